"""Side steps, turns and single steps go where they should; feet stand still, legs do not pass through each other."""

import numpy as np
import pytest

from beyond_mocap.motion.contacts import detect_heel_toe_contacts
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.retargeting.posture import to_motion
from beyond_mocap.synthetic.steps import PEAK_TURN_RATE, build_side_walk, build_steps_in_place

NEUTRAL = build_neutral_stance(build_adult_skeleton())


def measure_shank_distance(posture) -> float:
    """The least distance of the middles of both legs below the knee, m."""
    motion = to_motion(posture, NEUTRAL)
    body, (places, _) = identify_joints(motion.skeleton), forward_kinematics(motion)
    share = np.linspace(0.0, 1.0, 9)[None, :, None]
    left, right = (places[:, None, limb.lower_leg] * (1.0 - share) + places[:, None, limb.foot] * share
                   for limb in (body.left, body.right))
    return float(np.linalg.norm(left[:, :, None] - right[:, None], axis=-1).min())


def measure_slide(posture) -> tuple[float, float]:
    """Mean speed in m/s of heels and toes in contact, and the share of time in which the less used foot has contact."""
    motion = to_motion(posture, NEUTRAL)
    body, (places, _) = identify_joints(motion.skeleton), forward_kinematics(motion)
    points = np.stack([places[:, [limb.foot, limb.toe], :2] for limb in (body.left, body.right)], axis=1)
    speed = np.linalg.norm(np.diff(points, axis=0), axis=-1) * motion.fps
    contacts = detect_heel_toe_contacts(motion)
    return float(speed[contacts[1:] & contacts[:-1]].mean()), float(contacts.any(axis=2).mean(axis=0).min())


@pytest.mark.parametrize("speed, degrees, crosses", [(0.5, 90, False), (0.9, 135, False), (1.1, 90, True),
                                                     (1.5, 90, True)])
def test_a_side_walk_goes_where_it_should_on_feet_that_stand(speed, degrees, crosses):
    walk = build_side_walk(speed, np.radians(degrees), 4.0, 60.0, NEUTRAL, crosses).posture
    travelled = (walk.hips[-1] - walk.hips[0])[:2] / 4.0
    wanted = speed * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    assert np.linalg.norm(travelled - wanted) < 0.06
    assert np.all(walk.heading == 0.0)
    slide, stands = measure_slide(walk)
    assert slide < 0.06 and stands > 0.35
    assert measure_shank_distance(walk) > 0.045


@pytest.mark.parametrize("crosses", [False, True])
def test_only_crossing_feet_pass_each_other_and_the_right_one_ahead(crosses):
    walk = build_side_walk(1.1, np.pi / 2.0, 4.0, 60.0, NEUTRAL, crosses).posture
    apart = walk.ankles[:, 0] - walk.ankles[:, 1]
    assert np.any(apart[:, 1] < -0.05) == crosses
    if crosses:
        assert apart[apart[:, 1] < 0.0, 0].max() < -0.1


@pytest.mark.parametrize("degrees", [45.0, 90.0, 135.0, 180.0, -90.0])
def test_a_turn_ends_where_it_should_at_a_human_rate(degrees):
    posture = build_steps_in_place((0.0, 0.0), np.radians(degrees), 60.0, NEUTRAL).posture
    assert posture.heading[0] == 0.0 and posture.heading[-1] == pytest.approx(np.radians(degrees))
    assert np.abs(np.gradient(posture.heading)).max() * 60.0 < 1.01 * PEAK_TURN_RATE
    feet = np.diff(posture.feet[:, :, 2], axis=0) * 60.0
    assert np.all(np.abs(feet).min(axis=1) < 1e-6)  # one foot at least keeps its direction
    twist = posture.feet[:, :, 2].mean(axis=1) - posture.heading
    assert np.abs(twist).max() < np.radians(50.0)
    assert measure_shank_distance(posture) > 0.06


@pytest.mark.parametrize("move", [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.25), (0.0, 0.45), (0.0, -0.3)])
def test_a_step_begins_and_ends_in_the_same_stand(move):
    posture = build_steps_in_place(move, 0.0, 60.0, NEUTRAL).posture
    for values in (posture.hips, posture.ankles[:, 0], posture.ankles[:, 1]):
        assert np.allclose(values[-1] - values[0], [*move, 0.0], atol=1e-4)
    lifted = posture.ankles[..., 2] > posture.ankles[0, :, 2] + 0.02
    assert lifted.any(axis=0).all() and not lifted.all(axis=1).any()  # both step, one after the other
    assert not lifted[:60].any() and not lifted[-60:].any()
