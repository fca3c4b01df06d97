"""The three kinds of work of a match, as functions for any process.

Each takes everything it needs except the library, which a worker reads by itself, once, and which is the same
everywhere. The last kind writes a player's files: with the figures of every report over all stretches, and second by
second.
"""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...evaluation.report import evaluate, rounded
from ...files.bvh import bvh
from ...library.build import build
from ...library.library import Library
from ...motion.track import Track
from ...motion.track.ball_path import BallPath
from ...synthesis.provenance import Provenance, provenance_of, write_provenance
from ...synthesis.quality import movement
from ...synthesis.quality.played import Played, played_from_take
from ...synthesis.take import Take
from ..crowd.crowd_window import CrowdPart, crowd_window
from ..player_edit import PlayerEdit
from ..shown import shown
from .units import Unit
from .windows import Piece, searched

_MOST, _LEAST, _SUMMED = {"max", "support_max"}, {"min"}, {"frames", "duration_s"}


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
_held: dict[LibrarySource, Library] = {}


def library_of(source: LibrarySource) -> Library:
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
        if source not in _held:
            built = build(source.folder, cache_dir=source.cache, skeleton=source.skeleton, unit=source.unit,
                          seed=source.seed)
            if source.key and built.kept[1] != source.key:
                raise InputError(source.folder, "a different library from the one of this match",
                                 "the same clips and the same numpy for all workers", "start the command again")
            hold(source, built)
        return _held[source]


def hold(source: LibrarySource, library: Library) -> None:
    """Set the library that work in this process uses."""
    with _lock:
        _held.clear()
        _held[source] = library


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
class Finish:
    """What is needed to finish a player.

    Attributes:
        edit: the edit list, with its correction.
        measured: tracks, one per stretch.
        ball: the match's ball.
        frames: (K,) frames of the match's clock at which the player overlaps another one.
        depth: (K,) m of that overlap.
        figures: write report and provenance.
        bvh: write BVH.
    """

    edit: PlayerEdit
    measured: tuple[Track, ...]
    ball: BallPath
    frames: np.ndarray
    depth: np.ndarray
    figures: bool
    bvh: bool


def search_unit(source: LibrarySource, unit: Unit) -> Piece:
    """Search one window of one player (`windows.search_window`)."""
    return searched(library_of(source), unit)


def part_crowd(source: LibrarySource, edits: Sequence[PlayerEdit], start: float, end: float) -> tuple[CrowdPart, ...]:
    """Resolve the collisions of all players in one window (`crowd.window.resolve_window`)."""
    return crowd_window(library_of(source), edits, start, end)


def finish_player(source: LibrarySource, order: Finish) -> PlayerFiles:
    """Construct a player's whole motion, its figures and its files.

    Args:
        source: where the library is.
        request: what is needed.
    Returns:
        The files.
    """
    from threadpoolctl import threadpool_limits

    library = library_of(source)
    with threadpool_limits(limits=1):
        plans = [stretch.plan for stretch in order.edit.stretches]
        span = float(plans[0].track.times[0]), float(plans[-1].track.times[-1])
        takes = shown(library, order.edit, order.ball, *span)
        files, report = {}, None
        if order.figures:
            overlap = [_overlap(take, order) for take in takes]
            report = player_report(library, takes, order.measured, overlap, order.ball)
            table = _join_provenance([provenance_of(take) for take in takes])
            files["provenance.csv"] = _written(lambda path: write_provenance(path, table))
        if order.bvh:
            for number, take in enumerate(takes, 1):
                ending = "bvh" if number == 1 else f"{number}.bvh"
                files[ending] = _written(lambda path, take=take: bvh.write(path, take.motion))
    return PlayerFiles(report, files)


def player_report(
    library: Library, takes: Sequence[Take], tracks: Sequence[Track], overlap: Sequence[np.ndarray], ball: BallPath
) -> dict:
    """Build a player's report over all stretches, in the form of the contract's Report JSON with `time_lost_s` and
    `per_second` added.

    Args:
        library: the clips.
        takes: one per stretch.
        tracks: measured, one per stretch.
        overlap: (T,) m of overlap with other bodies, one per stretch.
        ball: the match's ball, as written.
    Returns:
        The report.
    Raises:
        InputError: if a take has another skeleton than the library.
    """
    reports = [evaluate(take, track, library) for take, track in zip(takes, tracks)]
    out = combined(reports, [len(take.motion) for take in takes])
    out["time_lost_s"] = time_lost(out["warning_seconds"])
    out["per_second"] = per_second([played_from_take(take) for take in takes], tracks, overlap, ball)
    return rounded(out)


