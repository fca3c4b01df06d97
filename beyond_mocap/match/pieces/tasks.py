"""The four kinds of work of a match, as functions for any process.

Each takes everything it needs except the library, which a worker reads by itself, once, and which is the same
everywhere. The last kind writes a player's files: with the figures of every report over all stretches, and second by
second.
"""

from __future__ import annotations

import re
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...evaluation.report import evaluate, find_count_name, flatten_report, round_values
from ...files.bvh import bvh
from ...library.build import build_library
from ...library.library import Library
from ...motion.track import Track
from ...motion.track.ball_path import BallPath
from ...synthesis.one_thread import limit_to_one_thread
from ...synthesis.provenance import build_provenance, join_provenance, write_provenance
from ...synthesis.quality import movement
from ...synthesis.quality.playback import Playback, playback_from_take
from ...synthesis.take import Take
from ..crowd.correction import Correction
from ..crowd.window import PlayerCorrection, resolve_window
from ..displayed_motion import display_take
from .motion_parts import MotionBlock, MotionSpan
from .units import Unit
from .windows import Piece, search_window

# the recordings' touches are those of the whole library in every stretch
_MAXIMA, _MIN_NAMES = re.compile(r"(.*_)?max|recordings|source_(receptions|kicks|strike_count)"), {"min"}
_SUMS = re.compile(r".*frames|duration_s|.*count|seams|(source_)?(seconds|strides|stances)|slow_pieces|receptions|"
                   r"kicks|touches")


@dataclass(frozen=True)
class LibrarySource:
    """Where a library is, and which one it is.

    Attributes:
        folder: as for `build`.
        cache: as for `build`.
        skeleton: as for `build`.
        unit: as for `build`.
        seed: it is read with.
        key: of its content and of what it is read with (`Library.kept`); "" if not known yet.
    """

    folder: Path
    cache: Path | None = None
    skeleton: Path | None = None
    unit: float | None = None
    seed: int = 0
    key: str = ""


_lock = threading.RLock()
_loaded: dict[LibrarySource, Library] = {}


def load_library(source: LibrarySource) -> Library:
    """Load the library, from memory if this process has read it before; one is held at a time.

    Args:
        source: where it is.
    Returns:
        The library.
    Raises:
        InputError: if it is not the requested library: clips have changed, or this machine uses another numpy, so that
            results would differ.
    """
    with _lock:  # several threads of one worker may ask at the same time
        if source not in _loaded:
            built = build_library(source.folder, cache_dir=source.cache, skeleton=source.skeleton, unit=source.unit,
                                  seed=source.seed)
            if source.key and built.cache_location[1] != source.key:
                raise InputError(source.folder, "a different library from the one of this match",
                                 "the same clips and the same numpy for all workers", "start the command again")
            set_library(source, built)
        return _loaded[source]


def set_library(source: LibrarySource, library: Library) -> None:
    """Set the library that work in this process uses."""
    with _lock:
        _loaded.clear()
        _loaded[source] = library


@dataclass(frozen=True, eq=False)
class PlayerFiles:
    """A player's files.

    Attributes:
        report: the player's report, None if no figures are requested.
        files: content by ending of the file name.
    """

    report: dict | None
    files: dict[str, bytes]


@dataclass(frozen=True, eq=False, kw_only=True)
class FinishRequest:
    """What is needed to finish a player.

    Attributes:
        motion: constructed, one span per stretch.
        correction: collision avoidance.
        measured: tracks, one per stretch.
        ball: the match's ball.
        frames: (K,) frames of the match's clock at which the player overlaps another one.
        depth: (K,) m of that overlap.
        figures: write report and provenance.
        bvh: write BVH.
    """

    motion: tuple[MotionSpan, ...]
    correction: Correction
    measured: tuple[Track, ...]
    ball: BallPath
    frames: np.ndarray
    depth: np.ndarray
    figures: bool
    bvh: bool


def search_unit(source: LibrarySource, unit: Unit) -> Piece:
    """Search one window of one player (`windows.search_window`)."""
    return search_window(load_library(source), unit)


def construct_block(source: LibrarySource, block: MotionBlock) -> tuple[bytes, ...]:
    """Construct some windows of one player (`MotionBlock.construct`)."""
    return block.construct(load_library(source))


