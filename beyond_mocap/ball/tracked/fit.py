"""Fit launches to the samples between two touches: flight with bounces, slide and roll by the physics of `ball`.

All stretches are fitted together by damped least squares. The unknowns are the start position (slightly), velocity and
spin. Heights follow from the fit where the feed has none, because a ball slows differently in the air and on the
ground. Fits simulate thousands of flights, so they use coarse steps (`coarse_flight`) and the reference physics
(`batch.simulate_trajectories`) in the last round alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...base.easing import hermite
from ...base.errors import UserCancelledError
from ...base.vectors import unit_vectors
from ..batch import simulate_trajectories
from ..physics import FOOTBALL, Ball
from .coarse_flight import simulate_coarse_trajectories

GRID = 0.04  # s between the simulated moments of a flight
LONGEST = 5.0  # s, the longest stretch that is fitted
_COARSE_ROUNDS, _ROUNDS = 3, 5  # rounds with coarse steps: for each upward speed; from the best
_FINE_ROUNDS = 1  # rounds with the reference physics
_UPWARD_SPEEDS = (0.0, 2.0, 4.5, 7.0, 10.0, 14.0)  # m/s, tried where heights are unknown
_LOW_COUNT = 2  # of them the ball hardly leaves the ground
_LOFT_COST_SHARE, _LOFT_COST_MARGIN = 0.7, 3.0  # a loft must cost less than this share of the low one's cost, less this
_SHORT_DISTANCE = 6.0  # m, a shorter stretch stays on the ground: no more than a hop
# m, deviation of samples, of filled-in samples, of heights
_SAMPLE_DEVIATION, _FILLED_DEVIATION, _HEIGHT_DEVIATION = 0.08, 0.6, 0.12
_TOUCH_DEVIATION = 0.12  # m, deviation of touch positions
_USUAL_SPIN = 25.0  # rad/s, usual spin about each axis
_MIN_LOFT_SPEED = 1.0  # m/s upward, a slower ball stays on the ground
_USUAL_UPWARD_SPEED = 8.0  # m/s, usual velocity upward
_USUAL_END_HEIGHT, _MAX_END_HEIGHT = 1.5, 2.2  # m, usual and highest likely height of the ball at the next touch
_MIN_GAIN = 0.01  # share of the cost; the iteration stops when it gains less
_BATCH = 300  # stretches fitted together, to limit memory
_MAX_SAMPLES = 40  # samples used per stretch


@dataclass(frozen=True, eq=False)
class Stretches:
    """S stretches between touches, each with up to K samples; rows are padded with weight zero.

    Attributes:
        seconds: (S,) s from start to end.
        start: (S, 3) m, z NaN where unknown.
        end: (S, 3) m, z NaN where unknown.
        velocity: (S, 3) m/s at the start, z NaN where unknown.
        since: (S, K) s of each sample after the start.
        points: (S, K, 3) m, the samples.
        weight: (S, K) 1/m, horizontal.
        weight_z: (S, K) 1/m, vertical.
    """

    seconds: np.ndarray
    start: np.ndarray
    end: np.ndarray
    velocity: np.ndarray
    since: np.ndarray
    points: np.ndarray
    weight: np.ndarray
    weight_z: np.ndarray

    def __len__(self) -> int:
        return len(self.seconds)

    def select_rows(self, which: np.ndarray) -> Stretches:
        """Select some of the stretches."""
        return Stretches(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


@dataclass(frozen=True, eq=False)
class Launches:
    """One launch for each of S stretches.

    Attributes:
        place: (S, 3) m of the centre.
        velocity: (S, 3) m/s.
        spin: (S, 3) rad/s.
        cost: (S,) of the fit, sum of squared residuals.
    """

    place: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    cost: np.ndarray


def collect_stretches(times, positions, measured, used, spans) -> Stretches:
    """Collect stretches with their samples.

    Args:
        times: (N,) s of the feed.
        positions: (N, 3) m of the ball.
        measured: (N,) bool, measured samples; the others are filled in.
        used: (N,) bool.
        spans: per stretch (start s, end s, start (3,) m, end (3,) m, start velocity (3,) m/s).
    Returns:
        The stretches.
    """
    begins = np.array([span[0] for span in spans])
    ends = np.array([span[1] for span in spans])
    first, last = np.searchsorted(times, begins, "right"), np.searchsorted(times, ends, "left")
    columns = min(max(int((last - first).max(initial=0)), 1), _MAX_SAMPLES)
    # A stretch with more than _MAX_SAMPLES samples uses every stride-th of them.
    stride = np.ceil((last - first) / columns).astype(int)
    index = first[:, None] + np.arange(columns) * np.maximum(stride, 1)[:, None]
    inside = index < last[:, None]
    index = np.minimum(index, len(times) - 1)
    points = positions[index]
    weight = np.where(measured[index], 1.0 / _SAMPLE_DEVIATION, 1.0 / _FILLED_DEVIATION) * (inside & used[index])
    high = np.isfinite(points[..., 2])
    weight_z = np.where(measured[index], 1.0 / _HEIGHT_DEVIATION, 1.0 / _FILLED_DEVIATION) * (inside & used[index]
            & high)
    start, end, velocity = (np.array([span[place] for span in spans]) for place in (2, 3, 4))
    since = np.where(inside, times[index] - begins[:, None], 0.0)
    return Stretches(ends - begins, start, end, velocity=velocity, since=since, points=np.nan_to_num(points),
                     weight=weight, weight_z=weight_z)


def fit_launches(stretches: Stretches, ball: Ball = FOOTBALL, cancelled: Callable[[], bool] | None = None) -> Launches:
    """Fit the best launch of every stretch.

    Starts from the measured upward velocity; where heights are unknown, several are tried and the lower one is
    preferred.

    Args:
        stretches: S stretches.
        ball: the ball's physics.
        cancelled: called between batches; True cancels the work.
    Returns:
        The launches.
    Raises:
        UserCancelledError: if `cancelled` returns True.
    """
    if np.isfinite(stretches.velocity[:, 2]).all():
        starts = _build_guess(stretches, stretches.velocity[:, 2])[None]
    else:
        starts = _choose_starts(stretches, ball, cancelled)
    fits, costs = _fit_batches(stretches, starts, ball, rounds=_ROUNDS, simulate=_simulate_coarse, cancelled=cancelled)
    best, cost = fits[0], costs[0]
    for other, other_cost in zip(fits[1:], costs[1:]):
        is_better = other_cost < _LOFT_COST_SHARE * cost - _LOFT_COST_MARGIN  # when in doubt, keep the lower launch
        best, cost = np.where(is_better[:, None], other, best), np.where(is_better, other_cost, cost)
    fits, costs = _fit_batches(stretches, best[None], ball, rounds=_FINE_ROUNDS, simulate=_simulate_fine,
                               cancelled=cancelled)
    return Launches(*_build_launches(stretches, fits[0], ball), costs[0])


def _choose_starts(stretches: Stretches, ball: Ball, cancelled) -> np.ndarray:
    """Choose initial unknowns (U, S, 7): the best after some rounds from low and from high upward speeds."""
    row = np.arange(len(stretches))
    start = _build_guess(stretches, np.zeros(len(stretches)))
    far = np.flatnonzero(np.linalg.norm((stretches.end - stretches.start)[:, :2], axis=1) > _SHORT_DISTANCE)
    if not len(far):
        return start[None]
    far_stretches = stretches.select_rows(far)
    most = 0.5 * ball.gravity * far_stretches.seconds + 2.0  # with this speed the ball is down again at the end
    guesses = np.stack([_build_guess(far_stretches, np.minimum(upward, most)) for upward in _UPWARD_SPEEDS])
    found, costs = _fit_batches(far_stretches, guesses, ball, rounds=_COARSE_ROUNDS, simulate=_simulate_coarse,
                                cancelled=cancelled)
    low = np.argmin(costs[:_LOW_COUNT], axis=0)
    high = _LOW_COUNT + np.argmin(costs[_LOW_COUNT:], axis=0)
    both = np.stack([start, start])
    for chosen, unknown in zip((low, high), both):
        unknown[far] = found[chosen, row[: len(far)]]
    return both


def _simulate_coarse(place, velocity, spin, ball: Ball, count: int):
    return simulate_coarse_trajectories(place, velocity, spin, ball=ball, step=GRID, count=count)


def _simulate_fine(place, velocity, spin, ball: Ball, count: int):
    return simulate_trajectories(place, velocity, spin, ball, np.arange(count + 1) * GRID)


def _build_guess(stretches: Stretches, upward: np.ndarray) -> np.ndarray:
    """Build initial unknowns (S, 7): dx, dy, vx, vy, vz, top spin, side spin."""
    unknown = np.zeros((len(stretches), 7))
    unknown[:, 2:4] = stretches.velocity[:, :2]
    unknown[:, 4] = upward
    return unknown


def _build_launches(stretches: Stretches, unknown: np.ndarray, ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build positions (S, 3) m, velocities (S, 3) m/s and spins (S, 3) rad/s from the unknowns (S, 7)."""
    place = np.nan_to_num(stretches.start, nan=ball.radius)
    place[:, :2] += unknown[:, :2]
    place[:, 2] = np.maximum(place[:, 2], ball.radius)
    velocity = unknown[:, 2:5]
    flat = unit_vectors(velocity[:, :2], min_length=1e-6)
    top, side = unknown[:, 5], unknown[:, 6]
    spin = np.stack([-flat[:, 1] * top, flat[:, 0] * top, side], axis=1)
    return place, velocity, spin


