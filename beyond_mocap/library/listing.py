"""A library's clips, one by one, for browsing: labels, length, speed and quality.

The figures come from building the library: what the repair found and left (`repair.RepairFigures`), and how much the
recording jerks compared with the library's others of the same speed.
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
# m/s by which heels and toes in contact slide: fair and poor from sqrt(a^2 + (b v)^2) on at the speed v, as feet roll
_SLIDES, _SLIDES_SHARE = (0.09, 0.18), 0.045
_DRIFT = (0.10, 0.30)  # metres by which the floor rose or sank
_JERKY = (2.0, 4.0)  # times the library's median at the same speed, in the clip's median
_LEAST_JERK = 40.0  # m/s^3: a body at rest has almost none and is no reference
_HEAD = 1 << 16  # bytes at the start of a file that contain its number of frames


@dataclass(frozen=True, kw_only=True)
class Listed:
    """One clip of a list.

    Attributes:
        path: below the library's folder.
        labels: all labels that it carries, key moments' first.
        key_moments: number of key moments.
        seconds: its length.
        speed, max_speed: m/s, mean and highest, NaN where not measured.
        grade: GOOD, FAIR, POOR or UNKNOWN.
        details: lines 'name: value' that explain the grade.
    """

    path: str
    words: tuple[str, ...]
    moments: int
    seconds: float
    speed: float = float("nan")
    fastest: float = float("nan")
    mark: int = UNKNOWN
    told: tuple[str, ...] = ()


def listed(library: Library) -> tuple[Listed, ...]:
    """List all recordings of a built library, in its order; mirrored twins and synthetic clips are left out."""
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
    """List all recordings below a folder without reading their motion.

    For a library that is not built, or that cannot be built because no clip has labels.

    Args:
        folder: the library's folder.
        cache_dir: its cache folder; None for the default.
    Returns:
        One entry a recording; a broken label file beside a clip counts as no labels.
    Raises:
        InputError: for a missing folder or a broken table.
    """
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
        told = ("not converted yet: press Build Library",) if waits else ()
        seconds = max(frames - 1, 0) / fps if fps else 0.0
        words, keys = words_of(rows)
        out.append(Listed(path=path.relative_to(folder).as_posix(), words=words, moments=keys, seconds=seconds,
                          told=told))
    return tuple(out)


def words_of(rows: Sequence[ClipAnnotation]) -> tuple[tuple[str, ...], int]:
    """Collect the labels of rows, key moments' first, as they are spoken, then those of the longest rows; and count the
    key
    moments.
    """
    ordered = sorted(rows, key=lambda row: (row.key is None, row.start - row.end))
    words = dict.fromkeys(word for row in ordered for word in spoken(row.words))
    return tuple(words), sum(row.key is not None for row in rows)


def _quality(clip: Clip, speed: float, jerk: float) -> tuple[int, tuple[str, ...]]:
    """Grade a clip: the worst of its grades, and lines about the findings. speed: m/s; jerk: times the usual."""
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
            told.append(f"jumps removed: {mended.pops}")
    told.append(f"jerk: {jerk:.1f} x usual")
    if clip.recorded is not None:
        told.append("ends in flight: synthetic landing added")
    if not clip.annotations:
        told.append("no labels: not used")
    return max(marks), tuple(told)


def _grade(value: float, limits: tuple[float, float]) -> int:
    return GOOD if value < limits[0] else FAIR if value < limits[1] else POOR


def _speed_class(speed: np.ndarray) -> np.ndarray:
    """Classify speeds by whole m/s, 8 and above in one class."""
    return np.minimum(speed.astype(int), 8)


def _usual_jerk(jerk: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Compute the usual jerk (9,) m/s^3: the median of each speed class, of all frames where a class has few."""
    kind, overall = _speed_class(speed), float(np.median(jerk))
    usual = [np.median(jerk[kind == k]) if np.sum(kind == k) > 90 else overall for k in range(9)]
    return np.maximum(usual, _LEAST_JERK)


def _length(path: Path) -> tuple[int, float]:
    """Read the number of frames and frames per second from a BVH file's header; zeros where it has none."""
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
