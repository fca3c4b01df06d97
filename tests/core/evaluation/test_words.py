"""Faustino's eq. 18 on sets whose value is known by hand."""

import numpy as np
import pytest

from beyond_mocap.evaluation import annotation_similarity


@pytest.mark.parametrize(
    "asked, played, printed, ours",
    [
        ("walking", "walking", -1.0, -1.0),
        ("walking", "running", 1.0, 1.0),
        ("running kick", "running", 0.0, 0.0),
        # the paper's example: a walk against a running kick, three words between them
        ("walking", "running kick", 1.0, 1.0),
        ("kick right", "kick right low inside front", 0.2, -1.0),
        ("kick right low", "kick left low", 0.0, -1 / 3),
        ("kick", "", 1.0, 1.0),
    ],
)
def test_one_frame(asked, played, printed, ours):
    assert annotation_similarity.compute_eq18(asked.split(), played.split()) == pytest.approx(printed)
    assert annotation_similarity.compute_requested_similarity(asked.split(), played.split()) == pytest.approx(ours)


def test_nothing_asked_counts_neither_way():
    assert np.isnan(annotation_similarity.compute_requested_similarity([], ["kick"]))
    assert np.isnan(annotation_similarity.compute_eq18([], []))


def test_transitions_are_left_out_of_the_mean():
    asked = [("walking",), None, None, ("kick", "right"), ("walking",)]
    played = [("walking",), ("kick",), (), ("kick", "left"), ("running",)]
    values = annotation_similarity.measure_similarity(asked, played)
    np.testing.assert_allclose(values, [-1.0, np.nan, np.nan, 0.0, 1.0])


def test_word_order_and_repetition_do_not_matter():
    assert annotation_similarity.compute_eq18(("kick", "right"), ("right", "kick", "kick")) == -1.0
