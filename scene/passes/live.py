"""Sees that a passing scene has been edited, waits until the hand has come to rest, and has it made again.

Only where the scene is shown already. What is asked is compared with what the scene shown was made of, so that neither its
own making nor a walk along the timeline starts anything. The same wish is begun once: what was cancelled, undone or cannot be
made waits for the next edit.
"""

from __future__ import annotations

from time import perf_counter

import bpy
from bpy.app.handlers import persistent

from ...beyond_mocap.errors import BeyondMocapError
from .settings import PLAYED

TICK, IDLE = 0.05, 0.4  # seconds between two looks
SETTLED = 0.15  # seconds without a change after which the hand rests
HOLDING = ("TRANSFORM_OT", "VIEW3D_OT_cursor3d")

_seen = {"dirty": False, "changed": 0.0, "begun": ""}


def mark() -> None:
    """Something has changed that may matter."""
    _seen["dirty"], _seen["changed"] = True, perf_counter()


def edited(scene: bpy.types.Scene) -> str:
    """Digest of what is asked for, where it is another than what is shown was made of; else empty."""
    from . import make

    settings = scene.beyond_mocap_passes
    if not settings.live or settings.made_of in ("", PLAYED):
        return ""
    try:
        digest = make.order_of(scene).digest
    except BeyondMocapError as error:
        if settings.told != str(error):
            settings.told = str(error)
        return ""
    return digest if digest != settings.made_of else ""


@persistent
def _after_change(scene, depsgraph):
    settings = scene.beyond_mocap_passes
    if settings.live and settings.made_of and any(isinstance(update.id, bpy.types.Object) for update in depsgraph.updates):
        mark()


def _tick():
    if not _seen["dirty"]:
        return IDLE
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None or perf_counter() - _seen["changed"] < SETTLED or window.screen.is_animation_playing:
        return TICK
    running = [operator.bl_idname for operator in window.modal_operators]
    busy = bpy.context.window_manager.beyond_mocap_work.kind not in ("", "passes")
    if busy or any(name.startswith(HOLDING) for name in running):
        return TICK
    _seen["dirty"] = False
    digest = edited(window.scene)
    if digest and digest != _seen["begun"]:
        _seen["begun"] = digest
        with bpy.context.temp_override(window=window):
            if bpy.ops.beyond_mocap.passes_make.poll():
                bpy.ops.beyond_mocap.passes_make("INVOKE_DEFAULT", live=True)
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
    _seen.update(dirty=False, changed=0.0, begun="")
