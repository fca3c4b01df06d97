"""A body on the ground: how thick it is at each joint, how low it can lie, and a pose of lying on the side.

A skeleton has no flesh; a joint lies as far above the ground as the body is thick there, in round figures for an adult.
"""

from __future__ import annotations

import numpy as np

from ..base.vectors import unit_vectors
from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion, compute_pose, forward_kinematics
from ..motion.retargeting.neutral import NeutralStance
from ..motion.retargeting.posture import Posture, to_motion
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann
from . import gait_tables as tables

THICKNESS = {
    "hips": 0.09, "chest": 0.09, "neck": 0.06, "head": 0.07, "shoulder": 0.06, "upper_arm": 0.06, "lower_arm": 0.04,
    "hand": 0.03, "upper_leg": 0.08, "lower_leg": 0.05, "foot": 0.04, "toe": 0.02,
}
"""Metres from a joint to the skin below it."""

_OTHER_THICKNESS, _TIP_THICKNESS = 0.02, 0.01  # m: thickness at other joints and at tips
_ARM_ANGLES = np.radians(np.arange(0.0, 100.0, 1.0))  # rad by which an arm can be turned up
# shares of the leg's length below which the knee of a kneeling leg is, and hips and knee of a lying one
_KNEELING, _LYING_HIPS, _LYING_KNEE = 0.16, 0.38, 0.25
_SMOOTH_SECONDS = 0.3  # s over which corrections are smoothed


def compute_lowest_root(skeleton: Skeleton, rotations: np.ndarray, arms: bool = True) -> np.ndarray:
    """Compute the height of the root at which the lowest part of the body touches the ground.

    Args:
        skeleton: the skeleton.
        rotations: (T, J, 4) local.
        arms: whether arms count; they yield where a body falls or rolls onto them (`raise_arms`).
    Returns:
        (T,) m.
    """
    places, world = compute_pose(skeleton, np.zeros((len(rotations), 3)), rotations)
    without = set() if arms else {joint for chain in _list_arms(skeleton) for joint in chain}
    points = [(place, thick) for joint, place, thick in iter_surface(skeleton, places, world) if joint not in without]
    return -np.min([place[:, 2] - thick for place, thick in points], axis=0)


def detect_lying_legs(motion: Motion) -> np.ndarray:
    """Detect legs that lie or kneel: their feet bear no weight, and a foot that is held would push its knee below.

    Args:
        motion: T frames on a ground of height 0.
    Returns:
        (T, 2, 1) bool, left and right leg; not one with its knee up, as in sitting.
    """
    body, (places, _) = identify_joints(motion.skeleton), forward_kinematics(motion)
    legs = [float(np.linalg.norm(motion.skeleton.offsets[[side.lower_leg, side.foot]], axis=1).sum())
            for side in (body.left, body.right)]
    hips, knees = (places[:, joints, 2] / legs
                   for joints in ([body.hips], [body.left.lower_leg, body.right.lower_leg]))
    return ((knees < _KNEELING) | ((hips < _LYING_HIPS) & (knees < _LYING_KNEE)))[..., None]


def raise_arms(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, fps: float) -> np.ndarray:
    """Turn arms that reach below the ground up at the shoulder, smoothly over time, so that little of them stays below.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m.
        rotations: (T, J, 4) local.
        fps: frames per second.
    Returns:
        (T, J, 4) local rotations.
    """
    places, world = compute_pose(skeleton, root, rotations)
    out = rotations.copy()
    for chain in _list_arms(skeleton):
        shoulder = places[:, chain[0]]
        points = [(p - shoulder, thick) for joint, p, thick in iter_surface(skeleton, places, world)
                  if joint in chain[1:]]
        out_level = points[-1][0][:, :2]
        level = unit_vectors(out_level)
        along = np.stack([np.sum(p[:, :2] * level, axis=1) for p, _ in points], axis=1)[..., None]
        above = np.stack([p[:, 2] for p, _ in points], axis=1)[..., None]
        thick = np.array([t for _, t in points])[:, None]
        # height of each point of the arm for each angle in _ARM_ANGLES: (T, points, angles)
        heights = above * np.cos(_ARM_ANGLES) + along * np.sin(_ARM_ANGLES) - thick + shoulder[:, 2, None, None]
        angle = _ARM_ANGLES[_find_first_above(heights.min(axis=1))]
        axis = np.stack([level[:, 1], -level[:, 0], np.zeros(len(level))], axis=1)
        turn = smooth_zero_phase_hann(axis * smooth_above(angle, fps)[:, None], fps, _SMOOTH_SECONDS)
        rotated = quaternion.multiply(quaternion.from_rotation_vector(turn), world[:, chain[0]])
        parent = world[:, skeleton.parents[chain[0]]]
        is_moved = np.any(turn != 0.0, axis=1)[:, None]
        out[:, chain[0]] = np.where(is_moved, quaternion.multiply(quaternion.inverse(parent), rotated),
                                    out[:, chain[0]])
    return out


def smooth_above(values: np.ndarray, fps: float) -> np.ndarray:
    """Compute a smooth curve (T,) that is nowhere below `values` (T,) >= 0: a running maximum, then a running mean."""
    width = 2 * int(_SMOOTH_SECONDS * fps / 2) + 1
    from scipy.ndimage import maximum_filter1d, uniform_filter1d

    return uniform_filter1d(maximum_filter1d(values, width), width)


def _find_first_above(height: np.ndarray) -> np.ndarray:
    """Find the first column (T,) of height (T, A) m that is not below the ground; the highest if all are below."""
    is_above = height >= 0.0
    return np.where(is_above.any(axis=1), np.argmax(is_above, axis=1), np.argmax(height, axis=1))


