"""Synthetic throws at a target: a whole body that strides, turns hips and trunk, and lets one arm follow like a whip.

Instants, angles and rates of the hard overarm throw follow Dillman, Fleisig and Andrews 1993 (J. Orthop. Sports Phys.
Ther. 18, 402-408) and Fleisig, Barrentine, Zheng, Escamilla and Andrews 1999 (J. Biomech. 32, 1371-1375): foot down
0.15 s before release with the upper arm level, pelvis then trunk turning at about 600 and 1200 degrees per second, the
arm turned out by 170 degrees 0.03 s before release, the elbow at 25 degrees as the ball leaves. A throw is aimed as
humans aim: the body turns to the target, and the ball leaves a little earlier or later in the swing. `find_grip` gives
where a hand holds a ball, between the fingers on the palm's side, on any humanoid skeleton.
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
from . import gait_tables as tables
from .footsteps import lift_foot
from .gestures import RIGHT, build_plan_parts, choose_style

BEFORE, AFTER = 1.6, 1.2
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
        hips: rows (time, ahead, lowered).
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
        (-1.6, 0, 2, -85), (-0.8, 0, 0, -92), (-0.35, -2, 2, -84), (-0.14, -3, 6, -45), (-0.08, -4, 10, -12),
        (0.0, -4, 18, 5), (0.15, -2, 26, 14), (0.5, 0, 20, 16), (1.1, 0, 6, 6),
    ),
    spine=(
        (-1.6, 0, 4, 0), (-0.8, 0, 4, -8), (-0.35, 0, -2, -18), (-0.14, 2, -12, -30), (-0.09, -4, -16, -25),
        (-0.045, -12, -10, -4), (0.0, -18, 14, 14), (0.1, -15, 30, 26), (0.3, -8, 32, 26), (0.6, -2, 24, 14),
        (1.1, 0, 6, 4),
    ),
    right_arm=(
        (-1.6, 30, 18, 40, 95), (-0.8, 32, 22, 40, 100), (-0.5, 0, 40, 15, 55), (-0.3, -35, 76, 10, 50),
        (-0.14, -28, 92, -45, 90), (-0.08, -14, 95, -120, 100), (-0.034, 4, 96, -170, 94), (-0.017, 7, 96, -152, 66),
        (0.0, 8, 95, -106, 28), (0.017, 12, 93, -56, 18), (0.06, 30, 85, -12, 22), (0.15, 60, 60, 8, 40),
        (0.35, 66, 28, 22, 45), (0.8, 30, 15, 18, 35), (1.2, 12, 12, 14, 26),
    ),
    left_arm=(
        (-1.6, 30, 18, 40, 95), (-0.8, 32, 22, 40, 98), (-0.45, 15, 60, 20, 42), (-0.17, 20, 84, 10, 25),
        (-0.08, 10, 60, 20, 70), (0.0, -15, 26, 28, 108), (0.3, -12, 22, 28, 88), (1.1, 6, 13, 14, 28),
    ),
    forearm=(
        (-1.6, 20, 5), (-0.3, 0, 5), (-0.1, -10, -35), (-0.035, -5, -52), (0.0, 12, -6), (0.02, 40, 26), (0.08, 75, 22),
        (0.35, 40, 10), (1.2, 20, 6),
    ),
    hips=(
        (-1.6, -0.01, 0.03), (-0.85, -0.05, 0.02), (-0.5, 0.03, 0.06), (-0.15, 0.44, 0.15), (0.0, 0.60, 0.13),
        (0.2, 0.72, 0.10), (0.6, 0.78, 0.06), (1.1, 0.78, 0.03),
    ),
    left_foot=(
        (-1.6, 0.15, 0.0, 0.0, 0, -78), (-1.05, 0.15, 0.0, 0.0, 0, -78), (-0.68, 0.12, -0.08, 0.42, 22, -75),
        (-0.35, 0.60, -0.02, 0.16, 4, -50), (-0.15, 0.94, 0.03, 0.0, -4, -12), (-0.09, 0.94, 0.03, 0.0, 0, -12),
        (1.2, 0.94, 0.03, 0.0, 0, -12),
    ),
    right_foot=(
        (-1.6, -0.16, 0.0, 0.0, 0, -84), (-0.3, -0.16, 0.0, 0.0, 0, -82), (-0.14, -0.14, 0.0, 0.02, 24, -64),
        (0.0, -0.02, -0.02, 0.10, 58, -40), (0.22, 0.30, -0.14, 0.20, 62, -22), (0.5, 0.74, -0.26, 0.08, 16, -16),
        (0.72, 0.82, -0.28, 0.0, 0, -16), (1.2, 0.82, -0.28, 0.0, 0, -16),
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
    inside = speed**4 - tables.GRAVITY * (tables.GRAVITY * level**2 + 2.0 * up * speed**2)
    if level < 1e-6 or inside < 0.0:
        raise InputError("throw", "a target out of reach", f"one that {speed:g} m/s reach", "throw faster or nearer")
    return float(np.arctan2(speed**2 - np.sqrt(inside), tables.GRAVITY * level))


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
        fps=_PLAN_RATE, hips=np.stack([hips[:, 0], nothing, height - hips[:, 1]], axis=-1), heading=nothing,
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
