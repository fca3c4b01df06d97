"""Poses near and far from a library, and the smoothness curve."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.evaluation import realism
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics, place_motion
from beyond_mocap.motion.quaternion import from_rotation_vector
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton

FPS = 30.0
SKELETON = build_adult_skeleton()
BODY = identify_joints(SKELETON)


def swinging(count=90, speed=1.5, amount=0.4, seed=0):
    """A body travelling along +X with swinging joints, (T, J, 3) m and the motion."""
    random = np.random.default_rng(seed)
    t = np.arange(count) / FPS
    phase = random.uniform(0, 6, (len(SKELETON), 3))
    turns = amount * np.sin(2 * np.pi * t[:, None, None] + phase)
    turns[:, 0] = 0.0
    root = np.stack([speed * t, 0 * t, 0 * t + 0.95], axis=-1)
    motion = Motion(SKELETON, root, from_rotation_vector(turns), FPS)
    return motion


def features(motion):
    return realism.build_pose_features(SKELETON, forward_kinematics(motion)[0], FPS, BODY.hips)


def test_place_and_heading_on_the_pitch_do_not_matter():
    motion = swinging()
    np.testing.assert_allclose(features(place_motion(motion, 2.1, (30.0, -7.0, 0.0))), features(motion), atol=2e-5)


def test_speed_does_matter():
    slow, fast = features(swinging(speed=1.0)), features(swinging(speed=3.0))
    distance = np.linalg.norm(slow - fast, axis=1)
    # all joints 2 m/s apart, weighed by 0.12 s
    np.testing.assert_allclose(distance, 0.24, atol=2e-3)


def test_a_copy_is_near_and_a_contortion_is_far():
    library = features(swinging(seed=1))
    copied = realism.measure_nearest_distance(features(swinging(seed=1))[10:40], library)
    assert copied.max() < 2e-3
    assert realism.measure_nearest_distance(features(swinging(seed=1, amount=1.5))[10:40], library).min() > 0.02


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_nearest_distance_is_the_smallest_of_all(seed):
    random = np.random.default_rng(seed)
    a, b = random.normal(size=(7, 12)).astype(np.float32), random.normal(size=(30, 12)).astype(np.float32)
    owner = random.integers(0, 3, 30)
    mine = random.integers(0, 3, 7)
    every = np.linalg.norm(a[:, None] - b, axis=-1)
    nearest, enough = every.min(axis=1), random.uniform(1.0, 5.0, 7)
    np.testing.assert_allclose(realism.measure_nearest_distance(a, b), nearest, atol=1e-3)
    bound = realism.bound_nearest_distance(a, realism.split_library(b), enough)
    np.testing.assert_array_equal(bound > enough, nearest > enough)
    np.testing.assert_allclose(bound[nearest > enough], nearest[nearest > enough], atol=1e-3)
    every[mine[:, None] == owner] = np.inf
    np.testing.assert_allclose(realism.measure_nearest_distance(a, b, mine, owner), every.min(axis=1), atol=1e-3)


def test_the_mirrored_pose_of_a_mirrored_pose_is_the_pose():
    own = features(swinging())
    twin = realism.mirror_features(own, BODY)
    assert np.abs(twin - own).max() > 0.01
    np.testing.assert_allclose(realism.mirror_features(twin, BODY), own, atol=1e-6)


def test_unreal_compares_at_the_speed():
    real = realism.compute_class_p95(np.concatenate([np.full(50, 0.1), np.full(50, 0.3)]), np.repeat([0.5, 3.5], 50))
    flags = realism.find_unreal_frames(np.array([0.2, 0.2, 0.4]), np.array([0.5, 3.5, 6.0]), real)
    np.testing.assert_array_equal(flags, [True, False, True])


def test_a_class_needs_three_recordings_with_a_second_each():
    owner, speed = np.repeat([0, 1, 2, 3], 20), np.repeat([0.5, 0.6, 0.7, 6.0], 20)
    owner, speed = np.append(owner, [0] * 9), np.append(speed, [3.5] * 9)  # nine poses are not enough
    counts = realism.count_recordings(owner, speed, 10)
    assert counts.tolist() == [3, 0, 0, 0, 1]
    limits = realism.compute_pose_limits(np.where(speed > 4.0, 5.0, 0.1), speed, counts)
    assert limits[0] == pytest.approx(0.1) and np.isnan(limits[1:]).all()
    flags = realism.find_unreal_frames(np.array([0.2, 0.05, 9.0]), np.array([0.5, 0.5, 6.0]), limits)
    np.testing.assert_array_equal(flags, [1.0, 0.0, np.nan])


def test_smoothness_peaks_at_a_cut():
    places = [forward_kinematics(swinging(seed=seed))[0] for seed in (1, 2)]
    cut = realism.measure_smoothness(SKELETON, np.concatenate([places[0][:40], places[1][40:80]]), FPS)
    uncut = realism.measure_smoothness(SKELETON, places[0], FPS)
    assert len(cut) == 79 and 37 <= np.argmax(cut) <= 41 and cut.max() > 3 * uncut.max()
    assert realism.measure_smoothness(SKELETON, np.repeat(places[0][:1], 5, axis=0), FPS) == pytest.approx(np.zeros(4))


def test_smoothness_is_real_at_its_speed():
    curve = np.concatenate([np.linspace(0.0, 1.0, 101), [np.nan], np.linspace(2.0, 3.0, 101)])
    real = realism.compute_class_p95(curve, np.repeat([0.5, 0.5, 3.5], [101, 1, 101]))
    assert real == pytest.approx([0.95, 0.95, 2.95, 2.95, 2.95])
