"""Description of a throw or kick before it is generated, and the windows of it that networks receive in each frame.

The description contains the positions of hands and feet, the release and the target.
Source: Fredriksson sections 7.1 and 7.7, eq. 7.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import freeze_array
from .phases import compute_motion_phase, compute_warped_phase

STEP = 0.1
"""Seconds between two samples of a window: 20 frames of Fredriksson's 200 Hz."""
BACK, AHEAD = 2, 6
SAMPLES = BACK + 1 + AHEAD


@dataclass(frozen=True, eq=False, kw_only=True)
class Description:
    """What a motion has to be, in the normalised frame: metres, Z up, floor at 0, X from the hips to the impact.

    The origin is below the first position of the hips.

    Attributes:
        effectors: (T, 4, 3) m, positions of left and right wrist, left and right toe.
        hands: (T, 2, 3, 3), world rotations of the hand joints, or None.
        limb: index into `chains.EFFECTORS` of the limb that throws or kicks.
        release: fractional frame at which the ball leaves.
        impact: (3,) m, the point that the ball has to hit.
        fps: frames per second.
        before: (B, 4, 3) m, positions of the effectors in the frames before the first, or None: they do not move.
        after: (A, 4, 3) m, positions of the effectors in the frames after the last, or None: they do not move.
    """

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
                object.__setattr__(self, name, freeze_array(getattr(self, name)))
        count = len(self.effectors)
        shapes = {"effectors": (count, 4, 3), "hands": (count, 2, 3, 3), "impact": (3,)}
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array is not None and not (array.shape == shape and np.all(np.isfinite(array))):
                raise InputError(f"description: {name}", f"shape {array.shape}", f"{shape}, finite")
        if count < 2 or self.limb not in range(4) or not 0.0 <= self.release <= count - 1 or not self.fps > 0:
            found = f"{count} frames at {self.fps:g} per second, limb {self.limb}, release at frame {self.release:g}"
            raise InputError("description", found, "at least two frames, a limb of 0 to 3, a release within the frames")

    def __len__(self) -> int:
        return len(self.effectors)


class Windows(NamedTuple):
    """Network inputs of each frame n, leading axes free.

    Attributes:
        points: (..., 4, 9, 3) m, positions of the effectors from 0.2 s before to 0.6 s after.
        deltas: (..., 4, 9, 3) m, their displacements in the following frame.
        next: (..., 4, 3) m, their positions in frame n + 1.
        hands_next: (..., 2, 3, 3), the hands' rotations in frame n + 1, or None.
        sides: (..., 2), b_l and b_r, the side that throws or kicks.
        impact: (..., 3) m.
        phase: (...), the motion phase.
    """

    points: np.ndarray
    deltas: np.ndarray
    next: np.ndarray
    hands_next: np.ndarray | None
    sides: np.ndarray
    impact: np.ndarray
    phase: np.ndarray


def build_windows(description: Description, reference: np.ndarray | None = None) -> Windows:
    """Build the windows (T, ...) of all frames.

    Between frames, positions are interpolated linearly; beyond the known ones they do not move. The `next` and
    `hands_next` of the last frame are therefore its own, or the first of `after`.

    Args:
        description: the description.
        reference: (N,) speed curve for warped phases (section 9.3); None for phases by distance (eq. 7.2).
    """
    frames = np.arange(len(description))
    sample_frames = frames[:, None] + np.arange(-BACK, AHEAD + 1) * (STEP * description.fps)
    points = interpolate_positions(description, sample_frames)
    hands = description.hands
    return Windows(
        points=np.swapaxes(points, 1, 2), deltas=np.swapaxes(interpolate_positions(description, sample_frames + 1.0)
                                                             - points, 1, 2),
        next=interpolate_positions(description, frames + 1.0), hands_next=None if hands is None
        else hands[np.minimum(frames + 1, len(hands) - 1)], sides=np.broadcast_to(np.eye(2)[description.limb % 2],
                                                                                  (len(frames), 2)),
        impact=np.broadcast_to(description.impact, (len(frames), 3)), phase=compute_phases(description, reference),
    )


def compute_phases(description: Description, reference: np.ndarray | None = None) -> np.ndarray:
    """Compute the motion phase (T,) of the throwing limb, by travelled distance or warped to a reference curve (N,)."""
    effector = description.effectors[:, description.limb]
    if reference is None:
        return compute_motion_phase(effector, description.release, description.fps)
    return compute_warped_phase(effector, description.release, description.fps, reference)


def interpolate_positions(description: Description, frames: np.ndarray) -> np.ndarray:
    """Interpolate the positions of the effectors (..., 4, 3) m at fractional frames (...), also beyond both ends."""
    before = np.zeros((0, 4, 3)) if description.before is None else description.before
    after = np.zeros((0, 4, 3)) if description.after is None else description.after
    known = np.concatenate([before, description.effectors, after])
    at = np.clip(np.asarray(frames, dtype=float) + len(before), 0.0, len(known) - 1.0)
    low = np.minimum(np.floor(at).astype(int), len(known) - 2)
    share = (at - low)[..., None, None]
    return (1.0 - share) * known[low] + share * known[low + 1]


def scale_description(description: Description, ratio: float) -> Description:
    """Scale a description to a body `ratio` times as large, and its target with it (section 4.5)."""
    scaled_arrays = {
        name: None if getattr(description, name) is None else getattr(description, name) * ratio
        for name in ("effectors", "impact", "before", "after")
    }
    return replace(description, **scaled_arrays)
