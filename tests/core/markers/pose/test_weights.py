"""Weights by the deformation of clusters (eq. 5.2 to 5.4), by hand."""

import numpy as np
import pytest

from beyond_mocap.markers.pose.residuals import (
    compute_cluster_deviation,
    compute_marker_weights,
    measure_edge_deviation,
)

# three markers one metre apart
PLACES = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0]])
JOINT = np.zeros(3, dtype=int)


def moved(marker, shift):
    out = PLACES.copy()
    out[marker] += shift
    return out[None]


def test_an_edge_that_is_longer_is_counted_at_both_its_ends():
    # marker 1 moves outwards on the line from marker 0: that edge is 10 % longer, the one to marker 2 differently
    seen = moved(1, [0.1, 0.0, 0.0])
    other = np.linalg.norm(seen[0, 1] - seen[0, 2]) - 1.0
    assert measure_edge_deviation(JOINT, PLACES, seen)[0] == pytest.approx(
        [np.sqrt(0.1**2 / 2), np.sqrt((0.1**2 + other**2) / 2), np.sqrt(other**2 / 2)]
    )


def test_the_clusters_deviation_is_the_sum_over_markers_of_the_mean_over_frames():
    deviation = np.array([[0.1, 0.2, 0.2], [0.3, np.nan, 0.0]])
    wanted = np.sqrt((0.01 + 0.09) / 2 + 0.04 + (0.04 + 0.0) / 2)
    assert compute_cluster_deviation(JOINT, deviation) == pytest.approx([wanted] * 3)


def test_the_marker_that_is_off_counts_less_and_none_more_than_one():
    seen = np.concatenate([np.repeat(PLACES[None], 99, axis=0), moved(0, [0.0, -0.3, 0.0])])
    found = compute_marker_weights(JOINT, PLACES, seen)
    assert np.all(found[:99] == 1.0)
    assert found[99, 0] < found[99, 1] < 1.0 and found[99, 0] < 0.3


def test_unseen_markers_count_nothing_and_pairs_cannot_be_judged():
    seen = PLACES[None].copy()
    seen[0, 2] = np.nan
    assert compute_marker_weights(JOINT, PLACES, seen).tolist() == [[1.0, 1.0, 0.0]]
    assert np.isnan(measure_edge_deviation(JOINT, PLACES, seen)).all()


def test_the_models_own_deviation_is_taken_where_it_is_known():
    seen = moved(0, [0.0, -0.3, 0.0])
    strict = compute_marker_weights(JOINT, PLACES, seen, np.array([0.01, 0.01, np.nan]))
    assert strict[0, 0] < 0.1 and strict[0, 2] > strict[0, 1]
