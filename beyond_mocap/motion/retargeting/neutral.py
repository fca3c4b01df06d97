"""The neutral stance of any humanoid skeleton: upright, facing +X, legs straight down, arms hanging, soles flat.

Skeletons rest in all kinds of poses (CMU's legs splay, LAFAN1's limbs all lie along X, Mixamo forms a T). Everything in
anatomical terms ("thigh 20 degrees forward") is relative to this one stance, so it holds for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.vectors import arctan2, cross_product, unit_vectors
from .. import quaternion
from ..humanoid import Humanoid, Limb, compute_heading_from_positions, identify_joints
from ..motion import Motion, compute_local_rotations, compute_pose, forward_kinematics
from ..skeleton import Skeleton, freeze_array
from .structure import list_descendants

_UP = np.array([0.0, 0.0, 1.0])
_DOWN = -_UP
# a collar bone within this angle of sideways is left as the skeleton has it
_COLLAR_TOLERANCE = np.radians(40.0)
# a spine within this angle of upright, a toe within this angle of level, is left as it is
_UPRIGHT_TOLERANCE = np.radians(25.0)
# legs within this angle of the vertical count as standing
_MAX_SPLAY = np.radians(40.0)
# usual slope of the line ankle-ball of a flat foot
_SOLE_SLOPE = np.radians(22.0)
# height of the ball of the foot (the toe joint) above the ground, share of the leg's length
_BALL_HEIGHT = 0.022


@dataclass(frozen=True, eq=False, kw_only=True)
class NeutralStance:
    """A skeleton in its neutral stance.

    Attributes:
        skeleton: J joints.
        rotations: (J, 4) world rotation of each joint.
        positions: (J, 3) metres, the ground at z = 0, mid-hip above the origin.
        leg: thigh plus shank, metres.
        ankle_height: metres.
        ball: (2, 3) metres from ankle to toe joint (left, right) with the sole flat.
        heel: metres from the ankle's foot point back to the heel.
        tip: metres from toe joint to toe tip.
    """

    skeleton: Skeleton
    rotations: np.ndarray
    positions: np.ndarray
    leg: float
    ankle_height: float
    ball: np.ndarray
    heel: float
    tip: float


def build_neutral_stance(skeleton: Skeleton, example: Motion | None = None) -> NeutralStance:
    """Build the neutral stance of a skeleton.

    Args:
        skeleton: J joints.
        example: a recording on the skeleton. Its most upright frames show how bones are twisted about their own length
            and how a flat foot lies, which bone directions alone leave open. Needed where synthetic and recorded motion
            are blended, and where a skeleton's rest pose does not stand (LAFAN1, Bandai).
    Returns:
        The stance.
    Raises:
        InputError: if hips or legs cannot be found.
    """
    body = identify_joints(skeleton)
    world = np.array(_build_initial_rotations(skeleton, body, example))
    slopes = [_measure_sole_slope(skeleton, limb, world, example) for limb in (body.left, body.right)]
    _straighten_limbs(skeleton, body, world, slopes)
    local = compute_local_rotations(skeleton, world)
    positions, _ = compute_pose(skeleton, np.zeros((1, 3)), local[None])
    return _measure_stance(skeleton, body, world, positions[0])


def scale_stance(stance: NeutralStance, size: float) -> NeutralStance:
    """Scale a stance, with its skeleton."""
    names = "positions", "leg", "ankle_height", "ball", "heel", "tip"
    lengths = {name: getattr(stance, name) * size for name in names}
    return replace(stance, skeleton=stance.skeleton.scale(size), **lengths)


def is_rest_upright(skeleton: Skeleton) -> bool:
    """Whether the rest pose (no joint rotated) stands: its spine is upright and its legs hang, if splayed."""
    body = identify_joints(skeleton)
    places, _ = compute_pose(skeleton, np.zeros((1, 3)), quaternion.identity(1, len(skeleton)))
    top = next(j for j in (body.neck, body.head, body.chest, body.hips) if j is not None)
    bones = [(body.hips, top, _UP, _UPRIGHT_TOLERANCE)]
    bones += [(leg.upper_leg, leg.foot, _DOWN, _MAX_SPLAY) for leg in (body.left, body.right)]
    return all(
        unit_vectors(places[0, low] - places[0, high], -way) @ way > np.cos(most) for high, low, way, most in bones
    )


def _build_initial_rotations(skeleton: Skeleton, body: Humanoid, example: Motion | None) -> np.ndarray:
    """Build the initial world rotations (J, 4), facing +X: the example's upright frames, or the rest pose set upright.
    """
    if example is not None:
        return _average_upright_frames(skeleton, body, example)
    places, _ = compute_pose(skeleton, np.zeros((1, 3)), quaternion.identity(1, len(skeleton)))
    places = places[0]
    across = places[body.left.upper_leg] - places[body.right.upper_leg]
    top = next(j for j in (body.neck, body.head, body.chest, body.hips) if j is not None)
    up = places[top] - places[body.hips]
    if np.linalg.norm(up) < 1e-6:
        up = places[body.hips] - 0.5 * (places[body.left.foot] + places[body.right.foot])
    left = unit_vectors(across, np.array([0.0, 1.0, 0.0]))
    if unit_vectors(up, _UP)[2] > np.cos(_UPRIGHT_TOLERANCE):
        # a skeleton that rests upright keeps its own posture
        left, up = unit_vectors(left * [1.0, 1.0, 0.0], left), _UP
    up = unit_vectors(up - np.dot(up, left) * left, _UP)
    frame = quaternion.from_axes(cross_product(left, up), left, up)
    return np.broadcast_to(quaternion.inverse(frame), (len(skeleton), 4))


def _average_upright_frames(skeleton: Skeleton, body: Humanoid, example: Motion) -> np.ndarray:
    """Average the world rotations (J, 4) of the tenth of the frames that look most like standing, each turned to face
    +X.
    """
    places, world = forward_kinematics(example)
    score = _score_uprightness(body, places)
    chosen = np.argsort(-score, kind="stable")[: max(len(score) // 10, 1)]
    turn = quaternion.from_up_angle(-compute_heading_from_positions(skeleton, places[chosen]))
    rotated = quaternion.multiply(turn[:, None], world[chosen])
    alike = np.sign(np.sum(rotated * rotated[:1], axis=-1, keepdims=True))
    return quaternion.normalize(np.sum(rotated * np.where(alike == 0.0, 1.0, alike), axis=0))


def _score_uprightness(body: Humanoid, places: np.ndarray) -> np.ndarray:
    """Score how much each frame (T,) looks like standing: limbs that hang, a head that is high."""
    score = np.zeros(len(places))
    for limb in (body.left, body.right):
        for high, low in (
            (limb.upper_leg, limb.lower_leg), (limb.lower_leg, limb.foot), (limb.upper_arm, limb.lower_arm)
        ):
            if high is not None and low is not None:
                score += unit_vectors(places[:, low] - places[:, high], _DOWN) @ _DOWN
    return score


def _straighten_limbs(skeleton: Skeleton, body: Humanoid, world: np.ndarray, slopes: list[float]) -> None:
    """Rotate limbs in `world` (J, 4), parents first, each with all that hangs on it, in the shorter direction."""
    for limb, side, slope in ((body.left, 1.0, slopes[0]), (body.right, -1.0, slopes[1])):
        if limb.shoulder is not None and limb.upper_arm is not None:
            sideways = np.array([0.0, side, 0.0])
            if _measure_bone_angle(skeleton, world, limb.shoulder, limb.upper_arm, sideways) > _COLLAR_TOLERANCE:
                _point_bone(skeleton, world, limb.shoulder, limb.upper_arm, sideways)
        for high, low in ((limb.upper_arm, limb.lower_arm), (limb.lower_arm, limb.hand), (limb.hand, None)):
            if high is not None:
                _point_bone(skeleton, world, high, low, _DOWN)
        _point_bone(skeleton, world, limb.upper_leg, limb.lower_leg, _DOWN)
        _point_bone(skeleton, world, limb.lower_leg, limb.foot, _DOWN)
        _flatten_foot(skeleton, world, limb, slope)


def _measure_sole_slope(skeleton: Skeleton, limb: Limb, world: np.ndarray, example: Motion | None) -> float:
    """Measure how steeply, in radians, the line from ankle to toe joint falls while the sole is flat.

    In the example: where the ankle is in its lowest quarter. Else as the skeleton rests, or a usual slope where that
    pose shows no flat foot.
    """
    if example is not None and limb.toe is not None:
        places, _ = forward_kinematics(example)
        ankle = places[:, limb.foot]
        bones = places[:, limb.toe] - ankle
        low = ankle[:, 2] <= np.quantile(ankle[:, 2], 0.25)
        slope = float(np.median(arctan2(-bones[low, 2], np.hypot(bones[low, 0], bones[low, 1]))))
        return float(np.clip(slope, np.radians(5.0), np.radians(50.0)))
    direction = _compute_bone_direction(skeleton, world, limb.foot, limb.toe)
    slope = float(np.arctan2(-direction[2], np.hypot(direction[0], direction[1])))
    return slope if direction[0] > 0.5 and np.radians(5.0) < slope < np.radians(50.0) else _SOLE_SLOPE


def _flatten_foot(skeleton: Skeleton, world: np.ndarray, limb: Limb, slope: float) -> None:
    _point_bone(skeleton, world, limb.foot, limb.toe, np.array([np.cos(slope), 0.0, -np.sin(slope)]))
    ahead = np.array([1.0, 0.0, 0.0])
    if limb.toe is not None and _has_tip(skeleton, limb.toe):
        if _measure_bone_angle(skeleton, world, limb.toe, None, ahead) > _UPRIGHT_TOLERANCE:
            _point_bone(skeleton, world, limb.toe, None, ahead)


def _has_tip(skeleton: Skeleton, joint: int) -> bool:
    return bool(np.linalg.norm(skeleton.tip_offset(joint)) > 1e-4)


def _compute_bone_direction(skeleton: Skeleton, world: np.ndarray, joint: int, child: int | None) -> np.ndarray:
    """Compute the world direction (3,) of the bone from `joint` to `child` (or to its tip, or continuing its parent's
    bone).
    """
    if child is not None:
        return unit_vectors(_compute_world_offset(skeleton, world, joint, child), _DOWN)
    offset = skeleton.tip_offset(joint) if _has_tip(skeleton, joint) else skeleton.offsets[joint]
    return unit_vectors(quaternion.rotate(world[joint], offset), _DOWN)


def _compute_world_offset(skeleton: Skeleton, world: np.ndarray, joint: int, below: int) -> np.ndarray:
    """Compute the vector (3,) from `joint` to a joint `below` it, metres, world."""
    total = np.zeros(3)
    while below != joint:
        total = total + quaternion.rotate(world[skeleton.parents[below]], skeleton.offsets[below])
        below = skeleton.parents[below]
    return total


def _measure_bone_angle(skeleton: Skeleton, world: np.ndarray, joint: int, child: int | None,
                        target: np.ndarray) -> float:
    return float(np.arccos(np.clip(np.dot(_compute_bone_direction(skeleton, world, joint, child), target), -1.0, 1.0)))


def _point_bone(skeleton: Skeleton, world: np.ndarray, joint: int, child: int | None, target: np.ndarray) -> None:
    """Rotate `joint` and all below it so that its bone points along `target`; a half turn is about the body's X."""
    direction = _compute_bone_direction(skeleton, world, joint, child)
    turn = quaternion.rotation_between(direction, target)
    if np.dot(direction, target) < -0.999:
        turn = quaternion.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.pi)
    for other in list_descendants(skeleton.parents, joint):
        world[other] = quaternion.multiply(turn, world[other])


