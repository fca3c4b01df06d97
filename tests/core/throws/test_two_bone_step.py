"""One step of two-bone inverse kinematics against the one for whole motions, and at its edges."""

import numpy as np
import pytest

from beyond_mocap.motion import limb, quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.limb_reach import interpolate_target, solve_two_bones

MOTION = build_throw(fps=60.0).motion
BODY = identify_joints(MOTION.skeleton)
LIMBS = [(BODY.right.upper_arm, BODY.right.lower_arm, BODY.right.hand),
         (BODY.left.upper_leg, BODY.left.lower_leg, BODY.left.foot)]


def moved(places, turn_upper, turn_lower, joints):
    """Where middle and end joint (T, 3) are after the turns."""
    top, middle, end = (places[:, joint] for joint in joints)
    knee = top + np.einsum("tab,tb->ta", turn_upper, middle - top)
    return knee, knee + np.einsum("tab,tb->ta", turn_lower, end - middle)


def hinges(places, joints):
    """Unit hinge axes (T, 3) of the bends that the pose shows."""
    top, middle, end = (places[:, joint] for joint in joints)
    axis = np.cross(middle - top, end - middle)
    return axis / np.linalg.norm(axis, axis=-1, keepdims=True)


@pytest.mark.parametrize("joints", LIMBS)
def test_the_end_joint_gets_there_as_the_solver_of_whole_motions_brings_it(joints):
    places, world = forward_kinematics(MOTION)
    target = places[:, joints[2]] + np.random.default_rng(1).normal(0.0, 0.02, (len(MOTION), 3))
    top, middle, end = (places[:, joint] for joint in joints)
    upper, lower, there = solve_two_bones(top, middle, end, target, hinges(places, joints), np)
    _, now = moved(places, upper, lower, joints)
    assert np.allclose(now, there, atol=1e-8)
    other = limb.solve_two_bone(MOTION.skeleton, MOTION.root_positions, MOTION.rotations, joints, target)
    miss = np.linalg.norm(now - target, axis=-1)
    assert np.allclose(miss, other.miss, atol=1e-7)
    whole = forward_kinematics(type(MOTION)(MOTION.skeleton, MOTION.root_positions, other.rotations, 60.0))[0]
    bent = np.linalg.norm(np.cross(middle - top, end - middle), axis=-1) > 0.04
    knee, _ = moved(places, upper, lower, joints)
    # it takes a straight limb's plane from other frames, which one step cannot see
    assert np.abs(knee - whole[:, joints[1]])[bent].max() < 2e-3
    turns = quaternion.to_matrix(world[:, joints[0]])
    assert np.allclose((upper @ turns).swapaxes(-1, -2) @ (upper @ turns), np.eye(3), atol=1e-7)


def test_nothing_moves_where_the_end_joint_is_already_there():
    joints = LIMBS[0]
    places, _ = forward_kinematics(MOTION)
    top, middle, end = (places[:, joint] for joint in joints)
    upper, lower, _ = solve_two_bones(top, middle, end, end, hinges(places, joints), np, soft=1e-4)
    assert np.abs(upper - np.eye(3)).max() < 1e-6 and np.abs(lower - np.eye(3)).max() < 1e-6


def test_a_target_out_of_reach_is_neared_along_its_line():
    top, middle, end = np.zeros(3), np.array([0.3, 0, 0.01]), np.array([0.58, 0, 0.0])
    _, _, there = solve_two_bones(top, middle, end, np.array([0.0, 2.0, 0.0]), np.array([0.0, 1.0, 0.0]), np)
    length = np.linalg.norm(middle) + np.linalg.norm(end - middle)
    assert np.allclose(there, [0.0, length, 0.0], atol=1e-4)


def test_a_straight_limb_bends_about_the_hinge_it_is_given():
    top, middle, end = np.zeros(3), np.array([0, 0, -0.4]), np.array([0, 0, -0.8])
    upper, lower, there = solve_two_bones(top, middle, end, np.array([0, 0, -0.7]), np.array([0.0, 1.0, 0.0]), np)
    assert np.allclose(there, [0, 0, -0.7], atol=1e-9)
    knee = upper @ middle
    assert knee[0] < -0.05 or knee[0] > 0.05
    assert np.allclose(np.cross(knee, there - knee) / np.linalg.norm(np.cross(knee, there - knee)), [0, 1, 0])


def test_leading_axes_are_free():
    rows = np.random.default_rng(2).normal(size=(5, 2, 3))
    hinge = np.broadcast_to([0.0, 1.0, 0.0], rows.shape)
    both = solve_two_bones(rows, rows + [0.3, 0, 0], rows + [0.3, 0.25, 0], rows + [0.2, 0.2, 0.1], hinge, np)
    one = solve_two_bones(rows[3, 1], rows[3, 1] + [0.3, 0, 0], rows[3, 1] + [0.3, 0.25, 0], rows[3, 1]
                          + [0.2, 0.2, 0.1], hinge[0, 0], np)
    assert all(np.allclose(a[3, 1], b, atol=1e-12) for a, b in zip(both, one))


def test_the_point_reached_for_lies_between():
    assert np.allclose(interpolate_target(np.zeros(3), np.ones(3), 0.25), 0.25)
