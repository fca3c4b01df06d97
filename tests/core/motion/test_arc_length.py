"""Arc length against lengths known in closed form, and back, also where the speed vanishes."""

import numpy as np
import pytest

from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.motion.path.path import Path, PolynomialPath, SplinePath

LEGENDRE = np.polynomial.legendre


def polynomial(*rows, domain=(0.0, 1.0)):
    """A path whose x, y, z are polynomials 1, u, u^2 ... of the parameter."""
    size = max(len(row) for row in rows)
    low, high = domain
    scaled = np.polynomial.Polynomial([(low + high) / 2, (high - low) / 2])
    columns = []
    for row in rows:
        series = np.polynomial.Polynomial(row)(scaled).coef
        columns.append(np.pad(LEGENDRE.poly2leg(series), (0, size))[:size])
    return PolynomialPath(np.stack(columns, axis=1), domain)


def bezier(*points):
    """One cubic piece from its four control points."""
    return SplinePath(np.repeat([0.0, 1.0], 4), np.array(points, dtype=float))


def back_and_forth(arc, count=101):
    """The largest error in metres of parameter and length one after the other."""
    s = np.linspace(0.0, arc.length, count)
    return np.abs(arc.distance_at(arc.parameter_at(s)) - s).max()


def test_a_parabola_has_its_length():
    arc = ArcLength(polynomial([0, 1], [0, 0, 1], [0], domain=(0.0, 2.0)))
    assert arc.length == pytest.approx(np.sqrt(17) + np.arcsinh(4) / 4, abs=1e-9)
    assert arc.distance_at(np.array([1.0]))[0] == pytest.approx(np.sqrt(5) / 2 + np.arcsinh(2) / 4, abs=1e-9)
    assert back_and_forth(arc) < 1e-9


def test_who_slows_to_a_stop_and_goes_on_has_run_both_halves():
    """x = (u - 0.3)^3: the speed touches zero within the only piece; x = (u - 0.3)^2 turns round there."""
    cubic, square = np.poly([0.3] * 3)[::-1], np.poly([0.3] * 2)[::-1]
    assert ArcLength(polynomial(cubic, [0], [0])).length == pytest.approx(0.7**3 + 0.3**3, abs=1e-7)
    arc = ArcLength(polynomial(square, [0], [0]))
    assert arc.length == pytest.approx(0.7**2 + 0.3**2, abs=1e-7)
    assert back_and_forth(arc) < 1e-7


def test_a_cusp():
    """x = v^2, y = v^3 about v = u - 0.4: the speed is |v| sqrt(4 + 9 v^2)."""
    arc = ArcLength(polynomial(np.poly([0.4] * 2)[::-1], np.poly([0.4] * 3)[::-1], [0]))

    def whole(v):
        return ((4 + 9 * v * v) ** 1.5 - 8) / 27

    assert arc.length == pytest.approx(whole(0.4) + whole(0.6), abs=1e-7)


def test_a_bezier_curve_against_adaptive_quadrature():
    from scipy.integrate import quad

    path = bezier((0, 0, 0), (3, 4, 1), (-2, 4, 2), (1, 0, 0.5))
    truth, _ = quad(lambda u: np.linalg.norm(path.at(np.array([u]), 1)), 0, 1, epsabs=1e-12, limit=500)
    assert ArcLength(path).length == pytest.approx(truth, abs=1e-8)


def test_a_path_of_one_place_has_no_length():
    arc = ArcLength(bezier(*[(1, 2, 3)] * 4))
    assert arc.length < 1e-12 and np.abs(arc.distance_at(np.array([0.0, 0.5, 2.0]))).max() < 1e-12
    assert np.isfinite(arc.parameter_at(np.array([-1.0, 0.0, 5.0]))).all()


def test_beyond_its_ends_it_is_at_its_ends():
    arc = ArcLength(bezier((0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)))
    assert arc.distance_at(np.array([-1.0, 2.0])) == pytest.approx([0.0, 3.0])
    assert arc.parameter_at(np.array([-1.0, 9.0])) == pytest.approx([0.0, 1.0])


def test_large_coordinates_are_no_reason_to_halve_for_ever():
    """A kilometre of a wave, 1e5 m from the origin: as many pieces and the same length as at the origin."""
    at = np.linspace(0.0, 1000.0, 8001)
    coefficients = np.stack([at, np.sin(at), 0 * at], axis=1)
    knots = np.concatenate([[0.0] * 3, np.linspace(0, 1, len(at) - 2), [1.0] * 3])
    near, far = (ArcLength(SplinePath(knots, coefficients + move)) for move in (0.0, 1e5))
    assert far.length == pytest.approx(near.length, abs=1e-6)
    assert back_and_forth(far) < 1e-9


class Helix(Path):
    """Radius 2 m, 0.5 m up a radian, told by an angle that speeds up: its length has a closed form."""

    domain, closed = (0.0, 3.0), False
    breaks = np.array([0.0, 3.0])

    def at(self, u, derivative=0):
        u = np.asarray(u, dtype=float)
        angle = u**2
        if derivative == 0:
            return np.stack([2 * np.cos(angle), 2 * np.sin(angle), 0.5 * angle], axis=1)
        return 2 * u[:, None] * np.stack([-2 * np.sin(angle), 2 * np.cos(angle), np.full(len(u), 0.5)], axis=1)


def test_a_helix_that_sets_out_from_a_stand():
    arc, u = ArcLength(Helix()), np.linspace(0.0, 3.0, 50)
    assert arc.distance_at(u) == pytest.approx(np.sqrt(4.25) * u**2, abs=1e-7)
    assert arc.parameter_at(np.sqrt(4.25) * u**2) == pytest.approx(u, abs=1e-6)


def test_a_circle_drawn_as_a_closed_spline():
    from scipy.interpolate import make_interp_spline

    angle = np.linspace(0.0, 2 * np.pi, 65)
    spline = make_interp_spline(angle, np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1), bc_type="periodic")
    path = SplinePath(spline.t, spline.c, 3, closed=True)
    assert ArcLength(path).length == pytest.approx(2 * np.pi, abs=1e-5)  # what the cubic is off the circle
    assert path.at(np.array([-0.5, 7.0])) == pytest.approx(
        path.at(np.array([2 * np.pi - 0.5, 7.0 - 2 * np.pi])), abs=1e-12
    )


def test_lengths_are_found_where_the_path_stands_for_a_while():
    """Forward, five seconds on one spot, and forward again."""
    x = np.concatenate([np.linspace(0, 2, 9), np.full(20, 2.0), np.linspace(2, 5, 12)])
    points = np.stack([x, 0 * x, 0 * x], axis=1)
    knots = np.concatenate([[0.0] * 3, np.linspace(0, 10, len(x) - 2), [10.0] * 3])
    arc = ArcLength(SplinePath(knots, points))
    assert arc.length == pytest.approx(5.0, abs=1e-9)
    assert back_and_forth(arc, 1001) < 1e-7
    assert np.all(np.diff(arc.parameter_at(np.linspace(0, 5, 400))) > 0)
