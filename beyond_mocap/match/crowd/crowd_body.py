"""One body among many: its capsules over time, how curves move them, and which curves resolve its contacts.

The curves are the least and smoothest ones that move the body by its share of each contact. With n the direction away
from the other body, a point down its leg by a share f moves by (1 - f) root + f foot, and a point on an arm by rotation
x lever. Root and feet together, and each arm by itself, are one banded system (`BandedLeastSquares`) that minimises the
squares of: what is missing at each contact, the curves and their third differences, a foot's shift relative to its
root's, and a foot's speed while it is in contact.
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
"""Weight of the root's shift, and s in which it fades in and out."""

FOOT_NEAR, FOOT_STANDS, FOOT_SECONDS = 0.01, 300.0, 0.12
"""Weights of a foot's shift relative to its root's and of its speed in contact (per frame at 30 per second); s in which
the shift fades in and out."""

ARM_STAY, ARM_SECONDS, MOST_TURN = 5e-4, 0.15, 1.1
"""Weight of an arm's rotation, s in which it fades in and out, and its largest angle, rad."""

BASE = 30.0
"""Frames per second the weights are given for."""

_SHORT_ARM = 0.08  # m from the rotation axis: on a shorter lever, rotating an arm does not separate bodies
_UPRIGHT = 0.35  # least share of a push that counts as horizontal
_HELD = 1e6  # weight that fixes a value: far above all others


@dataclass(frozen=True, eq=False)
class CrowdBody:
    """One body over T common frames.

    Attributes:
        parts: its C capsules.
        lines: (T, C, 2, 3) m, ends of their lines, NaN where the body is absent.
        bend_offset: (T, C, 2, 3) m by which bent limbs differ from where the curves alone put them.
        foot_contacts: (T, 2) bool, left and right foot in contact with the ground.
        firmness: (T,) how firmly it keeps its path against others.
    """

    parts: tuple[Capsule, ...]
    lines: np.ndarray
    bent: np.ndarray
    stands: np.ndarray
    firm: np.ndarray

    @property
    def radii(self) -> np.ndarray:
        """(C,) m of the capsules."""
        return np.array([part.radius for part in self.parts])

    @property
    def there(self) -> tuple[int, int]:
        """First frame and end of the time the body is present."""
        known = np.flatnonzero(np.isfinite(self.lines[:, 0, 0, 0]))
        return (int(known[0]), int(known[-1]) + 1) if len(known) else (0, 0)

    def frames(self, low: int, high: int) -> CrowdBody:
        """Select the frames low .. high."""
        rows = (values[low:high] for values in (self.lines, self.bent, self.stands, self.firm))
        return CrowdBody(self.parts, *rows)


@dataclass(frozen=True, eq=False)
class Contact:
    """The K contacts of one body.

    Attributes:
        frame: (K,) frame.
        part: (K,) capsule.
        line_share: (K,) position along the capsule's line, 0 to 1.
        position: (K, 3) m of that point.
        direction: (K, 3) unit vector away from the other body.
        distance: (K,) m the body should move, its share of the overlap.
        arm_distance: (K,) m its arm should move, where the part is an arm.
    """

    frame: np.ndarray
    part: np.ndarray
    at: np.ndarray
    place: np.ndarray
    away: np.ndarray
    give: np.ndarray
    arm: np.ndarray


