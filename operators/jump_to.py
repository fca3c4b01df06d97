"""Jump To: go to the second that a warning or a key moment is about."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import bake
from ..scene.settings import active_player
from .verb import Verb


class BEYOND_MOCAP_OT_jump_to(Verb, bpy.types.Operator):
    """Go to the frame that this line is about, and select the player's body. Where a line names several, each press
goes to the next. Shift-click also brings the body into view"""

    bl_idname = "beyond_mocap.jump_to"
    bl_label = "Jump To"

    seconds: FloatProperty(
        name="Seconds", options={"SKIP_SAVE"}, description="Second on the tracking file's clock to go to"
    )
    stops: StringProperty(
        name="Stops", options={"SKIP_SAVE"},
        description="Seconds with blanks between, instead: to the next one behind the current frame, from the last to "
        "the first"
    )
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="Whose body; empty: the active player's")
    frame_view: BoolProperty(
        name="Bring into View", options={"SKIP_SAVE"}, description="Move the 3D views so that the body is seen"
    )

    def invoke(self, context, event):
        """As the button was pressed."""
        self.frame_view = self.frame_view or event.shift
        return self.execute(context)

    def frame(self, scene) -> int:
        """The scene frame to go to."""
        try:
            seconds = [float(text) for text in self.stops.split()] or [self.seconds]
        except ValueError:
            raise InputError("stops", repr(self.stops), "seconds with blanks between") from None
        frames = sorted(int(round(bake.frame_at(scene, second))) for second in seconds)
        return next((frame for frame in frames if frame > scene.frame_current), frames[0])

    def do(self, context):
        """Set the frame, select the body."""
        settings = context.scene.beyond_mocap
        if self.player and self.player not in settings.players:
            raise InputError("player", self.player, "a name in the list", "look at step 2")
        player = settings.players[self.player] if self.player else active_player(settings)
        context.scene.frame_set(self.frame(context.scene))
        body = player.body if player is not None else None
        if body is None or body.name not in context.view_layer.objects:
            return
        if context.view_layer.objects.active is None or context.mode == "OBJECT":
            for other in context.selected_objects:
                other.select_set(False)
            body.select_set(True)
            context.view_layer.objects.active = body
        if self.frame_view and not bpy.app.background:
            _bring_into_view(context)


def _bring_into_view(context) -> None:
    """Let every 3D view show what is selected."""
    for area in context.screen.areas:
        if area.type == "VIEW_3D":
            region = next(region for region in area.regions if region.type == "WINDOW")
            with context.temp_override(area=area, region=region):
                bpy.ops.view3d.view_selected(use_all_regions=False)
