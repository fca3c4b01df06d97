"""Marker sets: onto a cloud's labels, from a file or one of those that come along, and to a file."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.errors import InputError
from ..beyond_mocap.files.whole import atomic_write
from ..scene.markers import sets
from ..scene.markers.settings import cloud_meant
from .marker_verb import OnMarkers
from .verb import ImportVerb, Verb

_items: list[tuple[str, str, str]] = []


def shipped(_operator, _context):
    """The marker sets that come along; kept, since Blender does not keep the texts itself."""
    if not _items:
        from ..beyond_mocap.files.marker_set_text import shipped_sets

        _items.append(("AUTO", "Recognise", "The one that the labels are of"))
        _items.extend((one.name, one.name.replace("_", " ").title(), one.about) for one in shipped_sets())
    return _items


class BEYOND_MOCAP_OT_use_marker_set(OnMarkers, Verb, bpy.types.Operator):
    """Give the markers their segments by a marker set that comes along"""

    bl_idname = "beyond_mocap.use_marker_set"
    bl_label = "Use Marker Set"

    which: EnumProperty(name="Marker Set", items=shipped, description="Which one")

    def do(self, context):
        """Find it, apply it."""
        from ..beyond_mocap.files.marker_set_text import shipped_sets

        thing = self.cloud(context)
        labels = tuple(row.name for row in thing.beyond_mocap_cloud.labels)
        named = (one for one in shipped_sets() if one.name == self.which)
        found = sets.recognised(labels) if self.which == "AUTO" else next(named)
        for line in sets.apply(thing, found):
            self.report({"WARNING"}, line)
        self.report({"INFO"}, f"{thing.name}: {found.name}")


class BEYOND_MOCAP_OT_load_marker_set(OnMarkers, ImportVerb, bpy.types.Operator):
    """Give the markers of the active cloud their segments by a marker set in a text file"""

    bl_idname = "beyond_mocap.load_marker_set"
    bl_label = "Load Marker Set"
    filename_ext = ".txt"

    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})

    def do(self, context):
        """Read it, apply it."""
        from ..beyond_mocap.files.marker_set_text import read_marker_set

        chosen = self.chosen()
        if len(chosen) != 1:
            raise InputError("import", f"{len(chosen)} files" if chosen else "no file given", "one marker set")
        thing = self.cloud(context)
        for line in sets.apply(thing, read_marker_set(chosen[0])):
            self.report({"WARNING"}, line)


class BEYOND_MOCAP_OT_save_marker_set(OnMarkers, Verb, bpy.types.Operator, ExportHelper):
    """Write labels, segments and landmarks of the active cloud as a marker set, for other recordings and the command
line"""

    bl_idname = "beyond_mocap.save_marker_set"
    bl_label = "Save Marker Set"
    bl_options = {"REGISTER"}
    filename_ext = ".txt"

    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})

    def do(self, context):
        """Put it together, write it."""
        from ..beyond_mocap.files.marker_set_text import marker_set_text

        path = Path(bpy.path.abspath(self.filepath))
        name = "_".join(path.stem.split()) or sets.OWN
        atomic_write(path, marker_set_text(sets.of_cloud(cloud_meant(context), name)))
        self.report({"INFO"}, f"written to {path}")
