"""Errors in a feed's samples, corrected and reported.

How real feeds err: samples are missing, or continue at constant velocity while the player is out of sight and then snap
back by 0.4-1.4 m from one sample to the next, some 8 times per player and half; single samples jump away and return; an
absent ball is at a sentinel (z = -10, or exactly at the origin). Simple cameras and receivers let every sample jitter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, TimedMessage, format_count, format_seconds
from ...base.settings.synthesis import MAX_SPEED
from ...base.time_series import find_runs
from .data import Track, is_ball_sentinel
from .outliers import MAX_ACCELERATION, SNAP_LIMIT, detect_outliers, measure_line_distance
from .sampling import GAP_INTERVALS, LONG_GAP

_USUAL_SPEEDS = (0.2, 7.0)  # m/s; the median of a player's speed lies between them
_JITTER = 0.06  # metres; noise of single samples from which on a track is smoothed: optical systems have 0.01
_JITTER_LEFT, _JITTER_SECONDS = 0.04, (0.4, 1.5)  # metres of noise that smoothing should leave; seconds of its window
_SLOPE_SECONDS = 0.3  # seconds whose slope is the velocity next to a gap
_MOST_NAMED = 5  # times or stretches that a line names
_MAX_GAP = 3600.0  # seconds


@dataclass(frozen=True, kw_only=True)
class DataReport:
    """What `clean_track` found.

    Attributes:
        lines: text for people, one finding each, with times.
        rate: samples per second (median).
        dropped: rows without a time.
        merged: rows whose time repeated.
        filled, outliers: samples inserted and replaced.
        gaps: (start, end) seconds between measured samples.
        warnings: those lines that need attention.
    """

    lines: tuple[str, ...]
    rate: float
    dropped: int
    merged: int
    filled: int
    outliers: int
    gaps: tuple[tuple[float, float], ...]
    warnings: tuple[str, ...]


def clean_track(track: Track) -> tuple[Track, DataReport]:
    """Clean a track: in order of time, with one plausible position per sample, and a report of the changes.

    Rows without a time are dropped, repeated times merged to their mean, times sorted. Spikes, excursions and the
    coasted samples before a snap are marked `outlier`; missing samples, and those of gaps longer than three sample
    intervals, are inserted and marked `filled`. Where all samples jitter, the others are smoothed. Both kinds of marked
    samples then get a cubic between the valid neighbours that starts and ends with their velocities (beyond one second
    only as curved as the distance allows). Before the first and after the last valid sample the velocity fades (to a
    third in half a second). A track that is already clean comes back equal.

    Args:
        track: samples as the feed has them, pitch frame.
    Returns:
        The cleaned track, and the report.
    Raises:
        InputError: if fewer than two samples have a position, a gap is longer than an hour, or the positions are
            hardly a player's in metres.
    """
    times, positions, ball, notes, dropped, merged = _sort_rows(track)
    ball, notes = _remove_ball_sentinels(ball, notes)
    times, positions, ball = _insert_missing_rows(times, positions, ball, track.name)
    known = np.isfinite(positions).all(axis=1)
    if np.count_nonzero(known) < 2:
        found = f"{format_count(np.count_nonzero(known), 'sample')} with a position"
        raise InputError(track.name, found, "at least two")
    noise = _measure_jitter(times[known], positions[known])
    outlier, snaps = np.zeros(len(times), dtype=bool), ()
    outlier[known], snaps = detect_outliers(times[known], positions[known], noise)
    is_valid = known & ~outlier
    jitter = []
    if noise > 0.0:
        positions[is_valid], jitter = _smooth_jitter(times[is_valid], positions[is_valid], noise, snaps)
    _check_unit(times[known], positions[known], outlier[known], track.name)
    positions = _interpolate_gaps(times, positions, is_valid)
    cleaned = Track(times, positions, ball, ball_height_known=np.isfinite(ball[:, 2]), filled=~known, outlier=outlier,
                    name=track.name)
    return cleaned, _build_report(cleaned, notes, snaps, dropped=dropped, merged=merged, jitter=jitter)


def _check_unit(times: np.ndarray, positions: np.ndarray, outlier: np.ndarray, name: str) -> None:
    """Check that most samples are a player's in metres; InputError with the likely unit otherwise.

    Speeds are measured over a second, so that they do not consist of a fast feed's noise.
    """
    later = np.minimum(np.searchsorted(times, times + 1.0), len(times) - 1)
    first = times[later] > times
    distance = np.linalg.norm(positions[later] - positions, axis=1)
    speed = float(np.median(distance[first] / (times[later] - times)[first]))
    if speed <= MAX_SPEED and np.count_nonzero(outlier) <= 0.5 * len(outlier):
        return
    found = f"a median speed of {speed:.3g} m/s, {np.count_nonzero(outlier)} outliers in {len(outlier)} samples"
    for unit, size in (("centimetres", 100.0), ("millimetres", 1000.0)):
        if size * _USUAL_SPEEDS[0] < speed < size * _USUAL_SPEEDS[1]:
            raise InputError(name, f"positions look like {unit} ({found})", "metres", f"divide x and y by {size:g}")
    raise InputError(name, f"positions are not a player's ({found})", "metres and seconds", "check the units")


def _sort_rows(track: Track):
    """Sort rows by time, merge repeated times and drop unknown ones; with notes and counts of the changes."""
    timed = np.isfinite(track.times)
    rows = np.column_stack([track.positions, track.ball])[timed]
    rows[~np.isfinite(rows[:, :2]).all(axis=1), :2] = np.nan
    rows[:, 4] = np.where(track.ball_height_known[timed], rows[:, 4], np.nan)
    notes = [f"{format_count(np.count_nonzero(~timed), 'row')} without a time dropped"] if not timed.all() else []
    times = track.times[timed]
    if np.any(np.diff(times) < 0):
        late = times[1:][np.diff(times) < 0]
        notes.append(f"times out of order sorted: {_describe_times(late)}")
    order = np.argsort(times, kind="stable")
    times, rows = times[order], rows[order]
    starts = np.flatnonzero(np.diff(times, prepend=-np.inf) > 1e-6)
    merged = len(times) - len(starts)
    if merged:
        repeated = times[starts][np.diff(starts, append=len(times)) > 1]
        notes.append(f"{format_count(merged, 'row')} with a repeated time merged: {_describe_times(repeated)}")
        rows = _average_groups(rows, starts)
    return times[starts], rows[:, :2], rows[:, 2:], notes, int(np.count_nonzero(~timed)), merged


def _average_groups(rows: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Average the finite values in each group of rows (N, k): (G, k); NaN where a group has none."""
    finite = np.isfinite(rows)
    counts = np.add.reduceat(finite, starts, axis=0, dtype=float)
    sums = np.add.reduceat(np.where(finite, rows, 0.0), starts, axis=0)
    return np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0)


