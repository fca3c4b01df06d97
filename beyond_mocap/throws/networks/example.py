"""One recorded or synthetic throw or kick, for training and for the choice of a start pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.humanoid import estimate_stature, identify_joints
from ...motion.mirror import mirror
from ...motion.motion import Motion, forward_kinematics, place_motion, sample_frames_cubic
from ...motion.skeleton import freeze_array
from .chains import EFFECTORS, find_chains
from .description import AHEAD, BACK, STEP, Description
from .kinematics import Pose, build_pose, to_matrices

_MIN_DISTANCE = 0.05  # metres over the ground from the hips to the impact, below which the direction is undefined


@dataclass(frozen=True, eq=False)
class Example:
    """A throw or kick in the normalised frame (see `Description`).

    Attributes:
        name: name for reports.
        subject: name of the performer, to distinguish subjects.
        motion: at the model's rate.
        limb: index into `EFFECTORS`.
        release: fractional frame at which the ball leaves.
        impact: (3,) m, target of the ball.
        launch: (3,) m/s, velocity of the ball at the release, or None.
        stature: metres.
        before: (B, 4, 3) m, positions of the effectors before the motion's first frame, or None.
        after: (A, 4, 3) m, positions of the effectors after the motion's last frame, or None.
    """

    name: str
    subject: str
    motion: Motion
    limb: int
    release: float
    impact: np.ndarray
    launch: np.ndarray | None = None
    stature: float = 1.8
    before: np.ndarray | None = None
    after: np.ndarray | None = None

    def __post_init__(self):
        for name in ("impact", "launch", "before", "after"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, freeze_array(getattr(self, name)))
        if self.limb not in range(4) or not 0.0 <= self.release <= len(self.motion) - 1:
            found = f"limb {self.limb}, release at frame {self.release:g} of {len(self.motion)}"
            raise InputError(f"example {self.name}", found, "a limb of 0 to 3, a release within the motion")


def build_example(
    name: str, subject: str, motion: Motion, limb: int | str, release: float, impact, launch=None, fps: float = 30.0,
    span: tuple[float, float] | None = None,
) -> Example:
    """Build an example from a motion in the world, floor at 0.

    Args:
        name: name for reports.
        subject: name of the performer.
        motion: the recording.
        limb: index or name of one of `EFFECTORS`.
        release: seconds from the motion's first frame.
        impact: (3,) m, world.
        launch: (3,) m/s, world, or None.
        fps: frames per second of the example.
        span: first and last second of the example, None for the whole motion; the motion beyond them is kept as
            `before` and `after`.
    Raises:
        InputError: if the impact is above the hips, or the skeleton lacks a limb.
    """
    first, last = (0.0, motion.duration) if span is None else (max(span[0], 0.0), min(span[1], motion.duration))
    count = int(np.floor((last - first) * fps + 1e-6)) + 1
    if count < 2:
        raise InputError(f"example {name}", f"{last - first:.3f} s", "at least two frames",
                         "include more of the recording")  # fmt: skip
    motion, angle, shift = _normalize(motion, np.asarray(impact, dtype=float), first * motion.fps, name)
    resampled, before, after = (_resample(motion, frames, first, fps) for frames in _list_frames(motion, first, count,
            fps))
    rotation = quaternion.from_up_angle(np.array(angle))
    return Example(
        name=name, subject=subject, motion=resampled, limb=EFFECTORS.index(limb) if isinstance(limb, str)
        else int(limb), release=(release - first) * fps,
        impact=quaternion.rotate(rotation, np.asarray(impact, dtype=float)) + shift, launch=None if launch is None
        else quaternion.rotate(rotation, np.asarray(launch, dtype=float)), stature=estimate_stature(motion.skeleton),
        before=None if before is None else compute_effectors(before), after=None if after is None
        else compute_effectors(after),
    )


def _normalize(motion: Motion, impact: np.ndarray, frame: float, name: str) -> tuple[Motion, float, np.ndarray]:
    """Move a motion to the frame whose origin is below the hips at `frame` and whose +X points to the impact.

    Returns:
        The motion, the angle (rad) of its rotation about the world's Z, and the translation (3,) m after it.
    """
    root, rotations = sample_frames_cubic(motion, np.array([frame]))
    places, _ = forward_kinematics(Motion(motion.skeleton, root, rotations, motion.fps))
    hips = places[0, identify_joints(motion.skeleton).hips] * (1.0, 1.0, 0.0)
    direction = impact - hips
    if not np.hypot(direction[0], direction[1]) > _MIN_DISTANCE:
        raise InputError(f"example {name}", "a target directly above or below the hips", "a target some distance away")
    angle = -float(np.arctan2(direction[1], direction[0]))
    shift = -quaternion.rotate(quaternion.from_up_angle(np.array(angle)), hips)
    return place_motion(motion, angle, shift), angle, shift


def _list_frames(motion: Motion, first: float, count: int, fps: float) -> list[np.ndarray]:
    """List the frames of an example, those known before it and those known after it, at `fps`.

    The example has `count` frames from second `first`; the others are limited to what windows include.
    """
    last = int(np.floor((motion.duration - first) * fps + 1e-6))
    back = min(int(np.floor(first * fps + 1e-6)), int(np.ceil(BACK * STEP * fps)))
    ahead = min(last, count - 1 + int(np.ceil(AHEAD * STEP * fps)) + 1)
    return [np.arange(count), np.arange(-back, 0), np.arange(count, ahead + 1)]


def _resample(motion: Motion, frames: np.ndarray, first: float, fps: float) -> Motion | None:
    """Resample a motion at frames (N,) counted at `fps` from second `first`; None if there are none."""
    if not len(frames):
        return None
    root, rotations = sample_frames_cubic(motion, (first + frames / fps) * motion.fps)
    return Motion(motion.skeleton, root, rotations, fps)


def compute_effectors(motion: Motion) -> np.ndarray:
    """Compute the positions (T, 4, 3) m of the wrists and toes."""
    return forward_kinematics(motion)[0][:, list(find_chains(motion.skeleton).effectors)]


def build_description(example: Example) -> Description:
    """Build the description of an example: what is known of its motion before it is generated."""
    places, turns = forward_kinematics(example.motion)
    joints = list(find_chains(example.motion.skeleton).effectors)
    return Description(
        effectors=places[:, joints], hands=quaternion.to_matrix(turns[:, joints[:2]]), limb=example.limb,
        release=example.release, impact=example.impact, fps=example.motion.fps, before=example.before,
        after=example.after,
    )


def compute_poses(example: Example) -> Pose:
    """Compute the states (T, ...) of an example's body; `moved` is backward, zero in the first frame."""
    motion = example.motion
    pose = build_pose(motion.skeleton, motion.root_positions, to_matrices(motion))
    return pose._replace(moved=np.diff(pose.positions, axis=0, prepend=pose.positions[:1]))


def orient_example(example: Example, limb: int) -> Example:
    """Return an example of a limb's side: itself, or mirrored where the other arm throws or the other foot kicks."""
    return example if example.limb == limb else mirror_example(example)


def mirror_example(example: Example) -> Example:
    """Mirror an example: the same throw with the other arm, or kick with the other leg."""
    def mirror_effectors(effectors):
        return None if effectors is None else effectors[:, [1, 0, 3, 2]] * (1.0, -1.0, 1.0)

    return replace(
        example, motion=mirror(example.motion), limb=example.limb ^ 1, impact=example.impact * (1.0, -1.0, 1.0),
        launch=None if example.launch is None else example.launch * (1.0, -1.0, 1.0),
        before=mirror_effectors(example.before), after=mirror_effectors(example.after),
    )
