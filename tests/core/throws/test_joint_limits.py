"""Joint limits that are learnt, and hinges that do not bend backwards."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.limits import FREE_RANGE, JointLimits, estimate_joint_limits

SKELETON = build_adult_skeleton()


@pytest.fixture(scope="module")
def thrown():
    return np.concatenate([build_throw((18.0, y, 1.0), fps=60.0).motion.rotations for y in (-2.0, 0.0, 2.0)])


@pytest.fixture(scope="module")
def limits(thrown):
    return JointLimits(SKELETON, estimate_joint_limits(thrown))


def test_what_was_learnt_from_lies_within(thrown, limits):
    local = quaternion.to_matrix(thrown)
    kept, over = limits.limit_rotations(local)
    assert over.max() < 1e-9 and limits.measure_excess(local).max() < 1e-9
    assert np.array_equal(kept, local)


def test_a_joint_turned_too_far_comes_back_to_the_end_of_its_range(thrown, limits):
    local = quaternion.to_matrix(thrown[:5])
    joint = SKELETON.index("Neck")
    far = local.copy()
    far[:, joint] = far[:, joint] @ quaternion.to_matrix(quaternion.from_rotation_vector(np.array([0.0, 0.0, 2.0])))
    kept, over = limits.limit_rotations(far)
    assert over[:, joint].min() > 0.3 and limits.measure_excess(kept).max() < 1e-6
    others = [j for j in range(len(SKELETON)) if j != joint]
    assert np.array_equal(kept[:, others], far[:, others]) and over[:, others].max() < 1e-9


@pytest.mark.parametrize("name", ["LeftLeg", "RightLeg", "LeftForeArm", "RightForeArm"])
def test_a_hinge_does_not_bend_backwards(thrown, limits, name):
    joint = SKELETON.index(name)
    number = [hinge.joint for hinge in limits.hinges].index(joint)
    hinge = limits.hinges[number]
    local = quaternion.to_matrix(thrown[:1])
    assert limits.measure_bends(local)[0, number] > 0.0
    bent = quaternion.to_matrix(quaternion.from_rotation_vector(-0.5 * hinge.across))
    local[:, joint] = bent
    assert limits.measure_bends(local)[0, number] < -0.4
    kept, over = limits.limit_rotations(local)
    assert over[0, joint] > 0.3 and limits.measure_bends(kept)[0, number] >= -np.radians(5.0) - 1e-9


def test_a_joint_past_half_a_turn_from_the_middle_stays_on_its_side():
    rows = np.zeros((len(SKELETON), 3, 3))
    rows[:, 1:] = [[-FREE_RANGE] * 3, [FREE_RANGE] * 3]
    joint = SKELETON.index("RightArm")
    rows[joint, 1:] = [[-0.1, -0.1, -0.5], [0.1, 0.1, 3.0]]
    limits = JointLimits(SKELETON, rows)
    far = np.zeros((1, len(SKELETON), 3))
    far[0, joint, 2] = 3.3
    kept, over = limits.limit_rotations(quaternion.to_matrix(quaternion.from_rotation_vector(far)))
    end = quaternion.to_rotation_vector(quaternion.from_matrix(kept))[0, joint, 2]
    assert end == pytest.approx(3.0, abs=1e-6) and over[0, joint] == pytest.approx(0.3, abs=1e-6)


def test_the_range_lies_about_the_middle():
    angles = np.concatenate([np.full(90, -1.0), np.linspace(-1.0, 2.0, 10)])
    middle, low, high = estimate_joint_limits(quaternion.from_rotation_vector(np.array([[[0.0, 0.0, a]]
            for a in angles])), free_joints=())[0]
    assert np.allclose(middle, [0, 0, 0.5], atol=1e-6) and np.allclose(low, -high, atol=1e-6)
    assert high[2] == pytest.approx(1.5 + np.radians(10.0) + 0.24, abs=1e-6)


def test_the_root_is_free(thrown):
    limits = estimate_joint_limits(thrown)
    assert np.array_equal(limits[0, 1:], [[-FREE_RANGE] * 3, [FREE_RANGE] * 3])


def test_the_mean_is_found_on_both_sides_of_the_sphere():
    q = quaternion.from_rotation_vector(np.array([[[0.0, 0.0, a]] for a in (2.6, 2.8, 3.0, 3.2, 3.4)]))
    middle, low, high = estimate_joint_limits(q, free_joints=())[0]
    assert np.allclose(np.abs(middle), [0, 0, 3.0], atol=1e-6)
    assert high[2] < 0.7 and low[2] > -0.7


@pytest.mark.parametrize("bad", [np.zeros((3, 3, 3)), np.full((22, 3, 3), np.nan)])
def test_limits_of_another_body_are_refused(bad):
    with pytest.raises(InputError, match="joint limits"):
        JointLimits(SKELETON, bad)
