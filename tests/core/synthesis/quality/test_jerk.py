"""A planted jolt at a seam against smooth recordings."""

import numpy as np
import pytest

from beyond_mocap.synthesis.quality import movement

FPS = 30.0


def smooth(count=400, seed=1):
    """Two joints on slow curves: (T, 2, 3) m."""
    random = np.random.default_rng(seed)
    t = np.arange(count) / FPS
    waves = [np.sin(2 * np.pi * f * t[:, None, None] + random.uniform(0, 6, (2, 3))) for f in (0.3, 0.7, 1.1)]
    return 0.1 * sum(waves)


def test_jerk_is_the_third_derivative():
    t = np.arange(50) / FPS
    positions = np.zeros((50, 3, 3))
    positions[:, 1, 2] = 5.0 * t**3
    np.testing.assert_allclose(movement.compute_jerk(positions, FPS), 30.0, rtol=1e-6)
    assert len(movement.compute_jerk(positions[:3], FPS)) == 0


@pytest.mark.parametrize("step", [0.0, 0.05])
def test_a_jolt_raises_the_ratio_only_at_its_seam(step):
    speed = np.full(400, 1.5)
    real = movement.compute_real_p95(*movement.collect_uncut_windows(movement.compute_jerk(smooth(), FPS), speed))
    positions = smooth(seed=2)
    positions[200:] += [0.0, step, 0.0]
    values = movement.compute_jerk(positions, FPS)
    ratios = movement.compute_transition_ratios(values, np.array([100, 200, 300]), speed, real)
    assert ratios[[0, 2]].max() < 2.0
    # the third differences of a step s are s, -2 s, s
    if step:
        assert ratios[1] == pytest.approx(2 * step * FPS**3 / real[1], rel=0.1)
        assert movement.compute_rest_ratios(values, np.array([100, 200, 300]), speed, real).max() < 2.0
        assert movement.compute_rest_ratios(values, np.array([100, 300]), speed, real).max() == pytest.approx(ratios[1])
    else:
        assert ratios[1] < 2.0


@pytest.mark.parametrize("seam", [192, 208])
def test_the_window_reaches_eight_frames_each_way(seam):
    positions = np.zeros((400, 1, 3))
    positions[200:] += 0.1
    values = movement.compute_jerk(positions, FPS)
    real = np.ones(5)
    assert movement.compute_transition_ratios(values, np.array([seam]), np.zeros(400), real) > 0
    beyond = seam + 3 * np.sign(seam - 200)
    assert movement.compute_transition_ratios(values, np.array([beyond]), np.zeros(400), real) == 0


def test_real_windows_are_whole_and_by_speed():
    values = np.concatenate([np.full(100, 10.0), np.full(100, 50.0)])
    speed = np.concatenate([np.full(102, 0.5), np.full(101, 2.5)])
    windows, at = movement.collect_uncut_windows(values, speed)
    assert len(windows) == len(at) == 200 - 16
    real = movement.compute_real_p95(windows, at)
    assert real[2] == 50.0 and real[3] == real[4] == 50.0 and real[0] <= 50.0
    assert len(movement.collect_uncut_windows(values[:10], speed[:13])[0]) == 0


def test_no_seams_no_ratios():
    assert len(movement.compute_transition_ratios(np.ones(50), np.array([], int), np.ones(53), np.ones(5))) == 0
    assert len(movement.compute_transition_ratios(np.zeros(0), np.array([1]), np.ones(2), np.ones(5))) == 0
