"""One body among many: its capsules over time, where curves bring it, and which curves its contacts ask for.

These are the least smooth ones that bring it out of its share of each contact. With n the direction away from the
other, a point that is down its leg by a share f moves by (1 - f) root + f foot, and a point on an arm by turn x arm.
What is least is, for root and feet together and for each arm by itself, one banded system (`BandedLeastSquares`): the
squares of what lacks at each contact, of the curves and of their third differences, of a foot's distance from its
root's shift, and of its speed while it stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.vectors import cross
from ...motion import quaternion
from .capsules import Capsule
from .correction import ARMS, FEET, ROOT

STAY, SECONDS = 0.003, 0.3
"""Weight of the root's shift, and seconds in which it comes and goes."""

FOOT_NEAR, FOOT_STANDS, FOOT_SECONDS = 0.01, 300.0, 0.12
"""Weights of a foot's shift against its root's and of its speed while it stands (per frame at 30 per second); seconds
in which it comes and goes."""

ARM_STAY, ARM_SECONDS, MOST_TURN = 5e-4, 0.15, 1.1
"""Weight of an arm's turn, seconds in which it comes and goes, and radians that it turns at most."""

BASE = 30.0
"""Frames per second for which weights are."""

_SHORT_ARM = 0.08  # m from the shoulder's axis below which turning an arm brings nothing away
_UPRIGHT = 0.35  # least share of a push that goes over the ground
_HELD = 1e6  # weight that holds a value: far above all others


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


@dataclass(frozen=True, eq=False, kw_only=True)
class Calm:
    """What keeps a body's curves small and smooth, whatever its contacts: the squares of its root and feet and of each
    arm, over the frames low .. low + count in which it is there."""

    body: CrowdBody
    low: int
    count: int
    root_and_feet: BandedLeastSquares
    arms: tuple[BandedLeastSquares, ...]

    @classmethod
    def of(cls, body: CrowdBody, curves: np.ndarray, held: tuple[bool, bool], fps: float) -> Calm:
        """Of a body; held: whether its curves (T, 12) stay what they are at its first and at its last frame."""
        low, high = body.there
        whole = _calm_root_and_feet(body.frames(low, high), curves[low:high], held, fps)
        arms = []
        for side in (0, 1):
            arms.append(BandedLeastSquares(high - low, 3))
            for axis in range(3):
                values = curves[low:high, ARMS.start + 3 * side + axis]
                _calm(arms[side], axis, ARM_STAY, seconds=ARM_SECONDS, firm=body.firm[low:high], fps=fps)
                _hold(arms[side], axis, values, held)
        return cls(body=body, low=low, count=high - low, root_and_feet=whole, arms=tuple(arms))


def solve_curves(calm: Calm, mine: Contact, curves, placed, arms_too: bool, weight: float) -> np.ndarray:
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
            out[there, columns] = _arm(calm, side, mine, rows=rows, shoulder=shoulder, turns=curves[:, columns],
                                       weight=weight)
    whole = np.flatnonzero(~is_arm | arms_too)
    if len(whole) or curves[there, : ARMS.start].any():
        out[there, : ARMS.start] = _root_and_feet(calm, mine, whole, curves, weight)
    return out


def _calm_root_and_feet(body: CrowdBody, curves: np.ndarray, held, fps: float) -> BandedLeastSquares:
    squares, scale = BandedLeastSquares(len(curves), ARMS.start), BASE / fps
    for curve in range(ARMS.start):
        _calm(squares, curve, STAY, seconds=SECONDS if curve < FEET.start else FOOT_SECONDS, firm=body.firm, fps=fps)
        _hold(squares, curve, curves[:, curve], held)
    frames = np.arange(len(curves)) * ARMS.start
    for side in (0, 1):
        both = (body.stands[:-1, side] & body.stands[1:, side]).astype(float)
        for axis in (0, 1):
            foot = FEET.start + 2 * side + axis
            near = frames[:, None] + np.array([foot, axis])
            squares.add_rows(near, np.array([1.0, -1.0]), FOOT_NEAR * scale * body.firm)
            step = frames[:-1, None] + np.array([foot + ARMS.start, foot])
            squares.add_rows(step, np.array([1.0, -1.0]), FOOT_STANDS / scale * both)
    return squares


def _calm(squares: BandedLeastSquares, curve: int, stay: float, seconds: float, firm: np.ndarray, fps: float) -> None:
    """Keeps a curve small, and smooth over so many seconds."""
    squares.add_value(stay * BASE / fps * firm, curve)
    squares.add_smoothness(stay * BASE / fps * (seconds * fps) ** 6 * firm, curve)


def _hold(squares: BandedLeastSquares, curve: int, values: np.ndarray, held) -> None:
    """Keeps a curve's first and last two frames what they are, where they are held."""
    for ends, which in ((slice(0, 2), held[0]), (slice(-2, None), held[1])):
        if which:
            index = (np.arange(squares.count) * squares.unknowns + curve)[ends, None]
            squares.add_rows(index, np.ones(1), np.full(len(index), _HELD), values[ends])


def _arm(calm: Calm, side: int, mine: Contact, rows, shoulder, turns, weight: float) -> np.ndarray:
    """The turns (W, 3) of one arm with its contacts `rows`; shoulder (T, 3) m, turns (T, 3) so far."""
    row = cross(mine.place[rows] - shoulder[mine.frame[rows]], mine.away[rows])
    long = np.linalg.norm(row, axis=1) > _SHORT_ARM
    rows, row, squares = rows[long], row[long], calm.arms[side].copy()
    frame = mine.frame[rows]
    goal = np.einsum("rk,rk->r", row, turns[frame]) + mine.arm[rows]
    squares.add_rows((frame - calm.low)[:, None] * 3 + np.arange(3), row, np.full(len(rows), weight), goal)
    return _limited(squares.solve())


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
    squares.add_rows((frame - calm.low)[:, None] * ARMS.start + columns, values, np.full(len(rows), weight), goal)
    return squares.solve()
