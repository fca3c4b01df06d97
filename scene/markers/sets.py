"""Convert the labels of a cloud to a marker set of the core, and apply a marker set to the labels of a cloud."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bmesh
import bpy

from ...beyond_mocap.base.errors import InputError
from . import nodes
from .settings import is_cloud

if TYPE_CHECKING:
    from ...beyond_mocap.markers.model.marker_set import MarkerSet

OWN = "own"


def of_cloud(cloud: bpy.types.Object, name: str = "") -> "MarkerSet":
    """Build the marker set that a cloud's labels describe.

    Markers that the cloud lacks come from its static trial and the set that was applied last.

    Args:
        cloud: the cloud.
        name: of the set; "" uses the cloud's.
    Returns:
        The marker set.
    Raises:
        InputError: if no marker has a segment, or names are wrong.
    """
    from ...beyond_mocap.markers.files.marker_set_text import parse_marker_set
    from ...beyond_mocap.markers.model.marker_set import MarkerSet

    kept = cloud.beyond_mocap_cloud
    told = {row.name: (row.segment.strip(), row.landmark, row.role) for row in kept.labels}
    if not any(segment for segment, *_ in told.values()):
        raise InputError(cloud.name, "no marker has a segment", "markers with segments",
                         "load a marker set, or select markers in Edit Mode and press Assign")
    before = parse_marker_set(kept.set_text, cloud.name) if kept.set_text else None  # the set that was applied last
    if is_cloud(kept.static):
        told = {row.name: (row.segment.strip(), row.landmark, "STATIC") for row in kept.static.beyond_mocap_cloud.labels
                if row.role not in ("BALL", "OTHER") and row.segment.strip()} | told  # fmt: skip
    told = _rows_of(before) | told if before is not None else told
    carried, marked = {}, {}
    for label, (segment, landmark, how) in told.items():
        if segment and how not in ("BALL", "OTHER"):
            carried.setdefault(segment, []).append(label)
            for point in filter(None, (part.strip() for part in landmark.split(","))):
                marked.setdefault(point, []).append(label)
    on_body = [label for labels in carried.values() for label in labels]
    having = {how: [label for label, row in told.items() if row[2] == how] for how in ("STATIC", "OPTIONAL")}
    return MarkerSet(name or kept.set_name or OWN, carried, marked, before.aliases if before is not None else {},
                     static=frozenset(having["STATIC"]) & frozenset(on_body),
                     optional=frozenset(having["OPTIONAL"]) & frozenset(on_body),
                     ball=tuple(label for label, row in told.items() if row[2] == "BALL"),
                     other=tuple(label for label, row in told.items() if row[2] == "OTHER"))


def _rows_of(marker_set: "MarkerSet") -> dict[str, tuple[str, str, str]]:
    """Return segment, landmarks and role of every label of a set."""
    marks: dict[str, list[str]] = {}
    for landmark, labels in marker_set.landmarks.items():
        for label in labels:
            marks.setdefault(label, []).append(landmark)
    labels = (*marker_set.labels, *marker_set.ball, *marker_set.other)
    return {label: (marker_set.segment_of(label) or "", ", ".join(marks.get(label, ())), role(marker_set, label))
            for label in labels}


def apply(cloud: bpy.types.Object, marker_set: "MarkerSet") -> list[str]:
    """Apply names, segments and roles of a marker set to a cloud's labels; return messages on what does not fit."""
    from ...beyond_mocap.markers.files.marker_set_text import marker_set_text
    from ...beyond_mocap.markers.model.marker_set import named_as
    from .cloud import read

    kept, rows = cloud.beyond_mocap_cloud, _rows_of(marker_set)
    trial = read(cloud, bpy.context.scene)
    names = dict(zip(trial.labels, named_as(trial, marker_set).labels))
    with nodes.draw_later():
        for row in kept.labels:
            row.name = names.get(row.name, row.name)
            row.segment, row.landmark, row.role = rows.get(row.name, ("", "", "NEEDED"))
    nodes.draw_lines(cloud)
    kept.set_name, kept.set_text = marker_set.name, marker_set_text(marker_set)
    missing = sorted(marker_set.needed - {row.name for row in kept.labels})
    return [f"{marker_set.name}: {', '.join(missing[:8])} missing in {cloud.name}"] if missing else []


def role(marker_set: "MarkerSet", label: str) -> str:
    """Return a label's role in a set."""
    table = (("BALL", marker_set.ball), ("OTHER", marker_set.other), ("STATIC", marker_set.static),
             ("OPTIONAL", marker_set.optional))
    return next((name for name, labels in table if label in labels), "NEEDED")


def recognised(labels: tuple[str, ...]) -> "MarkerSet":
    """Choose the shipped set of these labels; raise InputError where none fits."""
    from ...beyond_mocap.markers.files.marker_set_text import shipped_sets
    from ...beyond_mocap.markers.model.marker_set import recognise

    return recognise(labels, shipped_sets())


def assign(cloud: bpy.types.Object, names: list[str], segment: str) -> None:
    """Assign markers to a segment; "" removes them from it."""
    from ...beyond_mocap.markers.model.template import JOINTS

    if segment and segment not in JOINTS:
        raise InputError("segment", f"{segment!r}", f"one of {', '.join(JOINTS)}")
    with nodes.draw_later():
        for row in cloud.beyond_mocap_cloud.labels:
            if row.name in names:
                row.segment = segment
                if row.role in ("BALL", "OTHER") and segment:
                    row.role = "NEEDED"
    cloud.beyond_mocap_cloud.set_name = OWN
    nodes.draw_lines(cloud)


def chosen(cloud: bpy.types.Object) -> list[str]:
    """List the labels of the selected vertices; outside Edit Mode that of the active row."""
    from .cloud import markers

    if not is_cloud(cloud):
        return []
    kept = cloud.beyond_mocap_cloud
    if cloud.mode != "EDIT":
        return [row.name for number, row in enumerate(kept.labels) if number == kept.active_label]
    selected = [vertex.select for vertex in bmesh.from_edit_mesh(cloud.data).verts]
    return [kept.labels[marker].name for marker, on in zip(markers(cloud), selected) if on]
