"""Hits recognised while frames arrive: the last seconds of a stream are analysed again and again (Ball handling §4).

A hit motion is told once it is over, that is when the part has come to rest again: only then can its whole way be
compared with others (eq. 2). It takes the seconds of the follow-through; the paper's user waits as long.
"""

from __future__ import annotations

import numpy as np

from ...ball.contact import Tool
from ...motion.motion import Motion
from ..hits import HitMotion, analyse
from .listener import Arrived, Listener, poses

WINDOW = 4.0
"""Seconds that are looked at."""
_RATE = 60.0
_LEAST = 0.5
_SETTLED = 0.05


class LiveHits:
    """Watches a listener for hits of a part. side: "left", "right", or "" for either. threshold: as in `analyse`."""

    def __init__(self, listener: Listener, part: str = "foot", side: str = "", threshold: float | None = None,
                 tool: Tool | None = None):
        self.listener, self.part, self.threshold, self.tool = listener, part, threshold, tool
        sided = part in ("foot", "hand", "tool")
        self.sides = ((side,) if side else ("left", "right")) if sided else ("",)
        self._after = float("-inf")
        self._seen = 0

    def look(self) -> tuple[HitMotion, float] | None:
        """The strongest hit motion that has ended since the last look, and the seconds (monotonic clock) of its key;
        None where there is none. InputError for a part that the streamed body lacks."""
        frames = self.listener.since(0)
        if not frames or frames[-1].number == self._seen:
            return None
        self._seen = frames[-1].number
        frames = [frame for frame in frames if frame.time > frames[-1].time - WINDOW]
        if frames[-1].time - frames[0].time < _LEAST:
            return None
        motion, times = even(frames, _RATE)
        found = [hit for side in self.sides for hit in self._hits(motion, side)]
        new = [hit for hit in found if times[hit.first] > self._after]
        if not new:
            return None
        best = max(new, key=lambda hit: hit.max_speed)
        self._after = float(times[best.key])
        return best, float(times[best.key])

    def _hits(self, motion: Motion, side: str) -> list[HitMotion]:
        """Hit motions that are whole: begun within the window and over by now."""
        settled = len(motion) - 1 - int(np.ceil(_SETTLED * motion.fps))
        found = analyse(motion, self.part, side, self.threshold, tool=self.tool).motions
        return [hit for hit in found if 0 < hit.first and hit.last < settled]


def recorded(listener: Listener, seconds: float, rate: float | None = None) -> Motion | None:
    """The last `seconds` of a stream as a motion; None where there is less than two frames. rate: no more frames a
    second than this. Networks bring frames in bunches, so they are taken to be evenly apart from the first to the
    last."""
    frames = listener.since(0)
    frames = [frame for frame in frames if frame.time > frames[-1].time - seconds]
    return even(frames, rate)[0] if len(frames) > 1 and frames[-1].time > frames[0].time else None


def even(frames: list[Arrived], rate: float | None = None) -> tuple[Motion, np.ndarray]:
    """Frames that came in, two or more, as a motion, and the seconds (T,) of its frames; `rate` as above."""
    seconds = frames[-1].time - frames[0].time
    step = 1 if rate is None else max(1, int(len(frames) / (seconds * rate)))
    frames = frames[::-1][::step][::-1]
    skeleton, root, rotations = poses(frames)
    seconds = max(frames[-1].time - frames[0].time, 1e-3)
    fps = (len(frames) - 1) / seconds
    return Motion(skeleton, root, rotations, fps), frames[0].time + np.arange(len(frames)) / fps
