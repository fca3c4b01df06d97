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


def build_marker_set(cloud: bpy.types.Object, name: str = "") -> "MarkerSet":
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

    properties = cloud.beyond_mocap_cloud
    rows = {row.name: (row.segment.strip(), row.landmark, row.role) for row in properties.labels}
    if not any(segment for segment, *_ in rows.values()):
        raise InputError(cloud.name, "no marker has a segment", "markers with segments",
                         "load a marker set, or select markers in Edit Mode and press Assign")
    applied = parse_marker_set(properties.set_text,
                               cloud.name) if properties.set_text else None  # the set that was applied last
    if is_cloud(properties.static):
        rows = {row.name: (row.segment.strip(), row.landmark, "STATIC")
                for row in properties.static.beyond_mocap_cloud.labels if row.role not in ("BALL", "OTHER")
                and row.segment.strip()} | rows  # fmt: skip
    rows = _list_rows(applied) | rows if applied is not None else rows
    segments, landmarks = {}, {}
    for label, (segment, landmark, role_name) in rows.items():
        if segment and role_name not in ("BALL", "OTHER"):
            segments.setdefault(segment, []).append(label)
            for point in filter(None, (part.strip() for part in landmark.split(","))):
                landmarks.setdefault(point, []).append(label)
    on_body = [label for labels in segments.values() for label in labels]
    by_role = {role_name: [label for label, row in rows.items() if row[2] == role_name]
               for role_name in ("STATIC", "OPTIONAL")}
    return MarkerSet(name or properties.set_name or OWN, segments, landmarks, applied.aliases if applied is not None
                     else {}, static=frozenset(by_role["STATIC"]) & frozenset(on_body),
                     optional=frozenset(by_role["OPTIONAL"]) & frozenset(on_body),
                     ball=tuple(label for label, row in rows.items() if row[2] == "BALL"),
                     other=tuple(label for label, row in rows.items() if row[2] == "OTHER"))


def _list_rows(marker_set: "MarkerSet") -> dict[str, tuple[str, str, str]]:
    """Return segment, landmarks and role of every label of a set."""
    marks: dict[str, list[str]] = {}
    for landmark, labels in marker_set.landmarks.items():
        for label in labels:
            marks.setdefault(label, []).append(landmark)
    labels = (*marker_set.labels, *marker_set.ball, *marker_set.other)
    return {label: (marker_set.find_segment(label) or "", ", ".join(marks.get(label, ())), find_role(marker_set, label))
            for label in labels}


def apply_marker_set(cloud: bpy.types.Object, marker_set: "MarkerSet") -> list[str]:
    """Apply names, segments and roles of a marker set to a cloud's labels; return messages on what does not fit."""
    from ...beyond_mocap.markers.files.marker_set_text import format_marker_set
    from ...beyond_mocap.markers.model.marker_set import convert_labels
    from .cloud import read_trial

    properties, rows = cloud.beyond_mocap_cloud, _list_rows(marker_set)
    trial = read_trial(cloud, bpy.context.scene)
    names = dict(zip(trial.labels, convert_labels(trial, marker_set).labels))
    with nodes.defer_lines():
        for row in properties.labels:
            row.name = names.get(row.name, row.name)
            row.segment, row.landmark, row.role = rows.get(row.name, ("", "", "NEEDED"))
    nodes.draw_lines(cloud)
    properties.set_name, properties.set_text = marker_set.name, format_marker_set(marker_set)
    missing = sorted(marker_set.required_markers - {row.name for row in properties.labels})
    return [f"{marker_set.name}: {', '.join(missing[:8])} missing in {cloud.name}"] if missing else []


def find_role(marker_set: "MarkerSet", label: str) -> str:
    """Return a label's role in a set."""
    table = (("BALL", marker_set.ball), ("OTHER", marker_set.other), ("STATIC", marker_set.static),
             ("OPTIONAL", marker_set.optional))
    return next((name for name, labels in table if label in labels), "NEEDED")


def choose_shipped_set(labels: tuple[str, ...]) -> "MarkerSet":
    """Choose the shipped set of these labels; raise InputError where none fits."""
    from ...beyond_mocap.markers.files.marker_set_text import read_shipped_sets
    from ...beyond_mocap.markers.model.marker_set import choose_marker_set

    return choose_marker_set(labels, read_shipped_sets())


def assign_segment(cloud: bpy.types.Object, names: list[str], segment: str) -> None:
    """Assign markers to a segment; "" removes them from it."""
    from ...beyond_mocap.markers.model.template import JOINTS

    if segment and segment not in JOINTS:
        raise InputError("segment", f"{segment!r}", f"one of {', '.join(JOINTS)}")
    with nodes.defer_lines():
        for row in cloud.beyond_mocap_cloud.labels:
            if row.name in names:
                row.segment = segment
                if row.role in ("BALL", "OTHER") and segment:
                    row.role = "NEEDED"
    cloud.beyond_mocap_cloud.set_name = OWN
    nodes.draw_lines(cloud)


def list_selected_labels(cloud: bpy.types.Object) -> list[str]:
    """List the labels of the selected vertices; outside Edit Mode that of the active row."""
    from .cloud import read_marker_indices

    if not is_cloud(cloud):
        return []
    properties = cloud.beyond_mocap_cloud
    if cloud.mode != "EDIT":
        return [row.name for number, row in enumerate(properties.labels) if number == properties.active_label]
    selected = [vertex.select for vertex in bmesh.from_edit_mesh(cloud.data).verts]
    return [properties.labels[marker].name for marker, on in zip(read_marker_indices(cloud), selected) if on]
