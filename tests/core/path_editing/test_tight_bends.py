"""Paths that no foot could follow: told with their seconds, and nobody planted there."""

import numpy as np
import pytest

from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.path_editing.ground_contact import compute_curvature, compute_free_share
from beyond_mocap.path_editing.path_edit import edit_path
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import prepare_source
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def source():
    return prepare_source(build_gait(1.4, 5.0, 30.0), PathEditSettings())


def line(*corners):
    return fit_line(np.array(corners, dtype=float), "line")


def circle(radius, rounds=1.0):
    a = np.linspace(0.0, 2.0 * np.pi * rounds, int(200 * rounds))
    return fit_line(np.column_stack([radius * np.sin(a), radius - radius * np.cos(a), 0.0 * a]), "circle")


def jittery():
    """Eight metres with 5 cm of noise every centimetre."""
    x = np.arange(0.0, 8.0, 0.01)
    return line(*zip(x, np.random.default_rng(0).normal(0.0, 0.05, len(x)), 0.0 * x))


def jolt(motion):
    return np.linalg.norm(np.diff(forward_kinematics(motion)[0], 3, axis=0), axis=-1).max() * motion.fps**3


def bad(ridden):
    return [told for told in ridden.warnings if "feet are not planted there" in told]


def test_a_circle_bends_by_one_over_its_radius():
    path = circle(1.25)
    assert np.allclose(compute_curvature(path, np.linspace(*path.domain, 50)[5:-5]), 0.8, rtol=0.02)


def test_loops_tighter_than_a_foot_are_told_and_nobody_stands_there(source):
    ridden = edit_path(source, circle(0.12, 6.0), PathEditSettings())
    (told,) = bad(ridden)
    assert told.startswith("the path bends more tightly than 0.3 m radius from 0.0 s to")
    assert not ridden.standing.any() and np.allclose(ridden.miss, 0.0)


def test_a_steep_stretch_is_told_with_its_seconds_and_planted_before_and_after(source):
    ridden = edit_path(source, line((0, 0, 0), (2, 0, 0), (2, 0, 2), (8, 0, 2)), PathEditSettings())
    (told,) = bad(ridden)
    ((first, last),) = told.spans
    assert "steeper than 60 degrees" in told and 1.2 < first < 1.7 and 2.5 < last < 3.0  # metres 2 to 4 at 1.4 m/s
    frames = np.arange(len(ridden.motion)) / ridden.motion.fps
    inside = (frames >= first) & (frames <= last)
    assert not ridden.standing[inside].any() and ridden.standing[~inside].any(axis=(1, 2)).mean() > 0.9


def test_legs_do_not_flail_on_a_pole(source):
    ridden = edit_path(source, line((0, 0, 0), (0, 0, 9)), PathEditSettings())
    assert jolt(ridden.motion) < 1.5 * jolt(source.motion)


@pytest.mark.parametrize("path", [circle(2.0), circle(0.6), line((0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 3, 0))])
def test_bends_and_corners_that_feet_can_follow_are_not_told(source, path):
    assert not bad(edit_path(source, path, PathEditSettings()))


def test_a_line_that_jitters_is_told_and_its_own_path_is_not(source):
    assert len(bad(edit_path(source, jittery(), PathEditSettings()))) == 1
    assert not bad(edit_path(source, source.path, PathEditSettings()))


def test_feet_are_let_go_smoothly_within_the_stretch():
    free = np.zeros(90, dtype=bool)
    free[20:70] = True
    much = compute_free_share(free, 30.0)
    assert np.all(much[~free] < 1e-9) and np.allclose(much[30:60], 1.0) and np.abs(np.diff(much)).max() < 0.3
