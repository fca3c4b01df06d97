"""Fit launches to the samples between two touches: flight with bounces, slide and roll by the physics of `ball`.

All stretches are fitted together by damped least squares. The unknowns are the start position (slightly), velocity and
spin. Heights follow from the fit where the feed has none, because a ball slows differently in the air and on the
ground. Fits simulate thousands of flights, so they use coarse steps, about one sample apart, in which a ball may bounce
once. `batch.simulate_trajectories` is the reference: at 0.04 s the two agree within some centimetres over a second.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...base.easing import hermite
from ...base.errors import Cancelled
from ...base.vectors import unit_vectors
from ..batch import courses
from ..physics import FOOTBALL, Ball, bounced, gripped, in_air, length, rolling_spin, sliding, slip, slowing

GRID = 0.04  # s between the simulated moments of a flight
LONGEST = 5.0  # s, the longest stretch that is fitted
_ROUGH_ROUNDS, _ROUNDS = 3, 5  # rounds with coarse steps: for each upward speed; from the best
_FINE_ROUNDS = 1  # rounds with the reference physics
_UPWARD = (0.0, 2.0, 4.5, 7.0, 10.0, 14.0)  # m/s, tried where heights are unknown
_LOW_ONES = 2  # of them the ball hardly leaves the ground
_CLEARLY, _MARGIN = 0.7, 3.0  # a loft must cost less than this share of the low one's cost, less this
_FLAT = 6.0  # m, a shorter stretch stays on the ground: no more than a hop
_SEEN, _FILLED, _SEEN_HEIGHT = 0.08, 0.6, 0.12  # m, deviation of samples, of filled-in samples, of heights
_PLACED = 0.12  # m, deviation of touch positions
_SPUN = 25.0  # rad/s, usual spin about each axis
_HOP = 1.0  # m/s upward, a slower ball stays on the ground
_LOFTED = 8.0  # m/s, usual velocity upward
_TAKEN, _HIGH = 1.5, 2.2  # m, usual and highest likely height of the ball at the next touch
_ENOUGH = 0.01  # share of the cost; the iteration stops when it gains less
_AT_ONCE = 300  # stretches fitted together, to limit memory
_MOST = 40  # samples used per stretch

_LEAST_HOP = 0.35  # m/s upward after a bounce: a lower hop ends within one step


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

    def take(self, which: np.ndarray) -> Stretches:
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


def gathered(times, positions, measured, used, spans) -> Stretches:
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
    most = min(max(int((last - first).max(initial=0)), 1), _MOST)
    # A stretch with more than _MAX_SAMPLES samples uses every stride-th of them.
    stride = np.ceil((last - first) / most).astype(int)
    index = first[:, None] + np.arange(most) * np.maximum(stride, 1)[:, None]
    inside = index < last[:, None]
    index = np.minimum(index, len(times) - 1)
    points = positions[index]
    weight = np.where(measured[index], 1.0 / _SEEN, 1.0 / _FILLED) * (inside & used[index])
    high = np.isfinite(points[..., 2])
    weight_z = np.where(measured[index], 1.0 / _SEEN_HEIGHT, 1.0 / _FILLED) * (inside & used[index] & high)
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
        Cancelled: if `cancelled` returns True.
    """
    if np.isfinite(stretches.velocity[:, 2]).all():
        tried = [_guess(stretches, stretches.velocity[:, 2])]
    else:
        tried = _lofted(stretches, ball, cancelled)
    fitted = [_fitted(stretches, start, ball, rounds=_ROUNDS, follow=_coarsely, cancelled=cancelled) for start in tried]
    best, cost = fitted[0]
    for other, costs in fitted[1:]:
        clearly = costs < _CLEARLY * cost - _MARGIN  # when in doubt, keep the lower launch
        best, cost = np.where(clearly[:, None], other, best), np.where(clearly, costs, cost)
    best, cost = _fitted(stretches, best, ball, rounds=_FINE_ROUNDS, follow=_finely, cancelled=cancelled)
    return Launches(*_launch(stretches, best, ball), cost)


