"""Smoothing splines against the problem they solve, written out."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from beyond_mocap.motion.path.smooth_spline import fit_smoothing_spline, fit_spline_within

AT = np.sort(np.random.default_rng(5).uniform(0.0, 6.0, 200))
VALUES = np.stack([np.sin(AT), np.cos(1.7 * AT), AT**2], axis=1) + np.random.default_rng(6).normal(size=(200, 3))


def total(knots, coefficients, order, stiff):
    """What is to be as small as possible."""
    spline = BSpline(knots, coefficients, 3)
    fine = np.linspace(knots[3], knots[-4], 24_001)
    fine = 0.5 * (fine[1:] + fine[:-1])
    bend = (spline(fine, order) ** 2).sum(axis=1).mean()
    return ((spline(AT) - VALUES) ** 2).sum(axis=1).mean() + stiff ** (2 * order) * bend


@pytest.mark.parametrize("order", (2, 3))
@pytest.mark.parametrize("closed, ends_met", [(False, False), (False, True), (True, False)])
def test_no_change_makes_it_better(order, closed, ends_met):
    more = {"domain": (0.0, 6.0)} if closed else {}
    knots, best = fit_smoothing_spline(VALUES, AT, 12, 0.5, order, closed=closed, keep_ends=ends_met, **more)
    least = total(knots, best, order, 0.5)
    for own in range(12 if closed else 15):
        if ends_met and own in (0, 14):
            continue
        for step in (1e-3, -1e-3):
            other = best.copy()
            other[own] += step
            if closed and own < 3:
                other[12 + own] += step
            assert total(knots, other, order, 0.5) > least
    if ends_met:
        assert best[[0, -1]] == pytest.approx(VALUES[[0, -1]], abs=1e-12)


def test_closed_and_open_ends():
    knots, closed = fit_smoothing_spline(VALUES, AT, 12, 0.5, 3, closed=True, domain=(0.0, 6.0))
    assert np.array_equal(closed[:3], closed[-3:])
    spline = BSpline(knots, closed, 3)
    for derivative in (0, 1, 2):
        assert spline(0.0, derivative) == pytest.approx(spline(6.0, derivative), abs=1e-9)


@pytest.mark.parametrize("order", (2, 3))
def test_what_costs_nothing_is_kept(order):
    """A line has no acceleration; a parabola's does not change."""
    values = np.stack([2 + 3 * AT, (AT**2 if order == 3 else -AT)], axis=1)
    knots, coefficients = fit_smoothing_spline(values, AT, 30, 1.0, order)
    assert BSpline(knots, coefficients, 3)(AT) == pytest.approx(values, abs=1e-6)


def test_within_a_slack():
    corner = np.abs(AT - 3.0)[:, None] * [4.0, 0.0]
    knots, coefficients = fit_spline_within(corner, AT, 40, 0.5, 0.05)
    assert np.linalg.norm(BSpline(knots, coefficients, 3)(AT) - corner, axis=1).max() < 0.06


def test_samples_much_closer_than_the_stiffness():
    """Three samples in 2 ms of a path that is smoothed over 0.4 s: the parabola through them, not a singular matrix."""
    at, values = np.array([0.0, 0.001, 0.002]), np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 3.0]])
    knots, coefficients = fit_smoothing_spline(values, at, 4, 0.4, order=3)
    assert BSpline(knots, coefficients, 3)(at) == pytest.approx(values, abs=1e-4)
