"""Solve launches that reach a target: the ball is at a place at a time, after a given number of bounces.

The ball's position at the requested time is a smooth function of its launch velocity while the number of bounces
stays the same. From a first guess (`initial_launches`) a damped Newton iteration (eq. 7: finite differences from three
nearby launches; eq. 8: the part of the step that reduces the miss) continues with the ball's own physics, for all
targets at once. Where height and time allow several launches, the one that goes up highest and bounces latest is used.

Source: Ball handling, section 4, equations 7 and 8.
"""

from __future__ import annotations

import numpy as np

from .aim_problem import HIT_TOLERANCE, AimProblem, AimResult
from .initial_launches import MAX_INITIAL_SPEED, choose_times, estimate_launches, search_launches
from .physics import Ball, vector_length

RETRY_TOLERANCE = 1e-3
"""m: with a larger miss the next kind of initial guess is tried."""
CONVERGED_TOLERANCE = 1e-4
"""m: the miss at which the iteration stops."""
MAX_ITERATIONS = 14
LONGEST_STEP = 15.0
"""m/s: the largest change of a launch in one step."""
FALLBACK_TIME_SHARES = (1.06, 0.94, 1.15, 0.85)
"""Shares of the time with the slowest launch that are tried where the ball's own physics does not allow that time: it
is at the limit of what is possible, where a rebound just reaches the target's height."""
DIFFERENCE_STEP = 1e-3
"""m/s: by how much a launch is varied for finite differences."""


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
    problem = AimProblem.from_arguments(start, target, ball, seconds=seconds, bounces=bounces, spin=spin, ground=ground)
    if seconds is None:
        problem = problem.with_seconds(choose_times(problem, loft, initial_seconds))
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


@np.errstate(over="ignore", invalid="ignore")  # trial launches may diverge
def _solve_problem(problem: AimProblem, initial_velocity: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
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
    for guess in (lambda part: estimate_launches(part)[0], search_launches):
        far = np.flatnonzero(~(miss <= RETRY_TOLERANCE))
        if not len(far):
            break
        part = problem.select_rows(far)
        second, second_miss = _solve_newton(part, guess(part))
        better = (second_miss < miss[far]) | ~np.isfinite(velocity[far]).all(axis=1)
        velocity[far[better]], miss[far[better]] = second[better], second_miss[better]
    return velocity, miss


def _solve_newton(problem: AimProblem, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def _measure_shortfall(problem: AimProblem, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure what is missing to the targets.

    Returns:
        Vectors (B, 3) m from ball to target, and their lengths (B,) m, infinite where the number of bounces is wrong.
    """
    place, bounces = problem.simulate_arrival(velocity)
    short = problem.target - place
    return short, np.where(bounces == problem.bounces, vector_length(short), np.inf)


def _compute_jacobian(problem: AimProblem, velocity: np.ndarray, place: np.ndarray) -> np.ndarray:
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
