"""The correction that keeps a body out of others: a few smooth curves, stored at ten knots per second.

The curves are the root's horizontal shift, each foot's, and the rotation of each arm about its shoulder. They are
stored as whole tenths of millimetres and of milliradians, so that stored and in-memory values give the same bits, and
are 0 between the pieces in which something changes.

A leg whose foot moves opens or closes its knee until the ankle has the required distance from the hip, about the axis
about which the knee is bent. A nearly straight leg shows no such axis: it uses the axis perpendicular to leg and foot,
since knees point where toes do. Then the whole leg swings about the hip by the shortest rotation. Each frame depends on
no other frame; a foot that does not move leaves the leg unchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from ...base.easing import quintic_step_by_powers
from ...base.errors import InputError
from ...base.vectors import unit_vectors
from ...motion import limb as two_bones
from ...motion import quaternion
from ...motion.humanoid import Limb, identify_joints
from ...motion.motion import Motion, compute_pose
from ...motion.skeleton import Skeleton, freeze_array

ROOT, FEET, ARMS = slice(0, 2), slice(2, 6), slice(6, 12)
"""Columns: shift (x, y) of the root, m; of the left and the right foot, m; rotation vectors of both arms, rad."""

CURVES = 12
UNIT = 1e-4
"""m and rad of a stored 1."""

KNOT_SECONDS = 0.1  # s between the knots of a correction
_MIN_VISIBLE = 5e-4  # m and rad: smaller values are not visible and count as 0

SOFT_KNEE_MARGIN = 0.01
"""m below full length, where a leg starts to ease out."""

_CLEAR_BEND = 0.05  # sine of a knee's bend: below this its axis has less and less weight
_MIN_LEG_LENGTH = 0.05  # m, the least distance from hip to ankle


@dataclass(frozen=True, eq=False)
class Correction:
    """The corrections of one body, on the match's clock.

    Attributes:
        knots: (N,) int, frames, ascending, `step` apart within a piece and more between two pieces.
        values: (N, 12) int16 in UNIT, columns ROOT, FEET and ARMS; 0 at the ends of pieces.
        fps: frames per second of the clock.
        step: frames between knots.
    Raises:
        InputError: if the shapes do not match, or knots do not ascend.
    """

    knots: np.ndarray
    values: np.ndarray
    fps: float
    step: int

    def __post_init__(self):
        knots, values = freeze_array(self.knots, np.int64), freeze_array(self.values, np.int16)
        if knots.ndim != 1 or values.shape != (len(knots), CURVES) or np.any(np.diff(knots) < self.step):
            found = f"knots {knots.shape}, values {values.shape}"
            raise InputError("correction", found, f"(N,) rising and (N, {CURVES})")
        if not (self.step >= 1 and self.fps > 0.0):
            raise InputError("correction", f"{self.step} frames at {self.fps:g} per second", "1 or more, above 0")
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "values", values)

    @classmethod
    def build_empty(cls, fps: float) -> Correction:
        """Build a correction that changes nothing."""
        return cls(np.zeros(0, int), np.zeros((0, CURVES), int), fps, compute_knot_step(fps))

    @classmethod
    def from_curves(cls, curves: np.ndarray, first: int, fps: float) -> Correction:
        """Build a correction from sampled curves.

        Args:
            curves: (T, 12) m and rad.
            first: frame of the match's clock of the first row.
            fps: frames per second.
        Returns:
            The correction.
        """
        step = compute_knot_step(fps)
        at = np.arange(-(-first // step) * step, first + len(curves), step)
        values = np.round(np.clip(curves[at - first] / UNIT, -32767, 32767)).astype(np.int16)
        is_visible = np.abs(curves[at - first]).max(axis=1, initial=0.0) > _MIN_VISIBLE
        # A knot next to a visible one is stored as 0: pieces start and end there.
        stored = is_visible | np.append(is_visible[1:], False) | np.append(False, is_visible[:-1])
        values[~is_visible] = 0
        return cls(at[stored], values[stored], fps, step)

    def build_pieces(self) -> list[tuple[int, int]]:
        """(first, end) knot indices of each piece."""
        breaks = np.flatnonzero(np.diff(self.knots) > self.step) + 1
        edges = [0, *breaks.tolist(), len(self.knots)]
        return [(low, high) for low, high in zip(edges, edges[1:]) if high - low > 1]

    def build_curves(self, first: int, count: int) -> np.ndarray:
        """Give the curves (T, 12), m and rad, at `count` frames from frame `first`; cubic between knots."""
        out = np.zeros((count, CURVES))
        for low, high in self.build_pieces():
            start, end = max(int(self.knots[low]), first), min(int(self.knots[high - 1]) + 1, first + count)
            if start < end:
                spline = CubicSpline(self.knots[low:high], self.values[low:high] * UNIT, bc_type="clamped")
                out[start - first : end - first] = spline(np.arange(start, end))
        return out


def compute_knot_step(fps: float) -> int:
    """Frames from knot to knot."""
    return max(1, round(KNOT_SECONDS * fps))


def apply_correction(motion: Motion, correction: Correction, first: int = 0) -> Motion:
    """Apply a correction to a motion.

    Bone lengths stay, flat feet stay flat, and frames without correction keep every bit. Each frame is corrected on its
    own.

    Args:
        motion: the motion.
        correction: the correction.
        first: frame of the match's clock of the motion's frame 0.
    Returns:
        The corrected motion.
    Raises:
        InputError: if the frame rates differ.
    """
    if abs(motion.fps - correction.fps) > 1e-9:
        raise InputError("correction", f"{correction.fps:g} frames per second", f"{motion.fps:g}, the motion's rate")
    return apply_curves(motion, correction.build_curves(first, len(motion)))


def apply_curves(motion: Motion, curves: np.ndarray) -> Motion:
    """Apply correction curves (T, 12), m and rad, to a motion of T frames."""
    affected = np.flatnonzero(curves.any(axis=1))
    if not len(affected):
        return motion
    skeleton, body, values = motion.skeleton, identify_joints(motion.skeleton), curves[affected]
    root, rotations = np.array(motion.root_positions), np.array(motion.rotations)
    places, world = compute_pose(skeleton, root[affected], rotations[affected])
    root[affected, :2] += values[:, ROOT]
    for side, limb in enumerate((body.left, body.right)):
        foot_shift = values[:, FEET].reshape(-1, 2, 2)[:, side] - values[:, ROOT]
        new_rotations = move_leg(skeleton, limb, places, world, np.column_stack([foot_shift, np.zeros(len(affected))]))
        arm_rotation = values[:, ARMS].reshape(-1, 2, 3)[:, side]
        if limb.upper_arm is not None and arm_rotation.any():
            upper = quaternion.multiply(quaternion.from_rotation_vector(arm_rotation), world[:, limb.upper_arm])
            new_rotations[limb.upper_arm] = convert_to_parent(skeleton, world, limb.upper_arm, upper)
        for joint, local in new_rotations.items():
            rotations[affected, joint] = quaternion.match_signs(local, rotations[affected, joint])
    return replace(motion, root_positions=root, rotations=rotations)


def join_corrections(parts: Sequence[tuple[Correction, int, int]], reach: int) -> Correction:
    """Join the corrections of neighbouring windows.

    Around an edge between two cores, one blends into the other within 2 `reach` frames.

    Args:
        parts: (correction, first, end), with the frames of each window's core, in order; each was solved for `reach`
            frames beyond both ends.
        reach: frames.
    Returns:
        One correction.
    """
    fps, step = parts[0][0].fps, parts[0][0].step
    total: dict[int, np.ndarray] = {}
    for number, (correction, first, end) in enumerate(parts):
        share = np.ones(len(correction.knots))
        if number and parts[number - 1][2] == first:
            share = share * quintic_step_by_powers((correction.knots - first + reach) / (2.0 * reach))
        if number + 1 < len(parts) and parts[number + 1][1] == end:
            share = share * quintic_step_by_powers((end + reach - correction.knots) / (2.0 * reach))
        for knot, weight, values in zip(correction.knots.tolist(), share, correction.values):
            total[knot] = total.get(knot, 0.0) + weight * values
    knots = np.array(sorted(total), int)
    values = np.array([np.round(total[knot]) for knot in knots.tolist()]).reshape(-1, CURVES)
    return Correction(knots, values, fps, step)


def move_leg(
    skeleton: Skeleton, limb: Limb, places: np.ndarray, world: np.ndarray, shift: np.ndarray
) -> dict[int, np.ndarray]:
    """Move the ankle relative to the hip; the foot keeps its rotation in the world.

    Args:
        skeleton: the body's skeleton.
        limb: the leg.
        places: (W, J, 3) m, all joints of the given pose, world frame.
        world: (W, J, 4) their rotations, world frame.
        shift: (W, 3) m of the ankle relative to the hip.
    Returns:
        Local rotations (W, 4) by joint.
    """
    hip, knee, ankle = (places[:, joint] for joint in (limb.upper_leg, limb.lower_leg, limb.foot))
    thigh, shin, line = knee - hip, ankle - knee, ankle - hip
    lengths, goal = (np.linalg.norm(thigh, axis=1), np.linalg.norm(shin, axis=1)), line + shift
    distance, goal_distance = np.linalg.norm(line, axis=1), np.linalg.norm(goal, axis=1)
    # Ease near full length, relative to the given pose: no shift changes nothing.
    eased = [two_bones.soften_distance(length, lengths[0] + lengths[1], SOFT_KNEE_MARGIN)
             for length in (distance, goal_distance)]
    reach = np.clip(distance + eased[1] - eased[0], _MIN_LEG_LENGTH, lengths[0] + lengths[1])
    knee_change = two_bones.compute_inner_angle(*lengths, reach) - two_bones.compute_inner_angle(*lengths, distance)
    toes = places[:, limb.toe_or_foot] - ankle if limb.toe is not None else np.zeros(line.shape)
    bend = quaternion.from_axis_angle(_find_knee_axis(thigh, shin, line, toes), -knee_change)
    swing = quaternion.rotation_between(thigh + quaternion.rotate(bend, shin), goal)
    lower = quaternion.multiply(bend, world[:, limb.lower_leg])
    foot_parent = quaternion.multiply(swing, quaternion.multiply(bend, world[:, skeleton.parents[limb.foot]]))
    upper = quaternion.multiply(swing, world[:, limb.upper_leg])
    return {
        limb.upper_leg: convert_to_parent(skeleton, world, limb.upper_leg, upper),
        limb.lower_leg: convert_to_parent(skeleton, world, limb.lower_leg, lower),
        limb.foot: quaternion.multiply(quaternion.inverse(foot_parent), world[:, limb.foot]),
    }


def convert_to_parent(skeleton: Skeleton, world: np.ndarray, joint: int, rotation: np.ndarray) -> np.ndarray:
    """Convert a joint's world rotations (W, 4) to its parent's frame."""
    return quaternion.multiply(quaternion.inverse(world[:, skeleton.parents[joint]]), rotation)


def _find_knee_axis(thigh: np.ndarray, shin: np.ndarray, line: np.ndarray, toes: np.ndarray) -> np.ndarray:
    """Find the axis (W, 3), unit, about which a positive rotation bends the knee further."""
    bones = np.linalg.norm(thigh, axis=1) * np.linalg.norm(shin, axis=1)
    axis = np.cross(thigh, shin) / bones[:, None]
    across = unit_vectors(np.cross(toes, line), np.array([0.0, 1.0, 0.0]))
    share = np.clip(np.linalg.norm(axis, axis=1, keepdims=True) / _CLEAR_BEND, 0.0, 1.0)
    mixed = share * unit_vectors(axis, across) + (1.0 - share) * across
    down = unit_vectors(line, across)
    return unit_vectors(mixed - np.sum(mixed * down, axis=1, keepdims=True) * down, across)
