"""The motion that stays on both sides of a stretch which is constructed again."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...motion import quaternion
from ...motion.track import SampledTrack
from ...motion.track.sampling import MOVING_SPEED
from .meeting import eased
from .on_track import pulled_to_track

MOST_TURN = 1.5 * np.pi
"""Radians that a body may turn on the spot so as to turn the way it did before."""

OFFSET_SECONDS = 1.0
"""Seconds within a stretch over which the root forgets how far off the constructed place the old one was at its end."""


@dataclass(frozen=True, eq=False, kw_only=True)
class OldMotion:
    """What was shown before in the W frames of a window.

    root: (W, 3) m.
    rotation: (W, 4) of the root joint.
    stepped: (W, 2) bool, extra steps of either foot.
    share: (W,) of the old motion in what comes out, 0 where it is replaced.
    stretch: first and end frame of the window between which it is free.
    """

    root: np.ndarray
    rotation: np.ndarray
    stepped: np.ndarray
    share: np.ndarray
    stretch: tuple[int, int]

    @property
    def stays(self) -> np.ndarray:
        """(W,) bool: frames in which some of it stays."""
        return self.share > 0.0

    def heading_of(self, pose: np.ndarray) -> np.ndarray:
        """(W,) rad with which poses (W, J, 4) out of the facing frame face as the old motion; NaN where they are
        free."""
        heading = quaternion.yaw(quaternion.multiply(self.rotation, quaternion.inverse(pose[:, 0])))
        heading[~self.stays] = np.nan
        return heading

    def turned_alike(self, track: SampledTrack, heading: np.ndarray) -> SampledTrack | None:
        """The track with the direction in which a body turns the same way round as the old one.

        Args:
            track: W frames.
            heading: (W,) rad of the new body on that track, unwrapped.

        Returns:
            None where both turn alike, or where the body is nowhere so slow that both ways will do.
        """
        old = np.unwrap(quaternion.yaw(self.rotation))
        first, end = max(self.stretch[0] - 1, 0), min(self.stretch[1], len(heading) - 1)
        turns = np.round((heading[end] - heading[first] - old[end] + old[first]) / (2.0 * np.pi))
        slow = track.speed < MOVING_SPEED
        middle = first + int(np.argmin(track.speed[first : end + 1]))
        if turns == 0 or not slow[middle]:
            return None
        fast = np.flatnonzero(~slow[first : end + 1]) + first
        low, high = max(fast[fast < middle], default=first), min(fast[fast > middle], default=end)
        if abs(heading[high] - heading[low] - 2.0 * np.pi * turns) > MOST_TURN:
            return None
        ramp = eased((np.arange(len(heading)) - low) / max(high - low, 1), np.ones(len(heading)))
        return replace(track, direction=track.direction - 2.0 * np.pi * turns * ramp)

    def pulled(self, ground: np.ndarray, track: SampledTrack, window: float) -> np.ndarray:
        """Pull a root onto the track between what stays; near that it sets out from where the old one is.

        Args:
            ground: (W, 2) m, the constructed root.
            track: W frames.
            window: seconds, as `pulled_to_track` has it.
        """
        old, stays = self.root[:, :2], self.stays
        first, end = self.stretch
        at, fade = np.arange(len(ground)), max(1.0, min(OFFSET_SECONDS * track.fps, end - first))
        root = ground.copy()
        for edge in [edge for edge in (first - 1, end) if 0 <= edge < len(ground)]:
            near = eased(1.0 - np.abs(at - edge) / fade, np.ones(len(at)))[:, None]
            root += np.where(stays[:, None], 0.0, near * (old - ground)[edge])
        root = np.where(stays[:, None], old, root)
        pulled = pulled_to_track(root, track.raw, track.fps, window)
        return pulled + self.share[:, None] * (old - pulled)

    def kept_steps(self) -> np.ndarray:
        """(W, 2) bool: the steps that are taken, in whole or in part, where the old motion stays."""
        kept = np.zeros_like(self.stepped)
        for side in range(kept.shape[1]):
            stepped = self.stepped[:, side]
            number = np.cumsum(np.diff(stepped, prepend=False)) * stepped
            kept[:, side] = stepped & np.isin(number, number[self.stays & stepped])
        return kept
