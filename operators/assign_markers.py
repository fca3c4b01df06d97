"""Assign Markers: which segment of the body carries the selected markers."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ..beyond_mocap.errors import InputError
from ..scene.markers import sets
from .marker_verb import OnMarkers
from .verb import Verb

_items: list[tuple[str, str, str]] = []


def segments(_operator, _context):
    """The segments to choose from; kept, since Blender does not keep the texts itself."""
    if not _items:
        from ..beyond_mocap.markers.template import JOINTS

        _items.append(("NONE", "None", "No segment carries it"))
        _items.extend((name, name, f"The body's {name} carries it") for name in JOINTS)
    return _items


class BEYOND_MOCAP_OT_assign_markers(OnMarkers, Verb, bpy.types.Operator):
    """Say which segment carries the markers that are selected in Edit Mode, or else the one chosen in the list"""

    bl_idname = "beyond_mocap.assign_markers"
    bl_label = "Assign Markers"

    segment: EnumProperty(name="Segment", items=segments, description="The segment of the body that carries them")

    def do(self, context):
        """Write it to the labels."""
        thing = self.cloud(context)
        names = sets.chosen(thing)
        if not names:
            raise InputError(thing.name, "no marker selected", "one at least", "select vertices in Edit Mode")
        segment = "" if self.segment == "NONE" else self.segment
        sets.assign(thing, names, segment)
        self.report({"INFO"}, f"{', '.join(names)}: {segment or 'no segment'}")
