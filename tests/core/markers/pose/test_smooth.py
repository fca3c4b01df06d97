"""The whole sequence at once: noise goes, motion stays, windows leave no seam."""

import numpy as np
import pytest

from beyond_mocap.markers.pose import smooth as module
from beyond_mocap.markers.pose.chain import build_poses, compute_world_poses
from beyond_mocap.markers.pose.descent import HeldPoint, PoseTask, descend
from beyond_mocap.markers.pose.smooth import smooth_poses
from beyond_mocap.motion import quaternion
from tests.core.markers.small_chain import HINGE, SKELETON, build_small_chain

FPS = 100.0


def swinging(made, count=90):
    """Poses that swing slowly, the hinge too."""
    seconds = np.arange(count)[:, None, None] / FPS
    phase = np.linspace(0.0, 3.0, 3 * len(SKELETON)).reshape(len(SKELETON), 3)
    turns = quaternion.from_rotation_vector(0.4 * np.sin(4.0 * seconds + phase))
    turns[:, HINGE] = quaternion.from_euler(0.5 + 0.3 * np.sin(4.0 * seconds[:, 0, 0])[:, None], made.order[HINGE][:1])
    return build_poses(made, np.stack([np.linspace(0.0, 1.0, count), np.zeros(count), np.ones(count)], axis=1), turns)


def task_of(made, truth, noise=0.004, **more):
    placed = compute_world_poses(made, truth)
    seen = placed.markers + placed.origin + np.random.default_rng(2).normal(0.0, noise, placed.markers.shape)
    weights = np.ones((len(made.joint), seen.shape[-1]))
    return PoseTask(chain=made, seen=seen, weights=weights, stiffness=np.full((len(SKELETON), 3), 1e-3), **more)


def off(truth, found):
    """Root mean square angle between local rotations, degrees."""
    gap = quaternion.multiply(
        quaternion.inverse(np.moveaxis(truth.local, 1, -1)), np.moveaxis(found.local, 1, -1))
    return np.degrees(np.sqrt(np.mean(np.sum(quaternion.to_rotation_vector(gap) ** 2, axis=-1))))


def test_noise_goes_and_the_motion_stays():
    made = build_small_chain()
    truth = swinging(made)
    task = task_of(made, truth)
    rough = descend(task, truth).poses
    found, held = smooth_poses(task, rough, 0.03, FPS)
    assert off(truth, found) < 0.6 * off(truth, rough)
    assert not held.any()
    assert np.all(found.angles[HINGE, 1:] == 0.0)


def test_windows_leave_no_seam(monkeypatch):
    made = build_small_chain()
    truth = swinging(made)
    task = task_of(made, truth)
    rough = descend(task, truth).poses
    whole, _ = smooth_poses(task, rough, 0.02, FPS)
    monkeypatch.setattr(module, "_WINDOW_FRAMES", 25)
    monkeypatch.setattr(module, "_LOOK_AHEAD_FRAMES", 25)
    pieces, _ = smooth_poses(task, rough, 0.02, FPS)
    assert off(whole, pieces) < 0.05


def test_frames_without_markers_are_bridged():
    made = build_small_chain()
    truth = swinging(made)
    task = task_of(made, truth, noise=0.0)
    task.weights[:, 40:50] = 0.0
    start = truth.copy_arrays()
    start.local[..., 40:50] = truth.local[..., 39:40]
    found, _ = smooth_poses(task, start, 0.02, FPS)
    assert off(truth.select_frames(slice(40, 50)), found.select_frames(slice(40, 50))) < 1.0


def test_a_held_point_takes_part():
    made = build_small_chain()
    truth = swinging(made, 30)
    placed = compute_world_poses(made, truth)
    spot = np.array([0.0, 0.1, 0.0])
    there = placed.joints[4] + np.einsum("abf,b->af", placed.world[4], spot) + placed.origin
    seen = there + np.array([0.0, 0.0, 0.04])[:, None]
    point = HeldPoint(joint=4, place=spot, radius=0.02, seen=seen, weight=np.full(30, 100.0))
    task = task_of(made, truth, noise=0.0, point=point)
    found, alone = smooth_poses(task, truth, 1e-4, FPS)[0], descend(task, truth).poses
    assert off(alone, found) < 0.2 < off(truth, found)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_frames_are_no_harm(count):
    made = build_small_chain()
    truth = swinging(made, count)
    found, _ = smooth_poses(task_of(made, truth), truth, 0.02, FPS)
    assert np.isfinite(found.local).all() and found.root.shape == (3, count)
