"""Clean Markers: gaps filled, swaps and jumps mended, markers without a name given to those they are."""

from __future__ import annotations

import bpy

from ..scene.markers import cloud, sets
from ..scene.markers.settings import is_cloud
from .marker_verb import OnMarkers
from .verb import BackgroundVerb


class BEYOND_MOCAP_OT_clean_markers(OnMarkers, BackgroundVerb, bpy.types.Operator):
    """Fill the gaps of the active cloud's markers, mend exchanged labels and jumps, and name those that nobody has
named where the others tell. Reconstruct does the same for itself"""

    bl_idname = "beyond_mocap.clean_markers"
    bl_label = "Clean Up Markers"
    kind = "clean markers"

    def order(self, context):
        """The trial, and which markers belong together."""
        thing = self.cloud(context)
        trial = cloud.read(thing, context.scene)
        assigned = any(row.segment for row in thing.beyond_mocap_cloud.labels)
        return thing.name, trial, sets.of_cloud(thing).clusters(trial.labels) if assigned else None

    @staticmethod
    def work(order, progress, cancelled, _hurry):
        """Clean it."""
        from ..beyond_mocap.markers.clean import clean

        name, trial, clusters = order
        return name, clean(trial, clusters, progress=progress, cancelled=cancelled)

    def apply(self, scene, result):
        """Other trajectories for the cloud, and what was done."""
        name, cleaned = result
        thing = scene.objects.get(name)
        if not is_cloud(thing):
            self.report({"WARNING"}, f"{name} is gone: nothing was written")
            return
        cloud.write(thing, cleaned.trial, scene)
        thing.beyond_mocap_cloud.cleaned = "\n".join(cleaned.report.lines) or "nothing to mend"
        for line in thing.beyond_mocap_cloud.cleaned.splitlines():
            self.report({"INFO"}, f"{name}: {line}")
