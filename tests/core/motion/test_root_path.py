"""A path with planted sway: the root keeps the path and leaves the sway."""

import numpy as np
import pytest

from beyond_mocap.motion.path.smooth_spline import SLACK, compute_root_path

FPS = 30.0
TIME = np.arange(150) / FPS
SWAY = np.stack([0.02 * np.sin(2 * np.pi * 2.4 * TIME), 0.03 * np.sin(2 * np.pi * 1.2 * TIME)], axis=1)


@pytest.mark.parametrize("fps", (30.0, 60.0))
def test_the_sway_goes_and_the_path_stays(fps):
    time = np.arange(int(5 * fps)) / fps
    path = np.stack([3.0 * time, 2.0 * np.sin(0.5 * time)], axis=1)
    sway = np.stack([0.02 * np.sin(2 * np.pi * 2.4 * time), 0.03 * np.sin(2 * np.pi * 1.2 * time)], axis=1)
    line, _ = compute_root_path(path + sway, np.zeros(len(time)), fps)
    inner = slice(int(fps), -int(fps))  # the ends are known from one side only
    assert np.linalg.norm(line - path, axis=1)[inner].max() < 0.02
    assert np.linalg.norm(line - path - sway, axis=1).max() < 1.2 * SLACK


def test_it_stays_near_where_the_body_turns_sharply():
    path = np.stack([np.abs(TIME - 2.5) * -4.0, np.zeros(len(TIME))], axis=1)
    line, _ = compute_root_path(path, np.zeros(len(TIME)), FPS)
    assert np.linalg.norm(line - path, axis=1).max() < 1.3 * SLACK


def test_straight_is_straight_and_ends_near_the_body():
    path = np.stack([3.0 * TIME, 0.3 * np.sin(TIME)], axis=1)
    line, facing = compute_root_path(path + SWAY, 0.2 * np.sin(TIME), FPS, "straight")
    along = line[-1] - line[0]
    off = (line - line[0]) @ np.array([-along[1], along[0]]) / np.linalg.norm(along)
    assert np.abs(off).max() < 1e-9 and np.ptp(facing) == 0 and np.linalg.norm(line[-1] - path[-1]) < 0.2


def test_who_stands_has_a_root_that_stands():
    line, _ = compute_root_path(SWAY, np.zeros(len(TIME)), FPS, "straight")
    assert np.ptp(line, axis=0).max() == 0
