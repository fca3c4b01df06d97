"""The exact flights between chosen strikes, and where each ball meets its part (Table 1, step 8).

A ball lies on its part along the change of its velocity; that moves it a little, and with it the flights: after some
rounds both fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ball.aim import aim
from ..ball.flight import Launch
from ..base.vectors import unit_vectors
from .pass_costs import arrivals, spun
from .pass_court import LONGEST_SERVE, ON_TARGET, Court, Link, turned
from .pass_scene import GROUND

BESIDE = 0.45
"""Metres by which a missed ball goes past the part."""

ROUNDS = 5
LEAP = 3.0
"""m/s between two launches above which the ball takes quite another way, such as into the ground instead of up."""

NEARBY = np.array([1, -1, 2, -2, 3, -3, 5, -5, 8, -8, 12])
"""Frames by which a flight may be longer or shorter than was best, where places have moved."""


@dataclass(frozen=True, eq=False)
class Flown:
    """The flights of K strikes. serve: the ball's launch before the first. places, normals (K, 3): the ball's at each
    strike, m, and the way from part to ball. arriving (K, 3), leaving (K-1, 3) m/s and spin (K-1, 3) rad/s of the
    balls; missed (K-1,): by how many metres each passes the next strike."""

    serve: Launch
    places: np.ndarray
    normals: np.ndarray
    arriving: np.ndarray
    leaving: np.ndarray
    spin: np.ndarray
    missed: np.ndarray


def laid(court: Court, chain: Sequence[Link]) -> tuple[np.ndarray, np.ndarray]:
    """Places m and normals (K, 3) of the balls as if each part pushed its ball the way that it moves."""
    ways = np.array([turned(link.moment.struck.velocity, link.facing)[0] for link in chain])
    return _laid(court, chain, unit_vectors(ways))


def fitted(court: Court, chain: list[Link], places: np.ndarray, first: float) -> tuple[list[Link], Flown]:
    """The chain, some of whose flights may be some frames longer or shorter, and its flights. places (K, 3) m: the
    balls' at first; first: s of the first strike."""
    serving = 0.0 if court.scene.serve == GROUND else min(first, LONGEST_SERVE)  # it sets out as the scene begins
    for _ in range(ROUNDS):
        leaving, spin, missed = _between(court, chain, places)
        _, arriving = _arriving(court, chain, places, (first, serving), leaving, spin)
        places, _ = _laid(court, chain, unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving))
        chain = _within_reach(court, chain, places, missed)
    leaving, spin, missed = _between(court, chain, places, last=True)
    serve, arriving = _arriving(court, chain, places, (first, serving), leaving, spin)
    normals = unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving)
    return chain, Flown(serve, places, normals, arriving, leaving, spin, missed)


def _laid(court: Court, chain: Sequence[Link], normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    each = enumerate(zip(chain, normals))
    return np.array([court.ball_on(number, link, normal) for number, (link, normal) in each]), normals


def _between(court: Court, chain, places, last: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocities and spins (K-1, 3) with which the balls leave, and by how many m (K-1,) they miss the next strike. One
    that only quite another flight would bring there is taken so at the `last` only; before, it is told to miss."""
    targets = np.array([_target(court, number, places, chain) for number in range(court.last)])
    seconds, spin = np.array([link.seconds for link in chain[:-1]]), _spins(court, chain, places, targets)
    bounces = np.array([one.bounces for one in court.passes])
    velocities, missed = np.empty((court.last, 3)), np.empty(court.last)
    for count in np.unique(bounces):
        same = np.flatnonzero(bounces == count)
        near = np.array([chain[number].velocity for number in same])
        aimed = aim(places[same], targets[same], court.ball, seconds[same], int(count), spin[same], near=near)
        other = (np.linalg.norm(aimed.velocity - near, axis=1) > LEAP) & (not last)
        velocities[same] = np.where(other[:, None], near, aimed.velocity)
        missed[same] = np.where(other, np.inf, aimed.miss)
    return velocities, spin, missed


def _spins(court: Court, chain, places, targets) -> np.ndarray:
    """(K-1, 3) rad/s with which the balls leave."""
    each = zip(places[:-1], targets, chain, court.sites)
    return np.array([spun(a[None], b, np.array([link.seconds]), court.ball, site.kind)[0] for a, b, link, site in each])


def _target(court: Court, number: int, places: np.ndarray, chain: Sequence[Link]) -> np.ndarray:
    """(3,) m: where the ball of a pass goes: to the next strike, or past it where it is missed."""
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
    """The serve, and the velocities (K, 3) m/s with which all balls come to their strikes. begun: s of the first
    strike, and for how many the ball has flown by then."""
    serve, served = _served(court, places[0], *begun)
    seconds = np.array([link.seconds for link in chain[:-1]])
    return serve, np.concatenate([served[None], arrivals(places[:-1], leaving, spin, seconds, court.ball)])


def _served(court: Court, place: np.ndarray, first: float, seconds: float) -> tuple[Launch, np.ndarray]:
    """The ball's launch `seconds` before the first strike at `first` s, and its velocity (3,) m/s there."""
    if court.scene.serve == GROUND:
        return Launch(0.0, place, np.zeros(3)), np.zeros(3)
    start = court.serving_place(place)
    aimed = aim(start[None], place[None], court.ball, np.array([seconds]), 0)
    launch = Launch(first - seconds, start, aimed.velocity[0])
    return launch, arrivals(start[None], aimed.velocity, None, np.array([seconds]), court.ball)[0]


def _within_reach(court: Court, chain: list[Link], places: np.ndarray, missed: np.ndarray) -> list[Link]:
    """The chain with flights that miss some frames longer or shorter, where they then do not."""
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
