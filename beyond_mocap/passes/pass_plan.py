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

from ..ball.aim import aim
from ..ball.flight import Flight, Launch, fly
from ..ball.physics import Ball
from ..base.vectors import unit_vectors
from .pass_choice import choose
from .pass_court import LONGEST_SERVE, ON_TARGET, THROUGH, Court, Link, Natural, Site, arrivals, spun, turned, ways_of
from .pass_scene import GROUND, PassScene
from .way import HitOrder, Stance

LIMP = {"received": (0.9, 0.4), "dropped": (1.1, 0.9)}
"""m/s ahead and up with which a ball goes on that was stopped, or that slipped off."""


# -- the time of each strike: a chain of flights that leave the next player enough time (Fig. 5)


LONGER = 6
"""Most longer flights that are tried where a player has too little time."""
Need = Callable[[str, "HitOrder | Stance", HitOrder], float]
"""Returns the seconds that a player needs from one strike, or from standing, to the next."""
BESIDE = 0.45
"""Metres by which a missed ball passes the part."""
ROUNDS = 5  # rounds in which ball places and flights are solved in turns
LEAP = 3.0
"""m/s between two launches above which the ball takes a different trajectory, such as into the ground instead of up."""
NEARBY = np.array([1, -1, 2, -2, 3, -3, 5, -5, 8, -8, 12])
"""Frames that are added to a flight where the ball's places have moved."""


def first_time(court: Court, order: HitOrder, need: Need) -> float:
    """Compute the time of the first strike: when its player is ready and the serve has arrived.

    Args:
        problem: the scene with its sites.
        order: the first strike.
        need: seconds that a player needs.
    Returns:
        Seconds, a whole frame.
    """
    site, fps = court.sites[0], court.scene.fps
    least = max(court.scene.lead_in, need(site.player, _standing(court, site.player), order))
    if court.scene.serve != GROUND:
        least = max(least, court.serving_seconds(np.array(order.ball)))
    return float(np.ceil(least * fps - 1e-6) / fps)


def in_time(court: Court, chain: list[Link], orders: Sequence[HitOrder], places: np.ndarray, first: float,
            need: Need) -> tuple[list[Link], list[str]]:
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
    told: list[str] = []
    last_of: dict[str, int] = {}
    for number, site in enumerate(court.sites):
        before = last_of.get(site.player)
        start = _standing(court, site.player) if before is None else orders[before]
        needed = need(site.player, start, orders[number])
        lack = needed - _time(chain, before, number, first)
        if lack > 1e-6 and number:
            chain = _longer(court, chain, range(before or 0, number), lack, places)
        have = _time(chain, before, number, first)
        if needed - have > 0.5 / court.scene.fps:
            at = _time(chain, None, number, first)
            told.append(f"{site.player} has {have:.1f} s before the strike at {at:.2f} s, but needs {needed:.1f} s")
        last_of[site.player] = number
    return chain, told


def _standing(court: Court, name: str) -> Stance:
    """Build the stance in which a player begins."""
    return Stance(court.scene.player(name).place, court.scene.facing(name))


def _time(chain: Sequence[Link], before: int | None, number: int, first: float) -> float:
    """Compute the seconds from one strike, or from the beginning, to another."""
    return sum(link.seconds for link in chain[before or 0 : number]) + (first if before is None else 0.0)


