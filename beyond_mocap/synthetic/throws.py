"""Synthetic throws at a target: a whole body that strides, sinks into its front leg, turns hips and trunk, and lets
one arm follow like a whip.

The order of events follows Dillman, Fleisig and Andrews 1993 (J. Orthop. Sports Phys. Ther. 18, 402-408) and Fleisig,
Barrentine, Zheng, Escamilla and Andrews 1999 (J. Biomech. 32, 1371-1375): the foot is down 0.15 s before the release
with the upper arm level, then pelvis, trunk, elbow and wrist are fastest one after the other. The amounts follow four
recorded pitches, measured by the same formulas as the throws (`benchmarks.pitching`). The adult at 36 m/s: pelvis 700,
trunk 1100 and elbow 2200 degrees per second, arm turned out by 170 degrees (it lies back by 80), trunk tilted by 29
and elbow bent by 40 degrees as the ball leaves. Literature has the trunk at 1200 and the elbow at 25 degrees.

A throw is aimed as humans aim: the body turns to the target, and the ball leaves a little earlier or later in the
swing, so that a slow ball, which has to rise, leaves a more bent elbow. `find_grip` gives where a hand holds a ball,
between the fingers on the palm's side, on any humanoid skeleton.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.mirror import mirror
from ..motion.motion import Motion, forward_kinematics, place_motion, sample_frames
from ..motion.retargeting.adult import build_adult_skeleton
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.retargeting.posture import Posture, to_motion
from ..motion.skeleton import Skeleton
from ..motion.supports import GRAVITY
from . import gait_tables as tables
from .footsteps import lift_foot
from .gestures import RIGHT, build_plan_parts, choose_style

BEFORE, AFTER = 2.0, 1.2
"""Seconds of a hard throw before and after release; slower ones take longer."""
SLOWEST, FASTEST = 3.0, 45.0  # m/s at release
_PLAN_RATE = 480.0  # Hz at which a throw is planned
_ROUNDING_SECONDS = 0.007  # s over which corners of the tables are rounded
_EARLIEST, _LATEST = -0.022, 0.022  # s around the table's release within which the ball can leave
_AIM_ROUNDS = 12  # rounds of aiming: instant, rate and turn depend on one another
_GRIP_AHEAD, _GRIP_DOWN = 0.012, 0.105  # m of an adult whose hand hangs: toward the thumb, toward the fingertips
USUAL_GRIP = 0.036
"""Metres from the palm's middle to the centre of a baseball; larger balls are further out by their radius."""


@dataclass(frozen=True)
class ThrowStyle:
    """How a right arm throws along +X; seconds from release, degrees, metres of an adult.

    Attributes:
        pelvis: rows (time, list, tilt, turn), against the throwing direction.
        spine: rows (time, list, tilt, turn), the chest against the pelvis.
        right_arm: rows (time, brought forward across, abduction, inward turn, elbow).
        left_arm: rows (time, brought forward across, abduction, inward turn, elbow).
        forearm: rows (time, turn, flexion of the wrist).
        hips: rows (time, ahead, left, lowered).
        left_foot: rows (time, ahead, left, raised, pitch, yaw).
        right_foot: rows (time, ahead, left, raised, pitch, yaw).
    """

    pelvis: tuple
    spine: tuple
    right_arm: tuple
    left_arm: tuple
    forearm: tuple
    hips: tuple
    left_foot: tuple
    right_foot: tuple


