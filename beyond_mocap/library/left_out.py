"""Which seconds of a library's locomotion do not belong to it, and why.

The search avoids frames labelled as locomotion whose posture is not that of locomotion at their speed
(`library.posture`), such as a guard while walking, unless their labels are asked for. Here they become stretches that
people can look up, each with the part of the body that is most unlike.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

from ..annotation import LOCOMOTION
from ..annotation.gaits import TURNING
from ..annotation.labels import find_label
from ..base.time_series import find_runs
from .features import Frames
from .library import Library
from .posture import SPEED_EDGES

MAX_LISTED = 12
"""Stretches left out of locomotion that people read at once."""

_JOINED, _SHORTEST = 0.4, 0.5  # seconds between stretches that are one; of the shortest stretch that is listed
_FAR = 0.3  # of a direction's component or in leg lengths: an offset that has a name
_found: weakref.WeakKeyDictionary[Library, tuple[LeftOut, ...]] = weakref.WeakKeyDictionary()


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """A stretch of a clip that is left out of locomotion.

    Attributes:
        clip: its path below the library's folder.
        start, end: seconds from the clip's first frame.
        part: of the body that is most unlike locomotion, of `posture.PARTS`.
        how: what that part does, or "".
        gait: the gait at that speed.
        speed: m/s, mean.
    """

    clip: str
    start: float
    end: float
    part: str
    how: str
    gait: str
    speed: float

    @property
    def reason(self) -> str:
        """Why, such as "arms (hands up) unlike walking at 0.8 m/s"."""
        return f"{self.part}{f' ({self.how})' if self.how else ''} unlike {self.gait} at {self.speed:.1f} m/s"

    def describe(self) -> str:
        """Describe the stretch in a line."""
        return f"{PurePosixPath(self.clip).name} {self.start:.1f} to {self.end:.1f} s: {self.reason}"


@dataclass(frozen=True, kw_only=True)
class SpeedClass:
    """Locomotion recorded in a range of speeds.

    Attributes:
        low, high: m/s; the highest is infinite.
        seconds: recorded, mirrored twins not counted.
        left_out: seconds of it that do not belong.
    """

    low: float
    high: float
    seconds: float
    left_out: float


def find_left_out(library: Library) -> tuple[LeftOut, ...]:
    """Find the stretches of locomotion that do not belong to it, in the library's order; computed once for each."""
    if library not in _found:
        _found[library] = _find_left_out(library)
    return _found[library]


def _find_left_out(library: Library) -> tuple[LeftOut, ...]:
    """Find the stretches of locomotion that do not belong to it."""
    frames = library.frames
    is_strange = select_locomotion_alone(frames, library.clips) & (library.strangeness > 1.0)
    found = []
    for index, clip in enumerate(library.clips):
        first = frames.first[index]
        runs = find_runs(is_strange[first : first + frames.count[index]])
        for start, end in _join_runs(runs, int(_JOINED * library.fps)):
            if end - start >= _SHORTEST * library.fps:
                part = slice(first + start, first + end)
                found.append(_describe_stretch(library, clip.path, part, frames.speed[part], start=start / library.fps,
                                               end=(end - 1) / library.fps))
    return tuple(found)


def select_locomotion_alone(frames: Frames, clips: Sequence) -> np.ndarray:
    """Select the frames (N,) bool of recordings, twins left out, whose labels say no more than locomotion and turns."""
    acts = [i for i, word in enumerate(frames.vocabulary) if _names_act(word)]
    gaits = [i for i, word in enumerate(frames.vocabulary) if word in LOCOMOTION]
    own = np.array([not clip.mirrored and not clip.is_synthetic for clip in clips])
    return own[frames.clip] & frames.words[:, gaits].any(axis=1) & ~frames.words[:, acts].any(axis=1)


def _names_act(word: str) -> bool:
    """Whether a label names more than locomotion, turns and directions."""
    return bool(set(find_label(word).kinds) - {"modifier"}) and word not in (*LOCOMOTION, TURNING)


