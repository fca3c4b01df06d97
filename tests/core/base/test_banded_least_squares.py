"""The banded solver finds what dense least squares finds."""

import numpy as np
import pytest

from beyond_mocap.base.banded_least_squares import BandedLeastSquares


def dense(rows, goals, weights):
    """The least of sum weight (row x - goal)^2, by dense algebra."""
    root = np.sqrt(weights)[:, None]
    return np.linalg.lstsq(root * rows, root * np.asarray(goals).reshape(len(rows), -1), rcond=None)[0]


def test_the_least_of_a_sum_of_squares_is_that_of_dense_algebra():
    random = np.random.default_rng(1)
    squares, count = BandedLeastSquares(9, 2), 9
    dense = [], []
    for curve in (0, 1):
        squares.add_value(np.full(count, 0.1), curve)
        squares.add_smoothness(np.full(count, 2.0), curve)
        for frame in range(count):
            row = np.zeros(18)
            row[2 * frame + curve] = np.sqrt(0.1)
            dense[0].append(row), dense[1].append(0.0)
        for frame in range(count - 3):
            row = np.zeros(18)
            row[2 * (frame + np.arange(4)) + curve] = np.sqrt(2.0) * np.array([-1, 3, -3, 1])
            dense[0].append(row), dense[1].append(0.0)
    index, values, goal = np.array([[4, 5], [5, 4], [10, 13]]), random.normal(size=(3, 2)), np.array([1.0, -2.0, 0.5])
    squares.add_rows(index, values, np.ones(3), goal)
    for at, value, wish in zip(index, values, goal):
        row = np.zeros(18)
        row[at] = value
        dense[0].append(row), dense[1].append(wish)
    expected = np.linalg.lstsq(np.array(dense[0]), np.array(dense[1]), rcond=None)[0]
    assert squares.solve().ravel() == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("order, stencil", [(1, [-1, 1]), (2, [1, -2, 1]), (3, [-1, 3, -3, 1])])
def test_differences_and_values_of_several_goals_are_those_of_dense_algebra(order, stencil):
    random, count = np.random.default_rng(order), 12
    goal, weight, stiff = random.normal(size=(count, 3)), random.uniform(0.1, 1, count), random.uniform(1, 9, count)
    squares = BandedLeastSquares(count, reach=order, columns=3)
    squares.add_value(weight, goal=goal)
    squares.add_difference(order, stiff[order:])
    bends = np.array([np.convolve(row, stencil[::-1], "valid") for row in np.eye(count)]).T
    expected = dense(
        np.vstack([np.eye(count), bends]), np.vstack([goal, np.zeros((count - order, 3))]),
        np.concatenate([weight, stiff[order:]]),
    )
    assert squares.solve() == pytest.approx(expected, abs=1e-9)


def test_terms_with_a_goal_are_those_of_dense_algebra():
    random, count = np.random.default_rng(0), 7
    swing, goal = random.normal(size=count - 1), random.normal(size=count - 1)
    squares = BandedLeastSquares(count, 2, reach=1)
    squares.add_terms({0: -1.0, 2: 1.0, 3: swing}, np.full(count - 1, 2.0), goal)
    rows = np.zeros((count - 1, 2 * count))
    for frame in range(count - 1):
        rows[frame, [2 * frame, 2 * frame + 2, 2 * frame + 3]] = -1.0, 1.0, swing[frame]
    for curve in (0, 1):
        squares.add_value(0.1, curve)
    expected = dense(np.vstack([rows, np.eye(2 * count)]), np.concatenate([goal, np.zeros(2 * count)]),
                     np.concatenate([np.full(count - 1, 2.0), np.full(2 * count, 0.1)]))
    assert squares.solve().ravel() == pytest.approx(expected[:, 0], abs=1e-9)


def test_a_curve_too_short_for_a_difference_is_left_alone():
    squares = BandedLeastSquares(2)
    squares.add_value(1.0, goal=np.array([3.0, 4.0]))
    squares.add_difference(3, 5.0)
    assert squares.solve()[:, 0] == pytest.approx([3.0, 4.0])


@pytest.mark.parametrize("goal", [0.7, np.array([1.0, -2.0]), np.array([[1.0, 0.3], [-2.0, 0.5]])])
def test_rows_have_one_goal_or_one_per_row_or_one_per_column(goal):
    squares, index, values = BandedLeastSquares(5, reach=2, columns=2), np.array([[0, 2], [3, 4]]), [1.0, -3.0]
    squares.add_value(0.5)
    squares.add_rows(index, np.array(values), np.array([2.0, 4.0]), goal)
    rows = np.zeros((2, 5))
    rows[0, [0, 2]], rows[1, [3, 4]] = values, values
    goals = np.broadcast_to(goal if np.ndim(goal) == 2 else np.reshape(goal, (-1, 1)), (2, 2))
    expected = dense(np.vstack([rows, np.eye(5)]), np.vstack([goals, np.zeros((5, 2))]),
                     np.concatenate([[2.0, 4.0], np.full(5, 0.5)]))
    assert squares.solve() == pytest.approx(expected, abs=1e-9)
