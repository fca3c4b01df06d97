"""Sees that a passing scene has been edited, waits until the hand has come to rest, and has it made again. While a
place is being dragged, its flights alone are worked out, again and again, and drawn.

Only where the scene is shown already. What is asked is compared with what the scene shown was made of, so that neither
its own making nor a walk along the timeline starts anything. The same wish is begun once: what was cancelled, undone or
cannot be made waits for the next edit.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError
from ..core import background, window
from ..core.live import Watcher, is_playing
from . import make
from .settings import PLAYED

KIND = "flights"

_seen = {"begun": "", "drawn": ""}
_running: list[background.Job] = []  # at most one


def edited(scene: bpy.types.Scene) -> str:
    """Digest of what is asked for, where it is another than what is shown was made of; else empty."""
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


def look_at(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Note whether the scene shown may be another than is asked for."""
    settings = scene.beyond_mocap_passes
    if settings.live and settings.made_of and any(isinstance(one.id, bpy.types.Object) for one in depsgraph.updates):
        WATCHER.mark()


def settle(scene: bpy.types.Scene) -> bool:
    """Have the scene made again where it has been edited; whether that has to wait."""
    if _busy():
        return True
    _rest()
    digest = edited(scene)
    if not digest:
        make.show_dragged(None)
    if digest and digest != _seen["begun"]:
        _seen["begun"] = digest
        if bpy.ops.beyond_mocap.passes_make.poll():
            bpy.ops.beyond_mocap.passes_make("INVOKE_DEFAULT", live=True)
    return False


def _busy() -> bool:
    return is_playing() or bpy.context.window_manager.beyond_mocap_work.kind not in ("", "passes")


def _drag(scene) -> None:
    """Take in the flights that have been worked out, and begin with those of where everybody is now."""
    if _busy():
        return
    if _running:
        if not _running[0].poll():
            return
        job = _running.pop()
        if job.result is not None:
            make.show_dragged(job.result)
            window.redraw()
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


def forget() -> None:
    """Nothing is worked out or drawn any more."""
    _seen["begun"] = ""
    _rest()
    make.forget_rallies()


WATCHER = Watcher(name="Passing scene", changed=look_at, settle=settle, dragged=_drag, loaded=make.forget_rallies,
                  ends=forget)
