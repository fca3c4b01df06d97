"""The legs of a gait: feet are planted, and hips are lowered where a leg would not reach its foot."""

from __future__ import annotations

import numpy as np

from ..base.time_series import hann_smooth
from ..motion.humanoid import identify_joints
from ..motion.retargeting.neutral import NeutralStance
from ..motion.retargeting.posture import Posture, compute_hip_positions
from . import gait_tables as tables
from .footsteps import TOE_LIFT_PITCH, FootMovement, Footsteps, roll_foot

# longest reach of a leg, walking and running, share of its length: runners' knees stay bent by about 20
# degrees (V, and recordings), and a knee that snaps straight is the most visible error
_LONGEST_REACH, _SPRINT_REACH = (0.9955, 0.984), 0.99
# height of a sprinter's hips when a foot leaves the ground, share of what it is in standing
_SPRINT_HEIGHT = 0.94
# how close a sprinter's ankle comes to the hip, shares of the leg's length: knees bent by 143 and 150 degrees
_CLOSEST = (0.317, 0.259)
# share of the leg's length below that limit from which a swinging leg eases toward it
_EASE_SHARE = 0.03


class Legs:
    """Both legs at T moments on given stances, for one or several paths of the hips.

    Args:
        times: (T,) s.
        steps: stances of the left and the right foot.
        heading: (T,) rad of the body.
        neutral: neutral stance of the body.
    """

    def __init__(self, times: np.ndarray, steps: tuple[Footsteps, ...], heading: np.ndarray, neutral: NeutralStance):
        self.times, self.steps, self.neutral = times, steps, neutral
        self.feet = tuple(FootMovement(steps[s], times, heading=heading, neutral=neutral,
                                       thigh_shank=measure_leg(neutral, s)) for s in (0, 1))

    def plant_feet(self, posture: Posture) -> Posture:
        """Set the feet of a posture; the hips are lowered where a leg would not reach."""
        times, steps, neutral = self.times, self.steps, self.neutral
        hips = posture.hips.copy()
        hips[:, 2] -= self.compute_hip_drop(posture)
        posture = posture.replace_arrays(hips=hips)
        tops = compute_hip_positions(posture, neutral)
        paths = [self.feet[s].compute_path(tops[:, s]) for s in (0, 1)]
        ankles = [limit_leg_reach(paths[s].ankle, tops[:, s], times, steps[s], sum(measure_leg(neutral, s)))
                  for s in (0, 1)]
        feet = np.stack([np.stack([np.zeros_like(p.pitch), p.pitch, p.yaw], axis=-1) for p in paths], axis=1)
        return posture.replace_arrays(ankles=np.stack(ankles, axis=1), feet=feet,
                                      toes=np.stack([p.bend for p in paths], axis=1))

    def compute_hip_drop(self, posture: Posture) -> np.ndarray:
        """Compute how far (T,) m to lower the hips so that feet in contact are in reach, smooth in time."""
        times, tops = self.times, compute_hip_positions(posture, self.neutral)
        drop = np.zeros(len(times))
        for side, steps in enumerate(self.steps):
            ankle = self.feet[side].compute_path(tops[:, side]).ankle
            longest = _compute_longest_reach(steps, times) * sum(measure_leg(self.neutral, side))
            flat = np.sum((tops[:, side, :2] - ankle[:, :2]) ** 2, axis=-1)
            highest = ankle[:, 2] + np.sqrt(np.maximum(longest**2 - flat, 0.0))
            drop = np.maximum(drop, np.where(steps.is_in_contact(times), tops[:, side, 2] - highest, 0.0))
        width = max(int(0.06 / (times[1] - times[0])), 1)
        # the greatest need around each frame, then smoothed: never less than needed
        around = np.lib.stride_tricks.sliding_window_view(np.pad(drop, width, mode="edge"), 2 * width + 1)
        return hann_smooth(np.max(around, axis=-1), width)


