"""Cancel: stop what runs in the background."""

from __future__ import annotations

import bpy

from ..scene import background


class BEYOND_MOCAP_OT_cancel(bpy.types.Operator):
    """Stop what runs in the background; its result is dropped and nothing changes"""

    bl_idname = "beyond_mocap.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    def execute(self, _context):
        """Ask every job to stop."""
        background.stop()
        return {"FINISHED"}
