"""Made throws: the ball goes where it is aimed, at the speed asked, out of a body that stands on the ground."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.throws import STYLES, build_throw


def landed(made, target):
    """Where the ball passes the target's distance, metres."""
    away = np.hypot(*(np.array(target) - made.position)[:2])
    seconds = away / np.hypot(*made.velocity[:2])
    return made.position + seconds * made.velocity - [0.0, 0.0, 0.5 * 9.81 * seconds**2]


@pytest.mark.parametrize("arm", ["left", "right"])
@pytest.mark.parametrize("style", sorted(STYLES))
@pytest.mark.parametrize(
    "target, speed", [((18.0, 0.0, 1.0), 32.0), ((12.0, -5.0, 1.6), 18.0), ((6.0, 2.0, 0.6), 12.0)]
)
def test_hits_what_it_is_aimed_at(arm, style, target, speed):
    made = build_throw(target, speed, arm, style)
    assert np.linalg.norm(landed(made, target) - target) < 0.05
    assert abs(np.linalg.norm(made.velocity) - speed) < 1e-6


def test_the_hand_carries_the_ball_until_release():
    made = build_throw(speed=25.0, fps=480.0)
    body = identify_joints(made.motion.skeleton)
    places, turns = forward_kinematics(made.motion)
    ball = places[:, body.right.hand] + quaternion.rotate(turns[:, body.right.hand], made.grip)
    frame = int(round(made.release * 480.0))
    assert np.linalg.norm(ball[frame] - made.position) < 0.06
    velocity = (ball[frame + 1] - ball[frame - 1]) * 240.0
    assert abs(np.linalg.norm(velocity) - 25.0) < 1.0


def test_feet_stand_on_the_ground_and_do_not_slide():
    made = build_throw(speed=30.0, fps=120.0)
    places, _ = forward_kinematics(made.motion)
    toe = places[:, identify_joints(made.motion.skeleton).left.toe]
    assert places[..., 2].min() > -0.005
    landed_on = toe[int((made.release - 0.05) * 120) :]
    assert np.ptp(landed_on, axis=0).max() < 0.01


def test_elbows_and_knees_bend_the_right_way():
    made = build_throw(speed=30.0)
    places, _ = forward_kinematics(made.motion)
    body = identify_joints(made.motion.skeleton)
    assert np.linalg.norm(np.diff(places, axis=0), axis=-1).max() * 120.0 < 45.0
    for limb in (body.left, body.right):
        assert (places[:, limb.foot, 2] < places[:, limb.lower_leg, 2]).all()


@pytest.mark.parametrize("wrong", [{"arm": "third"}, {"style": "underhand"}, {"speed": 80.0}, {"target": (90.0, 0, 1)}])
def test_what_cannot_be_thrown_is_told(wrong):
    with pytest.raises(InputError):
        build_throw(**{"speed": 20.0} | wrong)
