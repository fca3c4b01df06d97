"""Keep: what a rider does becomes an ordinary action."""

from __future__ import annotations

import bpy

from ..scene.ride import riders
from ..scene.ride.settings import meant
from .rider_verb import RiderVerb


class BEYOND_MOCAP_OT_bake_path(RiderVerb, bpy.types.Operator):
    """Keep the motion on its new path as an ordinary action with a key on every frame. The original action and the
curve stay in the file"""

    bl_idname = "beyond_mocap.bake_path"
    bl_label = "Keep"

    def do(self, context):
        """All that are meant; of who could not follow lately, the last motion that could be worked out."""
        chosen = meant(context)
        for body in chosen:
            riders.may_keep(body)
        kept = [riders.keep(context.scene, body) for body in chosen]
        riders.back_to(context, chosen)
        self.report({"INFO"}, f"kept as {', '.join(action.name for action, _ in kept)}")
        for line in (told for _, told in kept if told):
            self.report({"WARNING"}, f"the last motion that could be worked out is kept: {line}")
