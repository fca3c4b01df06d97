"""Shapes of clusters: the planted shape and its noise come back, whatever a few frames do; distances between markers
tell bodies apart."""

import numpy as np
import pytest

from beyond_mocap.markers.cleaning.cluster_shape import (
    compute_mean_shape,
    compute_median,
    compute_medians,
    compute_quantile,
    measure_distance_spread,
)
from beyond_mocap.motion import quaternion

CLUSTER = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.02], [0.03, 0.12, 0.0], [-0.05, 0.02, 0.09]])


def moving(cluster, frames=300, seed=1):
    chance = np.random.default_rng(seed)
    vectors = np.cumsum(chance.normal(scale=0.1, size=(frames, 3)), 0)
    turn = quaternion.to_matrix(quaternion.from_rotation_vector(vectors))
    way = np.cumsum(chance.normal(scale=0.02, size=(frames, 3)), axis=0)
    return np.einsum("tij,nj->tni", turn, cluster) + way[:, None]


def lengths(places):
    return np.linalg.norm(places[:, None] - places[None], axis=-1)


def test_the_planted_shape_and_each_markers_noise_come_back():
    noise = np.array([0.001, 0.001, 0.001, 0.004])
    seen = moving(CLUSTER) + np.random.default_rng(2).normal(size=(300, 4, 3)) * noise[:, None]
    shape = compute_mean_shape(seen)
    np.testing.assert_allclose(lengths(shape.places), lengths(CLUSTER), atol=0.001)
    assert shape.sigma[3] > 1.5 * shape.sigma[:3].max()
    assert 0.002 < shape.sigma[3] < 0.01


def test_swaps_ghosts_and_gaps_do_not_bend_it():
    seen = moving(CLUSTER)
    seen[50:90, [0, 1]] = seen[50:90, [1, 0]]
    seen[100:130, 2] += 0.3
    seen[::3, 3] = np.nan
    np.testing.assert_allclose(lengths(compute_mean_shape(seen).places), lengths(CLUSTER), atol=0.001)


def test_two_bodies_are_distinguished_by_their_distances():
    two = np.concatenate([moving(CLUSTER, seed=3), moving(CLUSTER[::-1], seed=4)], axis=1)[:, [0, 4, 1, 5, 2, 6, 3, 7]]
    distance, spread = measure_distance_spread(two)
    np.testing.assert_allclose(distance[0, 2], np.linalg.norm(CLUSTER[1] - CLUSTER[0]))
    assert spread[0, 2] < 1e-9 < 0.05 < spread[0, 1]


def test_quantiles_are_numpys_and_leave_out_nan():
    values = np.random.default_rng(5).normal(size=(40, 3, 2))
    np.testing.assert_allclose(compute_quantile(values, 0.3), np.quantile(values, 0.3, axis=0))
    values[::4, 1] = np.nan
    np.testing.assert_allclose(compute_quantile(values, 0.9), np.nanquantile(values, 0.9, axis=0))
    values[:, 2, 0] = np.nan
    assert np.isnan(compute_quantile(values, 0.5)[2, 0]) and compute_medians(values)[2, 0] == 0.0
    assert compute_median(np.array([np.nan])) == 0.0 and compute_median(np.array([1.0, np.nan, 3.0])) == 2.0


@pytest.mark.filterwarnings("error")
def test_a_cluster_that_is_never_seen_has_no_shape():
    shape = compute_mean_shape(np.full((20, 4, 3), np.nan))
    assert np.isnan(shape.places).all() and shape.usual_deformation == 0.0
