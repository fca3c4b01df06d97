"""Preview a throw on its armature and ball, apply or revert it, and update it while target or settings change.

Blender reports after every change that something has changed; a timer then compares the settings of each preview
with the present ones and regenerates it in a thread once the user pauses. The result is an undo step of its own: it
creates and removes actions and balls, and Blender may keep pointers to them over an undo that does not include them.
A preview that undo or redo restores is not regenerated, otherwise earlier steps could not be reached.
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
BAKED = (BAKE_MARK, BEFORE, KEYS)  # custom properties of a bake that can be removed
RESULTS = ("made", "made_of", "asked", "rigged", "release", "figures", "told")

HELD_BY = ("BEYOND_MOCAP_OT_throw_at_target", "BEYOND_MOCAP_OT_kick_at_target")
MODES = ("OBJECT", "POSE")
KIND = "throw again"
MATTERS = (bpy.types.Object, bpy.types.Scene)

_seen: dict = {"job": None, "begun": {}, "ended": set(), "restored": False}


def show(scene: bpy.types.Scene, body: bpy.types.Object, result: "Result") -> None:
    """Show a throw on its armature and its ball."""
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
    """Revert the preview: armature and ball play what they did before, and data created for the throw is removed."""
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
    """Apply the preview: the throw becomes the armature's own motion, its ball a normal object."""
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
    """List lines "name: value" about a throw."""
    thrown, joined, fps = result.thrown, result.joined, result.order.fps
    velocity = thrown.launch.velocity
    speed, level = float(np.linalg.norm(velocity)), float(np.linalg.norm(velocity[:2]))
    up = np.degrees(np.arctan2(velocity[2], level))
    limb = "Wrist" if result.order.act == "throw" else "Ankle"
    lines = [f"Release frame: {joined.release * fps:.2f}", f"Ball speed: {speed:.1f} m/s",
             f"Launch angle: {up:.0f}\N{DEGREE SIGN}", f"Target error: {100.0 * thrown.impact_error:.1f} cm",
             f"Flight to target: {result.seconds:.2f} s", f"{limb} correction: {100.0 * thrown.moved:.1f} cm",
             f"Lowest speed: {thrown.slowest:.1f} m/s"]
    if np.isfinite(result.usual_jerk):
        lines.append(f"Transition jerk: {100.0 * result.jerk / result.usual_jerk:.0f} %")
    return lines


def _reset(wish) -> None:
    for name in RESULTS:
        wish.property_unset(name)


def due(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find an armature whose preview is not up to date.

    Each request is started once, also if undo or redo restores it.
    """
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
    """Regenerate an armature's throw in a thread, on its present frame."""
    wish = body.beyond_mocap_throw
    asked = order.order_of(scene, body, wish.made, wish.frame or wish.asked)
    return background.Job(KIND, lambda *asking: made.work(asked, *asking))


def finish(scene: bpy.types.Scene, job: background.Job) -> None:
    """Show a thread's result as an undo step if it is still requested; raise its BeyondMocapError if it failed."""
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
        bpy.ops.ed.undo_push(message=f"Update {body.name} {asked.act}")
    elif _seen["begun"].get(body.name) == asked.digest:  # it may be requested again
        del _seen["begun"][body.name]


def settle(scene: bpy.types.Scene) -> bool:
    """Show finished results and start due updates; return whether something runs or has to wait."""
    active = bpy.context.view_layer.objects.active
    if active is not None and active.mode not in MODES:  # undo steps contain only the active object in other modes
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
    """Call a function; if it fails, show at the armature why its unchanged preview is out of date."""

    def tell(text: str) -> None:
        body = scene.objects.get(name)
        if body is not None:
            body.beyond_mocap_throw.told = text

    attempt(call, tell, f"{name}: the preview cannot be updated")


def restored() -> None:
    """Note that undo or redo restored previews, which are not regenerated."""
    _seen["restored"] = True


def forget() -> None:
    """Clear all state when another file is opened or the extension is disabled."""
    background.stop(KIND)
    _seen.update(job=None, begun={}, ended=set(), restored=False)


WATCHER = Watcher(name="Throws", matters=MATTERS, settle=settle, held_by=HELD_BY, restored=restored, loaded=forget,
                  ends=forget)
