"""Properties of an aimed ball, saved with the file and covered by undo; and which ball, body and target are
selected.
"""

import bpy
from bpy.props import BoolProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty, StringProperty

from ..core import live
from ..core.properties import with_settings
from ..passes.settings import KEPT
from ..result.result import BeyondMocapBefore

MARK = "beyond_mocap_shot"
"""Custom property of an action or curve of this extension; of an action, a digest of what it was computed from. Not the
name of the property group on objects: before Blender 5.0 both would share one place."""


def mark_changed(_settings, _context) -> None:
    """Mark that an aimed ball may need an update."""
    live.mark_watcher("Aimed balls")


@with_settings("aim", update=mark_changed)
@with_settings("aim.handover")
class BeyondMocapAim(bpy.types.PropertyGroup):
    """How a ball is struck, by what and towards what."""

    attached_to = ("Object.beyond_mocap_aim",)

    on: BoolProperty(name="Aimed", description="This ball is aimed at a target")
    body: PointerProperty(name="Body", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE",
                          update=mark_changed,
                          description="Armature that strikes the ball; none: it leaves from its place")
    place: FloatVectorProperty(name="From", size=3, options={"HIDDEN"},
                               description="Position of the ball without a body, in metres")
    target: PointerProperty(name="Target", type=bpy.types.Object, update=mark_changed,
                            description="Where the ball arrives; drag it with G")
    curve: PointerProperty(name="Trajectory", type=bpy.types.Object, description="Curve along the ball's trajectory")
    messages: StringProperty(name="Messages", options={"HIDDEN"}, description="Status and warnings")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Figures of the shot")
    strike: IntProperty(name="Strike", options={"HIDDEN"}, description="Scene frame on which the ball is struck")
    arrived: FloatProperty(name="Arrived", options={"HIDDEN"}, description="Scene frame on which it is at the target")
    before: PointerProperty(type=BeyondMocapBefore, description="Animation of the ball before it was aimed")
    handed: BoolProperty(name="Handed Over", options={"HIDDEN"},
                         description="Blender's rigid bodies move the ball")
    handed_before: StringProperty(name="Handed Before", options={"HIDDEN"},
                                  description="Values to restore after the handover, as JSON")


def list_aimed_balls(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the aimed balls of a scene."""
    return [thing for thing in scene.objects if thing.beyond_mocap_aim.on]


def find_aimed_ball(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the aimed ball that is active, has the active target, is selected, or is the only one."""
    active = context.view_layer.objects.active
    balls = list_aimed_balls(context.scene)
    candidates = [ball for ball in balls if ball == active]
    candidates += [ball for ball in balls if active is not None and ball.beyond_mocap_aim.target == active]
    candidates += [ball for ball in balls if ball.select_get()]
    candidates += balls if len(balls) == 1 else []
    return candidates[0] if candidates else None


def find_selected_ball(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the selected ball by mark or name; an aimed one that is active, or whose target or body is; or the only
    mesh.
    """
    selected = [thing for thing in context.selected_objects if thing.type == "MESH"]
    marked = [thing for thing in selected if thing.beyond_mocap_aim.on or thing.get(KEPT)
              or "ball" in thing.name.lower()]
    if marked:
        return marked[0]
    active = context.view_layer.objects.active
    aimed = find_aimed_ball(context)
    if aimed is not None and active in (aimed, aimed.beyond_mocap_aim.target, aimed.beyond_mocap_aim.body):
        return aimed
    unparented = [thing for thing in selected if thing.parent is None]
    return unparented[0] if len(unparented) == 1 and len(context.selected_objects) == 1 else None


def find_selected_body(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the armature that strikes: the active one, or a selected one."""
    active = context.view_layer.objects.active
    found = [thing for thing in (active, *context.selected_objects) if thing is not None and thing.type == "ARMATURE"]
    return found[0] if found else None


def find_selected_target(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find a selected Empty."""
    return next((thing for thing in context.selected_objects if thing.type == "EMPTY"), None)
