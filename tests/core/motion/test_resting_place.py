"""Where a slow body rests: stands are found as by trying every stretch, and a fast track stays as it is."""

import numpy as np
import pytest

from beyond_mocap.motion.track import Track, sample_track
from beyond_mocap.motion.track.resting_place import MOST_DISTANCE, find_rests, measure_rest_lengths, relax_track

FPS = 30.0


def longest_by_trying(positions, first, half_diagonal):
    for end in range(len(positions), first, -1):
        size = np.ptp(positions[first:end], axis=0)
        if np.hypot(*size) <= 2.0 * half_diagonal:
            return end - first


def test_the_lengths_of_all_stretches():
    walk = np.cumsum(np.random.default_rng(4).normal(0.0, 0.03, (200, 2)), axis=0)
    found = measure_rest_lengths(walk, 0.1)
    assert found.tolist() == [longest_by_trying(walk, first, 0.1) for first in range(len(walk))]


def test_lengths_below_the_least_that_counts_may_be_left_out():
    walk = np.cumsum(np.random.default_rng(4).normal(0.0, 0.02, (600, 2)), axis=0)
    whole, found = measure_rest_lengths(walk, 0.1), measure_rest_lengths(walk, 0.1, 18)
    assert 10 < np.count_nonzero(whole >= 18) < 590
    assert np.array_equal(np.where(whole >= 18, whole, 0), np.where(found >= 18, found, 0))


def test_stands_do_not_overlap_and_fit_their_box():
    walk = np.cumsum(np.random.default_rng(5).normal(0.0, 0.01, (900, 2)), axis=0)
    rests = find_rests(walk, FPS)
    assert len(rests) > 1 and all(a[1] <= b[0] for a, b in zip(rests, rests[1:]))
    for first, end in rests:
        assert end - first >= 0.6 * FPS and np.hypot(*np.ptp(walk[first:end], axis=0)) <= 0.2


def track_at(speed, noise=0.03, seconds=12.0):
    """Along X at speed(t), with the slow wander of a tracking system."""
    times = np.arange(0.0, seconds, 0.04)
    random = np.random.default_rng(2)
    wander = np.cumsum(random.normal(0.0, noise / 5.0, (len(times), 2)), axis=0)
    places = np.column_stack([np.cumsum(speed(times) * 0.04), np.zeros(len(times))]) + wander
    return sample_track(Track(times, places), FPS)


def test_a_standing_player_rests():
    relaxed = relax_track(track_at(lambda times: np.zeros(len(times)), noise=0.02))
    assert np.mean(relaxed.speed < 0.02) > 0.6


def test_a_fast_track_stays_as_it_is():
    track = track_at(lambda times: np.full(len(times), 3.0))
    assert np.array_equal(relax_track(track).positions, track.positions)


@pytest.mark.parametrize("seed", range(3))
def test_the_body_stays_near_its_track(seed):
    random = np.random.default_rng(seed)
    places = np.cumsum(random.normal(0.0, 0.04, (400, 2)), axis=0)
    track = sample_track(Track(np.arange(400) / 25.0, places), FPS)
    relaxed = relax_track(track)
    assert np.linalg.norm(relaxed.positions - track.positions, axis=1).max() <= MOST_DISTANCE + 1e-9
    assert np.all(relaxed.leeway > 0.0) and len(relaxed) == len(track)
