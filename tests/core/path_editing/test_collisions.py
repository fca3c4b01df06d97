"""Collisions with planted truth: where, when and how near, worked out by hand."""

import numpy as np
import pytest

from beyond_mocap.path_editing.collisions import compute_least_gaps, find_collisions


def moving(times, start, velocity):
    """Places (T, 3) of a body at a constant velocity."""
    return np.asarray(start, float) + np.asarray(times)[:, None] * np.asarray(velocity, float)


def test_a_meeting_head_on_is_found_to_the_last_digit():
    times = np.linspace(0.0, 10.0, 301)
    places = np.stack([moving(times, (-10, 0, 0), (2, 0, 0)), moving(times, (10, 0.3, 0), (-2, 0, 0))])
    [met] = find_collisions(times, places)
    half = np.sqrt(0.6**2 - 0.3**2) / 4.0  # metres of the way at 4 m/s
    assert (met.first, met.second) == (0, 1)
    assert [met.start, met.end, met.time, met.gap] == pytest.approx([5 - half, 5 + half, 5.0, 0.3], abs=1e-9)
    assert met.place == pytest.approx((0.0, 0.15, 0.0), abs=1e-9)


def test_a_meeting_between_two_frames_is_found():
    times = np.array([0.0, 1.0])
    places = np.stack([moving(times, (-5, 0, 0), (10, 0, 0)), moving(times, (5, 0.1, 0), (-10, 0, 0))])
    [met] = find_collisions(times, places)
    assert [met.time, met.gap] == pytest.approx([0.5, 0.1])
    assert met.end - met.start == pytest.approx(2 * np.sqrt(0.6**2 - 0.1**2) / 20.0)


@pytest.mark.parametrize("beside, found", [(0.59, 1), (0.61, 0)])
def test_the_distance_decides(beside, found):
    times = np.linspace(0.0, 10.0, 11)
    places = np.stack([moving(times, (-10, 0, 0), (2, 0, 0)), moving(times, (10, beside, 0), (-2, 0, 0))])
    assert len(find_collisions(times, places)) == found


@pytest.mark.parametrize("above, found", [(0.5, 1), (1.7, 1), (1.9, 0), (4.0, 0)])
def test_whoever_is_on_a_bridge_meets_nobody_below(above, found):
    times = np.linspace(0.0, 10.0, 31)
    places = np.stack([moving(times, (-10, 0, 0), (2, 0, 0)), moving(times, (10, 0, above), (-2, 0, 0))])
    assert len(find_collisions(times, places)) == found


def test_the_gap_of_upright_capsules():
    """Up a shaft: apart while one's head is below the other's feet by the distance, together before."""
    still, rising = np.zeros((1, 11, 3)), np.zeros((1, 11, 3))
    rising[0, :, 2] = np.linspace(3.0, 1.5, 11)
    assert compute_least_gaps(still, rising, 0.6, 1.8)[0] == pytest.approx(1.5 - 1.2)
    rising[0, :, 0] = 0.4
    assert compute_least_gaps(still, rising, 0.6, 1.8)[0] == pytest.approx(np.hypot(0.3, 0.4))


def test_a_falling_body_enters_and_leaves_at_exact_times():
    times = np.array([0.0, 1.0])
    places = np.zeros((2, 2, 3))
    places[1, :, 2] = 6.0, -6.0
    [met] = find_collisions(times, places)
    assert [met.start, met.end] == pytest.approx([(6.0 - 1.8) / 12.0, (6.0 + 1.8) / 12.0])
    assert met.gap == 0.0


def test_walking_together_is_one_collision_and_parting_ends_it():
    times = np.linspace(0.0, 10.0, 301)
    first = moving(times, (0, 0, 0), (1, 0, 0))
    second = moving(times, (0.3, 0, 0), (1, 0, 0))
    second[150:, 1] = (times[150:] - times[150]) * 2.0
    [met] = find_collisions(times, np.stack([first, second]))
    assert met.start == 0.0
    assert met.end == pytest.approx(5.0 + np.sqrt(0.27) / 2.0)


def test_a_motion_that_starts_again_does_not_sweep_through_others():
    times = np.linspace(0.0, 10.0, 301)
    first = moving(times, (0, 0, 0), (2, 0, 0))
    first[150:] -= (10.0, 0.0, 0.0)
    post = np.zeros((301, 3)) + (3.0, 0.0, 0.0)
    met = find_collisions(times, np.stack([first, post]))
    assert [round(hit.time, 6) for hit in met] == [1.5, 6.5]


def test_bodies_at_one_spot_all_the_time():
    times = np.linspace(0.0, 1.0, 5)
    [met] = find_collisions(times, np.zeros((2, 5, 3)))
    assert (met.start, met.end, met.gap) == (0.0, 1.0, 0.0)
