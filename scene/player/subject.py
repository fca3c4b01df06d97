"""Whose timeline is meant: the active player's, or that of a library clip that is being annotated."""

from __future__ import annotations

import bpy

from ..core.measure import Clock, scene_clock
from ..core.settings import active_player
from ..timeline import lanes, strips
from . import dots


def subject(context: bpy.types.Context) -> bpy.types.Object | None:
    """The object whose strips are meant: the active object, where it has lanes and is nobody's dot; else the active
    player's dot, where it has lanes; else None."""
    chosen = clip(context)
    if chosen is not None:
        return chosen
    player = active_player(context.scene.beyond_mocap)
    return None if player is None else strips.dot_of(player, context.scene)


def clip(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object, where it has lanes and is nobody's dot."""
    active = context.view_layer.objects.active
    return active if active is not None and lanes.has(active) and not active.beyond_mocap_dot.player else None


def can_have(context: bpy.types.Context) -> bool:
    """Whether there is somebody whose timeline can be written."""
    return clip(context) is not None or active_player(context.scene.beyond_mocap) is not None


def with_lanes(context: bpy.types.Context) -> bpy.types.Object:
    """The subject, the player's dot and lanes made where there are none; InputError where track or words cannot be
    read."""
    found = subject(context)
    return strips.with_lanes(context, active_player(context.scene.beyond_mocap)) if found is None else found


def clock(context: bpy.types.Context, target: bpy.types.Object) -> Clock:
    """The clock of its seconds: the scene's for a player's dot, its own for a clip."""
    return scene_clock(context.scene) if target.beyond_mocap_dot.player else lanes.written_for(target)


def name_of(target: bpy.types.Object) -> str:
    """Whose timeline it is, for messages."""
    return target.beyond_mocap_dot.player or target.name


def show(context: bpy.types.Context, player) -> None:
    """Make a player the active one, his dot alone selected, so that the NLA editor shows his strips."""
    settings = context.scene.beyond_mocap
    settings.active_player = next(n for n, other in enumerate(settings.players) if other == player)
    dot = strips.with_lanes(context, player) if player.dot is None else dots.ensure(context, player)
    for other in context.view_layer.objects.selected:
        other.select_set(False)
    if dot.name in context.view_layer.objects:
        dot.select_set(True)
        context.view_layer.objects.active = dot
