"""Who strikes the ball when, where and with which frame of which motion, and how it flies between (Ball handling,
section 4).

As in the paper, the natural flights of all frames of a ball stretch choose the strike (`pass_choice`), then the flight
between two strikes is solved exactly (`solved_flights`); strikes follow one another as the ball travels
(`strike_times`). Strikes are on whole frames of the output.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..ball.flight import Flight, Launch, simulate_flight
from ..ball.physics import Ball
from .pass_choice import choose_strikes
from .pass_cost import HIT_COST
from .pass_problem import ON_TARGET, Link, NaturalFlights, PassProblem, Site, simulate_flights
from .pass_scene import PassScene
from .player_path import HitOrder
from .solved_flights import SolvedFlights, estimate_ball_places, fit_flights
from .strike_times import Need, find_first_time, lengthen_flights

LAST_BALL_SPEEDS = {"received": (0.9, 0.4), "dropped": (1.1, 0.9)}
"""m/s ahead and up with which a ball goes on that was stopped, or that slipped off."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Strike:
    """One strike as it is played.

    Attributes:
        player: name.
        order: what the body has to do.
        velocity_in: (3,) m/s of the arriving ball.
        velocity_out: (3,) m/s of the leaving ball.
        spin: (3,) rad/s of the leaving ball.
        outcome: "struck", "received", "missed" or "dropped".
        bounces: of the flight that leaves.
        travel: s of the flight that leaves; 0 for the last strike.
        cost: m/s, how badly motion and flight fit; variety does not count.
        natural: the natural trajectories it was chosen from; None for the last strike.
    """

    player: str
    order: HitOrder
    velocity_in: np.ndarray
    velocity_out: np.ndarray
    spin: np.ndarray
    outcome: str
    bounces: int
    travel: float
    cost: float
    natural: NaturalFlights | None


@dataclass(frozen=True, eq=False, kw_only=True)
class PassPlan:
    """All strikes and flights of a scene.

    Attributes:
        strikes: in order of time.
        flights: to the first strike, from each strike to the next, and after the last one.
        seconds: length of the whole scene.
        fps: frames per second.
        warnings: what differs from the request.
    """

    strikes: tuple[Strike, ...]
    flights: tuple[Flight, ...]
    seconds: float
    fps: float
    warnings: tuple[str, ...]

    def list_orders(self, player: str) -> tuple[HitOrder, ...]:
        """List the strikes that one player has to do."""
        return tuple(one.order for one in self.strikes if one.player == player)

    def flight_at(self, times: np.ndarray) -> np.ndarray:
        """Find the flight that the ball is in at `times` (N,) s; at a strike the one that leaves.

        Returns:
            (N,) indices into `flights`.
        """
        starts = [one.launch.time for one in self.flights]
        return np.maximum(np.searchsorted(starts, np.asarray(times, float) + 1e-9, side="right") - 1, 0)


def plan_passes(scene: PassScene, sites: Sequence[Site], ball: Ball, need: Need,
                cancelled: Callable[[], bool] | None = None,
                progress: Callable[[float, str], None] | None = None) -> PassPlan:
    """Plan the chain of strikes and flights of a scene.

    Args:
        scene: the passing scene.
        sites: sites of every strike; the last one is where the last pass ends.
        ball: the ball.
        need: seconds that a player needs from one strike, or from standing, to the next.
        cancelled: whether to stop.
        progress: receives the share of the work done and a short text.
    Returns:
        The plan.
    Raises:
        InputError: if no human can send a ball that far, or over the net.
        UserCancelledError: if `cancelled` returns True.
    """
    report = progress or (lambda share, text: None)
    problem = PassProblem(scene, list(sites), ball, cancelled or (lambda: False))
    chain = choose_strikes(problem, lambda share, text: report(0.8 * share, text))
    places, normals = estimate_ball_places(problem, chain)
    orders = [_build_order(problem, chain, number, time=0.0, places=places, normals=normals)
              for number in range(len(chain))]
    first = find_first_time(problem, orders[0], need)
    chain, time_warnings = lengthen_flights(problem, chain, orders, places=places, first=first, need=need)
    report(0.9, "Flights")
    chain, flights = fit_flights(problem, chain, places, first)
    strikes = _build_strikes(problem, chain, flights, first)
    seconds = float(np.ceil((strikes[-1].order.time + scene.lead_out) * scene.fps - 1e-6) / scene.fps)
    warnings = (*time_warnings, *_list_misses(problem, flights), *_list_obstacles(problem, chain, flights))
    return PassPlan(strikes=strikes, flights=_simulate_all(problem, flights.serve, strikes, seconds), seconds=seconds,
                    fps=scene.fps, warnings=warnings)


