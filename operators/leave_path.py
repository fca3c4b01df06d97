"""Leave: a rider plays its original motion again."""

from __future__ import annotations

import bpy

from ..scene.ride import riders
from ..scene.ride.settings import meant
from .verb import Verb


class BEYOND_MOCAP_OT_leave_path(Verb, bpy.types.Operator):
    """Give the armature its original motion back, exactly as it was. The curve stays, and Edit Path takes it up again"""

    bl_idname = "beyond_mocap.leave_path"
    bl_label = "Leave"

    @classmethod
    def poll(cls, context):
        """A rider."""
        cls.poll_message_set("Select an armature that rides a path, or its curve")
        return bool(meant(context))

    def do(self, context):
        """All that are meant."""
        chosen = meant(context)
        for body in chosen:
            riders.may_end(body)
        for body in chosen:
            riders.end(body)
        riders.back_to(context, chosen)
