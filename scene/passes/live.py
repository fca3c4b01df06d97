"""Sees that a passing scene has been edited, waits until the hand has come to rest, and has it made again. While a
place is being dragged, its flights alone are worked out, again and again, and drawn.

Only where the scene is shown already. What is asked is compared with what the scene shown was made of, so that neither
its own making nor a walk along the timeline starts anything. The same wish is begun once: what was cancelled, undone or
cannot be made waits for the next edit.
"""

from __future__ import annotations

import traceback
from time import perf_counter

import bpy
from bpy.app.handlers import persistent

from ...beyond_mocap.errors import BeyondMocapError
from .. import background
from . import rally
from .settings import PLAYED

KIND = "flights"
TICK, IDLE = 0.05, 0.4  # seconds between two looks
SETTLED = 0.15  # seconds without a change after which the hand rests
HOLDING = ("TRANSFORM_OT", "VIEW3D_OT_cursor3d")

_seen = {"dirty": False, "changed": 0.0, "begun": "", "drawn": ""}
_running: list[background.Job] = []  # at most one


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
    if not settings.live or not settings.made_of:
        return
    if any(isinstance(update.id, bpy.types.Object) for update in depsgraph.updates):
        mark()


def _tick():
    try:
        return _look()
    except Exception:  # a timer that raises is never called again
        traceback.print_exc()
        _seen["dirty"] = False
        return IDLE


def _look() -> float:
    """Do what is due; seconds until the next look."""
    if not _seen["dirty"]:
        return IDLE
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None or window.screen.is_animation_playing:
        return TICK
    if bpy.context.window_manager.beyond_mocap_work.kind not in ("", "passes"):
        return TICK
    if any(operator.bl_idname.startswith(HOLDING) for operator in window.modal_operators):
        _drag(window.scene)
        return TICK
    if perf_counter() - _seen["changed"] < SETTLED:
        return TICK
    _rest()
    _seen["dirty"] = False
    digest = edited(window.scene)
    if not digest:
        rally.show_dragged(None)
    if digest and digest != _seen["begun"]:
        _seen["begun"] = digest
        with bpy.context.temp_override(window=window):
            if bpy.ops.beyond_mocap.passes_make.poll():
                bpy.ops.beyond_mocap.passes_make("INVOKE_DEFAULT", live=True)
    return TICK


def _drag(scene) -> None:
    """Take in the flights that have been worked out, and begin with those of where everybody is now."""
    from . import make

    if _running:
        if not _running[0].poll():
            return
        job = _running.pop()
        if job.result is not None:
            rally.show_dragged(job.result)
            _redraw()
    settings = scene.beyond_mocap_passes
    if not settings.live or settings.made_of in ("", PLAYED):
        return
    try:
        order = make.order_of(scene)
    except BeyondMocapError:  # where he is just now nobody can be
        return
    if order.library is not None and order.digest != _seen["drawn"]:
        _seen["drawn"] = order.digest
        _running.append(background.Job(KIND, lambda _progress, cancelled, _hurry: make.flights(order, cancelled)))


def _rest() -> None:
    """The hand rests: nothing is worked out for the drag alone any more."""
    if _running:
        _running.pop().cancel()
    _seen["drawn"] = ""


def _redraw() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


@persistent
def _after_load(*_):
    rally.forget()


def register():
    """Look from now on, where there is a window."""
    if not bpy.app.background:
        bpy.app.handlers.depsgraph_update_post.append(_after_change)
        bpy.app.timers.register(_tick, first_interval=1.0, persistent=True)
    bpy.app.handlers.load_post.append(_after_load)


def unregister():
    """Look no more."""
    if _after_change in bpy.app.handlers.depsgraph_update_post:
        bpy.app.handlers.depsgraph_update_post.remove(_after_change)
    if _after_load in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_after_load)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _seen.update(dirty=False, changed=0.0, begun="", drawn="")
    _rest()
    rally.forget()
