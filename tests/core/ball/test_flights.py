"""Flights between touches from their samples: planted launches come back, with and without heights."""

import numpy as np
import pytest

from beyond_mocap.ball.batch import simulate_trajectories
from beyond_mocap.ball.physics import FOOTBALL
from beyond_mocap.ball.tracked.fit import collect_stretches, fit_launches, simulate_coarse_trajectories
from beyond_mocap.ball.tracked.solve import solve_samples

STEP = 0.04


def planted(velocities, seconds, spins, noise=0.03, seed=1):
    """(times, positions, spans, truth): launches one after the other from the origin, with pauses."""
    random = np.random.default_rng(seed)
    grid = np.arange(int(seconds / STEP) + 1) * STEP
    places, _ = simulate_trajectories(np.array([0.0, 0.0, 0.11]), velocities, spins, FOOTBALL, grid)
    times = np.concatenate([k * (seconds + 1.0) + grid for k in range(len(places))])
    positions = places.reshape(-1, 3) + random.normal(0.0, noise, (len(times), 3))
    spans = []
    for k, place in enumerate(places):
        start = k * (seconds + 1.0)
        spans.append((start, start + grid[-1], place[0].copy(), place[-1].copy(), velocities[k] * [0.95, 0.95, 0.8]))
    return times, positions, spans, places


@pytest.mark.parametrize("heights", [True, False])
def test_planted_launches_come_back(heights):
    velocities = np.array([[18.0, 4.0, 9.0], [14.0, 0.0, 6.0], [12.0, -5.0, 0.0], [9.0, 9.0, 0.0]])
    times, positions, spans, places = planted(velocities, 1.6, np.zeros((4, 3)))
    if not heights:
        positions[:, 2] = np.nan
        for span in spans:
            for vector in span[2:]:
                vector[2] = np.nan
    every = np.ones(len(times), bool)
    found = fit_launches(collect_stretches(times, positions, every, every, spans))
    assert np.abs(found.velocity[:, :2] - velocities[:, :2]).max() < 0.6
    assert np.abs(found.velocity[:, 2] - velocities[:, 2]).max() < (0.5 if heights else 2.5)


def test_coarse_steps_go_where_the_physics_goes():
    random = np.random.default_rng(0)
    velocity = np.column_stack([random.normal(0.0, 9.0, (300, 2)), random.uniform(0.0, 9.0, 300)])
    place, spin = np.tile([0.0, 0.0, 0.11], (300, 1)), random.normal(0.0, 15.0, (300, 3))
    rough, _ = simulate_coarse_trajectories(place, velocity, spin, FOOTBALL, STEP, 25)
    fine, _ = simulate_trajectories(place, velocity, spin, FOOTBALL, np.arange(26) * STEP)
    off = np.linalg.norm(rough[:, -1] - fine[:, -1], axis=1)
    assert np.median(off) < 0.08
    assert np.percentile(off, 95) < 0.3


def test_a_pass_in_the_air_is_a_flight_with_its_bounce():
    velocities = np.array([[16.0, 3.0, 7.0]])
    grid = np.arange(56) * STEP
    places, _ = simulate_trajectories(np.array([0.0, 0.0, 0.11]), velocities, np.zeros(3), FOOTBALL, grid)
    way = places[0]
    still = 25
    ball = np.vstack([np.tile(way[0], (still, 1)), way, np.tile(way[-1] * [1, 1, 0] + [0, 0, 0.11], (still, 1))])
    ball += np.random.default_rng(2).normal(0.0, 0.03, ball.shape)
    times = np.arange(len(ball)) * STEP
    positions = np.stack([np.tile([-0.3, 0.0], (len(ball), 1)), np.tile(way[-1, :2] + [0.4, 0.0], (len(ball), 1))])
    solved = solve_samples(times, ball, positions, ["home_1", "home_2"])
    flights = [piece for piece in solved.pieces if piece.kind == "flight"]
    assert len(flights) == 1
    assert len(flights[0].bounces) >= 1
    assert abs(flights[0].positions[:, 2].max() - way[:, 2].max()) < 0.15
    assert np.abs(np.linalg.norm(flights[0].velocities[0]) - np.linalg.norm(velocities[0])) < 1.0
    kick = min(solved.touches, key=lambda touch: abs(touch.time - still * STEP))
    assert kick.player == "home_1" and kick.after[2] > 5.0
