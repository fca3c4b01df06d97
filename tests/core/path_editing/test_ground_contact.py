"""The ground under feet: planes while they stand, smooth in between, and clear of what sticks out."""

import numpy as np
import pytest

from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.motion.path.terrain import Terrain
from beyond_mocap.path_editing.ground_contact import build_mesh_surface, build_path_surface, compute_footing, is_level
from beyond_mocap.path_editing.path_line import fit_line

FPS, COUNT = 30.0, 90


@pytest.fixture
def walking():
    """Feet (T, 2, 2, 2) that stand for 15 frames and step 1 m ahead in 15, left and right in turn, and when they
    stand."""
    at = np.arange(COUNT)
    feet, standing = np.zeros((COUNT, 2, 2, 2)), np.zeros((COUNT, 2, 2), dtype=bool)
    for side, late in enumerate((0, 15)):
        phase, lap = (at + late) % 30, (at + late) // 30
        share = np.clip((phase - 14) / 16.0, 0.0, 1.0)
        x = lap + share * share * (3.0 - 2.0 * share) - 0.5 * side
        feet[:, side, 0, 0], feet[:, side, 1, 0] = x - 0.15, x
        feet[:, side, :, 1] = 0.1 - 0.2 * side
        standing[:, side] = (phase < 15)[:, None]
    return feet, standing


def slope(rise):
    return fit_line(np.array([[-2.0, 0.0, -2.0 * rise], [8.0, 0.0, 8.0 * rise]]), "slope")


def test_a_paths_height_is_level_across_it(walking):
    path = slope(0.3)
    arc = ArcLength(path)
    places = np.array([[1.0, 0.0], [1.0, 0.7], [3.0, -0.5]])
    height, tilt = build_path_surface(path, arc, np.full(3, 4.0))(places, np.arange(3))
    assert np.allclose(height, [0.3, 0.3, 0.9], atol=1e-4) and np.allclose(tilt, [0.3, 0.0], atol=1e-4)
    assert not is_level(path, arc) and is_level(slope(0.0), ArcLength(slope(0.0)))


def test_on_a_slope_feet_are_on_it_all_the_time(walking):
    feet, standing = walking
    path = slope(0.3)
    surface = build_path_surface(path, ArcLength(path), np.full(COUNT, 3.0))
    found = compute_footing(feet, standing, np.zeros((COUNT, 2)), FPS, surface)
    assert np.allclose(found.height, 0.3 * feet[:, :, 1, 0], atol=1e-3)
    assert np.allclose(found.slope, [0.3, 0.0], atol=1e-3) and found.lift.max() < 0.03
    assert np.allclose(found.normal, np.array([-0.3, 0.0, 1.0]) / np.hypot(0.3, 1.0), atol=1e-3)


def stairs(height=0.17):
    corners = [(-3.0, 0.0), (0.7, 0.0), (0.7, height), (1.7, height), (1.7, 2 * height), (9.0, 2 * height)]
    vertices = np.array([(x, y, z) for y in (-3.0, 3.0) for x, z in corners])
    quads = [(i, i + 1, i + 7, i + 6) for i in range(5)]
    return Terrain(vertices, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def test_on_stairs_feet_are_level_and_pass_the_edges(walking):
    feet, standing = walking
    surface = build_mesh_surface(stairs(), np.zeros((COUNT, 3)))
    found = compute_footing(feet, standing, np.full((COUNT, 2), 0.03), FPS, surface)
    stands = standing.any(axis=2)
    assert np.all(np.min(np.abs(found.height[stands, None] - [0.0, 0.17, 0.34]), axis=1) < 1e-6)
    assert np.abs(found.slope[stands]).max() < 1e-6
    real = np.stack([surface(feet[:, side, 1], np.arange(COUNT))[0] for side in (0, 1)], axis=1)
    assert (found.height + found.lift + 0.03 - real).min() > -0.005
    assert np.abs(np.diff(found.height + found.lift, 3, axis=0)).max() < 0.05


def test_where_the_mesh_ends_the_path_goes_on(walking):
    feet, standing = walking
    origin = np.tile([0.0, 0.0, 0.5], (COUNT, 1))
    nothing = Terrain(np.array([[90.0, 90, 0], [91, 90, 0], [90, 91, 0]]), np.array([[0, 1, 2]]))
    found = compute_footing(feet, standing, np.zeros((COUNT, 2)), FPS, build_mesh_surface(nothing, origin))
    assert np.allclose(found.height, 0.5) and np.allclose(found.slope, 0.0)


def test_feet_that_never_stand_have_a_ground_too(walking):
    feet, standing = walking
    path = slope(0.2)
    surface = build_path_surface(path, ArcLength(path), np.full(COUNT, 3.0))
    found = compute_footing(feet, np.zeros_like(standing), np.full((COUNT, 2), 0.4), FPS, surface)
    assert np.abs(found.height - 0.2 * feet[:, :, 1, 0]).max() < 0.01
