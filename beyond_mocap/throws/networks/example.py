"""One recorded or synthetic throw or kick, for training and for the choice of a start pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.humanoid import identify, stature
from ...motion.mirror import mirror
from ...motion.motion import Motion, cubic_at, forward_kinematics, place
from ...motion.skeleton import frozen_array
from .chains import EFFECTORS, chains_of
from .description import AHEAD, BACK, STEP, Description
from .kinematics import Pose, matrices, pose_of

_NEAREST = 0.05  # metres over the ground from the hips to the impact, below which the direction is undefined


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
                object.__setattr__(self, name, frozen_array(getattr(self, name)))
        if self.limb not in range(4) or not 0.0 <= self.release <= len(self.motion) - 1:
            found = f"limb {self.limb}, release at frame {self.release:g} of {len(self.motion)}"
            raise InputError(f"example {self.name}", found, "a limb of 0 to 3, a release within the motion")


def example_of(
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
    motion, turn, shift = _normalised(motion, np.asarray(impact, dtype=float), first * motion.fps, name)
    taken, before, after = (_resampled(motion, frames, first, fps) for frames in _frames(motion, first, count, fps))
    turned = quaternion.about_up(np.array(turn))
    return Example(
        name=name, subject=subject, motion=taken, limb=EFFECTORS.index(limb) if isinstance(limb, str) else int(limb),
        release=(release - first) * fps, impact=quaternion.rotate(turned, np.asarray(impact, dtype=float)) + shift,
        launch=None if launch is None else quaternion.rotate(turned, np.asarray(launch, dtype=float)),
        stature=stature(motion.skeleton), before=None if before is None else effectors_of(before),
        after=None if after is None else effectors_of(after),
    )


def _normalised(motion: Motion, impact: np.ndarray, frame: float, name: str) -> tuple[Motion, float, np.ndarray]:
    """Move a motion to the frame whose origin is below the hips at `frame` and whose +X points to the impact.

    Returns:
        The motion, the angle (rad) of its rotation about the world's Z, and the translation (3,) m after it.
    """
    root, rotations = cubic_at(motion, np.array([frame]))
    places, _ = forward_kinematics(Motion(motion.skeleton, root, rotations, motion.fps))
    hips = places[0, identify(motion.skeleton).hips] * (1.0, 1.0, 0.0)
    way = impact - hips
    if not np.hypot(way[0], way[1]) > _NEAREST:
        raise InputError(f"example {name}", "a target directly above or below the hips", "a target some distance away")
    turn = -float(np.arctan2(way[1], way[0]))
    shift = -quaternion.rotate(quaternion.about_up(np.array(turn)), hips)
    return place(motion, turn, shift), turn, shift


def _frames(motion: Motion, first: float, count: int, fps: float) -> list[np.ndarray]:
    """List the frames of an example, those known before it and those known after it, at `fps`.

    The example has `count` frames from second `first`; the others are limited to what windows include.
    """
    last = int(np.floor((motion.duration - first) * fps + 1e-6))
    back = min(int(np.floor(first * fps + 1e-6)), int(np.ceil(BACK * STEP * fps)))
    ahead = min(last, count - 1 + int(np.ceil(AHEAD * STEP * fps)) + 1)
    return [np.arange(count), np.arange(-back, 0), np.arange(count, ahead + 1)]


def _resampled(motion: Motion, frames: np.ndarray, first: float, fps: float) -> Motion | None:
    """Resample a motion at frames (N,) counted at `fps` from second `first`; None if there are none."""
    if not len(frames):
        return None
    root, rotations = cubic_at(motion, (first + frames / fps) * motion.fps)
    return Motion(motion.skeleton, root, rotations, fps)


def effectors_of(motion: Motion) -> np.ndarray:
    """Compute the positions (T, 4, 3) m of the wrists and toes."""
    return forward_kinematics(motion)[0][:, list(chains_of(motion.skeleton).effectors)]


def describe(example: Example) -> Description:
    """Build the description of an example: what is known of its motion before it is generated."""
    places, turns = forward_kinematics(example.motion)
    joints = list(chains_of(example.motion.skeleton).effectors)
    return Description(
        effectors=places[:, joints], hands=quaternion.to_matrix(turns[:, joints[:2]]), limb=example.limb,
        release=example.release, impact=example.impact, fps=example.motion.fps, before=example.before,
        after=example.after,
    )


def poses(example: Example) -> Pose:
    """Compute the states (T, ...) of an example's body; `moved` is backward, zero in the first frame."""
    motion = example.motion
    pose = pose_of(motion.skeleton, motion.root_positions, matrices(motion))
    return pose._replace(moved=np.diff(pose.positions, axis=0, prepend=pose.positions[:1]))


def mirrored(example: Example) -> Example:
    """Mirror an example: the same throw with the other arm, or kick with the other leg."""
    def side(effectors):
        return None if effectors is None else effectors[:, [1, 0, 3, 2]] * (1.0, -1.0, 1.0)

    return replace(
        example, motion=mirror(example.motion), limb=example.limb ^ 1, impact=example.impact * (1.0, -1.0, 1.0),
        launch=None if example.launch is None else example.launch * (1.0, -1.0, 1.0), before=side(example.before),
        after=side(example.after),
    )