def _remove_ball_sentinels(ball: np.ndarray, notes: list[str]) -> tuple[np.ndarray, list[str]]:
    """Replace sentinels in ball rows (N, 3) with NaN: z below the ground, far outside, or parked at the origin."""
    seen, wrong = np.isfinite(ball[:, :2]).all(axis=1), is_ball_sentinel(ball)
    if wrong.any():
        count = format_count(np.count_nonzero(wrong), "sample")
        notes = [*notes, f"{count} without a ball (below the ground, far off the pitch, or parked at the origin)"]
    ball = np.where((seen & ~wrong)[:, None], ball, np.nan)
    return ball, notes


def _insert_missing_rows(times, positions, ball, name: str):
    """Insert rows of NaN, evenly, where two rows are more than three sample intervals apart."""
    steps = np.diff(times)
    interval = np.median(steps) if len(steps) else 1.0
    gaps = np.flatnonzero(steps > GAP_INTERVALS * interval + 1e-9)
    if len(gaps) and steps[gaps].max() > _MAX_GAP:
        worst = gaps[np.argmax(steps[gaps])]
        found = f"nothing between {format_seconds(times[worst])} and {format_seconds(times[worst + 1])} s"
        raise InputError(name, found, "gaps of an hour at most", "cut the track")
    new = [np.linspace(times[i], times[i + 1], int(round(steps[i] / interval)) + 1)[1:-1] for i in gaps]
    at = np.repeat(gaps + 1, [len(piece) for piece in new])
    if not len(at):
        return times, positions, ball
    blank = np.nan
    return np.insert(times, at, np.concatenate(new)), np.insert(positions, at, blank, 0), np.insert(ball, at, blank, 0)


