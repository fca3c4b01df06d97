"""Hits detected while frames arrive: the last seconds of a stream are analysed again and again (Ball handling, section
4).

A strike is reported as soon as the part slows down again, some 0.1 s after it was fastest, and compared by what eq. 2
knows by then: the highest speed, and the way to the strike. A hit motion that is noticed only as a whole, such as one
that rises late, is reported when it is over.
"""

from __future__ import annotations

import queue
import threading
import time

import numpy as np

from ...ball.contact import Tool
from ...motion.motion import Motion, forward_kinematics
from ..hits import HitMotion, detect_hit_under_way, detect_hits
from ..part_trajectory import Poses
from .listener import Listener, StreamFrame, convert_poses

WINDOW = 4.0
"""Seconds of the stream that are analysed."""
_RATE = 60.0  # Hz: most frames per second that are analysed
_LEAST_SECONDS = 0.5  # s of frames without which nothing is analysed
_SETTLE_SECONDS = 0.05  # s by which a hit motion has to be over
_PAUSES = 0.015, 0.04  # s between two looks of the thread, at least and at most; between them as long as a look takes
_LOOK_SECONDS = 0.1  # s between two moments that are analysed at most: a strike shows for some 0.2 s while under way


class LiveHits:
    """Detects hits of a part in the frames of a listener; once it is started in a thread of its own, so that a strike
    is noticed while the program draws.

    Args:
        listener: the listener.
        part: "foot", "head", "chest", "hand", "tool", or a joint's name.
        side: "left", "right", or "" for either.
        threshold: as in `detect_hits`.
        tool: what is in the hand.
    """

    def __init__(self, listener: Listener, part: str = "foot", side: str = "", threshold: float | None = None,
                 tool: Tool | None = None):
        self.listener, self.part, self.threshold, self.tool = listener, part, threshold, tool
        sided = part in ("foot", "hand", "tool")
        self.sides = ((side,) if side else ("left", "right")) if sided else ("",)
        self._after = self._seen_until = float("-inf")
        self._last_number = 0
        self._found: queue.SimpleQueue[tuple[HitMotion, float] | Exception] = queue.SimpleQueue()

    def start(self) -> LiveHits:
        """Start the thread; it ends with the listener."""
        threading.Thread(target=self._watch, name="beyond_mocap strikes", daemon=True).start()
        return self

    def take_hit(self) -> tuple[HitMotion, float] | None:
        """Take what the thread has found: as `find_new_hit`, which it also raises."""
        if self._found.empty():
            return None
        found = self._found.get()
        if isinstance(found, Exception):
            raise found
        return found

    def _watch(self) -> None:
        """Look for new hits until the listener stops; an error is found once."""
        reported = ""
        while self.listener.is_running:
            start = time.monotonic()
            try:
                if (found := self.find_new_hit()) is not None:
                    self._found.put(found)
            except Exception as error:  # raised where it is taken
                if str(error) != reported:
                    self._found.put(error)
                reported = str(error)
            time.sleep(min(max(time.monotonic() - start, _PAUSES[0]), _PAUSES[1]))

    def find_new_hit(self) -> tuple[HitMotion, float] | None:
        """Find the strongest hit motion whose strike has been since the last one that was found.

        Returns:
            The hit motion and the time of its key (s, monotonic clock), or None.
        Raises:
            InputError: if the streamed body lacks the part.
        """
        frames = self.listener.frames_since(0)
        if not frames or frames[-1].number == self._last_number:
            return None
        self._last_number = frames[-1].number
        frames = [frame for frame in frames if frame.time > frames[-1].time - WINDOW]
        if frames[-1].time - frames[0].time < _LEAST_SECONDS:
            return None
        motion, times = space_evenly(frames, _RATE)
        unseen = int(np.count_nonzero(times > self._seen_until))
        self._seen_until = float(times[-1])
        poses = forward_kinematics(motion)  # once, for both sides and all moments
        found = [hit for side in self.sides for hit in self._detect_hits(motion, poses, side, unseen)]
        new = [hit for hit in found if times[hit.first] > self._after]
        if not new:
            return None
        best = max(new, key=lambda hit: hit.max_speed)
        self._after = float(times[best.key])
        return best, float(times[best.key])

    def _detect_hits(self, motion: Motion, poses: Poses, side: str, unseen: int) -> list[HitMotion]:
        """Find the hit motions that have begun within the window: the one under way, and those that are over.

        A busy program looks seldom, so the one under way is searched at each moment of the last `unseen` frames.
        """
        settled = len(motion) - 1 - int(np.ceil(_SETTLE_SECONDS * motion.fps))
        found = detect_hits(motion, self.part, side, self.threshold, tool=self.tool, poses=poses).motions
        found = [hit for hit in found if 0 < hit.first and hit.last < settled]
        step = max(int(_LOOK_SECONDS * motion.fps), 1)
        for end in range(len(motion), max(len(motion) - unseen, 2), -step):
            until = poses[0][:end], poses[1][:end]
            under_way = detect_hit_under_way(motion.frames(0, end), self.part, side, self.threshold, tool=self.tool,
                                             poses=until)
            if under_way is not None:
                return [*found, under_way]
        return found


def build_recording(listener: Listener, seconds: float, rate: float | None = None) -> Motion | None:
    """Build a motion from the last seconds of a stream.

    Networks deliver frames in bursts, so the frames are spaced evenly from the first to the last.

    Args:
        listener: the listener.
        seconds: how much of the stream.
        rate: most frames per second; None: all.
    Returns:
        The motion, or None if there are fewer than two frames.
    """
    frames = listener.frames_since(0)
    frames = [frame for frame in frames if frame.time > frames[-1].time - seconds]
    return space_evenly(frames, rate)[0] if len(frames) > 1 and frames[-1].time > frames[0].time else None


def space_evenly(frames: list[StreamFrame], rate: float | None = None) -> tuple[Motion, np.ndarray]:
    """Build a motion with evenly spaced frames.

    Args:
        frames: two frames or more that have arrived.
        rate: most frames per second; None: all.
    Returns:
        motion: the motion, T frames.
        times: (T,) s of its frames, monotonic clock.
    """
    seconds = frames[-1].time - frames[0].time
    step = 1 if rate is None else max(1, int(len(frames) / (seconds * rate)))
    # every `step`-th frame, counted from the last one so that it is always kept
    frames = frames[::-1][::step][::-1]
    skeleton, root, rotations = convert_poses(frames)
    seconds = max(frames[-1].time - frames[0].time, 1e-3)
    fps = (len(frames) - 1) / seconds
    return Motion(skeleton, root, rotations, fps), frames[0].time + np.arange(len(frames)) / fps
