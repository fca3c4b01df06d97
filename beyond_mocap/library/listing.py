"""A library's clips, one by one, for browsing: labels, length, speed and quality.

The figures come from building the library: what the repair found and left (`clip.RepairFigures`), and how much the
recording jerks compared with the library's others of the same speed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..annotation import ClipAnnotation, sort_labels
from ..base.content import open_file
from ..base.errors import InputError
from . import cache
from .clip import Clip
from .folder.annotations import Annotations
from .folder.conversions import Conversions, is_foreign
from .folder.recordings import list_own_recordings
from .library import Library

GOOD, FAIR, POOR, UNKNOWN = range(4)
# m/s by which heels and toes in contact slide: fair and poor from sqrt(a^2 + (b v)^2) on at the speed v, as feet roll
_SLIDE_LIMITS, _SLIDE_SPEED_SHARE = (0.09, 0.18), 0.045
_DRIFT_LIMITS = (0.10, 0.30)  # metres by which the floor rose or sank
_JERK_LIMITS = (2.0, 4.0)  # times the library's median at the same speed, in the clip's median
_MIN_JERK = 40.0  # m/s^3: a body at rest has almost none and is no reference
_HEAD_BYTES = 1 << 16  # bytes at the start of a file that contain its number of frames


@dataclass(frozen=True, kw_only=True)
class ListedClip:
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
    labels: tuple[str, ...]
    key_moments: int
    seconds: float
    speed: float = float("nan")
    max_speed: float = float("nan")
    grade: int = UNKNOWN
    details: tuple[str, ...] = ()


def list_clips(library: Library) -> tuple[ListedClip, ...]:
    """List all recordings of a built library, in its order; mirrored twins and synthetic clips are left out."""
    frames = library.frames
    usual_jerk = _compute_usual_jerk(frames.jerk, frames.speed)
    ratio, speed = frames.jerk / usual_jerk[_classify_speed(frames.speed)], frames.speed
    out = []
    for number, clip in enumerate(library.clips):
        if clip.mirrored or clip.is_synthetic:
            continue
        part = slice(frames.first[number], frames.first[number] + frames.count[number])
        mean, fastest = float(speed[part].mean()), float(speed[part].max())
        mark, details = _grade_clip(clip, mean, float(np.median(ratio[part])))
        seconds = clip.recording.duration
        words, keys = collect_labels(clip.annotations)
        out.append(ListedClip(path=clip.path, labels=words, key_moments=keys, seconds=seconds, speed=mean,
                              max_speed=fastest, grade=mark, details=details))
    return tuple(out)


def scan_clips(folder: str | Path, cache_dir: str | Path | None = None) -> tuple[ListedClip, ...]:
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
    paths = list_own_recordings(folder)
    conversions = Conversions(folder, cache.find_cache_folder(folder, cache_dir)[0])
    annotations = Annotations(folder, paths)
    out = []
    for path in paths:
        frames, fps = _read_length(conversions.find_readable_file(path))
        try:
            rows = annotations.read_rows(path, fps or 30.0)
        except InputError:
            rows = ()
        needs_conversion = is_foreign(path) and not conversions.is_current(path)
        details = ("not converted yet: press Build Library",) if needs_conversion else ()
        seconds = max(frames - 1, 0) / fps if fps else 0.0
        words, keys = collect_labels(rows)
        out.append(ListedClip(path=path.relative_to(folder).as_posix(), labels=words, key_moments=keys, seconds=seconds,
                              details=details))
    return tuple(out)


def collect_labels(rows: Sequence[ClipAnnotation]) -> tuple[tuple[str, ...], int]:
    """Collect the labels of rows, key moments' first, as they are spoken, then those of the longest rows; and count the
    key moments.
    """
    ordered = sorted(rows, key=lambda row: (row.key is None, row.start - row.end))
    words = dict.fromkeys(word for row in ordered for word in sort_labels(row.words))
    return tuple(words), sum(row.key is not None for row in rows)


def _grade_clip(clip: Clip, speed: float, jerk: float) -> tuple[int, tuple[str, ...]]:
    """Grade a clip: the worst of its grades, and lines about the findings. speed: m/s; jerk: times the usual."""
    marks, details = [_grade_value(jerk, _JERK_LIMITS)], []
    if clip.repair_figures is not None:
        figures = clip.repair_figures
        rolling = _SLIDE_SPEED_SHARE * speed
        marks += [_grade_value(figures.slides, tuple(np.hypot(_SLIDE_LIMITS, (rolling, 2.0 * rolling)))),
                  _grade_value(figures.drift, _DRIFT_LIMITS)]
        slid = f" (file: {100 * figures.slid:.0f})" if figures.slid > figures.slides + 0.01 else ""
        details.append(f"foot slide: {100 * figures.slides:.0f} cm/s{slid}")
        if figures.drift > 0.0:
            details.append(f"floor levelled: {100 * figures.drift:.0f} cm")
        if figures.pops:
            details.append(f"jumps removed: {figures.pops}")
    details.append(f"jerk: {jerk:.1f} x usual")
    if any(clip.t_pose_frames):
        details.append(f"T-pose left out: {sum(clip.t_pose_frames) / clip.motion.fps:.1f} s")
    if clip.recorded_count is not None:
        details.append("ends in flight: synthetic landing added")
    if clip.has_proposed_labels:
        details.append("labels: proposed")
    if not clip.annotations:
        details.append("nothing but a T-pose: not used" if clip.is_t_pose else "no labels: not used")
    return max(marks), tuple(details)


def _grade_value(value: float, limits: tuple[float, float]) -> int:
    return GOOD if value < limits[0] else FAIR if value < limits[1] else POOR


def _classify_speed(speed: np.ndarray) -> np.ndarray:
    """Classify speeds by whole m/s, 8 and above in one class."""
    return np.minimum(speed.astype(int), 8)


def _compute_usual_jerk(jerk: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Compute the usual jerk (9,) m/s^3: the median of each speed class, of all frames where a class has few."""
    kind, overall = _classify_speed(speed), float(np.median(jerk))
    usual = [np.median(jerk[kind == k]) if np.sum(kind == k) > 90 else overall for k in range(9)]
    return np.maximum(usual, _MIN_JERK)


def _read_length(path: Path) -> tuple[int, float]:
    """Read the number of frames and frames per second from a BVH file's header; zeros where it has none."""
    if not path.is_file():  # a pipe keeps its readers waiting
        return 0, 0.0
    try:
        with open_file(path, "a BVH file") as file:
            head = file.read(_HEAD_BYTES).decode("ascii", "replace")
    except (OSError, InputError):
        return 0, 0.0
    frames, step = re.search(r"Frames:\s*(\d+)", head), re.search(r"Frame Time:\s*([\d.eE+-]+)", head)
    try:
        return int(frames[1]), 1.0 / float(step[1])
    except (TypeError, ValueError, ZeroDivisionError):
        return 0, 0.0
