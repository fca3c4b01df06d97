"""The foot of a reception is slow around its touch, where it was, and does not kick to catch up."""

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import build_surfaces
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import sample_frames
from beyond_mocap.synthesis.construct.calm_foot import CALM_SPEED, calm_foot
from beyond_mocap.synthesis.construct.move_body_part import Body
from beyond_mocap.synthetic.actions.receptions import build_reception

FPS = 60.0
HURRIED = 1.3  # factor on the pace of a reception


@pytest.fixture(scope="module")
def scene():
    """A reception in a run, played too fast, with the frame of its touch and the foot."""
    move = build_reception("inside", fps=FPS, speed=3.5, height=0.45)
    key = int(round(move.key * FPS))
    body = Body.from_pose(move.motion.skeleton, *sample_frames(move.motion, key + HURRIED * np.arange(-30.0, 31.0)))
    foot, = build_surfaces(move.motion.skeleton, ("receive", "right", "foot", "low", "inside"))
    return body, foot


def measure_speed(body: Body) -> np.ndarray:
    human = identify_joints(body.skeleton)
    away = body.places[:, human.right.foot] - body.places[:, human.hips]
    return np.linalg.norm(np.gradient(away, axis=0), axis=1) * FPS


def test_a_hurried_foot_is_slowed_down_around_the_touch(scene):
    body, foot = scene
    calm = calm_foot(body, foot, (30, 30), np.zeros(61, bool), FPS)
    near = slice(30 - 8, 30 + 9)

    assert measure_speed(body)[near].max() > 1.2 * CALM_SPEED
    assert measure_speed(calm)[near].max() < 3.0

    assert measure_speed(calm).max() <= max(5.5, 1.16 * measure_speed(body).max())
    np.testing.assert_allclose(calm.places[30], body.places[30], atol=1e-6)
    np.testing.assert_allclose(calm.places[[0, -1]], body.places[[0, -1]], atol=1e-6)
    other = identify_joints(body.skeleton).left.foot
    np.testing.assert_allclose(calm.places[:, other], body.places[:, other], atol=1e-9)


def test_a_foot_on_the_ground_stays_there(scene):
    body, foot = scene
    standing = np.arange(61) > 36
    calm = calm_foot(body, foot, (30, 30), standing, FPS)
    ankle = identify_joints(body.skeleton).right.foot
    np.testing.assert_allclose(calm.places[standing, ankle], body.places[standing, ankle], atol=1e-6)


def test_a_slow_foot_is_left_alone():
    move = build_reception("inside", fps=FPS)
    body = Body.from_pose(move.motion.skeleton, move.motion.root_positions, move.motion.rotations)
    foot, = build_surfaces(move.motion.skeleton, ("receive", "right", "foot", "low", "inside"))
    key = int(round(move.key * FPS))
    assert calm_foot(body, foot, (key, key), np.zeros(len(move.motion), bool), FPS) is body
