"""What verbs about riders share: whom they mean."""

from __future__ import annotations

from ..scene.ride.settings import meant
from .verb import Verb


class RiderVerb(Verb):
    """A verb about the riders that are meant; greyed, with the reason, where there are none."""

    @classmethod
    def poll(cls, context):
        """A rider."""
        cls.poll_message_set("Select an armature that rides a path, or its curve")
        return bool(meant(context))
