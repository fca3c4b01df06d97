"""What an aimed ball keeps, saved with the file and known to undo; which ball, body and target are meant."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty, StringProperty

from ..core import live
from ..core.properties import with_settings
from ..passes.settings import KEPT
from ..result.result import BeyondMocapBefore

MARK = "beyond_mocap_shot"
"""Custom property of an action or curve of ours: of an action, a digest of what it was made of. Not the name of the
group on objects, with which it would share its place before Blender 5.0."""


def changed(_settings, _context) -> None:
    """A setting that the ball may have to follow."""
    live.mark("Aimed balls")


@with_settings("aim", update=changed)
@with_settings("aim.handover")
class BeyondMocapAim(bpy.types.PropertyGroup):
    """Who strikes a ball, towards what and how."""

    attached_to = ("Object.beyond_mocap_aim",)

    on: BoolProperty(name="Aimed", description="Whether this ball is aimed at a target")
    body: PointerProperty(name="Body", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE",
                          update=changed,
                          description="The armature that strikes the ball; none: it leaves from where it lies")
    place: FloatVectorProperty(name="From", size=3, options={"HIDDEN"},
                               description="Where the ball lies when nobody strikes it, metres")
    target: PointerProperty(name="Target", type=bpy.types.Object, update=changed,
                            description="Where the ball arrives; drag it with G")
    curve: PointerProperty(name="Trajectory", type=bpy.types.Object, description="The curve along the ball's way")
    told: StringProperty(name="Told", options={"HIDDEN"}, description="What is wrong, if anything")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Lines about the shot that is shown")
    strike: IntProperty(name="Strike", options={"HIDDEN"}, description="Scene frame on which the ball is struck")
    arrived: FloatProperty(name="Arrived", options={"HIDDEN"}, description="Scene frame on which it is at the target")
    before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before it was aimed")
    handed: BoolProperty(name="Handed Over", options={"HIDDEN"},
                         description="Whether Blender's rigid bodies have the ball")
    handed_before: StringProperty(name="Handed Before", options={"HIDDEN"},
                                  description="What the handover has to bring back, as JSON")


def aimed(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The aimed balls of a scene."""
    return [thing for thing in scene.objects if thing.beyond_mocap_aim.on]


def aimed_ball(context: bpy.types.Context) -> bpy.types.Object | None:
    """The aimed ball that is meant: active, selected, the one whose target is active, or the only one."""
    active = context.view_layer.objects.active
    balls = aimed(context.scene)
    meant = [ball for ball in balls if ball == active]
    meant += [ball for ball in balls if active is not None and ball.beyond_mocap_aim.target == active]
    meant += [ball for ball in balls if ball.select_get()]
    meant += balls if len(balls) == 1 else []
    return meant[0] if meant else None


def ball_meant(context: bpy.types.Context) -> bpy.types.Object | None:
    """The ball that is selected, by mark or name; an aimed one that, or whose target, is active; the only mesh."""
    chosen = [thing for thing in context.selected_objects if thing.type == "MESH"]
    marked = [thing for thing in chosen if thing.beyond_mocap_aim.on or thing.get(KEPT) or "ball" in thing.name.lower()]
    if marked:
        return marked[0]
    active = context.view_layer.objects.active
    aimed = aimed_ball(context)
    if aimed is not None and active in (aimed, aimed.beyond_mocap_aim.target, aimed.beyond_mocap_aim.body):
        return aimed
    loose = [thing for thing in chosen if thing.parent is None]
    return loose[0] if len(loose) == 1 and len(context.selected_objects) == 1 else None


def body_meant(context: bpy.types.Context) -> bpy.types.Object | None:
    """The armature that strikes: the active one, or one that is selected."""
    active = context.view_layer.objects.active
    found = [thing for thing in (active, *context.selected_objects) if thing is not None and thing.type == "ARMATURE"]
    return found[0] if found else None


def target_meant(context: bpy.types.Context) -> bpy.types.Object | None:
    """An Empty that is selected."""
    return next((thing for thing in context.selected_objects if thing.type == "EMPTY"), None)
