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
from .sampling import GAP_INTERVALS, LONG_GAP

_USUAL_SPEEDS = (0.2, 7.0)  # m/s; the median of a player's speed lies between them
_MAX_ACCELERATION = 12.0  # m/s^2, hardest acceleration of a player
_SPIKE = 0.2  # metres off its neighbours' line from which a sample is a spike, beyond what acceleration explains
_EXCURSION = 0.5  # seconds within which a jump away has to return to count as an excursion
_COAST = (0.2, 0.9)  # seconds before a snap that are replaced: at least, and at most while the feed coasts
_CATCH_UP = 3.0  # m/s by which the player may be faster while making up for a snap; large snaps need more time
_COAST_EXACT = 0.012  # metres: a coasting feed keeps to its line up to rounding to centimetres
_JITTER = 0.06  # metres; noise of single samples from which on a track is smoothed: optical systems have 0.01
_JITTER_LEFT, _JITTER_SECONDS = 0.04, (0.4, 1.5)  # metres of noise that smoothing should leave; seconds of its window
# noise of s metres along both axes puts a sample 1.22 s off its neighbours' line, and a step 1.5 s off the usual one,
# along each axis; five times that is passed once in 300 000 samples
_SPIKE_NOISE, _JUMP_NOISE = 6.1, 7.5
_STRAY = 2  # samples before a jump at the track's start, or after one at its end, that are taken for strays
_SNAP_LIMIT = 3.0  # metres; a longer step is another player, or real: reported, not repaired
_SLOPE_SECONDS = 0.3  # seconds whose slope is the velocity next to a gap
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
        ball_unknown: samples without the ball.
        warnings: those lines that need attention.
    """

    lines: tuple[str, ...]
    rate: float
    dropped: int
    merged: int
    filled: int
    outliers: int
    gaps: tuple[tuple[float, float], ...]
    ball_unknown: int
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
    outlier[known], snaps = _detect_outliers(times[known], positions[known], noise)
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
    off = _measure_line_distance(times[1:-1], positions[1:-1], times[:-2], place_a=positions[:-2], time_b=times[2:],
                                 place_b=positions[2:])
    bend = _MAX_ACCELERATION / 8.0 * float(np.median(times[2:] - times[:-2])) ** 2
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


def _detect_outliers(times: np.ndarray, positions: np.ndarray,
                     noise: float) -> tuple[np.ndarray, tuple[float, ...]]:
    """Detect the samples (N,) bool to replace, and the times of steps too large to repair; all positions are numbers,
    and jitter by `noise` metres.
    """
    wrong = _detect_spikes(times, positions, noise)
    left = np.flatnonzero(~wrong)
    jumps, excess = _detect_jumps(times[left], positions[left], noise)
    too_far, used = [], set()
    for place, jump in enumerate(jumps):
        if jump in used:
            continue
        # a jump with a return is an excursion, one near an end a stray, a very long one is only reported, any other is
        # a snap after coasting
        back = _find_return_jump(times[left], jumps, excess, place)
        if back is not None:
            used.add(back)
            wrong[left[jump + 1 : back + 1]] = True
        elif min(jump + 1, len(left) - 1 - jump) <= _STRAY:
            wrong[left[: jump + 1] if jump < _STRAY else left[jump + 1 :]] = True
        elif np.linalg.norm(excess[place]) > _SNAP_LIMIT:
            too_far.append(float(times[left[jump + 1]]))
        else:
            wrong[left[_find_coasted_samples(times[left], positions[left], jump,
                                             float(np.linalg.norm(excess[place])))]] = True
    return wrong, tuple(too_far)


def _detect_spikes(times: np.ndarray, positions: np.ndarray, noise: float) -> np.ndarray:
    """Detect single samples (N,) bool far off the line between their neighbours, while the neighbours' lines fit
    better.

    A spike of size d is d off its line and puts its neighbours d/2 off theirs; a step puts the two samples beside it
    off theirs equally, so neither stands out and steps are left to `_detect_jumps`. The first and last sample have one
    neighbour only: they are measured against the line of the third and fourth, or their own errors would blame the
    second.
    """
    wrong = np.zeros(len(times), dtype=bool)
    if len(times) < 5:
        return wrong
    off = _measure_line_distance(times[1:-1], positions[1:-1], times[:-2], place_a=positions[:-2], time_b=times[2:],
                                 place_b=positions[2:])
    first, last = (
        _measure_line_distance(
            times[i], positions[i], times[j], place_a=positions[j], time_b=times[k], place_b=positions[k],
        ) for i, j, k in _ENDS
    )
    neighbour_distances = np.concatenate([[first], off, [last]])
    far = off > _SPIKE + _SPIKE_NOISE * noise + _MAX_ACCELERATION / 8.0 * (times[2:] - times[:-2]) ** 2
    wrong[1:-1] = far & (off > 1.5 * np.maximum(neighbour_distances[:-2], neighbour_distances[2:]))
    return wrong


_ENDS = ((0, 2, 3), (-1, -3, -4))


def _measure_line_distance(time, place, time_a, place_a, time_b, place_b) -> np.ndarray:
    """Measure the metres (...,) from `place` (..., 2) to the straight, steady path from a to b at `time` (...,)."""
    share = np.asarray((time - time_a) / (time_b - time_a))[..., None]
    return np.linalg.norm(place - place_a * (1 - share) - place_b * share, axis=-1)


def _detect_jumps(times: np.ndarray, positions: np.ndarray, noise: float) -> tuple[list[int], np.ndarray]:
    """Detect steps that no player takes.

    Returns:
        Indices j (the step is from sample j to j+1), and each one's excess (len, 2) metres over the median velocity of
        the 0.6 s (7 samples at least) around it.
    """
    steps = np.diff(times)
    if len(steps) < 3:
        return [], np.zeros((0, 2))
    velocity = np.diff(positions, axis=0) / steps[:, None]
    half = int(max(3, round(0.3 / np.median(steps))))
    padded = np.pad(velocity, ((half, half), (0, 0)), mode="reflect" if half < len(steps) else "edge")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0), axis=2)
    excess = (velocity - usual) * steps[:, None]
    short = steps <= GAP_INTERVALS * np.median(steps) + 1e-9
    allowed = _SPIKE + _JUMP_NOISE * noise + _MAX_ACCELERATION / 3.0 * steps
    jumps = np.flatnonzero(short & (np.linalg.norm(excess, axis=1) > allowed))
    return jumps.tolist(), excess[jumps]


def _find_return_jump(times: np.ndarray, jumps: list[int], excess: np.ndarray, place: int) -> int | None:
    """Find the later jump within half a second that reverses jump number `place`; None if there is none."""
    for other in range(place + 1, len(jumps)):
        if times[jumps[other]] - times[jumps[place]] > _EXCURSION:
            break
        if np.linalg.norm(excess[place] + excess[other]) < 0.5 * np.linalg.norm(excess[place]):
            return jumps[other]
    return None


def _find_coasted_samples(times: np.ndarray, positions: np.ndarray, jump: int, size: float) -> np.ndarray:
    """Find the samples up to `jump` to replace.

    As many as making up for `size` metres takes, and further back while they lie on an exact line. The first sample of
    such a line is where the player was last seen, and is left as it is.
    """
    before = times[jump] - times[: jump + 1]
    first = int(np.searchsorted(-before, -max(_COAST[0], min(size / _CATCH_UP, _COAST[1]))))
    for start in range(min(first, jump - 3), -1, -1):
        if before[start] > _COAST[1] or not _is_on_line(times[start : jump + 1], positions[start : jump + 1]):
            break
        first = start
    return np.arange(max(first + 1, 1), jump + 1)


def _is_on_line(times: np.ndarray, positions: np.ndarray) -> bool:
    """Whether the samples have one velocity up to the feed's rounding."""
    basis = np.column_stack([np.ones(len(times)), times - times[0]])
    line = basis @ np.linalg.lstsq(basis, positions, rcond=None)[0]
    return bool(np.abs(positions - line).max() <= _COAST_EXACT)


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
        ball_unknown=int(np.count_nonzero(_find_missing_ball(track))), warnings=tuple(warnings),
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
            TimedMessage(f"steps of more than {_SNAP_LIMIT:g} m left as they are: {_describe_times(snaps)}",
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


def _describe_times(times, most: int = 5) -> str:
    """Describe the first few of some times."""
    named = ", ".join(f"{time:.2f}" for time in list(times)[:most])
    return f"{named} s" + (f" and {len(times) - most} more" if len(times) > most else "")


def _describe_stretches(times: np.ndarray, interval: float) -> str:
    """Describe times (N,) as stretches of neighbouring samples."""
    starts = np.flatnonzero(np.diff(times, prepend=-np.inf) > 1.5 * interval)
    ends = [*(starts[1:] - 1), len(times) - 1]
    named = [f"{times[a]:.2f}" if a == b else f"{times[a]:.2f}-{times[b]:.2f}" for a, b in zip(starts, ends)]
    return ", ".join(named[:5]) + " s" + (f" and {len(named) - 5} more" if len(named) > 5 else "")
