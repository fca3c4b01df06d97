"""Which ball, body and target are meant, and on which frames a body strikes."""

from __future__ import annotations

import bpy

from ..passes.hits_shown import motion_of
from ..passes.settings import KEPT
from .settings import aimed_ball


def ball_meant(context: bpy.types.Context) -> bpy.types.Object | None:
    """The ball that is selected, by its mark or name; an aimed one that is active or whose target is; the only mesh
    that is selected."""
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


def stretch_of(scene: bpy.types.Scene, body: bpy.types.Object, part: str, side: str) -> tuple[int, int]:
    """Scene frames of the ball stretch of the strike nearest to the current frame; the current frame where there is
    none."""
    from ...beyond_mocap.passes.hits import analyse

    motion, first = motion_of(scene, body)
    now = min(max(scene.frame_current, first), first + len(motion) - 1)
    motions = analyse(motion, part, side).motions
    if not motions:
        return now, now
    nearest = min(motions, key=lambda one: abs(first + one.key - scene.frame_current))
    low, high = nearest.ball_stretch
    return int(first + low), int(first + high)
