"""What the panel "Throws & Kicks" shows, and what an armature keeps of its throw; saved with the file."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..core.properties import with_settings
from ..result.result import BeyondMocapBefore

USUAL = {"throw": "baseball", "kick": "football"}
LIMBS = {"throw": "hand", "kick": "foot"}
MARK = "beyond_mocap_thrown"  # custom property of what a throw has made; no group has its name


@with_settings("throw", "throw.ball")
class BeyondMocapThrow(bpy.types.PropertyGroup):
    """How an armature is to throw or kick, and what came of it."""

    attached_to = ("Object.beyond_mocap_throw",)

    target: PointerProperty(name="Target", type=bpy.types.Object,
                            description="What is to be hit: any object's origin; none: the 3D cursor")
    ball: PointerProperty(name="Ball", type=bpy.types.Object, poll=lambda _own, thing: thing.type in {"MESH", "EMPTY"},
                          description="The ball that flies; a kick strikes it where it lies. None: one is made")
    throw_model: StringProperty(
        name="Throw Model", subtype="FILE_PATH",
        description="A trained model (.npz) of throws; empty: the one that comes with the extension",
    )
    kick_model: StringProperty(
        name="Kick Model", subtype="FILE_PATH",
        description="A trained model (.npz) of kicks; empty: the one that comes with the extension",
    )
    made_of: StringProperty(name="Made of", options={"HIDDEN"}, description="The settings that it was made of")
    asked: IntProperty(name="Asked", options={"HIDDEN"}, description="The frame on which it was made to leave")
    made: StringProperty(name="Made", options={"HIDDEN"}, description="throw or kick; empty: none is shown")
    rigged: BoolProperty(name="Rigged", options={"HIDDEN"}, description="Whether it is shown on a rig's controls")
    release: FloatProperty(name="Released", options={"HIDDEN"}, description="Scene frame on which the ball leaves")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Lines about what is shown")
    told: StringProperty(name="Told", options={"HIDDEN"}, description="What is to be known about it")
    before: PointerProperty(type=BeyondMocapBefore, description="What the armature played before")
    flown: PointerProperty(name="Flown", type=bpy.types.Object, options={"HIDDEN"}, description="The ball that flies")
    hold: StringProperty(name="Hold", options={"HIDDEN"}, description="The stretch in which the hand carries the ball")
    ball_before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before")
    curve: PointerProperty(name="Trajectory", type=bpy.types.Object, description="The curve along the ball's way")


def thrower(context: bpy.types.Context) -> bpy.types.Object | None:
    """The armature that is meant: the active object, one that is selected, or whose ball or target is active."""
    active = context.view_layer.objects.active
    chosen = [thing for thing in (active, *context.selected_objects) if thing is not None and thing.type == "ARMATURE"]
    if chosen or active is None:
        return chosen[0] if chosen else None
    bodies = [thing for thing in context.scene.objects if thing.type == "ARMATURE" and thing.beyond_mocap_throw.made]
    return next((body for body in bodies if active in (body.beyond_mocap_throw.flown, body.beyond_mocap_throw.target)),
                None)
