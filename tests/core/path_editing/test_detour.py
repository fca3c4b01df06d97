"""Detours of paths: how far aside, how smooth, and the path as it was everywhere else."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.motion.path.path import PolynomialPath
from beyond_mocap.path_editing.detour import RISE, PathChange, add_detours, compute_detour_width, compute_offsets
from beyond_mocap.path_editing.path_line import fit_line


def straight(length=20.0):
    return fit_line(np.array([[0.0, 0, 0], [length / 2, 0, 0], [length, 0, 0]]), "line")


def circle(radius=5.0):
    angle = np.linspace(0.0, 2 * np.pi, 181)
    return fit_line(radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1), "circle", closed=True)


def places(path, count=4001):
    return path.at(np.linspace(*path.domain, count))


def test_a_detour_goes_to_the_left_by_what_it_says_and_comes_back():
    path = straight()
    line = places(add_detours(path, [(10.0, 6.0, 0.5)]))
    assert line[:, 1].max() == pytest.approx(0.5, abs=1e-5)
    plateau = np.abs(line[:, 0] - 10.0) < 0.5 * 6.0 * (1 - 2 * RISE)
    assert line[plateau, 1] == pytest.approx(0.5, abs=1e-4)
    beyond = np.abs(line[:, 0] - 10.0) > 3.2
    assert np.abs(line[beyond, 1]).max() < 1e-5


def test_it_is_twice_continuously_differentiable():
    path = add_detours(straight(), [(10.0, 6.0, 0.5)])
    u = np.linspace(*path.domain, 20001)
    bend = path.at(u, 2)
    assert np.abs(np.diff(bend, axis=0)).max() < 0.01 * np.abs(bend).max()


def test_without_detours_it_is_the_same_path():
    path = straight()
    assert add_detours(path, []) is path
    assert add_detours(path, [(10.0, 6.0, 0.0)]) is path


@pytest.mark.parametrize("detour", [(1.0, 0.0, 0.5), (np.nan, 1.0, 0.5), (1.0, 1.0), (1.0, 1.0, np.inf)])
def test_what_is_no_detour_is_told(detour):
    with pytest.raises(InputError, match="detour"):
        add_detours(straight(), [detour])


def test_to_the_right_around_a_closed_path_across_its_seam():
    path = circle()
    line = places(add_detours(path, [(0.0, 8.0, -0.4)]))
    radius = np.hypot(line[:, 0], line[:, 1])
    assert radius.max() == pytest.approx(5.4, abs=2e-3)
    assert radius[0] == radius[-1] == pytest.approx(5.4, abs=2e-3)
    assert radius.min() == pytest.approx(5.0, abs=2e-3)
    assert add_detours(path, [(0.0, 8.0, -0.4)]).closed


def test_neighbours_join_to_one_long_detour():
    step = (1 - RISE) * 5.0
    arc = np.linspace(8.0, 12.0, 101)
    assert compute_offsets(arc, [(10.0 + n * step, 5.0, 0.3) for n in (-1, 0, 1)]) == pytest.approx(0.3)


def test_a_path_that_stands_still_in_between_keeps_its_parameter():
    """u^3 stands still at u = 0: time passes, the place does not change."""
    path = PolynomialPath(np.array([[0.0, 0, 0], [6.0, 0, 0], [0.0, 0, 0], [4.0, 0, 0]]), (-1.0, 1.0))
    gone = add_detours(path, [(10.0, 6.0, 0.5)])
    u = np.linspace(-1.0, 1.0, 501)
    assert gone.domain == pytest.approx(path.domain)
    assert np.abs(gone.at(u)[:, 0] - path.at(u)[:, 0]).max() < 1e-4
    assert np.isfinite(gone.at(u)).all()


def test_a_vertical_path_is_moved_aside_without_a_hole():
    path = fit_line(np.array([[0.0, 0, 0], [0, 0, 3.0]]), "ladder")
    line = places(add_detours(path, [(1.5, 2.0, 0.4)]))
    assert np.isfinite(line).all()
    assert np.hypot(line[:, 0], line[:, 1]).max() == pytest.approx(0.4, abs=1e-3)


@pytest.mark.parametrize("speed, radius", [(1.5, 4.0), (6.0, 24.0)])
def test_gentle_means_what_it_says(speed, radius):
    width = float(compute_detour_width(0.5, speed))
    arc = np.linspace(-width / 2, width / 2, 20001)
    bend = np.diff(compute_offsets(arc, [(0.0, width, 0.5)]), 2) / np.diff(arc)[0] ** 2
    assert 1.0 / np.abs(bend).max() == pytest.approx(radius, rel=0.01)


def test_a_detour_of_a_walk_costs_the_metres_that_it_is_longer():
    path = straight()
    assert ArcLength(add_detours(path, [(10.0, 6.0, 0.5)])).length > ArcLength(path).length + 0.05


def test_a_change_is_described_once_and_within_the_path():
    change = PathChange(0.5, ((-1.0, 4.0, 0.4), (1.5, 4.0, 0.4), (10.0, 3.0, -0.25)))
    assert change.describe(11.0) == [
        "waits 0.50 s", "moves 0.40 m to the left from 0.0 to 3.5 m of the path",
        "moves 0.25 m to the right from 8.5 to 11.0 m of the path",
    ]  # fmt: skip
    assert PathChange().describe() == []
