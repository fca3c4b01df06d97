"""A planned heading: whole steps of ten degrees at decisions some times a second, smoothed where it is read.

The cheapest one is found by dynamic programming. Costs are whole numbers, which add up alike whatever comes before
them. A part of it can be planned again such that it joins the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion.skeleton import freeze_array

BINS = 36
BIN_ANGLE = 2.0 * np.pi / BINS
"""Number of headings, and radians between two of them."""

COST_UNIT = 1e-6
"""Cost of one whole number."""

SMOOTHING_SECONDS = 0.7
"""Seconds of the window that smooths the headings between decisions."""

_TAPS = 10  # points of that window on either side
_FORBIDDEN = 10**12


@dataclass(frozen=True, eq=False)
class HeadingPath:
    """A planned heading, D decisions.

    Attributes:
        times: (D,) s on the track's clock, ascending.
        bins: (D,) whole numbers of BIN_ANGLE from +x, counterclockwise, unwrapped.
    """

    times: np.ndarray
    bins: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "times", freeze_array(self.times))
        object.__setattr__(self, "bins", freeze_array(self.bins, int))

    def sample(self, times: np.ndarray) -> np.ndarray:
        """Sample the heading (T,) rad from +x, unwrapped, at `times` (T,) s; constant beyond both ends."""
        out, angles = np.zeros(len(times)), BIN_ANGLE * self.bins
        offsets = SMOOTHING_SECONDS / 2.0 * np.arange(-_TAPS, _TAPS + 1) / (_TAPS + 1)
        weights = 0.5 + 0.5 * np.cos(2.0 * np.pi * offsets / SMOOTHING_SECONDS)
        for offset, weight in zip(offsets, weights / weights.sum()):
            out += weight * np.interp(times + offset, self.times, angles)
        return out

    def cut_span(self, start: float, end: float) -> HeadingPath:
        """Cut out the decisions that the headings from `start` to `end` s depend on, less whole turns."""
        reach = 0.5 * SMOOTHING_SECONDS
        low = max(int(np.searchsorted(self.times, start - reach, side="right")) - 1, 0)
        part = slice(low, int(np.searchsorted(self.times, end + reach)) + 1)
        bins = self.bins[part]
        return HeadingPath(self.times[part], bins - BINS * (bins[0] // BINS))


def find_cheapest_path(costs: np.ndarray, step_costs: np.ndarray) -> np.ndarray:
    """Find the cheapest sequence of headings; among equals the one that has turned least from its first one.

    So a body that turns away and back comes back the way it went, rather than all the way round.

    Args:
        costs: (D, BINS) of every heading at every decision; inf where it is not possible.
        step_costs: (D, 2 N + 1) of coming to a decision by -N .. N bins; inf where that is too fast.
    Returns:
        (D,) bins, unwrapped.
    """
    units = np.rint(np.minimum(costs / COST_UNIT, _FORBIDDEN)).astype(np.int64)
    steps = np.rint(np.minimum(step_costs / COST_UNIT, _FORBIDDEN)).astype(np.int64)[:, :, None]
    most, bins = steps.shape[1] // 2, np.arange(BINS)
    turns = np.arange(-most, most + 1)[:, None]
    came_from = (bins[None, :] - turns) % BINS
    total, turned, best = units[0], np.zeros(BINS, dtype=np.int64), np.zeros((len(units), BINS), dtype=np.int64)
    for k in range(1, len(units)):
        reached, angles = total[came_from] + steps[k], turned[came_from] + turns
        best[k] = _find_least(reached, np.abs(angles))
        total, turned = reached[best[k], bins] + units[k], angles[best[k], bins]
    path = np.empty(len(units), dtype=np.int64)
    path[-1] = int(_find_least(total, np.abs(turned)))
    for k in range(len(units) - 1, 0, -1):
        path[k - 1] = path[k] - (best[k, path[k] % BINS] - most)
    return path - BINS * (path[0] // BINS)


def _find_least(values: np.ndarray, seconds: np.ndarray) -> np.ndarray:
    """Find the first row of the least of values (K, ...); among equals the one of the least of `seconds` (K, ...)."""
    return np.where(values == values.min(axis=0), seconds, _FORBIDDEN).argmin(axis=0)


def replace_part(bins: np.ndarray, first: int, end: int, costs: np.ndarray, step_costs: np.ndarray) -> np.ndarray:
    """Replace a part of a path by the cheapest one for other costs that joins the rest at both ends.

    Args:
        bins: (D,) the path.
        first, end: its part; where that ends before the path does, the path's own bins there are kept.
        costs, step_costs: of all D decisions, as for `find_cheapest_path`.
    Returns:
        (D,) bins, unwrapped; behind the part they differ by whole turns at most.
    """
    own = costs[first:end].copy()
    for row, is_joined in ((0, first > 0), (-1, end < len(bins))):
        if is_joined:
            own[row] = np.where(np.arange(BINS) == bins[first:end][row] % BINS, 0.0, np.inf)
    part = find_cheapest_path(own, step_costs[first:end])
    if first > 0:
        part = part + bins[first] - part[0]
    turns = BINS * ((part[-1] - bins[end - 1]) // BINS) if end < len(bins) else 0
    return np.concatenate([bins[:first], part, bins[end:] + turns])
