"""Cancel: end what runs in the background, let it come to an early end, or take a player out of the queue."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, StringProperty

from ..scene import background, queue


class BEYOND_MOCAP_OT_cancel(bpy.types.Operator):
    """End what runs in the background and what waits: nothing changes"""

    bl_idname = "beyond_mocap.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    keep: BoolProperty(
        name="Finish Early", options={"SKIP_SAVE"},
        description="Come to an end with the best that has been found so far; players that wait are left as they are",
    )
    player: StringProperty(
        name="Player", options={"SKIP_SAVE"}, description="Only take this player out of the queue",
    )

    @classmethod
    def description(cls, _context, properties):
        """What this button does."""
        if properties.player:
            return f"Leave {properties.player} as it is: take it out of the queue"
        if properties.keep:
            return "Finish early: keep the best that has been found so far"
        return "Cancel what runs and what waits: nothing changes"

    def execute(self, context):
        """Ask every job to end."""
        if self.player:
            queue.remove(self.player)
            context.window_manager.beyond_mocap_work.waiting = "\n".join(queue.names())
        elif self.keep:
            background.end()
        else:
            queue.clear()
            background.stop()
        return {"FINISHED"}
