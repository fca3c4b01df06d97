"""One recorded or made throw or kick, as training and the search for a start pose take it."""

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

_NEAREST = 0.05  # metres over the ground from the hips to the impact: nearer ones give no direction


@dataclass(frozen=True, eq=False)
class Example:
    """A throw or kick in the normalised frame (see `Description`).

    name, subject: for reports, and for telling subjects apart. motion: at the model's rate. limb: index into
    `EFFECTORS`. release: fractional frame at which the ball leaves. impact: (3,) m. launch: (3,) m/s, the ball's
    velocity as it leaves, or None. stature: metres. before (B, 4, 3), after (A, 4, 3): places of the effectors beyond
    the motion's ends, or None."""

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
    """An example from a motion in the world, floor at 0.

    limb: index or name of one of `EFFECTORS`. release: seconds from the motion's first frame. impact (3,) m and
    launch (3,) m/s, in the world. span: first and last second that the example has, the whole motion without it; what
    the motion shows beyond them is kept as `before` and `after`. InputError where the impact is on top of the hips,
    or the skeleton lacks a limb."""
    first, last = (0.0, motion.duration) if span is None else (max(span[0], 0.0), min(span[1], motion.duration))
    count = int(np.floor((last - first) * fps + 1e-6)) + 1
    if count < 2:
        raise InputError(f"example {name}", f"{last - first:.3f} s", "two frames or more", "take more of the recording")
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
    """The motion in the frame where the hips' place over the ground at `frame` is the origin and the impact lies on
    +X; by which angle (radians) it was turned about the world's Z and by which vector (3,) m then moved."""
    root, rotations = cubic_at(motion, np.array([frame]))
    places, _ = forward_kinematics(Motion(motion.skeleton, root, rotations, motion.fps))
    hips = places[0, identify(motion.skeleton).hips] * (1.0, 1.0, 0.0)
    way = impact - hips
    if not np.hypot(way[0], way[1]) > _NEAREST:
        raise InputError(f"example {name}", "a target right above or below the hips", "one some way off")
    turn = -float(np.arctan2(way[1], way[0]))
    shift = -quaternion.rotate(quaternion.about_up(np.array(turn)), hips)
    return place(motion, turn, shift), turn, shift


def _frames(motion: Motion, first: float, count: int, fps: float) -> list[np.ndarray]:
    """Of an example of `count` frames from second `first`: its frames, those known before it and those after it, at
    `fps`, as far as windows see."""
    last = int(np.floor((motion.duration - first) * fps + 1e-6))
    back = min(int(np.floor(first * fps + 1e-6)), int(np.ceil(BACK * STEP * fps)))
    ahead = min(last, count - 1 + int(np.ceil(AHEAD * STEP * fps)) + 1)
    return [np.arange(count), np.arange(-back, 0), np.arange(count, ahead + 1)]


def _resampled(motion: Motion, frames: np.ndarray, first: float, fps: float) -> Motion | None:
    """Frames (N,) counted at `fps` from second `first`, or None where there are none."""
    if not len(frames):
        return None
    root, rotations = cubic_at(motion, (first + frames / fps) * motion.fps)
    return Motion(motion.skeleton, root, rotations, fps)


def effectors_of(motion: Motion) -> np.ndarray:
    """Places (T, 4, 3) m of the wrists and toes."""
    return forward_kinematics(motion)[0][:, list(chains_of(motion.skeleton).effectors)]


def describe(example: Example) -> Description:
    """What is known of the example's motion before it is generated."""
    places, turns = forward_kinematics(example.motion)
    joints = list(chains_of(example.motion.skeleton).effectors)
    return Description(
        effectors=places[:, joints], hands=quaternion.to_matrix(turns[:, joints[:2]]), limb=example.limb,
        release=example.release, impact=example.impact, fps=example.motion.fps, before=example.before,
        after=example.after,
    )


def poses(example: Example) -> Pose:
    """The states (T, ...) of the example's body; `moved` is backward, nothing in the first frame."""
    motion = example.motion
    pose = pose_of(motion.skeleton, motion.root_positions, matrices(motion))
    return pose._replace(moved=np.diff(pose.positions, axis=0, prepend=pose.positions[:1]))


def mirrored(example: Example) -> Example:
    """The same throw with the other arm, or kick with the other leg."""
    def side(effectors):
        return None if effectors is None else effectors[:, [1, 0, 3, 2]] * (1.0, -1.0, 1.0)

    return replace(
        example, motion=mirror(example.motion), limb=example.limb ^ 1, impact=example.impact * (1.0, -1.0, 1.0),
        launch=None if example.launch is None else example.launch * (1.0, -1.0, 1.0), before=side(example.before),
        after=side(example.after),
    )
