"""Relink Library: the library's folder was moved; say where it is now, or have it looked for beside the file."""

from __future__ import annotations

import os

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import watch
from ..scene.settings import absolute, as_setting
from .verb import Verb


class BEYOND_MOCAP_OT_relink_library(Verb, bpy.types.Operator):
    """The library's folder was moved: choose where it is now. Without a choice it is looked for beside this file"""

    bl_idname = "beyond_mocap.relink_library"
    bl_label = "Relink Library"

    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        """A folder that was set once."""
        cls.poll_message_set("Choose the library's folder in the field above")
        return bool(context.scene.beyond_mocap.library_folder)

    def invoke(self, context, _event):
        """Look beside the file first; ask where nothing is found."""
        if watch.relink(context.scene):
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def do(self, context):
        """Set the folder."""
        settings = context.scene.beyond_mocap
        chosen = bpy.path.abspath(self.directory) if self.directory else ""
        if chosen and not watch.holds_recordings(chosen):
            raise InputError(chosen, "no recordings below it", "the library's folder", "choose another")
        if chosen:
            settings.library_folder = as_setting(chosen)
        elif not os.path.isdir(absolute(settings.library_folder)) and not watch.relink(context.scene):
            raise InputError(
                absolute(settings.library_folder), "no such folder, nor one like it beside this file",
                "the library's folder", "choose it in Relink Library",
            )
        watch.check(context.scene)
        self.report({"INFO"}, f"library: {absolute(settings.library_folder)}")
