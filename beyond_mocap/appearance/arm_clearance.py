"""Arms kept out of the trunk of the body that is shown.

People do not pass through themselves: on their own skeleton, elbows, forearms and hands of recordings stay 2 cm and
more outside the trunk, measured to the middle of the bone. Brought to a body with another trunk or other arms they do
not, nor do arms that networks predict. Each arm is turned about its shoulder, by the least angle that clears all of it,
smoothly in time: the turn rises and falls over a quarter of a second, in the frame of the collar bone, which carries
the arm. Frames without need keep their bits.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.errors import format_count
from ..base.time_series import compute_running_maximum, hann_smooth
from ..base.vectors import cross_product, dot_products, measure_lengths, unit_vectors
from ..motion import quaternion
from ..motion.humanoid import Limb, identify_joints
from ..motion.motion import Motion, compute_pose, forward_kinematics
from ..motion.retargeting.neutral import build_neutral_stance
from ..motion.retargeting.structure import list_ancestors
from ..motion.skeleton import Skeleton
from .trunk import PosedTrunk, Trunk, build_trunk, measure_depth, pose_trunk

CLEARANCE = 0.025
"""m from the skin of the trunk to the middle of an arm's bones, at a stature of 1.80 m: the arm touches the shirt."""
EASE_SECONDS = 0.12
"""s before and after a frame of need over which the turn stays, and again over which it rises or falls."""
MAX_TURN = np.radians(40.0)
"""Largest turn of one pass: a hand close to its own shoulder has no lever."""

_HAND_LENGTH = 0.09  # m from the wrist to the knuckles, at 1.80 m
_ALONG = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)  # points along the forearm, from the elbow
_PASSES = 3


class ArmClearance:
    """Clears the arms of all recordings of a library, once, and remembers how deep they were.

    Attributes:
        depths: m, of each motion with an arm inside: how deep.
    """

    def __init__(self, example: Motion):
        """Build the trunk.

        Args:
            example: frames of all motions, on their skeleton (`neutral.build_neutral_stance`).
        """
        self._trunk = build_trunk(build_neutral_stance(example.skeleton, example))
        self.depths: list[float] = []

    def clear(self, motion: Motion) -> Motion:
        """Return the motion with its arms outside the trunk."""
        cleared = clear_arms(motion, self._trunk)
        if cleared is not motion:
            depth = measure_arm_depth(motion.skeleton, *forward_kinematics(motion), self._trunk).max()
            self.depths += [float(depth)] if depth > 0.0 else []
        return cleared

    def describe(self) -> list[str]:
        """Describe what was changed: one line, or none."""
        if not self.depths:
            return []
        return [f"arms moved out of the trunk in {format_count(len(self.depths), 'clip')}, where they were up to "
                f"{100 * np.max(self.depths):.0f} cm inside"]


def clear_arms(motion: Motion, trunk: Trunk) -> Motion:
    """Keep the arms of a motion out of the trunk.

    Args:
        motion: T frames.
        trunk: of the body with this skeleton.
    Returns:
        The motion; the motion itself where no arm is inside.
    """
    limbs, parents = _list_arms(motion.skeleton), motion.skeleton.parents
    ends = {*trunk.joints.ravel().tolist(), *(limb.hand for limb in limbs)}
    needed = {joint for end in ends for joint in list_ancestors(parents, end)}
    places, world = compute_pose(motion.skeleton, motion.root_positions, motion.rotations, needed)
    posed, rotations = pose_trunk(trunk, places, world), None
    for limb in limbs:
        turn = _find_turn(posed, limb, places, world[:, parents[limb.upper_arm]], scale=trunk.scale, fps=motion.fps)
        if turn is not None:
            rotations = np.array(motion.rotations) if rotations is None else rotations
            moved = np.abs(turn[:, 0]) < 1.0
            rotations[moved, limb.upper_arm] = quaternion.multiply(turn[moved], rotations[moved, limb.upper_arm])
    return motion if rotations is None else replace(motion, rotations=rotations)


