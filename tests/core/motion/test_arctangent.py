"""The same angles wherever arrays lie in memory."""

import numpy as np

from beyond_mocap.motion.arctangent import arctan2


def test_where_a_result_lies_changes_no_bit():
    """The place of a freed block holds the vectors and, in every other round right behind them, the angles: numpy's own
    function then gives other bits where it is built with AVX-512."""
    vectors = np.random.default_rng(4).normal(size=(1801, 3))
    expected = np.arctan2(vectors[:, 0].copy(), vectors[:, 1].copy())
    sine = vectors[:, 0].copy()
    for number in range(40):
        block = np.empty(4 * len(vectors) + 2 + number % 4)
        del block
        copy = vectors.copy()
        np.testing.assert_array_equal(arctan2(sine, copy[:, 1]), expected)


def test_numbers_stay_numbers():
    assert arctan2(1.0, 0.0) == np.pi / 2 and np.ndim(arctan2(1.0, 0.0)) == 0
    assert arctan2(np.ones((2, 3)), 1.0).shape == (2, 3)
