"""Step 3: from dots and words to motion."""

from __future__ import annotations

import bpy

from .tab import Step


class BEYOND_MOCAP_PT_synthesis(Step, bpy.types.Panel):
    """The button, and how it goes about it."""

    bl_label = "3  Synthesize"
    bl_order = 3

    def draw(self, context):
        """Button, progress, choices."""
        layout, settings = self.layout, context.scene.beyond_mocap
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.synthesize", icon="ARMATURE_DATA")
        row.operator("beyond_mocap.update", icon="FILE_REFRESH")
        self.progress(context, "synthesis")
        header, body = layout.panel("beyond_mocap_synthesis_more", default_closed=True)
        header.label(text="Choices")
        if body:
            body.use_property_split, body.use_property_decorate = True, False
            body.prop(settings, "method")
            if settings.method == "distance":
                body.prop(settings, "catch_up")
            for name in ("mirror", "nearest", "rate"):
                body.prop(settings, name)
            self.fine_tuning(body, settings)

    def fine_tuning(self, layout, settings):
        """What seldom needs another value, closed at first."""
        header, body = layout.panel("beyond_mocap_synthesis_tuning", default_closed=True)
        header.label(text="Fine Tuning")
        if not body:
            return
        body.prop(settings, "alpha", slider=True)
        own = {"path": ("root_window", "made"), "distance": ("delta",)}.get(settings.method, ())
        for name in ("omega", "gaits", "track_window", "seam_window", *own):
            body.prop(settings, name)
