"""Shirt numbers as meshes: Blender's own digits, cut fine enough to lie on the cloth, big on the back, small in
front."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bmesh
import bpy
import numpy as np

from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from ...beyond_mocap.appearance.body import BodyMesh

SIZES = {"back": 0.235, "chest": 0.095}  # metres that digits are tall
WIDEST = {"back": 0.26, "chest": 0.13}  # metres that two digits may take
FINE = 0.018  # metres between cuts


def shapes(
    number: int, body: "BodyMesh", skeleton: Skeleton, example: Motion
) -> tuple[np.ndarray, list[tuple[int, ...]], np.ndarray, np.ndarray]:
    """Vertices (V, 3) m in the rest pose, faces, joints (V, 6) and weights (V, 6) of `number` on back and chest."""
    from ...beyond_mocap.appearance.shirt_number import on_shirt  # brings scipy, which is slow to import

    scale = float(np.ptp(body.vertices, axis=0).max()) / 1.8
    vertices, faces, joints, weights = [], [], [], []
    for side in SIZES:
        points, polygons = _digits(str(number), SIZES[side] * scale, WIDEST[side] * scale)
        laid = on_shirt(body, skeleton, points, side, example)
        first = sum(len(rows) for rows in vertices)
        vertices.append(laid.vertices)
        joints.append(laid.joints)
        weights.append(laid.weights)
        faces += [tuple(first + corner for corner in polygon) for polygon in polygons]
    return np.concatenate(vertices), faces, np.concatenate(joints), np.concatenate(weights)


def _digits(text: str, tall: float, widest: float) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Points (N, 2) m around the text's middle, to the right and up, and polygons that look at the reader."""
    mesh = _filled(text)
    shape = bmesh.new()
    shape.from_mesh(mesh)
    bpy.data.meshes.remove(mesh)
    bmesh.ops.remove_doubles(shape, verts=shape.verts, dist=1e-5)
    points = np.array([vertex.co[:2] for vertex in shape.verts])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, scale = (low + high) / 2.0, tall / (high[1] - low[1])
    scale = np.array([min(scale, widest / (high[0] - low[0])), scale])
    for axis in (0, 1):
        for at in np.arange(low[axis], high[axis], FINE / scale[axis])[1:]:
            place, normal = np.zeros(3), np.zeros(3)
            place[axis], normal[axis] = at, 1.0
            whole = shape.verts[:] + shape.edges[:] + shape.faces[:]
            bmesh.ops.bisect_plane(shape, geom=whole, plane_co=place, plane_no=normal, dist=1e-6)
    shape.verts.index_update()
    points = np.array([vertex.co[:2] for vertex in shape.verts])
    facing = np.sign(sum(face.normal.z * face.calc_area() for face in shape.faces))
    polygons = [tuple(vertex.index for vertex in face.verts)[:: 1 if facing > 0 else -1] for face in shape.faces]
    shape.free()
    return (points - middle) * scale, polygons


def _filled(text: str) -> bpy.types.Mesh:
    """The text as a flat mesh, in Blender's built-in font."""
    curve = bpy.data.curves.new("Number", "FONT")
    curve.body, curve.resolution_u = text, 4
    thing = bpy.data.objects.new("Number", curve)
    mesh = bpy.data.meshes.new_from_object(thing)
    bpy.data.objects.remove(thing)
    bpy.data.curves.remove(curve)
    return mesh
