"""Root, pelvis, surge and coverage against tracks whose answer is known."""

import numpy as np
import pytest

from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.quality import movement

FPS = 30.0


def path(seconds=20.0, speed=3.0):
    """A player on a wide curve: (T,) s and (T, 2) m."""
    times = np.arange(int(seconds * FPS) + 1) / FPS
    return times, np.stack([speed * times, 4.0 * np.sin(0.3 * times)], axis=-1)


def swaying(pelvis, times, amount=0.03):
    """The pelvis with a body's own sway of `amount` m at 1.9 Hz across its path."""
    return pelvis + np.stack([0 * times, amount * np.sin(2 * np.pi * 1.9 * times)], axis=-1)


def test_a_shifted_track_is_off_by_the_shift_everywhere():
    times, pelvis = path()
    error = movement.measure_root_error(pelvis, pelvis + [0.3, -0.4], FPS)
    np.testing.assert_allclose(error, 0.5, atol=1e-12)
    np.testing.assert_allclose(movement.measure_pelvis_error(pelvis, pelvis + [0.3, -0.4]), 0.5, atol=1e-12)


def test_the_window_takes_out_sway_and_only_sway():
    times, track = path()
    body = swaying(track, times)
    assert movement.measure_root_error(body, track, FPS).max() < 0.004
    assert movement.measure_pelvis_error(body, track).mean() == pytest.approx(0.03 * 2 / np.pi, rel=0.02)
    assert movement.measure_sway(body, FPS).mean() == pytest.approx(0.03 * 2 / np.pi, rel=0.1)


def test_the_window_does_not_punish_a_curve_that_both_follow():
    _, track = path(speed=8.0)
    assert movement.measure_root_error(track, track, FPS).max() == 0.0


def test_the_track_is_read_between_samples_and_without_outliers():
    times = np.arange(0.0, 5.0, 0.1)
    positions = np.stack([2.0 * times, times], axis=-1)
    positions[20] += 1.0
    flags = np.zeros(len(times), bool)
    flags[20] = True
    at = np.array([0.05, 1.95, 2.0, 2.05, 9.0])
    read = movement.interpolate_track(Track(times, positions, outlier=flags), at)
    np.testing.assert_allclose(read[:4], np.stack([2.0 * at[:4], at[:4]], axis=-1), atol=1e-12)
    np.testing.assert_allclose(read[4], positions[-1])
    assert movement.interpolate_track(Track(times, positions), at)[2, 0] == pytest.approx(5.0)


def test_travel_speed_and_its_classes():
    times, track = path(speed=3.3)
    straight = np.stack([3.3 * times, 0 * times], axis=-1)
    np.testing.assert_allclose(movement.measure_travel_speed(straight, FPS), 3.3, atol=1e-9)
    assert list(movement.classify_speed(np.array([0.0, 0.99, 1.0, 2.5, 3.3, 4.5, 9.0]))) == [0, 0, 1, 2, 3, 4, 4]


@pytest.mark.parametrize("amount", [0.0, 0.1, 0.4])
def test_surge_is_the_planted_speed_wobble(amount):
    times = np.arange(600) / FPS
    along = 3.0 * times - amount / (2 * np.pi * 2.5) * np.cos(2 * np.pi * 2.5 * times)
    turn = np.array([np.cos(0.7), np.sin(0.7)])
    surge = movement.measure_surge(along[:, None] * turn, FPS)
    assert np.sqrt(np.mean(surge**2)) == pytest.approx(amount / np.sqrt(2), rel=0.06, abs=1e-9)


def test_class_rms_is_not_known_for_classes_with_few_values():
    values = np.concatenate([np.full(40, 0.1), np.full(50, 0.3)])
    classes = np.concatenate([np.zeros(40, int), np.full(50, 3)])
    np.testing.assert_allclose(movement.compute_class_rms(values, classes), [0.1, np.nan, np.nan, 0.3, np.nan])
    assert np.isnan(movement.compute_class_rms(values[:5], classes[:5])).all()


def test_speed_coverage_counts_too_fast_and_too_slow():
    wanted = np.concatenate([np.full(10, 0.2), np.full(20, 0.7), np.full(50, 3.0), np.full(20, 5.0)])
    assert movement.measure_speed_coverage(wanted, fastest=4.0, slowest=1.2) == {"above": 0.2, "below": 0.2}
    assert np.isnan(movement.measure_speed_coverage(wanted, 4.0, np.nan)["below"])


def test_one_frame_is_no_reason_to_fail():
    still = np.zeros((1, 2))
    assert movement.measure_root_error(still, still, FPS) == 0
    assert movement.measure_travel_speed(still, FPS) == 0
    assert movement.measure_surge(still, FPS) == 0