_OVERARM = ThrowStyle(
    pelvis=(
        (-1.6, -1, 2, -85), (-0.8, 3, -3, -96), (-0.5, 11, -5, -95), (-0.35, 16, -4, -94), (-0.25, 13, -3, -88),
        (-0.19, 8, -2, -74), (-0.14, 0, 0, -50), (-0.09, -7, 5, -21), (-0.05, -11, 14, -2), (0.0, -13, 25, 11),
        (0.1, -13, 37, 23), (0.25, -5, 40, 38), (0.45, -4, 24, 41), (0.7, -2, 9, 34), (1.1, 0, 3, 10),
    ),
    spine=(
        (-1.6, 0, -1, 0), (-0.8, 0, 0, -5), (-0.5, 1, 3, -15), (-0.35, 1, 5, -22), (-0.25, 0, 5, -35),
        (-0.19, 1, 3, -46), (-0.15, 2, -1, -53), (-0.12, 2, -5, -54), (-0.09, -2, -8, -48), (-0.06, -7, -9, -36),
        (-0.03, -13, -7, -20), (0.0, -17, -3, -5), (0.04, -18, 3, 10), (0.1, -14, 9, 28), (0.2, -5, 13, 34),
        (0.35, -5, 12, 26), (0.55, -3, 6, 16), (0.8, -1, 1, 4), (1.1, 0, 0, 2),
    ),
    right_arm=(
        (-1.6, 30, 18, 40, 95), (-0.8, 32, 22, 40, 100), (-0.55, 10, 36, 20, 70), (-0.4, -18, 58, 10, 48),
        (-0.3, -30, 74, 5, 50), (-0.2, -24, 88, -25, 82), (-0.14, -18, 92, -60, 104), (-0.08, -10, 95, -120, 112),
        (-0.05, -1, 97, -155, 107), (-0.025, 3, 98, -173, 79), (-0.01, 4, 99, -155, 46), (0.0, 4, 99, -131, 29),
        (0.017, 7, 98, -72, 24), (0.035, 20, 95, -38, 25), (0.06, 42, 92, -12, 28), (0.1, 60, 80, 0, 34),
        (0.2, 60, 55, 18, 44),
        (0.35, 42, 34, 24, 50), (0.6, 24, 20, 22, 45), (0.9, 14, 14, 16, 34), (1.2, 10, 12, 14, 26),
    ),
    left_arm=(
        (-1.6, 30, 18, 40, 95), (-0.8, 32, 22, 40, 98), (-0.5, 18, 56, 25, 45), (-0.3, -4, 82, 14, 30),
        (-0.2, -26, 86, 12, 48), (-0.12, -32, 72, 20, 82), (-0.06, -12, 50, 26, 100), (0.0, 8, 30, 28, 110),
        (0.1, 10, 24, 28, 105), (0.3, 0, 26, 28, 88), (0.6, -6, 20, 22, 55), (1.1, 6, 13, 14, 28),
    ),
    forearm=(
        (-1.6, 20, 5), (-0.3, 0, 5), (-0.1, -10, -35), (-0.035, -5, -52), (0.0, 12, -6), (0.02, 40, 26), (0.08, 75, 22),
        (0.35, 40, 10), (1.2, 20, 6),
    ),
    hips=(
        (-1.6, -0.01, 0.0, 0.03), (-1.0, -0.05, 0.0, 0.02), (-0.7, -0.02, 0.0, 0.04), (-0.5, 0.10, 0.0, 0.12),
        (-0.35, 0.27, 0.0, 0.20), (-0.25, 0.40, 0.0, 0.23), (-0.15, 0.57, 0.0, 0.245), (-0.08, 0.69, 0.0, 0.245),
        (0.0, 0.79, 0.0, 0.225), (0.1, 0.87, 0.0, 0.18), (0.2, 0.91, -0.01, 0.14), (0.35, 0.94, -0.06, 0.11),
        (0.6, 0.97, -0.20, 0.085), (0.8, 0.98, -0.25, 0.065), (1.1, 0.98, -0.26, 0.05),
    ),
    left_foot=(
        (-1.6, 0.15, 0.0, 0.0, 0, -78), (-1.35, 0.15, 0.0, 0.0, 0, -78), (-0.80, 0.04, -0.35, 0.60, 25, -85),
        (-0.68, 0.08, -0.36, 0.44, 20, -85), (-0.55, 0.22, -0.44, 0.18, 10, -82), (-0.42, 0.56, -0.42, 0.09, 4, -76),
        (-0.32, 0.86, -0.26, 0.09, 0, -60), (-0.23, 1.05, -0.08, 0.08, -6, -40), (-0.19, 1.125, 0.0, 0.045, -7, -24),
        (-0.15, 1.14, 0.02, 0.0, -4, -15), (-0.09, 1.14, 0.02, 0.0, 0, -12), (1.2, 1.14, 0.02, 0.0, 0, -12),
    ),
    right_foot=(
        (-1.6, -0.16, 0.0, 0.0, 0, -84), (-0.3, -0.16, 0.0, 0.0, 0, -82), (-0.2, -0.14, -0.01, 0.02, 14, -74),
        (-0.12, -0.04, -0.03, 0.08, 42, -52), (-0.05, 0.10, -0.06, 0.15, 58, -36), (0.0, 0.21, -0.10, 0.17, 62, -28),
        (0.05, 0.27, -0.15, 0.20, 65, -24), (0.12, 0.32, -0.26, 0.27, 62, -18), (0.2, 0.36, -0.44, 0.34, 55, -10),
        (0.3, 0.48, -0.58, 0.38, 42, 0), (0.42, 0.66, -0.62, 0.32, 25, 5), (0.56, 0.80, -0.57, 0.14, 10, 4),
        (0.68, 0.83, -0.53, 0.0, 0, 0), (1.2, 0.83, -0.53, 0.0, 0, 0),
    ),
)  # fmt: skip
_SIDEARM = replace(
    _OVERARM, spine=tuple((t, 0.15 * a, b, c) for t, a, b, c in _OVERARM.spine),
    right_arm=tuple((t, a, min(b, 84), c, e) for t, a, b, c, e in _OVERARM.right_arm),
)
STYLES = {"overarm": _OVERARM, "sidearm": _SIDEARM}


