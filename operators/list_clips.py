"""List Clips: what lies in the library's folder, without building it."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import clips, preferences, session, watch
from ..scene.settings import absolute
from .verb import Verb


class BEYOND_MOCAP_OT_list_clips(Verb, bpy.types.Operator):
    """List the clips of the folder with their words, without reading their motion. For speeds and quality press Build
Library"""

    bl_idname = "beyond_mocap.list_clips"
    bl_label = "List Clips"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """A folder has to be chosen."""
        cls.poll_message_set("Choose the library's folder first")
        return bool(context.scene.beyond_mocap.library_folder)

    def do(self, context):
        """Take them from the built library where there is one, else from the folder."""
        from ..beyond_mocap.library.listing import listed, scanned

        settings = context.scene.beyond_mocap
        folder = absolute(settings.library_folder)
        files = watch.look(folder)
        if files is None:
            watch.check(context.scene)
            raise InputError(folder, "no such folder", "the library's folder", "press Relink Library")
        built = session.library(folder, settings.library_unit or None)
        found = listed(built) if built is not None else scanned(folder, preferences.cache_folder(folder))
        clips.keep(context.window_manager, settings.library_folder, found, files)
        self.report({"INFO"}, f"clips listed: {len(found)}")