def moved(body: CrowdBody, curves: np.ndarray) -> np.ndarray:
    """Move a body's capsules by curves; bones become as long as they have to be.

    Args:
        body: the body, T frames.
        curves: (T, 12) m and rad.
    Returns:
        (T, C, 2, 3) m, ends of the capsules' lines.
    """
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
    """The terms that keep a body's curves small and smooth, independent of its contacts.

    Attributes:
        body: the body.
        low: first frame at which it is present.
        count: number of frames it is present.
        root_and_feet: squares of the first six curves.
        arms: squares of each arm's three curves.
    """

    body: CrowdBody
    low: int
    count: int
    root_and_feet: BandedLeastSquares
    arms: tuple[BandedLeastSquares, ...]

    @classmethod
    def of(cls, body: CrowdBody, curves: np.ndarray, held: tuple[bool, bool], fps: float) -> Calm:
        """Build the terms of a body.

        Args:
            body: the body, T frames.
            curves: (T, 12) m and rad so far.
            held_ends: whether the curves keep their values at the body's first and last frame.
            fps: frames per second.
        Returns:
            The terms.
        """
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
    """Solve the body's curves for its share of these contacts.

    Args:
        smoothness: the body's terms.
        contacts: the body's contacts.
        curves: (T, 12) m and rad so far.
        capsule_lines: (T, C, 2, 3) m, where the capsules are now.
        arms_too: contacts at arms also move root and feet.
        weight: of each contact.
    Returns:
        (T, 12) m and rad.
    """
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
    """Build the terms of root and feet: small, smooth, feet near the root's shift and slow in contact."""
    squares, scale = BandedLeastSquares(len(curves), ARMS.start), BASE / fps
    for curve in range(ARMS.start):
        _calm(squares, curve, STAY, seconds=SECONDS if curve < FEET.start else FOOT_SECONDS, firm=body.firm, fps=fps)
        _hold(squares, curve, curves[:, curve], held)
    # Unknown number of curve c at frame t: t * 6 + c. Each row couples the unknowns in its index columns.
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
    """Add terms that keep a curve small, and smooth over so many seconds."""
    squares.add_value(stay * BASE / fps * firm, curve)
    squares.add_smoothness(stay * BASE / fps * (seconds * fps) ** 6 * firm, curve)


def _hold(squares: BandedLeastSquares, curve: int, values: np.ndarray, held) -> None:
    """Hold a curve's first and last two frames at their values, where `held_ends` is set."""
    for ends, which in ((slice(0, 2), held[0]), (slice(-2, None), held[1])):
        if which:
            index = (np.arange(squares.count) * squares.unknowns + curve)[ends, None]
            squares.add_rows(index, np.ones(1), np.full(len(index), _HELD), values[ends])


def _arm(calm: Calm, side: int, mine: Contact, rows, shoulder, turns, weight: float) -> np.ndarray:
    """Solve the rotation vectors (W, 3) of one arm for its contacts `rows`.

    shoulder (T, 3) m; rotations (T, 3) rad, the rotations so far.
    """
    # A small rotation w moves the point by w x lever; along `direction` that is (lever x direction) . w.
    row = cross(mine.place[rows] - shoulder[mine.frame[rows]], mine.away[rows])
    long = np.linalg.norm(row, axis=1) > _SHORT_ARM
    rows, row, squares = rows[long], row[long], calm.arms[side].copy()
    frame = mine.frame[rows]
    goal = np.einsum("rk,rk->r", row, turns[frame]) + mine.arm[rows]
    squares.add_rows((frame - calm.low)[:, None] * 3 + np.arange(3), row, np.full(len(rows), weight), goal)
    return _limited(squares.solve())


def _limited(turns: np.ndarray) -> np.ndarray:
    """Limit rotation vectors (T, 3) softly to MAX_ARM_ANGLE."""
    size = np.maximum(np.linalg.norm(turns, axis=1, keepdims=True), 1e-9)
    return turns * (MOST_TURN * np.tanh(size / MOST_TURN) / size)


def _root_and_feet(calm: Calm, mine: Contact, rows, curves, weight: float) -> np.ndarray:
    """Solve the first six curves (W, 6) for the contacts `rows`."""
    parts, frame, part = calm.body.parts, mine.frame[rows], mine.part[rows]
    side = np.array([p.side for p in parts])[part]
    ends = np.array([p.along if p.limb == "leg" else (0.0, 0.0) for p in parts])[part]
    # How far down the leg the contact is: the foot's shift counts by this share, the root's by the rest.
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
