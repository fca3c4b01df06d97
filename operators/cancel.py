"""Cancel: end what runs in the background."""

from __future__ import annotations

import bpy

from ..scene import background


class BEYOND_MOCAP_OT_cancel(bpy.types.Operator):
    """Come to an end with what has been found so far. Pressed again, or before anything is found: nothing changes"""

    bl_idname = "beyond_mocap.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    def execute(self, _context):
        """Ask every job to end."""
        background.end()
        return {"FINISHED"}
