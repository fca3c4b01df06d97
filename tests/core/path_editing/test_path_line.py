"""Drawn lines as paths: near what was drawn, twice differentiable, whatever was drawn."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.path_editing.path_line import build_b_spline, build_straight_points, fit_control_points, fit_line

ROUND = np.linspace(0.0, 2.0 * np.pi, 400)


def circle(radius):
    return radius * np.stack([np.cos(ROUND), np.sin(ROUND), 0 * ROUND], axis=1)


@pytest.mark.parametrize("radius", (1.0, 2.0, 8.0))
@pytest.mark.parametrize("closed", (False, True))
def test_smooth_lines_are_kept_within_a_millimetre(radius, closed):
    path = fit_line(circle(radius), "circle", closed=closed)
    places = path.at(np.linspace(*path.domain, 3000))
    assert np.abs(np.linalg.norm(places[:, :2], axis=1) - radius).max() < 1e-3
    assert ArcLength(path).length == pytest.approx(2 * np.pi * radius, rel=2e-3)


def test_a_closed_line_is_smooth_over_its_seam():
    path = fit_line(circle(2.0), "circle", closed=True)
    low, high = path.domain
    for derivative in (0, 1, 2):
        before, after = path._spline(high, derivative), path._spline(low, derivative)
        assert np.abs(before - after).max() < 1e-9


def test_its_ends_are_met():
    line = np.array([[1.0, 2.0, 0.5], [4.0, 2.0, 0.0], [4.0, 7.0, 0.0]]) + 1e5
    path = fit_line(line, "corner")
    assert np.abs(path.at(np.array(path.domain)) - line[[0, -1]]).max() < 1e-9


def test_bad_lines_are_refused():
    for line in (
        np.zeros((1, 3)),
        np.zeros((5, 3)),
        np.zeros((0, 3)),
        [[0, 0, 0], [np.nan, 1, 0]],
        [[0, 0, 0], [0.1, 0, 0]],
    ):
        with pytest.raises(InputError, match="^line:"):
            fit_line(np.array(line, dtype=float), "line")


POINTS = np.array([[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, -1, 0], [6, 0, 0], [7, 3, 2]], dtype=float)


@pytest.mark.parametrize("degree", (1, 2, 3, 5))
def test_a_b_spline_meets_its_ends_and_has_as_many_knots_as_it_needs(degree):
    path = build_b_spline(POINTS, degree)
    assert len(path.knots) == len(POINTS) + degree + 1 and path.domain == (0.0, 1.0)
    assert path.at(np.array([0.0, 1.0])) == pytest.approx(POINTS[[0, -1]], abs=1e-12)
    inner = np.diff(np.unique(path.knots))
    assert np.ptp(inner) < 1e-12


def test_a_b_spline_of_the_highest_degree_is_a_bezier_curve():
    from math import comb

    u = np.linspace(0, 1, 11)[:, None]
    bernstein = np.concatenate([comb(5, i) * u**i * (1 - u) ** (5 - i) for i in range(6)], axis=1)
    assert build_b_spline(POINTS, 5).at(u[:, 0]) == pytest.approx(bernstein @ POINTS, abs=1e-12)


@pytest.mark.parametrize(
    "points, degree", [(POINTS, 6), (POINTS, 0), (POINTS[:1], 1), (POINTS * np.nan, 3), (POINTS * 0, 3)]
)
def test_b_splines_that_cannot_be_are_refused(points, degree):
    with pytest.raises(InputError, match="control points"):
        build_b_spline(points, degree)


@pytest.mark.parametrize("count, off", [(4, 4.0), (8, 0.7), (40, 0.002)])
def test_control_points_give_the_curve_back_the_better_the_more_there_are(count, off):
    path = fit_line(circle(2.0)[:300] + 1e4, "bow")
    again = build_b_spline(fit_control_points(path, count, 3), 3)
    assert again.at(np.array([0.0, 1.0])) == pytest.approx(path.at(np.array(path.domain)), abs=1e-9)
    places = again.at(np.linspace(0, 1, 500)) - 1e4
    assert np.abs(np.linalg.norm(places[:, :2], axis=1) - 2.0).max() < off


def test_control_points_of_a_closed_path_meet_where_it_closes():
    points = fit_control_points(fit_line(circle(2.0), "circle", closed=True), 12, 3)
    assert points[0] == pytest.approx(points[-1], abs=1e-6)


def test_straight_goes_from_the_first_place_to_the_last():
    path = fit_line(POINTS, "line")
    points = build_straight_points(path, 5)
    assert points[[0, -1]] == pytest.approx(POINTS[[0, -1]], abs=1e-9)
    assert np.diff(points, axis=0) == pytest.approx(np.tile((POINTS[-1] - POINTS[0]) / 4, (4, 1)))
    closed = build_straight_points(fit_line(circle(2.0), "circle", closed=True), 3)
    assert np.linalg.norm(closed[-1] - closed[0]) == pytest.approx(4.0, abs=0.05)
    with pytest.raises(InputError):
        build_straight_points(path, 1)

BAD_TURNS = {
    "back": [[0, 0, 0], [3, 0, 0], [0, 0, 0]], "a third time": [[0, 0, 0], [3, 0, 0], [0, 0, 0], [3, 0, 0]],
    "nearly back": [[0, 0, 0], [3, 0, 0], [0, 0.3, 0]], "up and down": [[0, 0, 0], [0, 0, 3], [0, 0, 0]],
    "far off": [[1e5, 1e5, 0], [1e5 + 3, 1e5, 0], [1e5, 1e5, 0]],
    "repeated": [[0, 0, 0], [0, 0, 0], [3, 0, 0], [3, 0, 0], [3, 0, 0], [0, 0, 0], [0, 0, 0]],
    "cusp": np.stack([np.linspace(-1, 1, 201) ** 2, np.linspace(-1, 1, 201) ** 3, np.zeros(201)], axis=1),
}


@pytest.mark.parametrize("line", BAD_TURNS.values(), ids=BAD_TURNS)
@pytest.mark.parametrize("closed", (False, True))
def test_who_is_sent_back_where_he_came_from_gets_room_to_turn_round(line, closed):
    """The path nowhere stops, has a radius everywhere, and is not far from what was drawn."""
    line = np.asarray(line, dtype=float)
    path = fit_line(line, "line", closed=closed)
    assert sharpest(path) > 0.03
    places = path.at(np.linspace(*path.domain, 200))
    assert off_line(places, np.append(line, line[:1], axis=0) if closed else line) < 0.15
    if not closed:
        assert np.abs(path.at(np.array(path.domain)) - line[[0, -1]]).max() < 1e-9


def off_line(places, line):
    """How far the farthest of places (N, 3) is from a polyline."""
    sides = np.diff(line, axis=0)
    share = np.einsum("nmi,mi->nm", places[:, None] - line[:-1], sides) / np.maximum((sides**2).sum(axis=1), 1e-12)
    nearest = line[:-1] + np.clip(share, 0.0, 1.0)[..., None] * sides
    return np.linalg.norm(places[:, None] - nearest, axis=2).min(axis=1).max()


def sharpest(path):
    """The smallest radius of a path in metres."""
    u = np.linspace(*path.domain, 20_000)
    speed, bend = path.at(u, 1), path.at(u, 2)
    size = np.linalg.norm(speed, axis=1)
    return 1.0 / (np.linalg.norm(np.cross(speed, bend), axis=1) / size**3).max()


def test_the_seam_of_a_closed_line_may_be_a_turn():
    """Beginning elsewhere on the same closed line does not change the curve."""
    line = np.array([[0, 0, 0], [3, 0, 0], [3, 0.1, 0]], dtype=float)
    one, other = (fit_line(np.roll(line, shift, axis=0), "line", closed=True) for shift in (0, 1))
    places, others = (path.at(np.linspace(*path.domain, 5000)) for path in (one, other))
    assert off_line(places[::50], others[::5]) < 0.005


def test_noise_on_a_dense_line_is_no_way():
    x = np.linspace(0.0, 10.0, 10_001)
    line = np.stack([x, 2 * np.sin(0.7 * x), 0 * x], axis=1)
    noisy = line + np.random.default_rng(1).normal(size=line.shape) * 1e-3
    noisy[[0, -1]] = line[[0, -1]]
    path = fit_line(noisy, "noisy")
    assert ArcLength(path).length == pytest.approx(ArcLength(fit_line(line, "line")).length, rel=1e-3)
    places = path.at(np.linspace(*path.domain, 300))
    assert off_line(places, line[::20]) < 1e-3


def test_a_loop_tighter_than_a_stride_and_a_vertical_line_are_paths():
    loop = 0.1 * np.stack([np.sin(ROUND), 1 - np.cos(ROUND), 0 * ROUND], axis=1)
    line = np.concatenate([[[-3, 0, 0]], loop, [[3, 0, 0]]])
    path = fit_line(line, "loop")
    assert np.isfinite(path.at(np.linspace(*path.domain, 999), 2)).all() and 6.0 < ArcLength(path).length < 6.7
    path = fit_line(np.array([[1, 1, 0], [1, 1, 2.5]]), "pole")
    assert path.at(np.linspace(*path.domain, 99))[:, :2] == pytest.approx(np.ones((99, 2)))


def test_a_figure_of_eight_crosses_itself():
    eight = np.stack([4 * np.sin(ROUND), 2 * np.sin(2 * ROUND), 0 * ROUND], axis=1)
    path = fit_line(eight, "eight", closed=True)
    places = path.at(np.linspace(*path.domain, 400))
    assert off_line(places, eight) < 0.005
    assert np.linalg.norm(path.at(np.linspace(*path.domain, 4001)), axis=1).min() < 0.01


def test_it_changes_little_where_the_line_changes_little():
    """Who drags a point back over the line must not see the path leap."""
    paths = [fit_line(np.array([[0, 0, 0], [3, 0, 0], [0.5, y, 0]]), "line") for y in np.arange(0.3, 1.5, 0.01)]
    places = np.array([path.at(path.domain[0] + np.linspace(0, 1, 300) * np.ptp(path.domain)) for path in paths])
    assert np.linalg.norm(np.diff(places, axis=0), axis=2).max() < 0.05


COORDINATE = st.floats(-1e5, 1e5) | st.floats(-3, 3)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=2, max_size=12), st.booleans())
def test_any_line_is_a_path_or_a_message(points, closed):
    """Whatever is drawn: finite places, its ends met, arc length there and back; or one line that says why not."""
    line = np.array(points, dtype=float)
    try:
        path = fit_line(line, "line", closed=closed)
    except InputError as error:
        assert str(error).startswith("line: ") and "\n" not in str(error)
        return
    scale = np.abs(line).max() + 1.0
    for derivative in (0, 1, 2):
        assert np.isfinite(path.at(np.linspace(*path.domain, 200), derivative)).all()
    if not closed:
        assert np.abs(path.at(np.array(path.domain)) - line[[0, -1]]).max() < 1e-9 * scale
    arc = ArcLength(path)
    s = np.linspace(0.0, arc.length, 50)
    assert np.abs(arc.distance_at(arc.parameter_at(s)) - s).max() < 1e-9 * scale
    assert np.all(np.diff(arc.parameter_at(s)) > 0)
