"""Paths that no foot could follow: told with their seconds, and nobody planted there."""

import numpy as np
import pytest

from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.path_editing.ground_contact import curvature, share_free
from beyond_mocap.path_editing.path_line import through
from beyond_mocap.path_editing.ride import RideSettings, prepare, ride
from beyond_mocap.synthetic.gait import gait


@pytest.fixture(scope="module")
def source():
    return prepare(gait(1.4, 5.0, 30.0), RideSettings())


def line(*corners):
    return through(np.array(corners, dtype=float), "line")


def circle(radius, rounds=1.0):
    a = np.linspace(0.0, 2.0 * np.pi * rounds, int(200 * rounds))
    return through(np.column_stack([radius * np.sin(a), radius - radius * np.cos(a), 0.0 * a]), "circle")


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
    assert np.allclose(curvature(path, np.linspace(*path.domain, 50)[5:-5]), 0.8, rtol=0.02)


def test_loops_tighter_than_a_foot_are_told_and_nobody_stands_there(source):
    ridden = ride(source, circle(0.12, 6.0), RideSettings())
    (told,) = bad(ridden)
    assert told.startswith("the path bends more tightly than 0.3 m radius from 0.0 s to")
    assert not ridden.standing.any() and np.allclose(ridden.miss, 0.0)


def test_a_steep_stretch_is_told_with_its_seconds_and_planted_before_and_after(source):
    ridden = ride(source, line((0, 0, 0), (2, 0, 0), (2, 0, 2), (8, 0, 2)), RideSettings())
    (told,) = bad(ridden)
    ((first, last),) = told.spans
    assert "steeper than 60 degrees" in told and 1.2 < first < 1.7 and 2.5 < last < 3.0  # metres 2 to 4 at 1.4 m/s
    frames = np.arange(len(ridden.motion)) / ridden.motion.fps
    inside = (frames >= first) & (frames <= last)
    assert not ridden.standing[inside].any() and ridden.standing[~inside].any(axis=(1, 2)).mean() > 0.9


def test_legs_do_not_flail_on_a_pole(source):
    ridden = ride(source, line((0, 0, 0), (0, 0, 9)), RideSettings())
    assert jolt(ridden.motion) < 1.5 * jolt(source.motion)


@pytest.mark.parametrize("path", [circle(2.0), circle(0.6), line((0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 3, 0))])
def test_bends_and_corners_that_feet_can_follow_are_not_told(source, path):
    assert not bad(ride(source, path, RideSettings()))


def test_a_line_that_jitters_is_told_and_its_own_path_is_not(source):
    assert len(bad(ride(source, jittery(), RideSettings()))) == 1
    assert not bad(ride(source, source.path, RideSettings()))


def test_feet_are_let_go_smoothly_within_the_stretch():
    free = np.zeros(90, dtype=bool)
    free[20:70] = True
    much = share_free(free, 30.0)
    assert np.all(much[~free] < 1e-9) and np.allclose(much[30:60], 1.0) and np.abs(np.diff(much)).max() < 0.3