def plant_feet(posture: Posture, times: np.ndarray, steps: tuple[Footsteps, ...], neutral: NeutralStance) -> Posture:
    """Set the feet of a posture; the hips are lowered where a leg would not reach.

    Args:
        posture: the posture.
        times: (T,) s.
        steps: stances of the left and the right foot.
        neutral: neutral stance of the body.
    Returns:
        The posture with feet.
    """
    return Legs(times, steps, posture.heading, neutral).plant_feet(posture)


def _compute_longest_reach(steps: Footsteps, times: np.ndarray) -> np.ndarray:
    """Compute the longest reach of a leg at `times` (T,): (T,) share of its length."""
    walking, running = _LONGEST_REACH
    speed = steps.speed[steps.find_stance(times)]
    longest = walking + (running - walking) * tables.compute_run_share(speed)
    return longest + (_SPRINT_REACH - running) * tables.compute_sprint_share(speed)


def limit_leg_reach(ankle: np.ndarray, hip: np.ndarray, times: np.ndarray, steps: Footsteps, leg: float) -> np.ndarray:
    """Pull the ankle toward its hip where the leg would be too straight in swing, and away where a sprinter's knee
    would bend too far.

    Args:
        ankle: (T, 3) m.
        hip: (T, 3) m.
        times: (T,) s.
        steps: stances of the foot.
        leg: length of the leg, m.
    Returns:
        (T, 3) m.
    """
    away = ankle - hip
    far = np.linalg.norm(away, axis=1)
    share = ease_reach(far, (_compute_longest_reach(steps, times) + 0.006 - _EASE_SHARE) * leg, _EASE_SHARE * leg)
    share = share * _ease_flexion(far / leg, tables.compute_sprint_share(steps.speed[steps.find_stance(times)]))
    return hip + away * np.where(steps.is_in_contact(times), 1.0, share)[:, None]


def _ease_flexion(far: np.ndarray, sprint: np.ndarray) -> np.ndarray:
    """Compute by which factors (T,) to lengthen a leg of `far` (T,) shares of its length whose knee bends too far."""
    begin, end = _CLOSEST
    eased = begin - (begin - end) * np.tanh((begin - far) / (begin - end))
    return 1.0 + sprint * np.where(far < begin, eased / np.maximum(far, 1e-9) - 1.0, 0.0)


def ease_reach(far: np.ndarray, begin: float | np.ndarray, soft: float) -> np.ndarray:
    """Compute by which factors to shorten distances so that they approach a limit softly.

    Args:
        far: (T,) m, distances.
        begin: m from which on they are shortened.
        soft: m, most that they exceed `begin`.
    Returns:
        (T,) factors, 1 below `begin`.
    """
    eased = begin + soft * np.tanh((far - begin) / soft)
    return np.where(far < begin, 1.0, eased / np.maximum(far, 1e-9))


def measure_leg(neutral: NeutralStance, side: int) -> tuple[float, float]:
    """Measure the lengths of thigh and shank (m) of one side (0 left, 1 right)."""
    body = identify_joints(neutral.skeleton)
    joints = (body.left, body.right)[side]
    hip, knee, ankle = (neutral.positions[j] for j in (joints.upper_leg, joints.lower_leg, joints.foot))
    return float(np.linalg.norm(knee - hip)), float(np.linalg.norm(ankle - knee))


def measure_push_off(neutral: NeutralStance) -> float:
    """Measure how far behind the hips a sprinter's flat foot has been when it leaves the ground, share of the leg's
    length: short feet leave earlier, so that hips keep their height.
    """
    pitch = tables.interpolate_stance_pitch(np.ones(1), np.array([tables.FASTEST]))
    ahead, up = roll_foot(pitch, pitch - TOE_LIFT_PITCH, neutral, 0)
    below = _SPRINT_HEIGHT * (neutral.leg + neutral.ankle_height) - up
    return float(ahead[0] + np.sqrt(max((_SPRINT_REACH * neutral.leg) ** 2 - below[0] ** 2, 0.0))) / neutral.leg
