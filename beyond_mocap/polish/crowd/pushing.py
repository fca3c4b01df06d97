"""Bodies that are in each other pushed apart: arms turned away, roots and feet shifted, all as smooth curves.

Each body has twelve curves (`correction`): its root's shift over the ground, its feet's, and the turns of its arms
about their shoulders. Round after round the contacts are looked for where the bodies are by now, and every body takes
its share of each: with n the direction away from the other, a point that is down its leg by a share f moves by
(1 - f) root + f foot, a point on an arm by turn x arm. What is least is, for the root and the feet together and for
each arm by itself, one banded system (`banded_squares`): the squares of what lacks at each contact, of the curves and
of their third differences, of a foot's distance from its hip's shift, and of its speed while it stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...motion import quaternion
from .banded_squares import BandedSquares
from .capsules import Capsule, Touching, touching
from .correction import ARMS, FEET, ROOT

ALLOWED = 0.005
"""Metres of overlap that are left as they are."""

STAY, SECONDS = 0.003, 0.3
"""Weight of the root's shift, and seconds in which it comes and goes."""

FOOT_NEAR, FOOT_STANDS, FOOT_SECONDS = 0.01, 300.0, 0.12
"""Weights of a foot's shift against its root's and of its speed while it stands (per frame at 30 per second); seconds
in which it comes and goes."""

ARM_STAY, ARM_SECONDS, MOST_TURN = 5e-4, 0.15, 1.1
"""Weight of an arm's turn, seconds in which it comes and goes, and radians that it turns at most."""

OUTWARD = 1.0
"""How much the way between two trunks counts against the shortest way out of a contact."""

_ROUNDS, _ARMS_ALONE = 16, 4
_STEP = 0.5
_FIRMER = 1.1
_SHORT_ARM = 0.08  # m from the shoulder's axis below which turning an arm brings nothing away
_UPRIGHT = 0.35  # least share of a push that goes over the ground
_HELD = 1e6
_BASE = 30.0  # frames per second for which the weights are


@dataclass(frozen=True, eq=False)
class CrowdBody:
    """One body over T common frames. parts: its C capsules; lines (T, C, 2, 3) m, NaN where it is not there; bent (T,
    C, 2, 3) m: how far from where its curves alone bring them limbs have come by being bent for earlier curves; stands
    (T, 2) bool, left and right foot; firm (T,): how firmly it keeps its way against others."""

    parts: tuple[Capsule, ...]
    lines: np.ndarray
    bent: np.ndarray
    stands: np.ndarray
    firm: np.ndarray

    @property
    def radii(self) -> np.ndarray:
        """(C,) m."""
        return np.array([part.radius for part in self.parts])

    @property
    def there(self) -> tuple[int, int]:
        """First frame and end of where it is there."""
        known = np.flatnonzero(np.isfinite(self.lines[:, 0, 0, 0]))
        return (int(known[0]), int(known[-1]) + 1) if len(known) else (0, 0)

    def frames(self, low: int, high: int) -> CrowdBody:
        """Frames low .. high of it."""
        rows = (values[low:high] for values in (self.lines, self.bent, self.stands, self.firm))
        return CrowdBody(self.parts, *rows)


@dataclass(frozen=True, eq=False)
class Contact:
    """What one body has of its contacts (K,): frame, part, place (K, 3) m, away (K, 3) unit from the other, give (K,)
    m that it should give way by, its share of the overlap; arm (K,) m that its arm should, where the part is one."""

    frame: np.ndarray
    part: np.ndarray
    at: np.ndarray
    place: np.ndarray
    away: np.ndarray
    give: np.ndarray
    arm: np.ndarray


def moved(body: CrowdBody, curves: np.ndarray) -> np.ndarray:
    """(T, C, 2, 3) m: the capsules' lines with curves (T, 12) put on the body, bones taken for as long as they have to
    be."""
    out = np.array(body.lines)
    feet, arms = curves[:, FEET].reshape(-1, 2, 2), curves[:, ARMS].reshape(-1, 2, 3)
    pivot: dict[int, np.ndarray] = {}
    for number, part in enumerate(body.parts):
        if part.limb == "arm":
            centre = pivot.setdefault(part.side, body.lines[:, number, 0])
            turn = quaternion.from_rotation_vector(arms[:, part.side])[:, None]
            out[:, number] = centre[:, None] + quaternion.rotate(turn, body.lines[:, number] - centre[:, None])
        share = np.array(part.along)[:, None] if part.limb == "leg" else np.zeros((2, 1))
        out[:, number, :, :2] += (1.0 - share) * curves[:, None, ROOT] + share * feet[:, None, part.side]
    return out + body.bent