@dataclass(frozen=True, eq=False, kw_only=True)
class Throw:
    """A synthetic throw.

    Attributes:
        motion: the body.
        release: s at which the ball leaves the hand.
        arm: "left" or "right".
        position: (3,) m, the ball's centre at release.
        velocity: (3,) m/s of the ball at release.
        grip: (3,) m, the ball's centre in the hand joint's own axes.
    """

    motion: Motion
    release: float
    arm: str
    position: np.ndarray
    velocity: np.ndarray
    grip: np.ndarray


def build_throw(
    target: tuple[float, float, float] = (18.0, 0.0, 1.0), speed: float = 25.0, arm: str = "right",
    style: str | ThrowStyle = "overarm", skeleton: Skeleton | None = None, fps: float = 120.0,
) -> Throw:
    """Build a throw out of standing at the origin whose ball, without air, flies through the target.

    Args:
        target: (3,) m.
        speed: of the ball as it leaves, m/s.
        arm: "left" or "right".
        style: a name, or a performer's own style.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
    Returns:
        The throw.
    Raises:
        InputError: for a target that cannot be reached at that speed, an unknown arm or style, or a body without hands.
    """
    chosen = choose_style("throw", arm, "arm", style=style, styles=STYLES, speed=speed, speeds=(SLOWEST, FASTEST))
    neutral = build_neutral_stance(skeleton or build_adult_skeleton())
    swing = _Swing(to_motion(_build_posture(chosen, neutral), neutral), neutral, arm)
    release, rate, turn = _solve_aim(swing, np.asarray(target, dtype=float), speed)
    return swing.build_throw_at(release, rate, turn, fps)


class _Swing:
    """A hard throw along +X at the planning rate, with its ball; slower and turned ones are sampled from it."""

    def __init__(self, motion: Motion, neutral: NeutralStance, arm: str):
        body = identify_joints(motion.skeleton)
        if body.right.hand is None or body.left.hand is None:
            raise InputError("throw", "a body without hands", "a skeleton with arms and hands")
        self.hand = body.left.hand if arm == "left" else body.right.hand
        self.arm = arm
        self.motion = mirror(motion) if arm == "left" else motion
        self.grip = compute_grip(neutral, arm)
        places, turns = forward_kinematics(self.motion)
        self.ball = places[:, self.hand] + quaternion.rotate(turns[:, self.hand], self.grip)
        self.velocity = np.gradient(self.ball, 1.0 / _PLAN_RATE, axis=0)

    def find_release(self, at: float) -> tuple[np.ndarray, np.ndarray]:
        """Interpolate the place (3,) m and velocity (3,) m/s of the ball `at` seconds from the table's release."""
        frame = np.clip((BEFORE + at) * _PLAN_RATE, 0, len(self.ball) - 2)
        low, share = int(frame), frame - int(frame)
        place_and_velocity = [(1.0 - share) * rows[low] + share * rows[low + 1] for rows in (self.ball, self.velocity)]
        return place_and_velocity[0], place_and_velocity[1]

    def build_throw_at(self, at: float, rate: float, turn: float, fps: float) -> Throw:
        """Build the throw at playback rate `rate`, turned by `turn` rad, at `fps`."""
        seconds = np.arange(int(np.floor((len(self.motion) - 1) / _PLAN_RATE / rate * fps)) + 1) / fps
        root, rotations = sample_frames(self.motion, seconds * rate * _PLAN_RATE)
        motion = place_motion(Motion(self.motion.skeleton, root, rotations, fps), turn)
        spot, velocity = self.find_release(at)
        rotated = quaternion.rotate(quaternion.from_up_angle(np.array(turn)), np.stack([spot, rate * velocity]))
        return Throw(motion=motion, release=(BEFORE + at) / rate, arm=self.arm, position=rotated[0],
                     velocity=rotated[1], grip=self.grip)


def _solve_aim(swing: _Swing, target: np.ndarray, speed: float) -> tuple[float, float, float]:
    """Find when in the swing (s), at which rate and turned by how much (rad) a ball of `speed` hits the target."""
    instants = np.linspace(_EARLIEST, _LATEST, 89)
    turn = float(np.arctan2(target[1], target[0]))
    at, rate = 0.0, 1.0
    for _ in range(_AIM_ROUNDS):
        target_turned = quaternion.rotate(quaternion.from_up_angle(np.array(-turn)), target)
        elevation_errors = []
        for instant in instants:
            spot, velocity = swing.find_release(instant)
            rises = float(np.arctan2(velocity[2], np.hypot(velocity[0], velocity[1])))
            elevation_errors.append(rises - _compute_elevation(target_turned - spot, speed))
        at = _find_zero(instants, np.array(elevation_errors), speed)
        spot, velocity = swing.find_release(at)
        rate = speed / float(np.linalg.norm(velocity))
        to_target = target_turned - spot
        turn += float(np.arctan2(to_target[1], to_target[0]) - np.arctan2(velocity[1], velocity[0]))
    return at, rate, turn


