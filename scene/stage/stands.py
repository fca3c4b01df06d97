"""The stands: a simple bowl around the pitch with boards, two tiers, a crowd and a roof's edge."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.material import get_material
from . import surfaces
from .meshes import create_mesh, create_object

NAME = "Stands"
MARGIN = 5.9  # metres between the lines and the boards, which stand on the grass
CORNER, STEPS = 12.0, 6  # metres of the bowl's inner radius at its corners, and edges of such a corner
PARTS = {"boards": ((0.0, 0.0), (0.0, 0.95)),
         "concrete": ((0.0, 0.95), (0.25, 0.95), (0.25, 0.0), (2.2, 0.0), (2.2, 1.4)),
         "crowd": ((2.2, 1.4), (15.0, 8.2)),
         "wall": ((15.0, 8.2), (15.0, 11.0), (15.6, 11.0)),
         "upper crowd": ((15.6, 11.0), (31.0, 22.5)),
         "back": ((31.0, 22.5), (31.0, 29.5)),
         "roof": ((31.0, 29.5), (11.0, 26.5), (11.0, 27.6), (32.0, 31.0))}
"""Profile of each part: metres outwards from the boards' foot, and above the ground."""


def create_stands(collection: bpy.types.Collection, units: float, size: tuple[float, float]) -> bpy.types.Object:
    """Create the bowl around a pitch of `size` (length, width) metres."""
    corners, faces, places, materials = [], [], [], []
    for part, profile in PARTS.items():
        ring, own_faces, own_places = _sweep(np.array(profile), size)
        faces += [tuple(corner + len(corners) for corner in face) for face in own_faces]
        materials += [_choose_material(part)] * len(own_faces)
        corners += ring.tolist()
        places += own_places
    mesh = create_mesh(NAME, np.array(corners) * units, faces)
    for material in (get_material("Stand concrete", (0.11, 0.11, 0.115), 0.9), surfaces.get_crowd_material(),
                     surfaces.get_board_material(), get_material("Stand roof", (0.035, 0.038, 0.045), 0.7)):
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.array(materials, np.int32))
    mesh.uv_layers.new(name="Metres").data.foreach_set("uv", np.array(places, np.float32).ravel())
    return create_object(collection, NAME, mesh)


def _choose_material(part: str) -> int:
    return {"crowd": 1, "upper crowd": 1, "boards": 2, "roof": 3}.get(part, 0)


def _sweep(profile: np.ndarray, size: tuple[float, float]):
    """Sweep a profile (P, 2) around the pitch.

    Returns:
        Corners (P R, 3) metres, quads that face inwards, and for each corner of each quad its metres along and up.
    """
    rings = [_build_ring(outwards, size) for outwards, _ in profile]
    count = len(rings[0])
    corners = np.concatenate([np.column_stack([ring, np.full(count, height)])
                              for ring, (_, height) in zip(rings, profile)])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(np.vstack([rings[0], rings[0][:1]]), axis=0),
                                                            axis=1))])
    up = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    faces, places = [], []
    for row in range(len(profile) - 1):
        for i in range(count):
            j = (i + 1) % count
            faces.append((row * count + j, row * count + i, (row + 1) * count + i, (row + 1) * count + j))
            places += [(along[i + 1], up[row]), (along[i], up[row]), (along[i], up[row + 1]),
                       (along[i + 1], up[row + 1])]
    return corners, faces, places


def _build_ring(outwards: float, size: tuple[float, float]) -> np.ndarray:
    """Build a rectangle with round corners (R, 2), metres, that far out from the boards, counter-clockwise."""
    half = np.array(size) / 2.0 + MARGIN - CORNER
    radius = CORNER + outwards
    quarters = []
    for number, sign in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        angles = np.radians(90.0 * number + np.linspace(0.0, 90.0, STEPS + 1))
        quarters.append(half * sign + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    return np.concatenate(quarters)
