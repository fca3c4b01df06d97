"""What the panel "Throws & Kicks" shows, and what an armature keeps of its throw. Saved with the file, known to
undo."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..passes.settings import SIDES
from ..result import BeyondMocapBefore

KINDS = (
    ("usual", "Usual", "A baseball for throws, a football for kicks"),
    ("baseball", "Baseball", "73 mm, 145 g"),
    ("tennis", "Tennis Ball", "67 mm, 58 g"),
    ("handball", "Handball", "Size 3: 188 mm, 450 g"),
    ("volleyball", "Volleyball", "209 mm, 270 g"),
    ("football", "Football", "Size 5: 220 mm, 430 g"),
)
USUAL = {"throw": "baseball", "kick": "football"}
LIMBS = {"throw": "hand", "kick": "foot"}
MARK = "beyond_mocap_thrown"
"""Custom property of what a throw has made; no group has its name."""


class BeyondMocapThrow(bpy.types.PropertyGroup):
    """How an armature is to throw or kick, and what came of it."""

    attached_to = ("Object.beyond_mocap_throw",)

    side: EnumProperty(name="Side", items=SIDES, default="right", description="With which hand or foot")
    target: PointerProperty(
        name="Target", type=bpy.types.Object, description="What is to be hit: any object's origin; none: the 3D cursor"
    )
    frame: IntProperty(
        name="On Frame", default=0, min=0,
        description="Scene frame on which the ball leaves hand or foot, up to half a frame sooner or later; 0: the "
        "current frame",
    )
    speed: FloatProperty(
        name="Ball Speed", default=0.0, min=0.0, max=60.0, precision=1,
        description="How fast the ball leaves, m/s; 0: as in examples that are thrown or kicked as far",
    )
    ball: PointerProperty(
        name="Ball", type=bpy.types.Object, poll=lambda _own, thing: thing.type in {"MESH", "EMPTY"},
        description="The ball that flies; a kick strikes it where it lies. None: one is made",
    )
    kind: EnumProperty(name="Kind", items=KINDS, default="usual", description="What kind of ball it is, in the air")
    library: BoolProperty(
        name="Run-Up by Library", default=True,
        description="Let the synthesizer find the way into the throw and out of it among the clips of the library "
        "(step 1); without one the throw is eased into the armature's own motion",
    )
    throw_model: StringProperty(
        name="Throw Model", subtype="FILE_PATH",
        description="A trained model (.npz) of throws; empty: the one that comes with the extension",
    )
    kick_model: StringProperty(
        name="Kick Model", subtype="FILE_PATH",
        description="A trained model (.npz) of kicks; empty: the one that comes with the extension",
    )
    seed: IntProperty(name="Seed", default=0, min=0, description="Another number, another throw at the same target")
    live: BoolProperty(
        name="Follow",
        default=True,
        description="Make what is shown again when the target is dragged or these settings are edited, "
        "until it is kept",
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
    return next(
        (body for body in bodies if active in (body.beyond_mocap_throw.flown, body.beyond_mocap_throw.target)), None
    )
