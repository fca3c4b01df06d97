"""Who strikes the ball when, where and with which frame of which motion, and how it flies between (Ball handling,
section 4).

As in the paper, the natural flights of all frames of a ball stretch choose the strike (`pass_choice`), then the flight
between two strikes is solved exactly (Table 1, step 8); strikes follow one another as the ball travels. A ball touches
its part along the change of its velocity. That moves the ball a little, and with it the flights, so both are solved in
turns for some rounds. Strikes are on whole frames of the output.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ball.aim import solve_launches
from ..ball.flight import Flight, Launch, simulate_flight
from ..ball.physics import Ball
from ..base.vectors import unit_vectors
from .pass_choice import choose_strikes
from .pass_problem import (
    HIT_COST,
    LONGEST_SERVE,
    ON_TARGET,
    Link,
    NaturalFlights,
    PassProblem,
    Site,
    compute_arrivals,
    compute_spin,
    rotate_about_up,
    simulate_flights,
)
from .pass_scene import GROUND, PassScene
from .player_path import HitOrder, Stance

LAST_BALL_SPEEDS = {"received": (0.9, 0.4), "dropped": (1.1, 0.9)}
"""m/s ahead and up with which a ball goes on that was stopped, or that slipped off."""


# -- the time of each strike: a chain of flights that leave the next player enough time (Fig. 5)


MOST_LONGER = 6
"""Most longer flights that are tried where a player has too little time."""
Need = Callable[[str, "HitOrder | Stance", HitOrder], float]
"""Returns the seconds that a player needs from one strike, or from standing, to the next."""
MISS_DISTANCE = 0.45
"""Metres by which a missed ball passes the part."""
ROUNDS = 5  # rounds in which ball places and flights are solved in turns
LAUNCH_CHANGE = 3.0
"""m/s between two launches above which the ball takes a different trajectory, such as into the ground instead of up."""
FRAME_OFFSETS = np.array([1, -1, 2, -2, 3, -3, 5, -5, 8, -8, 12])
"""Frames that are added to a flight where the ball's places have moved."""


def find_first_time(problem: PassProblem, order: HitOrder, need: Need) -> float:
    """Compute the time of the first strike: when its player is ready and the serve has arrived.

    Args:
        problem: the scene with its sites.
        order: the first strike.
        need: seconds that a player needs.
    Returns:
        Seconds, a whole frame.
    """
    site, fps = problem.sites[0], problem.scene.fps
    least = max(problem.scene.lead_in, need(site.player, _build_stance(problem, site.player), order))
    if problem.scene.serve != GROUND:
        least = max(least, problem.find_serving_seconds(np.array(order.ball)))
    return float(np.ceil(least * fps - 1e-6) / fps)


def lengthen_flights(problem: PassProblem, chain: list[Link], orders: Sequence[HitOrder], places: np.ndarray,
                     first: float, need: Need) -> tuple[list[Link], list[str]]:
    """Lengthen flights until every player has enough time for their strikes.

    Args:
        problem: the scene with its sites.
        chain: the strikes.
        orders: their orders.
        places: (K, 3) m, the ball at each strike.
        first: s of the first strike.
        need: seconds that a player needs.
    Returns:
        chain: the strikes with their new travel times.
        warnings: one line for each player who still has too little time.
    """
    warnings: list[str] = []
    last_of: dict[str, int] = {}
    for number, site in enumerate(problem.sites):
        before = last_of.get(site.player)
        start = _build_stance(problem, site.player) if before is None else orders[before]
        needed = need(site.player, start, orders[number])
        missing = needed - _time_between(chain, before, number, first)
        if missing > 1e-6 and number:
            chain = _lengthen_chain(problem, chain, range(before or 0, number), missing, places)
        have = _time_between(chain, before, number, first)
        if needed - have > 0.5 / problem.scene.fps:
            at = _time_between(chain, None, number, first)
            warnings.append(f"{site.player} has {have:.1f} s before the strike at {at:.2f} s, but needs {needed:.1f} s")
        last_of[site.player] = number
    return chain, warnings


def _build_stance(problem: PassProblem, name: str) -> Stance:
    """Build the stance in which a player begins."""
    return Stance(problem.scene.find_player(name).place, problem.scene.find_facing(name))


def _time_between(chain: Sequence[Link], before: int | None, number: int, first: float) -> float:
    """Compute the seconds from one strike, or from the beginning, to another."""
    return sum(link.seconds for link in chain[before or 0 : number]) + (first if before is None else 0.0)