def _measure_stance(skeleton: Skeleton, body: Humanoid, world: np.ndarray, places: np.ndarray) -> NeutralStance:
    """Measure the stance: leg and foot lengths, and positions with the ground at z = 0."""
    limbs = (body.left, body.right)
    legs = [
        np.linalg.norm(places[limb.lower_leg] - places[limb.upper_leg])
        + np.linalg.norm(places[limb.foot] - places[limb.lower_leg])
        for limb in limbs
    ]
    leg = float(np.mean(legs))
    ball = np.array([_measure_foot_ball(places, limb, leg) for limb in limbs])
    toes = [limb.toe for limb in limbs if limb.toe is not None and _has_tip(skeleton, limb.toe)]
    tips = [np.linalg.norm(skeleton.tip_offset(toe)) for toe in toes]
    middle = 0.5 * (places[body.left.upper_leg] + places[body.right.upper_leg])
    ankle_height = float(np.mean(-ball[:, 2])) + _BALL_HEIGHT * leg
    ground = np.mean([places[limb.foot, 2] for limb in limbs]) - ankle_height
    positions = places - np.array([middle[0], middle[1], ground])
    return NeutralStance(
        skeleton=skeleton, rotations=freeze_array(world), positions=freeze_array(positions), leg=leg,
        ankle_height=ankle_height, ball=freeze_array(ball), heel=0.065 * leg,
        tip=float(np.mean(tips)) if tips else 0.075 * leg,
    )


def _measure_foot_ball(places: np.ndarray, limb: Limb, leg: float) -> np.ndarray:
    """Measure the vector (3,) m from ankle to ball of the foot; a usual one where the skeleton has no toe joint."""
    if limb.toe is None:
        return leg * np.array([0.155, 0.0, -0.065])
    return places[limb.toe] - places[limb.foot]
