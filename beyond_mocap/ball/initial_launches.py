"""First guesses of the launches that reach a target, from which the iteration of `aim` starts.

A ball with linear drag only has heights in closed form, bounces included, so its launches are found without simulation:
they are the estimate, and where the time of flight is free, they choose it. Where the iteration from there diverges, a
row of launches is simulated.
"""

from __future__ import annotations

import numpy as np

from ..base.vectors import arctan2
from . import batch
from .aim_problem import AimProblem
from .physics import Ball, vector_length

UPWARD_SAMPLES = 20
"""Number of upward launch speeds that are tried for a first guess."""
FREE_TIMES = np.geomspace(0.1, 6.0, 40)
"""s: flight times that are tried where the time is free."""
MAX_INITIAL_SPEED = 200.0
"""m/s: the highest launch speed an iteration starts from."""


def estimate_launches(problem: AimProblem) -> tuple[np.ndarray, np.ndarray]:
    """Estimate launches for balls with a linear drag as strong as theirs on average; exact for linear drag.

    Args:
        problem: the targets (B).
    Returns:
        Velocities (B, 3) m/s, and (B,) bool: a launch exists that is at the target's height in time.
    """
    offset = problem.target - problem.start
    drag = problem.ball.linear_drag + problem.ball.drag * vector_length(offset) / problem.seconds
    level = offset[:, :2] / (batch.compute_drag_factors(drag * problem.seconds)[0] * problem.seconds)[:, None]
    upward, found = _find_upward_speed(problem, drag)
    return np.column_stack([level, upward]), found


def _find_upward_speed(problem: AimProblem, drag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the highest upward speed (B,) m/s with which such a ball is at the target's height in time.

    Returns:
        Speeds (B,) m/s and (B,) bool: one exists. Where none does, the speed that comes closest.
    """
    gravity, low, seconds = problem.ball.gravity, problem.ground + problem.ball.radius, problem.seconds
    first, second = batch.compute_drag_factors(drag * seconds)
    direct = (problem.target[:, 2] - problem.start[:, 2] + gravity * seconds**2 * second) / (seconds * first)
    if not problem.bounces:
        return direct, np.ones(len(direct), bool)
    top = gravity * seconds * second / first + 0.5  # the highest launch that is down again in time
    tried = top[:, None] - (top[:, None] + 40.0) * np.linspace(0.0, 1.0, UPWARD_SAMPLES) ** 2

    def measure_height_error(upward):
        args = (problem.start[:, None, 2] - low, upward, drag[:, None], seconds[:, None])
        return _compute_height_after(*args, problem.bounces, problem.ball) - (problem.target[:, None, 2] - low)

    return _find_highest_root(measure_height_error, tried)


def search_launches(problem: AimProblem) -> np.ndarray:
    """Search launches with the ball's own physics, where the iteration from the estimates diverges.

    Of a row of upward speeds, each corrected to reach the target's distance, use the one that comes closest to its
    height.

    Args:
        problem: the targets (B).
    Returns:
        (B, 3) m/s.
    """
    count = len(problem.start)
    # Row b * UPWARD_SAMPLES + h is target b with the h-th upward speed.
    many = problem.select_rows(np.repeat(np.arange(count), UPWARD_SAMPLES))
    top = problem.ball.gravity * problem.seconds * (0.5 + 0.1 * problem.seconds) + 1.0
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
    short = np.where(bounces == problem.bounces, vector_length(place - many.target), np.inf)
    best = np.arange(count) * UPWARD_SAMPLES + np.argmin(short.reshape(count, UPWARD_SAMPLES), axis=1)
    return np.column_stack([level, upward])[best]


def choose_times(problem: AimProblem, loft: float | None, initial_seconds: np.ndarray | None) -> np.ndarray:
    """Choose flight times with the slowest launch, or the launch closest to an angle, by the estimates.

    Args:
        problem: the targets (B); their seconds are ignored.
        loft: rad above the horizon; None: the slowest launch.
        initial_seconds: (B,) s, only times near these are tried; None: those near the best of FREE_TIMES.
    Returns:
        (B,) s.
    """
    coarse = initial_seconds
    if coarse is None:
        coarse = _choose_best_time(problem, np.tile(FREE_TIMES, (len(problem.start), 1)), loft)
    return _choose_best_time(problem, coarse[:, None] * np.linspace(0.9, 1.1, 11), loft)


def _choose_best_time(problem: AimProblem, times: np.ndarray, loft: float | None) -> np.ndarray:
    """Choose the best (B,) s of each row of `times` (B, N) s."""
    count, each = times.shape
    timed = problem.select_rows(np.repeat(np.arange(count), each)).with_seconds(times.ravel())
    launch, found = estimate_launches(timed)
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
