"""Motions: where joints are, what lies between frames, and that nothing given is changed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import (
    Motion,
    compute_end_positions,
    compute_pose,
    compute_world_rotation,
    concatenate_motions,
    forward_kinematics,
    place_motion,
    resample,
    sample_frames,
)
from beyond_mocap.motion.skeleton import Skeleton

TREE = Skeleton(
    ("root", "a", "b", "c"),
    (-1, 0, 1, 0),
    [[0, 0, 0], [0.1, 0, 0.4], [0, 0.2, 0.3], [0, -0.1, 0]],
    (2, 3),
    [[0, 0, 0.1], [0.1, 0, 0]],
)


@pytest.fixture
def motion() -> Motion:
    random = np.random.default_rng(0)
    return Motion(TREE, random.normal(size=(20, 3)), random.normal(size=(20, 4, 4)), 30.0)


def test_forward_kinematics_is_the_chain_of_its_parents(motion):
    positions, rotations = forward_kinematics(motion)
    for frame in range(len(motion)):
        turns, places = [], []
        for joint, parent in enumerate(TREE.parents):
            turn = Rotation.from_quat(np.roll(motion.rotations[frame, joint], -1))
            turns.append(turn if parent < 0 else turns[parent] * turn)
            at = (
                motion.root_positions[frame]
                if parent < 0
                else places[parent] + turns[parent].apply(TREE.offsets[joint].copy())
            )
            places.append(at)
        assert np.allclose(positions[frame], places)
        assert np.allclose(quaternion.to_matrix(rotations[frame]), [turn.as_matrix() for turn in turns])
        tip = places[2] + turns[2].apply([0, 0, 0.1])
        assert np.allclose(compute_end_positions(motion)[frame, 0], tip)


def test_of_some_joints_no_bit_differs_and_others_are_unknown(motion):
    chain = [2, 1, 0]
    some, whole = (compute_pose(TREE, motion.root_positions, motion.rotations, joints) for joints in (chain, None))
    for found, every in zip(some, whole):
        assert np.array_equal(found[:, chain], every[:, chain]) and np.isnan(found[:, 3]).all()


@pytest.mark.parametrize("joints", [None, (0, 1, 2, 3, 4, 5, 6, 7, 8, 9)])
def test_few_frames_have_the_same_bits_as_many(joints):
    random, tree = np.random.default_rng(4), (-1, 0, 1, 1, 0, 2, 4, 4, 6, 3, 9, 10)
    skeleton = Skeleton(tuple(map(str, range(12))), tree, random.normal(size=(12, 3)))
    root, local = random.normal(size=(250, 3)), quaternion.normalize(random.normal(size=(250, 12, 4)))
    whole = compute_pose(skeleton, root, local, joints)
    parts = [compute_pose(skeleton, root[at : at + 50], local[at : at + 50], joints) for at in range(0, 250, 50)]
    for together, apart in zip(whole, map(np.concatenate, zip(*parts))):
        assert np.isfinite(together[:, :10]).all() and np.array_equal(together, apart, equal_nan=True)


def test_rotations_are_unit_continuous_and_read_only(motion):
    assert np.allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0)
    assert np.all(np.sum(motion.rotations[1:] * motion.rotations[:-1], axis=-1) >= 0.0)
    with pytest.raises(ValueError):
        motion.rotations[0, 0, 0] = 1.0
    again = Motion(TREE, motion.root_positions, motion.rotations, 30.0)
    assert np.array_equal(again.rotations, motion.rotations)


def test_whole_frames_are_themselves_and_halves_lie_between(motion):
    root, rotations = sample_frames(motion, np.array([3.0, 7.0, 99.0, -5.0]))
    assert np.allclose(root, motion.root_positions[[3, 7, 19, 0]]) and np.allclose(
        rotations, motion.rotations[[3, 7, 19, 0]]
    )
    root, rotations = sample_frames(motion, np.array([3.5]))
    assert np.allclose(root[0], motion.root_positions[3:5].mean(axis=0))
    assert np.allclose(rotations[0], quaternion.slerp(motion.rotations[3], motion.rotations[4], 0.5))


@pytest.mark.parametrize("fps, count", [(60.0, 39), (15.0, 10), (25.0, 16), (29.97, 19)])
def test_resampling_keeps_the_time(motion, fps, count):
    other = resample(motion, fps)
    assert len(other) == count and other.fps == fps and other.duration <= motion.duration + 1e-9
    at = np.arange(count) / fps * 30.0
    expected = [np.interp(at, np.arange(20), motion.root_positions[:, axis]) for axis in range(3)]
    assert np.allclose(other.root_positions, np.stack(expected, axis=-1))
    assert resample(motion, 30.0) is motion


def test_placing_turns_about_the_world_then_moves(motion):
    before, _ = forward_kinematics(motion)
    after, _ = forward_kinematics(place_motion(motion, np.pi / 2, (1.0, 2.0, 3.0)))
    assert np.allclose(after, before[..., (1, 0, 2)] * (-1, 1, 1) + (1.0, 2.0, 3.0))
    angles = np.linspace(0, 1, len(motion))
    each, _ = forward_kinematics(place_motion(motion, angles))
    one, _ = forward_kinematics(place_motion(motion, angles[7]))
    assert np.allclose(each[7], one[7])


def test_cutting_and_joining(motion):
    joined = concatenate_motions([motion.frames(0, 8), motion.frames(8, 20)])
    assert np.allclose(forward_kinematics(joined)[0], forward_kinematics(motion)[0])
    assert len(motion.frames(4, 9)) == 5


def test_one_frame_is_a_motion():
    one = Motion(TREE, np.zeros((1, 3)), quaternion.identity(1, 4), 30.0)
    assert one.duration == 0.0 and len(resample(one, 60.0)) == 1 and sample_frames(one, np.array([0.3]))[0].shape == (1,
            3)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="root"):
        Motion(TREE, np.zeros((5, 3)), quaternion.identity(5, 3), 30.0)
    with pytest.raises(InputError, match="rate"):
        Motion(TREE, np.zeros((5, 3)), quaternion.identity(5, 4), 0.0)


def test_one_joint_turns_in_the_world_as_all_do(motion):
    _, world = forward_kinematics(motion)
    for joint in range(len(motion.skeleton)):
        assert np.allclose(compute_world_rotation(motion.skeleton, motion.rotations, joint), world[:, joint])
