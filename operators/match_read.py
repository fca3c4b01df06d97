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

    def order(self, context):
        """Which files. Of those that are dropped together the largest is read, which is the tracking: others are found
        beside it."""
        dropped = [Path(self.directory, name) for name in sorted(file.name for file in self.files) if name]
        chosen = str(max(dropped, key=_size)) if self.directory and dropped else self.filepath
        return reading.order_of(context.scene.beyond_mocap_match, bpy.path.abspath(chosen) if chosen else "")

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
    bl_file_extensions = ".csv;.json;.jsonl;.xml;.dat"  # dropped texts are words; tracking as text is chosen by name

    @classmethod
    def poll_drop(cls, context):
        """The 3D view, where the match will be."""
        return context.area is not None and context.area.type == "VIEW_3D"


def _size(path: Path) -> int:
    """Bytes of a file; 0 where there is none."""
    return path.stat().st_size if path.is_file() else 0
