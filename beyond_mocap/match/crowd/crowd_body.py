"""One body among many: its capsules over time, how curves move them, and which curves resolve its contacts.

The curves are the least and smoothest ones that move the body by its share of each contact. With n the direction away
from the other body, a point down its leg by a share f moves by (1 - f) root + f foot, and a point on an arm by rotation
x lever. Root and feet together, and each arm by itself, are one banded system (`BandedLeastSquares`) that minimises the
squares of: what is missing at each contact, the curves and their third differences, a foot's shift relative to its
root's, and a foot's speed while it is in contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.vectors import cross_product
from ...motion import quaternion
from .capsules import Capsule
from .correction import ARMS, FEET, ROOT

SHIFT_WEIGHT, SHIFT_SECONDS = 0.003, 0.3
"""Weight of the root's shift, and s in which it fades in and out."""

FOOT_ROOT_WEIGHT, FOOT_SPEED_WEIGHT, FOOT_SECONDS = 0.01, 300.0, 0.12
"""Weights of a foot's shift relative to its root's and of its speed in contact (per frame at 30 per second); s in which
the shift fades in and out."""

ARM_WEIGHT, ARM_SECONDS, MAX_ARM_ANGLE = 5e-4, 0.15, 1.1
"""Weight of an arm's rotation, s in which it fades in and out, and its largest angle, rad."""

BASE_FPS = 30.0
"""Frames per second the weights are given for."""

_MIN_LEVER = 0.08  # m from the rotation axis: on a shorter lever, rotating an arm does not separate bodies
_MIN_LEVEL_SHARE = 0.35  # least share of a push that counts as horizontal
_HOLD_WEIGHT = 1e6  # weight that fixes a value: far above all others


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
    bend_offset: np.ndarray
    foot_contacts: np.ndarray
    firmness: np.ndarray

    @property
    def radii(self) -> np.ndarray:
        """(C,) m of the capsules."""
        return np.array([part.radius for part in self.parts])

    @property
    def present_span(self) -> tuple[int, int]:
        """First frame and end of the time the body is present."""
        known = np.flatnonzero(np.isfinite(self.lines[:, 0, 0, 0]))
        return (int(known[0]), int(known[-1]) + 1) if len(known) else (0, 0)

    def select_frames(self, rows: slice | np.ndarray) -> CrowdBody:
        """Select some of the frames."""
        values = (self.lines, self.bend_offset, self.foot_contacts, self.firmness)
        return CrowdBody(self.parts, *(each[rows] for each in values))


@dataclass(frozen=True, eq=False)
class BodyContacts:
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
    line_share: np.ndarray
    position: np.ndarray
    direction: np.ndarray
    distance: np.ndarray
    arm_distance: np.ndarray


def move_capsules(body: CrowdBody, curves: np.ndarray) -> np.ndarray:
    """Move a body's capsules by curves; bones become as long as they have to be.

    Args:
        body: the body, T frames.
        curves: (T, 12) m and rad.
    Returns:
        (T, C, 2, 3) m, ends of the capsules' lines.
    """
    out, moved = np.array(body.lines), np.flatnonzero(curves.any(axis=1))
    if len(moved):
        out[moved] = _move_lines(body.parts, body.lines[moved], curves[moved])
    return out + body.bend_offset


def _move_lines(parts: Sequence[Capsule], lines: np.ndarray, curves: np.ndarray) -> np.ndarray:
    """Move the lines (T, C, 2, 3) m of a body's capsules by curves (T, 12) m and rad."""
    out, sides = np.array(lines), [part.side for part in parts]
    feet, arms = curves[:, FEET].reshape(-1, 2, 2), curves[:, ARMS].reshape(-1, 2, 3)
    for side in (0, 1):
        arm = [number for number, part in enumerate(parts) if part.limb == "arm" and part.side == side]
        if arm:
            shoulder = lines[:, arm[:1], :1]
            rotation = quaternion.from_rotation_vector(arms[:, side])[:, None, None]
            out[:, arm] = shoulder + quaternion.rotate(rotation, lines[:, arm] - shoulder)
    share = np.array([part.along for part in parts])[:, :, None]  # 0 but for legs
    out[..., :2] += (1.0 - share) * curves[:, None, None, ROOT] + share * feet[:, sides, None]
    return out