def measure_arm_depth(skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray, trunk: Trunk) -> np.ndarray:
    """Measure how deep the deepest point of both arms is inside the trunk.

    Args:
        skeleton: J joints.
        positions: (T, J, 3) m, its joints, world.
        rotations: (T, J, 4), the same.
        trunk: of the body with this skeleton.
    Returns:
        (T,) m from the skin of the trunk to the middle of elbow, forearm or hand, negative outside; minus infinity
        above and below it, and without arms.
    """
    points = [list_arm_points(limb, positions, trunk.scale) for limb in _list_arms(skeleton)]
    if not points:
        return np.full(len(positions), -np.inf)
    return measure_depth(pose_trunk(trunk, positions, rotations), np.concatenate(points))[0].max(axis=0)


def _list_arms(skeleton: Skeleton) -> list[Limb]:
    """List the limbs of both sides that have a whole arm."""
    body = identify_joints(skeleton)
    return [limb for limb in (body.left, body.right) if None not in (limb.upper_arm, limb.lower_arm, limb.hand)]


def list_arm_points(limb: Limb, places: np.ndarray, scale: float) -> np.ndarray:
    """List points along an arm, from the elbow to the knuckles.

    Args:
        limb: a limb with an arm.
        places: (T, J, 3) m, joints, world.
        scale: the stature relative to 1.80 m.
    Returns:
        (P, T, 3) m.
    """
    elbow, wrist = places[:, limb.lower_arm], places[:, limb.hand]
    bone = wrist - elbow
    points = np.moveaxis(np.empty((3, len(_ALONG) + 1, len(places))), 0, 2)  # by component in memory, as poses are
    for number, share in enumerate(_ALONG):
        points[number] = elbow + share * bone
    points[-1] = wrist + scale * _HAND_LENGTH * unit_vectors(bone)
    return points


def _find_turn(trunk: PosedTrunk, limb: Limb, places: np.ndarray, carrier: np.ndarray, *, scale: float,
               fps: float) -> np.ndarray | None:
    """Find the turns (T, 4) of an upper arm, in the frame of the joint that carries it, rotated by `carrier` (T, 4);
    None where nothing is to be cleared.
    """
    shoulder, points = places[:, limb.upper_arm], list_arm_points(limb, places, scale)
    back, total = quaternion.inverse(carrier), None
    for _ in range(_PASSES):
        needed = _find_needed_turn(trunk, points, shoulder, CLEARANCE * scale)
        if not needed.any():
            break
        turn = quaternion.from_rotation_vector(_ease(quaternion.rotate(back, needed), fps))
        total = turn if total is None else quaternion.multiply(turn, total)
        arm = quaternion.rotate(back, points - shoulder)
        points = shoulder + quaternion.rotate(carrier, quaternion.rotate(turn, arm))
    return total


def _find_needed_turn(trunk: PosedTrunk, points: np.ndarray, shoulder: np.ndarray, clearance: float) -> np.ndarray:
    """Find the least rotation vector (T, 3), world, about a shoulder (T, 3) m that brings the point (P, T, 3) m which
    needs the largest one `clearance` m out of the trunk; 0 where none needs any.
    """
    depth, way = measure_depth(trunk, points)
    need = np.maximum(depth + clearance, 0.0)
    lever = cross_product(points - shoulder, way)
    turn = (need / np.maximum(dot_products(lever, lever), 1e-6))[..., None] * lever
    angle = measure_lengths(turn)
    worst = np.argmax(angle, axis=0)
    frames = np.arange(len(shoulder))
    most = angle[worst, frames]
    return turn[worst, frames] * (np.minimum(most, MAX_TURN) / np.maximum(most, 1e-12))[:, None]


def _ease(turn: np.ndarray, fps: float) -> np.ndarray:
    """Ease rotation vectors (T, 3) in and out: everywhere as large as they are, but smooth in size and direction."""
    reach = max(1, int(round(EASE_SECONDS * fps)))
    size = hann_smooth(compute_running_maximum(measure_lengths(turn), reach, reach), reach)
    direction = np.stack([hann_smooth(column, 2 * reach) for column in turn.T], axis=1)
    return size[:, None] * unit_vectors(direction, min_length=1e-12)
