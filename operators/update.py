"""Update: takes after changes of their words or tracks, made anew only where these touch them."""

from __future__ import annotations

import bpy

from ..scene import freshness
from .turns import TurnsVerb


class BEYOND_MOCAP_OT_update(TurnsVerb, bpy.types.Operator):
    """Make anew only what changes of the words or the track touch since the last Synthesize or Update.
The rest stays as it is, to the last bit; shown as a preview, until it is accepted or discarded.
After the file was opened again the take is made again as it was"""

    bl_idname = "beyond_mocap.update"
    bl_label = "Update"
    kind = "update"

    @classmethod
    def poll(cls, context):
        """A take."""
        if not super().poll(context):
            return False
        cls.poll_message_set("Synthesize first")
        return any(player.use and player.take for player in context.scene.beyond_mocap.players)

    def wanted(self, context):
        """Where something is out of date about some of the players, only those; the others stay untouched. Drawn tracks
        are read anew in any case, since `look` does not play what has to be played."""
        found = super().wanted(context)
        if len(found) == 1:
            return found
        changed = [(player, how) for player, how in found
                   if player.drawn_track is not None or freshness.look(context.scene, player)[0]]
        return changed or found
