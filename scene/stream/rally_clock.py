"""The scene's time at a moment of the clock, from when a playback came to which frame, however slowly it is drawn."""

from __future__ import annotations

from collections import deque

import numpy as np

_MOST_FRAMES = 120  # frames that are remembered: some seconds, and a strike is noticed within half of one
_PACE_FRAMES = 12  # latest frames from which it is known how fast the playback goes


class RallyClock:
    """The frames that a playback has come to, with their moments."""

    def __init__(self) -> None:
        self._frames: deque[tuple[float, float]] = deque(maxlen=_MOST_FRAMES)

    def note_frame(self, moment: float, seconds: float) -> None:
        """Note that the playback has come to a frame.

        Args:
            moment: s on the monotonic clock.
            seconds: s of the frame on the rally's clock; before the last one where the playback has begun again.
        """
        if self._frames and (seconds < self._frames[-1][1] or moment <= self._frames[-1][0]):
            self._frames.clear()
        self._frames.append((moment, seconds))

    def forget_frames(self) -> None:
        """Forget all frames: what is not played has no pace."""
        self._frames.clear()

    def find_seconds(self, moment: float) -> float | None:
        """Find the scene's time at a moment, as if each frame were drawn at once.

        Args:
            moment: s on the monotonic clock.
        Returns:
            s on the rally's clock: between two frames in proportion, after the last one at the pace of the playback,
            which is never faster than the clock, before the first one that frame's; None before two frames are known.
        """
        if len(self._frames) < 2:
            return None
        moments, seconds = np.transpose(self._frames)
        pace = np.median((np.diff(seconds) / np.diff(moments))[-_PACE_FRAMES:])  # not of a pause
        return float(np.interp(moment, moments, seconds) + min(pace, 1.0) * max(moment - moments[-1], 0.0))
