"""Read Match: who plays, in which colours, and what the data are like."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import CollectionProperty, StringProperty

from ..scene.match import reading
from .verb import BackgroundVerb


class BEYOND_MOCAP_OT_read_match(BackgroundVerb, bpy.types.Operator):
    """Read a provider's tracking of a whole match: fills the list of players, the teams' colours and the data report.
The first minute is chosen"""

    bl_idname = "beyond_mocap.read_match"
    bl_label = "Read Match"
    kind = "match file"

    filepath: StringProperty(
        name="File", subtype="FILE_PATH", options={"SKIP_SAVE"},
        description="A tracking file; empty: the one that is chosen in the panel",
    )
    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context, event):
        """Of files that are dropped together the first one is read: a second one is found beside it."""
        names = sorted(file.name for file in self.files if file.name)
        if self.directory and names:
            self.filepath = str(Path(self.directory, _first(names)))
        return super().invoke(context, event)

    def order(self, context):
        """Which files."""
        chosen = bpy.path.abspath(self.filepath) if self.filepath else ""
        return reading.order_of(context.scene.beyond_mocap_match, chosen)

    @staticmethod
    def work(order, progress, cancelled, hurry):
        """Read them."""
        return reading.work(order, progress)

    def apply(self, scene, result):
        """The list."""
        order, read = result
        match = scene.beyond_mocap_match
        reading.fill(match, order, read)
        for line in match.report.splitlines()[:6]:
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"{len(read.players)} players, {match.length_s / 60.0:.1f} minutes, {read.provider}")


class BEYOND_MOCAP_FH_match(bpy.types.FileHandler):
    """A provider's tracking of a match dropped into the 3D view"""

    bl_idname = "BEYOND_MOCAP_FH_match"
    bl_label = "Match of all players"
    bl_import_operator = "beyond_mocap.read_match"
    bl_file_extensions = ".csv;.txt;.json;.jsonl;.xml;.dat"

    @classmethod
    def poll_drop(cls, context):
        """The 3D view, where the match will be."""
        return context.area is not None and context.area.type == "VIEW_3D"


def _first(names: list[str]) -> str:
    """Of a tracking file and its metadata the tracking: that is no .xml and does not say meta."""
    return next((name for name in names if not name.lower().endswith(".xml") and "meta" not in name.lower()), names[0])