def _build_order(problem: PassProblem, chain: Sequence[Link], number: int, time: float, places, normals) -> HitOrder:
    """Build the order for one strike."""
    link, site = chain[number], problem.sites[number]
    one = link.moment.hits[int(link.moment.which[0])]
    return HitOrder(time=time, clip=one.clip, hit=one.hit, strike_frame=float(link.moment.frame[0]),
                    place=tuple(map(float, site.place)), facing=link.facing, ball=tuple(map(float, places[number])),
                    normal=tuple(map(float, normals[number])), part=site.part, side=one.hit.side, tool=site.tool,
                    kind=site.kind, touches=number < problem.last or problem.passes[-1].error != "missed")


def _build_strikes(problem: PassProblem, chain: Sequence[Link], flights: SolvedFlights, first: float) -> tuple[Strike,
        ...]:
    """Build all strikes with their times on whole frames."""
    fps = problem.scene.fps
    times = np.round(np.cumsum([first, *(link.seconds for link in chain[:-1])]) * fps) / fps
    outcome = {"missed": "missed", "dropped": "dropped", "": "received"}[problem.passes[-1].error]
    contacts = (flights.places, flights.normals)
    orders = [_build_order(problem, chain, number, float(time), *contacts) for number, time in enumerate(times)]
    played = [
        Strike(player=site.player, order=order, velocity_in=arriving, velocity_out=leaving, spin=spin, outcome="struck",
               bounces=site.requested.bounces, travel=link.seconds, cost=link.cost, natural=link.natural)
        for site, order, arriving, leaving, spin, link in zip(
            problem.sites, orders, flights.arriving, flights.leaving, flights.spin, chain
        )
    ]
    # what happens to the ball after the last strike
    last_velocity = _find_last_velocity(outcome, chain[-1], flights.arriving[-1])
    last = Strike(player=problem.sites[-1].player, order=orders[-1], velocity_in=flights.arriving[-1],
                  velocity_out=last_velocity, spin=np.zeros(3), outcome=outcome, bounces=0, travel=0.0,
                  cost=chain[-1].cost, natural=None)
    return (*played, last)


def _find_last_velocity(outcome: str, link: Link, arriving: np.ndarray) -> np.ndarray:
    """Compute the velocity (3,) m/s with which the ball goes on from the last strike."""
    if outcome == "missed":
        return arriving
    ahead, up = LAST_BALL_SPEEDS[outcome]
    return np.array([ahead * np.cos(link.facing), ahead * np.sin(link.facing), up])


def _simulate_all(problem: PassProblem, serve: Launch, strikes: Sequence[Strike], seconds: float) -> tuple[Flight, ...]:
    """Simulate the flights to the first strike, between strikes, and after the last one until `seconds`."""
    flights = [simulate_flight(serve, problem.ball, strikes[0].order.time - serve.time)]
    sent = strikes[:-1] if strikes[-1].outcome == "missed" else strikes  # a missed ball flies on
    ends = [*(one.order.time for one in strikes[1 : len(sent)]), seconds]
    for one, end in zip(sent, ends):
        launch = Launch(one.order.time, np.array(one.order.ball), one.velocity_out, one.spin)
        flights.append(simulate_flight(launch, problem.ball, max(end - launch.time, 1.0 / problem.scene.fps)))
    return tuple(flights)


def _list_misses(problem: PassProblem, flown: SolvedFlights) -> list[str]:
    """List a warning for each flight that does not reach the next strike."""
    return [
        f"{problem.describe_pass(number)}: the ball misses the next strike by {100 * miss:.0f} cm"
        for number, miss in enumerate(flown.missed) if miss > ON_TARGET
    ]  # fmt: skip


def _list_obstacles(problem: PassProblem, chain: Sequence[Link], flown: SolvedFlights) -> list[str]:
    """List a warning for each ball that flies through a player or into the net."""
    out = []
    seconds = np.array([link.seconds for link in chain[:-1]])
    trajectories = simulate_flights(flown.places[:-1], flown.leaving, flown.spin, seconds, problem.ball)
    for number in range(problem.last):
        through = problem.compute_blocked_cost(number, trajectories[number : number + 1])[0]
        names = [name for (name, _), depth in zip(problem.others[number], through) if depth > HIT_COST]
        names += [] if problem.clears_net(trajectories[number : number + 1])[0] else ["the net"]
        out += [f"{problem.describe_pass(number)}: the ball flies through {name}" for name in names]
    return out
