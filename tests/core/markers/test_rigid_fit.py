"""Technical frames: planted rotations come back, mirrors never, what is not determined is flagged."""

import numpy as np
import pytest

from beyond_mocap.markers.rigid_fit import compute_mean_rotation, fit_rigid, place_points, to_model_frame
from beyond_mocap.motion import quaternion

CLUSTER = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.02], [0.03, 0.12, 0.0], [-0.05, 0.02, 0.09]])


def planted(frames=200, seed=1):
    """(rotations (T, 3, 3), shifts (T, 3)) all round the sphere."""
    chance = np.random.default_rng(seed)
    return quaternion.to_matrix(quaternion.normalize(chance.normal(size=(frames, 4)))), chance.normal(size=(frames, 3))


def carried(rotation, shift, cluster):
    return np.einsum("tij,nj->tni", rotation, cluster) + shift[:, None]


@pytest.mark.parametrize("count", [3, 4])
def test_planted_motions_come_back_from_three_markers_and_more(count):
    rotation, shift = planted()
    fit = fit_rigid(CLUSTER[:count], carried(rotation, shift, CLUSTER[:count]))
    np.testing.assert_allclose(fit.rotation, rotation, atol=1e-9)
    np.testing.assert_allclose(fit.shift, shift, atol=1e-9)
    assert fit.rms.max() < 1e-9 and fit.is_determined.all()
    np.testing.assert_allclose(place_points(fit, CLUSTER), carried(rotation, shift, CLUSTER), atol=1e-9)
    np.testing.assert_allclose(to_model_frame(fit, place_points(fit, CLUSTER))[7], CLUSTER, atol=1e-9)


def test_noise_of_half_a_millimetre_turns_a_hands_breadth_by_less_than_a_degree():
    rotation, shift = planted()
    seen = carried(rotation, shift, CLUSTER) + np.random.default_rng(2).normal(scale=5e-4, size=(200, 4, 3))
    fit = fit_rigid(CLUSTER, seen)
    off = quaternion.to_rotation_vector(quaternion.from_matrix(np.einsum("tij,tkj->tik", fit.rotation, rotation)))
    assert np.degrees(np.sqrt(np.mean(np.sum(off**2, axis=-1)))) < 1.0
    assert 2e-4 < fit.rms.mean() < 1e-3


def test_a_mirrored_cluster_gets_a_rotation_and_no_mirror():
    rotation, shift = planted()
    fit = fit_rigid(CLUSTER, carried(rotation, shift, CLUSTER * [1, -1, 1]))
    np.testing.assert_allclose(np.linalg.det(fit.rotation), 1.0, atol=1e-9)
    assert fit.rms.min() > 0.01


def test_unseen_markers_count_nothing_and_weights_count_as_copies():
    rotation, shift = planted(50)
    seen = carried(rotation, shift, CLUSTER)
    seen[::2, 3] = np.nan
    seen[:, 0] += np.random.default_rng(3).normal(scale=0.002, size=(50, 3))
    fit = fit_rigid(CLUSTER, seen)
    np.testing.assert_allclose(fit.rotation[0], fit_rigid(CLUSTER[:3], seen[0, :3]).rotation)
    twice = fit_rigid(CLUSTER[[0, 0, 1, 2, 3]], seen[:, [0, 0, 1, 2, 3]])
    weighted = fit_rigid(CLUSTER, seen, weights=np.array([2.0, 1.0, 1.0, 1.0]))
    np.testing.assert_allclose(weighted.rotation, twice.rotation, atol=1e-9)
    np.testing.assert_allclose(weighted.rms, twice.rms, atol=1e-12)
    zero = fit_rigid(CLUSTER, seen, weights=np.array([0.0, 1.0, 1.0, 1.0]))
    assert zero.rms.max() < 1e-9


def test_what_does_not_determine_a_rotation_is_flagged_and_nothing_seen_is_nan():
    rotation, shift = planted(4)
    line = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.001, 0.0]])
    fit = fit_rigid(line, carried(rotation, shift, line))
    assert not fit.is_determined.any()
    np.testing.assert_allclose(place_points(fit, line), carried(rotation, shift, line), atol=1e-3)
    seen = carried(rotation, shift, CLUSTER)
    seen[0], seen[1, :3], seen[2, :2] = np.nan, np.nan, np.nan
    fit = fit_rigid(CLUSTER, seen)
    assert fit.is_determined.tolist() == [False, False, False, True]
    assert np.isnan(fit.rotation[0]).all() and np.isnan(fit.rms[0])
    np.testing.assert_allclose(place_points(fit, CLUSTER)[1, 3], seen[1, 3], atol=1e-9)


def test_the_mean_of_rotations_about_one_is_that_one():
    chance = np.random.default_rng(4)
    middle = quaternion.normalize(chance.normal(size=4))
    around = quaternion.from_rotation_vector(0.2 * chance.normal(size=(4000, 3)))
    turned = quaternion.to_matrix(quaternion.multiply(middle, around))
    turned[5] = np.nan
    off = quaternion.to_rotation_vector(quaternion.from_matrix(compute_mean_rotation(turned)
                                                               @ quaternion.to_matrix(middle).T))
    assert np.linalg.norm(off) < 0.02
    half = compute_mean_rotation(np.array([np.eye(3), quaternion.to_matrix(quaternion.from_up_angle(np.array(1.0)))]))
    np.testing.assert_allclose(half, quaternion.to_matrix(quaternion.from_up_angle(np.array(0.5))), atol=1e-12)
    np.testing.assert_allclose(compute_mean_rotation(np.full((2, 3, 3), np.nan)), np.eye(3))
