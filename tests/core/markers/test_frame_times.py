"""Frames taken at whole milliseconds are found from the markers themselves, and put at even times."""

import numpy as np
import pytest

from beyond_mocap.markers.trial import MarkerTrial, estimate_frame_times, resample_evenly

LABELS = tuple(f"M{i}" for i in range(12))


def places(times, seed=3):
    """(T, M, 3) m of twelve markers on a swinging body, at any times."""
    rng = np.random.default_rng(seed)
    size, rate, phase = rng.uniform(0.1, 0.6, (12, 3)), rng.uniform(0.5, 2.5, (12, 3)), rng.uniform(0, 6, (12, 3))
    return size * np.sin(2 * np.pi * rate * times[:, None, None] + phase) + rng.uniform(0, 2, (12, 3))


def trial(times, fps, noise=0.0003):
    seen = places(times) + np.random.default_rng(1).normal(0.0, noise, (len(times), 12, 3))
    return MarkerTrial(labels=LABELS, positions=seen, fps=fps)


@pytest.mark.parametrize("fps, phase", [(360.0, 0.0), (360.0, 0.5), (240.0, 0.3), (300.0, 0.7)])
def test_whole_milliseconds_are_found_and_corrected(fps, phase):
    even = np.arange(600) / fps
    real = np.floor(even * 1000 + phase) / 1000
    recorded = trial(real, fps)
    found = estimate_frame_times(recorded)
    assert np.allclose(np.diff(found), np.diff(real), atol=1e-9)
    shift = np.mean(real - even)  # what the clock is late on the whole cannot be known
    truth = places(even + shift)
    before = np.sqrt(np.mean((recorded.positions - truth) ** 2))
    after = np.sqrt(np.mean((resample_evenly(recorded).positions - truth) ** 2))
    assert after < 0.4 * before
    assert "whole milliseconds" in resample_evenly(recorded).notes[-1]


@pytest.mark.parametrize("fps", [360.0, 250.0, 100.0, 50.0])
def test_even_frames_stay(fps):
    recorded = trial(np.arange(600) / fps, fps)
    assert estimate_frame_times(recorded) is None
    assert resample_evenly(recorded) is recorded


def test_what_is_not_seen_stays_so():
    fps, even = 360.0, np.arange(600) / 360.0
    recorded = trial(np.floor(even * 1000) / 1000, fps)
    positions = recorded.positions.copy()
    positions[100:180, 2] = np.nan
    positions[:, 5] = np.nan
    mended = resample_evenly(recorded.with_positions(positions))
    assert mended.notes
    assert np.array_equal(np.isfinite(mended.positions), np.isfinite(positions))


def test_a_body_that_stands_still_tells_nothing():
    rng = np.random.default_rng(0)
    recorded = MarkerTrial(labels=LABELS, positions=rng.normal(0.0, 0.0003, (400, 12, 3)) + 1.0, fps=360.0)
    assert estimate_frame_times(recorded) is None
