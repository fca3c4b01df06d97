"""Fitted paths: planted ways come back, the sway of steps stays out of them."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import contacts
from beyond_mocap.motion.motion import place_motion
from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.path_editing.path_frame import fit_path, fit_polynomial, fit_spline, project_to_ground
from beyond_mocap.synthetic.gait import build_gait

TIMES = np.arange(600) / 60.0
WAY = np.stack([1.4 * TIMES, 2.0 * np.sin(0.4 * TIMES), 0.1 * TIMES], axis=1)
SWAY = np.stack([0.02 * np.sin(2 * np.pi * 1.9 * TIMES), 0.03 * np.sin(2 * np.pi * 0.95 * TIMES), 0 * TIMES], axis=1)


@pytest.mark.parametrize("degree", (1, 2, 13, 45))
def test_a_planted_polynomial_comes_back_at_any_degree(degree):
    random = np.random.default_rng(degree)
    times = np.arange(30_000) / 60.0
    scaled = 2.0 * times / times[-1] - 1.0
    planted = np.polynomial.legendre.legval(scaled, random.normal(size=(degree + 1, 3))).T
    path = fit_polynomial(planted, times, degree)
    assert np.abs(path.at(times) - planted).max() < 1e-11


def test_a_degree_too_high_is_refused():
    for degree in (0, 5, -1):
        with pytest.raises(InputError, match="degree"):
            fit_polynomial(WAY[:5], TIMES[:5], degree)


def test_the_spline_keeps_the_way_and_leaves_the_sway():
    path = fit_spline(WAY + SWAY, TIMES)
    inner = slice(60, -60)  # the ends are known from one side only
    assert np.abs(path.at(TIMES) - WAY)[inner].max() < 0.01


def test_a_line_is_its_own_fit():
    line = TIMES[:, None] * [1.0, -0.5, 0.2] + 1e5
    assert np.abs(fit_spline(line, TIMES).at(TIMES) - line).max() < 1e-8


@pytest.mark.parametrize("height, floor", [(0.0, 0.0), (0.03, 0.0), (2.0, 2.0), (-0.5, -0.5)])
def test_the_path_of_a_flat_walk_lies_on_its_ground(height, floor):
    """A floor at height 0 is where recordings have it; toe joints are some centimetres over it."""
    motion = place_motion(build_gait(1.4, 4.0, 30.0), offset=(0.0, 0.0, height))
    assert contacts.estimate_recorded_floor(motion)[0] == pytest.approx(floor, abs=0.025)
    standing = contacts.detect_heel_toe_contacts(motion)
    places = project_to_ground(motion, standing)
    assert np.ptp(places[:, 2]) == 0.0 and abs(places[0, 2] - contacts.estimate_recorded_floor(motion)[0]) < 1e-9
    for path in (fit_path(motion, standing), fit_path(motion, standing, "polynomial", 5)):
        assert path.domain == pytest.approx((0.0, motion.duration))
        assert np.linalg.norm(path.at(np.arange(len(motion)) / 30.0) - places, axis=1).max() < 0.1


@pytest.mark.parametrize(
    "places, times", [(WAY[:1], TIMES[:1]), (WAY[:3], TIMES[[0, 0, 1]]), (WAY[:3] * np.nan, TIMES[:3])]
)
def test_what_cannot_be_fitted_is_refused(places, times):
    with pytest.raises(InputError):
        fit_spline(places, times)


def test_a_sharp_turn_is_followed():
    """Turns back at 4 m/s, as hard as a foot can push (8 m/s^2): off by a hand where it turns, and smooth again
    soon."""
    speed = np.clip(8.0 * (TIMES - 5.0), -4.0, 4.0)
    line = np.stack([np.cumsum(speed) / 60.0, 0 * TIMES, 0 * TIMES], axis=1)
    path = fit_spline(line + SWAY, TIMES)
    off = np.linalg.norm(path.at(TIMES) - line - SWAY, axis=1)
    assert off.max() < 0.12
    away = (np.abs(TIMES - 5.0) > 2.0) & (TIMES > 1) & (TIMES < 9)
    assert np.abs(path.at(TIMES)[away, 1]).max() < 0.01


def test_the_heading_of_a_fitted_walk_does_not_wobble():
    yaw = np.arctan2(*fit_spline(WAY + SWAY, TIMES).at(TIMES, 1).T[1::-1])
    truth = np.arctan2(np.gradient(WAY[:, 1]), np.gradient(WAY[:, 0]))
    assert np.degrees(np.abs(yaw - truth))[60:-60].max() < 1.5


@pytest.mark.parametrize("slope", (0.3, -0.2))
def test_the_ground_under_a_walk_up_a_hill_rises_with_it(slope):
    motion = build_gait(1.4, 6.0, 30.0)
    standing = contacts.detect_heel_toe_contacts(motion)
    floor = contacts.estimate_recorded_floor(motion)[0]
    root = motion.root_positions.copy()
    root[:, 2] += slope * (root[:, 0] - root[0, 0])
    hill = replace(motion, root_positions=root)
    truth = floor + slope * (root[:, 0] - root[0, 0])
    assert np.abs(project_to_ground(hill, standing)[:, 2] - truth).max() < 0.12
    path = fit_path(hill, standing)
    times = np.arange(len(hill)) / 30.0
    assert np.abs(path.at(times)[:, 2] - truth)[15:-15].max() < 0.08


@pytest.mark.parametrize("frames, degree", ((90, 45), (360, 120), (30, 29)))
def test_a_high_degree_does_not_swing_between_few_frames(frames, degree):
    motion = build_gait(1.4, frames / 30.0, 30.0).frames(0, frames)
    path = fit_path(motion, contacts.detect_heel_toe_contacts(motion), "polynomial", degree)
    places = path.at(np.arange(frames) / 30.0)
    assert ArcLength(path).length < 1.03 * np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
    assert np.linalg.norm(places - project_to_ground(motion, contacts.detect_heel_toe_contacts(motion)),
                          axis=1).max() < 0.02
