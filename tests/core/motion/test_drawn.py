"""Drawn tracks: exact lengths and times of planted lines and speeds, and every mistake told in a line."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.track.line_track import SAMPLE_RATE, build_line_track, build_moving_track

STRAIGHT = np.column_stack([np.linspace(0.0, 20.0, 201), np.zeros(201)])


def test_a_steady_speed_takes_way_over_speed_and_ends_at_the_end():
    track = build_line_track(STRAIGHT, [0, 20], [2.5, 2.5], [1, 1], start=3.0)
    assert track.times[0] == 3.0 and track.times[-1] == pytest.approx(11.0)
    np.testing.assert_allclose(np.diff(track.times), 1 / SAMPLE_RATE, rtol=1e-6)
    np.testing.assert_allclose(
        track.positions, np.column_stack([2.5 * (track.times - 3.0), 0 * track.times]), atol=1e-9
    )


def test_speeds_change_evenly_and_are_met_at_the_points():
    track = build_line_track(STRAIGHT, [0, 8, 20], [0.0, 4.0, 2.0], [0, 0, 0])
    times = 2 * 8 / 4 + 2 * 12 / 6
    assert track.times[-1] == pytest.approx(times)
    np.testing.assert_allclose(np.interp(4.0, track.times, track.positions[:, 0]), 8.0, atol=1e-3)
    speed = np.gradient(track.positions[:, 0], track.times)
    np.testing.assert_allclose(np.interp([2.0, 4.0 - 0.1, 6.0], track.times, speed), [2.0, 3.9, 3.0], atol=0.06)


def test_a_stop_is_waited_at():
    track = build_line_track(STRAIGHT, [0, 8, 20], [4.0, 0.0, 4.0], [9, 1.5, 9])
    waited = np.abs(track.positions[:, 0] - 8.0) < 1e-9
    assert track.times[-1] == pytest.approx(4 + 1.5 + 6) and 1.4 < waited.sum() / SAMPLE_RATE < 1.6


def test_a_curve_is_gone_along_at_its_own_length():
    angle = np.linspace(0.0, np.pi, 2000)
    track = build_line_track(5 * np.column_stack([np.cos(angle), np.sin(angle)]), [0, 5 * np.pi], [3.0, 3.0], [0, 0])
    assert track.times[-1] == pytest.approx(5 * np.pi / 3.0, abs=1e-4)
    steps = np.linalg.norm(np.diff(track.positions, axis=0), axis=1)
    assert np.ptp(steps) < 1e-4


@pytest.mark.parametrize("speeds, part", [
    ([0.0, 0.0], "speed 0 at both points 1 and 2"), ([1.0, 12.5], "12.5 m/s"), ([1.0, np.nan], "an invalid speed"),
    ([-1.0, 1.0], "an invalid speed"), ([1e-5, 1e-5], "an hour at most"),
])
def test_speeds_that_make_no_sense_are_told(speeds, part):
    with pytest.raises(InputError, match="curve Way") as caught:
        build_line_track(STRAIGHT, [0, 20], speeds, [1, 1], name="curve Way")
    assert part in str(caught.value)


def test_lines_that_are_none_are_told():
    for line, arc in ((STRAIGHT[:2], [0, 0.1]), (STRAIGHT[:1], [0]), (STRAIGHT, [0, 5, 5, 20])):
        with pytest.raises(InputError):
            build_line_track(line, arc, [1.0] * len(arc), [0.0] * len(arc))


def test_what_moves_is_sampled_and_what_flies_is_told():
    times = np.arange(0, 61) / 60.0
    track = build_moving_track(times, np.column_stack([2 * times, times]))
    assert len(track) == 26 and np.allclose(track.positions[-1], [2, 1])
    for wrong in ((times[:1], np.zeros((1, 2))), (times, np.column_stack([20 * times, times]))):
        with pytest.raises(InputError):
            build_moving_track(*wrong)
