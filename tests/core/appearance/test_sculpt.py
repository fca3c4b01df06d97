"""The templates are what the script makes, and its steps do what they say."""

import numpy as np
import pytest

from beyond_mocap.appearance.sculpt.athlete import sculpt
from beyond_mocap.appearance.sculpt.fields import build_chain, build_ellipsoid, carve, join
from beyond_mocap.appearance.sculpt.meshing import cut_piece, grade, list_borders, mesh_field, relax
from beyond_mocap.appearance.sculpt.stitching import Surface
from beyond_mocap.appearance.template import read_template

BALL = build_ellipsoid((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))


def mesh_ball(size=0.02):
    axis = grade((-0.15, size), (0.15, size))
    piece = mesh_field(BALL, (axis, axis, axis))
    relax(piece, BALL, 8, 0.5 * size)
    return piece


def test_the_light_template_is_what_the_script_makes():
    made, stored = sculpt(light=True), read_template(True)
    assert np.array_equal(made.faces, stored.faces) and np.array_equal(made.materials, stored.materials)
    assert np.allclose(made.vertices, stored.vertices, atol=1e-5)
    assert np.array_equal(made.parts, stored.parts) and np.allclose(made.shares, stored.shares, atol=1e-5)


def test_a_meshed_ball_is_round_even_and_closed():
    piece = mesh_ball()
    assert np.allclose(np.linalg.norm(piece.vertices, axis=1), 0.1, atol=5e-4)
    assert not list_borders(piece.faces)
    corners = piece.vertices[np.array(piece.faces)]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert edges.min() > 0.004 and edges.max() < 0.04
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    assert np.all(np.sum(normal * corners.mean(axis=1), axis=1) > 0.0)


def test_a_cut_is_crisp_and_pieces_are_stitched_to_a_closed_surface():
    surface, borders = Surface(), []
    for sign in (1.0, -1.0):
        piece = mesh_ball()
        cut_piece(piece, BALL, lambda points, s=sign: s * points[:, 2] - 0.01, (None, 3))
        border = list_borders(piece.faces)
        assert len(border) == 1 and np.allclose(sign * piece.vertices[border[0], 2], 0.01, atol=1e-6)
        assert set(piece.materials) == {3}
        borders += surface.add(piece)
    surface.bridge(*borders, (0.0, 0.0, 1.0), 4)
    assert not list_borders(surface.faces) and surface.materials.count(4) > 10


@pytest.mark.parametrize("blend", [0.01, 0.05])
def test_joined_solids_have_no_crease_and_carved_ones_a_hollow(blend):
    pair = build_chain([(-0.1, 0.0, 0.0, 0.05), (-0.05, 0.0, 0.0, 0.05)]), build_ellipsoid((0.05, 0, 0), (0.06,) * 3)
    between = np.array([[0.0, 0.03, 0.0]])
    assert join(blend, *pair)(between) <= min(solid(between) for solid in pair)
    assert carve(blend, *pair)(np.array([[0.05, 0.0, 0.0]])) > 0.0
