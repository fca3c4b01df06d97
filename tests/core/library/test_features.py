"""Features know the movement, and neither where on the pitch nor in which direction it went."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.library.clip import Clip
from beyond_mocap.library.features import (
    HORIZON,
    build_frames,
    compute_raw_features,
    reduce_to_principal_components,
    sample_positions,
    select_feature_joints,
)
from beyond_mocap.motion.humanoid import compute_heading_from_positions
from beyond_mocap.motion.motion import place_motion
from beyond_mocap.synthetic.gait import build_gait

WALK = build_gait(1.6, 3.0, 60.0, turn_rate=0.4)


def features(motion, fps=30.0):
    _, positions = sample_positions(motion, fps)
    heading = np.unwrap(compute_heading_from_positions(motion.skeleton, positions))
    return compute_raw_features(positions[:, select_feature_joints(motion.skeleton)], heading, fps)


@settings(max_examples=15, deadline=None)
@given(st.floats(-4, 4), st.floats(-50, 50), st.floats(-50, 50))
def test_turning_and_moving_a_recording_changes_nothing(angle, x, y):
    assert np.allclose(features(WALK), features(place_motion(WALK, angle, (x, y, 0.0))), atol=1e-9)


def test_height_changes_the_height_alone():
    change = features(place_motion(WALK, 0.0, (0.0, 0.0, 0.3))) - features(WALK)
    moved = np.flatnonzero(np.abs(change[10]) > 1e-9)
    joints = len(select_feature_joints(WALK.skeleton))
    assert moved.tolist() == [3 * joint for joint in range(joints)]
    assert np.allclose(change[:, moved], 0.3 / np.sqrt(joints))


def test_distance_is_the_mean_over_joints_of_places_an_instant_later():
    """Two bodies that differ by 1 m/s at every joint alone are 0.12 s x 1 m/s apart."""
    places = np.zeros((40, 5, 3))
    places[:, :, 0] = np.arange(40)[:, None] / 30.0
    still, moving = (compute_raw_features(p, np.zeros(40), 30.0) for p in (places * 0.0, places))
    assert np.allclose(np.linalg.norm(moving - still, axis=1), HORIZON * 1.0)


def test_path_heading_and_speed_follow_the_recording():
    moved = place_motion(WALK, 1.1, (3.0, -2.0, 0.0))
    a, b = (build_frames([clip(m)]) for m in (WALK, moved))
    assert np.allclose(a.velocity, b.velocity, atol=1e-9) and np.allclose(b.heading - a.heading, 1.1, atol=1e-9)
    cosine, sine = np.cos(1.1), np.sin(1.1)
    turned = a.path @ np.array([[cosine, sine], [-sine, cosine]]) + [3.0, -2.0]
    assert np.allclose(turned, b.path, atol=1e-9)
    assert np.allclose(distances_within(a.features), distances_within(b.features), atol=1e-4)


def clip(motion):
    return Clip(path="made.bvh", mirrored=False, motion=motion, annotations=(),
                heel_toe_contacts=np.zeros((len(motion), 2, 2), bool))


def distances_within(features):
    return np.linalg.norm(features[:, None] - features[None], axis=2)


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0, 100.0])
def test_derivatives_do_not_depend_on_the_recording_s_rate(fps):
    motion = build_gait(1.6, 3.0, fps, turn_rate=0.4)
    source, positions = sample_positions(motion, 30.0)
    assert len(source) == len(positions) and np.all(source <= len(motion) - 1 + 1e-9)
    assert np.sqrt(np.mean((features(motion)[5:-5] - features(WALK)[5:-5]) ** 2)) < 0.01


def test_short_clips_have_features():
    for count in (1, 2, 3):
        short = features(WALK.frames(0, count), 60.0)
        assert len(short) == count and np.all(np.isfinite(short))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 40), st.integers(1, 9), st.floats(0.5, 0.999))
def test_the_fewest_components_that_hold_the_energy(seed, rows, columns, energy):
    random = np.random.default_rng(seed)
    values = random.normal(size=(rows, columns)) * random.uniform(0.01, 3.0, columns)
    mean, basis, reduced = reduce_to_principal_components(values.copy(), energy)
    centred = values - mean
    assert np.array_equal(reduced, centred @ basis)
    held = [np.sum((centred @ basis[:, :kept]) ** 2) / np.sum(centred**2) for kept in range(basis.shape[1] + 1)]
    assert np.allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-9)
    assert held[-1] >= energy - 1e-9 and held[-2] < energy + 1e-9


def test_values_without_variance_keep_one_component():
    mean, basis, _ = reduce_to_principal_components(np.ones((5, 3)))
    assert basis.shape == (3, 1) and np.allclose(mean, 1.0)


def test_the_library_s_features_hold_98_percent(library):
    raw, shown = [], []
    for number, item in enumerate(library.clips):
        raw.append(features(item.motion))
        shown.append(library.frames.features[library.frames.clip == number])
    raw, shown = np.concatenate(raw), np.concatenate(shown)
    share = np.sum(shown.astype(float) ** 2) / np.sum((raw - raw.mean(axis=0)) ** 2)
    assert 0.98 - 1e-4 <= share <= 1.0
    assert shown.dtype == np.float32


def test_fingers_and_joints_on_their_parents_take_no_part():
    joints = select_feature_joints(WALK.skeleton)
    names = [WALK.skeleton.names[j] for j in joints]
    assert joints[0] == 0 and "LeftHand" in names and not any("Index" in name or "Thumb" in name for name in names)