def _join_runs(runs: list[tuple[int, int]], gap: int) -> list[tuple[int, int]]:
    """Join runs with fewer than `gap` frames between them."""
    joined: list[tuple[int, int]] = []
    for start, end in runs:
        if joined and start - joined[-1][1] < gap:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((start, end))
    return joined


def _describe_stretch(library: Library, path: str, frames: slice, speed: np.ndarray, *, start: float,
                      end: float) -> LeftOut:
    """Describe a stretch of the library's frames, of `speed` m/s, by the part that is most unlike the locomotion of
    that speed.
    """
    posture = library.frames.posture[frames]
    is_strange = library.normal_postures.measure_strangeness(posture, speed) > 1.0
    part, how = "hips", "falling"  # each posture of a hop may be usual
    if is_strange.any():
        parts = library.normal_postures.measure_parts(posture[is_strange], speed[is_strange])
        part = max(parts, key=lambda name: parts[name][0])
        how = _describe_offset(part, parts[part][1])
    gait = [word for word in LOCOMOTION if (find_label(word).gait or 0.0) <= speed.mean()][-1]
    return LeftOut(clip=path, start=start, end=end, part=part, how=how, gait=gait, speed=float(speed.mean()))


def _describe_offset(part: str, offset: np.ndarray) -> str:
    """Describe what a part does from its offset (k,) in the columns of `posture.PARTS`; "" where it has no name."""
    if part == "hips":
        return "low" if offset[0] < 0.0 else "high"
    if part == "feet":
        return "apart" if offset[0] > 0.0 else "crossed"
    if part == "hands":
        return "fast" if offset[0] > 0.0 else "still"
    if part == "trunk":
        sideways, forward = abs(offset[1]), offset[0]
        return "sideways" if sideways > abs(forward) else "forward" if forward > 0.0 else "back"
    upper, fore = offset.reshape(-1, 2, 3)[:, 0], offset.reshape(-1, 2, 3)[:, 1]
    if upper[:, 2].max() > _FAR:
        return "elbows up"
    if fore[:, 2].max() > _FAR:
        return "hands up"
    return "hands down" if fore[:, 2].min() < -_FAR else ""


def measure_speed_classes(library: Library) -> tuple[SpeedClass, ...]:
    """Measure how much locomotion there is in each class of speed, and how much of it does not belong."""
    selected = select_locomotion_alone(library.frames, library.clips)
    kind, edges = np.digitize(library.frames.speed, SPEED_EDGES), (0.0, *SPEED_EDGES, float("inf"))
    out = []
    for number, (low, high) in enumerate(zip(edges[:-1], edges[1:])):
        inside = selected & (kind == number)
        strange = inside & (library.strangeness > 1.0)
        out.append(SpeedClass(low=low, high=high, seconds=float(inside.sum() / library.fps),
                              left_out=float(strange.sum() / library.fps)))
    return tuple(out)


def describe_left_out(library: Library, most: int = MAX_LISTED) -> list[str]:
    """Describe what is left out: a line with the totals, then the longest stretches, at most `most`; empty where all
    belongs.
    """
    classes = measure_speed_classes(library)
    total = sum(one.left_out for one in classes)
    if total < _SHORTEST:
        return []
    shares = [f"{one.left_out:.0f} of {one.seconds:.0f} s {_format_range(one)}" for one in classes
              if one.left_out >= 0.5]
    stretches = sorted(find_left_out(library), key=lambda one: one.start - one.end)
    more = [f"and {len(stretches) - most} shorter stretches"] if len(stretches) > most else []
    by_speed = ", ".join(shares)
    heading = f"{total:.0f} s left out of locomotion{': ' + by_speed if by_speed else ''}"
    return [heading, *(one.describe() for one in stretches[:most]), *more]


def _format_range(one: SpeedClass) -> str:
    if one.low == 0.0:
        return f"below {one.high:g} m/s"
    return f"at {one.low:g} to {one.high:g} m/s" if np.isfinite(one.high) else f"above {one.low:g} m/s"
