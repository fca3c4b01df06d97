"""Bring to the Timeline: players that have no strips yet, as in files of earlier versions, get a dot and their words as
strips."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import plans, strips, tracks
from .verb import Verb


class BEYOND_MOCAP_OT_place_players(Verb, bpy.types.Operator):
    """Give every player without one a dot that runs along the track, and lay the words of his text or file on it as
strips. Files of earlier versions need this once; texts and files stay as they are"""

    bl_idname = "beyond_mocap.place_players"
    bl_label = "Bring to the Timeline"

    @classmethod
    def poll(cls, context):
        """A player without strips."""
        cls.poll_message_set("Every player in the list has strips already")
        return any(strips.dot_of(player, context.scene) is None for player in context.scene.beyond_mocap.players)

    def do(self, context):
        """Read all tracks and words, then place those that could be read, and tell the others."""
        settings, read = context.scene.beyond_mocap, []
        troubles = []
        for player in settings.players:
            if strips.dot_of(player, context.scene) is not None:
                continue
            try:
                read.append((player, plans.written_words(player, settings.rate, tracks.read_track(settings, player))))
            except InputError as error:
                troubles.append(f"{player.name}: {error}")
        if not read:
            raise InputError("no player could be brought to the timeline", troubles[0])
        for player, timeline in read:
            strips.write(context, player, timeline)
        for trouble in troubles:
            self.report({"WARNING"}, trouble)
        self.report({"INFO"}, f"players brought to the timeline: {len(read)}")
