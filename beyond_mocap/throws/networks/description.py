"""All that is known of a throw or kick before it is generated (Fredriksson §7.1, §7.7): where hands and feet are to
be, when the ball leaves, and what it is to hit; and the windows of it that networks see in each frame (eq. 7.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import frozen_array
from .phases import motion_phase, warped_phase

STEP = 0.1
"""Seconds between two samples of a window: 20 frames of his 200 Hz."""
BACK, AHEAD = 2, 6
SAMPLES = BACK + 1 + AHEAD


@dataclass(frozen=True, eq=False, kw_only=True)
class Description:
    """What a motion is to be, in the normalised frame: metres, Z up, floor at 0, the hips' first place over the
    ground at the origin, +X from there to the impact.

    effectors: (T, 4, 3) m, places of left and right wrist, left and right toe. hands: (T, 2, 3, 3), rotations of the
    hand joints in the world, or None. limb: which of `chains.EFFECTORS` throws or kicks. release: fractional frame at
    which the ball leaves it. impact: (3,) m, what the ball is to hit. fps: frames per second. before (B, 4, 3), after
    (A, 4, 3): places of the effectors in the frames beyond both ends, where they are known; else they are taken to
    keep still."""

    effectors: np.ndarray
    hands: np.ndarray | None
    limb: int
    release: float
    impact: np.ndarray
    fps: float
    before: np.ndarray | None = None
    after: np.ndarray | None = None

    def __post_init__(self):
        for name in ("effectors", "hands", "impact", "before", "after"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen_array(getattr(self, name)))
        count = len(self.effectors)
        shapes = {"effectors": (count, 4, 3), "hands": (count, 2, 3, 3), "impact": (3,)}
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array is not None and not (array.shape == shape and np.all(np.isfinite(array))):
                raise InputError(f"description: {name}", f"shape {array.shape}", f"{shape}, finite")
        if count < 2 or self.limb not in range(4) or not 0.0 <= self.release <= count - 1 or not self.fps > 0:
            found = f"{count} frames at {self.fps:g} a second, limb {self.limb}, release at frame {self.release:g}"
            raise InputError("description", found, "two frames or more, a limb of 0 to 3, a release among the frames")

    def __len__(self) -> int:
        return len(self.effectors)


class Windows(NamedTuple):
    """What networks are told of each frame n, leading axes free.

    points, deltas (..., 4, 9, 3) m: places of the effectors from 0.2 s before to 0.6 s after, and how far each goes
    in the frame that follows. next (..., 4, 3) m: their places in frame n + 1. hands_next (..., 2, 3, 3): the hands'
    rotations there, or None. sides (..., 2): b_l, b_r, which side throws or kicks. impact (..., 3) m. phase (...):
    the motion phase."""

    points: np.ndarray
    deltas: np.ndarray
    next: np.ndarray
    hands_next: np.ndarray | None
    sides: np.ndarray
    impact: np.ndarray
    phase: np.ndarray


def windows(description: Description, reference: np.ndarray | None = None) -> Windows:
    """The windows (T, ...) of all frames. reference: the speed curve for warped phases (§9.3), else eq. 7.2.

    Between frames, places are linear; beyond the ends they are the known ones, then they keep still. The last frame's
    `next` and `hands_next` are therefore the frame's own, or the first of `after`."""
    frames = np.arange(len(description))
    seen = frames[:, None] + np.arange(-BACK, AHEAD + 1) * (STEP * description.fps)
    points = places_at(description, seen)
    hands = description.hands
    return Windows(
        points=np.swapaxes(points, 1, 2), deltas=np.swapaxes(places_at(description, seen + 1.0) - points, 1, 2),
        next=places_at(description, frames + 1.0),
        hands_next=None if hands is None else hands[np.minimum(frames + 1, len(hands) - 1)],
        sides=np.broadcast_to(np.eye(2)[description.limb % 2], (len(frames), 2)),
        impact=np.broadcast_to(description.impact, (len(frames), 3)), phase=phases(description, reference),
    )


def phases(description: Description, reference: np.ndarray | None = None) -> np.ndarray:
    """The motion phase (T,) of the throwing limb: by travelled distance, or warped to a reference curve."""
    effector = description.effectors[:, description.limb]
    if reference is None:
        return motion_phase(effector, description.release, description.fps)
    return warped_phase(effector, description.release, description.fps, reference)


def places_at(description: Description, frames: np.ndarray) -> np.ndarray:
    """Places of the effectors (..., 4, 3) m at fractional frames (...), which may lie beyond both ends."""
    before = np.zeros((0, 4, 3)) if description.before is None else description.before
    after = np.zeros((0, 4, 3)) if description.after is None else description.after
    known = np.concatenate([before, description.effectors, after])
    at = np.clip(np.asarray(frames, dtype=float) + len(before), 0.0, len(known) - 1.0)
    low = np.minimum(np.floor(at).astype(int), len(known) - 2)
    share = (at - low)[..., None, None]
    return (1.0 - share) * known[low] + share * known[low + 1]


def scaled(description: Description, ratio: float) -> Description:
    """The same movement of a body `ratio` times as large, with its target as far away in its own measure (§4.5)."""
    larger = {
        name: None if getattr(description, name) is None else getattr(description, name) * ratio
        for name in ("effectors", "impact", "before", "after")
    }
    return replace(description, **larger)
