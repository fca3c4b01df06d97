"""The add-on's own page in Blender's preferences: where caches go, threads, keys."""

from __future__ import annotations

import bpy

from ..scene.preferences import EXTENSION, Preferences
from .keys import draw_keys


class BeyondMocapPreferences(Preferences, bpy.types.AddonPreferences):
    """Cache folder, threads, and every key of the extension."""

    bl_idname = EXTENSION

    def draw(self, context):
        """Two settings, then the keys."""
        layout = self.layout
        column = layout.column()
        column.use_property_split = True
        column.prop(self, "cache_folder", placeholder="Beside each library")
        column.prop(self, "threads", text="Threads (0: all)")
        header, body = layout.panel("beyond_mocap_keys")
        header.label(text="Keys")
        if body:
            draw_keys(body, context)