def _lengthen_chain(problem: PassProblem, chain: list[Link], which: Iterable[int], missing: float,
                    places: np.ndarray) -> list[Link]:
    """Lengthen flights by whole frames where possible; passes with a requested time stay as they are.

    Args:
        which: indices of the flights that may be longer.
        missing: seconds that are missing.
        places: (K, 3) m, the ball at each strike.
    """
    fps = problem.scene.fps
    adjustable = [number for number in which if problem.passes[number].seconds is None]
    chain = list(chain)
    for done, number in enumerate(adjustable):
        # the missing time, shared evenly by the flights that are left
        frames = int(np.ceil(missing * fps / (len(adjustable) - done) - 1e-6))
        if frames <= 0:
            break
        # longest first, so that the first possible one takes the largest share of the missing time
        tried = chain[number].seconds + np.arange(frames, 0, -max(frames // MOST_LONGER, 1)) / fps
        aimed, good = problem.solve_launches(number, np.tile(places[number], (len(tried), 1)), places[number + 1],
                                             tried)
        if good.any():
            longer = int(np.argmax(good))
            missing -= tried[longer] - chain[number].seconds
            chain[number] = replace(chain[number], seconds=float(tried[longer]), velocity=aimed.velocity[longer])
    return chain


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


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedFlights:
    """Flights of K strikes.

    Attributes:
        serve: launch of the ball before the first strike.
        places: (K, 3) m, the ball at each strike.
        normals: (K, 3) unit vectors from part to ball.
        arriving: (K, 3) m/s of the balls.
        leaving: (K-1, 3) m/s of the balls.
        spin: (K-1, 3) rad/s of the leaving balls.
        missed: (K-1,) m by which each flight misses the next strike.
    """

    serve: Launch
    places: np.ndarray
    normals: np.ndarray
    arriving: np.ndarray
    leaving: np.ndarray
    spin: np.ndarray
    missed: np.ndarray


def estimate_ball_places(problem: PassProblem, chain: Sequence[Link]) -> tuple[np.ndarray, np.ndarray]:
    """Compute places (K, 3) m and normals (K, 3) of the balls if each part pushes its ball in the direction of its
    movement.
    """
    part_velocities = np.array([rotate_about_up(link.moment.part_states.velocity, link.facing)[0] for link in chain])
    return _place_balls(problem, chain, unit_vectors(part_velocities))


def fit_flights(problem: PassProblem, chain: list[Link], places: np.ndarray, first: float) -> tuple[list[Link],
        SolvedFlights]:
    """Solve flights and ball places together; some flights may become some frames longer or shorter.

    Args:
        problem: the scene with its sites.
        chain: the K strikes.
        places: (K, 3) m, first estimate of the balls' places.
        first: s of the first strike.
    Returns:
        chain: the strikes with their new travel times.
        flown: their flights.
    """
    serve_seconds = 0.0 if problem.scene.serve == GROUND else min(first, LONGEST_SERVE)  # it starts as the scene begins
    # ball places follow from flights, flights from places; this converges in a few rounds
    for _ in range(ROUNDS):
        leaving, spin, missed = _solve_between(problem, chain, places)
        _, arriving = _compute_arriving(problem, chain, places, serve_times=(first, serve_seconds), leaving=leaving,
                                        spin=spin)
        places, _ = _place_balls(problem, chain, unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving))
        chain = _adjust_flights(problem, chain, places, missed)
    leaving, spin, missed = _solve_between(problem, chain, places, last=True)
    serve, arriving = _compute_arriving(problem, chain, places, serve_times=(first, serve_seconds), leaving=leaving,
                                        spin=spin)
    normals = unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving)
    return chain, SolvedFlights(serve=serve, places=places, normals=normals, arriving=arriving, leaving=leaving,
                                spin=spin, missed=missed)


