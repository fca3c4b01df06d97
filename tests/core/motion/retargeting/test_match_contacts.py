"""Feet of a body of another size on the source's spots, and skin at the ball; the same body stays as it is."""

import numpy as np
import pytest

from beyond_mocap.motion import contacts, quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting import match_contacts as matching
from beyond_mocap.motion.retargeting.body_points import build_sole_points, measure_sole_heights, place_points
from beyond_mocap.motion.retargeting.retarget import Retargeter
from beyond_mocap.motion.retargeting.twist_bones import compute_twist, measure_roll
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.4, 4.0, 30.0)


def match(walk, size, touches=()):
    """The walk on a body `size` times as large; returns it with both bodies' contacts and soles."""
    on_ground = contacts.detect_heel_toe_contacts(walk)
    retargeter = Retargeter(walk, walk.skeleton.scale(size), standing=on_ground.all(axis=2), keeps_travel=True)
    both = [[build_sole_points(one, side) for side in (one.body.left, one.body.right)]
            for one in (retargeter.source, retargeter.target)]
    feet = matching.read_source_feet(walk, retargeter.source.body, both[0], on_ground)
    found = matching.match_contacts(retargeter.retarget(walk), retargeter.target.body, both[1], feet, touches)
    return found, on_ground, both[1]


def find_toes(motion):
    body = identify_joints(motion.skeleton)
    return forward_kinematics(motion)[0][:, [body.left.toe_or_foot, body.right.toe_or_foot]]


def test_the_same_body_stays(walk):
    found, _, _ = match(walk, 1.0)
    places, expected = forward_kinematics(found.motion)[0], forward_kinematics(walk)[0]
    away = np.linalg.norm((places - expected)[..., :2], axis=-1)
    assert np.percentile(away, 95) < 0.01 and found.miss.max() < 1e-6


@pytest.mark.parametrize("size", [0.9, 1.0, 1.12])
def test_toes_stand_on_the_sources_spots_and_soles_on_the_ground(walk, size):
    found, on_ground, soles = match(walk, size)
    away = np.linalg.norm((find_toes(found.motion) - find_toes(walk))[..., :2], axis=-1)
    assert away[on_ground[:, :, 1]].max() < 1e-3
    places, world = forward_kinematics(found.motion)
    for side, points in enumerate(soles):
        heights = measure_sole_heights(points, places, world)
        assert heights.min() > -1e-3
        assert np.abs(heights[on_ground[:, side].all(axis=1)]).max() < 0.01
    assert found.miss.max() < 1e-3


def test_skin_is_at_the_ball_and_the_other_foot_does_not_care(walk):
    body, frame = identify_joints(walk.skeleton), 30
    on_ground = contacts.detect_heel_toe_contacts(walk)
    side = 0 if not on_ground[frame - 3 : frame + 4, 0].any() else 1
    air = np.flatnonzero(~on_ground[:, side].any(axis=1))
    frame = int(air[len(air) // 2])
    foot = (body.left, body.right)[side].foot
    place = find_toes(walk)[frame, side]
    points = {foot: np.random.default_rng(3).normal(scale=0.04, size=(200, 3))}
    ball = (place + [0.16, 0.0, 0.02])[None]
    touch = matching.PartTouch(joint=foot, points=points, frames=np.array([frame]), ball=ball,
                               distance=np.array([BALL_RADIUS]))
    plain, _, _ = match(walk, 0.95)
    found, _, _ = match(walk, 0.95, (touch,))
    skin = place_points(points, *(values[[frame]] for values in forward_kinematics(found.motion)))
    assert np.linalg.norm(skin[0] - ball[0], axis=1).min() == pytest.approx(BALL_RADIUS, abs=5e-4)
    other = np.abs(find_toes(found.motion) - find_toes(plain.motion))[:, 1 - side]
    assert other.max() < 0.02
    far = np.abs(np.arange(len(walk)) - frame) > matching.TOUCH_SECONDS * walk.fps + 2
    assert np.abs(find_toes(found.motion) - find_toes(plain.motion))[far, side].max() < 0.02


def test_a_ball_out_of_reach_moves_nothing(walk):
    foot = identify_joints(walk.skeleton).left.foot
    far = matching.PartTouch(joint=foot, points={foot: np.zeros((1, 3))}, frames=np.array([20]),
                             ball=np.array([[50.0, 0.0, 0.11]]), distance=np.array([0.11]))
    np.testing.assert_array_equal(match(walk, 1.0, (far,))[0].motion.root_positions,
                                  match(walk, 1.0)[0].motion.root_positions)


def test_the_same_input_gives_the_same_bits(walk):
    first, second = (match(walk, 0.9)[0].motion for _ in range(2))
    assert first.rotations.tobytes() == second.rotations.tobytes()


def test_twist_is_a_share_of_the_roll_without_jumps():
    axis, angles = np.array([0.0, 0.0, 2.0]), np.linspace(-4.0, 4.0, 60)
    roll = quaternion.from_axis_angle(np.tile([0.0, 0.0, 1.0], (60, 1)), angles)
    np.testing.assert_allclose(measure_roll(roll, axis) - measure_roll(roll, axis)[0], angles + 4.0, atol=1e-9)
    half = compute_twist(roll, axis, 0.5)
    np.testing.assert_allclose(np.diff(measure_roll(half, axis)), 0.5 * np.diff(angles), atol=1e-9)
    other_sign = -quaternion.identity(3)
    np.testing.assert_allclose(compute_twist(other_sign, axis, 0.5)[:, 0], 1.0, atol=1e-12)
