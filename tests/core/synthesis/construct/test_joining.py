"""Stretches put one behind the other where there is no track to follow."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.synthesis.construct.thesis_methods import compute_torso_corrections, integrate_heading, integrate_path

UP, AHEAD = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


def test_facing_goes_on_from_where_it_was():
    turn = np.array([9.0, 0.1, 0.1, 0.0, -0.2])
    assert np.allclose(integrate_heading(0.5, turn), [0.5, 0.6, 0.7, 0.7, 0.5])


def lying(angle, lift=0.1):
    return quaternion.rotate(quaternion.from_up_angle(np.array(angle)), np.array([np.cos(lift), 0.0, np.sin(lift)]))


@pytest.mark.parametrize("before, after", [(0.0, 2.0), (1.0, -2.5), (-3.0, 3.0), (0.4, 0.4)])
def test_a_body_that_lies_goes_on_lying_the_same_way(before, after):
    up = np.stack([UP, lying(after)])
    found = compute_torso_corrections(up, np.array([1]), lying(before)[None])[0]
    assert -np.pi <= found <= np.pi
    turned = quaternion.rotate(quaternion.from_up_angle(np.array(found)), lying(after))
    assert np.allclose(turned, lying(before), atol=1e-9)


@pytest.mark.parametrize("before, after", [(UP, lying(1.0)), (lying(1.0), UP), (UP, UP)])
def test_where_one_stands_upright_nothing_is_turned(before, after):
    assert compute_torso_corrections(np.stack([UP, after]), np.array([1]), before[None]).tolist() == [0.0]


def test_a_leaning_runner_is_upright():
    leaning = np.array([np.sin(np.radians(35)), 0.0, np.cos(np.radians(35))])
    assert compute_torso_corrections(np.stack([UP, leaning]), np.array([1]), leaning[None]).tolist() == [0.0]


def test_no_seams_no_corrections():
    assert compute_torso_corrections(np.stack([UP, UP]), np.zeros(0, int), np.zeros((0, 3))).shape == (0,)


def test_velocities_add_up_along_the_facing():
    velocity = np.tile([3.0, 0.0], (31, 1))
    root = integrate_path(np.array([1.0, 2.0]), velocity, np.zeros((31, 2)), np.full(31, np.pi / 2), 30.0)
    assert np.allclose(root[0], [1, 2]) and np.allclose(root[-1], [1, 5])
    sway = np.tile([0.0, 0.1], (31, 1))
    moved = integrate_path(np.array([1.0, 2.0]), velocity, sway, np.full(31, np.pi / 2), 30.0)
    assert np.allclose(moved - root, [-0.1, 0.0])


def test_one_frame():
    assert integrate_path(np.zeros(2), np.ones((1, 2)), np.zeros((1, 2)), np.zeros(1), 30.0).tolist() == [[0.0, 0.0]]