@dataclass(frozen=True, eq=False, kw_only=True)
class SmoothnessTerms:
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
    def from_body(cls, body: CrowdBody, curves: np.ndarray, held_ends: tuple[bool, bool],
                  fps: float) -> SmoothnessTerms:
        """Build the terms of a body.

        Args:
            body: the body, T frames.
            curves: (T, 12) m and rad so far.
            held_ends: whether the curves keep their values at the body's first and last frame.
            fps: frames per second.
        Returns:
            The terms.
        """
        low, high = body.present_span
        present = slice(low, high)
        root_and_feet = _build_root_and_feet_smoothness(body.select_frames(present), curves[present], held_ends, fps)
        arms = []
        for side in (0, 1):
            arms.append(BandedLeastSquares(high - low, 3))
            for axis in range(3):
                values = curves[low:high, ARMS.start + 3 * side + axis]
                _add_smoothness(arms[side], axis, ARM_WEIGHT, seconds=ARM_SECONDS, firmness=body.firmness[low:high],
                                fps=fps)
                _hold_ends(arms[side], axis, values, held_ends)
        return cls(body=body, low=low, count=high - low, root_and_feet=root_and_feet, arms=tuple(arms))


def solve_curves(smoothness: SmoothnessTerms, contacts: BodyContacts, curves, capsule_lines, arms_too: bool,
                 weight: float) -> np.ndarray:
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
    out, parts = np.array(curves), smoothness.body.parts
    span = slice(smoothness.low, smoothness.low + smoothness.count)
    is_arm = np.array([part.limb == "arm" for part in parts])[contacts.part]
    sides = np.array([part.side for part in parts])[contacts.part]
    for side in (0, 1):
        rows = np.flatnonzero(is_arm & (sides == side))
        if len(rows):
            shoulder = capsule_lines[:, next(n for n, part in enumerate(parts) if part.limb == "arm" and part.side
                                             == side), 0]
            columns = slice(ARMS.start + 3 * side, ARMS.start + 3 * side + 3)
            out[span, columns] = _solve_arm(smoothness, side, contacts, rows=rows, shoulder=shoulder,
                                            rotations=curves[:, columns], weight=weight)
    whole = np.flatnonzero(~is_arm | arms_too)
    if len(whole) or curves[span, : ARMS.start].any():
        out[span, : ARMS.start] = _solve_root_and_feet(smoothness, contacts, whole, curves, weight)
    return out


def _build_root_and_feet_smoothness(body: CrowdBody, curves: np.ndarray, held_ends, fps: float) -> BandedLeastSquares:
    """Build the terms of root and feet: small, smooth, feet near the root's shift and slow in contact."""
    squares, scale = BandedLeastSquares(len(curves), ARMS.start), BASE_FPS / fps
    for curve in range(ARMS.start):
        _add_smoothness(squares, curve, SHIFT_WEIGHT, seconds=SHIFT_SECONDS if curve < FEET.start else FOOT_SECONDS,
                        firmness=body.firmness, fps=fps)
        _hold_ends(squares, curve, curves[:, curve], held_ends)
    # Unknown number of curve c at frame t: t * 6 + c. Each row couples the unknowns in its index columns.
    frames = np.arange(len(curves)) * ARMS.start
    for side in (0, 1):
        both = (body.foot_contacts[:-1, side] & body.foot_contacts[1:, side]).astype(float)
        for axis in (0, 1):
            foot = FEET.start + 2 * side + axis
            near = frames[:, None] + np.array([foot, axis])
            squares.add_rows(near, np.array([1.0, -1.0]), FOOT_ROOT_WEIGHT * scale * body.firmness)
            step = frames[:-1, None] + np.array([foot + ARMS.start, foot])
            squares.add_rows(step, np.array([1.0, -1.0]), FOOT_SPEED_WEIGHT / scale * both)
    return squares