def _place_balls(problem: PassProblem, chain: Sequence[Link], normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the balls' places (K, 3) m on their parts toward `normals` (K, 3); both are returned."""
    each = enumerate(zip(chain, normals))
    return np.array([problem.place_ball(number, link, normal) for number, (link, normal) in each]), normals


def _solve_between(problem: PassProblem, chain, places, last: bool = False) -> tuple[np.ndarray, np.ndarray,
        np.ndarray]:
    """Solve the flights between strikes.

    A ball that only a very different flight would bring to the next strike takes that flight in the `last` round only;
    before, it counts as a miss.

    Returns:
        velocities: (K-1, 3) m/s with which the balls leave.
        spin: (K-1, 3) rad/s.
        missed: (K-1,) m by which they miss the next strike.
    """
    targets = np.array([_find_target(problem, number, places, chain) for number in range(problem.last)])
    seconds, spin = np.array([link.seconds for link in chain[:-1]]), _compute_spins(problem, chain, places, targets)
    bounces = np.array([one.bounces for one in problem.passes])
    velocities, missed = np.empty((problem.last, 3)), np.empty(problem.last)
    for count in np.unique(bounces):
        same = np.flatnonzero(bounces == count)
        near = np.array([chain[number].velocity for number in same])
        aimed = solve_launches(places[same], targets[same], problem.ball, seconds=seconds[same], bounces=int(count),
                               spin=spin[same], initial_velocity=near)
        # a jump of the launch velocity means another trajectory: keep the old one until the last round
        other = (np.linalg.norm(aimed.velocity - near, axis=1) > LAUNCH_CHANGE) & (not last)
        velocities[same] = np.where(other[:, None], near, aimed.velocity)
        missed[same] = np.where(other, np.inf, aimed.miss)
    return velocities, spin, missed


def _compute_spins(problem: PassProblem, chain, places, targets) -> np.ndarray:
    """Compute the spins (K-1, 3) rad/s with which the balls leave."""
    each = zip(places[:-1], targets, chain, problem.sites)
    return np.array([compute_spin(a[None], b, np.array([link.seconds]), problem.ball, site.kind)[0] for a, b, link,
                     site in each])


def _find_target(problem: PassProblem, number: int, places: np.ndarray, chain: Sequence[Link]) -> np.ndarray:
    """Compute the target (3,) m of a pass: the next strike, or a point past it if the ball is missed."""
    place, site = places[number + 1], problem.sites[number + 1]
    if problem.passes[number].error != "missed":
        return place
    if site.part in ("head", "chest"):
        return place + [0.0, 0.0, MISS_DISTANCE]
    facing = chain[number + 1].facing
    beside = np.array([-np.sin(facing), np.cos(facing), 0.0])
    side = np.sign((place[:2] - site.place) @ beside[:2]) or 1.0
    return place + side * MISS_DISTANCE * beside


def _compute_arriving(problem: PassProblem, chain, places, serve_times: tuple[float, float], leaving,
                      spin) -> tuple[Launch, np.ndarray]:
    """Compute the serve and the velocities (K, 3) m/s with which all balls arrive.

    Args:
        serve_times: s of the first strike, and for how many s the ball has flown by then.
    """
    serve, served = _solve_serve(problem, places[0], *serve_times)
    seconds = np.array([link.seconds for link in chain[:-1]])
    return serve, np.concatenate([served[None], compute_arrivals(places[:-1], leaving, spin, seconds, problem.ball)])


def _solve_serve(problem: PassProblem, place: np.ndarray, first: float, seconds: float) -> tuple[Launch, np.ndarray]:
    """Compute the launch `seconds` before the first strike at `first` s, and the ball's velocity (3,) m/s there."""
    if problem.scene.serve == GROUND:
        return Launch(0.0, place, np.zeros(3)), np.zeros(3)
    start = problem.find_serving_place(place)
    aimed = solve_launches(start[None], place[None], problem.ball, np.array([seconds]), 0)
    launch = Launch(first - seconds, start, aimed.velocity[0])
    return launch, compute_arrivals(start[None], aimed.velocity, None, np.array([seconds]), problem.ball)[0]


def _adjust_flights(problem: PassProblem, chain: list[Link], places: np.ndarray, missed: np.ndarray) -> list[Link]:
    """Change flights that miss by some frames, where they then reach the next strike."""
    chain, fps = list(chain), problem.scene.fps
    for number in np.flatnonzero(missed > ON_TARGET):
        frames = round(chain[number].seconds * fps) + FRAME_OFFSETS
        frames = frames[frames > 2]
        starts = np.tile(places[number], (len(frames), 1))
        aimed, good = problem.solve_launches(number, starts, _find_target(problem, number, places, chain), frames / fps)
        if good.any() and problem.passes[number].seconds is None:
            other = np.linalg.norm(aimed.velocity - chain[number].velocity, axis=1)
            best = int(np.argmin(np.where(good, other, np.inf)))
            chain[number] = replace(chain[number], seconds=float(frames[best] / fps), velocity=aimed.velocity[best])
    return chain