def _find_zero(instants: np.ndarray, errors: np.ndarray, speed: float) -> float:
    """Find the instant at which the elevation error (N,) is zero, nearest to the table's own release."""
    change = np.flatnonzero(np.sign(errors[1:]) != np.sign(errors[:-1]))
    if not len(change):
        raise InputError(
            "throw", "a target too high, too low or too far", f"one that {speed:g} m/s reach", "throw faster or nearer"
        )
    zeros = instants[change] + (instants[1] - instants[0]) * errors[change] / (errors[change] - errors[change + 1])
    return float(zeros[np.argmin(np.abs(zeros))])


def _compute_elevation(to_target: np.ndarray, speed: float) -> float:
    """Compute the elevation (rad) of the flatter arc without air that covers `to_target` (3,) m.

    Raises:
        InputError: if there is none.
    """
    level, up = float(np.hypot(to_target[0], to_target[1])), float(to_target[2])
    inside = speed**4 - GRAVITY * (GRAVITY * level**2 + 2.0 * up * speed**2)
    if level < 1e-6 or inside < 0.0:
        raise InputError("throw", "a target out of reach", f"one that {speed:g} m/s reach", "throw faster or nearer")
    return float(np.arctan2(speed**2 - np.sqrt(inside), GRAVITY * level))


def _build_posture(style: ThrowStyle, neutral: NeutralStance) -> Posture:
    """Build the throw's posture at the planning rate."""
    times = np.arange(int(round((BEFORE + AFTER) * _PLAN_RATE)) + 1) / _PLAN_RATE - BEFORE
    nothing = np.zeros_like(times)
    curve, pelvis, spine, arms, height = build_plan_parts(style, neutral, times, _ROUNDING_SECONDS * _PLAN_RATE)
    hips = curve(style.hips) * (neutral.leg / tables.LEG)
    forearm = np.radians(curve(style.forearm))
    arms[:, RIGHT, 4] = forearm[:, 0]
    feet = [lift_foot(curve(rows), neutral) for rows in (style.left_foot, style.right_foot)]
    look = np.clip(-(pelvis[:, 2] + spine[:, 2]), -1.2, 1.2)
    nod = -0.55 * (pelvis[:, 1] + spine[:, 1])
    return Posture(
        fps=_PLAN_RATE, hips=np.stack([hips[:, 0], hips[:, 1], height - hips[:, 2]], axis=-1), heading=nothing,
        pelvis=pelvis, spine=spine, head=np.stack([-0.5 * spine[:, 0], nod, look], axis=-1), arms=arms,
        wrists=np.stack([nothing + 0.1, forearm[:, 1]], axis=-1), ankles=np.stack([foot[:, :3] for foot in feet],
                                                                                  axis=1),
        feet=np.stack([foot[:, 3:] for foot in feet], axis=1),
        toes=np.stack([np.clip(0.8 * foot[:, 4], 0.0, 0.7) * (foot[:, 2] < 0.3) for foot in feet], axis=-1),
        knees=np.zeros((len(times), 2)),
    )


def find_grip(skeleton: Skeleton, side: str, radius: float = USUAL_GRIP) -> np.ndarray:
    """Compute the centre of a held ball in the axes of the hand joint.

    Args:
        skeleton: any humanoid skeleton.
        side: "left" or "right".
        radius: of the ball, m.
    Returns:
        (3,) m.
    Raises:
        InputError: if the body has no such hand.
    """
    return compute_grip(build_neutral_stance(skeleton), side, radius)


def compute_grip(neutral: NeutralStance, side: str, out: float | None = None) -> np.ndarray:
    """Compute the centre of a held ball, for a skeleton whose neutral stance is known.

    Args:
        neutral: neutral stance of the body.
        side: "left" or "right".
        out: m from the palm's middle; None: of an adult's baseball, scaled to the body's size.
    Returns:
        (3,) m in the axes of the hand joint.
    Raises:
        InputError: if the body has no such hand.
    """
    hand = getattr(identify_joints(neutral.skeleton), side).hand
    if hand is None:
        raise InputError("throw", f"a body without a {side} hand", "a skeleton with arms and hands")
    size, sign = neutral.leg / tables.LEG, 1.0 if side == "left" else -1.0
    held = np.array([_GRIP_AHEAD, -USUAL_GRIP * sign, -_GRIP_DOWN]) * size
    if out is not None:
        held[1] = -sign * max(out, USUAL_GRIP * size)
    return quaternion.rotate(quaternion.inverse(neutral.rotations[hand]), held)
