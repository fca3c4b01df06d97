"""Path Cameras: four cameras around the riders and their paths."""

from __future__ import annotations

import bpy

from ..scene import path_cameras
from ..scene.ride.settings import meant, riders
from .verb import Verb


class BEYOND_MOCAP_OT_path_cameras(Verb, bpy.types.Operator):
    """Set up four cameras on all riders and their paths: from above, from the side, from three quarters, and following
behind the active one. Pressed again it lays only those anew that nobody has moved or changed"""

    bl_idname = "beyond_mocap.path_cameras"
    bl_label = "Path Cameras"

    @classmethod
    def poll(cls, context):
        """Somebody rides a path; edit mode has an undo of its own, which knows nothing of cameras."""
        cls.poll_message_set("Leave edit mode first (Tab)")
        if context.mode not in {"OBJECT", "POSE"}:
            return False
        cls.poll_message_set("Select an armature and press Edit Path first")
        return bool(riders(context.scene))

    def do(self, context):
        """Look at all of them, and lay the cameras."""
        first = next(iter(meant(context)), None)
        kept = path_cameras.set_up(context.scene, path_cameras.route(context.scene, first))
        if kept:
            self.report({"INFO"}, f"kept as you have changed them: {', '.join(kept)}")