def _lofted(stretches: Stretches, ball: Ball, cancelled) -> list[np.ndarray]:
    """Choose two initial unknowns (S, 7): the best after some rounds from low and from high upward speeds."""
    row = np.arange(len(stretches))
    start = _guess(stretches, np.zeros(len(stretches)))
    far = np.flatnonzero(np.linalg.norm((stretches.end - stretches.start)[:, :2], axis=1) > _FLAT)
    if not len(far):
        return [start]
    some = stretches.take(far)
    most = 0.5 * ball.gravity * some.seconds + 2.0  # with this speed the ball is down again at the end
    rough = [_fitted(some, _guess(some, np.minimum(upward, most)), ball, rounds=_ROUGH_ROUNDS, follow=_coarsely,
                     cancelled=cancelled)
             for upward in _UPWARD]  # fmt: skip
    costs, found = np.array([cost for _, cost in rough]), np.stack([unknown for unknown, _ in rough])
    low = np.argmin(costs[:_LOW_ONES], axis=0)
    high = _LOW_ONES + np.argmin(costs[_LOW_ONES:], axis=0)
    both = [start.copy(), start.copy()]
    for chosen, unknown in zip((low, high), both):
        unknown[far] = found[chosen, row[: len(far)]]
    return both


def _coarsely(place, velocity, spin, ball: Ball, count: int):
    return coarse_courses(place, velocity, spin, ball=ball, step=GRID, count=count)


def _finely(place, velocity, spin, ball: Ball, count: int):
    return courses(place, velocity, spin, ball, np.arange(count + 1) * GRID)


def _guess(stretches: Stretches, upward: np.ndarray) -> np.ndarray:
    """Build initial unknowns (S, 7): dx, dy, vx, vy, vz, top spin, side spin."""
    unknown = np.zeros((len(stretches), 7))
    unknown[:, 2:4] = stretches.velocity[:, :2]
    unknown[:, 4] = upward
    return unknown


