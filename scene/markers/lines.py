"""Which markers belong together, as it is seen: edges between the markers of a segment, colours by side."""

from __future__ import annotations

from contextlib import contextmanager

import bmesh
import bpy
import numpy as np

from . import nodes

NEIGHBOURS = 3  # edges that each marker begins

_waiting: list[bool] = []


@contextmanager
def at_once():
    """Many labels are changed; whoever does it draws at the end."""
    _waiting.append(True)
    try:
        yield
    finally:
        _waiting.pop()


def draw(cloud: bpy.types.Object) -> None:
    """Write edges and colours by the segments of the labels, in edit mode too; what is selected stays selected."""
    mesh, labels = cloud.data, cloud.beyond_mocap_cloud.labels
    if _waiting or cloud.library is not None or mesh.library is not None:
        return
    if not mesh.is_editmode and nodes.MARKER not in mesh.attributes:
        return
    shape = bmesh.from_edit_mesh(mesh) if mesh.is_editmode else bmesh.new()
    if not mesh.is_editmode:
        shape.from_mesh(mesh)
    colours = shape.verts.layers.int.get(nodes.SIDE) or shape.verts.layers.int.new(nodes.SIDE)
    which = shape.verts.layers.int[nodes.MARKER]
    shape.verts.ensure_lookup_table()
    segments = [labels[vertex[which]].segment if vertex[which] < len(labels) else "" for vertex in shape.verts]
    for vertex, segment in zip(shape.verts, segments):
        thing = vertex[which] < len(labels) and labels[vertex[which]].role in ("BALL", "OTHER")
        vertex[colours] = 0 if thing else side(segment)
    for edge in list(shape.edges):
        shape.edges.remove(edge)
    for one, other in edges(np.array([vertex.co for vertex in shape.verts]), segments):
        shape.edges.new((shape.verts[one], shape.verts[other]))
    if mesh.is_editmode:
        bmesh.update_edit_mesh(mesh)
    else:
        shape.to_mesh(mesh)
        shape.free()


def edges(places: np.ndarray, segments: list[str]) -> list[tuple[int, int]]:
    """Pairs of markers: each with its nearest of the same segment. places: (M, 3); segments: "" belongs to none."""
    found = set()
    for segment in sorted({name for name in segments if name}):
        mine = np.flatnonzero([name == segment for name in segments])
        apart = np.linalg.norm(places[mine, None] - places[None, mine], axis=-1)
        for row, order in zip(mine, np.argsort(apart, axis=1, kind="stable")):
            near = [mine[other] for other in order[: NEIGHBOURS + 1] if mine[other] != row]
            found |= {(int(min(row, other)), int(max(row, other))) for other in near}
    return sorted(found)


def side(segment: str) -> int:
    """Which of `nodes.COLOURS` a segment's markers have."""
    if not segment:
        return 3
    return 1 if segment.startswith("Left") else 2 if segment.startswith("Right") else 0
