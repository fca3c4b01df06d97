"""Import Words: a file of words becomes the active player's strips, or those of the clip that is annotated."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.annotation import read_timeline
from ..beyond_mocap.errors import InputError
from ..scene import clip_annotation, recordings, strips, tracks
from ..scene.settings import active_player, as_setting
from .verb import ImportVerb


class BEYOND_MOCAP_OT_import_words(ImportVerb, bpy.types.Operator):
    """Import a text of words ('START END words', 'TIME words') as strips: of the active player, or of the library's
clip whose armature is active. Strips that are there are replaced"""

    bl_idname = "beyond_mocap.import_words"
    bl_label = "Import Words"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".txt"

    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        """Somebody whose words they are."""
        cls.poll_message_set("Import tracking first: words belong to a player")
        return bool(clip_annotation.shown(context.object)) or active_player(context.scene.beyond_mocap) is not None

    def do(self, context):
        """Read the file, then lay the strips."""
        chosen = self.chosen()
        if len(chosen) != 1:
            raise InputError("import", f"{len(chosen)} files" if chosen else "no file given", "one text of words")
        settings, rig = context.scene.beyond_mocap, context.object
        if clip_annotation.shown(rig):
            motion, _ = recordings.read(settings, clip_annotation.shown(rig), rig[recordings.FOLDER])
            timeline, whose = read_timeline(chosen[0], motion.fps), rig.name
            clip_annotation.lay(rig, context.scene, motion, timeline)
        else:
            player = active_player(settings)
            start = float(tracks.read_track(settings, player).times[0])
            timeline, whose = read_timeline(chosen[0], settings.rate, start), player.name
            strips.write(context, player, timeline)
            player.annotation_file = as_setting(str(chosen[0]))
        self.report({"INFO"}, f"{whose}: {len(timeline.spans)} spans and {len(timeline.keys)} key moments")


class BEYOND_MOCAP_FH_words(bpy.types.FileHandler):
    """Texts of words dropped into a view"""

    bl_idname = "BEYOND_MOCAP_FH_words"
    bl_label = "Words of the active player or clip"
    bl_import_operator = "beyond_mocap.import_words"
    bl_file_extensions = ".txt"

    @classmethod
    def poll_drop(cls, context):
        """Where there is somebody whose words they are."""
        where = context.area is not None and context.area.type in {"VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR"}
        return where and BEYOND_MOCAP_OT_import_words.poll(context)
