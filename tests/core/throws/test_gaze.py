"""Heads of kicks move as the heads of the examples do, about their own mean."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.throws.network_npz import read_shipped_model
from beyond_mocap.throws.networks.example import build_description, compute_effectors, mirror_example
from beyond_mocap.throws.networks.frame_step import prepare_stepper
from beyond_mocap.throws.networks.gaze import turn_head
from beyond_mocap.throws.networks.kinematics import to_matrices


@pytest.fixture(scope="module")
def model():
    kicks = read_shipped_model("kick")
    return replace(kicks, examples=kicks.examples[:1])


def look_aside(motion, degrees):
    """Return the motion with its head turned by degrees (T,) or one."""
    head, rotations = identify_joints(motion.skeleton).head, motion.rotations.copy()
    angles = np.radians(np.broadcast_to(degrees, len(motion)))
    aside = quaternion.from_axis_angle(np.tile([0.0, 0.0, 1.0], (len(motion), 1)), angles)
    rotations[:, head] = quaternion.multiply(rotations[:, head], aside)
    return replace(motion, rotations=rotations)


def swing(motion):
    """Return the motion with a head that swings by 40 degrees to either side, once."""
    return look_aside(motion, 40.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, len(motion))))


def measure_off(motion, truth):
    """Measure the angles (T,) in degrees between two motions' heads."""
    ours, theirs = (forward_kinematics(one)[1][:, identify_joints(one.skeleton).head] for one in (motion, truth))
    turns = quaternion.multiply(ours, quaternion.inverse(theirs))
    return np.degrees(np.linalg.norm(quaternion.to_rotation_vector(turns), axis=-1))


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_head_that_swings_is_held_still_whichever_foot_kicks(model, mirrored):
    example = mirror_example(model.examples[0]) if mirrored else model.examples[0]
    aside = swing(example.motion)
    assert measure_off(aside, example.motion).mean() > 20.0
    for share, least, most in ((0.5, 9.0, 16.0), (1.0, 0.0, 5.0)):
        back = turn_head(model, build_description(example), aside, share)
        assert least <= measure_off(back, example.motion).mean() <= most
        assert np.array_equal(compute_effectors(back), compute_effectors(aside))


def test_where_a_head_points_on_average_stays(model):
    example = model.examples[0]
    aside = look_aside(example.motion, 40.0)
    back = turn_head(model, build_description(example), aside, 1.0)
    assert 38.0 < measure_off(back, example.motion).mean() < 42.0


def test_neck_and_head_stay_within_their_limits(model):
    example, limits = model.examples[0], prepare_stepper(model).limits
    aside = swing(example.motion)
    back = turn_head(model, build_description(example), aside, 0.5, limits)
    changed = np.any(back.rotations != aside.rotations, axis=-1)
    body = identify_joints(aside.skeleton)
    assert set(np.argwhere(changed)[:, 1]) == {body.neck, body.head}
    assert limits.measure_excess(to_matrices(back))[changed].max() < 1e-6


def test_throws_keep_their_heads(model):
    example = model.examples[0]
    thrown = replace(model, settings=replace(model.settings, action="throw"))
    assert turn_head(thrown, build_description(example), example.motion, 1.0) is example.motion
