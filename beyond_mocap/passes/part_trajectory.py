"""The trajectory of a part of the body that can strike a ball, and of the body that its movement is compared with.

Positions are smoothed before they are compared, because optical markers and suits shake at an impact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ball.contact import Tool, find_striking_surface
from ..motion.humanoid import compute_heading_from_positions, identify_joints, measure_leg_length
from ..motion.motion import Motion, forward_kinematics
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann

_SMOOTHING = 0.1  # s: Hann window over positions

Poses = tuple[np.ndarray, np.ndarray]
"""World positions (T, J, 3) m and rotations (T, J, 4) of all joints."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayerBody:
    """The body that the part's movement is compared with.

    Attributes:
        pelvis: (T, 3) m, smoothed, world frame.
        speed: (T,) m/s of the pelvis over the ground, smoothed.
        facing: (T,) rad, unwrapped.
        ground: height of the floor, m.
        size: leg length, m.
    """

    pelvis: np.ndarray
    speed: np.ndarray
    facing: np.ndarray
    ground: float
    size: float

    @staticmethod
    def from_motion(motion: Motion, positions: np.ndarray) -> PlayerBody:
        """Measure the body of a motion with world joint positions (T, J, 3) m."""
        body = identify_joints(motion.skeleton)
        # the floor is the height that toes fall below in 2 % of the frames only
        toes = positions[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2]
        pelvis = smooth_zero_phase_hann(positions[:, body.hips], motion.fps, _SMOOTHING)
        path = smooth_zero_phase_hann(pelvis[:, :2], motion.fps, 0.5)
        facing = np.unwrap(compute_heading_from_positions(motion.skeleton, positions))
        speed = np.linalg.norm(_differentiate(path, motion.fps), axis=1)
        return PlayerBody(pelvis=pelvis, speed=speed, facing=facing, ground=float(np.percentile(toes, 2)),
                          size=measure_leg_length(motion.skeleton))


@dataclass(frozen=True, eq=False, kw_only=True)
class PartTrajectory:
    """Smoothed trajectory of the part.

    Attributes:
        place: (T, 3) m, world frame.
        velocity: (T, 3) m/s, world frame.
        height: (T,) m above the ground.
        speed: (T,) m/s; of head and chest relative to the pelvis, because a jump is faster than the nod that meets the
            ball.
        fps: frames per second.
    """

    place: np.ndarray
    velocity: np.ndarray
    height: np.ndarray
    speed: np.ndarray
    fps: float

    @staticmethod
    def from_positions(place: np.ndarray, body: PlayerBody, part: str, fps: float) -> PartTrajectory:
        """Smooth the part's positions (T, 3) m and derive its velocity, height and speed."""
        smooth = smooth_zero_phase_hann(place, fps, _SMOOTHING)
        velocity = _differentiate(smooth, fps)
        relative_velocity = _differentiate(smooth - body.pelvis, fps) if part in ("head", "chest") else velocity
        return PartTrajectory(place=smooth, velocity=velocity, height=smooth[:, 2] - body.ground,
                              speed=np.linalg.norm(relative_velocity, axis=1), fps=fps)


@dataclass(frozen=True, eq=False, kw_only=True)
class PartMeasures:
    """What the hits of a part are found in.

    Attributes:
        body: the body.
        trajectory: of the part.
        other: (T,) m/s of the other foot where a foot strikes, else None.
        place: (T, 3) m, the part, not smoothed, world frame.
    """

    body: PlayerBody
    trajectory: PartTrajectory
    other: np.ndarray | None
    place: np.ndarray


def measure_part(motion: Motion, part: str = "foot", side: str = "right", *, joint: str | None = None,
                 tool: Tool | None = None, poses: Poses | None = None, body: PlayerBody | None = None) -> PartMeasures:
    """Measure the movement of one part of the body, and of what it is compared with.

    Args:
        motion: T frames.
        part, side, joint, tool: as in `hits.detect_hits`.
        poses: `forward_kinematics` of the motion, where it is known.
        body: that of another part, measured in the same motion.
    Returns:
        What hits are found in.
    Raises:
        InputError: for an unknown side, or a part or joint that the skeleton lacks.
    """
    positions, rotations = forward_kinematics(motion) if poses is None else poses
    surface = find_striking_surface(motion.skeleton, joint or part, side, tool)
    place = np.mean(surface.compute_line(positions, rotations), axis=0)
    body = body or PlayerBody.from_motion(motion, positions)
    other = _other_foot_speed(motion.skeleton, positions, side, motion.fps) if part == "foot" else None
    return PartMeasures(body=body, trajectory=PartTrajectory.from_positions(place, body, part, motion.fps),
                        other=other, place=place)


def _other_foot_speed(skeleton: Skeleton, positions: np.ndarray, side: str, fps: float) -> np.ndarray:
    """Compute the speed (T,) m/s of the foot that does not strike."""
    limb = getattr(identify_joints(skeleton), "left" if side == "right" else "right")
    place = positions[:, [limb.foot, limb.toe_or_foot]].mean(axis=1)
    return np.linalg.norm(_differentiate(smooth_zero_phase_hann(place, fps, _SMOOTHING), fps), axis=1)


def _differentiate(values: np.ndarray, fps: float) -> np.ndarray:
    """Differentiate values (T, k) over time by central differences, per second."""
    return np.gradient(values, axis=0) * fps
