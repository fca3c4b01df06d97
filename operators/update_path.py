"""Update Path: riders are worked out anew, whatever seems to have changed."""

from __future__ import annotations

import bpy

from ..scene.ride import measure, riders
from ..scene.ride.settings import meant
from .rider_verb import RiderVerb


class BEYOND_MOCAP_OT_update_path(RiderVerb, bpy.types.Operator):
    """Work out the rider's motion anew: after edits of the original action, while Live is off, or in a script"""

    bl_idname = "beyond_mocap.update_path"
    bl_label = "Update Path"

    def do(self, context):
        """All that are meant."""
        for body in meant(context):
            riders.renew(context.scene, body, anew=True)
            measure.measure(context.scene, body)
