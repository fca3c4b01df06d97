"""The report of one player of a match: the figures of every report over all his stretches, and second by second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...evaluation.report import evaluate, rounded
from ...library.library import Library
from ...motion.track import Track
from ...motion.track.ball_path import BallPath
from ...synthesis.quality import movement
from ...synthesis.quality.played import Played, played_from_take
from ...synthesis.take import Take

_MOST, _LEAST, _SUMMED = {"max", "support_max"}, {"min"}, {"frames", "duration_s"}


def player_report(
    library: Library, takes: Sequence[Take], tracks: Sequence[Track], overlap: Sequence[np.ndarray], ball: BallPath
) -> dict:
    """The figures of a player with one take, one measured track and the overlap (T,) m with others' bodies for each
    stretch in which he is there; in the form of the contract's Report JSON, with `time_lost_s` and `per_second` beside.

    ball: the match's, as written out. InputError where a take has another skeleton than the library.
    """
    reports = [evaluate(take, track, library) for take, track in zip(takes, tracks)]
    out = combined(reports, [len(take.motion) for take in takes])
    out["time_lost_s"] = time_lost(out["warning_seconds"])
    out["per_second"] = per_second([played_from_take(take) for take in takes], tracks, overlap, ball)
    return rounded(out)


def combined(reports: Sequence[dict], weights: Sequence[float]) -> dict:
    """One report for several stretches: means, shares and percentiles weighted by `weights`, largest and least values
    the largest and least, numbers of frames and seconds summed, lists one behind the other; what only some know is
    theirs."""
    if len(reports) == 1:
        return dict(reports[0])
    return {name: _joined(name, [one.get(name) for one in reports], weights) for name in reports[0]}


def _joined(name: str, values: list, weights: Sequence[float]):
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


def time_lost(warning_seconds: Sequence[Sequence[Sequence[float]]]) -> float:
    """Seconds in which something gave way: what the warnings are about, each second once."""
    spans = sorted((first, last) for line in warning_seconds for first, last in line)
    lost, until = 0.0, -np.inf
    for first, last in spans:
        lost += max(0.0, last - max(first, until))
        until = max(until, last)
    return lost


def per_second(
    played: Sequence[Played], tracks: Sequence[Track], overlap: Sequence[np.ndarray], ball: BallPath
) -> dict:
    """Whole seconds of the match's clock from `start_s` on, None where he is away: `root_error_m` (mean), `skate_cm_s`
    (mean over feet that stand), `overlap_m` (deepest), `ball_m` (nearest distance of his hips from the ball, on the
    ground)."""
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


def _curves(played: Played, track: Track, overlap: np.ndarray, ball: BallPath):
    """(name, values (T,) or (T, 2), what stands for a second of them)."""
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
