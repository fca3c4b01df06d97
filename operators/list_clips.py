"""List Clips: what lies in the library's folder, without building it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import clips, preferences, session, watch
from ..scene.settings import absolute
from .verb import BackgroundVerb

if TYPE_CHECKING:
    from ..beyond_mocap.library.library import Library


@dataclass(frozen=True, eq=False)
class Order:
    """Which folder, and the library that was built of it in this session."""

    setting: str
    folder: str
    cache_dir: str | None
    built: "Library | None"


class BEYOND_MOCAP_OT_list_clips(BackgroundVerb, bpy.types.Operator):
    """List the clips of the folder with their words, without reading their motion. For speeds and quality press Build
Library"""

    bl_idname = "beyond_mocap.list_clips"
    bl_label = "List Clips"
    bl_options = {"REGISTER"}
    kind = "list"

    @classmethod
    def poll(cls, context):
        """A folder has to be chosen."""
        cls.poll_message_set("Choose the library's folder first")
        return bool(context.scene.beyond_mocap.library_folder)

    def order(self, context):
        """The folder."""
        settings = context.scene.beyond_mocap
        folder = absolute(settings.library_folder)
        watch.check(context.scene)
        built = session.library(folder, settings.library_unit or None)
        return Order(settings.library_folder, folder, preferences.cache_folder(folder), built)

    @staticmethod
    def work(order, progress, _cancelled, _hurry):
        """From the built library where there is one, else from the folder."""
        from ..beyond_mocap.library.listing import listed, scanned

        progress(0.0, "Listing clips")
        files = watch.look(order.folder)
        if files is None:
            raise InputError(order.folder, "no such folder", "the library's folder", "press Relink Library")
        found = listed(order.built) if order.built is not None else scanned(order.folder, order.cache_dir)
        return order.setting, found, files

    def apply(self, _scene, result):
        """Show them."""
        setting, found, files = result
        clips.keep(bpy.context.window_manager, setting, found, files)
        self.report({"INFO"}, f"clips listed: {len(found)}")
