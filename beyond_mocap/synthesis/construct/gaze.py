"""Heads that follow the ball: the gaze turns smoothly to a moving place, within the range of a neck.

The turn of the head is a continuous function of the direction in which the ball lies as the body sees it. Ahead it is
that direction, within the limits of a neck; to the side it stays at its limit; behind the body it returns to looking
ahead, and so changes sides without a jump; overhead, where there is no side, it looks up. The result is smoothed over
time. Neck and chest take a share of each turn.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.easing import smoothstep
from ...base.vectors import arctan2, unit_vectors
from ...motion import quaternion
from ...motion.humanoid import compute_heading_from_positions, identify_joints
from ...motion.motion import Motion, forward_kinematics
from ...motion.track import smooth_zero_phase_hann

MAX_YAW, MAX_UP, MAX_DOWN = np.radians(75.0), np.radians(50.0), np.radians(55.0)  # from straight ahead of the body
CHEST_SHARE, NECK_SHARE = 0.12, 0.35  # shares of a turn that chest and neck take; the head takes the rest
SMOOTHING_SECONDS = 0.4  # s, window over which the head's turning is smoothed
_OVERHEAD = 0.5  # level length of a unit direction below which its side counts less and less
_NEAR_PLACE = 2.0  # m from the hips within which a place turns the shoulders less and less
_TWIST_BEHIND = np.radians(60.0)  # from straight behind within which shoulders do not know the side
_BEHIND = 0.5  # cosine from straight behind beyond which the head begins to turn back


def follow_with_gaze(
    motion: Motion, places: np.ndarray, look: np.ndarray, share: np.ndarray | float = 1.0,
    chest: np.ndarray | float = CHEST_SHARE,
) -> Motion:
    """Turn the head of a motion so that it follows a moving place.

    Args:
        motion: T frames.
        places: (T, 3) m, world, NaN where there is nothing to look at.
        look: (3,) unit, direction in which the head joint looks, in its own frame (`pins.estimate_look_axis`).
        share: (T,) share of the turn that is applied at each frame.
        chest: (T,) share of the turn that the chest takes.
    Returns:
        The motion with its head turned; the motion itself where no place is known at all.
    """
    known = np.isfinite(places).all(axis=1)
    if not known.any():
        return motion
    body = identify_joints(motion.skeleton)
    joints, world = forward_kinematics(motion)
    head = body.head_or_neck
    facing = compute_heading_from_positions(motion.skeleton, joints)
    # the place as seen from the head, in the body's facing frame
    seen = quaternion.rotate(quaternion.from_up_angle(-facing), _fill_gaps(places, known) - joints[:, head])
    yaw, pitch = smooth_zero_phase_hann(compute_head_angles(seen), motion.fps, SMOOTHING_SECONDS).T
    target = np.column_stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    target = quaternion.rotate(quaternion.from_up_angle(facing), target)
    sight = quaternion.rotate(world[:, head], np.broadcast_to(look, target.shape))
    turn = quaternion.to_rotation_vector(quaternion.rotation_between(sight, target))
    eased = np.broadcast_to(share, len(known)) * _ease_in(known, motion.fps)
    return _turn_head(motion, world, head, eased[:, None] * turn, np.broadcast_to(chest, len(known)))


MAX_TWIST = np.radians(40.0)
"""Largest twist of the shoulders against the hips; trunks reach some 45 degrees without effort."""

TWIST_SHARE = 0.6  # of the angle between hips and play that shoulders turn by
TWIST_LAG, TWIST_SECONDS = 0.15, 0.8  # s that shoulders come after the head, and window that smooths their turning


def twist_shoulders(motion: Motion, places: np.ndarray, share: np.ndarray | float = 1.0) -> Motion:
    """Twist the shoulders of a motion towards a moving place, a little after the head; legs and hips stay.

    Args:
        motion: T frames.
        places: (T, 3) m, world, NaN where there is nothing to face.
        share: (T,) share of the twist that is applied at each frame.
    Returns:
        The motion with its spine turned; the motion itself without a spine or a known place.
    """
    known = np.isfinite(places[:, :2]).all(axis=1)
    body = identify_joints(motion.skeleton)
    spine = [joint for joint in (*body.spine,) if joint not in (body.neck, body.head)]
    if not known.any() or not spine:
        return motion
    joints, world = forward_kinematics(motion)
    facing = compute_heading_from_positions(motion.skeleton, joints)
    away = _fill_gaps(places, known)[:, :2] - joints[:, body.hips, :2]
    seen = quaternion.rotate_level(away, -facing)
    near = smoothstep(np.linalg.norm(away, axis=1) / _NEAR_PLACE)
    # behind the body the side is open: the twist fades before it
    angle = arctan2(seen[:, 1], seen[:, 0])
    wanted = _limit_softly(TWIST_SHARE * angle, MAX_TWIST) * smoothstep((np.pi - np.abs(angle)) / _TWIST_BEHIND)
    late = np.maximum(np.arange(len(wanted)) - int(round(TWIST_LAG * motion.fps)), 0)
    wanted = smooth_zero_phase_hann((near * wanted)[late][:, None], motion.fps, TWIST_SECONDS)[:, 0]
    turn = np.broadcast_to(share, len(known)) * _ease_in(known, motion.fps) * wanted / len(spine)
    rotations = np.array(motion.rotations)
    for joint in spine:
        above = world[:, motion.skeleton.parents[joint]]
        axis = quaternion.rotate(quaternion.inverse(above), np.broadcast_to([0.0, 0.0, 1.0], (len(turn), 3)))
        rotations[:, joint] = quaternion.multiply(quaternion.from_axis_angle(axis, turn), rotations[:, joint])
    return replace(motion, rotations=rotations)


def compute_head_angles(seen: np.ndarray) -> np.ndarray:
    """Compute the angles by which a head turns to look in a direction; continuous except straight up and down.

    Args:
        seen: (N, 3), direction from the head, x ahead of the body, y to its left.
    Returns:
        (N, 2) rad, yaw (to the left) and pitch (up).
    """
    unit = unit_vectors(seen)
    level = np.hypot(unit[:, 0], unit[:, 1])
    back = np.maximum(-unit[:, 0] - _BEHIND * level, 0.0) / (1.0 - _BEHIND)
    side = arctan2(unit[:, 1], np.maximum(unit[:, 0], back))
    yaw = _limit_softly(side, MAX_YAW) * smoothstep(level / _OVERHEAD)
    pitch = arctan2(unit[:, 2], level)
    return np.column_stack([yaw, np.where(pitch > 0.0, _limit_softly(pitch, MAX_UP), _limit_softly(pitch, MAX_DOWN))])


def _limit_softly(angle: np.ndarray, limit: float) -> np.ndarray:
    """Limit angles (N,) softly to `limit`: up to three quarters of it they do not change."""
    free = 0.75 * limit
    over = np.maximum(np.abs(angle) - free, 0.0)
    return np.sign(angle) * (np.minimum(np.abs(angle), free) + (limit - free) * np.tanh(over / (limit - free)))


def _fill_gaps(places: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Fill unknown places (T, 3) with the last known one, or with the first known one before it."""
    at = np.flatnonzero(known)
    return places[at[np.clip(np.searchsorted(at, np.arange(len(known)), side="right") - 1, 0, None)]]


