"""Aimed balls follow while their target is dragged and their settings or bodies are edited.

Blender says after every change that something has changed; a timer, which runs during modal operators too, then
compares what each ball's way was made of with what there is now. Our own writes are such changes too, and find nothing
to do. What cannot be hit just now is told at the ball, which keeps its last way.
"""

from __future__ import annotations

import traceback
from time import perf_counter

import bpy
from bpy.app.handlers import persistent

from ...beyond_mocap.errors import BeyondMocapError
from .. import channels
from ..handlers import put_on, take_off
from . import shots
from .settings import MARK, aimed

TICK, IDLE = 0.01, 0.1  # seconds between two looks: after a change, and while nothing happens
QUIET = 0.5  # seconds after the last change in which looks are frequent
SHARE = 0.3  # of the time that a look has taken is left to the window before the next one

_seen = {"dirty": True, "changed": 0.0}


def mark() -> None:
    """Something has changed that may matter."""
    _seen["dirty"], _seen["changed"] = True, perf_counter()


def follow(scene: bpy.types.Scene) -> int:
    """Bring all live balls of a scene up to date; of how many there is anything new."""
    count = 0
    for ball in aimed(scene):
        aim = ball.beyond_mocap_aim
        if not aim.live or aim.handed or ball.library is not None:
            continue
        try:
            count += renew(scene, ball)
        except BeyondMocapError as error:
            count += tell(ball, str(error))
        except Exception:  # a timer that raises is never called again
            traceback.print_exc()
            tell(ball, f"{ball.name}: could not be aimed here; see the system console")
    return count


def renew(scene: bpy.types.Scene, ball: bpy.types.Object) -> bool:
    """Aim a ball again where what its way was made of is another than it was; whether it was."""
    wish, known = shots.wish_of(scene, ball), shots.solved_of(ball)
    made_of = shots.digest(wish, shots.strikes_of(scene, wish))
    played = channels.playing(ball)[0]
    written = played.get(MARK) if played is not None else None
    if known is not None and known.digest == made_of == written:
        return tell(ball, "")
    solved = shots.solve(scene, wish, ball.name)
    if made_of == written:  # another session has written it: only what is drawn is lacking
        shots.remember(ball, solved)
        return False
    shots.write(scene, ball, solved)
    return True


def tell(ball: bpy.types.Object, text: str) -> bool:
    """Say at the ball what is wrong; whether that is new."""
    new = ball.beyond_mocap_aim.told != text
    if new:
        ball.beyond_mocap_aim.told = text
    return new


def redraw() -> None:
    """Let all 3D views be drawn again: what is drawn over them is no data that Blender watches."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


@persistent
def _after_change(scene, depsgraph):
    if not shots.anything():
        return
    bodies = {ball.beyond_mocap_aim.body for ball in aimed(scene)}
    for update in depsgraph.updates:
        thing = update.id.original
        if isinstance(thing, bpy.types.Action):
            if not thing.get(MARK):
                shots.unsure()
                mark()
        elif isinstance(thing, bpy.types.Object):
            if thing in bodies:
                shots.unsure(thing)
            mark()
        elif isinstance(thing, (bpy.types.Armature, bpy.types.Scene)):
            mark()


@persistent
def _after_undo(*_):
    shots.unsure()
    mark()


@persistent
def _after_load(*_):
    shots.forget()
    mark()


def _tick():
    if not _seen["dirty"] or bpy.app.is_job_running("RENDER"):
        return TICK if perf_counter() - _seen["changed"] < QUIET else IDLE
    _seen["dirty"], begun, scenes = False, perf_counter(), set()
    for window in bpy.context.window_manager.windows:
        if window.scene.session_uid not in scenes:
            scenes.add(window.scene.session_uid)
            with bpy.context.temp_override(window=window):
                if follow(window.scene):
                    redraw()
    return max(TICK, SHARE * (perf_counter() - begun))


HANDLERS = (("undo_post", _after_undo), ("redo_post", _after_undo), ("load_post", _after_load),
            ("depsgraph_update_post", _after_change))


def register():
    """Follow from now on; by itself only where there is a window."""
    put_on(HANDLERS, _tick, 0.5, with_window={"depsgraph_update_post"})


def unregister():
    """Follow no more, and forget."""
    take_off(HANDLERS, _tick)
    shots.forget()
