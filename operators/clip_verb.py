"""What the verbs share that bring a clip of the library's list into the scene."""

from __future__ import annotations

from bpy.props import BoolProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import clips
from .verb import Verb


class ClipVerb(Verb):
    """A verb about one clip of the list: the one that it is told, else the one chosen there."""

    path: StringProperty(
        name="Clip", options={"SKIP_SAVE"}, description="Below the library's folder; empty: the one chosen in the list"
    )
    dressed: BoolProperty(name="Body", default=True, description="With a low-poly body, not only bones")

    @classmethod
    def poll(cls, context):
        """A clip in the list."""
        cls.poll_message_set("No clip is listed; press Build Library or List Clips first")
        return clips.active(context.window_manager) is not None

    def clip(self, context) -> str:
        """The clip, below the library's folder."""
        chosen = clips.active(context.window_manager)
        path = self.path or (chosen.path if chosen else "")
        if not path:
            raise InputError(self.bl_label, "no clip chosen", "a clip of the library's list")
        return path
