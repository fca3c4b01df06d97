"""Drawn lines as paths: near what was drawn, twice differentiable, whatever was drawn."""

import numpy as np
import pytest

from beyond_mocap.errors import InputError
from beyond_mocap.motion.arc_length import ArcLength
from beyond_mocap.polish.path_line import through

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