def _measure_jitter(times: np.ndarray, positions: np.ndarray) -> float:
    """Measure the metres by which samples (N, 2) jitter along each axis; 0 where the track need not be smoothed.

    White noise of s metres along both axes puts samples 1.44 s off the line between their neighbours in the median.
    """
    if len(times) < 5:
        return 0.0
    off = measure_line_distance(times[1:-1], positions[1:-1], times[:-2], place_a=positions[:-2], time_b=times[2:],
                                place_b=positions[2:])
    bend = MAX_ACCELERATION / 8.0 * float(np.median(times[2:] - times[:-2])) ** 2
    noise = (float(np.median(off)) - bend) / 1.44
    return noise if noise > _JITTER else 0.0


def _smooth_jitter(times: np.ndarray, positions: np.ndarray, noise: float,
                   snaps: tuple[float, ...]) -> tuple[np.ndarray, list[str]]:
    """Smooth valid positions (N, 2) that jitter by `noise` metres, and describe that in a line.

    Each stretch between gaps, and between the steps at `snaps` that are left as they are, is smoothed on its own.
    """
    steps = np.diff(times)
    rate = 1.0 / float(np.median(steps))
    # a Hann window of n samples leaves sqrt(1.5 / n) of white noise
    seconds = float(np.clip(1.5 * (noise / _JITTER_LEFT) ** 2 / rate, *_JITTER_SECONDS))
    snaps_before = np.searchsorted(np.sort(snaps), times, side="right")
    is_cut = (steps > GAP_INTERVALS / rate + 1e-9) | (np.diff(snaps_before) > 0)
    stretches = np.split(np.arange(len(times)), np.flatnonzero(is_cut) + 1)
    smooth = np.concatenate([_fit_local_lines(times[part], positions[part], seconds * rate) for part in stretches])
    return smooth, [f"samples jitter by {100 * noise:.0f} cm: the track is smoothed over {seconds:.1f} s"]


def _fit_local_lines(times: np.ndarray, positions: np.ndarray, width: float) -> np.ndarray:
    """Fit a line around each sample by least squares under a Hann window of `width` samples: its values (N, 2) there.

    Unlike a window alone, it needs no samples beyond the ends, nor even times.
    """
    half = max(int(np.ceil(width / 2.0 - 1e-9)) - 1, 0)
    window = 0.5 + 0.5 * np.cos(2.0 * np.pi * np.arange(-half, half + 1) / width)
    moment = times - times.mean()
    columns = np.column_stack([np.ones_like(moment), moment, moment**2, positions, moment[:, None] * positions])
    # "same" would have the window's length where that is longer than the stretch
    sums = np.stack([np.convolve(column, window)[half : half + len(times)] for column in columns.T], axis=1)
    total, first = sums[:, :1], sums[:, 1:2]
    mean, centre = sums[:, 3:5] / total, first / total
    variance = sums[:, 2:3] / total - centre**2
    slope = (sums[:, 5:] / total - centre * mean) / np.where(variance > 1e-9, variance, np.inf)
    return mean + slope * (moment[:, None] - centre)


def _interpolate_gaps(times: np.ndarray, positions: np.ndarray, is_valid: np.ndarray) -> np.ndarray:
    """Interpolate the positions (N, 2) by a cubic wherever they are not valid."""
    out = positions.copy()
    for start, stop in find_runs(~is_valid):
        before = _estimate_end_state(times, positions, is_valid, start - 1, -1)
        after = _estimate_end_state(times, positions, is_valid, stop, +1)
        out[start:stop] = _interpolate_hermite(times[start:stop], before, after)
    return out


def _estimate_end_state(times, positions, is_valid, index: int, direction: int):
    """Estimate (time, position, velocity) of the valid sample `index`, velocity over the valid ones beside it; or None.
    """
    if not 0 <= index < len(times):
        return None
    members = [index]
    while 0 <= (other := members[-1] + direction) < len(times) and is_valid[other]:
        if abs(times[other] - times[index]) > _SLOPE_SECONDS and len(members) > 1:
            break
        members.append(other)
    moment = times[members] - np.mean(times[members])
    place = positions[members] - np.mean(positions[members], axis=0)
    velocity = moment @ place / max(moment @ moment, 1e-12)
    speed = np.linalg.norm(velocity)
    return times[index], positions[index], velocity * min(1.0, MAX_SPEED / max(speed, 1e-9))


