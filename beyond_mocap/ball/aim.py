"""Solve launches that reach a target: the ball is at a place at a time, after a given number of bounces.

The ball's position at the requested time is a smooth function of its launch velocity while the number of bounces
stays the same. A first guess comes from a ball with linear drag only, whose heights have a closed form. From there a
damped Newton iteration (eq. 7: finite differences from three nearby launches; eq. 8: the part of the step that reduces
the miss) continues with the ball's own physics, for all targets at once. Where height and time allow several launches,
the one that goes up highest and bounces latest is used.

Source: Ball handling, section 4, equations 7 and 8.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..base.errors import InputError
from ..base.vectors import arctan2
from . import batch
from .physics import Ball, vector_length

HIT_TOLERANCE = 0.01
"""m: a miss up to this counts as a hit."""
RETRY_TOLERANCE = 1e-3
"""m: with a larger miss the next kind of initial guess is tried."""
CONVERGED_TOLERANCE = 1e-4
"""m: the miss at which the iteration stops."""
MAX_ITERATIONS = 14
LONGEST_STEP = 15.0
"""m/s: the largest change of a launch in one step."""
UPWARD_SAMPLES = 20
"""Number of upward launch speeds that are tried for a first guess."""
FREE_TIMES = np.geomspace(0.1, 6.0, 40)
"""s: flight times that are tried where the time is free."""
MAX_INITIAL_SPEED = 200.0
"""m/s: the highest launch speed an iteration starts from."""
FALLBACK_TIME_SHARES = (1.06, 0.94, 1.15, 0.85)
"""Shares of the time with the slowest launch that are tried where the ball's own physics does not allow that time: it
is at the limit of what is possible, where a rebound just reaches the target's height."""
REBOUND_MARGIN = 5e-3
"""s: the least time since the last bounce. Without it, a ball on the ground at its target would count its first touch
of the ground as a bounce."""
DIFFERENCE_STEP = 1e-3
"""m/s: by how much a launch is varied for finite differences."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AimResult:
    """Launches for B targets.

    Attributes:
        velocity: (B, 3) m/s at the launch, world frame; where not possible, the best that was found.
        spin: (B, 3) rad/s, as given.
        seconds: (B,) s until each ball is at its target.
        miss: (B,) m between ball and target at that time.
        possible: (B,) bool, the target is hit within the allowed speed.
    """

    velocity: np.ndarray
    spin: np.ndarray
    seconds: np.ndarray
    miss: np.ndarray
    possible: np.ndarray


def solve_launches(start: np.ndarray, target: np.ndarray, ball: Ball, seconds: np.ndarray | None = None,
                   bounces: int = 0, spin: np.ndarray | None = None, fastest: float | None = None,
                   initial_velocity: np.ndarray | None = None, ground: float = 0.0, loft: float | None = None,
                   initial_seconds: np.ndarray | None = None) -> AimResult:
    """Solve launches after which the ball's centre is at `target` after exactly `bounces` bounces.

    `start`, `target` and `spin` may have the shape (3,): the same for all B. Starts and targets below the height of a
    ball on the ground are moved onto the ground.

    Args:
        start: (B, 3) m, the ball's centre at the launch, world frame.
        target: (B, 3) m, where the centre has to be.
        ball: the ball's physics.
        seconds: (B,) s after the launch, or one number for all. None: the time with the slowest launch, or, with
            `loft`, the time whose launch is closest to that angle.
        bounces: how often the ball bounces before it is at the target.
        spin: (B, 3) rad/s. None: no spin.
        fastest: m/s, launches above this speed are not possible.
        initial_velocity: (B, 3) m/s, launches close to the solution, such as the previous ones while a target is
            dragged; rows that are not finite are ignored.
        ground: m, height of the ground.
        loft: rad above the horizon, used where the time is free.
        initial_seconds: (B,) s; where the time is free, only times close to these are tried.
    Returns:
        The launches.
    Raises:
        InputError: if a position or spin is not finite, or times or bounces are invalid.
    """
    problem = _Problem.from_arguments(start, target, ball, seconds=seconds, bounces=bounces, spin=spin, ground=ground)
    if seconds is None:
        problem = problem.with_seconds(_choose_times(problem, loft, initial_seconds))
    velocity, miss = _solve_problem(problem, initial_velocity)
    for share in FALLBACK_TIME_SHARES if seconds is None else ():
        failed = np.flatnonzero(~(miss <= HIT_TOLERANCE))
        if not len(failed):
            break
        subset = problem.select_rows(failed).with_seconds(problem.seconds[failed] * share)
        second, second_miss = _solve_problem(subset, None)
        hit = second_miss <= HIT_TOLERANCE
        velocity[failed[hit]], miss[failed[hit]] = second[hit], second_miss[hit]
        problem.seconds[failed[hit]] = subset.seconds[hit]
    possible = miss <= HIT_TOLERANCE
    if fastest is not None:
        possible &= vector_length(velocity) <= fastest
    return AimResult(velocity=velocity, spin=problem.spin, seconds=problem.seconds, miss=miss, possible=possible)


def solve_ground_launches(start: np.ndarray, target: np.ndarray, ball: Ball, seconds: np.ndarray | None = None,
                          arrival_speed: float = 2.0, fastest: float | None = None, ground: float = 0.0) -> AimResult:
    """Solve level launches for balls that slide and roll along the ground to `target`.

    Args:
        start: (B, 3) m; a start above the ground is moved onto it.
        target: (B, 3) m; only its position on the ground counts.
        ball: the ball's physics.
        seconds: (B,) s or one number. None: so that the ball still has `arrival_speed` at the target.
        arrival_speed: m/s at the target, where `seconds` is None.
        fastest: m/s, launches above this speed are not possible.
        ground: m, height of the ground.
    Returns:
        The launches, with zero spin.
    Raises:
        InputError: as for `solve_launches`.
    """
    problem = _Problem.from_arguments(start, target, ball, seconds=seconds, bounces=0, spin=None, ground=ground)
    low = ground + ball.radius
    problem.start[:, 2], problem.target[:, 2] = low, low
    offset = problem.target - problem.start
    distance = vector_length(offset)
    along = offset / np.maximum(distance, 1e-9)[:, None]
    if seconds is None:
        problem = problem.with_seconds(_solve_ground_times(ball, distance, arrival_speed))
    speed = _solve_ground_speeds(problem, distance)
    velocity = along * speed[:, None]
    miss = vector_length(problem.simulate_arrival(velocity)[0] - problem.target)
    possible = miss <= HIT_TOLERANCE
    if fastest is not None:
        possible &= speed <= fastest
    return AimResult(velocity=velocity, spin=problem.spin, seconds=problem.seconds, miss=miss, possible=possible)


def build_reach_error(start: np.ndarray, target: np.ndarray, result: AimResult, index: int, fastest: float,
                      subject: str) -> InputError:
    """Build the error that explains why a launch is not possible: distance, required speed and human limit.

    Args:
        start: (3,) or (B, 3) m, the launch positions.
        target: (3,) or (B, 3) m.
        result: the launches that were found.
        index: which of the B launches.
        fastest: m/s, the highest allowed speed.
        subject: the player or pass the message names.
    Returns:
        The error, to be raised by the caller.
    """
    start, target = np.atleast_2d(start), np.atleast_2d(target)
    far = np.linalg.norm(target[min(index, len(target) - 1)] - start[min(index, len(start) - 1)])
    speed = float(vector_length(result.velocity[index]))
    found = f"the target is {far:.1f} m away and has to be reached in {result.seconds[index]:.2f} s"
    if result.miss[index] > HIT_TOLERANCE:
        return InputError(subject, f"{found}: no launch reaches it with this number of bounces", "",
                          "allow more time, change the number of bounces, or move the target")
    expected = f"at most {fastest:.0f} m/s, the fastest a person can launch the ball"
    return InputError(subject, f"{found}: that takes {speed:.0f} m/s", expected, "allow more time or move the target")


@np.errstate(over="ignore", invalid="ignore")  # trial launches may diverge
def _solve_problem(problem: _Problem, initial_velocity: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Solve launch velocities (B, 3) m/s and misses (B,) m.

    Start from the given launches, then from first guesses, then from a search, each only for launches that still miss.
    """
    count = len(problem.start)
    velocity = np.full((count, 3), np.nan) if initial_velocity is None else np.broadcast_to(initial_velocity,
            (count, 3)).astype(float)
    miss = np.full(count, np.inf)
    known = np.flatnonzero(np.isfinite(velocity).all(axis=1))
    if len(known):
        velocity[known], miss[known] = _solve_newton(problem.select_rows(known), velocity[known])
    for guess in (lambda part: part.estimate_launches()[0], _Problem.search_launches):
        far = np.flatnonzero(~(miss <= RETRY_TOLERANCE))
        if not len(far):
            break
        part = problem.select_rows(far)
        second, second_miss = _solve_newton(part, guess(part))
        better = (second_miss < miss[far]) | ~np.isfinite(velocity[far]).all(axis=1)
        velocity[far[better]], miss[far[better]] = second[better], second_miss[better]
    return velocity, miss


