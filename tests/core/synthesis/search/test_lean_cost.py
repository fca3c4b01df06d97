"""What a track asks a body to lean, and that pieces which lean otherwise cost more."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion.lean import MOST_ACCELERATION
from beyond_mocap.motion.supports import GRAVITY
from beyond_mocap.motion.track import sample_track
from beyond_mocap.synthesis.search.candidate_index import SLOT
from beyond_mocap.synthesis.search.cost_weights import Weights
from beyond_mocap.synthesis.search.lean_cost import FREE_LEAN, compute_lean_cost, compute_wanted_lean
from beyond_mocap.synthesis.search.path_costs import PathCosts

FPS = 30.0
MIDDLE = slice(60, 180)
ONLY_LEAN = replace(Weights(**{name: 0.0 for name in vars(Weights())}), lean=1.0)


def stop_after(seconds, speed, brake):
    return lambda times: np.clip(speed - brake * (times - seconds), 0.0, speed)


@pytest.mark.parametrize("rate", [0.6, -0.6])
def test_a_circle_asks_for_a_lean_inward(track_of, rate):
    wanted, counts = compute_wanted_lean(sample_track(track_of(5.0, turn=rate), FPS))
    assert wanted[MIDDLE] == pytest.approx(np.tile([0.0, 5.0 * rate / GRAVITY], (120, 1)), abs=0.015)
    assert np.all(counts[MIDDLE] == 1.0)


def test_a_stop_asks_for_a_lean_back_and_a_start_for_one_ahead(track_of):
    wanted, _ = compute_wanted_lean(sample_track(track_of(stop_after(3.0, 6.0, 2.0)), FPS))
    assert wanted[120:150] == pytest.approx(np.tile([-2.0 / GRAVITY, 0.0], (30, 1)), abs=0.03)
    wanted, _ = compute_wanted_lean(sample_track(track_of(lambda times: np.clip(2.0 * (times - 2.0), 0.0, 6.0)), FPS))
    assert wanted[90:120] == pytest.approx(np.tile([2.0 / GRAVITY, 0.0], (30, 1)), abs=0.03)
    assert np.abs(wanted[200:230]).max() < 0.01


def test_no_more_is_asked_for_than_legs_answer(track_of):
    wanted, _ = compute_wanted_lean(sample_track(track_of(7.0, turn=1.5), FPS))
    assert np.linalg.norm(wanted[MIDDLE], axis=1) == pytest.approx(MOST_ACCELERATION / GRAVITY, abs=1e-6)


def test_small_players_lean_as_they_are_accelerated_in_their_own_size(order, track_of):
    def measure(**plan):
        request = order(track=track_of(4.0, turn=0.6), **plan)
        return compute_wanted_lean(request.track, request.size)[0][MIDDLE, 1], request.size

    (tall, one), (small, size) = measure(), measure(height=1.4)
    assert one == 1.0 and size < 0.9 and small == pytest.approx(tall, abs=1e-6)


@pytest.mark.parametrize("speed, share", [(0.0, 0.0), (1.4, 0.0), (1.7, 0.0), (2.3, 0.5), (3.0, 1.0)])
def test_the_lean_of_slow_bodies_does_not_count(track_of, speed, share):
    _, counts = compute_wanted_lean(sample_track(track_of(speed, turn=0.4), FPS))
    assert counts[MIDDLE] == pytest.approx(np.full(120, share), abs=0.03)


def test_a_lean_that_is_nearly_right_costs_nothing():
    lean = np.array([[0.1, 0.3], [0.1, 0.3 + FREE_LEAN], [0.0, 0.0], [0.1, -0.3]], dtype=np.float32)
    cost = compute_lean_cost(lean, np.array([0.1, 0.3]))
    assert cost == pytest.approx([0.0, 0.0, np.hypot(0.1, 0.3) - FREE_LEAN, 0.6 - FREE_LEAN], abs=1e-6)


@pytest.mark.parametrize("rate", [0.9, -0.9])
def test_a_piece_that_leans_as_the_bend_asks_is_chosen(library, order, track_of, rate):
    costs = PathCosts(library, order(track=track_of(3.0, turn=rate)), ONLY_LEAN)
    everything = len(costs.index.by_speed)
    _, frame, cost = costs.find_cheapest(90, 90 + SLOT, everything, 1)
    leans = costs.index.lean[:, 1]
    assert np.ptp(leans) > 0.2 and leans[frame[0]] * rate > 0.0
    assert abs(leans[frame[0]] - 3.0 * rate / GRAVITY) < np.median(np.abs(leans - 3.0 * rate / GRAVITY)) - 0.05
    _, _, walking = PathCosts(library, order(track=track_of(1.4, turn=rate)), ONLY_LEAN).find_cheapest(
        90, 90 + SLOT, everything, everything)
    assert not walking[np.isfinite(walking)].any()


def test_leans_cost_by_how_far_they_are_in_any_direction():
    wanted = np.array([0.1, -0.2])
    away = np.array([[0.3, 0.0], [0.0, 0.3], [-0.18, 0.24], [0.0, 0.0], [0.03, 0.04]])
    cost = compute_lean_cost((wanted + away).astype(np.float32), wanted)
    assert np.allclose(cost, [0.3 - FREE_LEAN] * 3 + [0.0, 0.0], atol=1e-6) and cost.dtype == np.float32
