"""Bodies that breathe hard after sprints: chest and shoulders rise and fall, and the trunk slumps forward a little.

Hips, legs and feet stay as they are. Head and arms keep their direction and go with neck and shoulders. The breath goes
with the clock and the player's seed alone, so takes, edits and windows of a match agree on it; sprints and recovery
only decide how deep it is. It fades while the body runs, as arms and trunk swing with every step there.

Source: at exhaustion people take 49 breaths a minute and half of each breath is inspiration ("The respiratory time and
flow profile at volitional exercise termination", J. Sports Sci.). At rest the upper ribs move 3 to 5 mm up and ahead
(De Groote 1997, J. Appl. Physiol. 83), less than a third of a deep breath (Kaneko and Horie 2012, Respir. Care 57): the
deepest breath here moves neck and shoulders by 2 cm. The slump has no source but the eye.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.easing import smoothstep
from ...base.time_series import hann_smooth
from ...motion import quaternion
from ...motion.humanoid import Humanoid, identify_joints
from ...motion.motion import Motion, compute_world_rotation, forward_kinematics
from .gaze import measure_trunk, turn_spine

RATES = (0.5, 0.8)
"""Breaths per second, least and most."""
CHEST_ANGLE, SHOULDER_ANGLE = np.radians(4.0), np.radians(7.0)
"""By how much the deepest breath bends the spine back and raises the shoulders."""
SLUMP_ANGLE = np.radians(8.0)
"""By how much the spine of an exhausted body bends forward."""
DEEP_EXERTION = 6.0
"""m of exertion after which the breath has 63 % of its depth: two or three sprints. Field players of a match have more
in less than a tenth of the time, at most 6 to 18 m."""
CALM_SPEEDS, CALM_SECONDS = (5.0, 1.5), 0.8
"""m/s from which down to which the breath comes to show, and s to either side over which that is smoothed."""

_MEAN_RATES = (0.58, 0.72)  # breaths per second, of different players
_WAVES = ((0.05, 11.3), (0.03, 17.9))  # breaths per second by which the rate wanders, and the period in s


def compute_breath_depth(exertion: np.ndarray, speed: np.ndarray, fps: float) -> np.ndarray:
    """Compute how deep a body's breath shows.

    Args:
        exertion: (T,) m (`synthesis.exertion`).
        speed: (T,) m/s of the player.
        fps: frames per second.
    Returns:
        (T,), 0 to 1.
    """
    calm = hann_smooth(smoothstep(speed, *CALM_SPEEDS), int(round(CALM_SECONDS * fps)))
    return calm * -np.expm1(-exertion / DEEP_EXERTION)


def compute_breath(times: np.ndarray, seed: int) -> np.ndarray:
    """Compute how full the lungs are, at a rate that wanders slowly within RATES.

    Args:
        times: (T,) s on the clock.
        seed: of the player's habits.
    Returns:
        (T,), 0 to 1.
    """
    random = np.random.default_rng([seed, 10])
    breaths = random.uniform(*_MEAN_RATES) * times
    for rate, period in _WAVES:
        turn = 2.0 * np.pi / period
        breaths = breaths - rate / turn * np.cos(turn * times + random.uniform(0.0, 2.0 * np.pi))
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * breaths)


def breathe(motion: Motion, depth: np.ndarray, times: np.ndarray, seed: int = 0) -> Motion:
    """Let the upper body of a motion breathe.

    Args:
        motion: T frames.
        depth: (T,) from 0 to 1; frames with 0 keep their bits.
        times: (T,) s on the clock.
        seed: of the player's habits.
    Returns:
        The motion; the motion itself where the depth is 0 throughout.
    """
    if not depth.any():
        return motion
    body, (joints, world) = identify_joints(motion.skeleton), forward_kinematics(motion)
    trunk = measure_trunk(motion.skeleton, joints, motion.fps)
    facing = trunk.heading + trunk.twist  # of the shoulders: both are bent and raised alike
    ahead, left = (np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
                   for angle in (facing, facing + 0.5 * np.pi))
    full = compute_breath(times, seed)
    bent, _ = turn_spine(motion, world, left, depth * (SLUMP_ANGLE - CHEST_ANGLE * full))
    raised = _raise_shoulders(bent, body, world, ahead, depth * SHOULDER_ANGLE * full)
    return _keep_directions(raised, body, world, depth > 0.0)


def _raise_shoulders(motion: Motion, body: Humanoid, world: np.ndarray, ahead: np.ndarray, angle: np.ndarray) -> Motion:
    """Raise both shoulders by angles (T,); world (T, J, 4) and ahead (T, 3) of the body before its spine turned."""
    rotations, moved = np.array(motion.rotations), angle > 0.0
    for limb, sense in ((body.left, 1.0), (body.right, -1.0)):
        if limb.shoulder is not None:
            above = world[moved, motion.skeleton.parents[limb.shoulder]]
            axis = quaternion.rotate(quaternion.inverse(above), ahead[moved])
            turn = quaternion.from_axis_angle(axis, sense * angle[moved])
            rotations[moved, limb.shoulder] = quaternion.multiply(turn, rotations[moved, limb.shoulder])
    return replace(motion, rotations=rotations)


def _keep_directions(motion: Motion, body: Humanoid, world: np.ndarray, moved: np.ndarray) -> Motion:
    """Turn neck and upper arms back to their rotations (T, J, 4) in the world, in the frames `moved` (T,)."""
    rotations, parents = np.array(motion.rotations), motion.skeleton.parents
    neck = body.head if body.neck is None else body.neck
    for joint in (neck, body.left.upper_arm, body.right.upper_arm):
        if joint is not None:
            above = compute_world_rotation(motion.skeleton, rotations[moved], parents[joint])
            local = quaternion.multiply(quaternion.inverse(above), world[moved, joint])
            rotations[moved, joint] = quaternion.match_signs(local, rotations[moved, joint])
    return replace(motion, rotations=rotations)
