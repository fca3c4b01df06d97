"""Heads that follow a ball: on it where a neck can, and never with a jerk."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.construct.gaze import MAX_YAW, compute_head_angles, follow_with_gaze
from beyond_mocap.synthesis.construct.pins import estimate_look_axis
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


@pytest.fixture(scope="module")
def standing():
    return build_gait(0.0, 6.0, FPS, seed=4)


@pytest.fixture(scope="module")
def look(standing):
    return estimate_look_axis(standing.skeleton, standing.rotations)


def sight(motion, look):
    """(T, 3) unit where the head looks, and (T, 3) m where it is."""
    places, world = forward_kinematics(motion)
    head = identify_joints(motion.skeleton).head
    return quaternion.rotate(world[:, head], np.broadcast_to(look, (len(motion), 3))), places[:, head]


def off(motion, look, ball):
    """(T,) radians between where the head looks and the ball."""
    way, head = sight(motion, look)
    away = ball - head
    return np.arccos(np.clip(np.sum(way * away, axis=1) / np.linalg.norm(away, axis=1), -1.0, 1.0))


def test_the_gaze_is_on_a_ball_ahead(standing, look):
    """Planted: a ball that goes slowly from side to side, up and down, within what a neck can."""
    times = np.arange(len(standing)) / FPS
    angle, height = 0.8 * np.sin(0.9 * times), 1.6 + 1.2 * np.sin(0.7 * times)
    ball = np.column_stack([5.0 * np.cos(angle), 5.0 * np.sin(angle), height])
    assert off(standing, look, ball).max() > 0.6
    assert np.degrees(off(follow_with_gaze(standing, ball, look), look, ball)).max() < 3.0


@pytest.mark.parametrize("way", ["overhead", "behind", "beside"])
def test_nothing_snaps(standing, look, way):
    """A fast ball over the head, round the back, or past the shoulder: the head turns no faster than heads do."""
    x = np.linspace(-12.0, 12.0, len(standing))
    ball = {
        "overhead": np.column_stack([x, 0.02 + 0 * x, 3.2 + 0 * x]),
        "behind": np.column_stack([-2.0 + 0 * x, 0.6 * x, 0.4 + 0 * x]),
        "beside": np.column_stack([x, 1.0 + 0 * x, 1.0 + 0 * x]),
    }[way]
    way, _ = sight(follow_with_gaze(standing, ball, look), look)
    speed = np.linalg.norm(np.diff(way, axis=0), axis=1) * FPS
    assert np.degrees(speed.max()) < 330.0
    assert np.degrees(np.abs(np.diff(speed)).max() * FPS) < 2500.0


def test_head_angles_have_no_edge_but_straight_up():
    """All round the body and at every height but straight up and down, a degree makes a small difference."""
    turn = np.radians(np.arange(-180.0, 180.5, 0.5))
    for up in np.radians(np.arange(-70.0, 71.0, 10.0)):
        seen = np.column_stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up) + 0 * turn])
        angles = compute_head_angles(seen)
        assert np.abs(np.diff(angles, axis=0)).max() < np.radians(2.5)
        np.testing.assert_allclose(angles[0], angles[-1], atol=1e-6)
        assert np.abs(angles[:, 0]).max() <= MAX_YAW + 1e-9
    mirrored = compute_head_angles(seen * [1.0, -1.0, 1.0])
    np.testing.assert_allclose(mirrored * [-1.0, 1.0], angles, atol=1e-12)


def test_only_head_neck_and_chest_turn_and_only_by_their_share(standing, look):
    ball = np.tile([2.0, 4.0, 1.0], (len(standing), 1))
    share = np.zeros(len(standing))
    share[60:] = 1.0
    found, body = follow_with_gaze(standing, ball, look, share), identify_joints(standing.skeleton)
    assert found.rotations[:60].tobytes() == standing.rotations[:60].tobytes()
    changed = np.flatnonzero(np.abs(found.rotations - standing.rotations).max(axis=(0, 2)) > 1e-9)
    assert set(changed) == {body.chest, body.neck, body.head}
    still = follow_with_gaze(standing, ball, look, chest=0.0)
    np.testing.assert_allclose(still.rotations[:, body.chest], standing.rotations[:, body.chest], atol=1e-12)


def test_nothing_to_see_changes_nothing(standing, look):
    ball = np.full((len(standing), 3), np.nan)
    assert follow_with_gaze(standing, ball, look) is standing
    ball[:60] = [3.0, 2.0, 1.0]
    found = follow_with_gaze(standing, ball, look)
    assert np.all(np.isfinite(found.rotations))
    assert found.rotations[60:].tobytes() == standing.rotations[60:].tobytes()
