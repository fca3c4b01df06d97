"""Ball to Physics: Blender's rigid bodies take the ball over on a frame. Take Ball Back: it goes its keyed way."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ..beyond_mocap.base.settings.choices import BALLS
from ..scene.aimed import handover
from ..scene.aimed.subject import ball_meant
from .verb import Verb


class BEYOND_MOCAP_OT_ball_to_physics(Verb, bpy.types.Operator):
    """From the current frame on Blender's rigid bodies move the ball, as fast and with the spin that it has there:
keyed as Animated up to then, over a ground that is solid; other selected meshes are in its way. Play
from the start to see it"""

    bl_idname = "beyond_mocap.ball_to_physics"
    bl_label = "Ball to Physics"

    frame: IntProperty(name="Frame", default=0, min=0, description="Frame of the handover; 0: the current one")
    ball: EnumProperty(
        name="Ball", items=(("OWN", "Own", "The kind that it is aimed as"), *BALLS), default="OWN",
        description="What kind of ball it is",
    )

    @classmethod
    def poll(cls, context):
        """A ball that is animated."""
        cls.poll_message_set("Select a ball that moves")
        ball = ball_meant(context)
        if ball is None or ball.animation_data is None or ball.animation_data.action is None:
            return False
        cls.poll_message_set("Blender's physics has this ball already")
        return ball.rigid_body is None

    def do(self, context):
        """Hand it over."""
        ball = ball_meant(context)
        frame = self.frame or context.scene.frame_current
        kind = ball.beyond_mocap_aim.ball if self.ball == "OWN" else self.ball
        chosen = [thing for thing in context.selected_objects if thing.type == "MESH" and thing.visible_get()]
        solid = [thing for thing in chosen if thing != ball]
        handover.hand_over(context.scene, ball, frame, kind, solid)
        self.report({"INFO"}, f"Physics has {ball.name} from frame {frame} on: play from the start")


class BEYOND_MOCAP_OT_ball_from_physics(Verb, bpy.types.Operator):
    """Blender's rigid bodies let go of the ball: it goes its keyed way again, and the solid ground goes"""

    bl_idname = "beyond_mocap.ball_from_physics"
    bl_label = "Take Ball Back"

    @classmethod
    def poll(cls, context):
        """A ball that has been handed over."""
        cls.poll_message_set("Blender's physics has no ball that is selected")
        ball = ball_meant(context)
        return ball is not None and ball.beyond_mocap_aim.handed

    def do(self, context):
        """Take it back."""
        handover.take_back(context.scene, ball_meant(context))
