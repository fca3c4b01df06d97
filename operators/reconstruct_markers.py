"""Reconstruct: the body that moved under the markers."""

from __future__ import annotations

import bpy

from ..scene.markers import solve
from ..scene.markers.settings import is_cloud
from .marker_verb import OnMarkers
from .verb import BackgroundVerb


class BEYOND_MOCAP_OT_reconstruct_markers(OnMarkers, BackgroundVerb, bpy.types.Operator):
    """Find the skeleton that moves under the markers of the active cloud: an armature with an action beside it, and a
clip of the library where asked for"""

    bl_idname = "beyond_mocap.reconstruct_markers"
    bl_label = "Reconstruct"
    kind = "reconstruct markers"

    def order(self, context):
        """The trial, its static or model, and the settings."""
        return solve.order_of(context.scene, self.cloud(context))

    @staticmethod
    def work(order, progress, cancelled, _hurry):
        """Reconstruct it."""
        from ..beyond_mocap.reconstruct import reconstruct

        made = reconstruct(order.trial, order.static, order.model, order.settings, progress, cancelled)
        return order, made

    def apply(self, scene, result):
        """Armature, action, figures, and the clip."""
        order, made = result
        thing = scene.objects.get(order.cloud)
        if not is_cloud(thing):
            self.report({"WARNING"}, f"{order.cloud} is gone: nothing was written")
            return
        notes = solve.add(order, made)
        with self.within(scene):
            body = solve.show(bpy.context, thing, made)
        for line in (*made.warnings, *notes):
            self.report({"INFO"}, f"{thing.name}: {line}")
        self.report({"INFO"}, f"{body.name}: {'; '.join(solve.figures(made))}")
