"""Take Ball: a bone carries the ball for a while. Free Ball: it does not any more."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ..beyond_mocap.base.settings.choices import HOLDS, PARTS, SIDES
from ..beyond_mocap.errors import InputError
from ..scene.passes import possession
from ..scene.passes.settings import ball_of, subject
from .verb import Verb


class BEYOND_MOCAP_OT_take_ball(Verb, bpy.types.Operator):
    """Let a hand or foot of the armature carry the ball from one frame to another, without a jump at either end: a
Child Of constraint with a keyed influence. The ball's own action is put aside; Free Ball brings it back"""

    bl_idname = "beyond_mocap.take_ball"
    bl_label = "Take Ball"

    part: EnumProperty(name="Part", items=PARTS, default="hand", description="What carries the ball")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right, of what there are two")
    bone: StringProperty(name="Bone", description="A bone by name, in place of the part")
    first: IntProperty(name="From", default=1, description="Frame from which on it is carried")
    last: IntProperty(name="To", default=30, description="Frame on which it is let go")
    how: EnumProperty(name="Hold", items=HOLDS, default="KEEP", description="Where the ball is while it is carried")
    settle: IntProperty(
        name="Settle", default=4, min=1, max=1000,
        description="Frames within which the ball comes to where it is carried",
    )

    @classmethod
    def poll(cls, context):
        """An armature and a ball."""
        cls.poll_message_set("Select an armature")
        if subject(context) is None:
            return False
        cls.poll_message_set("Select the ball beside the armature")
        return ball_of(context) is not None

    def do(self, context):
        """Find the bone, carry."""
        body, ball, scene = subject(context), ball_of(context), context.scene
        bone = self.bone or possession.bone_of(scene, body, self.part, self.side)
        skin = 0.03 if self.bone else possession.SURFACE.get(self.part, 0.03)
        possession.take(scene, ball, body, bone, self.first, self.last, self.how, self.settle, skin)
        self.report({"INFO"}, f"{body.name} carries {ball.name} with {bone} on frames {self.first} to {self.last}")


class BEYOND_MOCAP_OT_free_ball(Verb, bpy.types.Operator):
    """Take back that the ball is carried: at one stretch, or at all.
After the last one the ball plays its own action again"""

    bl_idname = "beyond_mocap.free_ball"
    bl_label = "Free Ball"

    number: IntProperty(name="Stretch", default=-1, min=-1, options={"SKIP_SAVE"}, description="Which one; -1: all")

    @classmethod
    def poll(cls, context):
        """A ball that is carried."""
        cls.poll_message_set("Nobody carries the ball")
        ball = ball_of(context)
        return ball is not None and len(ball.beyond_mocap_ball.holds) > 0

    def do(self, context):
        """One or all."""
        ball = ball_of(context)
        if self.number >= len(ball.beyond_mocap_ball.holds):
            raise InputError("stretch", f"number {self.number}", f"below {len(ball.beyond_mocap_ball.holds)}")
        possession.free(context.scene, ball, None if self.number < 0 else self.number)