@dataclass(frozen=True, eq=False, kw_only=True)
class _Problem:
    """Targets (B): start, target, spin (B, 3), seconds (B,), and the ball, bounces and ground they share."""

    start: np.ndarray
    target: np.ndarray
    spin: np.ndarray
    seconds: np.ndarray
    ball: Ball
    bounces: int
    ground: float

    @classmethod
    def from_arguments(cls, start, target, ball, seconds, bounces, spin, ground) -> _Problem:
        """Check and broadcast the arguments of `solve_launches` to (B, 3) and (B,).

        Args:
            start: (3,) or (B, 3) m, where the balls start.
            target: (3,) or (B, 3) m.
            ball: their kind.
            seconds: s of flight, a number or (B,); None: 1 s, until it is chosen.
            bounces: number of bounces before the target.
            spin: (3,) or (B, 3) rad/s; None: no spin.
            ground: m, height of the ground.
        Returns:
            The checked problem.
        """
        start, target = np.asarray(start, float), np.asarray(target, float)
        spin = np.zeros(3) if spin is None else np.asarray(spin, float)
        timed = np.ones(1) if seconds is None else np.asarray(seconds, float)
        shape = np.broadcast_shapes(start.shape, target.shape, spin.shape, (*timed.reshape(-1, 1).shape[:1], 3), (1, 3))
        start, target, spin = (np.broadcast_to(value, shape).copy() for value in (start, target, spin))
        if bounces < 0 or int(bounces) != bounces:
            raise InputError("aim", f"{bounces} bounces", "a whole number, 0 or more")
        if not (np.isfinite(start).all() and np.isfinite(target).all() and np.isfinite(spin).all()):
            raise InputError("aim", "a position or spin that is NaN or infinite")
        if not (np.isfinite(timed).all() and (timed > 0.0).all()):
            raise InputError("aim", f"{np.min(timed):g} s of flight", "a time of more than 0 s")
        for place in (start, target):
            place[:, 2] = np.maximum(place[:, 2], ground + ball.radius)
        return cls(start=start, target=target, spin=spin, seconds=np.broadcast_to(timed, shape[:1]).copy(), ball=ball,
                   bounces=int(bounces), ground=ground)

    def with_seconds(self, seconds: np.ndarray) -> _Problem:
        """Return the same problem with other seconds (B,) of flight."""
        return replace(self, seconds=seconds)

    def select_rows(self, rows: np.ndarray) -> _Problem:
        """Select some of the targets; an index may occur more than once."""
        return replace(self, start=self.start[rows], target=self.target[rows], spin=self.spin[rows],
                       seconds=self.seconds[rows])

    def simulate_arrival(self, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate the balls to their time.

        More than the requested bounces are not simulated, and a bounce within REBOUND_MARGIN does not count. A ball on
        the ground cannot be struck into it: -1 bounces.

        Args:
            velocity: (B, 3) m/s, launch velocities.
        Returns:
            Positions (B, 3) m and bounces (B,).
        """
        balls = batch.build_balls(self.start, velocity, self.spin, self.ball, self.ground)
        balls = batch.simulate_balls(balls, self.ball, self.seconds, self.ground, self.bounces)
        low, rising = self.ground + self.ball.radius, balls.velocity[:, 2]
        just = (balls.bounces > 0) & (rising > 0.0) & (balls.position[:, 2] - low < REBOUND_MARGIN * rising)
        lies = self.start[:, 2] < low + 1e-3
        return balls.position, np.where(lies & (velocity[:, 2] < 0.0), -1, balls.bounces - just)

    def estimate_launches(self) -> tuple[np.ndarray, np.ndarray]:
        """Estimate launches for balls with a linear drag as strong as theirs on average; exact for linear drag.

        Returns:
            Velocities (B, 3) m/s, and (B,) bool: a launch exists that is at the target's height in time.
        """
        offset = self.target - self.start
        drag = self.ball.linear_drag + self.ball.drag * vector_length(offset) / self.seconds
        level = offset[:, :2] / (batch.compute_drag_factors(drag * self.seconds)[0] * self.seconds)[:, None]
        upward, found = self._find_upward_speed(drag)
        return np.column_stack([level, upward]), found

    def _find_upward_speed(self, drag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the highest upward speed (B,) m/s with which such a ball is at the target's height in time.

        Returns:
            Speeds (B,) m/s and (B,) bool: one exists. Where none does, the speed that comes closest.
        """
        gravity, low = self.ball.gravity, self.ground + self.ball.radius
        first, second = batch.compute_drag_factors(drag * self.seconds)
        direct = (self.target[:, 2] - self.start[:, 2] + gravity * self.seconds**2 * second) / (self.seconds * first)
        if not self.bounces:
            return direct, np.ones(len(direct), bool)
        top = gravity * self.seconds * second / first + 0.5  # the highest launch that is down again in time
        tried = top[:, None] - (top[:, None] + 40.0) * np.linspace(0.0, 1.0, UPWARD_SAMPLES) ** 2

        def measure_height_error(upward):
            args = (self.start[:, None, 2] - low, upward, drag[:, None], self.seconds[:, None])
            return _compute_height_after(*args, self.bounces, self.ball) - (self.target[:, None, 2] - low)

        return _find_highest_root(measure_height_error, tried)

    def search_launches(self) -> np.ndarray:
        """Search launch velocities (B, 3) m/s with the ball's own physics.

        Of a row of upward speeds, each corrected to reach the target's distance, use the one that comes closest to its
        height. Slower than the first guess; used where that one diverges.
        """
        count = len(self.start)
        # Row b * UPWARD_SAMPLES + h is target b with the h-th upward speed.
        many = self.select_rows(np.repeat(np.arange(count), UPWARD_SAMPLES))
        top = self.ball.gravity * self.seconds * (0.5 + 0.1 * self.seconds) + 1.0
        upward = (top[:, None] - (top[:, None] + 40.0) * np.linspace(0.0, 1.0, UPWARD_SAMPLES) ** 2).ravel()
        offset = (many.target - many.start)[:, :2]
        level = offset / many.seconds[:, None]
        # Scale the level speed until the ball covers the level distance to the target.
        for _ in range(3):
            place, bounces = many.simulate_arrival(np.column_stack([level, upward]))
            distance_share = np.sum((place - many.start)[:, :2] * offset,
                                    axis=1) / np.maximum(np.sum(offset * offset, axis=1), 1e-9)
            level = level * np.clip(1.0 / np.maximum(distance_share, 1e-2), 0.3, 3.0)[:, None]
            level /= np.maximum(vector_length(np.column_stack([level, 0.0 * upward])) / MAX_INITIAL_SPEED, 1.0)[:, None]
        place, bounces = many.simulate_arrival(np.column_stack([level, upward]))
        # Launches with the wrong number of bounces cannot win.
        short = np.where(bounces == self.bounces, vector_length(place - many.target), np.inf).reshape(count,
                UPWARD_SAMPLES)
        best = np.arange(count) * UPWARD_SAMPLES + np.argmin(short, axis=1)
        return np.column_stack([level, upward])[best]


def _solve_newton(problem: _Problem, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solve launch velocities by a damped Newton iteration.

    The Jacobian of eq. 7 comes from three nearby launches and is updated with the result of each step (Broyden's rule).
    Where the update no longer helps it is computed again. A launch that does not improve three times in a row is given
    up.

    Args:
        problem: the targets (B).
        guess: (B, 3) m/s, initial launches.
    Returns:
        Velocities (B, 3) m/s and misses (B,) m, infinite where the number of bounces is wrong.
    """
    velocity = guess / np.maximum(vector_length(guess) / MAX_INITIAL_SPEED, 1.0)[:, None]
    short, miss = _measure_shortfall(problem, velocity)
    slope = np.empty((len(guess), 3, 3))
    stale, stuck = np.ones(len(guess), bool), np.zeros(len(guess), int)
    for _ in range(MAX_ITERATIONS):
        now = np.flatnonzero((miss > CONVERGED_TOLERANCE) & (stuck < 3))
        if not len(now):
            break
        old = now[stale[now]]
        if len(old):
            slope[old] = _compute_jacobian(problem.select_rows(old), velocity[old], problem.target[old] - short[old])
            stale[old] = False
        # Each failed attempt shortens the next step: full, 0.3, 0.1 (eq. 8).
        step = _compute_step(slope[now], short[now]) * np.array([1.0, 0.3, 0.1])[stuck[now]][:, None]
        step /= np.maximum(vector_length(step) / LONGEST_STEP, 1.0)[:, None]
        new_short, new_miss = _measure_shortfall(problem.select_rows(now), velocity[now] + step)
        slope[now] += _compute_broyden_update(slope[now], step, short[now] - new_short)
        # A launch with the wrong number of bounces has an infinite miss: judge it by its distance instead.
        lost = np.isinf(miss[now])
        better = np.where(lost, ~np.isinf(new_miss) | (vector_length(new_short) < vector_length(short[now])),
                          new_miss < miss[now])
        stale[now] = ~better | (new_miss > 0.3 * miss[now])
        stuck[now] = np.where(better & (lost | (new_miss < 0.9 * miss[now])), 0, stuck[now] + 1)
        improved = now[better]
        velocity[improved] += step[better]
        short[improved], miss[improved] = new_short[better], new_miss[better]
    return velocity, miss


def _measure_shortfall(problem: _Problem, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure what is missing to the targets.

    Returns:
        Vectors (B, 3) m from ball to target, and their lengths (B,) m, infinite where the number of bounces is wrong.
    """
    place, bounces = problem.simulate_arrival(velocity)
    short = problem.target - place
    return short, np.where(bounces == problem.bounces, vector_length(short), np.inf)


def _compute_jacobian(problem: _Problem, velocity: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Compute (B, 3, 3) s: how the arrival positions (B, 3) m change with the launch velocities (B, 3) m/s."""
    count = len(velocity)
    nudged = (velocity[:, None] + DIFFERENCE_STEP * np.eye(3)).reshape(-1, 3)
    beside, _ = problem.select_rows(np.repeat(np.arange(count), 3)).simulate_arrival(nudged)
    return np.swapaxes(beside.reshape(count, 3, 3) - place[:, None], 1, 2) / DIFFERENCE_STEP


def _compute_step(slope: np.ndarray, short: np.ndarray) -> np.ndarray:
    """Compute the steps (B, 3) m/s that remove `short` (B, 3) m by the Jacobians (B, 3, 3), slightly damped."""
    transposed = np.swapaxes(slope, 1, 2)
    square = transposed @ slope + 1e-9 * np.eye(3)
    with np.errstate(invalid="ignore"):  # diverged launches have infinite slopes
        can = np.isfinite(square).all(axis=(1, 2)) & (np.linalg.det(square) != 0.0)
    return np.linalg.solve(np.where(can[:, None, None], square, np.eye(3)), transposed @ short[:, :, None])[:, :, 0]


def _compute_broyden_update(slope: np.ndarray, step: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Compute Broyden's update (B, 3, 3) after a step (B, 3) m/s moved the arrival by `moved` (B, 3) m."""
    wrong = moved - np.einsum("bij,bj->bi", slope, step)
    return wrong[:, :, None] * step[:, None] / np.maximum(np.sum(step * step, axis=1), 1e-12)[:, None, None]


def _choose_times(problem: _Problem, loft: float | None, initial_seconds: np.ndarray | None) -> np.ndarray:
    """Choose flight times (B,) s with the slowest launch, or the launch closest to `loft` rad, by the first guesses.

    Looks at FREE_TIMES (or at `initial_seconds`) first, then at times near the best one.
    """
    coarse = initial_seconds if initial_seconds is not None else _choose_best_time(problem,
                                                                                   np.tile(FREE_TIMES,
            (len(problem.start), 1)), loft)
    return _choose_best_time(problem, coarse[:, None] * np.linspace(0.9, 1.1, 11), loft)


def _choose_best_time(problem: _Problem, times: np.ndarray, loft: float | None) -> np.ndarray:
    """Choose the best (B,) s of each row of `times` (B, N) s."""
    count, each = times.shape
    launch, found = problem.select_rows(np.repeat(np.arange(count),
                                                  each)).with_seconds(times.ravel()).estimate_launches()
    cost = vector_length(launch)
    if loft is not None:
        cost = np.abs(arctan2(launch[:, 2], vector_length(launch * [1.0, 1.0, 0.0])) - loft)
    best = np.argmin(np.where(found, cost, cost + 1e6).reshape(count, each), axis=1)
    return times[np.arange(count), best]


def _compute_height_after(height, upward, drag, seconds, bounces: int, ball: Ball) -> np.ndarray:
    """Compute heights m above a ball on the ground, after `bounces` bounces under linear drag.

    NaN where the ball has not bounced that often by then. All arguments broadcast.
    """
    height, upward, drag, left = (value.copy() for value in np.broadcast_arrays(height, upward, drag, seconds))
    for _ in range(bounces):
        fall = (upward + np.sqrt(upward**2 + 2.0 * ball.gravity * height)) / ball.gravity
        # Newton's method for the time of landing, from the time without drag.
        for _ in range(4):
            place, rise = _compute_fall(height, upward, drag, fall, ball.gravity)
            fall = np.maximum(fall - place / np.minimum(rise, -1e-6), 1e-9)
        left = left - fall
        upward = -ball.restitution * _compute_fall(height, upward, drag, fall, ball.gravity)[1]
        height = np.zeros_like(height)
    return np.where(left >= 0.0, _compute_fall(height, upward, drag, np.maximum(left, 0.0), ball.gravity)[0], np.nan)


def _compute_fall(height, upward, drag, seconds, gravity: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute height m and upward speed m/s after `seconds` under linear drag."""
    first, second = batch.compute_drag_factors(drag * seconds)
    place = height + upward * seconds * first - gravity * seconds**2 * second
    return place, upward * np.exp(-drag * seconds) - gravity * seconds * first


def _find_highest_root(value, tried: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the first sign change of `value` in each row of `tried` (B, N), whose values fall, by bisection.

    Returns:
        Roots (B,), and (B,) bool: the sign changes. Where it does not, the value that comes closest to zero.
    """
    rows, values = np.arange(len(tried)), value(tried)
    changes = values[:, 1:] * values[:, :-1] <= 0.0
    first, found = np.argmax(changes, axis=1), changes.any(axis=1)
    out = tried[rows, np.argmin(np.where(np.isnan(values), np.inf, np.abs(values)), axis=1)]
    high, low = tried[rows, first], tried[rows, first + 1]
    sign = np.sign(values[rows, first])
    for _ in range(24):
        middle = 0.5 * (high + low)
        same = np.sign(value(middle[:, None])[:, 0]) == sign
        high, low = np.where(same, middle, high), np.where(same, low, middle)
    return np.where(found, 0.5 * (high + low), out), found


def _solve_ground_speeds(problem: _Problem, distance: np.ndarray) -> np.ndarray:
    """Solve the level launch speed (B,) m/s with which the ball rolls `distance` (B,) m in time, by bisection."""
    low, high = np.zeros(len(distance)), np.full(len(distance), 120.0)
    for _ in range(24):
        speed = 0.5 * (low + high)
        level = speed[:, None] * [1.0, 0.0, 0.0]
        place, _ = batch.simulate_states([0.0, 0.0, problem.ball.radius], level, None, problem.ball, problem.seconds)
        low, high = np.where(place[:, 0] < distance, speed, low), np.where(place[:, 0] < distance, high, speed)
    return high


def _solve_ground_times(ball: Ball, distance: np.ndarray, arrival_speed: float) -> np.ndarray:
    """Solve the times (B,) s after which a ball on the ground is `distance` (B,) m away with `arrival_speed` m/s
    left.
    """
    times, distances, speeds_left = _build_ground_table(ball)
    out = np.empty(len(distance))
    for i, far in enumerate(distance):
        there = [np.interp(far, row, times, right=np.inf) for row in distances]
        still = [np.interp(time, times, row) if np.isfinite(time) else -1.0 for time, row in zip(there, speeds_left)]
        # The first row of the table that is still fast enough; interpolate between it and the row before.
        fast = int(np.argmax(np.array(still) >= arrival_speed))  # the slowest launch that is fast enough at the target
        share = np.clip((arrival_speed - still[fast - 1]) / (still[fast] - still[fast - 1]), 0.0, 1.0) if fast else 1.0
        before = there[fast - 1] if fast and np.isfinite(there[fast - 1]) else there[fast]
        out[i] = before + share * (there[fast] - before)
    return np.where(np.isfinite(out), out, times[-1])


@lru_cache(maxsize=16)
def _build_ground_table(ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build times (T,) s, and distances m and remaining speeds m/s (S, T) of level launches with rising speed."""
    times, speeds = np.linspace(0.0, 10.0, 41), np.geomspace(0.3, 60.0, 28)
    positions, velocities = batch.simulate_trajectories([0.0, 0.0, ball.radius], speeds[:, None] * [1.0, 0.0, 0.0],
                                                        None, ball, times)
    return times, positions[:, :, 0], velocities[:, :, 0]
