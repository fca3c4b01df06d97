"""What a library's clips are, one by one, for somebody who looks for one: words, length, speed, and how good it is.

The figures are those that building worked out: what the repair found and left (`repair.Mended`), and how much the
recording jerks beside the library's others of the same speed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..annotation import ClipAnnotation, spoken
from ..base.errors import InputError
from . import cache
from .clip import Clip
from .library import Library
from .scan import Annotations, Conversions, is_foreign, own_recordings

GOOD, FAIR, POOR, UNKNOWN = range(4)
# m/s by which standing heels and toes slide, fair and poor from sqrt(a^2 + (b v)^2) on at the speed v: feet roll
_SLIDES, _SLIDES_SHARE = (0.09, 0.18), 0.045
_DRIFT = (0.10, 0.30)  # metres by which the floor rose or sank
_JERKY = (2.0, 4.0)  # times the library's median at the same speed, in the clip's median
_LEAST_JERK = 40.0  # m/s^3: a body that stands still has next to none, and is no measure
_HEAD = 1 << 16  # bytes of a file's head in which its number of frames stands


@dataclass(frozen=True, kw_only=True)
class Listed:
    """One clip. path: below the library's folder. words: all that it carries, key moments' first. moments: number of
    key moments. seconds: its length. speed, fastest: m/s, mean and highest, NaN where nobody has measured. mark: GOOD,
    FAIR, POOR or UNKNOWN; told: lines 'name: value' behind the mark."""

    path: str
    words: tuple[str, ...]
    moments: int
    seconds: float
    speed: float = float("nan")
    fastest: float = float("nan")
    mark: int = UNKNOWN
    told: tuple[str, ...] = ()


def listed(library: Library) -> tuple[Listed, ...]:
    """All recordings of a built library, in its order; mirrored twins and made clips are left out."""
    frames = library.frames
    usual = _usual_jerk(frames.jerk, frames.speed)
    ratio, speed = frames.jerk / usual[_speed_class(frames.speed)], frames.speed
    out = []
    for number, clip in enumerate(library.clips):
        if clip.mirrored or clip.made:
            continue
        part = slice(frames.first[number], frames.first[number] + frames.count[number])
        mean, fastest = float(speed[part].mean()), float(speed[part].max())
        mark, told = _quality(clip, mean, float(np.median(ratio[part])))
        seconds = clip.recording.duration
        words, keys = words_of(clip.annotations)
        out.append(Listed(path=clip.path, words=words, moments=keys, seconds=seconds, speed=mean, fastest=fastest,
                          mark=mark, told=told))
    return tuple(out)


def scanned(folder: str | Path, cache_dir: str | Path | None = None) -> tuple[Listed, ...]:
    """All recordings below a folder, without reading their motion: for a library that is not built, or cannot be for
    lack of words. InputError for a missing folder or a broken table; a broken text beside a clip counts as no words."""
    folder = Path(folder)
    paths = own_recordings(folder)
    conversions = Conversions(folder, cache.place(folder, cache_dir)[0])
    annotations = Annotations(folder, paths)
    out = []
    for path in paths:
        frames, fps = _length(conversions.readable(path))
        try:
            rows = annotations.of(path, fps or 30.0)
        except InputError:
            rows = ()
        waits = is_foreign(path) and not conversions.stands(path)
        told = ("waits for: conversion (Build Library)",) if waits else ()
        seconds = max(frames - 1, 0) / fps if fps else 0.0
        words, keys = words_of(rows)
        out.append(Listed(path=path.relative_to(folder).as_posix(), words=words, moments=keys, seconds=seconds,
                          told=told))
    return tuple(out)


def words_of(rows: Sequence[ClipAnnotation]) -> tuple[tuple[str, ...], int]:
    """Key moments' words first, as one says them, then those of the longest rows; and the number of key moments."""
    ordered = sorted(rows, key=lambda row: (row.key is None, row.start - row.end))
    words = dict.fromkeys(word for row in ordered for word in spoken(row.words))
    return tuple(words), sum(row.key is not None for row in rows)


def _quality(clip: Clip, speed: float, jerk: float) -> tuple[int, tuple[str, ...]]:
    """The worst of a clip's marks, and lines about what was found. speed: m/s; jerk: times the usual."""
    marks, told = [_grade(jerk, _JERKY)], []
    if clip.mended is not None:
        mended = clip.mended
        rolls = _SLIDES_SHARE * speed
        marks += [_grade(mended.slides, tuple(np.hypot(_SLIDES, (rolls, 2.0 * rolls)))), _grade(mended.drift, _DRIFT)]
        slid = f" (file: {100 * mended.slid:.0f})" if mended.slid > mended.slides + 0.01 else ""
        told.append(f"feet slide: {100 * mended.slides:.0f} cm/s{slid}")
        if mended.drift > 0.0:
            told.append(f"floor levelled: {100 * mended.drift:.0f} cm")
        if mended.pops:
            told.append(f"jumps taken out: {mended.pops}")
    told.append(f"jerk: {jerk:.1f} x usual")
    if clip.recorded is not None:
        told.append("ends in flight: landing made")
    if not clip.annotations:
        told.append("no words: not used")
    return max(marks), tuple(told)


def _grade(value: float, limits: tuple[float, float]) -> int:
    return GOOD if value < limits[0] else FAIR if value < limits[1] else POOR


def _speed_class(speed: np.ndarray) -> np.ndarray:
    """Whole m/s, 8 and above in one."""
    return np.minimum(speed.astype(int), 8)


def _usual_jerk(jerk: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """(9,) m/s^3: the median of each speed class, of all where a class has few frames."""
    kind, overall = _speed_class(speed), float(np.median(jerk))
    usual = [np.median(jerk[kind == k]) if np.sum(kind == k) > 90 else overall for k in range(9)]
    return np.maximum(usual, _LEAST_JERK)


def _length(path: Path) -> tuple[int, float]:
    """Number of frames and frames per second that a BVH file's head names; zeros where it does not."""
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD).decode("ascii", "replace")
    except OSError:
        return 0, 0.0
    frames, step = re.search(r"Frames:\s*(\d+)", head), re.search(r"Frame Time:\s*([\d.eE+-]+)", head)
    try:
        return int(frames[1]), 1.0 / float(step[1])
    except (TypeError, ValueError, ZeroDivisionError):
        return 0, 0.0