def _simulate_to_samples(stretches: Stretches, unknown: np.ndarray, ball: Ball, simulate) -> tuple[np.ndarray,
        np.ndarray]:
    """Simulate the balls; return positions at the samples (S, K, 3) m and at the end (S, 3) m."""
    count = int(np.ceil(stretches.seconds.max() / GRID))
    places, speeds = simulate(*_build_launches(stretches, unknown, ball), ball, count)
    return _interpolate_grid(places, speeds, stretches.since), _interpolate_grid(places, speeds,
                                                                                 stretches.seconds[:, None])[:, 0]


def _interpolate_grid(places, speeds, since) -> np.ndarray:
    """Interpolate (S, K, 3) m cubically between the moments of the grid."""
    cell = np.clip((since / GRID).astype(int), 0, places.shape[1] - 2)
    share = (since / GRID - cell)[..., None]
    row = np.arange(len(places))[:, None]
    p, q = places[row, cell], places[row, cell + 1]
    m, n = speeds[row, cell] * GRID, speeds[row, cell + 1] * GRID
    return hermite(share, p, m, q, n)


def _compute_residuals(stretches: Stretches, unknown: np.ndarray, seen: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Compute the weighted residuals of balls against samples, end positions and usual values.

    Args:
        stretches: S stretches.
        unknown: (S, 7).
        seen: (S, K, 3) m, the balls at the samples' times.
        end: (S, 3) m, the balls at the end.
    Returns:
        (S, R) residuals: horizontal, vertical, then the prior terms.
    """
    offset = seen - stretches.points
    count = np.maximum((stretches.weight > 0).sum(axis=1), 1)
    even = np.sqrt(np.minimum(1.0, 12.0 / count))[:, None]  # errors of neighbouring samples correlate
    flat = offset[..., :2] * (stretches.weight * even)[..., None]
    high = offset[..., 2] * stretches.weight_z * even
    known = np.isfinite(stretches.end[:, 2])
    last = (end - np.nan_to_num(stretches.end)) / _TOUCH_DEVIATION
    over = np.where(known, last[:, 2], end[:, 2] / _USUAL_END_HEIGHT + np.maximum(end[:, 2] - _MAX_END_HEIGHT, 0.0)
                    / _TOUCH_DEVIATION)
    rise = np.where(np.isfinite(stretches.velocity[:, 2]), 0.0, unknown[:, 4] / _USUAL_UPWARD_SPEED)
    speed = np.linalg.norm(unknown[:, 2:4], axis=1)
    rolls = np.where(unknown[:, 4] < _MIN_LOFT_SPEED, np.clip(unknown[:, 5], 0.0, speed / FOOTBALL.radius), 0.0)
    spin_excess = np.stack([unknown[:, 5] - rolls,
                            unknown[:, 6]])  # rolling: any spin between sliding and rolling is free
    prior = np.stack([last[:, 0], last[:, 1], over, *(unknown[:, :2] / _TOUCH_DEVIATION).T, rise,
                      *(spin_excess / _USUAL_SPIN)], axis=1)
    return np.concatenate([_soften_residuals(flat.reshape(len(offset), -1)), _soften_residuals(high), prior], axis=1)


def _soften_residuals(off: np.ndarray) -> np.ndarray:
    """Soften residuals: beyond two deviations they grow like their square root."""
    far = np.abs(off) > 2.0
    return np.where(far, np.sign(off) * np.sqrt(np.maximum(4.0 * np.abs(off) - 4.0, 0.0)), off)


_DIFFERENCE_STEPS = np.array([0.01, 0.01, 0.02, 0.02, 0.05, 0.5, 0.5])


def _fit_batches(stretches: Stretches, starts: np.ndarray, ball: Ball, rounds: int, simulate,
                 cancelled) -> tuple[np.ndarray, np.ndarray]:
    """Fit stretches from each of some initial unknowns (U, S, 7), in batches of about equal length.

    Returns:
        Unknowns (U, S, 7) and costs (U, S).
    """
    order = np.argsort(stretches.seconds, kind="stable")
    out, costs = starts.copy(), np.zeros(starts.shape[:2])
    for low in range(0, len(order), _BATCH):
        if cancelled is not None and cancelled():
            raise UserCancelledError("solving the ball: cancelled")
        some = order[low : low + _BATCH]
        rows = stretches.select_rows(np.tile(some, len(starts)))
        out[:, some], costs[:, some] = _solve_least_squares(rows, starts[:, some], ball, rounds, simulate)
    return out, costs


def _solve_least_squares(stretches: Stretches, starts: np.ndarray, ball: Ball, rounds: int,
                         simulate) -> tuple[np.ndarray, np.ndarray]:
    """Solve the least-squares fit by the Levenberg-Marquardt method, each stretch with its own damping.

    Args:
        stretches: U times S stretches.
        starts: (U, S, 7) initial unknowns; the S of each go on while one of them gains.
        ball: the ball's physics.
        rounds: at most.
        simulate: `_simulate_coarse` or `_simulate_fine`.
    """
    stretches, unknown, count = _crop_columns(stretches), starts.reshape(-1, starts.shape[-1]), starts.shape[-1]
    off, slope = _linearize(stretches, unknown, ball, simulate)
    cost = (off**2).sum(axis=1)
    damping, goes_on = np.full(len(unknown), 1e-2), np.ones(len(unknown), bool)
    for number in range(rounds):
        # i, j: unknowns; s: stretch; r: residual. Normal equations per stretch.
        normal = np.einsum("isr,jsr->sij", slope, slope)
        right = -np.einsum("isr,sr->si", slope, off)
        diagonal = np.einsum("sii->si", normal) + 1e-9
        damped = normal + (damping[:, None] * diagonal)[..., None] * np.eye(count)
        step = np.linalg.solve(damped, right[..., None])[..., 0]
        tried = unknown + np.clip(step, -6.0 * _USUAL_SPIN, 6.0 * _USUAL_SPIN)
        if number + 1 < rounds:
            off_tried, slope_tried = _linearize(stretches, tried, ball, simulate)
        else:  # the slope after the last round is not needed
            off_tried, slope_tried = _simulate_residuals(stretches, tried, ball, simulate), slope
        cost_tried = (off_tried**2).sum(axis=1)
        good = goes_on & (cost_tried < cost)
        better = np.where(good, cost - cost_tried, 0.0) > _MIN_GAIN * cost
        unknown, off = np.where(good[:, None], tried, unknown), np.where(good[:, None], off_tried, off)
        slope, cost = np.where(good[:, None], slope_tried, slope), np.where(good, cost_tried, cost)
        # Less damping after a success, more after a failure.
        damping = np.clip(np.where(good, damping / 5.0, damping * 8.0), 1e-6, 1e4)
        goes_on = np.repeat(better.reshape(starts.shape[:2]).any(axis=1), starts.shape[1])
        if not goes_on.any():
            break
    return unknown.reshape(starts.shape), cost.reshape(starts.shape[:2])


def _simulate_residuals(stretches: Stretches, unknown: np.ndarray, ball: Ball, simulate) -> np.ndarray:
    """Simulate the balls; return their residuals (S, R)."""
    return _compute_residuals(stretches, unknown, *_simulate_to_samples(stretches, unknown, ball, simulate))


def _linearize(stretches: Stretches, unknown: np.ndarray, ball: Ball, simulate) -> tuple[np.ndarray, np.ndarray]:
    """Compute the residuals (S, R), and (7, S, R): their change with each unknown, by coarse steps.

    Rows s, S + s, 2 S + s ... of the simulation are stretch s with none and with one of the unknowns 2..6 changed; a
    change of the start position (unknowns 0, 1) moves the whole trajectory and needs no simulation.
    """
    count = len(unknown)
    copies = stretches.select_rows(np.tile(np.arange(count), 6))
    nudged = np.tile(unknown, (6, 1))
    nudged[count:] += np.repeat(np.diag(_DIFFERENCE_STEPS)[2:], count, axis=0)
    seen, end = _simulate_to_samples(copies, nudged, ball, _simulate_coarse)
    residuals = _compute_residuals(copies, nudged, seen, end).reshape(6, count, -1)
    moved = []
    for axis in range(2):
        shift = _DIFFERENCE_STEPS[axis] * np.eye(3)[axis]
        shifted = unknown + _DIFFERENCE_STEPS[axis] * np.eye(7)[axis]
        moved.append(_compute_residuals(stretches, shifted, seen[:count] + shift, end[:count] + shift))
    slope = (np.concatenate([np.stack(moved), residuals[1:]]) - residuals[0]) / _DIFFERENCE_STEPS[:, None, None]
    is_coarse = simulate is _simulate_coarse
    return residuals[0] if is_coarse else _simulate_residuals(stretches, unknown, ball, simulate), slope


def _crop_columns(stretches: Stretches) -> Stretches:
    """Crop the stretches to the columns that have samples."""
    used = np.flatnonzero((stretches.weight > 0).any(axis=0))
    last = int(used[-1]) + 1 if len(used) else 1
    wide = {name: getattr(stretches, name)[:, :last] for name in ("since", "points", "weight", "weight_z")}
    rest = {name: getattr(stretches, name) for name in ("seconds", "start", "end", "velocity")}
    return Stretches(**rest, **wide)