def resolve_collision_window(source: LibrarySource, players: Sequence[Sequence[MotionSpan]], start: float,
                             end: float) -> tuple[PlayerCorrection, ...]:
    """Resolve the collisions of all players in one window (`crowd.window.resolve_window`)."""
    skeleton = load_library(source).skeleton
    takes = [[span.load_take(skeleton) for span in spans] for spans in players]
    return resolve_window(takes, start, end)


def finish_player(source: LibrarySource, request: FinishRequest) -> PlayerFiles:
    """Build a player's figures and files.

    Args:
        source: where the library is.
        request: what is needed.
    Returns:
        The files.
    """
    library = load_library(source)
    files: dict[str, bytes] = {}
    stretches, tables = [], []

    def finish_stretch(number: int) -> None:  # what it holds is gone when it returns: one is in memory at a time
        take = display_take(request.motion[number].load_take(library.skeleton), request.correction, request.ball)
        if request.figures:
            overlap = _build_overlap(take, request)
            stretches.append(measure_stretch(library, take, request.measured[number], overlap, request.ball))
            tables.append(build_provenance(take))
        if request.bvh:
            ending = f"{number + 1}.bvh" if number else "bvh"
            files[ending] = _write_to_bytes(lambda path: bvh.write_bvh(path, take.motion))

    with limit_to_one_thread():
        for number in range(len(request.motion)):
            finish_stretch(number)
        if request.figures:
            table = join_provenance(tables)
            files["provenance.csv"] = _write_to_bytes(lambda path: write_provenance(path, table))
    return PlayerFiles(build_player_report(stretches) if request.figures else None, files)


@dataclass(frozen=True, eq=False)
class StretchFigures:
    """The figures of one stretch.

    Attributes:
        report: from `evaluate`.
        frames: of its take.
        per_second: from `measure_per_second`.
    """

    report: dict
    frames: int
    per_second: dict


def measure_stretch(library: Library, take: Take, track: Track, overlap: np.ndarray, ball: BallPath) -> StretchFigures:
    """Measure a stretch.

    Args:
        library: the clips.
        take: of the stretch, T frames.
        track: measured.
        overlap: (T,) m of overlap with other bodies.
        ball: the match's ball, as written.
    Returns:
        The figures.
    Raises:
        InputError: if the take has another skeleton than the library.
    """
    played = playback_from_take(take)
    return StretchFigures(evaluate(take, track, library, played), len(take.motion),
                          measure_per_second(played, track, overlap, ball))


def build_player_report(stretches: Sequence[StretchFigures]) -> dict:
    """Build a player's report over all stretches, in the form of the contract's Report JSON with `time_lost_s` and
    `per_second` added.

    Args:
        stretches: in order of time.
    Returns:
        The report.
    """
    out = merge_reports([one.report for one in stretches], [one.frames for one in stretches])
    out["time_lost_s"] = measure_time_lost(out["warning_seconds"])
    out["per_second"] = join_seconds([one.per_second for one in stretches])
    return round_values(out)


def merge_reports(reports: Sequence[dict], weights: Sequence[float]) -> dict:
    """Merge the reports of several stretches.

    Means, shares and percentiles are averages, weighted by what they rest on where a report says so, else by the
    stretches; maxima and minima stay so; numbers of frames and seconds are summed; lists are joined. A value that only
    some reports have is taken from these.

    Args:
        reports: one per stretch.
        weights: of each stretch.
    Returns:
        One report.
    """
    if len(reports) == 1:
        return dict(reports[0])
    out = {name: _merge_values(name, [one.get(name) for one in reports], weights) for name in reports[0]}
    flat = flatten_report(out)
    return {**out, **({"unknown": {name: reason for name, reason in out["unknown"].items() if flat.get(name) is None}}
                      if out.get("unknown") else {})}


def measure_time_lost(warning_seconds: Sequence[Sequence[Sequence[float]]]) -> float:
    """Measure the seconds in which a request was not met: the spans of the warnings, each second once."""
    spans = sorted((first, last) for line in warning_seconds for first, last in line)
    lost, until = 0.0, -np.inf
    for first, last in spans:
        lost += max(0.0, last - max(first, until))
        until = max(until, last)
    return lost


