"""Which markers belong together, as it is seen: edges between the markers of a segment, colours by side."""

from __future__ import annotations

import bpy
import numpy as np

from . import nodes
from .settings import is_cloud

NEIGHBOURS = 3  # edges that each marker begins


def draw(cloud: bpy.types.Object) -> None:
    """Write edges and colours by the segments of the labels."""
    if not is_cloud(cloud) or cloud.library is not None or cloud.data.library is not None or cloud.mode == "EDIT":
        return
    from .cloud import markers

    mesh, labels = cloud.data, cloud.beyond_mocap_cloud.labels
    who, places = markers(cloud), np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", places)
    segments = [labels[marker].segment for marker in who]
    pairs = edges(places.reshape(-1, 3), segments)
    mesh.clear_geometry()
    mesh.vertices.add(len(who))
    mesh.attributes["position"].data.foreach_set("vector", places)
    mesh.attributes.new(nodes.MARKER, "INT", "POINT").data.foreach_set("value", who)
    mesh.attributes.new(nodes.SIDE, "INT", "POINT").data.foreach_set("value", [side(name) for name in segments])
    mesh.edges.add(len(pairs))
    mesh.edges.foreach_set("vertices", pairs.ravel())
    mesh.update()


def edges(places: np.ndarray, segments: list[str]) -> np.ndarray:
    """Pairs (E, 2) of markers: each with its nearest of the same segment. places: (M, 3); segments: "" belongs to none."""
    found = set()
    for segment in sorted({name for name in segments if name}):
        mine = np.flatnonzero([name == segment for name in segments])
        apart = np.linalg.norm(places[mine, None] - places[None, mine], axis=-1)
        for row, order in zip(mine, np.argsort(apart, axis=1, kind="stable")):
            found |= {(min(row, mine[near]), max(row, mine[near])) for near in order[: NEIGHBOURS + 1] if mine[near] != row}
    return np.array(sorted(found), np.int32).reshape(-1, 2)


def side(segment: str) -> int:
    """Which of `nodes.COLOURS` a segment's markers have."""
    if not segment:
        return 3
    return 1 if segment.startswith("Left") else 2 if segment.startswith("Right") else 0
