"""A throw that is shown, and not kept yet, follows while its target is dragged and its settings are edited.

Blender says after every change that something has changed; a timer then compares what each throw was made of with what
is asked now, and has it made again in a thread once the hand rests. What comes is a step of undo of its own: actions
and balls are made and removed for it, and Blender may keep pointers to them over an undo that does not know of that.
What undo or redo brings back is not made again, or nobody would get further back.
"""

from __future__ import annotations

import bpy

from ..core import background
from ..core.live import Watcher, attempt
from . import made, order, shown

HELD_BY = ("BEYOND_MOCAP_OT_throw_at_target", "BEYOND_MOCAP_OT_kick_at_target")
MODES = ("OBJECT", "POSE")
KIND = "throw again"
MATTERS = (bpy.types.Object, bpy.types.Scene)

_seen: dict = {"job": None, "begun": {}, "ended": set(), "restored": False}


def due(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """An armature whose throw is another than what is asked for; the same wish is begun once, and not anew where undo
    or redo has brought it back."""
    asked = {}
    for body in scene.objects:
        if body.type != "ARMATURE" or body.library is not None:
            continue
        wish = body.beyond_mocap_throw
        if wish.made and wish.live and wish.made_of:
            asked[body.name] = order.digest(scene, body, wish.made)
    if _seen["restored"]:
        _seen["begun"].update(_seen["ended"] & asked.items())
        _seen["restored"] = False
    for name, digest in asked.items():
        body = scene.objects[name]
        if digest != body.beyond_mocap_throw.made_of and _seen["begun"].get(name) != digest:
            _seen["begun"][name] = digest
            return body
    return None


def begin(scene: bpy.types.Scene, body: bpy.types.Object) -> background.Job:
    """Make an armature's throw again in a thread, on the frame on which it is."""
    wish = body.beyond_mocap_throw
    asked = order.order_of(scene, body, wish.made, wish.frame or wish.asked)
    return background.Job(KIND, lambda *asking: made.work(asked, *asking))


def finish(scene: bpy.types.Scene, job: background.Job) -> None:
    """Show what a thread has made, as a step of undo, where it is still asked for; BeyondMocapError where it cannot be
    made."""
    if background.cancelled(job):
        return
    if job.error is not None:
        raise job.error
    asked = job.result.order
    body = scene.objects.get(asked.body)
    if body is None or not body.beyond_mocap_throw.made:
        return
    if order.digest(scene, body, asked.act) == asked.digest:
        shown.show(scene, body, job.result)
        _seen["ended"].add((body.name, asked.digest))
        bpy.ops.ed.undo_push(message=f"{body.name} {asked.act}s again")
    elif _seen["begun"].get(body.name) == asked.digest:  # it may be asked for again
        del _seen["begun"][body.name]


def tell(scene: bpy.types.Scene, name: str, text: str) -> None:
    """Say at an armature why its throw, which stays as it was, is not what is asked for."""
    body = scene.objects.get(name)
    if body is not None:
        body.beyond_mocap_throw.told = text


def settle(scene: bpy.types.Scene) -> bool:
    """Show what has come, begin what is due; whether something is made or has to wait."""
    active = bpy.context.view_layer.objects.active
    if active is not None and active.mode not in MODES:  # steps of undo know of the active object alone there
        return True
    name = _seen["job"][0] if _seen["job"] else ""
    if _seen["job"]:
        uid, job = _seen["job"][1:]
        if not job.poll() and not job.stale:
            return True
        _seen["job"] = None
        if uid != scene.session_uid:
            _seen["begun"].pop(name, None)
        else:
            _try(scene, name, lambda: finish(scene, job))
    body = due(scene)
    if body is not None:
        _try(scene, body.name, lambda: _begin(scene, body))
    return body is not None


def _begin(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    _seen["job"] = body.name, scene.session_uid, begin(scene, body)


def _try(scene: bpy.types.Scene, name: str, action) -> None:
    attempt(action, lambda text: tell(scene, name, text), f"{name}: could not be made again here")


def restored() -> None:
    """What undo or redo brings back is not made again."""
    _seen["restored"] = True


def forget() -> None:
    """Another file is open, or none is looked at any more."""
    background.stop(KIND)
    _seen.update(job=None, begun={}, ended=set(), restored=False)


WATCHER = Watcher(
    name="Throws", matters=MATTERS, settle=settle, held_by=HELD_BY, restored=restored, loaded=forget, ends=forget,
)
