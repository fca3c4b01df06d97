"""A mesh as ground: planes and hills of known height, bridges, walls, holes."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.path.terrain import Terrain


def mesh(height, low=-10.0, high=10.0, count=41):
    """Vertices and triangles of a square field whose height is a function of x and y."""
    x, y = np.meshgrid(np.linspace(low, high, count), np.linspace(low, high, count), indexing="ij")
    vertices = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    number = np.arange(count * count).reshape(count, count)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, d, c], axis=1)])


def test_a_slope_is_as_high_and_as_steep_as_it_is():
    """Half of the triangles look down: their normals are told upwards all the same."""
    ground = Terrain(*mesh(lambda x, y: 0.5 * x - 0.2 * y + 3.0))
    places = np.random.default_rng(1).uniform(-9.9, 9.9, (500, 2))
    heights, normals = ground.find_heights(places, np.full(500, np.inf))
    assert heights == pytest.approx(0.5 * places[:, 0] - 0.2 * places[:, 1] + 3.0, abs=1e-9)
    assert normals == pytest.approx(np.tile(np.array([-0.5, 0.2, 1.0]) / np.linalg.norm([0.5, 0.2, 1.0]), (500, 1)))


def test_edges_and_corners_belong_to_it_and_beyond_is_nothing():
    ground = Terrain(*mesh(lambda x, y: x + y))
    x, y = np.meshgrid(np.linspace(-10, 10, 41), np.linspace(-10, 10, 41))
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    heights, _ = ground.find_heights(places, np.full(len(places), np.inf))
    assert heights == pytest.approx(places.sum(axis=1), abs=1e-9)
    outside, normals = ground.find_heights([[10.5, 0.0], [0.0, -300.0], [np.nan, 0.0]], np.full(3, np.inf))
    assert np.isnan(outside).all() and np.isnan(normals).all()


def test_under_a_bridge_and_on_it():
    field, triangles = mesh(lambda x, y: 0 * x)
    bridge, more = mesh(lambda x, y: 4.0 + 0 * x, -2.0, 2.0, 5)
    ground = Terrain(np.concatenate([field, bridge]), np.concatenate([triangles, more + len(field)]))
    heights, _ = ground.find_heights([[0, 0], [0, 0], [0, 0], [5, 5]], [3.0, 4.0, 9.0, 9.0])
    assert heights == pytest.approx([0.0, 4.0, 4.0, 0.0])
    assert np.isnan(ground.find_heights([[0, 0]], [-1.0])[0]).all()


def test_walls_and_triangles_without_area_are_no_ground():
    wall = Terrain([[0, 0, 0], [1, 0, 0], [0, 0, 5], [2, 2, 2]], [[0, 1, 2], [3, 3, 3]])
    assert np.isnan(wall.find_heights([[0.2, 0.0], [2.0, 2.0]], [9.0, 9.0])[0]).all()
    assert np.isnan(Terrain(np.zeros((0, 3)), np.zeros((0, 3))).find_heights([[0.0, 0.0]], [9.0])[0]).all()


def test_large_and_small_triangles_together_against_all_of_them():
    """The grid must not miss one: compared with every triangle tried for every place."""
    random = np.random.default_rng(3)
    middle = random.uniform(-50, 50, (300, 1, 3)) + 1e5
    corners = middle + random.normal(size=(300, 3, 3)) * random.choice([0.1, 1.0, 60.0], (300, 1, 1))
    ground = Terrain(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3))
    places, below = random.uniform(-60, 60, (400, 2)) + 1e5, random.uniform(-60, 60, 400) + 1e5
    heights, _ = ground.find_heights(places, below)
    for place, limit, height in zip(places, below, heights):
        sides = corners[:, 1:, :2] - corners[:, :1, :2]
        shares = np.linalg.solve(sides.transpose(0, 2, 1), (place - corners[:, 0, :2])[..., None])[..., 0]
        all_heights = corners[:, 0, 2] + (shares * (corners[:, 1:, 2] - corners[:, :1, 2])).sum(axis=1)
        hit = (shares >= 0).all(axis=1) & (shares.sum(axis=1) <= 1) & (all_heights <= limit)
        assert (np.isnan(height) and not hit.any()) or height == pytest.approx(all_heights[hit].max(), abs=1e-6)


@pytest.mark.parametrize("vertices, triangles", [
    ([[0, 0, 0], [1, 0, 0], [0, 1, np.nan]], [[0, 1, 2]]), ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]]),
    ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, -1]]),
])
def test_a_broken_mesh_is_refused(vertices, triangles):
    with pytest.raises(InputError, match="ground"):
        Terrain(vertices, triangles)
