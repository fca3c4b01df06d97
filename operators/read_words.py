"""Words from Text or File: a player's strips say what his text, or else his file on disk, says."""

from __future__ import annotations

import bpy

from ..scene import plans, strips, tracks
from ..scene.settings import active_player
from .verb import Verb


class BEYOND_MOCAP_OT_read_words(Verb, bpy.types.Operator):
    """Lay the active player's strips anew from the words of the text chosen in step 2, or of the file where there is no
text. Strips and key moments that are there now are replaced"""

    bl_idname = "beyond_mocap.read_words"
    bl_label = "Words from Text or File"

    @classmethod
    def poll(cls, context):
        """A player with a text or a file."""
        player = active_player(context.scene.beyond_mocap)
        cls.poll_message_set("Import tracking, and choose a file or text with words in step 2 first")
        return player is not None and (player.annotation_text is not None or bool(player.annotation_file))

    def do(self, context):
        """Read all of it, then lay the strips."""
        settings = context.scene.beyond_mocap
        player = active_player(settings)
        timeline = plans.written_words(player, settings.rate, tracks.read_track(settings, player))
        strips.write(context, player, timeline)
        told = f"{player.name}: {len(timeline.spans)} spans and {len(timeline.keys)} key moments"
        self.report({"INFO"}, f"{told} from {plans.written_in(player)}")