def combined(reports: Sequence[dict], weights: Sequence[float]) -> dict:
    """Merge the reports of several stretches.

    Means, shares and percentiles are weighted averages; maxima and minima stay so; numbers of frames and seconds are
    summed; lists are joined. A value that only some reports have is taken from these.

    Args:
        reports: one per stretch.
        weights: of each stretch.
    Returns:
        One report.
    """
    if len(reports) == 1:
        return dict(reports[0])
    return {name: _joined(name, [one.get(name) for one in reports], weights) for name in reports[0]}


def time_lost(warning_seconds: Sequence[Sequence[Sequence[float]]]) -> float:
    """Measure the seconds in which a request was not met: the spans of the warnings, each second once."""
    spans = sorted((first, last) for line in warning_seconds for first, last in line)
    lost, until = 0.0, -np.inf
    for first, last in spans:
        lost += max(0.0, last - max(first, until))
        until = max(until, last)
    return lost


def per_second(
    played: Sequence[Played], tracks: Sequence[Track], overlap: Sequence[np.ndarray], ball: BallPath
) -> dict:
    """Measure figures for whole seconds of the match's clock.

    Args:
        played: one per stretch.
        tracks: one per stretch.
        overlap: (T,) m, one per stretch.
        ball: the match's ball.
    Returns:
        `start_s`, and lists with None where the player is absent: `root_error_m` (mean), `skate_cm_s` (mean over feet
        in contact), `overlap_m` (deepest), `ball_m` (least horizontal distance of the hips from the ball).
    """
    start = int(np.floor(min(one.start_time for one in played) + 1e-6))
    end = int(np.floor(max(one.times[-1] for one in played) + 1e-6)) + 1
    names = ("root_error_m", "skate_cm_s", "overlap_m", "ball_m")
    rows: dict[str, list] = {name: [None] * (end - start) for name in names}
    for one, track, deep in zip(played, tracks, overlap):
        second = np.floor(one.times + 1e-6).astype(int) - start
        for name, values, over in _curves(one, track, deep, ball):
            for number in np.unique(second):
                found = values[second == number]
                found = found[np.isfinite(found)]
                rows[name][number] = float(over(found)) if len(found) else None
    return {"start_s": start, **rows}


def _overlap(take: Take, order: Finish) -> np.ndarray:
    """Build (T,) m by which a take's body overlaps others."""
    out = np.zeros(len(take.motion))
    at = order.frames - round(take.start_time * take.motion.fps)
    inside = (at >= 0) & (at < len(out))
    out[at[inside]] = order.depth[inside]
    return out


def _join_provenance(tables: Sequence[Provenance]) -> Provenance:
    """Join the provenance of several stretches."""
    arrays = {name: np.concatenate([getattr(one, name) for one in tables])
              for name in ("times", "clip_frame", "mirrored", "contacts")}  # fmt: skip
    return Provenance(clip=tuple(clip for one in tables for clip in one.clip),
                      words=tuple(words for one in tables for words in one.words), **arrays)


def _written(write) -> bytes:
    """Return what `write(path)` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "content"
        write(path)
        return path.read_bytes()


def _joined(name: str, values: list, weights: Sequence[float]):
    """Merge one value of several reports by its type and name; dicts are merged key by key."""
    known = [(value, weight) for value, weight in zip(values, weights) if value is not None]
    if not known:
        return None
    first = known[0][0]
    if isinstance(first, dict):
        kept = [weight for _, weight in known]
        return {key: _joined(key, [value.get(key) for value, _ in known], kept) for key in first}
    if isinstance(first, list):
        return [entry for value, _ in known for entry in value]
    if isinstance(first, (bool, str)) or name in ("version", "seed", "fps"):
        return first
    numbers = np.array([value for value, _ in known], dtype=float)
    if name in _MOST or name in _LEAST or name in _SUMMED:
        done = numbers.max() if name in _MOST else numbers.min() if name in _LEAST else numbers.sum()
    else:
        done = np.average(numbers, weights=[weight for _, weight in known])
    return int(done) if isinstance(first, int) and name in _SUMMED else float(done)


def _curves(played: Played, track: Track, overlap: np.ndarray, ball: BallPath):
    """Compute (name, values (T,) or (T, 2), how a second is summarised)."""
    wanted = movement.track_at(track, played.times)
    skate = np.full((len(played.motion), 2), np.nan)
    skate[1:] = 100.0 * movement.contact_speeds(played.feet, played.contacts, played.motion.fps)
    place = [np.interp(played.times, ball.times, ball.positions[:, axis], np.nan, np.nan) for axis in (0, 1)]
    away = np.linalg.norm(played.pelvis - np.stack(place, axis=1), axis=1)
    return (
        ("root_error_m", movement.root_error(played.pelvis, wanted, played.motion.fps), np.mean),
        ("skate_cm_s", skate, np.mean),
        ("overlap_m", np.asarray(overlap, dtype=float), np.max),
        ("ball_m", away, np.min),
    )
