"""What the verbs on clouds of markers share."""

from __future__ import annotations

from contextlib import nullcontext

import bpy

from ..scene import linked
from ..scene.markers.settings import cloud_meant


class OnMarkers:
    """To be mixed into a verb: it is about the cloud of markers that is meant."""

    @classmethod
    def poll(cls, context):
        """A cloud."""
        cls.poll_message_set("Select a cloud of markers (Import Markers makes one)")
        return cloud_meant(context) is not None

    @staticmethod
    def cloud(context):
        """The cloud; InputError where it belongs to another file."""
        thing = cloud_meant(context)
        linked.refuse(thing, thing.data)
        return thing

    @staticmethod
    def within(scene):
        """The context of the scene that the work began in, also where the window shows another one by now."""
        if bpy.context.scene == scene:
            return nullcontext()
        return bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0])
