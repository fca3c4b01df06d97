"""Live: sees that what a player is made of has been edited, waits until the hand has come to rest, and has him updated.

Blender says after every change what has changed; that the change matters is found by comparing what is asked now with
what the newest take was made of, so that neither the preview itself nor a walk along the timeline starts anything.
First a quick take is made, and when nothing has changed for a while a whole one in its place.
"""

from __future__ import annotations

import json
from time import perf_counter

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError
from ..core.live import Watcher, is_playing
from . import freshness, plans, queue

WHOLE = 0.8  # seconds without a change after which a quick take is made as well as it can be
MATTERS = (bpy.types.Object, bpy.types.Curve, bpy.types.Action, bpy.types.Scene)

_seen: dict = {"looked": 0.0, "quick": {}, "begun": {}}


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
    players = {player.name: player for player in scene.beyond_mocap.players if player.use}
    if _seen["looked"] != WATCHER.since:
        for name, player in players.items():
            asked = edited(scene, player)
            if asked and _seen["begun"].get(name) != asked:
                _seen["quick"][name], _seen["begun"][name] = now, asked
                return name, "quick"
        _seen["looked"] = WATCHER.since
    for name, since in list(_seen["quick"].items()):
        if now - max(since, WATCHER.since) > WHOLE:
            del _seen["quick"][name]
            if name in players and not edited(scene, players[name]):
                return name, "whole"
    return None


def settle(scene: bpy.types.Scene) -> bool:
    """Have a player updated who is to be, where Live is on; whether one may have to be in a while."""
    if not scene.beyond_mocap.live:
        _seen["quick"].clear()
        return False
    if bpy.context.window_manager.beyond_mocap_work.kind or queue.names() or is_playing():
        return True
    found = due(scene, perf_counter())
    if found is not None and bpy.ops.beyond_mocap.update_live.poll():
        bpy.ops.beyond_mocap.update_live("INVOKE_DEFAULT", player=found[0], kind=found[1])
    return found is not None or bool(_seen["quick"])


def forget() -> None:
    """No wish is known any more."""
    _seen.update(looked=0.0, quick={}, begun={})


WATCHER = Watcher(name="Live", matters=MATTERS, settle=settle, ends=forget)
