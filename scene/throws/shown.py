"""A throw on its armature and ball; what they did before is put aside and comes back, or the throw is kept. Until then
it follows while its target is dragged and its settings are edited.

Blender says after every change that something has changed; a timer then compares what each throw was made of with what
is asked now, and has it made again in a thread once the hand rests. What comes is a step of undo of its own: actions
and balls are made and removed for it, and Blender may keep pointers to them over an undo that does not know of that.
What undo or redo brings back is not made again, or there would be no way further back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core import action, background, channels, session
from ..core.live import Watcher, attempt
from ..core.measure import frames_per_second
from ..core.set_aside import bring_back, drop, put_aside
from ..result import bake
from ..rigs.rig_bake import BEFORE, KEYS
from ..rigs.rig_bake import MARK as BAKE_MARK
from . import flown, made, order, rigged
from .settings import MARK

if TYPE_CHECKING:
    from .made import Result

MOST_LINES = 12
BAKED = (BAKE_MARK, BEFORE, KEYS)  # what tells a bake that is taken away again
RESULTS = ("made", "made_of", "asked", "rigged", "release", "figures", "told")

HELD_BY = ("BEYOND_MOCAP_OT_throw_at_target", "BEYOND_MOCAP_OT_kick_at_target")
MODES = ("OBJECT", "POSE")
KIND = "throw again"
MATTERS = (bpy.types.Object, bpy.types.Scene)

_seen: dict = {"job": None, "begun": {}, "ended": set(), "restored": False}


def show(scene: bpy.types.Scene, body: bpy.types.Object, result: "Result") -> None:
    """Lay a throw on its armature and its ball."""
    wish, joined, fps = body.beyond_mocap_throw, result.joined, frames_per_second(scene)
    order.check(scene, body)
    flown.check(wish, result)
    if result.library is not None:
        session.keep_library(result.library, result.order.unit)
    name, start, more = f"{body.name} {result.order.act}s", joined.start * fps, []
    if result.order.table:
        more = rigged.lay(scene, body, result.order.table, motion=joined.motion, start=int(round(start)),
                          name=result.order.act)
        wish.rigged = True
    else:
        if not wish.before.kept:
            put_aside(wish.before, body)
        channels.discard(body, MARK)
        action.write(body, joined.motion, scene, start, name, generated=True)[MARK] = True
    more = [*more, *flown.show(scene, body, result)]
    last = joined.start + (len(joined.motion) - 1) / fps
    bake.lengthen(scene, fps * max(joined.release + result.seconds, last))
    wish.made, wish.release = result.order.act, joined.release * fps
    wish.made_of, wish.asked = result.order.digest, round(result.order.at * fps)
    wish.figures = "\n".join(figures(result))
    told = [*result.thrown.warnings, *joined.warnings, *more]
    wish.told = "\n".join(list(dict.fromkeys(str(line) for line in told))[:MOST_LINES])


def leave(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """The armature plays what it did before, and so does its ball; what was made for the throw goes."""
    wish = body.beyond_mocap_throw
    channels.check_local(body, wish.flown)
    channels.check_free(body)
    flown.give_back(scene, body)
    played = channels.playing(body)[0]
    if wish.rigged and played is not None and played.get(MARK):
        rigged.take_away(body)
    elif wish.before.kept:
        bring_back(wish.before, body, MARK)
    _reset(wish)


def keep(body: bpy.types.Object) -> None:
    """The throw stays as the armature's own motion, its ball as an object of the user's."""
    wish = body.beyond_mocap_throw
    channels.check_local(body, wish.flown)
    played = channels.playing(body)[0]
    if played is not None and played.get(MARK):
        for name in (MARK, *BAKED):
            played.pop(name, None)
    drop(wish.before, MARK)
    flown.keep(body)
    _reset(wish)


def figures(result: "Result") -> list[str]:
    """Lines "name: value" about a throw."""
    thrown, joined, fps = result.thrown, result.joined, result.order.fps
    velocity = thrown.launch.velocity
    speed, level = float(np.linalg.norm(velocity)), float(np.linalg.norm(velocity[:2]))
    up = np.degrees(np.arctan2(velocity[2], level))
    limb = "Wrist" if result.order.act == "throw" else "Ankle"
    lines = [f"Leaves on frame: {joined.release * fps:.2f}", f"Leaves with: {speed:.1f} m/s",
             f"Launch angle: {up:.0f}\N{DEGREE SIGN}", f"Passes the target by: {100.0 * thrown.impact_error:.1f} cm",
             f"Flight to the target: {result.seconds:.2f} s", f"{limb} moved to hit: {100.0 * thrown.moved:.1f} cm",
             f"Slowest that gets there: {thrown.slowest:.1f} m/s"]
    if np.isfinite(result.usual_jerk):
        lines.append(f"Seam jerk, of p99: {100.0 * result.jerk / result.usual_jerk:.0f} %")
    return lines


def _reset(wish) -> None:
    for name in RESULTS:
        wish.property_unset(name)


def due(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """An armature whose throw is not as asked; each wish is begun once, also where undo or redo brings it back."""
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
    """Show a thread's result, as a step of undo, where it is still asked for. BeyondMocapError where there is none."""
    if background.cancelled(job):
        return
    if job.error is not None:
        raise job.error
    asked = job.result.order
    body = scene.objects.get(asked.body)
    if body is None or not body.beyond_mocap_throw.made:
        return
    if order.digest(scene, body, asked.act) == asked.digest:
        show(scene, body, job.result)
        _seen["ended"].add((body.name, asked.digest))
        bpy.ops.ed.undo_push(message=f"{body.name} {asked.act}s again")
    elif _seen["begun"].get(body.name) == asked.digest:  # it may be asked for again
        del _seen["begun"][body.name]


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
        _try(scene, body.name, lambda: _seen.update(job=(body.name, scene.session_uid, begin(scene, body))))
    return body is not None


def _try(scene: bpy.types.Scene, name: str, call) -> None:
    """Call it; where that fails, say at an armature why its throw, which stays as it was, is not what is asked for."""

    def tell(text: str) -> None:
        body = scene.objects.get(name)
        if body is not None:
            body.beyond_mocap_throw.told = text

    attempt(call, tell, f"{name}: could not be made again here")


def restored() -> None:
    """What undo or redo brings back is not made again."""
    _seen["restored"] = True


def forget() -> None:
    """Another file is open, or none is looked at any more."""
    background.stop(KIND)
    _seen.update(job=None, begun={}, ended=set(), restored=False)


WATCHER = Watcher(name="Throws", matters=MATTERS, settle=settle, held_by=HELD_BY, restored=restored, loaded=forget,
                  ends=forget)
