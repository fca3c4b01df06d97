"""What a rider keeps: an armature whose motion rides a curve. Saved with the file, and known to undo."""

from __future__ import annotations

import json

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..result import BeyondMocapBefore

FITS = (
    ("spline", "Smoothing Spline", "A smooth curve that leaves out the sway of the steps, however long the motion is"),
    ("polynomial", "Polynomial", "One polynomial of the chosen degree over the whole motion"),
)
ENDS = (
    ("stop", "Stop", "The motion ends where the path ends"),
    ("repeat", "Start Again", "Where the path ends, the motion goes on from the path's beginning"),
)
FRAMES = (
    ("path", "Path", "Offsets turn with the path, seen from above; the body stays upright"),
    ("tangent", "Tangent", "Offsets turn with the full tangent: on a slope the whole body is tilted"),
    ("absolute", "Absolute", "Offsets keep their direction in the world: in a bend the body goes sideways"),
)
WISHES = ("fit", "degree", "by_arc_length", "speed", "end", "cycle", "frame", "plant", "lean", "bends", "slopes",
          "climbs",
          "delay")


def is_curve(_ride, candidate: bpy.types.Object) -> bool:
    """Whether an object may be picked as the new path."""
    return candidate.type == "CURVE"


def is_mesh(_ride, candidate: bpy.types.Object) -> bool:
    """Whether an object may be picked as the ground."""
    return candidate.type == "MESH"


def follow_pick(ride, context: bpy.types.Context) -> None:
    """Where a curve is active that nobody rides any more, the one that was picked instead becomes active."""
    active = context.view_layer.objects.active if context.view_layer is not None else None
    if not ride.on or ride.curve is None or context.mode != "OBJECT" or active is None or active.type != "CURVE":
        return
    if all(body.beyond_mocap_ride.curve != active for body in riders(context.scene)):
        choose(context, ride.curve)


def choose(context: bpy.types.Context, thing: bpy.types.Object) -> None:
    """Select one object and nothing else, and make it active, so that Tab edits it."""
    if thing.name not in context.view_layer.objects:
        return
    for other in list(context.selected_objects):
        other.select_set(False)
    thing.hide_set(False)
    thing.select_set(True)
    context.view_layer.objects.active = thing


class BeyondMocapRide(bpy.types.PropertyGroup):
    """One armature's path editing."""

    attached_to = ("Object.beyond_mocap_ride",)

    on: BoolProperty(name="Rides", description="Whether the armature's motion rides a curve")
    curve: PointerProperty(
        name="New Path", type=bpy.types.Object, poll=is_curve, update=follow_pick,
        description="The curve object that the motion rides",
    )
    before: PointerProperty(type=BeyondMocapBefore, description="The original motion, put aside")
    fit: EnumProperty(name="Original Path", items=FITS, default="spline", description="How the original path is found")
    degree: IntProperty(
        name="Degree", default=13, min=1, max=200, soft_max=60,
        description="Of the polynomial that is the original path"
    )
    by_arc_length: BoolProperty(
        name="Keep Speed",
        default=True,
        description="As many metres of path in each frame as the original goes; off: the whole motion is spread over "
        "the whole path",
    )
    speed: FloatProperty(
        name="Speed", default=1.0, min=0.05, max=20.0, soft_min=0.25, soft_max=4.0, precision=2,
        description="How many times as fast the motion plays, steps and all",
    )
    end: EnumProperty(
        name="Path Too Short", items=ENDS, default="stop",
        description="What happens where the path ends before the motion"
    )
    cycle: BoolProperty(
        name="Cycle", description="Repeat the motion's best loop of steps until the path ends, its seams blended"
    )
    frame: EnumProperty(
        name="Offsets", items=FRAMES, default="path", description="What the body's offsets from the path turn with"
    )
    plant: BoolProperty(name="Plant Feet", default=True, description="Feet that stand in the original stand here too")
    lean: BoolProperty(name="Lean", default=True, description="Lean into bends as their radius and the speed ask for")
    bends: BoolProperty(
        name="Slow in Bends", description="Tight bends slow the motion as they slow people (two-thirds power law)"
    )
    slopes: BoolProperty(name="Follow Slopes", default=True, description="Feet follow the slope of the path or ground")
    climbs: BoolProperty(
        name="Slow on Slopes", description="Slopes slow the motion as they slow walkers (Tobler's function)"
    )
    delay: FloatProperty(
        name="Delay", default=0.0, min=0.0, max=86399.0, soft_max=10.0, precision=2, unit="TIME_ABSOLUTE",
        description="Seconds that the motion begins later",
    )
    added: FloatProperty(
        name="Added", options={"HIDDEN"}, description="Seconds of the delay that keep it apart from others"
    )
    detours: StringProperty(
        name="Detours", default="[]",
        description="Lateral detours as JSON: [arc in metres, width in metres, offset in metres to the left] each",
    )
    agreed: StringProperty(
        name="Agreed", options={"HIDDEN"}, description="Digest of what it was when riders were asked to keep apart"
    )
    ground: PointerProperty(
        name="Ground", type=bpy.types.Object, poll=is_mesh,
        description="A mesh whose surface the feet follow; none: the height of the path itself",
    )
    live: BoolProperty(
        name="Live", default=True, description="Follow the curve and these settings while they are edited"
    )
    told: StringProperty(name="Told", options={"HIDDEN"}, description="Lines about what to look at")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Figures of the result as JSON")


def wishes(ride: BeyondMocapRide) -> dict:
    """The settings as arguments of the core's `RideSettings`."""
    found = {name: getattr(ride, name) for name in WISHES}
    found["speed"], found["delay"] = (round(found[name], 6) for name in ("speed", "delay"))  # single precision
    try:
        found["detours"] = tuple(tuple(float(value) for value in detour) for detour in json.loads(ride.detours or "[]"))
    except (TypeError, ValueError):
        found["detours"] = ()
    return found


def riders(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """All armatures of a scene that ride."""
    if not bpy.data.armatures:
        return []
    return [body for body in scene.objects if body.type == "ARMATURE" and body.beyond_mocap_ride.on]


def meant(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The riders that a button means, the active one first: the selected ones; with a curve active, all who ride it."""
    chosen = context.view_layer.objects.active
    if chosen is None:
        return []
    if chosen.type == "CURVE":
        return [body for body in riders(context.scene) if body.beyond_mocap_ride.curve == chosen]
    others = [body for body in context.selected_objects if body.type == "ARMATURE" and body != chosen]
    return [body for body in (chosen, *others) if body.type == "ARMATURE" and body.beyond_mocap_ride.on]