def _launch(stretches: Stretches, unknown: np.ndarray, ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build positions (S, 3) m, velocities (S, 3) m/s and spins (S, 3) rad/s from the unknowns (S, 7)."""
    place = np.nan_to_num(stretches.start, nan=ball.radius)
    place[:, :2] += unknown[:, :2]
    place[:, 2] = np.maximum(place[:, 2], ball.radius)
    velocity = unknown[:, 2:5]
    flat = unit_vectors(velocity[:, :2], least=1e-6)
    top, side = unknown[:, 5], unknown[:, 6]
    spin = np.stack([-flat[:, 1] * top, flat[:, 0] * top, side], axis=1)
    return place, velocity, spin


def _ways(stretches: Stretches, unknown: np.ndarray, ball: Ball, follow) -> tuple[np.ndarray, np.ndarray]:
    """Simulate the balls; return positions at the samples (S, K, 3) m and at the end (S, 3) m."""
    count = int(np.ceil(stretches.seconds.max() / GRID))
    places, speeds = follow(*_launch(stretches, unknown, ball), ball, count)
    return _between(places, speeds, stretches.since), _between(places, speeds, stretches.seconds[:, None])[:, 0]


def _between(places, speeds, since) -> np.ndarray:
    """Interpolate (S, K, 3) m cubically between the moments of the grid."""
    cell = np.clip((since / GRID).astype(int), 0, places.shape[1] - 2)
    share = (since / GRID - cell)[..., None]
    row = np.arange(len(places))[:, None]
    p, q = places[row, cell], places[row, cell + 1]
    m, n = speeds[row, cell] * GRID, speeds[row, cell + 1] * GRID
    return hermite(share, p, m, q, n)


def _misses(stretches: Stretches, unknown: np.ndarray, seen: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Compute the weighted residuals of balls against samples, end positions and usual values.

    Args:
        stretches: S stretches.
        unknown: (S, 7).
        seen: (S, K, 3) m, the balls at the samples' times.
        end: (S, 3) m, the balls at the end.
    Returns:
        (S, R) residuals: horizontal, vertical, then the prior terms.
    """
    off = seen - stretches.points
    count = np.maximum((stretches.weight > 0).sum(axis=1), 1)
    even = np.sqrt(np.minimum(1.0, 12.0 / count))[:, None]  # errors of neighbouring samples correlate
    flat = off[..., :2] * (stretches.weight * even)[..., None]
    high = off[..., 2] * stretches.weight_z * even
    known = np.isfinite(stretches.end[:, 2])
    last = (end - np.nan_to_num(stretches.end)) / _PLACED
    over = np.where(known, last[:, 2], end[:, 2] / _TAKEN + np.maximum(end[:, 2] - _HIGH, 0.0) / _PLACED)
    rise = np.where(np.isfinite(stretches.velocity[:, 2]), 0.0, unknown[:, 4] / _LOFTED)
    speed = np.linalg.norm(unknown[:, 2:4], axis=1)
    rolls = np.where(unknown[:, 4] < _HOP, np.clip(unknown[:, 5], 0.0, speed / FOOTBALL.radius), 0.0)
    spun = np.stack([unknown[:, 5] - rolls, unknown[:, 6]])  # rolling: any spin between sliding and rolling is free
    prior = np.stack([last[:, 0], last[:, 1], over, *(unknown[:, :2] / _PLACED).T, rise, *(spun / _SPUN)], axis=1)
    return np.concatenate([_soft(flat.reshape(len(off), -1)), _soft(high), prior], axis=1)


def _soft(off: np.ndarray) -> np.ndarray:
    """Soften residuals: beyond two deviations they grow like their square root."""
    far = np.abs(off) > 2.0
    return np.where(far, np.sign(off) * np.sqrt(np.maximum(4.0 * np.abs(off) - 4.0, 0.0)), off)


_NUDGE = np.array([0.01, 0.01, 0.02, 0.02, 0.05, 0.5, 0.5])


def _fitted(stretches: Stretches, unknown, ball: Ball, rounds: int, follow, cancelled) -> tuple[np.ndarray, np.ndarray]:
    """Fit stretches in batches of about equal length; return unknowns (S, 7) and costs (S,)."""
    order = np.argsort(stretches.seconds, kind="stable")
    out, costs = unknown.copy(), np.zeros(len(unknown))
    for low in range(0, len(order), _AT_ONCE):
        if cancelled is not None and cancelled():
            raise Cancelled("solving the ball: cancelled")
        some = order[low : low + _AT_ONCE]
        out[some], costs[some] = _descend(stretches.take(some), unknown[some], ball, rounds, follow)
    return out, costs


def _descend(stretches: Stretches, unknown, ball: Ball, rounds: int, follow) -> tuple[np.ndarray, np.ndarray]:
    """Solve the least-squares fit by the Levenberg-Marquardt method, each stretch with its own damping."""
    stretches, count = _cropped(stretches), unknown.shape[1]
    off = _misses(stretches, unknown, *_ways(stretches, unknown, ball, follow))
    cost = (off**2).sum(axis=1)
    damping = np.full(len(unknown), 1e-2)
    for _ in range(rounds):
        slope = _slopes(stretches, unknown, ball)
        # i, j: unknowns; s: stretch; r: residual. Normal equations per stretch.
        normal = np.einsum("isr,jsr->sij", slope, slope)
        right = -np.einsum("isr,sr->si", slope, off)
        diagonal = np.einsum("sii->si", normal) + 1e-9
        damped = normal + (damping[:, None] * diagonal)[..., None] * np.eye(count)
        step = np.linalg.solve(damped, right[..., None])[..., 0]
        tried = unknown + np.clip(step, -6.0 * _SPUN, 6.0 * _SPUN)
        off_tried = _misses(stretches, tried, *_ways(stretches, tried, ball, follow))
        cost_tried = (off_tried**2).sum(axis=1)
        good = cost_tried < cost
        better = np.where(good, cost - cost_tried, 0.0) > _ENOUGH * cost
        unknown, off = np.where(good[:, None], tried, unknown), np.where(good[:, None], off_tried, off)
        cost = np.where(good, cost_tried, cost)
        # Less damping after a success, more after a failure.
        damping = np.clip(np.where(good, damping / 5.0, damping * 8.0), 1e-6, 1e4)
        if not better.any():
            break
    return unknown, cost


def _slopes(stretches: Stretches, unknown: np.ndarray, ball: Ball) -> np.ndarray:
    """Compute (7, S, R): the change of the residuals with each unknown, by coarse steps.

    Rows s, S + s, 2 S + s ... of the simulation are stretch s with none and with one of the unknowns 2..6 changed; a
    change of the start position (unknowns 0, 1) moves the whole trajectory and needs no simulation.
    """
    count = len(unknown)
    six = stretches.take(np.tile(np.arange(count), 6))
    nudged = np.tile(unknown, (6, 1))
    nudged[count:] += np.repeat(np.diag(_NUDGE)[2:], count, axis=0)
    seen, end = _ways(six, nudged, ball, _coarsely)
    misses = _misses(six, nudged, seen, end).reshape(6, count, -1)
    moved = []
    for axis in range(2):
        shift = _NUDGE[axis] * np.eye(3)[axis]
        shifted = unknown + _NUDGE[axis] * np.eye(7)[axis]
        moved.append(_misses(stretches, shifted, seen[:count] + shift, end[:count] + shift))
    return (np.concatenate([np.stack(moved), misses[1:]]) - misses[0]) / _NUDGE[:, None, None]


def _cropped(stretches: Stretches) -> Stretches:
    """Crop the stretches to the columns that have samples."""
    used = np.flatnonzero((stretches.weight > 0).any(axis=0))
    last = int(used[-1]) + 1 if len(used) else 1
    wide = {name: getattr(stretches, name)[:, :last] for name in ("since", "points", "weight", "weight_z")}
    rest = {name: getattr(stretches, name) for name in ("seconds", "start", "end", "velocity")}
    return Stretches(**rest, **wide)


def coarse_courses(place: np.ndarray, velocity: np.ndarray, spin: np.ndarray, ball: Ball, step: float,
                   count: int) -> tuple[np.ndarray, np.ndarray]:
    """Simulate balls in coarse steps.

    Args:
        place: (B, 3) m at the launch.
        velocity: (B, 3) m/s at the launch.
        spin: (B, 3) rad/s at the launch.
        ball: the ball's physics.
        step: s between the moments.
        count: number of steps.
    Returns:
        Positions (B, count + 1, 3) m and velocities (B, count + 1, 3) m/s.
    """
    place, velocity, spin = place.copy(), velocity.copy(), spin.copy()
    places, velocities = np.empty((count + 1, *place.shape)), np.empty((count + 1, *place.shape))
    low = ball.radius
    place[:, 2] = np.maximum(place[:, 2], low)
    lies = (place[:, 2] <= low) & (velocity[:, 2] <= _LEAST_HOP)
    velocity[lies, 2] = 0.0
    places[0], velocities[0] = place, velocity
    for index in range(1, count + 1):
        flies, stays = np.flatnonzero(~lies), np.flatnonzero(lies)
        if len(flies):
            place[flies], velocity[flies], spin[flies], lies[flies] = _in_air(
                place[flies], velocity[flies], spin[flies], ball=ball, step=step, low=low)  # fmt: skip
        if len(stays):
            rolling = _on_ground(place[stays], velocity[stays], spin[stays], ball, step)
            place[stays], velocity[stays], spin[stays] = rolling
        places[index], velocities[index] = place, velocity
    return places.transpose(1, 0, 2), velocities.transpose(1, 0, 2)


def _in_air(place, velocity, spin, ball: Ball, step: float, low: float):
    """Step balls in the air by Heun's method; a ball that crosses the ground bounces once within the step.

    `lies` marks balls that stay on the ground from there.
    """
    first = in_air(velocity, spin, ball)
    then = in_air(velocity + step * first, spin, ball)
    after = velocity + 0.5 * step * (first + then)
    there = place + step * velocity + step**2 / 6.0 * (2.0 * first + then)
    lies = np.zeros(len(place), bool)
    down = np.flatnonzero((there[:, 2] <= low) & (after[:, 2] < 0.0))
    if len(down):
        fall, pull = velocity[down, 2], first[down, 2]
        deep = np.maximum(place[down, 2] - low, 0.0)
        # Time to the ground from a parabola, then the rest of the step after the bounce.
        until = (fall + np.sqrt(np.maximum(fall**2 - 2.0 * pull * deep, 0.0))) / np.minimum(-pull, -1e-6)
        until = np.clip(np.abs(until), 0.0, step)[:, None]
        meets = velocity[down] + until * first[down]
        flat = place[down] + until * 0.5 * (velocity[down] + meets)
        away, turned = bounced(meets, spin[down], ball)
        low_hop = away[:, 2] < _LEAST_HOP
        away[low_hop, 2] = 0.0
        left = step - until
        pulled = np.where(low_hop, 0.0, -ball.gravity)
        there[down] = flat + left * away
        there[down, 2] = low + np.maximum(left[:, 0] * away[:, 2] + 0.5 * pulled * left[:, 0] ** 2, 0.0)
        away[:, 2] += pulled * left[:, 0]
        after[down], spin[down], lies[down] = away, turned, low_hop
    return there, after, spin, lies


def _on_ground(place, velocity, spin, ball: Ball, step: float):
    """Step balls on the ground: slide while there is slip, else roll."""
    before = slip(velocity, spin, ball)
    rubs = length(before) > 1e-6
    faster, turning = sliding(velocity, spin, ball)
    slid, turned = velocity + step * faster, spin + step * turning
    stops = ~rubs | ((slip(slid, turned, ball) * before).sum(axis=1) <= 0.0)
    grip, spun = gripped(velocity, spin, ball)
    speed = length(grip)
    slower = np.maximum(speed - step * slowing(speed, ball), 0.0)
    rolled = grip * (slower / np.maximum(speed, 1e-9))[:, None]
    after = np.where(stops[:, None], rolled, slid)
    spun = np.where(stops[:, None], rolling_spin(rolled, ball) + spun * [0.0, 0.0, 1.0], turned)
    middle = np.where(stops[:, None], 0.5 * (grip + rolled), 0.5 * (velocity + slid))
    return place + step * middle, after, spun
