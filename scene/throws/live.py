"""A throw that is shown, and not kept yet, follows while its target is dragged and its settings are edited.

Blender says after every change that something has changed; a timer then compares what each throw was made of with what
is asked now, and has it made again in a thread once the hand rests. What comes is a step of undo of its own: actions
and balls are made and removed for it, and Blender may keep pointers to them over an undo that does not know of that.
What undo or redo brings back is not made again, or nobody would get further back.
"""

from __future__ import annotations

import traceback
from time import perf_counter

import bpy
from bpy.app.handlers import persistent

from ...beyond_mocap.errors import BeyondMocapError
from .. import background
from ..handlers import put_on, take_off
from . import made, order, shown

TICK, IDLE = 0.1, 0.4  # seconds between two looks: after a change or while something is made, and else
SETTLED = 0.15  # seconds without a change after which the hand rests
HOLDING = ("TRANSFORM_OT", "VIEW3D_OT_cursor3d", "BEYOND_MOCAP_OT_throw_at_target", "BEYOND_MOCAP_OT_kick_at_target")
MODES = ("OBJECT", "POSE")
KIND = "throw again"
MATTERS = (bpy.types.Object, bpy.types.Scene)

_seen: dict = {"dirty": False, "changed": 0.0, "job": None, "begun": {}, "ended": set(), "restored": False}


def mark() -> None:
    """Something has changed that may matter."""
    _seen["dirty"], _seen["changed"] = True, perf_counter()


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


@persistent
def _after_change(_scene, depsgraph):
    if any(isinstance(update.id, MATTERS) for update in depsgraph.updates):
        mark()


@persistent
def _after_undo(*_):
    _seen["restored"] = True
    mark()


@persistent
def _after_load(*_):
    _seen.update(begun={}, ended=set(), restored=False)
    mark()


def _tick():
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None or not (_seen["dirty"] or _seen["job"]):
        return IDLE
    active = window.view_layer.objects.active
    holds = any(one.bl_idname.startswith(HOLDING) for one in window.modal_operators)
    # in other modes steps of undo know of the active object alone
    holds = holds or active is not None and active.mode not in MODES
    if holds or bpy.app.is_job_running("RENDER") or perf_counter() - _seen["changed"] < SETTLED:
        return TICK
    with bpy.context.temp_override(window=window):
        _look(window.scene)
    return TICK


def _look(scene: bpy.types.Scene) -> None:
    """Show what has come, begin what is due."""
    name = _seen["job"][0] if _seen["job"] else ""
    try:
        if _seen["job"]:
            uid, job = _seen["job"][1:]
            if not job.poll() and not job.stale:
                return
            _seen["job"] = None
            if uid == scene.session_uid:
                finish(scene, job)
            else:
                _seen["begun"].pop(name, None)
        body = due(scene)
        if body is None:
            _seen["dirty"] = False
            return
        name = body.name
        _seen["job"] = name, scene.session_uid, begin(scene, body)
    except BeyondMocapError as error:
        tell(scene, name, str(error))
    except Exception:  # a timer that raises is never called again
        traceback.print_exc()
        tell(scene, name, f"{name}: could not be made again here; see the system console")


HANDLERS = (("undo_post", _after_undo), ("redo_post", _after_undo), ("load_post", _after_load),
            ("depsgraph_update_post", _after_change))


def register():
    """Look from now on, where there is a window."""
    if not bpy.app.background:
        put_on(HANDLERS, _tick, 1.0)


def unregister():
    """Look no more."""
    take_off(HANDLERS, _tick)
    background.stop(KIND)
    _seen.update(dirty=False, changed=0.0, job=None, begun={}, ended=set(), restored=False)
