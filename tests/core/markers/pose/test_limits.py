"""Limits: held exactly, whatever the markers say, and the rest of the body finds its best beside them."""

import numpy as np
import pytest

from beyond_mocap.markers.pose import limits
from beyond_mocap.markers.pose.chain import compute_world_poses, read_angles
from beyond_mocap.markers.pose.descent import PoseTask, descend
from beyond_mocap.motion import quaternion
from tests.core.markers.small_chain import HINGE, SKELETON, build_small_chain, sample_poses

ARM = 2


def bound(joint, angle, low, high, **more):
    """The small chain with one angle of one joint limited, in radians."""
    lows, highs = np.full((len(SKELETON), 3), -np.inf), np.full((len(SKELETON), 3), np.inf)
    lows[joint, angle], highs[joint, angle] = low, high
    return build_small_chain(low=lows, high=highs, **more)


def task_of(made, truth):
    placed = compute_world_poses(made, truth)
    seen = placed.markers + placed.origin
    return PoseTask(chain=made, seen=seen, weights=np.ones((len(made.joint), seen.shape[-1])),
                    stiffness=np.full((len(SKELETON), 3), 1e-3))


def posed(made, joint, angles, count=6):
    """Random poses with this joint at these angles."""
    at = sample_poses(made, count, size=0.3)
    at.local[joint] = quaternion.from_euler(np.array(angles), made.order[joint])[:, None]
    at.angles[joint] = np.array(angles)[:, None] * ~np.array(made.is_fully_free)[joint]
    return at


@pytest.mark.parametrize("joint", [ARM, HINGE])
def test_a_joint_beyond_its_limit_comes_back_to_it(joint):
    free, made = build_small_chain(), bound(joint, 0, -0.5, 0.5)
    truth = posed(free, joint, (0.9, 0.0, 0.0))
    arrived = descend(task_of(made, truth), sample_poses(made, 6, seed=4, size=0.2))
    angles = read_angles(made, joint, arrived.poses.local[joint])
    assert np.abs(angles[0] - 0.5).max() < 1e-6
    assert arrived.held[joint].all()
    assert np.all(np.linalg.norm(arrived.poses.root - truth.root, axis=0) < 0.05)


def test_beside_a_limit_the_rest_is_as_good_as_can_be():
    free, made = build_small_chain(), bound(ARM, 0, -0.5, 0.5)
    truth = posed(free, ARM, (0.9, 0.2, 0.1))
    arrived = descend(task_of(made, truth), sample_poses(made, 6, seed=4, size=0.2))
    other = descend(task_of(made, truth), arrived.poses)
    assert np.abs(other.cost - arrived.cost).max() < 1e-6 * arrived.cost.max()
    unlimited = descend(task_of(free, truth), arrived.poses)
    assert np.all(unlimited.cost < 1e-3 * arrived.cost) and not unlimited.held.any()


def test_what_stays_within_is_not_touched():
    made = bound(ARM, 0, -0.5, 0.5)
    truth = posed(made, ARM, (0.4, 0.2, 0.1))
    arrived = descend(task_of(made, truth), sample_poses(made, 6, seed=4, size=0.2))
    assert not arrived.held.any() and arrived.cost.max() < 1e-5
    kept = limits.apply_limits(made, limits.find_limited_joints(made), truth)[0]
    assert np.array_equal(kept.local, truth.local)


def test_limits_beyond_a_quarter_turn_are_understood():
    made = bound(ARM, slice(None), [-1.0, -0.5, -1.0], [1.0, 2.6, 1.0])
    angles = read_angles(made, ARM, quaternion.from_euler(np.array([0.2, 2.2, -0.3]), made.order[ARM])[:, None])
    assert angles[:, 0] == pytest.approx([0.2, 2.2, -0.3])


def test_near_the_pole_the_outer_angles_stop_nothing():
    made = bound(ARM, 0, -0.2, 0.2)
    truth = posed(made, ARM, (1.0, np.pi / 2 - 0.02, 0.3))
    kept = limits.apply_limits(made, limits.find_limited_joints(made), truth)[0]
    assert np.array_equal(kept.local, truth.local)
