"""The pitch: one flat mesh of its ground with the markings cut into it.

Lines and stripes are faces of the same surface with other materials. Nothing lies on anything, so no clip distance and
no shading mode of the 3D view can make them flicker.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector
from mathutils.geometry import delaunay_2d_cdt

from ...beyond_mocap.appearance.pitch_markings import Marking, build_markings
from ...beyond_mocap.appearance.sports import Sport
from . import surfaces
from .meshes import create_mesh, create_object

STRIPE = 5.5  # metres, about: the depth of a goal area, so that the boxes end with a stripe
BEYOND = 6.0  # metres of ground beyond the lines
TRIANGLES = 1  # delaunay_2d_cdt: the triangles inside the given faces
LINES = 2  # number of the first paint's material; 0 and 1 are the stripes'


def create_pitch(collection: bpy.types.Collection, units: float, sport: Sport,
                 size: tuple[float, float]) -> bpy.types.Object:
    """Create the ground of a sport's pitch of `size` (length, width) metres, a little larger than its lines."""
    stripes = _build_stripes(size[0] + 2.0 * sport.behind, size[1])
    markings = build_markings(sport, size)
    paints = sorted({marking.colour for marking in markings}, key=list(surfaces.PAINTS).index)
    lines, kinds = [], []
    for marking in markings:
        own = _build_ribbon(marking) if marking.width else [marking.points]
        lines += [*own]
        kinds += [LINES + paints.index(marking.colour)] * len(own)
    corners, faces, materials = cut_faces([*stripes, *lines], [*(i % 2 for i in range(len(stripes))), *kinds])
    mesh = create_mesh("Grass", np.column_stack([corners, np.zeros(len(corners))]) * units, faces)
    for material in surfaces.get_pitch_materials(sport.ground, paints, units):
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", materials)
    return create_object(collection, "Grass", mesh)


def create_boards(collection: bpy.types.Collection, units: float, sport: Sport, size: tuple[float, float]) -> None:
    """Create the boards of a rink: a thin wall on its outline."""
    outline = build_markings(sport, size)[0].points
    count = len(outline) - 1
    corners = [(*point, height) for height in (0.0, sport.boards) for point in outline[:-1]]
    faces = [(i, (i + 1) % count, count + (i + 1) % count, count + i) for i in range(count)]
    mesh = create_mesh("Boards", np.array(corners) * units, faces)
    mesh.materials.append(surfaces.get_material("Rink boards", (0.75, 0.75, 0.75), 0.5))
    create_object(collection, "Boards", mesh)


def cut_faces(polygons: list, kinds: list[int]) -> tuple[np.ndarray, list, np.ndarray]:
    """Cut polygons that may overlap into triangles that do not.

    Args:
        polygons: each (n, 2) corners, counter-clockwise.
        kinds: number of each polygon; where several overlap, the highest is used.
    Returns:
        Corners (N, 2), triangles as rows of corner numbers, and their kinds (T,).
    """
    points = [Vector(point) for polygon in polygons for point in polygon]
    ends = np.cumsum([len(polygon) for polygon in polygons])
    rows = [list(range(end - len(polygon), end)) for polygon, end in zip(polygons, ends)]
    corners, _, faces, _, _, sources = delaunay_2d_cdt(points, [], rows, TRIANGLES, 1e-5)
    found = np.array([max(kinds[source] for source in given) for given in sources], np.int32)
    return np.array([tuple(corner) for corner in corners]), faces, found


def _build_stripes(length: float, width: float) -> list[np.ndarray]:
    """Build the mown stripes across the pitch, an even number between the goal lines, as corners in metres."""
    count = 2 * max(1, round(length / STRIPE / 2))
    inner = np.linspace(-length / 2, length / 2, count + 1)
    edges = np.concatenate([[inner[0] - BEYOND], inner, [inner[-1] + BEYOND]])
    y = width / 2 + BEYOND
    return [np.array([(a, -y), (b, -y), (b, y), (a, y)]) for a, b in zip(edges[:-1], edges[1:])]


def _build_ribbon(marking: Marking) -> np.ndarray:
    """Build the quads (N - 1, 4, 2) of a line along N points, mitred at its corners."""
    points = marking.points
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    closed = np.allclose(points[0], points[-1])
    before = np.concatenate([along[-1:] if closed else along[:1], along])
    after = np.concatenate([along, along[:1] if closed else along[-1:]])
    bisector = before + after
    across = np.stack([-bisector[:, 1], bisector[:, 0]], axis=1)
    across /= np.sum(across * np.stack([-before[:, 1], before[:, 0]], axis=1), axis=1, keepdims=True)
    left, right = points + across * marking.width / 2, points - across * marking.width / 2
    return np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)
