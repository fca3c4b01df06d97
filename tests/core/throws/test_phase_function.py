"""Weights of the control points against the corrected polynomials of eq. 3.25 with the indices of eq. 3.26."""

import numpy as np
import pytest

from beyond_mocap.throws.networks.phases import weigh_points, weigh_points_at


def by_the_book(phase, points):
    """eq. 3.25-3.26 with the two misprinted factors put right."""
    u = phase * (points - 1)
    k1 = int(np.floor(u))
    t = u - k1
    theta = (-t / 2 + t**2 - t**3 / 2, 1 - 5 / 2 * t**2 + 3 / 2 * t**3, t / 2 + 2 * t**2 - 3 / 2 * t**3,
             -(t**2) / 2 + t**3 / 2)  # fmt: skip
    out = np.zeros(points)
    for k, one in zip((max(k1 - 1, 0), k1, min(k1 + 1, points - 1), min(k1 + 2, points - 1)), theta):
        out[k] += one
    return out


@pytest.mark.parametrize("points", [2, 3, 4, 7])
def test_weights_are_the_corrected_splines(points):
    phases = np.linspace(0, 1, 97)
    expected = [by_the_book(phase, points) for phase in phases]
    np.testing.assert_allclose(weigh_points(phases, points), expected, atol=1e-12)


@pytest.mark.parametrize("points", [1, 2, 4, 5])
def test_weights_sum_to_one_everywhere_and_each_point_rules_at_its_phase(points):
    assert np.abs(weigh_points(np.linspace(-0.5, 1.5, 401), points).sum(-1) - 1).max() < 1e-12
    np.testing.assert_allclose(weigh_points(np.linspace(0, 1, points), points), np.eye(points), atol=1e-12)


def test_weights_glide_and_do_not_close():
    weights = weigh_points(np.linspace(0, 1, 20001), 4)
    slope = np.gradient(weights, 1 / 20000, axis=0)
    assert np.abs(np.diff(slope, axis=0)).max() < 0.01  # no kink
    assert weights[:6000, 3].max() == 0 and weights[-6000:, 0].max() == 0


def test_leading_axes_are_free_and_phases_beyond_the_ends_count_as_the_ends():
    assert weigh_points(np.zeros((5, 2)), 4).shape == (5, 2, 4)
    np.testing.assert_array_equal(weigh_points(1.7), weigh_points(1.0))


@pytest.mark.parametrize("points", [1, 2, 3, 4, 7])
def test_one_phase_is_weighed_as_many_are(points):
    phases = [-0.3, 0.0, 0.2, 1 / 3, 0.5, 0.66, 0.999, 1.0, 1.2]
    one_by_one = [weigh_points_at(phase, points) for phase in phases]
    np.testing.assert_allclose(one_by_one, weigh_points(np.array(phases), points), atol=1e-12)
