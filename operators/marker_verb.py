"""What the verbs on clouds of markers share."""

from __future__ import annotations

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