def _interpolate_hermite(at: np.ndarray, before, after) -> np.ndarray:
    """Interpolate by a Hermite cubic from one end state to the other: (len(at), 2); beyond the ends the velocity fades.
    """
    if before is None or after is None:
        time, place, velocity = before or after
        away = at - time
        return place + velocity * np.sign(away)[:, None] * (0.5 * (1.0 - np.exp(-np.abs(away) / 0.5)))[:, None]
    (t0, p0, v0), (t1, p1, v1) = before, after
    length = t1 - t0
    if length > 1.0:
        most = 3.0 * np.linalg.norm(p1 - p0) / length
        v0, v1 = (v * min(1.0, most / max(np.linalg.norm(v), 1e-9)) for v in (v0, v1))
    s = ((at - t0) / length)[:, None]
    return (p0 * (1 + 2 * s) * (1 - s) ** 2 + p1 * s * s * (3 - 2 * s) + length * s * (1 - s) * (v0 * (1 - s) - v1 * s))


def _build_report(track: Track, notes: list[str], snaps: tuple[float, ...], *, dropped: int, merged: int,
                  jitter: list[str]) -> DataReport:
    """Build the report of a cleaned track."""
    gaps = _find_gaps(track)
    warnings = [*jitter, *_collect_warnings(track, snaps, gaps)]
    return DataReport(
        lines=(*notes, *_describe_replacements(track), *warnings), rate=1.0 / track.interval, dropped=dropped,
        merged=merged, filled=int(track.filled.sum()), outliers=int(track.outlier.sum()), gaps=gaps,
        warnings=tuple(warnings),
    )


def _find_gaps(track: Track) -> tuple[tuple[float, float], ...]:
    """Find (start, end) seconds wherever measured samples are more than three intervals apart."""
    times = track.times[track.is_measured]
    wide = np.flatnonzero(np.diff(times) > GAP_INTERVALS * track.interval + 1e-9)
    return tuple((float(times[i]), float(times[i + 1])) for i in wide)


def _find_missing_ball(track: Track) -> np.ndarray:
    return ~np.isfinite(track.ball[:, :2]).all(axis=1)


def _collect_warnings(track: Track, snaps: tuple[float, ...], gaps) -> list[TimedMessage]:
    """Collect warnings about implausible data that were left as they are."""
    speed = np.linalg.norm(np.diff(track.positions, axis=0), axis=1) / np.diff(track.times)
    fast = track.times[1:][speed > MAX_SPEED]
    out = []
    if snaps:
        out.append(
            TimedMessage(f"steps of more than {SNAP_LIMIT:g} m left as they are: {_describe_times(snaps)}",
                         *zip(snaps, snaps))
        )
    if len(fast):
        out.append(TimedMessage(f"faster than {MAX_SPEED:g} m/s in {format_count(len(fast), 'sample')}: "
                                f"{_describe_times(fast)}", *zip(fast, fast)))
    return out + [TimedMessage(f"no samples from {a:.2f} to {b:.2f} s", (a, b)) for a, b in gaps if b - a > LONG_GAP]


def _describe_replacements(track: Track) -> list[str]:
    """Describe what was inserted and replaced, and how much of the ball is missing."""
    marked = (("sample", "filled", track.filled), ("outlier", "replaced", track.outlier))
    out = [f"{format_count(m.sum(), noun)} {change}: {_describe_stretches(track.times[m], track.interval)}"
           for noun, change, m in marked if m.any()]
    unknown = _find_missing_ball(track)
    if unknown.any() and not unknown.all():
        out.append(f"ball unknown in {unknown.sum()} of {len(track)} samples")
    return out


def _describe_times(times) -> str:
    """Describe the first few of some times."""
    return _describe_first([f"{time:.2f}" for time in times])


def _describe_stretches(times: np.ndarray, interval: float) -> str:
    """Describe times (N,) as stretches of neighbouring samples."""
    starts = np.flatnonzero(np.diff(times, prepend=-np.inf) > 1.5 * interval)
    ends = [*(starts[1:] - 1), len(times) - 1]
    named = [f"{times[a]:.2f}" if a == b else f"{times[a]:.2f}-{times[b]:.2f}" for a, b in zip(starts, ends)]
    return _describe_first(named)


def _describe_first(named: list[str]) -> str:
    """Join the first of some times in seconds, and count the others."""
    more = f" and {len(named) - _MOST_NAMED} more" if len(named) > _MOST_NAMED else ""
    return f"{', '.join(named[:_MOST_NAMED])} s{more}"