def _longer(court: Court, chain: list[Link], which: Iterable[int], lack: float, places: np.ndarray) -> list[Link]:
    """Lengthen flights by whole frames where possible; passes with a requested time stay as they are.

    Args:
        which: indices of the flights that may be longer.
        missing: seconds that are missing.
        places: (K, 3) m, the ball at each strike.
    """
    fps = court.scene.fps
    free = [number for number in which if court.passes[number].seconds is None]
    chain = list(chain)
    for done, number in enumerate(free):
        # the missing time, shared evenly by the flights that are left
        frames = int(np.ceil(lack * fps / (len(free) - done) - 1e-6))
        if frames <= 0:
            break
        # longest first, so that the first possible one takes the largest share of the missing time
        tried = chain[number].seconds + np.arange(frames, 0, -max(frames // LONGER, 1)) / fps
        aimed, good = court.flown(number, np.tile(places[number], (len(tried), 1)), places[number + 1], tried)
        if good.any():
            longer = int(np.argmax(good))
            lack -= tried[longer] - chain[number].seconds
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
    natural: Natural | None


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

    def orders(self, player: str) -> tuple[HitOrder, ...]:
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
        Cancelled: if `cancelled` returns True.
    """
    report = progress or (lambda share, text: None)
    court = Court(scene, list(sites), ball, cancelled or (lambda: False))
    chain = choose(court, lambda share, text: report(0.8 * share, text))
    places, normals = laid(court, chain)
    orders = [_order(court, chain, number, time=0.0, places=places, normals=normals) for number in range(len(chain))]
    first = first_time(court, orders[0], need)
    chain, hasty = in_time(court, chain, orders, places=places, first=first, need=need)
    report(0.9, "Flights")
    chain, flown = fitted(court, chain, places, first)
    strikes = _strikes(court, chain, flown, first)
    seconds = float(np.ceil((strikes[-1].order.time + scene.lead_out) * scene.fps - 1e-6) / scene.fps)
    told = (*hasty, *_misses(court, flown), *_ways(court, chain, flown))
    return PassPlan(strikes=strikes, flights=_flights(court, flown.serve, strikes, seconds), seconds=seconds,
                    fps=scene.fps, warnings=told)


def _order(court: Court, chain: Sequence[Link], number: int, time: float, places, normals) -> HitOrder:
    """Build the order for one strike."""
    link, site = chain[number], court.sites[number]
    one = link.moment.hits[int(link.moment.which[0])]
    return HitOrder(time=time, clip=one.clip, hit=one.hit, strike_frame=float(link.moment.frame[0]),
                    place=tuple(map(float, site.place)), facing=link.facing, ball=tuple(map(float, places[number])),
                    normal=tuple(map(float, normals[number])), part=site.part, side=one.hit.side, tool=site.tool,
                    kind=site.kind, touches=number < court.last or court.passes[-1].error != "missed")


def _strikes(court: Court, chain: Sequence[Link], flown: Flown, first: float) -> tuple[Strike, ...]:
    """Build all strikes with their times on whole frames."""
    fps = court.scene.fps
    times = np.round(np.cumsum([first, *(link.seconds for link in chain[:-1])]) * fps) / fps
    outcome = {"missed": "missed", "dropped": "dropped", "": "received"}[court.passes[-1].error]
    met = (flown.places, flown.normals)
    orders = [_order(court, chain, number, float(time), *met) for number, time in enumerate(times)]
    struck = [
        Strike(player=site.player, order=order, velocity_in=arriving, velocity_out=leaving, spin=spin, outcome="struck",
               bounces=site.asked.bounces, travel=link.seconds, natural=link.natural)
        for site, order, arriving, leaving, spin, link in zip(
            court.sites, orders, flown.arriving, flown.leaving, flown.spin, chain
        )
    ]
    # what happens to the ball after the last strike
    limp = _limp(outcome, chain[-1], flown.arriving[-1])
    last = Strike(player=court.sites[-1].player, order=orders[-1], velocity_in=flown.arriving[-1], velocity_out=limp,
                  spin=np.zeros(3), outcome=outcome, bounces=0, travel=0.0, natural=None)
    return (*struck, last)


def _limp(outcome: str, link: Link, arriving: np.ndarray) -> np.ndarray:
    """Compute the velocity (3,) m/s with which the ball goes on from the last strike."""
    if outcome == "missed":
        return arriving
    ahead, up = LIMP[outcome]
    return np.array([ahead * np.cos(link.facing), ahead * np.sin(link.facing), up])


def _flights(court: Court, serve: Launch, strikes: Sequence[Strike], seconds: float) -> tuple[Flight, ...]:
    """Simulate the flights to the first strike, between strikes, and after the last one until `seconds`."""
    flights = [fly(serve, court.ball, strikes[0].order.time - serve.time)]
    sent = strikes[:-1] if strikes[-1].outcome == "missed" else strikes  # a missed ball flies on
    ends = [*(one.order.time for one in strikes[1 : len(sent)]), seconds]
    for one, end in zip(sent, ends):
        launch = Launch(one.order.time, np.array(one.order.ball), one.velocity_out, one.spin)
        flights.append(fly(launch, court.ball, max(end - launch.time, 1.0 / court.scene.fps)))
    return tuple(flights)


def _misses(court: Court, flown: Flown) -> list[str]:
    """List a warning for each flight that does not reach the next strike."""
    return [
        f"{court.name(number)}: the ball passes the next strike at {100 * miss:.0f} cm"
        for number, miss in enumerate(flown.missed) if miss > ON_TARGET
    ]  # fmt: skip


def _ways(court: Court, chain: Sequence[Link], flown: Flown) -> list[str]:
    """List a warning for each ball that flies through a player or into the net."""
    out = []
    seconds = np.array([link.seconds for link in chain[:-1]])
    ways = ways_of(flown.places[:-1], flown.leaving, flown.spin, seconds, court.ball)
    for number in range(court.last):
        through = court.in_the_way(number, ways[number : number + 1])[0]
        names = [name for (name, _), depth in zip(court.others[number], through) if depth > THROUGH]
        names += [] if court.clear(ways[number : number + 1])[0] else ["the net"]
        out += [f"{court.name(number)}: the ball flies through {name}" for name in names]
    return out


@dataclass(frozen=True, eq=False, kw_only=True)
class Flown:
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


def laid(court: Court, chain: Sequence[Link]) -> tuple[np.ndarray, np.ndarray]:
    """Compute places (K, 3) m and normals (K, 3) of the balls if each part pushes its ball in the direction of its
    movement.
    """
    ways = np.array([turned(link.moment.struck.velocity, link.facing)[0] for link in chain])
    return _laid(court, chain, unit_vectors(ways))


def fitted(court: Court, chain: list[Link], places: np.ndarray, first: float) -> tuple[list[Link], Flown]:
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
    serving = 0.0 if court.scene.serve == GROUND else min(first, LONGEST_SERVE)  # it starts as the scene begins
    # ball places follow from flights, flights from places; this converges in a few rounds
    for _ in range(ROUNDS):
        leaving, spin, missed = _between(court, chain, places)
        _, arriving = _arriving(court, chain, places, begun=(first, serving), leaving=leaving, spin=spin)
        places, _ = _laid(court, chain, unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving))
        chain = _within_reach(court, chain, places, missed)
    leaving, spin, missed = _between(court, chain, places, last=True)
    serve, arriving = _arriving(court, chain, places, begun=(first, serving), leaving=leaving, spin=spin)
    normals = unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving)
    return chain, Flown(serve=serve, places=places, normals=normals, arriving=arriving, leaving=leaving, spin=spin,
                        missed=missed)


def _laid(court: Court, chain: Sequence[Link], normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the balls' places (K, 3) m on their parts toward `normals` (K, 3); both are returned."""
    each = enumerate(zip(chain, normals))
    return np.array([court.ball_on(number, link, normal) for number, (link, normal) in each]), normals


def _between(court: Court, chain, places, last: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve the flights between strikes.

    A ball that only a very different flight would bring to the next strike takes that flight in the `last` round only;
    before, it counts as a miss.

    Returns:
        velocities: (K-1, 3) m/s with which the balls leave.
        spin: (K-1, 3) rad/s.
        missed: (K-1,) m by which they miss the next strike.
    """
    targets = np.array([_target(court, number, places, chain) for number in range(court.last)])
    seconds, spin = np.array([link.seconds for link in chain[:-1]]), _spins(court, chain, places, targets)
    bounces = np.array([one.bounces for one in court.passes])
    velocities, missed = np.empty((court.last, 3)), np.empty(court.last)
    for count in np.unique(bounces):
        same = np.flatnonzero(bounces == count)
        near = np.array([chain[number].velocity for number in same])
        aimed = aim(places[same], targets[same], court.ball, seconds=seconds[same], bounces=int(count), spin=spin[same],
                    near=near)
        # a jump of the launch velocity means another trajectory: keep the old one until the last round
        other = (np.linalg.norm(aimed.velocity - near, axis=1) > LEAP) & (not last)
        velocities[same] = np.where(other[:, None], near, aimed.velocity)
        missed[same] = np.where(other, np.inf, aimed.miss)
    return velocities, spin, missed


def _spins(court: Court, chain, places, targets) -> np.ndarray:
    """Compute the spins (K-1, 3) rad/s with which the balls leave."""
    each = zip(places[:-1], targets, chain, court.sites)
    return np.array([spun(a[None], b, np.array([link.seconds]), court.ball, site.kind)[0] for a, b, link, site in each])


def _target(court: Court, number: int, places: np.ndarray, chain: Sequence[Link]) -> np.ndarray:
    """Compute the target (3,) m of a pass: the next strike, or a point past it if the ball is missed."""
    place, site = places[number + 1], court.sites[number + 1]
    if court.passes[number].error != "missed":
        return place
    if site.part in ("head", "chest"):
        return place + [0.0, 0.0, BESIDE]
    facing = chain[number + 1].facing
    beside = np.array([-np.sin(facing), np.cos(facing), 0.0])
    side = np.sign((place[:2] - site.place) @ beside[:2]) or 1.0
    return place + side * BESIDE * beside


def _arriving(court: Court, chain, places, begun: tuple[float, float], leaving, spin) -> tuple[Launch, np.ndarray]:
    """Compute the serve and the velocities (K, 3) m/s with which all balls arrive.

    Args:
        serve_times: s of the first strike, and for how many s the ball has flown by then.
    """
    serve, served = _served(court, places[0], *begun)
    seconds = np.array([link.seconds for link in chain[:-1]])
    return serve, np.concatenate([served[None], arrivals(places[:-1], leaving, spin, seconds, court.ball)])


def _served(court: Court, place: np.ndarray, first: float, seconds: float) -> tuple[Launch, np.ndarray]:
    """Compute the launch `seconds` before the first strike at `first` s, and the ball's velocity (3,) m/s there."""
    if court.scene.serve == GROUND:
        return Launch(0.0, place, np.zeros(3)), np.zeros(3)
    start = court.serving_place(place)
    aimed = aim(start[None], place[None], court.ball, np.array([seconds]), 0)
    launch = Launch(first - seconds, start, aimed.velocity[0])
    return launch, arrivals(start[None], aimed.velocity, None, np.array([seconds]), court.ball)[0]


def _within_reach(court: Court, chain: list[Link], places: np.ndarray, missed: np.ndarray) -> list[Link]:
    """Change flights that miss by some frames, where they then reach the next strike."""
    chain, fps = list(chain), court.scene.fps
    for number in np.flatnonzero(missed > ON_TARGET):
        frames = round(chain[number].seconds * fps) + NEARBY
        frames = frames[frames > 2]
        starts = np.tile(places[number], (len(frames), 1))
        aimed, good = court.flown(number, starts, _target(court, number, places, chain), frames / fps)
        if good.any() and court.passes[number].seconds is None:
            other = np.linalg.norm(aimed.velocity - chain[number].velocity, axis=1)
            best = int(np.argmin(np.where(good, other, np.inf)))
            chain[number] = replace(chain[number], seconds=float(frames[best] / fps), velocity=aimed.velocity[best])
    return chain
