"""Live: sees that what a player is made of has been edited, waits until the hand has come to rest, and has him updated.

Blender says after every change what has changed; that the change matters is found by comparing what is asked now with
what the newest take was made of, so that neither the preview itself nor a walk along the timeline starts anything.
First a quick take is made, and when nothing has changed for a while a whole one in its place.
"""

from __future__ import annotations

import json
from time import perf_counter

import bpy
from bpy.app.handlers import persistent

from ..beyond_mocap.errors import BeyondMocapError
from . import freshness, plans, queue

TICK = 0.05  # seconds between two looks
SETTLED = 0.12  # seconds without a change after which the hand rests
WHOLE = 0.8  # seconds without a change after which a quick take is made as well as it can be
MATTERS = (bpy.types.Object, bpy.types.Curve, bpy.types.Action, bpy.types.Scene)
HOLDING = ("TRANSFORM_OT", "CURVE_OT", "VIEW3D_OT_cursor3d")

_seen: dict = {"changed": 0.0, "dirty": False, "quick": {}, "begun": {}}


def edited(scene: bpy.types.Scene, player) -> dict[str, str]:
    """What the player asks for, where that is another track, other words or other choices than his newest take was made
    of; empty where it is not, where he has none, or where what he asks for makes no sense just now."""
    made_of = json.loads(player.result.made_of or "{}")
    if not player.take or not made_of:
        return {}
    try:
        asked = freshness.parts_of_plan(plans.plan_of(scene.beyond_mocap, player, still=True)[0])
    except (BeyondMocapError, OSError):
        return {}
    return asked if any(made_of.get(name) != value for name, value in asked.items()) else {}


def due(scene: bpy.types.Scene, now: float) -> tuple[str, str] | None:
    """(player's name, "quick" or "whole") of whoever is to be updated at second `now`; None where nobody is. The same
    wish is begun once: what was cancelled, undone or cannot be made waits for the next edit."""
    if now - _seen["changed"] < SETTLED:
        return None
    players = {player.name: player for player in scene.beyond_mocap.players if player.use}
    if _seen["dirty"]:
        for name, player in players.items():
            asked = edited(scene, player)
            if asked and _seen["begun"].get(name) != asked:
                _seen["quick"][name], _seen["begun"][name] = now, asked
                return name, "quick"
        _seen["dirty"] = False
    for name, since in list(_seen["quick"].items()):
        if now - max(since, _seen["changed"]) > WHOLE:
            del _seen["quick"][name]
            if name in players and not edited(scene, players[name]):
                return name, "whole"
    return None


def mark() -> None:
    """Something has changed that may matter."""
    _seen["changed"], _seen["dirty"] = perf_counter(), True


@persistent
def _after_change(scene, depsgraph):
    if scene.beyond_mocap.live and any(isinstance(update.id, MATTERS) for update in depsgraph.updates):
        mark()


def _tick():
    window = next(iter(bpy.context.window_manager.windows), None)
    scene = window.scene if window is not None else None
    if scene is None or not scene.beyond_mocap.live:
        _seen["quick"].clear()
        return 0.5
    busy = bpy.context.window_manager.beyond_mocap_work.kind or queue.names() or window.screen.is_animation_playing
    if busy or any(operator.bl_idname.startswith(HOLDING) for operator in window.modal_operators):
        return TICK
    found = due(scene, perf_counter())
    if found is not None:
        with bpy.context.temp_override(window=window):
            if bpy.ops.beyond_mocap.update_live.poll():
                bpy.ops.beyond_mocap.update_live("INVOKE_DEFAULT", player=found[0], kind=found[1])
    return TICK


def register():
    """Look from now on, where there is a window."""
    if not bpy.app.background:
        bpy.app.handlers.depsgraph_update_post.append(_after_change)
        bpy.app.timers.register(_tick, first_interval=1.0, persistent=True)


def unregister():
    """Look no more."""
    if _after_change in bpy.app.handlers.depsgraph_update_post:
        bpy.app.handlers.depsgraph_update_post.remove(_after_change)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _seen.update(changed=0.0, dirty=False, quick={}, begun={})
