"""Pins: the part is there on time, the rest of the body and of the time is left alone, feet that stand still stand."""

from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import compute_heading, identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.construct.pins import FADE, MAX_SHIFT, apply_pins, estimate_look_axis
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.4, 4.0, 30.0)


def pin(time, part, position, hold=0.0):
    return SimpleNamespace(time=time, part=part, position=tuple(position), hold=hold)


def joints(motion):
    body = identify_joints(motion.skeleton)
    return {
        "left_hand": body.left.hand, "right_hand": body.right.hand, "left_foot": body.left.foot,
        "right_foot": body.right.foot, "gaze": body.head,
    }


def with_pins(motion, *pins, contacts=None):
    contacts = np.zeros((len(motion), 2), bool) if contacts is None else contacts
    found = apply_pins(motion, contacts, pins, 0.0, estimate_look_axis(motion.skeleton, motion.rotations))
    after = type(motion)(motion.skeleton, found.root, found.rotations, motion.fps)
    return after, found, forward_kinematics(motion)[0], forward_kinematics(after)[0]


def changed(before, after):
    off = np.any(before.root_positions != after.root_positions, axis=1)
    return off | np.any(before.rotations != after.rotations, axis=(1, 2))


@pytest.mark.parametrize("part, away", [
    ("right_hand", (0.1, -0.1, 0.2)), ("left_hand", (0.15, 0.05, 0.1)), ("left_foot", (0.05, 0.1, 0.1)),
])
def test_a_part_is_at_its_pin_and_all_else_is_left_alone(walk, part, away):
    joint = joints(walk)[part]
    place = forward_kinematics(walk)[0][60, joint] + away
    after, found, old, new = with_pins(walk, pin(2.0, part, place))
    assert np.linalg.norm(new[60, joint] - place) < 0.005 and found.miss[0] < 0.005
    off = np.flatnonzero(changed(walk, after))
    assert off.min() > 60 - FADE * 30 - 1 and off.max() < 60 + FADE * 30 + 1
    feet = [joints(walk)[name] for name in ("left_foot", "right_foot") if name != part]
    assert np.abs(new[:, feet] - old[:, feet]).max() < 0.003
    jerk = [np.linalg.norm(np.diff(places, 3, axis=0), axis=2).max() for places in (old, new)]
    assert jerk[1] < 2.0 * jerk[0]


def test_a_pin_holds_between_frames_too(walk):
    hand = joints(walk)["right_hand"]
    place = forward_kinematics(walk)[0][58, hand] + [0.1, -0.1, 0.2]
    after, found, _, new = with_pins(walk, pin(1.917, "right_hand", place, 0.1))
    assert np.abs(new[58:61, hand] - place).max() < 0.005 and found.miss[0] < 0.005


def test_who_is_too_short_bends_and_comes_nearer_with_his_feet_where_they_were(walk):
    still = np.repeat(walk.root_positions[:1], 60, 0), np.repeat(walk.rotations[:1], 60, 0)
    standing = type(walk)(walk.skeleton, *still, 30.0)
    hand, feet = joints(walk)["right_hand"], [joints(walk)[name] for name in ("left_foot", "right_foot")]
    shoulder = forward_kinematics(standing)[0][30, identify_joints(walk.skeleton).right.upper_arm]
    reach = np.linalg.norm(walk.skeleton.offsets[[identify_joints(walk.skeleton).right.lower_arm, hand]], axis=1).sum()
    place = shoulder + (reach + 0.2) * np.array([np.cos(-0.6), 0.0, np.sin(-0.6)])
    _, found, old, new = with_pins(standing, pin(1.0, "right_hand", place, 0.2), contacts=np.ones((60, 2), bool))
    assert found.miss[0] < 0.01
    assert np.abs(new[:, feet] - old[:, feet]).max() < 0.005
    assert np.linalg.norm(new[:, 0] - old[:, 0], axis=1).max() < MAX_SHIFT + 0.05


def test_what_is_out_of_reach_is_told(walk):
    place = forward_kinematics(walk)[0][60, 0] + [5.0, 0.0, 0.0]
    _, found, _, new = with_pins(walk, pin(2.0, "left_hand", place))
    assert 3.0 < found.miss[0] < 4.6 and np.isfinite(new).all()
    assert with_pins(walk, pin(-3.0, "left_hand", place))[1].miss == (np.inf,)


def test_a_gaze_turns_to_its_place_as_far_as_a_neck_can(walk):
    facing, head = compute_heading(walk)[60], joints(walk)["gaze"]
    look = estimate_look_axis(walk.skeleton, walk.rotations)
    for side, most in ((0.9, 0.02), (3.0, 2.0)):
        places, world = forward_kinematics(walk)
        place = places[60, head] + 6.0 * np.array([np.cos(facing + side), np.sin(facing + side), 0.1])
        after, found, _, new = with_pins(walk, pin(2.0, "gaze", place))
        sight = quaternion.rotate(forward_kinematics(after)[1][60, head], look)
        away = place - new[60, head]
        miss = np.arccos(np.clip(sight @ away / np.linalg.norm(away), -1.0, 1.0))
        assert abs(miss - found.miss[0]) < 0.05 and miss < most
        assert (miss > 0.8) == (side == 3.0)
        feet = [joints(walk)["left_foot"], joints(walk)["right_foot"]]
        assert np.abs(new[:, feet] - places[:, feet]).max() < 1e-9


def test_a_foot_on_its_way_to_a_pin_does_not_stand(walk):
    foot = joints(walk)["left_foot"]
    place = forward_kinematics(walk)[0][60, foot] + [0.0, 0.15, 0.1]
    _, found, _, _ = with_pins(walk, pin(2.0, "left_foot", place, 0.2), contacts=np.ones((len(walk), 2), bool))
    assert found.contacts[:, 1].all() and found.contacts[60:67, 0].all()
    assert not found.contacts[[55, 70], 0].any() and found.contacts[[40, 90], 0].all()
