"""Aim Ball: a body strikes the ball so that it arrives at a target. Leave Aim: it does not any more."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ..beyond_mocap.base.settings.aim import TIMES, WAYS
from ..beyond_mocap.base.settings.choices import BALLS, PARTS, SIDES
from ..scene import ball as balls
from ..scene import linked
from ..scene.aimed import shots
from ..scene.aimed.settings import aimed, aimed_ball
from ..scene.aimed.subject import ball_meant, body_meant, stretch_of, target_meant
from ..scene.measure import units_per_metre
from ..scene.passes.settings import KEPT
from .verb import Verb

FAR = 10.0  # metres to a target that is made
NAME = "Aimed Ball"  # another than that of the takes' ball, which may lie in the same collection


class BEYOND_MOCAP_OT_aim_ball(Verb, bpy.types.Operator):
    """Let the selected armature strike the selected ball (a new one, if none is) so that it arrives at the selected
Empty (a new one, if none is). Drag the Empty: the ball follows. Without an armature the ball leaves
from where it lies"""

    bl_idname = "beyond_mocap.aim_ball"
    bl_label = "Aim Ball"

    part: EnumProperty(name="Part", items=PARTS, default="foot", description="What the ball is struck with")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right, of what there are two")
    found: BoolProperty(
        name="Find the Strike", default=True,
        description="Take the ball stretch of the strike nearest to the current frame; else From and To",
    )
    first: IntProperty(name="From", default=1, description="First frame on which the ball may be struck")
    last: IntProperty(name="To", default=1, description="Last frame on which the ball may be struck")
    way: EnumProperty(name="Way", items=WAYS, default="AIR", description="How the ball gets there")
    bounces: IntProperty(
        name="Bounces", default=0, min=0, max=5, description="How often it touches the ground before it arrives"
    )
    timing: EnumProperty(name="Arrives", items=TIMES, default="FREE", description="When it arrives")
    seconds: FloatProperty(
        name="Flight", default=1.0, min=0.05, max=20.0, description="Seconds from the strike to the target"
    )
    arrival: IntProperty(name="Frame", default=50, description="Scene frame on which the ball arrives")
    ball: EnumProperty(name="Ball", items=BALLS, default="football", description="What kind of ball it is")

    @classmethod
    def poll(cls, context):
        """An armature or a ball."""
        cls.poll_message_set("Select an armature that strikes, or a ball")
        return body_meant(context) is not None or ball_meant(context) is not None

    def do(self, context):
        """Solve first, then make what is lacking and write."""
        shots.unsure()
        ball, scene = ball_meant(context), context.scene
        if ball is not None and ball.beyond_mocap_aim.on:
            linked.refuse(ball)
            solved = shots.solve(scene, shots.wish_of(scene, ball), ball.name)
            shots.write(scene, ball, solved)
        else:
            solved = self.new(context, ball)
        self.report({"INFO"}, "; ".join(shots.lines(solved)))

    def new(self, context, ball):
        """A ball that is not aimed yet."""
        body, scene, target = body_meant(context), context.scene, target_meant(context)
        linked.refuse(ball, body)
        shots.check_ball(ball)
        first, last = self.first, self.last
        if body is None:
            first = last = scene.frame_current
        elif self.found:
            first, last = stretch_of(scene, body, self.part, self.side)
        names = ("part", "side", "way", "bounces", "timing", "seconds", "arrival", "ball")
        own = {name: getattr(self, name) for name in names}
        place = shots.place_of(scene, ball) if ball is not None else (0.0, 0.0, 0.0)
        wish = shots.Wish(body=body, bone="", first=first, last=last, target=(0.0, 0.0, 0.0), place=place, **own)
        there = shots.place_of(scene, target) if target is not None else shots.ahead(shots.strikes_of(scene, wish), FAR)
        wish = replace(wish, target=there)
        solved = shots.solve(scene, wish, ball.name if ball is not None else NAME)
        room = (body or ball).users_collection[0]
        if ball is None:
            ball = balls.create(context, NAME, room, shots.radius_of(wish))
            ball[KEPT] = True
        if target is None:
            target = bpy.data.objects.new(f"{ball.name} target", None)
            target.empty_display_type, target.empty_display_size = "SPHERE", 0.15 * units_per_metre(scene)
            target.location = [value * units_per_metre(scene) for value in there]
            room.objects.link(target)
            context.view_layer.update()
        shots.set_up(ball, wish, target)
        shots.write(scene, ball, solved)
        return solved


class BEYOND_MOCAP_OT_leave_aim(Verb, bpy.types.Operator):
    """The ball is not aimed any more: it plays what it did before, and its trajectory goes. The target stays"""

    bl_idname = "beyond_mocap.leave_aim"
    bl_label = "Leave Aim"

    @classmethod
    def poll(cls, context):
        """An aimed ball."""
        cls.poll_message_set("No ball is aimed" if not aimed(context.scene) else "Select an aimed ball or its target")
        ball = aimed_ball(context)
        if ball is not None and ball.beyond_mocap_aim.handed:
            cls.poll_message_set("Blender's physics has the ball: press Take Ball Back first")
            return False
        return ball is not None

    def do(self, context):
        """Bring back what it did."""
        shots.leave(aimed_ball(context))
