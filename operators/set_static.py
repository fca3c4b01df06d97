"""Set Static: a recording of the same body standing still."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import linked
from ..scene.markers.settings import clouds, is_cloud
from .marker_verb import OnMarkers
from .verb import Verb


class BEYOND_MOCAP_OT_set_static(OnMarkers, Verb, bpy.types.Operator):
    """The active cloud is a static trial: the other selected clouds, or all others where none is selected, get the
places of their joints from it"""

    bl_idname = "beyond_mocap.set_static"
    bl_label = "Set Static Trial"

    @classmethod
    def poll(cls, context):
        """Two clouds at least, one of them active."""
        active = context.view_layer.objects.active
        cls.poll_message_set("Make the cloud of the static trial active; there have to be others")
        return is_cloud(active) and len(clouds(context.scene)) > 1

    def do(self, context):
        """Point to it."""
        static = context.view_layer.objects.active
        others = [thing for thing in clouds(context.scene) if thing != static]
        chosen = [thing for thing in others if thing.select_get()] or others
        linked.refuse(*chosen)
        if static.beyond_mocap_cloud.static in chosen:
            raise InputError(static.name, "its own static trial is among them", "a trial without", "clear it first")
        for thing in chosen:
            thing.beyond_mocap_cloud.static = static
        self.report({"INFO"}, f"{static.name}: static trial of {', '.join(thing.name for thing in chosen)}")
