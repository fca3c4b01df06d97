"""Meshes of the stage: new ones from corners and faces, and tubes and cords between pairs of points."""

from __future__ import annotations

import bpy
import numpy as np


def create_mesh(name: str, corners, faces) -> bpy.types.Mesh:
    """Create a mesh from corners (N, 3) and faces, each a row of corner numbers."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(corners).tolist(), [], faces)
    return mesh


def create_object(collection: bpy.types.Collection, name: str, data) -> bpy.types.Object:
    """Create an object in a collection; meshes are not selectable in the view."""
    thing = bpy.data.objects.new(name, data)
    thing.hide_select = data is not None and isinstance(data, bpy.types.Mesh)
    collection.objects.link(thing)
    return thing


def create_tubes(name: str, ends, radius: float, sides: int = 12) -> bpy.types.Mesh:
    """Create round tubes with closed ends.

    Args:
        name: of the mesh.
        ends: pairs of points (3,).
        radius: of a tube, in the unit of the points.
        sides: of a tube.
    Returns:
        The mesh.
    """
    corners, faces = [], []
    angles = 2.0 * np.pi * np.arange(sides) / sides
    for low, high in ends:
        first, second = _find_perpendiculars(high - low)
        circle = radius * (np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second)
        start = len(corners)
        corners += [*(low + circle), *(high + circle)]
        faces += [(start + i, start + (i + 1) % sides, start + sides + (i + 1) % sides, start + sides + i)
                  for i in range(sides)]
        faces += [tuple(start + i for i in reversed(range(sides))), tuple(start + sides + i for i in range(sides))]
    mesh = create_mesh(name, np.array(corners), faces)
    mesh.polygons.foreach_set("use_smooth", np.array([len(face) == 4 for face in faces]))
    return mesh


def create_cords(name: str, ends, half_width: float) -> bpy.types.Mesh:
    """Create thin crossed ribbons between pairs of points (3,), visible from all directions."""
    corners, faces = [], []
    for low, high in ends:
        for aside in _find_perpendiculars(high - low):
            start = len(corners)
            aside = half_width * aside
            corners += [low - aside, low + aside, high + aside, high - aside]
            faces.append(tuple(range(start, start + 4)))
    return create_mesh(name, np.array(corners), faces)


def _find_perpendiculars(along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors at right angles to `along` (3,) and to each other."""
    along = along / np.linalg.norm(along)
    first = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    return first, np.cross(along, first)