def pushed(
    bodies: Sequence[CrowdBody], pairs: Sequence[tuple[int, int]], curves: Sequence[np.ndarray], held, fps: float
) -> list[np.ndarray]:
    """The curves (T, 12) of each body with which these pairs are out of each other, as far as they can be.

    curves: those that they have already. held: for each body whether its curves stay what they are at its first and at
    its last frame. The bodies lie on the same T frames.
    """
    now = [np.array(values) for values in curves]
    calm = [Calm.of(body, own, ends, fps) for body, own, ends in zip(bodies, now, held)]
    for turn in range(_ROUNDS):
        placed = [moved(body, values) for body, values in zip(bodies, now)]
        contacts = _contacts(bodies, placed, pairs)
        for number, mine in enumerate(contacts):
            if len(mine.frame) and calm[number].count > 3:
                weight = _BASE / fps * _FIRMER**turn
                given = _given(calm[number], mine, now[number], placed[number], turn >= _ARMS_ALONE, weight)
                now[number] = now[number] + _STEP * (given - now[number])
    return now


def _contacts(bodies, placed, pairs) -> list[Contact]:
    """The contacts of every body with all others."""
    rows: list[list[tuple]] = [[] for _ in bodies]
    for one, other in pairs:
        found = touching(placed[one], placed[other], (bodies[one].radii, bodies[other].radii), ALLOWED)
        for body, against, sign in ((one, other, 1.0), (other, one, -1.0)):
            rows[body].append(_side(found, bodies, placed, body, against, sign))
    empty = (np.zeros(0, int),) * 2 + (np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return [Contact(*(np.concatenate(columns) for columns in zip(empty, *mine))) for mine in rows]


def _side(found: Touching, bodies, placed, body: int, against: int, sign: float) -> tuple:
    """One body's side of its contacts with another, as columns of `Contact`."""
    part, beside = (found.one, found.other) if sign > 0.0 else (found.other, found.one)
    at = found.at_one if sign > 0.0 else found.at_other
    ends = placed[body][found.frame, part]
    place = ends[:, 0] + at[:, None] * (ends[:, 1] - ends[:, 0])
    firm = [bodies[number].firm[found.frame] for number in (body, against)]
    way, deep = _way_out(found, placed[body], placed[against], sign)
    arms = [np.array([p.limb == "arm" for p in bodies[n].parts])[c] for n, c in ((body, part), (against, beside))]
    arm = deep * np.where(arms[0], np.where(arms[1], 0.5, 1.0), 0.0)
    return found.frame, part, at, place, way, deep * firm[1] / (firm[0] + firm[1]), arm


def _way_out(found: Touching, own, others, sign: float) -> tuple[np.ndarray, np.ndarray]:
    """Which way (K, 3), unit, a body leaves another by at each contact, and how far (K,) m: the shortest way, turned
    towards the way from the other's trunk to its own, so that limbs that have caught each other come free."""
    out = _middle(own)[found.frame] - _middle(others)[found.frame]
    out[:, 2] = 0.0
    shortest = sign * found.away
    way = shortest + OUTWARD * out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    off = shortest * (found.radii - found.depth)[:, None]
    along = np.einsum("kc,kc->k", way, off)
    return way, np.sqrt(along**2 + (found.radii - ALLOWED) ** 2 - np.einsum("kc,kc->k", off, off)) - along


def _middle(lines: np.ndarray) -> np.ndarray:
    """(T, 3) m: the middle of the hips."""
    return lines[:, 0].mean(axis=1)


@dataclass(frozen=True, eq=False)
class Calm:
    """What keeps a body's curves small and smooth, whatever its contacts: the squares of its root and feet and of each
    arm, over the frames low .. low + count in which it is there."""

    body: CrowdBody
    low: int
    count: int
    root_and_feet: BandedSquares
    arms: tuple[BandedSquares, ...]

    @classmethod
    def of(cls, body: CrowdBody, curves: np.ndarray, held: tuple[bool, bool], fps: float) -> Calm:
        """Of a body; held: whether its curves (T, 12) stay what they are at its first and at its last frame."""
        low, high = body.there
        whole = _calm_root_and_feet(body.frames(low, high), curves[low:high], held, fps)
        arms = []
        for side in (0, 1):
            arms.append(BandedSquares(high - low, 3))
            for axis in range(3):
                values = curves[low:high, ARMS.start + 3 * side + axis]
                _calm(arms[side], axis, ARM_STAY, ARM_SECONDS, body.firm[low:high], fps)
                _hold(arms[side], axis, values, held)
        return cls(body, low, high - low, whole, tuple(arms))


def _calm_root_and_feet(body: CrowdBody, curves: np.ndarray, held, fps: float) -> BandedSquares:
    squares, scale = BandedSquares(len(curves), ARMS.start), _BASE / fps
    for curve in range(ARMS.start):
        _calm(squares, curve, STAY, SECONDS if curve < FEET.start else FOOT_SECONDS, body.firm, fps)
        _hold(squares, curve, curves[:, curve], held)
    frames = np.arange(len(curves)) * ARMS.start
    for side in (0, 1):
        both = (body.stands[:-1, side] & body.stands[1:, side]).astype(float)
        for axis in (0, 1):
            foot = FEET.start + 2 * side + axis
            near = frames[:, None] + np.array([foot, axis])
            squares.add(near, np.array([1.0, -1.0]), FOOT_NEAR * scale * body.firm)
            step = frames[:-1, None] + np.array([foot + ARMS.start, foot])
            squares.add(step, np.array([1.0, -1.0]), FOOT_STANDS / scale * both)
    return squares


def _calm(squares: BandedSquares, curve: int, stay: float, seconds: float, firm: np.ndarray, fps: float) -> None:
    """Keeps a curve small, and smooth over so many seconds."""
    squares.stay(curve, stay * _BASE / fps * firm)
    squares.smooth(curve, stay * _BASE / fps * (seconds * fps) ** 6 * firm)


def _hold(squares: BandedSquares, curve: int, values: np.ndarray, held) -> None:
    """Keeps a curve's first and last two frames what they are, where they are held."""
    for ends, which in ((slice(0, 2), held[0]), (slice(-2, None), held[1])):
        if which:
            index = (np.arange(squares.count) * squares.unknowns + curve)[ends, None]
            squares.add(index, np.ones(1), np.full(len(index), _HELD), values[ends])


def _given(calm: Calm, mine: Contact, curves, placed, arms_too: bool, weight: float) -> np.ndarray:
    """The body's curves (T, 12) with its share of these contacts given way to."""
    out, parts = np.array(curves), calm.body.parts
    there = slice(calm.low, calm.low + calm.count)
    is_arm = np.array([part.limb == "arm" for part in parts])[mine.part]
    sides = np.array([part.side for part in parts])[mine.part]
    for side in (0, 1):
        rows = np.flatnonzero(is_arm & (sides == side))
        if len(rows):
            shoulder = placed[:, next(n for n, part in enumerate(parts) if part.limb == "arm" and part.side == side), 0]
            columns = slice(ARMS.start + 3 * side, ARMS.start + 3 * side + 3)
            out[there, columns] = _arm(calm, side, mine, rows, shoulder, curves[:, columns], weight)
    whole = np.flatnonzero(~is_arm | arms_too)
    if len(whole) or curves[there, : ARMS.start].any():
        out[there, : ARMS.start] = _root_and_feet(calm, mine, whole, curves, weight)
    return out


def _arm(calm: Calm, side: int, mine: Contact, rows, shoulder, turns, weight: float) -> np.ndarray:
    """The turns (W, 3) of one arm with its contacts `rows`; shoulder (T, 3) m, turns (T, 3) so far."""
    row = quaternion.cross(mine.place[rows] - shoulder[mine.frame[rows]], mine.away[rows])
    long = np.linalg.norm(row, axis=1) > _SHORT_ARM
    rows, row, squares = rows[long], row[long], calm.arms[side].copy()
    frame = mine.frame[rows]
    goal = np.einsum("rk,rk->r", row, turns[frame]) + mine.arm[rows]
    squares.add((frame - calm.low)[:, None] * 3 + np.arange(3), row, np.full(len(rows), weight), goal)
    return _limited(squares.least())


def _limited(turns: np.ndarray) -> np.ndarray:
    """Rotation vectors (T, 3) that near MOST_TURN softly."""
    size = np.maximum(np.linalg.norm(turns, axis=1, keepdims=True), 1e-9)
    return turns * (MOST_TURN * np.tanh(size / MOST_TURN) / size)


def _root_and_feet(calm: Calm, mine: Contact, rows, curves, weight: float) -> np.ndarray:
    """The first six curves (W, 6) with what lacks at the contacts `rows` given by root and feet."""
    parts, frame, part = calm.body.parts, mine.frame[rows], mine.part[rows]
    side = np.array([p.side for p in parts])[part]
    ends = np.array([p.along if p.limb == "leg" else (0.0, 0.0) for p in parts])[part]
    share = (ends[:, 0] + mine.at[rows] * (ends[:, 1] - ends[:, 0]))[:, None]
    push = mine.away[rows, :2]
    size = np.maximum(np.linalg.norm(push, axis=1, keepdims=True), 1e-9)
    push = push * (np.maximum(size, _UPRIGHT) / size)
    columns = np.stack([0 * side, 0 * side + 1, FEET.start + 2 * side, FEET.start + 2 * side + 1], axis=1)
    values = np.concatenate([(1.0 - share) * push, share * push], axis=1)
    goal = np.einsum("rk,rk->r", values, curves[frame[:, None], columns]) + mine.give[rows]
    squares = calm.root_and_feet.copy()
    squares.add((frame - calm.low)[:, None] * ARMS.start + columns, values, np.full(len(rows), weight), goal)
    return squares.least()
