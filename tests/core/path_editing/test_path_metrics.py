"""Figures of a ride, with errors planted in it."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.path.terrain import Terrain
from beyond_mocap.path_editing.path_edit import edit_path
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import prepare_source
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.path_editing.path_metrics import measure_knee_jerk, measure_path_edit
from beyond_mocap.synthetic.gait import build_gait

RIGID = PathEditSettings(plant=False, lean=False)


@pytest.fixture(scope="module")
def source():
    return prepare_source(build_gait(1.4, 5.0, 60.0), RIGID)


@pytest.fixture(scope="module")
def path():
    """A bend to the left, radius 4 m."""
    angle = np.linspace(0.0, 2.5, 200)
    return fit_line(np.column_stack([4 * np.sin(angle), 4 * (1 - np.cos(angle)), 0 * angle]), "bend")


def moved(ridden, by) -> Motion:
    """The ridden motion with its root moved by (T or 1, 3) m."""
    return replace(ridden.motion, root_positions=ridden.motion.root_positions + by)


def test_its_own_path_gives_the_recordings_own_figures(source):
    got = measure_path_edit(source, edit_path(source, source.path, RIGID), source.path)
    assert got["root_error_m"] == pytest.approx(got["root_error_own_m"], abs=1e-9)
    assert got["kept_speed"]["path"]["max"] < 1e-6 and got["kept_speed"]["body"]["max"] < 1e-6
    skate = got["skate"]
    for name in ("contact_cm_s", "point_cm_s", "stance_mm_median"):
        assert skate[name] == pytest.approx(skate[f"source_{name}"], rel=0.05)
        assert skate[name] == pytest.approx(skate[f"before_{name}"], rel=1e-6)
    assert got["ground_mm"]["standing_p95"] == pytest.approx(got["ground_mm"]["source_standing_p95"], abs=1.0)
    assert got["knee_jerk_ratio"]["p99"] == pytest.approx(1.0, abs=1e-3)
    assert got["ik_miss_share"] == 0.0 and got["seam_jerk"] == {"seams": 0, "max": None, "median": None}


def test_beside_a_recording_that_stands_still_a_ratio_of_jerk_is_unknown():
    pose = build_gait(0.0, 1.0, 30.0).frames(0, 1)
    still = prepare_source(replace(pose, root_positions=np.repeat(pose.root_positions, 24, axis=0),
                                   rotations=np.repeat(pose.rotations, 24, axis=0)), RIGID)
    assert measure_knee_jerk(still, still, np.arange(24)) == {"p99": None, "max": None}


def test_a_body_beside_the_path_is_measured_beside_it(source, path):
    ridden = edit_path(source, path, RIGID)
    aside = np.column_stack([-np.sin(ridden.heading), np.cos(ridden.heading), 0 * ridden.heading])
    before = measure_path_edit(source, ridden, path)["nearest_m"]["mean"]
    got = measure_path_edit(source, replace(ridden, motion=moved(ridden, 0.2 * aside)), path)
    assert got["root_error_m"]["mean"] == pytest.approx(0.2, abs=0.01)
    assert got["nearest_m"]["mean"] == pytest.approx(0.2, abs=0.01) and before < 0.02


def test_a_body_behind_its_place_is_off_in_time_but_not_beside_the_path(source, path):
    ridden = edit_path(source, path, RIGID)
    late = np.clip(np.arange(len(ridden.motion)) - 30, 0, None)
    root = ridden.motion.root_positions[late]
    got = measure_path_edit(source, replace(ridden, motion=replace(ridden.motion, root_positions=root)), path)
    assert got["root_error_m"]["p95"] > 0.5 and got["nearest_m"]["p95"] < 0.05


def test_a_surface_that_is_not_stood_on_is_seen(source):
    ridden = edit_path(source, source.path, RIGID)
    corners = np.array([[-99, -99, 0.05], [99, -99, 0.05], [99, 99, 0.05], [-99, 99, 0.05]]) + ridden.origin[0] * [0, 0,
                                                                                                                   1]
    sunk = measure_path_edit(source, ridden, source.path, Terrain(corners, [[0, 1, 2], [0, 2, 3]]))["ground_mm"]
    assert sunk["deepest"] == pytest.approx(sunk["source_deepest"] - 50.0, abs=0.1)
    assert sunk["standing_p95"] > 30.0 > sunk["source_standing_p95"]


def test_speed_that_is_not_kept_is_seen(source, path):
    ridden = edit_path(source, path, RIGID)
    got = measure_path_edit(source, replace(ridden, arc=1.05 * ridden.arc), path)
    assert got["kept_speed"]["path"]["mean"] == pytest.approx(0.05, abs=1e-6)


def test_feet_that_slide_are_counted_by_what_they_slide(source, path):
    ridden = edit_path(source, path, RIGID)
    before = measure_path_edit(source, ridden, path)["skate"]
    assert before["contact_cm_s"] > 1.5 * before["source_contact_cm_s"], "in a bend rigid feet swing round"
    stopped = np.repeat(ridden.motion.rotations[:1], len(ridden.motion), axis=0)
    gliding = ridden.motion.root_positions[:1] + 0.3 / 60.0 * np.arange(len(stopped))[:, None] * [1.0, 0.0, 0.0]
    slid = replace(ridden, motion=replace(ridden.motion, root_positions=gliding, rotations=stopped))
    got = measure_path_edit(source, slid, path)["skate"]
    assert got["contact_cm_s"] == pytest.approx(30.0, abs=1e-6) and got["stances_over_21mm"] > 0.8
