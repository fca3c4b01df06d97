"""Leave: a rider plays its original motion again."""

from __future__ import annotations

import bpy

from ..scene.ride import riders
from ..scene.ride.settings import meant
from .rider_verb import RiderVerb


class BEYOND_MOCAP_OT_leave_path(RiderVerb, bpy.types.Operator):
    """Give the armature its original motion back, exactly as it was. The curve stays, and Edit Path takes it up
again"""

    bl_idname = "beyond_mocap.leave_path"
    bl_label = "Leave"

    def do(self, context):
        """All that are meant."""
        chosen = meant(context)
        riders.leave(*chosen)
        riders.back_to(context, chosen)
