"""Drawn lines as paths: near what was drawn, twice differentiable, whatever was drawn."""

import numpy as np
import pytest

from beyond_mocap.errors import InputError
from beyond_mocap.motion.arc_length import ArcLength
from beyond_mocap.polish.path_line import b_spline, control_points, straight, through

ROUND = np.linspace(0.0, 2.0 * np.pi, 400)


def circle(radius):
    return radius * np.stack([np.cos(ROUND), np.sin(ROUND), 0 * ROUND], axis=1)


@pytest.mark.parametrize("radius", (1.0, 2.0, 8.0))
@pytest.mark.parametrize("closed", (False, True))
def test_smooth_lines_are_kept_within_a_millimetre(radius, closed):
    path = through(circle(radius), "circle", closed=closed)
    places = path.at(np.linspace(*path.domain, 3000))
    assert np.abs(np.linalg.norm(places[:, :2], axis=1) - radius).max() < 1e-3
    assert ArcLength(path).length == pytest.approx(2 * np.pi * radius, rel=2e-3)


def test_a_closed_line_is_smooth_over_its_seam():
    path = through(circle(2.0), "circle", closed=True)
    low, high = path.domain
    for derivative in (0, 1, 2):
        before, after = path._spline(high, derivative), path._spline(low, derivative)
        assert np.abs(before - after).max() < 1e-9


def test_its_ends_are_met():
    line = np.array([[1.0, 2.0, 0.5], [4.0, 2.0, 0.0], [4.0, 7.0, 0.0]]) + 1e5
    path = through(line, "corner")
    assert np.abs(path.at(np.array(path.domain)) - line[[0, -1]]).max() < 1e-9


def test_bad_lines_are_refused():
    for line in (np.zeros((1, 3)), np.zeros((5, 3)), np.zeros((0, 3)), [[0, 0, 0], [np.nan, 1, 0]], [[0, 0, 0], [0.1, 0, 0]]):
        with pytest.raises(InputError, match="^line:"):
            through(np.array(line, dtype=float), "line")


POINTS = np.array([[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, -1, 0], [6, 0, 0], [7, 3, 2]], dtype=float)


@pytest.mark.parametrize("degree", (1, 2, 3, 5))
def test_a_b_spline_meets_its_ends_and_has_as_many_knots_as_it_needs(degree):
    path = b_spline(POINTS, degree)
    assert len(path.knots) == len(POINTS) + degree + 1 and path.domain == (0.0, 1.0)
    assert path.at(np.array([0.0, 1.0])) == pytest.approx(POINTS[[0, -1]], abs=1e-12)
    inner = np.diff(np.unique(path.knots))
    assert np.ptp(inner) < 1e-12


def test_a_b_spline_of_the_highest_degree_is_a_bezier_curve():
    from math import comb

    u = np.linspace(0, 1, 11)[:, None]
    bernstein = np.concatenate([comb(5, i) * u**i * (1 - u) ** (5 - i) for i in range(6)], axis=1)
    assert b_spline(POINTS, 5).at(u[:, 0]) == pytest.approx(bernstein @ POINTS, abs=1e-12)


@pytest.mark.parametrize("points, degree", [(POINTS, 6), (POINTS, 0), (POINTS[:1], 1), (POINTS * np.nan, 3), (POINTS * 0, 3)])
def test_b_splines_that_cannot_be_are_refused(points, degree):
    with pytest.raises(InputError, match="control points"):
        b_spline(points, degree)


@pytest.mark.parametrize("count, off", [(4, 4.0), (8, 0.7), (40, 0.002)])
def test_control_points_give_the_curve_back_the_better_the_more_there_are(count, off):
    path = through(circle(2.0)[:300] + 1e4, "bow")
    again = b_spline(control_points(path, count, 3), 3)
    assert again.at(np.array([0.0, 1.0])) == pytest.approx(path.at(np.array(path.domain)), abs=1e-9)
    places = again.at(np.linspace(0, 1, 500)) - 1e4
    assert np.abs(np.linalg.norm(places[:, :2], axis=1) - 2.0).max() < off


def test_control_points_of_a_closed_path_meet_where_it_closes():
    points = control_points(through(circle(2.0), "circle", closed=True), 12, 3)
    assert points[0] == pytest.approx(points[-1], abs=1e-6)


def test_straight_goes_from_the_first_place_to_the_last():
    path = through(POINTS, "line")
    points = straight(path, 5)
    assert points[[0, -1]] == pytest.approx(POINTS[[0, -1]], abs=1e-9)
    assert np.diff(points, axis=0) == pytest.approx(np.tile((POINTS[-1] - POINTS[0]) / 4, (4, 1)))
    closed = straight(through(circle(2.0), "circle", closed=True), 3)
    assert np.linalg.norm(closed[-1] - closed[0]) == pytest.approx(4.0, abs=0.05)
    with pytest.raises(InputError):
        straight(path, 1)
