"""Go to Match Second: the playhead goes to a second of the match's clock, and a player is selected."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import channels
from ..scene.match import ours
from ..scene.match.settings import typed
from ..scene.measure import frames_per_second
from .verb import Verb


class BEYOND_MOCAP_OT_match_second(Verb, bpy.types.Operator):
    """Go to this second of the shown match, and select this player. The page over a match names both for its worst
seconds"""

    bl_idname = "beyond_mocap.match_second"
    bl_label = "Go to Match Second"

    seconds: FloatProperty(name="Second", options={"SKIP_SAVE"}, description="Of the match's clock")
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="ID in the feed; empty: nobody")

    @classmethod
    def poll(cls, context):
        """A match is shown."""
        cls.poll_message_set("Press Make Match or Show Match first")
        return bool(ours.bodies(context.scene))

    def invoke(self, context, _event):
        """Ask which second."""
        return context.window_manager.invoke_props_dialog(self)

    def do(self, context):
        """Set the frame, select the body."""
        scene, shown = context.scene, context.scene.beyond_mocap_match
        rate = shown.shown_rate or frames_per_second(scene)  # keys stay on their frames when the scene's rate changes
        frame = round(shown.shown_first + (self.seconds - shown.shown_start) * rate)
        last = _last(scene)
        if not shown.shown_first <= frame <= last:
            end = shown.shown_start + (last - shown.shown_first) / rate
            expected = f"{typed(shown.shown_start)} to {typed(end)} s"
            raise InputError("match", f"{typed(self.seconds)} s is not shown", expected,
                             "choose From and To around it and press Show Match")
        body = self.body(scene)
        scene.frame_set(frame)
        if body is not None and body.name in context.view_layer.objects and context.mode == "OBJECT":
            for other in context.selected_objects:
                other.select_set(False)
            body.select_set(True)
            context.view_layer.objects.active = body

    def body(self, scene) -> bpy.types.Object | None:
        """The player's armature; InputError where he is not shown."""
        known = {thing.get(ours.PLAYER): thing for thing in ours.bodies(scene)}
        if self.player and self.player not in known:
            raise InputError("match", f"{self.player} is not shown", f"one of {', '.join(map(str, known))}",
                             "tick the player and press Show Match")
        return known.get(self.player)


def _last(scene: bpy.types.Scene) -> int:
    """The last frame in which somebody moves; the scene's last one where nobody does."""
    actions = [channels.playing(body)[0] for body in ours.bodies(scene)]
    return round(max((action.frame_range[1] for action in actions if action is not None), default=scene.frame_end))
