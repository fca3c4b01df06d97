"""The stored state of a path edit: an armature whose motion follows a curve. Saved with the file, and part of undo."""

from __future__ import annotations

import json

import bpy
from bpy.props import BoolProperty, FloatProperty, PointerProperty, StringProperty

from ..core.properties import property_values, with_settings
from ..result.result import BeyondMocapBefore


def follow_pick(ride, context: bpy.types.Context) -> None:
    """Make the chosen curve active if the active curve is no longer the path of any armature."""
    active = context.view_layer.objects.active if context.view_layer is not None else None
    if not ride.on or ride.curve is None or context.mode != "OBJECT" or active is None or active.type != "CURVE":
        return
    if all(body.beyond_mocap_ride.curve != active for body in riders(context.scene)):
        choose(context, ride.curve)


def choose(context: bpy.types.Context, thing: bpy.types.Object) -> None:
    """Select one object only and make it active, so that Tab edits it."""
    if thing.name not in context.view_layer.objects:
        return
    for other in list(context.selected_objects):
        other.select_set(False)
    thing.hide_set(False)
    thing.select_set(True)
    context.view_layer.objects.active = thing


@with_settings("path_editing")
class BeyondMocapRide(bpy.types.PropertyGroup):
    """The path edit of one armature."""

    attached_to = ("Object.beyond_mocap_ride",)

    on: BoolProperty(name="On Path", description="Whether the armature's motion follows a curve")
    curve: PointerProperty(name="New Path", type=bpy.types.Object, poll=lambda _, thing: thing.type == "CURVE",
                           update=follow_pick, description="The curve object that the motion follows")
    before: PointerProperty(type=BeyondMocapBefore, description="The original motion, stored for Revert")
    added: FloatProperty(name="Added", options={"HIDDEN"},
                         description="Seconds of the delay that avoid collisions")
    detours: StringProperty(
        name="Detours", default="[]",
        description="Lateral detours as JSON: [arc in metres, width in metres, offset in metres to the left] each",
    )
    agreed: StringProperty(name="Agreed", options={"HIDDEN"},
                           description="Digest of the motion for which collisions were last avoided")
    ground: PointerProperty(name="Ground", type=bpy.types.Object, poll=lambda _, thing: thing.type == "MESH",
                            description="A mesh whose surface the feet follow; without it, the height of the path")
    told: StringProperty(name="Messages", options={"HIDDEN"}, description="Status and warnings")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Figures of the result as JSON")


def wishes(ride: BeyondMocapRide) -> dict:
    """Collect the settings as arguments of the core's `PathEditSettings`."""
    from ...beyond_mocap.path_editing.ride import RideSettings

    found = property_values(RideSettings, ride, "path_editing")
    found["speed"], found["delay"] = (round(found[name], 6) for name in ("speed", "delay"))  # single precision
    try:
        found["detours"] = tuple(tuple(float(value) for value in detour) for detour in json.loads(ride.detours or "[]"))
    except (TypeError, ValueError):
        found["detours"] = ()
    return found


def riders(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List all armatures of a scene that follow a path."""
    if not bpy.data.armatures:
        return []
    return [body for body in scene.objects if body.type == "ARMATURE" and body.beyond_mocap_ride.on]


def meant(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the edited armatures that a button acts on, the active one first: the selected ones, or all on an active
    curve.
    """
    chosen = context.view_layer.objects.active
    if chosen is None:
        return []
    if chosen.type == "CURVE":
        return [body for body in riders(context.scene) if body.beyond_mocap_ride.curve == chosen]
    others = [body for body in context.selected_objects if body.type == "ARMATURE" and body != chosen]
    return [body for body in (chosen, *others) if body.type == "ARMATURE" and body.beyond_mocap_ride.on]