def _list_arms(skeleton: Skeleton) -> list[list[int]]:
    """List the joints of both arms from the upper arm on, with fingers."""
    body = identify_joints(skeleton)
    tops = [limb.upper_arm for limb in (body.left, body.right) if limb.upper_arm is not None]
    return [[joint for joint in range(top, len(skeleton)) if _is_below(skeleton, joint, top)] for top in tops]


def _is_below(skeleton: Skeleton, joint: int, top: int) -> bool:
    while joint > top:
        joint = skeleton.parents[joint]
    return joint == top


def iter_surface(skeleton: Skeleton, places: np.ndarray, world: np.ndarray):
    """Iterate over (joint, place (T, 3) m, thickness m) of every joint and every tip."""
    for joint, thick in enumerate(compute_thickness(skeleton)):
        yield joint, places[:, joint], thick
    for joint, tip in zip(skeleton.end_parents, skeleton.end_offsets):
        yield joint, places[:, joint] + quaternion.rotate(world[:, joint], tip), _TIP_THICKNESS


def compute_thickness(skeleton: Skeleton) -> np.ndarray:
    """Compute the distance (J,) m from each joint to the skin."""
    body = identify_joints(skeleton)
    parts = [("chest", joint) for joint in body.spine]
    parts += [(role, getattr(limb, role)) for limb in (body.left, body.right) for role in THICKNESS
              if hasattr(limb, role)]  # fmt: skip
    out = np.full(len(skeleton), _OTHER_THICKNESS)
    for role, joint in (*parts, ("neck", body.neck), ("head", body.head), ("hips", body.hips)):
        if joint is not None:
            out[joint] = THICKNESS[role]
    return out


# degrees: flexion, abduction, inward turn and elbow of the lower and the upper arm; metres for an adult: ankles ahead
# of the hips, along the body and above their middle; degrees: roll to the front, bend of spine and head
_LANDING = {
    "arms": ((150, 0, 0, 18), (140, 6, 10, 30)), "ankles": ((0.12, 0.74, -0.12), (0.22, 0.62, -0.02)), "roll": 8.0,
    "spine": (6.0, -4.0), "head": (4.0, 10.0),
}
_LYING = {
    "arms": ((160, 10, 0, 50), (88, -4, 22, 70)), "ankles": ((0.10, 0.62, -0.13), (0.20, 0.52, -0.07)), "roll": 22.0,
    "spine": (14.0, 0.0), "head": (10.0, 6.0),
}
# degrees that are tried so that the body lies low: the trunk sloping up to the shoulder, the lower arm drawn in
_SLOPES, _DRAWN_IN = np.meshgrid(np.arange(-6.0, 22.0, 4.0), np.arange(-5.0, 46.0, 10.0))


def build_lying_pose(neutral: NeutralStance, left: bool, settled: bool) -> np.ndarray:
    """Build a pose of lying on one side, facing along +X.

    Of several slopes of the trunk and places of the lower arm, which differ by skeleton, the one with the lowest body
    wins.

    Args:
        neutral: neutral stance of the body.
        left: whether on the left side.
        settled: False: landing, arms stretched beyond the head; True: arms and knees drawn in, rolled a little forward.
    Returns:
        (J, 4) local rotations.
    """
    table = _LYING if settled else _LANDING
    variants = to_motion(_build_variants(table, neutral, left), neutral)
    body = identify_joints(neutral.skeleton)
    root = np.zeros((len(variants), 3))
    root[:, 2] = compute_lowest_root(neutral.skeleton, variants.rotations)
    places, _ = compute_pose(neutral.skeleton, root, variants.rotations)
    return variants.rotations[int(np.argmin(places[:, body.hips, 2] + 0.5 * places[:, body.chest, 2]))]


def _build_variants(table: dict, neutral: NeutralStance, left: bool) -> Posture:
    """Build all variants of lying of a table, one frame each."""
    sign, scale, count = 1.0 if left else -1.0, neutral.leg / tables.LEG, _SLOPES.size
    arms, ankles, feet = np.zeros((count, 2, 5)), np.zeros((count, 2, 3)), np.zeros((count, 2, 3))
    hips = np.tile([0.0, 0.0, 0.2], (count, 1))
    for row, side in enumerate((0, 1) if left else (1, 0)):
        arms[:, side, :4] = np.radians(table["arms"][row])
        ahead, along, above = np.array(table["ankles"][row]) * scale
        ankles[:, side] = hips + [ahead, -sign * along, above]
        feet[:, side] = np.radians([-90.0 * sign, 0.0, -35.0 * sign])
    arms[:, 0 if left else 1, 1] -= np.radians(_DRAWN_IN.ravel())
    # on the side, sloping, then rolled to the front about the body's own length, which points to the left or right
    slope = np.radians(sign * (_SLOPES.ravel() - 90.0))
    side_on = quaternion.from_rotation_vector(slope[:, None] * [1.0, 0.0, 0.0])
    roll = quaternion.from_rotation_vector(np.radians([0.0, table["roll"], 0.0]))
    tilt, bend = np.radians(table["spine"])
    nod, side_nod = np.radians(table["head"])
    one = np.ones((count, 1))
    return Posture(
        fps=30.0, hips=hips, heading=np.zeros(count),
        pelvis=quaternion.to_rotation_vector(quaternion.multiply(roll, side_on)), spine=one * [sign * bend, tilt, 0.0],
        head=one * [sign * side_nod, nod, 0.0], arms=arms, wrists=np.zeros((count, 2)), ankles=ankles, feet=feet,
        toes=np.zeros((count, 2)), knees=np.zeros((count, 2)),
    )
