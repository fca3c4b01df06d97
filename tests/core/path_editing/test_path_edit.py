"""A clip rides another path: its own gives the clip itself, and on another one it goes where the path is."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.path_editing.path_edit import edit_path
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import prepare_source
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.synthesis.quality.movement import list_foot_joints, measure_contact_speeds
from beyond_mocap.synthetic.gait import build_gait

RIGID = PathEditSettings(plant=False, lean=False)


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.4, 4.0, 30.0)


@pytest.fixture(scope="module")
def source(walk):
    return prepare_source(walk, PathEditSettings())


def circle(radius, rounds=1.0):
    """A line (N, 3) that turns left."""
    angle = np.linspace(0.0, 2.0 * np.pi * rounds, int(100 * rounds * max(radius, 1.0)))
    return np.stack([radius * np.sin(angle), radius * (1.0 - np.cos(angle)), 0.0 * angle], axis=1)


def straight(length, up=0.0):
    return fit_line(np.array([[0.0, 0.0, 0.0], [length, 0.0, up]]), "line")


def skate(motion, standing):
    """Mean m/s of feet that stand flat."""
    feet = forward_kinematics(motion)[0][:, list_foot_joints(motion.skeleton)]
    return np.nanmean(measure_contact_speeds(feet, standing.all(axis=2), motion.fps))


@pytest.mark.parametrize("frame", ["path", "tangent", "absolute"])
@pytest.mark.parametrize("fit", ["spline", "polynomial"])
def test_its_own_path_gives_the_motion_itself(walk, frame, fit):
    settings = PathEditSettings(plant=False, lean=False, frame=frame, fit=fit)
    source = prepare_source(walk, settings)
    ridden = edit_path(source, source.path, settings)
    assert np.abs(ridden.motion.root_positions - walk.root_positions).max() < 1e-9
    assert np.abs(ridden.motion.rotations - walk.rotations).max() < 1e-9
    assert np.array_equal(ridden.frames, np.arange(len(walk)))


def test_it_goes_as_far_along_the_new_path_as_along_its_own(source):
    ridden = edit_path(source, fit_line(circle(2.0, 3.0), "circle"), RIGID)
    assert np.allclose(np.diff(ridden.arc), source.residuals.step[1:])
    assert np.allclose(np.hypot(ridden.origin[:, 0], ridden.origin[:, 1] - 2.0), 2.0, atol=2e-3)
    assert np.allclose(np.diff(ridden.heading), np.diff(ridden.arc) / 2.0, atol=4e-3)
    off = np.linalg.norm(ridden.motion.root_positions - ridden.origin, axis=1)
    assert np.allclose(off, np.linalg.norm(source.residuals.place, axis=1))


def test_by_time_a_path_twice_as_long_is_passed_twice_as_fast(source):
    path = straight(2.0 * source.arc.length)
    ridden = edit_path(source, path, PathEditSettings(by_arc_length=False, plant=False, lean=False))
    assert len(ridden.motion) == len(source.motion) and abs(ridden.arc[-1] - path.at(path.domain)[1, 0]) < 1e-6


def test_it_stops_where_a_shorter_path_ends(source):
    ridden = edit_path(source, straight(2.0), RIGID)
    assert len(ridden.motion) < len(source.motion) and 1.9 < ridden.arc[-1] <= 2.0 + 1e-6
    assert len(ridden.warnings) == 1 and "ends" in ridden.warnings[0]


def test_half_the_speed_takes_twice_as_long(source):
    ridden = edit_path(source, straight(30.0), PathEditSettings(speed=0.5, plant=False, lean=False))
    assert len(ridden.motion) == 2 * len(source.motion) - 1
    assert np.allclose(ridden.arc[::2], np.cumsum(source.residuals.step))
    assert np.allclose(np.cumsum(np.diff(ridden.arc, prepend=0.0)), ridden.arc)


def test_it_waits_before_it_begins(source):
    ridden = edit_path(source, straight(30.0), PathEditSettings(delay=0.5, plant=False, lean=False))
    assert np.ptp(ridden.motion.root_positions[:16], axis=0).max() == 0.0
    assert np.array_equal(ridden.frames[15:], np.arange(len(source.motion)))


def test_planted_feet_do_not_slide_in_bends(source):
    path = fit_line(circle(2.0, 2.0), "circle")
    own, rigid, held = (
        skate(source.motion, source.standing),
        skate(edit_path(source, path, RIGID).motion, source.standing),
        skate(edit_path(source, path, PathEditSettings()).motion, source.standing),
    )
    assert rigid > 1.2 * own and held <= own


def test_a_vertical_path_and_one_who_stands_still_give_no_nan(walk, source):
    up = edit_path(source, fit_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 9.0]]), "pole"), PathEditSettings())
    assert np.isfinite(up.motion.root_positions).all() and np.isfinite(up.motion.rotations).all()
    root, rotations = np.tile(walk.root_positions[:1], (40, 1)), np.tile(walk.rotations[:1], (40, 1, 1))
    still = Motion(walk.skeleton, root, rotations, 30.0)
    source = prepare_source(still, PathEditSettings())
    ridden = edit_path(source, fit_line(np.array([[3.0, 1.0, 0.0], [3.0, 6.0, 0.0]]), "line"), PathEditSettings())
    assert np.allclose(ridden.motion.root_positions[:, :2], [3.0, 1.0], atol=0.15)
    assert any("stays in place" in line for line in ridden.warnings)


@pytest.mark.parametrize(
    "wrong", [{"frame": "world"}, {"end": "go on"}, {"fit": "line"}, {"speed": 0.0}, {"speed": np.nan}, {"delay": -1.0}]
)
def test_settings_that_make_no_sense_are_refused(wrong):
    with pytest.raises(InputError):
        PathEditSettings(**wrong)


def test_one_frame_is_no_motion(walk):
    with pytest.raises(InputError):
        prepare_source(walk.frames(0, 1), PathEditSettings())


def test_a_detour_takes_it_aside_and_back(source):
    settings = PathEditSettings(plant=False, lean=False, detours=((2.5, 3.0, 0.4),))
    around, ahead = (edit_path(source, straight(20.0), wanted) for wanted in (settings, RIGID))
    assert around.origin[:, 1].max() == pytest.approx(0.4, abs=1e-3)
    assert np.abs(around.origin[[0, -1], 1]).max() < 1e-4
    assert np.allclose(around.arc, ahead.arc)
    assert around.origin[-1, 0] < ahead.origin[-1, 0] - 0.05  # as fast as before, and a longer way
