"""Riding paths longer and shorter than the motion: cycled, cut, begun again, round and round."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.path_editing.path_edit import edit_path
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import prepare_source
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.path_editing.path_metrics import measure_path_edit
from beyond_mocap.synthetic.gait import build_gait


def line(length):
    return fit_line(np.stack([np.linspace(0.0, length, 50), np.zeros(50), np.zeros(50)], axis=1), "path")


def circle(radius):
    angle = np.linspace(0.0, 2.0 * np.pi, 100, endpoint=False)
    return fit_line(radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1), "path", closed=True)


@pytest.fixture(scope="module")
def source():
    return prepare_source(build_gait(1.4, 4.0, 30.0, seed=1), PathEditSettings())


def asked(**settings):
    return PathEditSettings(**{"plant": False, "lean": False, **settings})


def test_a_longer_path_is_filled_by_cycling(source):
    own = source.arc.length
    out = edit_path(source, line(3.0 * own), asked(cycle=True))
    assert out.arc[-1] == pytest.approx(3.0 * own, abs=1e-3) and len(out.transitions)
    assert np.all(out.transitions < len(out.motion)) and np.isfinite(out.motion.rotations).all()
    assert len(edit_path(source, line(3.0 * own), asked()).motion) == len(source.motion)


@pytest.mark.parametrize("speed, delay", [(0.5, 0.0), (2.0, 1.0)])
def test_seams_are_told_in_the_frames_that_are_shown(source, speed, delay):
    plain, other = (
        edit_path(source, line(14.0), asked(cycle=True, **more)) for more in ({}, {"speed": speed, "delay": delay})
    )
    seconds = delay + plain.transitions / plain.motion.fps / speed
    assert np.allclose(other.transitions / other.motion.fps, seconds, atol=1.01 / other.motion.fps)


def test_planted_cycles_stay_on_the_path(source):
    out = edit_path(source, circle(3.0), PathEditSettings(cycle=True))
    assert out.arc[-1] == pytest.approx(6.0 * np.pi, abs=0.01)
    assert np.linalg.norm(out.motion.root_positions[-1, :2] - [3.0, 0.0]) < 0.15
    assert out.correction.max() < 0.15


def test_the_motion_begins_again_with_the_path(source):
    out = edit_path(source, line(2.0), PathEditSettings(end="repeat"))
    assert len(out.motion) == len(source.motion) and len(out.restarts) == 2
    lap = out.restarts[0]
    assert np.array_equal(out.motion.root_positions[lap : 2 * lap], out.motion.root_positions[:lap])
    assert not out.standing[out.restarts].any() and not out.standing[out.restarts - 1].any()
    assert np.array_equal(out.standing[lap + 1 : 2 * lap - 1], out.standing[1 : lap - 1])
    assert len(edit_path(source, line(2.0), PathEditSettings()).motion) == lap


def test_figures_look_at_a_repeated_ride_once(source):
    path = line(2.0)
    told = [measure_path_edit(source, edit_path(source, path, PathEditSettings(end=end)), path)
            for end in ("stop", "repeat")]
    for name in ("root_error_m", "kept_speed", "knee_jerk_ratio"):
        assert told[0][name] == told[1][name]
    assert told[1]["skate"]["contact_cm_s"] == pytest.approx(told[0]["skate"]["contact_cm_s"], rel=0.1)


def test_a_closed_path_is_gone_round_without_a_cut(source):
    out = edit_path(source, circle(0.5), asked())
    assert len(out.motion) == len(source.motion) and not len(out.restarts)
    step = np.linalg.norm(np.diff(out.motion.root_positions, axis=0), axis=1)
    assert step.max() < 0.1


def test_who_stands_still_is_not_cycled():
    source = prepare_source(build_gait(0.0, 3.0, 30.0), PathEditSettings())
    with pytest.raises(InputError, match="cycling off"):
        edit_path(source, line(5.0), asked(cycle=True))


def test_a_cycle_on_bends_that_slow_ends_with_the_path(source):
    out = edit_path(source, circle(1.2), asked(cycle=True, end="repeat", bends=True))
    assert not len(out.restarts) and out.arc[-1] == pytest.approx(2.4 * np.pi, abs=0.06)


def test_a_cycle_reaches_the_path_s_end_over_hills_and_from_a_hill(source):
    x = np.linspace(0.0, 14.0, 200)
    hill = fit_line(np.stack([x, 0.0 * x, 1.2 * np.sin(x / 14.0 * 2.0 * np.pi)], axis=1), "hill")
    over = edit_path(source, hill, PathEditSettings(cycle=True))
    assert over.arc[-1] == pytest.approx(ArcLength(hill).length, abs=0.06)
    up = edit_path(source, fit_line(np.stack([x, 0.0 * x, 0.15 * x], axis=1), "up"), PathEditSettings())
    level = edit_path(prepare_source(up.motion, PathEditSettings(), up.standing), line(12.0),
                      PathEditSettings(cycle=True))
    assert level.arc[-1] == pytest.approx(12.0, abs=0.06)
    assert not [told for told in (*over.warnings, *level.warnings) if "before the motion" in told]


def test_two_frames_can_ride():
    source = prepare_source(build_gait(1.4, 1.0, 30.0).frames(0, 2), PathEditSettings())
    assert np.isfinite(edit_path(source, line(2.0), PathEditSettings()).motion.root_positions).all()
    with pytest.raises(InputError, match="cycling off"):
        edit_path(source, line(2.0), asked(cycle=True))


def test_by_time_nothing_is_cycled_and_that_is_told(source):
    out = edit_path(source, line(20.0), asked(cycle=True, by_arc_length=False))
    assert len(out.motion) == len(source.motion) and any("by time" in line for line in out.warnings)
