"""Who strikes the ball when, where, with which frame of which motion, and how it flies between (Ball handling §4).

The paper lets the natural flights of all frames of a ball stretch choose the strike (`pass_choice`), and then solves
the flight between two strikes exactly (`pass_flights`); strikes follow one another as the ball travels.
They lie on whole frames of the output.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ball.flight import Flight, Launch, fly
from ..ball.physics import Ball
from .orders import HitOrder, Stance
from .pass_choice import choose
from .pass_costs import THROUGH, ways_of
from .pass_court import ON_TARGET, Court, Link, Natural, Site
from .pass_flights import Flown, fitted, laid
from .pass_scene import GROUND, PassScene

LIMP = {"received": (0.9, 0.4), "dropped": (1.1, 0.9)}
"""m/s ahead and up with which a ball goes that was stopped, or that slipped off."""


# When each strike is: a chain of travels, long enough for who strikes next (Fig. 5).


LONGER = 6
"""How many longer flights are tried at most where there is too little time."""

Need = Callable[[str, "HitOrder | Stance", HitOrder], float]
"""Seconds that a player needs from one strike, or from standing, to the next."""


def first_time(court: Court, order: HitOrder, need: Need) -> float:
    """Seconds, a whole frame: the first strike, when who makes it is ready and the serve has come."""
    site, fps = court.sites[0], court.scene.fps
    least = max(court.scene.lead_in, need(site.player, _standing(court, site.player), order))
    if court.scene.serve != GROUND:
        least = max(least, court.serving_seconds(np.array(order.ball)))
    return float(np.ceil(least * fps - 1e-6) / fps)


def in_time(
    court: Court, chain: list[Link], orders: Sequence[HitOrder], places: np.ndarray, first: float, need: Need
) -> tuple[list[Link], list[str]]:
    """The chain with flights long enough for who strikes next, and a line for everybody who still has too little
    time."""
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
            told.append(f"{site.player} has {have:.1f} s before the strike at {at:.2f} s, and needs {needed:.1f} s")
        last_of[site.player] = number
    return chain, told


def _standing(court: Court, name: str) -> Stance:
    return Stance(court.scene.player(name).place, court.scene.facing(name))


def _time(chain: Sequence[Link], before: int | None, number: int, first: float) -> float:
    """Seconds from one strike, or from the beginning, to another."""
    return sum(link.seconds for link in chain[before or 0 : number]) + (first if before is None else 0.0)


def _longer(court: Court, chain: list[Link], which: Iterable[int], lack: float, places: np.ndarray) -> list[Link]:
    """The chain with some flights longer, by the frame, as far as they can be; those whose seconds are asked stay."""
    fps = court.scene.fps
    free = [number for number in which if court.passes[number].seconds is None]
    chain = list(chain)
    for done, number in enumerate(free):
        frames = int(np.ceil(lack * fps / (len(free) - done) - 1e-6))
        if frames <= 0:
            break
        tried = chain[number].seconds + np.arange(frames, 0, -max(frames // LONGER, 1)) / fps
        aimed, good = court.flown(number, np.tile(places[number], (len(tried), 1)), places[number + 1], tried)
        if good.any():
            longer = int(np.argmax(good))
            lack -= tried[longer] - chain[number].seconds
            chain[number] = replace(chain[number], seconds=float(tried[longer]), velocity=aimed.velocity[longer])
    return chain


@dataclass(frozen=True, eq=False)
class Strike:
    """One strike as it is played. order: what the body has to do. velocity_in, velocity_out (3,) m/s of the ball; spin
    (3,) rad/s with which it leaves.
    outcome: struck, received, missed or dropped. bounces, travel s: of the flight that goes out (0 for the last).
    natural: the ways it was chosen from; None for the last."""

    player: str
    order: HitOrder
    velocity_in: np.ndarray
    velocity_out: np.ndarray
    spin: np.ndarray
    outcome: str
    bounces: int
    travel: float
    natural: Natural | None


@dataclass(frozen=True, eq=False)
class PassPlan:
    """strikes in order of time; flights: to the first strike, from each strike to the next, and from the last on;
    seconds: of the whole scene; fps; warnings."""

    strikes: tuple[Strike, ...]
    flights: tuple[Flight, ...]
    seconds: float
    fps: float
    warnings: tuple[str, ...]

    def orders(self, player: str) -> tuple[HitOrder, ...]:
        """What one player has to do."""
        return tuple(one.order for one in self.strikes if one.player == player)

    def flight_at(self, times: np.ndarray) -> np.ndarray:
        """(N,): which flight the ball is in at `times` (N,) s; at a strike the one that goes out."""
        starts = [one.launch.time for one in self.flights]
        return np.maximum(np.searchsorted(starts, np.asarray(times, float) + 1e-9, side="right") - 1, 0)


def plan_passes(
    scene: PassScene,
    sites: Sequence[Site],
    ball: Ball,
    need: Need,
    cancelled: Callable[[], bool] | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> PassPlan:
    """The chain of strikes and flights of a scene.

    sites: of every strike, the last one where the last pass ends. need: seconds that a player needs from one strike, or
    from standing, to the next. InputError where no human sends the ball so far, or over the net; Cancelled.
    """
    report = progress or (lambda share, text: None)
    court = Court(scene, list(sites), ball, cancelled or (lambda: False))
    chain = choose(court, lambda share, text: report(0.8 * share, text))
    places, normals = laid(court, chain)
    orders = [_order(court, chain, number, 0.0, places, normals) for number in range(len(chain))]
    first = first_time(court, orders[0], need)
    chain, hasty = in_time(court, chain, orders, places, first, need)
    report(0.9, "Flights")
    chain, flown = fitted(court, chain, places, first)
    strikes = _strikes(court, chain, flown, first)
    seconds = float(np.ceil((strikes[-1].order.time + scene.lead_out) * scene.fps - 1e-6) / scene.fps)
    told = (*hasty, *_misses(court, flown), *_ways(court, chain, flown))
    return PassPlan(strikes, _flights(court, flown.serve, strikes, seconds), seconds, scene.fps, told)


def _order(court: Court, chain: Sequence[Link], number: int, time: float, places, normals) -> HitOrder:
    link, site = chain[number], court.sites[number]
    one = link.moment.hits[int(link.moment.which[0])]
    return HitOrder(
        time=time, clip=one.clip, hit=one.hit, strike_frame=float(link.moment.frame[0]),
        place=tuple(map(float, site.place)), facing=link.facing, ball=tuple(map(float, places[number])),
        normal=tuple(map(float, normals[number])), part=site.part, side=one.hit.side, tool=site.tool, kind=site.kind,
        touches=number < court.last or court.passes[-1].error != "missed",
    )  # fmt: skip


def _strikes(court: Court, chain: Sequence[Link], flown: Flown, first: float) -> tuple[Strike, ...]:
    fps = court.scene.fps
    times = np.round(np.cumsum([first, *(link.seconds for link in chain[:-1])]) * fps) / fps
    outcome = {"missed": "missed", "dropped": "dropped", "": "received"}[court.passes[-1].error]
    met = (flown.places, flown.normals)
    orders = [_order(court, chain, number, float(time), *met) for number, time in enumerate(times)]
    struck = [
        Strike(site.player, order, arriving, leaving, spin, "struck", site.asked.bounces, link.seconds, link.natural)
        for site, order, arriving, leaving, spin, link in zip(
            court.sites, orders, flown.arriving, flown.leaving, flown.spin, chain
        )
    ]
    limp = _limp(outcome, chain[-1], flown.arriving[-1])
    last = Strike(court.sites[-1].player, orders[-1], flown.arriving[-1], limp, np.zeros(3), outcome, 0, 0.0, None)
    return (*struck, last)


def _limp(outcome: str, link: Link, arriving: np.ndarray) -> np.ndarray:
    """(3,) m/s: how the ball goes on from the last one."""
    if outcome == "missed":
        return arriving
    ahead, up = LIMP[outcome]
    return np.array([ahead * np.cos(link.facing), ahead * np.sin(link.facing), up])


def _flights(court: Court, serve: Launch, strikes: Sequence[Strike], seconds: float) -> tuple[Flight, ...]:
    """The flights to the first strike, between all, and from the last one on until `seconds`."""
    flights = [fly(serve, court.ball, strikes[0].order.time - serve.time)]
    sent = strikes[:-1] if strikes[-1].outcome == "missed" else strikes  # a ball that is missed flies on
    ends = [*(one.order.time for one in strikes[1 : len(sent)]), seconds]
    for one, end in zip(sent, ends):
        launch = Launch(one.order.time, np.array(one.order.ball), one.velocity_out, one.spin)
        flights.append(fly(launch, court.ball, max(end - launch.time, 1.0 / court.scene.fps)))
    return tuple(flights)


def _misses(court: Court, flown: Flown) -> list[str]:
    return [
        f"{court.name(number)}: the ball is {100 * miss:.0f} cm beside the next strike"
        for number, miss in enumerate(flown.missed) if miss > ON_TARGET
    ]  # fmt: skip


def _ways(court: Court, chain: Sequence[Link], flown: Flown) -> list[str]:
    """A line for every ball that flies through somebody, or into the net."""
    out = []
    seconds = np.array([link.seconds for link in chain[:-1]])
    ways = ways_of(flown.places[:-1], flown.leaving, flown.spin, seconds, court.ball)
    for number in range(court.last):
        through = court.in_the_way(number, ways[number : number + 1])[0]
        names = [name for (name, _), depth in zip(court.others[number], through) if depth > THROUGH]
        names += [] if court.clear(ways[number : number + 1])[0] else ["the net"]
        out += [f"{court.name(number)}: the ball flies through {name}" for name in names]
    return out
