"""T-poses and A-poses at the start and the end of recordings, which calibrate a capture.

Such a stretch is upright and still, with both arms straight, out to the sides: level, or lower in an A-pose. It ends
with a jump where it was put before the motion, else the performer lowers the arms.
"""

from __future__ import annotations

import numpy as np

from ..base.time_series import compute_running_maximum
from ..base.vectors import dot_products, measure_lengths, unit_vectors
from .humanoid import Humanoid, Limb, identify_joints
from .motion import Motion, compute_pose, forward_kinematics

# vertical part of the arms' directions: a T-pose's at most, an A-pose's at least; and that of lowered arms
_RAISED, _APART, _LOWERED = np.sin(np.radians(20.0)), np.sin(np.radians(-50.0)), np.sin(np.radians(-60.0))
# parts of the arms' directions to their side at least and ahead at most; least cosines between upper arm and forearm,
# trunk and vertical, leg and vertical (legs are apart in the rest poses of some skeletons)
_SIDEWAYS, _AHEAD, _STRAIGHT, _UPRIGHT_TRUNK, _UPRIGHT_LEG = 0.4, 0.5, 0.9, 0.94, 0.82
_STILL_SPEED, _STILL_SECONDS = 0.4, 0.2  # m/s of the fastest joint over s
_JUMP = 0.15  # m that both hands move in the frame after a T-pose that is shorter than _STILL_SECONDS
_LOWERING_SECONDS = 2.0  # s at most until the arms are lowered
_LEAST_SECONDS = 0.2  # s of motion; a recording with less of it shows nothing but the T-pose


def find_t_poses(motion: Motion) -> tuple[int, int]:
    """Find the T-poses at the start and the end of a recording, each with the frames in which the arms are lowered.

    Args:
        motion: T frames.
    Returns:
        Number of frames at the start and at the end; (T, 0) where the recording shows nothing else.
    Raises:
        InputError: if the skeleton has no legs.
    """
    body, ends = identify_joints(motion.skeleton), [0, -1]
    if not all(_has_arm(limb) for limb in (body.left, body.right)):
        return 0, 0
    outer = compute_pose(motion.skeleton, motion.root_positions[ends], motion.rotations[ends])[0]
    if not _select_t_poses(outer, body).any():  # all of a recording takes a thousand times as long
        return 0, 0
    places = forward_kinematics(motion)[0]
    start, end = (_measure_first(one, body, motion.fps) for one in (places, places[::-1]))
    if (start or end) and len(motion) - start - end < _LEAST_SECONDS * motion.fps:
        return len(motion), 0
    return start, end


def _has_arm(limb: Limb) -> bool:
    return None not in (limb.upper_arm, limb.lower_arm, limb.hand)


def _compute_arms(places: np.ndarray, body: Humanoid) -> np.ndarray:
    """Compute the directions (T, 2, 2, 3) of left and right upper arm and forearm from positions (T, J, 3)."""
    chains = np.array([[limb.upper_arm, limb.lower_arm, limb.hand] for limb in (body.left, body.right)])
    return unit_vectors(np.diff(places[:, chains], axis=2), fallback=0.0)


def _select_t_poses(places: np.ndarray, body: Humanoid) -> np.ndarray:
    """Select the frames (T,) bool of positions (T, J, 3) m that show a T-pose or an A-pose."""
    limbs = body.left, body.right
    arms = _compute_arms(places, body)
    upper_legs, feet = [limb.upper_leg for limb in limbs], [limb.foot for limb in limbs]
    left = unit_vectors(places[:, upper_legs[0]] - places[:, upper_legs[1]], fallback=0.0)
    ahead = left[:, [1, 0, 2]] * (1.0, -1.0, 0.0)
    trunk = unit_vectors(places[:, body.neck_or_chest] - places[:, body.hips], fallback=0.0)[:, 2]
    legs = unit_vectors(places[:, upper_legs] - places[:, feet], fallback=0.0)[..., 2]
    aside = dot_products(arms, left[:, None, None]) * [[1.0], [-1.0]]
    is_apart = (arms[..., 2] < _RAISED) & (arms[..., 2] > _APART) & (aside > _SIDEWAYS)
    is_apart &= np.abs(dot_products(arms, ahead[:, None, None])) < _AHEAD
    is_straight = dot_products(arms[:, :, 0], arms[:, :, 1]) > _STRAIGHT
    return (is_apart.all(axis=(1, 2)) & is_straight.all(axis=1) & (trunk > _UPRIGHT_TRUNK)
            & (legs > _UPRIGHT_LEG).all(axis=1))


def _measure_first(places: np.ndarray, body: Humanoid, fps: float) -> int:
    """Measure for how many frames positions (T, J, 3) m begin with a T-pose, until the arms are lowered."""
    shown, reach = _select_t_poses(places, body), max(1, int(round(_STILL_SECONDS * fps)))
    later = np.minimum(np.arange(len(places)) + reach, len(places) - 1)
    is_still = measure_lengths(places[later] - places).max(axis=1) * fps < _STILL_SPEED * reach
    if not shown[0]:
        return 0
    # hands that shake at the limits of a T-pose do not end it
    end = 1 + int(np.flatnonzero(shown[: _count_leading(compute_running_maximum(shown, 0, reach // 2))])[-1])
    if not (is_still[0] or end < reach and _jumps(places[end - 1 : end + 1], body)):
        return 0
    return end + _count_lowering(_compute_arms(places[end - 1 :], body), fps)


def _count_leading(flags: np.ndarray) -> int:
    """Count the True at the start of flags (T,)."""
    return len(flags) if flags.all() else int(np.argmin(flags))


def _jumps(places: np.ndarray, body: Humanoid) -> bool:
    """Whether both hands move too far between two frames, (2, J, 3) m."""
    hands = places[:, [body.left.hand, body.right.hand]]
    return len(places) == 2 and bool(measure_lengths(hands[1] - hands[0]).min() > _JUMP)


def _count_lowering(arms: np.ndarray, fps: float) -> int:
    """Count the frames, after the first, in which the higher arm of directions (T, 2, 2, 3) sinks until it hangs."""
    height = arms[: int(_LOWERING_SECONDS * fps) + 1, :, 0, 2].max(axis=1)
    before = height[np.maximum(np.arange(1, len(height)) - max(1, int(_STILL_SECONDS * fps)), 0)]
    return _count_leading((height[1:] < before) & (height[1:] > _LOWERED))