def _ease_in(known: np.ndarray, fps: float) -> np.ndarray:
    """Compute the weight (T,) of the gaze: 1 where a place is known, fading within SMOOTHING_SECONDS beside gaps."""
    if known.all():
        return np.ones(len(known))
    frames, without = np.arange(len(known)), np.flatnonzero(~known)
    # distance to the nearest frame without a place, before and behind
    after = np.searchsorted(without, frames)
    beside = (without[np.clip(after - back, 0, len(without) - 1)] for back in (0, 1))
    return smoothstep(np.minimum(*(np.abs(frames - other) for other in beside)) / (SMOOTHING_SECONDS * fps))


def _turn_head(motion: Motion, world: np.ndarray, head: int, turn: np.ndarray, chest: np.ndarray) -> Motion:
    """Turn the head by rotation vectors (T, 3) in the world; neck and chest (T,) take their shares of them."""
    body, parents = identify_joints(motion.skeleton), motion.skeleton.parents
    # shares add up along the spine: each joint carries what the joints below it have taken
    shares, cumulated = {}, np.zeros(len(turn))
    for joint, own in ((body.chest, chest), (body.neck, NECK_SHARE)):
        if joint is not None and joint not in (head, body.hips):
            cumulated = cumulated + own
            shares[joint] = cumulated
    shares[head] = np.ones(len(turn))
    rotations, moved = np.array(motion.rotations), turn.any(axis=1)
    for joint, part in shares.items():
        above = parents[joint]
        while above >= 0 and above not in shares:
            above = parents[above]
        carried = shares[above] if above >= 0 else np.zeros(len(turn))
        below = world[:, parents[joint]] if joint else np.broadcast_to(quaternion.IDENTITY, (len(turn), 4))
        below = quaternion.multiply(quaternion.from_rotation_vector(carried[:, None] * turn), below)
        own = quaternion.multiply(quaternion.from_rotation_vector(part[:, None] * turn), world[:, joint])
        local = quaternion.match_signs(quaternion.multiply(quaternion.inverse(below), own), rotations[:, joint])
        rotations[:, joint] = np.where(moved[:, None], local, rotations[:, joint])
    return replace(motion, rotations=rotations)
