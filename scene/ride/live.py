"""Riders follow while curves, settings and grounds are edited, also while a point is being dragged.

Blender says after every change that something has changed; a timer, which runs during modal operators too, then
compares what each rider's motion was made of with what there is now. Our own writes are such changes too, and find
nothing to do. An edit from a timer is no undo step: undo brings back the state before, and riders are brought up to
date with that.
"""

from __future__ import annotations

import traceback
from time import perf_counter

import bpy
from bpy.app.handlers import persistent

from ...beyond_mocap.errors import BeyondMocapError
from ..handlers import put_on, take_off
from . import riders as rides
from . import source
from .riders import shown  # noqa: F401  (what overlays draw)
from .settings import riders

TICK, IDLE = 0.01, 0.05  # seconds between two looks: after a change, and while nothing happens
QUIET = 0.5  # seconds after the last change in which looks are frequent
SHARE = 0.3  # of the time that a look has taken is left to the window before the next one
MATTERS = (bpy.types.Object, bpy.types.Curve, bpy.types.Mesh, bpy.types.Armature, bpy.types.Action, bpy.types.Scene)

_seen = {"dirty": True, "changed": 0.0}


def mark() -> None:
    """Something has changed that may matter."""
    _seen["dirty"], _seen["changed"] = True, perf_counter()


def follow(scene: bpy.types.Scene) -> int:
    """Bring all live riders of a scene up to date; how many had to be. What cannot be is told at the rider, whose
    motion stays as it was."""
    count = 0
    for body in riders(scene):
        if not body.beyond_mocap_ride.live or body.mode == "EDIT" or body.library is not None:
            continue
        try:
            count += rides.renew(scene, body)
        except BeyondMocapError as error:
            rides.tell(body, str(error))
        except Exception:  # a timer that raises is never called again
            traceback.print_exc()
            rides.tell(body, f"{body.name}: the motion could not be worked out here; see the system console")
    return count


@persistent
def _after_change(_scene, depsgraph):
    if not _seen["dirty"] and any(isinstance(update.id, MATTERS) for update in depsgraph.updates):
        mark()


@persistent
def _after_frame(*_):
    mark()  # an edit that a change of frame brings into force is told by nothing else


@persistent
def _after_undo(*_):
    source.unsure()
    mark()


@persistent
def _after_load(*_):
    rides.forget()
    mark()


def _tick():
    if not _seen["dirty"] or bpy.app.is_job_running("RENDER"):
        return TICK if perf_counter() - _seen["changed"] < QUIET else IDLE
    _seen["dirty"], begun, scenes = False, perf_counter(), set()
    for window in bpy.context.window_manager.windows:
        if window.scene.session_uid not in scenes:
            scenes.add(window.scene.session_uid)
            with bpy.context.temp_override(window=window):
                follow(window.scene)
    return max(TICK, SHARE * (perf_counter() - begun))


HANDLERS = (("undo_post", _after_undo), ("redo_post", _after_undo), ("load_post", _after_load),
            ("depsgraph_update_post", _after_change), ("frame_change_post", _after_frame))
WITH_WINDOW = {"depsgraph_update_post", "frame_change_post"}


def register():
    """Follow from now on; by itself only where there is a window."""
    put_on(HANDLERS, _tick, 0.5, WITH_WINDOW)


def unregister():
    """Follow no more, and forget."""
    take_off(HANDLERS, _tick)
    rides.forget()
