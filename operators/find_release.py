"""Find Release: when and how the ball left the hand."""

from __future__ import annotations

import bpy

from ..scene.markers import thrown
from ..scene.markers.settings import is_cloud
from .marker_verb import OnMarkers
from .verb import BackgroundVerb


class BEYOND_MOCAP_OT_find_release(OnMarkers, BackgroundVerb, bpy.types.Operator):
    """Find out when and how fast the ball left the hand of the reconstructed body: a ball on its way, and a marker on
the timeline"""

    bl_idname = "beyond_mocap.find_release"
    bl_label = "Find Release"
    kind = "find release"

    def order(self, context):
        """The reconstruction, and what is known of the ball."""
        return thrown.order_of(context.scene, self.cloud(context))

    @staticmethod
    def work(order, progress, _cancelled, _hurry):
        """Find it."""
        from ..beyond_mocap.release import release

        name, trial, motion, settings = order
        progress(0.1, "release")
        return name, release(trial, motion, settings)

    def apply(self, scene, result):
        """Ball, timeline, figures."""
        name, found = result
        thing = scene.objects.get(name)
        if not is_cloud(thing):
            self.report({"WARNING"}, f"{name} is gone: nothing was written")
            return
        with self.within(scene):
            thrown.show(bpy.context, thing, found)
        for line in thrown.lines(found):
            self.report({"INFO"}, f"{name}: {line}")
