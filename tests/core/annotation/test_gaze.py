"""Which way a body faces: the ball when it goes slowly, its way when it runs."""

import numpy as np
import pytest

from beyond_mocap.annotation.gaits import choose_directions, compute_heading_offset
from beyond_mocap.motion.track import Track, sample_track


def track_past(ball, speed=0.9, seconds=6.0):
    """A player who walks along +x, the ball lying at (2,) m."""
    times = np.arange(int(seconds * 25) + 1) / 25.0
    places = np.column_stack([speed * times, np.zeros(len(times))])
    lying = None if ball is None else np.tile([*ball, 0.11], (len(times), 1))
    return sample_track(Track(times, places, lying), 30.0)


@pytest.mark.parametrize("ball, degrees, word", [
    ((100.0, 0.0), 0, "front"), ((0.0, 100.0), 90, "right"), ((0.0, -100.0), -90, "left"), ((-100.0, 0.1), 180, "back"),
])
def test_a_slow_player_faces_the_ball(ball, degrees, word):
    offset = compute_heading_offset(track_past(ball, speed=0.7))
    away = np.degrees(offset[90]) - degrees
    assert abs((away + 180.0) % 360.0 - 180.0) < 5.0
    assert choose_directions(offset, 30.0)[90] == word


def test_the_faster_the_less_it_turns_aside():
    turned = [abs(compute_heading_offset(track_past((0.0, 1000.0), speed))[90]) for speed in (0.7, 1.4, 2.5, 4.0, 7.0)]
    assert all(a > b for a, b in zip(turned, turned[1:])) and turned[-1] == 0.0


def test_without_a_ball_or_with_it_at_the_feet_the_body_faces_its_way():
    assert not np.any(compute_heading_offset(track_past(None)))
    times = np.arange(151) / 25.0
    places = np.column_stack([0.9 * times, np.zeros(151)])
    dribbled = Track(times, places, np.column_stack([places + [0.0, 0.6], np.full(151, 0.11)]))
    assert np.abs(compute_heading_offset(sample_track(dribbled, 30.0))).max() < 1e-6


def test_directions_last():
    offset = np.where(np.arange(300) % 20 < 3, np.pi / 2, 0.0)
    assert set(choose_directions(offset, 30.0)) == {"front"}
