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
from itertools import islice

import numpy as np

from ...annotation.striking import SIDED_PARTS
from ...ball.contact import Tool
from ...motion.motion import Motion, forward_kinematics
from ..hits import HitMotion, detect_hit_under_way, detect_hits
from ..part_trajectory import PartMeasures, Poses, measure_part
from .listener import Listener, StreamFrame, convert_poses

WINDOW = 4.0
"""Seconds of the stream that are analysed."""
_RATE = 60.0  # Hz: most frames per second that are analysed
_LEAST_SECONDS = 0.5  # s of frames without which nothing is analysed
_SETTLE_SECONDS = 0.05  # s by which a hit motion has to be over
_PAUSES = 0.015, 0.04  # s between two looks of the thread, at least and at most; between them as long as a look takes
_ANSWER_PAUSE = 0.2  # s after a strike, which is being answered: looks would slow that down
_TAKING_SECONDS = 0.5  # s for which a strike that has been found is expected to be taken
_LATEST_ARRIVAL = 1.0  # s from sender to listener; a stream that says more has another clock
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
        sided = part in SIDED_PARTS
        self.sides = ((side,) if side else ("left", "right")) if sided else ("",)
        self._after = self._seen_until = float("-inf")
        self._last_number = 0
        self._found_at = float("-inf")
        self._found: queue.SimpleQueue[tuple[HitMotion, float] | Exception] = queue.SimpleQueue()

    def start(self) -> LiveHits:
        """Start the thread; it ends with the listener."""
        threading.Thread(target=self._watch, name="beyond_mocap strikes", daemon=True).start()
        return self

    @property
    def is_hit_waiting(self) -> bool:
        """Whether a strike has just been found that is not taken yet."""
        return not self._found.empty() and time.monotonic() < self._found_at + _TAKING_SECONDS

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
            start, found = time.monotonic(), None
            try:
                if (found := self.find_new_hit()) is not None:
                    self._found_at = time.monotonic()
                    self._found.put(found)
            except Exception as error:  # raised where it is taken
                if str(error) != reported:
                    self._found.put(error)
                reported = str(error)
            pause = min(max(time.monotonic() - start, _PAUSES[0]), _PAUSES[1])
            time.sleep(pause if found is None else _ANSWER_PAUSE)

    def find_new_hit(self) -> tuple[HitMotion, float] | None:
        """Find the strongest hit motion whose strike has been since the last one that was found.

        Returns:
            The hit motion and the time of its key (s, monotonic clock): when it was sent, if the stream says so,
            otherwise when it arrived. None where there is no new one.
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
        frames, fps = _choose_frames(frames, _RATE)
        motion = Motion(*convert_poses(frames), fps)
        times = frames[0].time + np.arange(len(frames)) / fps
        unseen = int(np.count_nonzero(times > self._seen_until))
        self._seen_until = float(times[-1])
        found = self._detect_hits(motion, unseen)
        new = [hit for hit in found if times[hit.first] > self._after]
        if not new:
            return None
        best = max(new, key=lambda hit: hit.max_speed)
        self._after = float(times[best.key])
        key = frames[best.key]
        is_dated = key.sent is not None and 0.0 <= key.time - key.sent <= _LATEST_ARRIVAL
        return best, key.sent if is_dated else self._after

    def _detect_hits(self, motion: Motion, unseen: int) -> list[HitMotion]:
        """Find the hit motions that have begun within the window: those under way, and those that are over.

        A busy program looks seldom, so those under way are searched at each moment of the last `unseen` frames.
        """
        poses = forward_kinematics(motion)  # once, for both sides and all moments
        settled = len(motion) - 1 - int(np.ceil(_SETTLE_SECONDS * motion.fps))
        step, found = max(int(_LOOK_SECONDS * motion.fps), 1), []
        ends = [len(motion), *range(len(motion) - step, max(len(motion) - unseen, 2), -step)]
        moments = [motion.frames(0, end) for end in ends]
        measures = [self._measure(one, (poses[0][:end], poses[1][:end])) for one, end in zip(moments, ends)]
        for side in self.sides:
            whole = detect_hits(motion, self.part, side, self.threshold, tool=self.tool, measured=measures[0][side])
            found += [hit for hit in whole.motions if 0 < hit.first and hit.last < settled]
            under_way = (detect_hit_under_way(one, self.part, side, self.threshold, tool=self.tool,
                                              measured=measured[side]) for one, measured in zip(moments, measures))
            found += islice(filter(None, under_way), 1)
        return found

    def _measure(self, motion: Motion, poses: Poses) -> dict[str, PartMeasures]:
        """Measure the part of each side; the body is the same."""
        measures: dict[str, PartMeasures] = {}
        for side in self.sides:
            body = next((one.body for one in measures.values()), None)
            measures[side] = measure_part(motion, self.part, side, tool=self.tool, poses=poses, body=body)
        return measures


def build_recording(listener: Listener, seconds: float) -> Motion | None:
    """Build a motion from the last seconds of a stream.

    Networks deliver frames in bursts, so the frames are spaced evenly from the first to the last.

    Args:
        listener: the listener.
        seconds: how much of the stream.
    Returns:
        The motion, or None if there are fewer than two frames.
    """
    frames = listener.frames_since(0)
    frames = [frame for frame in frames if frame.time > frames[-1].time - seconds]
    if len(frames) < 2 or frames[-1].time <= frames[0].time:
        return None
    frames, fps = _choose_frames(frames)
    return Motion(*convert_poses(frames), fps)


def _choose_frames(frames: list[StreamFrame], rate: float | None = None) -> tuple[list[StreamFrame], float]:
    """Choose frames that are taken as evenly spaced.

    Args:
        frames: two frames or more that have arrived.
        rate: most frames per second; None: all.
    Returns:
        The chosen frames, and how many of them there are per second.
    """
    seconds = frames[-1].time - frames[0].time
    step = 1 if rate is None else max(1, int(len(frames) / (seconds * rate)))
    # every `step`-th frame, counted from the last one so that it is always kept
    frames = frames[::-1][::step][::-1]
    return frames, (len(frames) - 1) / max(frames[-1].time - frames[0].time, 1e-3)
