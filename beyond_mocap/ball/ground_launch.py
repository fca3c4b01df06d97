"""Solve level launches of balls that slide and roll along the ground to a target.

Such a ball moves on a line, so only its launch speed is unknown: a bisection finds it. Where the time is free, a table
of distances and remaining speeds gives the time that leaves the ball a requested speed at the target.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from . import batch
from .aim_problem import HIT_TOLERANCE, AimProblem, AimResult
from .physics import Ball, vector_length


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
        InputError: as for `aim.solve_launches`.
    """
    problem = AimProblem.from_arguments(start, target, ball, seconds=seconds, bounces=0, spin=None, ground=ground)
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


def _solve_ground_speeds(problem: AimProblem, distance: np.ndarray) -> np.ndarray:
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
