"""Update: the takes of this session after changes of their words or tracks, made anew only where these touch them."""

from __future__ import annotations

import bpy

from ..scene import session
from .synthesize import SynthesisVerb


class BEYOND_MOCAP_OT_update(SynthesisVerb, bpy.types.Operator):
    """Make anew only what changes of the words or the track touch since the last Synthesize or Update.
The rest stays as it is, to the last bit; shown as a preview, until it is accepted or discarded"""

    bl_idname = "beyond_mocap.update"
    bl_label = "Update"

    @classmethod
    def poll(cls, context):
        """A take of this session."""
        if not super().poll(context):
            return False
        cls.poll_message_set("Synthesize first")
        return any(player.use and session.made(player.take) for player in context.scene.beyond_mocap.players)

    def starts_from(self, player):
        """From the player's take, where this session has it."""
        made = session.made(player.take)
        return made.take if made else None