def measure_per_second(played: Playback, track: Track, overlap: np.ndarray, ball: BallPath) -> dict:
    """Measure figures for whole seconds of the match's clock.

    Args:
        played: a stretch, T frames.
        track: measured.
        overlap: (T,) m.
        ball: the match's ball.
    Returns:
        `start_s`, and lists with None where nothing is known: `root_error_m` (mean), `skate_cm_s` (mean over feet in
        contact), `overlap_m` (deepest), `ball_m` (least horizontal distance of the hips from the ball).
    """
    second = np.floor(played.times + 1e-6).astype(int)
    edges = np.searchsorted(second, np.arange(second[0], second[-1] + 2))
    rows: dict[str, list] = {}
    for name, values, over in _compute_curves(played, track, overlap, ball):
        known = (values[low:high][np.isfinite(values[low:high])] for low, high in zip(edges, edges[1:]))
        rows[name] = [float(over(found)) if len(found) else None for found in known]
    return {"start_s": int(second[0]), **rows}


def join_seconds(stretches: Sequence[dict]) -> dict:
    """Join what `measure_per_second` found for several stretches in order of time; None where the player is absent."""
    start = stretches[0]["start_s"]
    out: dict[str, list] = {name: [] for name in stretches[0] if name != "start_s"}
    for one in stretches:
        for name, values in out.items():
            first = one["start_s"] - start
            out[name] = [*values, *[None] * (first - len(values))][:first] + one[name]
    return {"start_s": start, **out}


def _build_overlap(take: Take, request: FinishRequest) -> np.ndarray:
    """Build (T,) m by which a take's body overlaps others."""
    out = np.zeros(len(take.motion))
    at = request.frames - round(take.start_time * take.motion.fps)
    inside = (at >= 0) & (at < len(out))
    out[at[inside]] = request.depth[inside]
    return out


def _write_to_bytes(write) -> bytes:
    """Return what `write(path)` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "content"
        write(path)
        return path.read_bytes()


def _merge_values(name: str, values: list, weights: Sequence[float]):
    """Merge one value of several reports by its type and name; dicts are merged key by key."""
    known = [(value, weight) for value, weight in zip(values, weights) if value is not None]
    if not known:
        return None
    first = known[0][0]
    if isinstance(first, dict):
        return {key: _merge_values(key, [value.get(key) for value, _ in known], _list_weights(key, known))
                for key in first}
    if isinstance(first, list):
        return [entry for value, _ in known for entry in value]
    if isinstance(first, (bool, str)) or name in ("version", "seed", "fps"):
        return first
    numbers = np.array([value for value, _ in known], dtype=float)
    is_max, is_sum = _MAXIMA.fullmatch(name) is not None, _SUMS.fullmatch(name) is not None
    if is_max or name in _MIN_NAMES or is_sum:
        merged = numbers.max() if is_max else numbers.min() if name in _MIN_NAMES else numbers.sum()
    else:
        shares = np.array([weight for _, weight in known], dtype=float)
        merged = np.average(numbers, weights=shares if shares.any() else None)
    return int(merged) if isinstance(first, int) and (is_sum or is_max) else float(merged)


def _list_weights(name: str, groups: Sequence[tuple[dict, float]]) -> list[float]:
    """List the weight of a figure in each of several (group, weight of its stretch): what it rests on, if known."""
    counts = [group.get(find_count_name(name, group)) for group, _ in groups]
    return [weight if count is None else float(count) for count, (_, weight) in zip(counts, groups)]


def _compute_curves(played: Playback, track: Track, overlap: np.ndarray, ball: BallPath):
    """Compute (name, values (T,) or (T, 2), how a second is summarised)."""
    targets = movement.interpolate_track(track, played.times)
    skate = np.full((len(played.motion), 2), np.nan)
    skate[1:] = 100.0 * movement.measure_contact_speeds(played.feet, played.contacts, played.motion.fps)
    place = [np.interp(played.times, ball.times, ball.positions[:, axis], np.nan, np.nan) for axis in (0, 1)]
    ball_distance = np.linalg.norm(played.pelvis - np.stack(place, axis=1), axis=1)
    return (
        ("root_error_m", movement.measure_root_error(played.pelvis, targets, played.motion.fps), np.mean),
        ("skate_cm_s", skate, np.mean),
        ("overlap_m", np.asarray(overlap, dtype=float), np.max),
        ("ball_m", ball_distance, np.min),
    )
