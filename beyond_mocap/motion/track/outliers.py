"""Outliers in a feed's samples: spikes, excursions, and the samples that a feed continues at constant velocity.

A feed that does not see the player continues at constant velocity (it coasts) and then snaps back from one sample to
the next; single samples jump away and return.
"""

from __future__ import annotations

import numpy as np

from .sampling import GAP_INTERVALS

MAX_ACCELERATION = 12.0
"""m/s^2: the hardest acceleration of a player."""
_SPIKE = 0.2  # metres off its neighbours' line from which a sample is a spike, beyond what acceleration explains
_EXCURSION = 0.5  # seconds within which a jump away has to return to count as an excursion
_COAST = (0.2, 0.9)  # seconds before a snap that are replaced: at least, and at most while the feed coasts
_CATCH_UP = 3.0  # m/s by which the player may be faster while making up for a snap; large snaps need more time
_COAST_EXACT = 0.012  # metres: a coasting feed keeps to its line up to rounding to centimetres
# noise of s metres along both axes puts a sample 1.22 s off its neighbours' line, and a step 1.5 s off the usual one,
# along each axis; five times that is passed once in 300 000 samples
_SPIKE_NOISE, _JUMP_NOISE = 6.1, 7.5
_BLOCK = 16384  # windows of which medians are found at a time: 90 minutes at 100 Hz would take a gigabyte
_STRAY = 2  # samples before a jump at the track's start, or after one at its end, that are taken for strays
SNAP_LIMIT = 3.0
"""Metres: a longer step is another player, or real; it is reported, not repaired."""
_ENDS = ((0, 2, 3), (-1, -3, -4))  # the first and last sample, each with two of the line that it is measured against


def detect_outliers(times: np.ndarray, positions: np.ndarray,
                    noise: float) -> tuple[np.ndarray, tuple[float, ...]]:
    """Detect the samples to replace, and the steps that are too large to repair.

    Args:
        times: (N,) s.
        positions: (N, 2) metres, all of them numbers.
        noise: metres by which they jitter.
    Returns:
        (N,) bool, the samples to replace; seconds of the steps that are left as they are.
    """
    wrong = _detect_spikes(times, positions, noise)
    left = np.flatnonzero(~wrong)
    times, positions = times[left], positions[left]
    jumps, excess = _detect_jumps(times, positions, noise)
    too_far, used = [], set()
    for place, jump in enumerate(jumps):
        if jump in used:
            continue
        # a jump with a return is an excursion, one near an end a stray, a very long one is only reported, any other is
        # a snap after coasting
        back = _find_return_jump(times, jumps, excess, place)
        if back is not None:
            used.add(back)
            wrong[left[jump + 1 : back + 1]] = True
        elif min(jump + 1, len(left) - 1 - jump) <= _STRAY:
            wrong[left[: jump + 1] if jump < _STRAY else left[jump + 1 :]] = True
        elif np.linalg.norm(excess[place]) > SNAP_LIMIT:
            too_far.append(float(times[jump + 1]))
        else:
            wrong[left[_find_coasted_samples(times, positions, jump, float(np.linalg.norm(excess[place])))]] = True
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
    off = measure_line_distance(times[1:-1], positions[1:-1], times[:-2], place_a=positions[:-2], time_b=times[2:],
                                place_b=positions[2:])
    first, last = (
        measure_line_distance(
            times[i], positions[i], times[j], place_a=positions[j], time_b=times[k], place_b=positions[k],
        ) for i, j, k in _ENDS
    )
    neighbour_distances = np.concatenate([[first], off, [last]])
    far = off > _SPIKE + _SPIKE_NOISE * noise + MAX_ACCELERATION / 8.0 * (times[2:] - times[:-2]) ** 2
    wrong[1:-1] = far & (off > 1.5 * np.maximum(neighbour_distances[:-2], neighbour_distances[2:]))
    return wrong


def measure_line_distance(time, place, time_a, place_a, time_b, place_b) -> np.ndarray:
    """Measure how far samples are from the straight, steady path between two others.

    Args:
        time: (...,) s of the samples.
        place: (..., 2) metres.
        time_a, time_b: (...,) s where the path begins and ends.
        place_a, place_b: (..., 2) metres, likewise.
    Returns:
        (...,) metres.
    """
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
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0)
    usual = np.concatenate([np.median(windows[first : first + _BLOCK], axis=2)
                            for first in range(0, len(windows), _BLOCK)])
    excess = (velocity - usual) * steps[:, None]
    short = steps <= GAP_INTERVALS * np.median(steps) + 1e-9
    allowed = _SPIKE + _JUMP_NOISE * noise + MAX_ACCELERATION / 3.0 * steps
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
    since = int(np.searchsorted(times, times[jump] - _COAST[1] - 1e-6))  # no earlier sample can be one of them
    times, positions, jump = times[since:], positions[since:], jump - since
    before = times[jump] - times[: jump + 1]
    first = int(np.searchsorted(-before, -max(_COAST[0], min(size / _CATCH_UP, _COAST[1]))))
    for start in range(min(first, jump - 3), -1, -1):
        if before[start] > _COAST[1] or not _is_on_line(times[start : jump + 1], positions[start : jump + 1]):
            break
        first = start
    return since + np.arange(max(first + 1, 1), jump + 1)


def _is_on_line(times: np.ndarray, positions: np.ndarray) -> bool:
    """Whether the samples have one velocity up to the feed's rounding."""
    basis = np.column_stack([np.ones(len(times)), times - times[0]])
    line = basis @ np.linalg.lstsq(basis, positions, rcond=None)[0]
    return bool(np.abs(positions - line).max() <= _COAST_EXACT)
