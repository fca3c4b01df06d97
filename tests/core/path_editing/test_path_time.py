"""When riders are where: exact without wishes, and by the cited laws with them."""

import numpy as np
import pytest

from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.motion.path.path import PolynomialPath
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.path_editing.path_frame import Residuals
from beyond_mocap.path_editing.path_time import (
    PathProfile,
    StepOptions,
    build_timing_by_arc_length,
    build_timing_by_profile,
    build_timing_by_time,
    compute_required_length,
    compute_step_scale,
    resample_residuals,
)

ROWS, FPS, STEP = 301, 30.0, 0.05


@pytest.fixture
def residuals():
    index = np.arange(ROWS, dtype=float)
    rotations = np.zeros((ROWS, 1, 4))
    rotations[:, 0, 0], rotations[:, 0, 3] = np.cos(0.01 * index), np.sin(0.01 * index)
    step = np.where(index > 0, STEP, 0.0)
    place = np.stack([np.sin(0.1 * index), 0.0 * index, np.cos(0.1 * index)], axis=1)
    return Residuals(
        place=place, rotations=rotations, step=step, standing=np.zeros((ROWS, 2, 2), dtype=bool), frames=index,
        turn=0.02 * (index > 0), under=np.zeros((ROWS, 2)), up=np.tile([0.0, 0.0, 1.0], (ROWS, 2, 1)), fps=FPS,
        skeleton=Skeleton(("Hips",), (-1,), np.zeros((1, 3))),
    )  # fmt: skip


def level(length, slope=0.0, bend=0.0):
    arc = np.linspace(0.0, length, 400)
    return PathProfile(arc, np.full(400, slope), np.full(400, bend))


def own(residuals):
    return PathProfile(np.cumsum(residuals.step), np.zeros(len(residuals)), np.zeros(len(residuals)))


def test_rows_between_rows_are_smooth(residuals):
    at = np.arange(0.0, ROWS - 1, 0.37)
    rows = resample_residuals(residuals, at)
    inside = (at > 1) & (at < ROWS - 2)
    truth = np.stack([np.sin(0.1 * at), 0.0 * at, np.cos(0.1 * at)], axis=1)
    assert np.abs(rows.place - truth)[inside].max() < 1e-4
    assert np.abs(rows.rotations[:, 0, 3] - np.sin(0.01 * at))[inside].max() < 1e-7
    assert np.allclose(rows.frames, at) and np.allclose(np.cumsum(rows.step), at * STEP)


def test_whole_rows_are_the_rows_themselves(residuals):
    timing = build_timing_by_arc_length(residuals, 1.0, 0.0)
    assert resample_residuals(residuals, timing.at).rotations.tobytes() == residuals.rotations.tobytes()


def test_a_level_way_asks_for_nothing(residuals):
    timing = build_timing_by_profile(residuals, own(residuals), level(30.0), StepOptions(True, True, True), 1.0, 0.0,
                                     False)
    assert np.allclose(timing.at, np.arange(ROWS)) and np.allclose(timing.arc, np.cumsum(residuals.step))


def test_slopes_make_steps_shorter_and_quicker_at_one_speed(residuals):
    timing = build_timing_by_profile(residuals, own(residuals), level(30.0, slope=0.2), StepOptions(slopes=True), 1.0,
                                     0.0, False)
    pace, tempo = np.diff(timing.arc), np.diff(timing.at)
    assert np.allclose(pace, STEP, rtol=1e-3) and np.allclose(tempo, 1.0 / (1.0 - 0.4 * 0.2), rtol=1e-3)


@pytest.mark.parametrize("slope", [0.15, -0.05, -0.2])
def test_climbs_follow_toblers_function(residuals, slope):
    timing = build_timing_by_profile(residuals, own(residuals), level(30.0, slope=slope), StepOptions(climbs=True), 1.0,
                                     0.0, False)
    tobler = np.exp(-3.5 * abs(slope + 0.05)) / np.exp(-3.5 * 0.05)
    assert np.diff(timing.arc).mean() == pytest.approx(STEP * tobler, rel=1e-3)
    assert np.diff(timing.at).mean() == pytest.approx(np.sqrt(tobler), rel=1e-3)


@pytest.mark.parametrize("radius", [3.0, 1.0, 0.25])
def test_bends_follow_the_two_thirds_law(residuals, radius):
    """Speed goes with the third root of the radius below 2 m; steps and tempo share it."""
    timing = build_timing_by_profile(residuals, own(residuals), level(30.0, bend=1.0 / radius), StepOptions(bends=True),
                                     1.0, 0.0, False)
    law = min((radius / 2.0) ** (1.0 / 3.0), 1.0)
    assert np.diff(timing.arc).mean() == pytest.approx(STEP * law, rel=1e-3)
    assert np.diff(timing.at).mean() == pytest.approx(np.sqrt(law), rel=1e-3)


@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_by_time_the_whole_path_is_passed_within_the_motion(residuals, speed):
    """x = u^2 from u = 0 to 3: the place at a share of the time, not of the length."""
    path = PolynomialPath(np.array([[3.0, 0, 0], [4.5, 0, 0], [1.5, 0, 0]]), (0.0, 3.0))
    timing = build_timing_by_time(residuals, path, ArcLength(path), speed, 0.5)
    share = np.maximum(np.arange(len(timing.arc)) - 15.0, 0.0) * speed / (ROWS - 1)
    assert len(timing.arc) == 15 + (ROWS - 1) / speed + 1
    assert np.allclose(timing.arc, 9.0 * share**2, atol=1e-7)


def test_what_its_own_path_asked_for_already_is_not_asked_again(residuals):
    bent = PathProfile(np.cumsum(residuals.step), np.zeros(ROWS), np.full(ROWS, 2.0))
    timing = build_timing_by_profile(residuals, bent, level(30.0, bend=2.0), StepOptions(bends=True), 1.0, 0.0, False)
    assert np.allclose(timing.at, np.arange(ROWS)) and np.allclose(timing.arc, np.cumsum(residuals.step), atol=1e-9)


def test_a_closed_way_is_gone_round(residuals):
    timing = build_timing_by_profile(residuals, own(residuals), level(4.0, slope=0.1), StepOptions(slopes=True), 1.0,
                                     0.0, True)
    assert timing.arc[-1] > 12.0 and np.allclose(np.diff(timing.arc), STEP, rtol=1e-2)


def test_a_way_is_as_long_as_the_steps_it_takes(residuals):
    wishes, climb = StepOptions(slopes=True), level(10.0, slope=0.2)
    assert compute_required_length(residuals, own(residuals), climb, wishes) == pytest.approx(10.0 / 0.92)
    climbed = PathProfile(np.cumsum(residuals.step), np.full(ROWS, 0.2), np.zeros(ROWS))
    assert compute_required_length(residuals, climbed, climb, wishes) == pytest.approx(10.0)


def test_steps_are_stretched_as_the_speed_is():
    own = np.full(90, STEP)
    assert compute_step_scale(own, own, FPS) is None
    assert np.allclose(compute_step_scale(1.3 * own, own, FPS), 1.3, atol=0.02)
    assert np.isfinite(compute_step_scale(own, 0.0 * own, FPS)).all()
