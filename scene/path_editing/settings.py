"""The stored state of a path edit: an armature whose motion follows a curve. Saved with the file, and part of undo."""

import json

import bpy
from bpy.props import BoolProperty, FloatProperty, PointerProperty, StringProperty

from ..core.properties import read_property_values, with_settings
from ..result.result import BeyondMocapBefore

SHAPES = (("FITTED", "Original", "Along the original path"),
          ("STRAIGHT", "Straight", "A straight line, as long as the original path, toward its end"),
          ("PRESENT", "As It Is", "Along the current path, with other points"))
MOST_DEGREE = 20
"""Highest degree of a B-spline that a motion follows."""


def activate_curve(edit, context: bpy.types.Context) -> None:
    """Make the chosen curve active if the active curve is no longer the path of any armature."""
    active = context.view_layer.objects.active if context.view_layer is not None else None
    if not edit.on or edit.curve is None or context.mode != "OBJECT" or active is None or active.type != "CURVE":
        return
    if all(body.beyond_mocap_ride.curve != active for body in list_edited_bodies(context.scene)):
        select_object(context, edit.curve)


def select_object(context: bpy.types.Context, thing: bpy.types.Object) -> None:
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
                           update=activate_curve, description="The curve object that the motion follows")
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
    messages: StringProperty(name="Messages", options={"HIDDEN"}, description="Status and warnings")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Figures of the result as JSON")


def collect_options(edit: BeyondMocapRide) -> dict:
    """Collect the settings as arguments of the core's `PathEditSettings`."""
    from ...beyond_mocap.path_editing.path_edit_settings import PathEditSettings

    options = read_property_values(PathEditSettings, edit, "path_editing")
    options["speed"], options["delay"] = (round(options[name], 6) for name in ("speed", "delay"))  # single precision
    try:
        options["detours"] = tuple(tuple(float(value) for value in detour)
                                   for detour in json.loads(edit.detours or "[]"))
    except (TypeError, ValueError):
        options["detours"] = ()
    return options


def list_edited_bodies(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List all armatures of a scene that follow a path."""
    if not bpy.data.armatures:
        return []
    return [body for body in scene.objects if body.type == "ARMATURE" and body.beyond_mocap_ride.on]


def list_target_bodies(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the edited armatures that a button acts on, the active one first: the selected ones, or all on an active
    curve.
    """
    active = context.view_layer.objects.active
    if active is None:
        return []
    if active.type == "CURVE":
        return [body for body in list_edited_bodies(context.scene) if body.beyond_mocap_ride.curve == active]
    others = [body for body in context.selected_objects if body.type == "ARMATURE" and body != active]
    return [body for body in (active, *others) if body.type == "ARMATURE" and body.beyond_mocap_ride.on]
