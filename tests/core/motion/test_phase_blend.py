"""Two made runs of known speed and phase, blended: what lies between them is known, too."""

from __future__ import annotations

import numpy as np
import pytest

from beyond_mocap.motion import contacts
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.phase_blend import blend_strides, find_strides
from beyond_mocap.synthetic.gait import build_gait

SLOW, FAST = 2.6, 4.0


def recorded(speed: float, **more):
    motion = build_gait(speed, 3.0, 60.0, **more)
    return find_strides(motion, contacts.detect_heel_toe_contacts(motion))


@pytest.fixture(scope="module")
def slow():
    return recorded(SLOW)


@pytest.fixture(scope="module")
def fast():
    return recorded(FAST, phase=0.3, seed=3)


def test_strides_are_found(slow):
    assert slow.steps >= 6
    assert slow.speed == pytest.approx(SLOW, rel=0.03)
    assert slow.seconds == pytest.approx(np.full(slow.steps, slow.seconds.mean()), rel=0.12)


def test_no_strides_where_nobody_walks():
    motion = build_gait(0.0, 2.0, 60.0)
    assert find_strides(motion, contacts.detect_heel_toe_contacts(motion)) is None


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_a_blend_goes_at_the_asked_speed(slow, fast, share):
    wanted = SLOW + share * (FAST - SLOW)
    motion, _ = blend_strides(slow, fast, wanted, 60.0)
    way = np.linalg.norm(motion.root_positions[-1, :2] - motion.root_positions[0, :2])
    assert way / motion.duration == pytest.approx(wanted, rel=0.03)


def test_its_steps_last_between_the_two_and_begin_together(slow, fast):
    motion, standing = blend_strides(slow, fast, 3.3, 60.0)
    between = find_strides(motion, standing)
    assert between.steps >= min(slow.steps, fast.steps) - 3
    assert fast.seconds.mean() < between.seconds.mean() < slow.seconds.mean()
    assert between.seconds.std() < 0.05 * between.seconds.mean()


def test_standing_feet_hardly_slide_before_they_are_held(slow, fast):
    motion, standing = blend_strides(slow, fast, 3.3, 60.0)
    body = identify_joints(motion.skeleton)
    toes = forward_kinematics(motion)[0][:, [body.left.toe, body.right.toe], :2]
    firm = standing[1:, :, 1] & standing[:-1, :, 1]
    assert np.median(np.linalg.norm(np.diff(toes, axis=0), axis=-1)[firm]) * 60.0 < 0.35
    assert 0.1 < standing[..., 1].mean() < 0.45


def test_the_ends_are_the_recordings(slow, fast):
    motion, standing = blend_strides(slow, fast, 1.0, 60.0)
    own = forward_kinematics(slow.motion)[0][:, :, 2]
    first = slow if slow.first_side == fast.first_side or slow.steps <= fast.steps else slow.select_steps(1, slow.steps)
    at = first.landings[0] + np.arange(len(motion))
    wanted = np.array([np.interp(at, np.arange(len(own)), own[:, joint]) for joint in range(own.shape[1])]).T
    assert np.median(np.abs(forward_kinematics(motion)[0][:, :, 2] - wanted)) < 0.01
    assert standing.any()


def test_the_same_foot_lands_first_whichever_began(slow, fast):
    for a, b in ((slow, fast), (slow.select_steps(1, slow.steps), fast)):
        motion, standing = blend_strides(a, b, 3.3, 60.0)
        mine = find_strides(motion, standing)
        heights = forward_kinematics(motion)[0][:, identify_joints(motion.skeleton).left.foot, 2]
        assert np.ptp(heights) > 0.15  # feet swing as high as in a run: out of step they would cancel
        assert mine is not None
