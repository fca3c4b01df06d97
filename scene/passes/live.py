"""Live updates of a passing scene: an edit is noticed, and when the user pauses, the scene is synthesized again.

While a place is dragged, only its flights are planned, again and again, and drawn. Nothing happens unless the scene has
been synthesized before. The requested scene is compared with the one that is shown, so that neither its own update nor
a change of frame starts anything. Each request starts once: one that was cancelled, undone or failed waits for the next
edit.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError
from ..core import background, window
from ..core.live import Watcher, is_playing
from . import generate as make
from .settings import PLAYED

KIND = "flights"

_seen = {"begun": "", "drawn": ""}
_running: list[background.Job] = []  # at most one


def find_edit(scene: bpy.types.Scene) -> str:
    """Compute the digest of the requested scene if it differs from the scene that is shown, otherwise ""."""
    settings = scene.beyond_mocap_passes
    if not settings.live or settings.made_of in ("", PLAYED):
        return ""
    try:
        digest = make.build_order(scene).digest
    except BeyondMocapError as error:
        if settings.messages != str(error):
            settings.messages = str(error)
        return ""
    return digest if digest != settings.made_of else ""


def mark_edit(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Mark the scene as possibly edited."""
    settings = scene.beyond_mocap_passes
    if settings.live and settings.made_of and any(isinstance(one.id, bpy.types.Object) for one in depsgraph.updates):
        WATCHER.mark_dirty()


def settle_edit(scene: bpy.types.Scene) -> bool:
    """Start an update if the scene was edited; return whether that has to wait."""
    if _is_busy():
        return True
    _stop_drag()
    digest = find_edit(scene)
    if not digest:
        make.show_drag(None)
    # each request starts once, also if it fails or is cancelled
    if digest and digest != _seen["begun"]:
        _seen["begun"] = digest
        if bpy.ops.beyond_mocap.passes_make.poll():
            bpy.ops.beyond_mocap.passes_make("INVOKE_DEFAULT", live=True)
    return False


def _is_busy() -> bool:
    return is_playing() or bpy.context.window_manager.beyond_mocap_work.kind not in ("", "passes")


def _update_drag(scene) -> None:
    """Draw the flights that are planned, and start to plan those of the current places."""
    if _is_busy():
        return
    if _running:
        if not _running[0].poll():
            return
        job = _running.pop()
        # None: the job was cancelled or failed
        if job.result is not None:
            make.show_drag(job.result)
            window.redraw_editors()
    settings = scene.beyond_mocap_passes
    if not settings.live or settings.made_of in ("", PLAYED):
        return
    try:
        order = make.build_order(scene)
    except BeyondMocapError:  # the player is at an impossible place just now
        return
    if order.library is not None and order.digest != _seen["drawn"]:
        _seen["drawn"] = order.digest
        _running.append(background.Job(KIND, lambda _progress, cancelled, _hurry: make.plan_flights(order, cancelled)))


def _stop_drag() -> None:
    """Stop planning flights for a drag."""
    if _running:
        _running.pop().cancel()
    _seen["drawn"] = ""


def clear_updates() -> None:
    """Stop updates and remove what is drawn."""
    _seen["begun"] = ""
    _stop_drag()
    make.clear_trajectories()


WATCHER = Watcher(name="Passing scene", changed=mark_edit, settle=settle_edit, dragged=_update_drag,
                  loaded=lambda: make.clear_trajectories(), ends=clear_updates)