def _add_smoothness(squares: BandedLeastSquares, curve: int, value_weight: float, seconds: float, firmness: np.ndarray,
                    fps: float) -> None:
    """Add terms that keep a curve small, and smooth over so many seconds."""
    squares.add_value(value_weight * BASE_FPS / fps * firmness, curve)
    squares.add_smoothness(value_weight * BASE_FPS / fps * (seconds * fps) ** 6 * firmness, curve)


def _hold_ends(squares: BandedLeastSquares, curve: int, values: np.ndarray, held_ends) -> None:
    """Hold a curve's first and last two frames at their values, where `held_ends` is set."""
    for ends, which in ((slice(0, 2), held_ends[0]), (slice(-2, None), held_ends[1])):
        if which:
            index = (np.arange(squares.count) * squares.unknowns + curve)[ends, None]
            squares.add_rows(index, np.ones(1), np.full(len(index), _HOLD_WEIGHT), values[ends])


def _solve_arm(smoothness: SmoothnessTerms, side: int, contacts: BodyContacts, rows, shoulder, rotations,
               weight: float) -> np.ndarray:
    """Solve the rotation vectors (W, 3) of one arm for its contacts `rows`.

    shoulder (T, 3) m; rotations (T, 3) rad, the rotations so far.
    """
    # A small rotation w moves the point by w x lever; along `direction` that is (lever x direction) . w.
    row = cross_product(contacts.position[rows] - shoulder[contacts.frame[rows]], contacts.direction[rows])
    has_lever = np.linalg.norm(row, axis=1) > _MIN_LEVER
    rows, row, squares = rows[has_lever], row[has_lever], smoothness.arms[side].copy()
    frame = contacts.frame[rows]
    goal = np.einsum("rk,rk->r", row, rotations[frame]) + contacts.arm_distance[rows]
    squares.add_rows((frame - smoothness.low)[:, None] * 3 + np.arange(3), row, np.full(len(rows), weight), goal)
    return _limit_rotation(squares.solve())


def _limit_rotation(rotations: np.ndarray) -> np.ndarray:
    """Limit rotation vectors (T, 3) softly to MAX_ARM_ANGLE."""
    size = np.maximum(np.linalg.norm(rotations, axis=1, keepdims=True), 1e-9)
    return rotations * (MAX_ARM_ANGLE * np.tanh(size / MAX_ARM_ANGLE) / size)


def _solve_root_and_feet(smoothness: SmoothnessTerms, contacts: BodyContacts, rows, curves,
                         weight: float) -> np.ndarray:
    """Solve the first six curves (W, 6) for the contacts `rows`."""
    parts, frame, part = smoothness.body.parts, contacts.frame[rows], contacts.part[rows]
    side = np.array([p.side for p in parts])[part]
    ends = np.array([p.along if p.limb == "leg" else (0.0, 0.0) for p in parts])[part]
    # How far down the leg the contact is: the foot's shift counts by this share, the root's by the rest.
    share = (ends[:, 0] + contacts.line_share[rows] * (ends[:, 1] - ends[:, 0]))[:, None]
    push = contacts.direction[rows, :2]
    size = np.maximum(np.linalg.norm(push, axis=1, keepdims=True), 1e-9)
    push = push * (np.maximum(size, _MIN_LEVEL_SHARE) / size)
    columns = np.stack([0 * side, 0 * side + 1, FEET.start + 2 * side, FEET.start + 2 * side + 1], axis=1)
    values = np.concatenate([(1.0 - share) * push, share * push], axis=1)
    goal = np.einsum("rk,rk->r", values, curves[frame[:, None], columns]) + contacts.distance[rows]
    squares = smoothness.root_and_feet.copy()
    squares.add_rows((frame - smoothness.low)[:, None] * ARMS.start + columns, values, np.full(len(rows), weight), goal)
    return squares.solve()
