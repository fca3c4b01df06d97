"""What an aimed ball keeps. Saved with the file, and known to undo."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty, StringProperty,
)

from ..passes.settings import BALLS, PARTS, SIDES
from ..result import BeyondMocapBefore

WAYS = (
    ("AIR", "Air", "It flies, and bounces as often as asked"),
    ("GROUND", "Ground", "It slides and rolls along the ground"),
)
TIMES = (
    ("FREE", "Slowest", "As long as the slowest launch takes; along the ground, so that it arrives at a walking pace"),
    ("SECONDS", "Seconds", "This long after the strike"),
    ("FRAME", "On Frame", "On this scene frame"),
)
MARK = "beyond_mocap_shot"
"""Custom property of an action or curve of ours: of an action, a digest of what it was made of. Not the name of the
group on objects, with which it would share its place before Blender 5.0."""


def changed(_settings, _context) -> None:
    """A setting that the ball may have to follow."""
    from . import live

    live.mark()


class BeyondMocapAim(bpy.types.PropertyGroup):
    """Who strikes a ball, towards what and how."""

    attached_to = ("Object.beyond_mocap_aim",)

    on: BoolProperty(name="Aimed", description="Whether this ball is aimed at a target")
    live: BoolProperty(name="Live", default=True, update=changed, description="Aim again while the target is dragged")
    body: PointerProperty(
        name="Body", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE", update=changed,
        description="The armature that strikes the ball; none: it leaves from where it lies",
    )
    part: EnumProperty(
        name="Part", items=PARTS, default="foot", update=changed, description="What the ball is struck with"
    )
    side: EnumProperty(
        name="Side", items=SIDES, default="right", update=changed, description="Left or right, of what there are two"
    )
    bone: StringProperty(name="Bone", update=changed, description="A bone by name, in place of the part")
    first: IntProperty(
        name="From", default=1, update=changed, description="First frame on which the ball may be struck"
    )
    last: IntProperty(
        name="To", default=1, update=changed,
        description="Last frame on which the ball may be struck; of all, the one with the part fastest that way is "
        "taken",
    )
    place: FloatVectorProperty(
        name="From", size=3, options={"HIDDEN"}, description="Where the ball lies when nobody strikes it, metres"
    )
    target: PointerProperty(
        name="Target", type=bpy.types.Object, update=changed, description="Where the ball arrives; drag it with G"
    )
    way: EnumProperty(name="Way", items=WAYS, default="AIR", update=changed, description="How the ball gets there")
    bounces: IntProperty(
        name="Bounces", default=0, min=0, max=5, update=changed,
        description="How often it touches the ground before it arrives",
    )
    timing: EnumProperty(name="Arrives", items=TIMES, default="FREE", update=changed, description="When it arrives")
    seconds: FloatProperty(
        name="Flight", default=1.0, min=0.05, max=20.0, precision=2, unit="TIME_ABSOLUTE", update=changed,
        description="Seconds from the strike to the target",
    )
    arrival: IntProperty(name="Frame", default=50, update=changed, description="Scene frame on which the ball arrives")
    ball: EnumProperty(
        name="Ball", items=BALLS, default="football", update=changed, description="What kind of ball it is"
    )
    back: FloatProperty(
        name="Back Spin", default=0.0, min=-30.0, max=30.0, precision=1, update=changed,
        description="Turns a second that lift the ball; negative: top spin, which pulls it down",
    )
    left: FloatProperty(
        name="Side Spin", default=0.0, min=-30.0, max=30.0, precision=1, update=changed,
        description="Turns a second that bend its way to the left; negative: to the right",
    )
    human: BoolProperty(
        name="As a Human Can", default=True, update=changed,
        description="Refuse launches faster than anybody strikes a ball with this part",
    )
    follow: FloatProperty(
        name="Goes On", default=3.0, min=0.0, max=60.0, precision=1, unit="TIME_ABSOLUTE", update=changed,
        description="Seconds that the ball is followed behind the target, bouncing and rolling; 0: it stays there",
    )
    curve: PointerProperty(name="Trajectory", type=bpy.types.Object, description="The curve along the ball's way")
    told: StringProperty(name="Told", options={"HIDDEN"}, description="What is wrong, if anything")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Lines about the shot that is shown")
    strike: IntProperty(name="Strike", options={"HIDDEN"}, description="Scene frame on which the ball is struck")
    arrived: FloatProperty(name="Arrived", options={"HIDDEN"}, description="Scene frame on which it is at the target")
    before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before it was aimed")
    handed: BoolProperty(
        name="Handed Over", options={"HIDDEN"}, description="Whether Blender's rigid bodies have the ball"
    )
    handover: IntProperty(
        name="On Frame", default=60, description="Frame on which Blender's rigid bodies take the ball over"
    )
    handed_before: StringProperty(
        name="Handed Before", options={"HIDDEN"}, description="What the handover has to bring back, as JSON"
    )


def aimed(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The aimed balls of a scene."""
    return [thing for thing in scene.objects if thing.beyond_mocap_aim.on]


def aimed_ball(context: bpy.types.Context) -> bpy.types.Object | None:
    """The aimed ball that is meant: the active object, one that is selected, one whose target is active, or the only
    one."""
    active = context.view_layer.objects.active
    balls = aimed(context.scene)
    meant = [ball for ball in balls if ball == active]
    meant += [ball for ball in balls if active is not None and ball.beyond_mocap_aim.target == active]
    meant += [ball for ball in balls if ball.select_get()]
    meant += balls if len(balls) == 1 else []
    return meant[0] if meant else None
