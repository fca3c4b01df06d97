"""The pitch: one flat mesh of grass with the markings cut into it.

Lines and stripes are faces of the same surface with other materials. Nothing lies on anything, so no clip distance and
no shading mode of the 3D view can make them flicker.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector
from mathutils.geometry import delaunay_2d_cdt

from . import surfaces
from .meshes import create_mesh, create_object

SIZE, LINE_WIDTH = (105.0, 68.0), 0.12  # metres; International Football Association Board, Laws of the Game, Law 1
SPOT = 0.11  # metres, radius of the centre mark and the penalty marks
STRIPE = 5.5  # metres, about: the depth of a goal area, so that the boxes end with a stripe
BEYOND = 6.0  # metres of grass beyond the lines
CHORD = 3.0  # degrees, an arc's longest chord
TRIANGLES = 1  # delaunay_2d_cdt: the triangles inside the given faces
LINES = 2  # number of the lines' material; 0 and 1 are the stripes'


def create_pitch(collection: bpy.types.Collection, units: float,
                 size: tuple[float, float] = SIZE) -> bpy.types.Object:
    """Create the grass of a pitch of `size` (length, width) metres, a little larger than its lines."""
    stripes = _build_stripes(*size)
    lines = [quad for stroke in _build_strokes(*size) for quad in _build_ribbon(np.array(stroke, float))]
    lines += [np.array(_build_arc((x, 0.0), SPOT, 0, 360)[:-1]) for x in (0.0, size[0] / 2 - 11.0, 11.0 - size[0] / 2)]
    corners, faces, materials = cut_faces([*stripes, *lines], [*(i % 2 for i in range(len(stripes))),
                                                               *(LINES for _ in lines)])
    mesh = create_mesh("Grass", np.column_stack([corners, np.zeros(len(corners))]) * units, faces)
    for material in surfaces.get_pitch_materials(units):
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", materials)
    return create_object(collection, "Grass", mesh)


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


def _build_strokes(length: float, width: float) -> list:
    """Build the centre lines of all markings but the spots, each a list of points (x, y) in metres."""
    x, y = length / 2, width / 2
    strokes = [_build_box(-x, -y, x, y), [(0, -y), (0, y)], _build_arc((0, 0), 9.15, 0, 360)]
    for side in (-1, 1):
        goal, mark, inward = side * x, side * (x - 11.0), 180 if side > 0 else 0
        for half_width, depth in ((20.16, 16.5), (9.16, 5.5)):
            front = goal - side * depth
            strokes.append([(goal, half_width), (front, half_width), (front, -half_width), (goal, -half_width)])
        strokes.append(_build_arc((mark, 0), 9.15, inward - 53, inward + 53))
        for touch in (-1, 1):
            middle = np.degrees(np.arctan2(-touch, -side))
            strokes.append(_build_arc((goal, touch * y), 1.0, middle - 45, middle + 45))
    return strokes


def _build_ribbon(points: np.ndarray) -> np.ndarray:
    """Build the quads (N - 1, 4, 2) of a line along points (N, 2), mitred at its corners."""
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    closed = np.allclose(points[0], points[-1])
    before = np.concatenate([along[-1:] if closed else along[:1], along])
    after = np.concatenate([along, along[:1] if closed else along[-1:]])
    bisector = before + after
    across = np.stack([-bisector[:, 1], bisector[:, 0]], axis=1)
    across /= np.sum(across * np.stack([-before[:, 1], before[:, 0]], axis=1), axis=1, keepdims=True)
    left, right = points + across * LINE_WIDTH / 2, points - across * LINE_WIDTH / 2
    return np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)


def _build_box(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]


def _build_arc(centre, radius, start, end):
    angles = np.radians(np.linspace(start, end, max(16, int((end - start) / CHORD)) + 1))
    return [(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angles]
