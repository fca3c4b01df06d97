"""The moving frame of a path: its heading where the tangent tells it, carried across where it does not."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.path_editing.path_frame import (
    FRAMES,
    MovingFrame,
    compute_heading,
    from_moving_frame,
    to_moving_frame,
)

FPS = 30.0


def along(angle):
    return np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)


def test_at_a_walk_it_is_the_tangents_own_direction():
    angle = 0.7 * np.arange(120) / FPS
    found = compute_heading(along(angle), np.full(120, 1.4), FPS)
    assert np.abs(found - angle).max() < 2e-3


def test_it_goes_on_turning_beyond_a_full_turn():
    angle = 2.0 * np.arange(200) / FPS
    found = compute_heading(along(angle), np.full(200, 1.4), FPS)
    assert abs(found[-1] - angle[-1]) < 0.02 and np.diff(found).min() > 0.0


def test_who_stands_does_not_spin():
    """He walks east, stands for three seconds while his path curls, and walks north."""
    angle = np.concatenate([np.zeros(60), np.linspace(0.0, 14.0 * np.pi, 90), np.full(60, 0.5 * np.pi)])
    speed = np.concatenate([np.full(60, 1.4), np.full(90, 0.05), np.full(60, 1.4)])
    found = compute_heading(along(angle), speed, FPS)
    assert abs(found[30]) < 1e-3 and abs(found[-30] - 0.5 * np.pi) < 1e-3
    assert np.diff(found).min() > -1e-3 and np.diff(found).max() * FPS < 2.0


def test_vertical_stretches_and_cusps_are_crossed_smoothly():
    tangent = along(np.zeros(120))
    tangent[50:70] = [0.0, 0.0, 1.0]
    found = compute_heading(tangent, np.where(tangent[:, 2] > 0.0, 0.0, 1.4), FPS)
    assert np.abs(found).max() < 1e-3
    back = np.where(np.arange(120) < 60, 0.0, np.pi - 1e-3)
    turned = compute_heading(along(back), np.full(120, 1.4), FPS)
    assert np.isfinite(turned).all() and abs(turned[-1] - back[-1]) < 0.05


def test_a_path_that_leads_nowhere_takes_what_it_is_given():
    still = np.zeros(40)
    assert np.array_equal(compute_heading(along(np.linspace(0, 9, 40)), still, FPS, 1.2), np.full(40, 1.2))
    assert np.isfinite(compute_heading(np.zeros((40, 3)), still, FPS)).all()


@pytest.mark.parametrize("frame", FRAMES)
def test_placing_undoes_relating(frame):
    rng = np.random.default_rng(1)
    moving = MovingFrame(rng.normal(size=(9, 3)), rng.normal(size=9), rng.uniform(-0.5, 0.5, 9))
    root, turned = rng.normal(size=(9, 3)), quaternion.normalize(rng.normal(size=(9, 4)))
    place, own = to_moving_frame(frame, moving, root, turned)
    back, rotations = from_moving_frame(frame, moving, place, own[:, None])
    assert np.abs(back - root).max() < 1e-12
    assert np.abs(np.abs(np.sum(rotations[:, 0] * turned, axis=1)) - 1.0).max() < 1e-12


def test_only_the_tangents_frame_tips_the_body():
    moving = MovingFrame(np.zeros((1, 3)), np.zeros(1), np.array([0.4]))
    up = np.array([[0.0, 0.0, 1.0]])
    lean = {frame: quaternion.rotate(moving.compute_rotations(frame)[1], up)[0] for frame in FRAMES}
    assert np.allclose(lean["path"], up) and np.allclose(lean["absolute"], up)
    assert np.allclose(lean["tangent"], [-np.sin(0.4), 0.0, np.cos(0.4)])
