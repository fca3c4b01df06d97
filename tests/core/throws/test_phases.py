"""Phases of movements whose speed is known."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks import phases

FPS = 30.0


def along(speed):
    """A hand (T, 3) that moves along a line with these speeds (T - 1,)."""
    way = np.concatenate([[0.0], np.cumsum(speed)]) / FPS
    return way[:, None] * np.array([0.6, 0.0, 0.8])


def throw(wind_up=30, after=25, seed=0):
    """A hand's way: a wind-up, a fast swing of fixed length, and its end; and the release."""
    swing = np.exp(-0.5 * ((np.arange(40) - 25) / 5.0) ** 2) * 15
    slow = 0.5 + 0.3 * np.sin(np.arange(wind_up) / wind_up * np.pi)
    return along(np.concatenate([slow, swing, np.full(after, 0.3)])), wind_up + 25.4


def test_the_motion_phase_is_the_travelled_part():
    got = phases.compute_motion_phase(along(np.ones(60)), 40.0, FPS)
    expected = np.where(np.arange(61) < 40, 0.66 * np.arange(61) / 40, 0.66 + 0.34 * (np.arange(61) - 40) / 20)
    np.testing.assert_allclose(got, expected, atol=1e-12)


@pytest.mark.parametrize("release", [0.0, 7.0, 12.37, 59.99, 60.0])
def test_the_release_has_its_phase_at_fractional_frames(release):
    got = phases.compute_motion_phase(along(np.full(60, 2.0)), release, FPS)
    assert got[-1] == pytest.approx(1.0 if release < 60 else 0.66)
    assert got[0] == pytest.approx(0.0 if release > 0 else 0.66)
    for frame in {int(release), min(int(release) + 1, 60)}:
        early, late = 0.66 * frame / max(release, 1), 0.66 + 0.34 * (frame - release) / max(60 - release, 1e-9)
        assert got[frame] == pytest.approx(early if frame < release else late)
    assert np.all(np.diff(got) > 0)


def test_a_still_limb_goes_by_time():
    np.testing.assert_allclose(phases.compute_motion_phase(np.ones((11, 3)), 5.0, FPS)[:6], 0.66 * np.arange(6) / 5)


def test_one_frame_has_a_phase():
    assert phases.compute_motion_phase(np.zeros((1, 3)), 0.0, FPS) == pytest.approx(0.66)


def test_the_distance_phase_is_clipped():
    got = phases.compute_distance_phase(np.array([0.1, 0.5, 0.75, 1.0, 1.2]), (0.5, 1.0))
    np.testing.assert_allclose(got, [0, 0, 0.5, 1, 1])


def test_warping_gives_what_looks_alike_one_phase():
    """The swing begins 17 frames before the release in all throws, however long the wind-up: warped phases know it."""
    made = [throw(wind_up) for wind_up in (15, 25, 35, 50)]
    reference = phases.compute_reference_curve(made, FPS)
    warped, plain = [], []
    for effector, release in made:
        at = np.arange(len(effector))
        warped.append(np.interp(release - 10, at, phases.compute_warped_phase(effector, release, FPS, reference)))
        by_time = np.where(at < release, 0.66 * at / release, 1.0)
        plain.append(np.interp(release - 10, at, by_time))
    assert np.ptp(warped) < 0.5 * np.ptp(plain)


def test_warped_phases_rise_from_0_to_1_and_pin_the_release():
    made = [throw(wind_up, after) for wind_up, after in ((15, 40), (30, 20), (60, 5))]
    reference = phases.compute_reference_curve(made, FPS)
    for effector, release in made:
        got = phases.compute_warped_phase(effector, release, FPS, reference)
        assert got[0] == 0 and got[-1] == pytest.approx(1) and np.all(np.diff(got) > 0)
        before = int(release)
        assert got[before] < 0.66 < got[before + 1]


def test_warp_finds_a_planted_shift():
    moments = np.linspace(0, 1, 100)
    bump = np.exp(-0.5 * ((moments - 0.5) / 0.06) ** 2)
    early = np.exp(-0.5 * ((moments - 0.4) / 0.06) ** 2)
    assert np.interp(0.4 * 99, np.arange(100), phases.align_curves(early, bump)) == pytest.approx(0.5 * 99, abs=2)
    np.testing.assert_allclose(phases.align_curves(bump, bump), np.arange(100), atol=1e-9)


@pytest.mark.parametrize("effector", [np.zeros((0, 3)), np.zeros((4, 2)), np.full((4, 3), np.nan)])
def test_what_is_no_way_is_refused(effector):
    with pytest.raises(InputError, match="phase"):
        phases.compute_motion_phase(effector, 1.0, FPS)
