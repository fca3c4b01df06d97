"""The labels of a cloud as a marker set of the core, and a marker set on the labels of a cloud."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bmesh
import bpy

from ...beyond_mocap.errors import InputError
from . import lines
from .settings import is_cloud

if TYPE_CHECKING:
    from ...beyond_mocap.markers.marker_set import MarkerSet

OWN = "own"


def of_cloud(cloud: bpy.types.Object, name: str = "") -> "MarkerSet":
    """The marker set that a cloud's labels describe. InputError where no segment has a marker, or names are wrong."""
    from ...beyond_mocap.markers.marker_set import MarkerSet

    kept = cloud.beyond_mocap_cloud
    carried, marked = {}, {}
    rows = [row for row in kept.labels if row.role not in ("BALL", "OTHER") and row.segment.strip()]
    for row in rows:
        carried.setdefault(row.segment.strip(), []).append(row.name)
        for landmark in filter(None, (part.strip() for part in row.landmark.split(","))):
            marked.setdefault(landmark, []).append(row.name)
    if not rows:
        raise InputError(
            cloud.name, "no marker belongs to a segment", "some that do",
            "load a marker set, or select markers in Edit Mode and press Assign",
        )
    return MarkerSet(
        name or kept.set_name or OWN, carried, marked,
        static=frozenset(row.name for row in rows if row.role == "STATIC"),
        optional=frozenset(row.name for row in rows if row.role == "OPTIONAL"),
        ball=tuple(row.name for row in kept.labels if row.role == "BALL"),
        other=tuple(row.name for row in kept.labels if row.role == "OTHER"),
    )


def apply(cloud: bpy.types.Object, marker_set: "MarkerSet") -> list[str]:
    """Give a cloud's labels the names, segments and roles of a marker set; returns lines about what does not fit."""
    kept = cloud.beyond_mocap_cloud
    names = marker_set.renaming([row.name for row in kept.labels])
    marks = {}
    for landmark, labels in marker_set.landmarks.items():
        for label in labels:
            marks.setdefault(label, []).append(landmark)
    with lines.at_once():
        for row in kept.labels:
            row.name = names.get(row.name, row.name)
            row.segment = marker_set.segment_of(row.name) or ""
            row.landmark = ", ".join(marks.get(row.name, ()))
            row.role = role(marker_set, row.name)
    lines.draw(cloud)
    kept.set_name = marker_set.name
    there = {row.name for row in kept.labels}
    missing = sorted(marker_set.needed - there)
    return [f"{marker_set.name}: {', '.join(missing[:8])} missing in {cloud.name}"] if missing else []


def role(marker_set: "MarkerSet", label: str) -> str:
    """A label's role in a set."""
    table = (
        ("BALL", marker_set.ball), ("OTHER", marker_set.other), ("STATIC", marker_set.static),
        ("OPTIONAL", marker_set.optional),
    )  # fmt: skip
    return next((name for name, labels in table if label in labels), "NEEDED")


def recognised(labels: tuple[str, ...]) -> "MarkerSet":
    """The shipped set that these labels are of. InputError where none fits."""
    from ...beyond_mocap.files.marker_set_text import shipped_sets
    from ...beyond_mocap.markers.marker_set import recognise

    return recognise(labels, shipped_sets())


def assign(cloud: bpy.types.Object, names: list[str], segment: str) -> None:
    """Let these markers belong to a segment; "" frees them."""
    from ...beyond_mocap.markers.template import JOINTS

    if segment and segment not in JOINTS:
        raise InputError("segment", f"{segment!r}", f"one of {', '.join(JOINTS)}")
    with lines.at_once():
        for row in cloud.beyond_mocap_cloud.labels:
            if row.name in names:
                row.segment = segment
                if row.role in ("BALL", "OTHER") and segment:
                    row.role = "NEEDED"
    cloud.beyond_mocap_cloud.set_name = OWN
    lines.draw(cloud)


def chosen(cloud: bpy.types.Object) -> list[str]:
    """Labels of the vertices that are selected; outside Edit Mode that of the list's row."""
    from .cloud import markers

    if not is_cloud(cloud):
        return []
    kept = cloud.beyond_mocap_cloud
    if cloud.mode != "EDIT":
        return [row.name for number, row in enumerate(kept.labels) if number == kept.active_label]
    selected = [vertex.select for vertex in bmesh.from_edit_mesh(cloud.data).verts]
    return [kept.labels[marker].name for marker, on in zip(markers(cloud), selected) if on]
