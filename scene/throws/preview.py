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

from ..core import action, background, channels, frame_range, saved_state, session
from ..core.live import Watcher, call_or_describe
from ..core.measure import frames_per_second
from ..rigs import rig_bake
from . import ball_motion as flown
from . import generation as made
from . import rig_throw as rigged
from . import throw_task as order
from .settings import MARK

if TYPE_CHECKING:
    from .generation import ThrowPreview

MOST_LINES = 12
RESULTS = ("made", "made_of", "asked", "rigged", "release", "figures", "messages")

HELD_BY = ("BEYOND_MOCAP_OT_throw_at_target", "BEYOND_MOCAP_OT_kick_at_target")
MODES = ("OBJECT", "POSE")
KIND = "throw again"
WATCHED_TYPES = (bpy.types.Object, bpy.types.Scene)

_state: dict = {"job": None, "begun": {}, "ended": set(), "restored": False}


def show_throw(scene: bpy.types.Scene, body: bpy.types.Object, result: "ThrowPreview") -> None:
    """Show a throw on its armature and its ball."""
    settings, joined, fps = body.beyond_mocap_throw, result.joined, frames_per_second(scene)
    order.check_throw(scene, body)
    flown.check_ball(settings, result)
    if result.library is not None:
        session.store_library(result.library, result.order.unit)
    name, start, messages = f"{body.name} {result.order.action}s", joined.start * fps, []
    if result.order.table:
        messages = rigged.bake_throw(scene, body, result.order.table, motion=joined.motion, start=int(round(start)),
                                     name=result.order.action)
        settings.rigged = True
    else:
        if not settings.before.kept:
            saved_state.save_playback(settings.before, body)
        channels.remove_marked_action(body, MARK)
        action.write_motion(body, joined.motion, scene, start, name, generated=True)[MARK] = True
    messages = [*messages, *flown.show_ball(scene, body, result)]
    last = joined.start + (len(joined.motion) - 1) / fps
    frame_range.extend_range(scene, fps * max(joined.release + result.seconds, last))
    settings.made, settings.release = result.order.action, joined.release * fps
    settings.made_of, settings.asked = result.order.digest, round(result.order.at * fps)
    settings.figures = "\n".join(list_figures(result))
    all_messages = [*result.thrown.warnings, *joined.warnings, *messages]
    settings.messages = "\n".join(list(dict.fromkeys(str(line) for line in all_messages))[:MOST_LINES])


def revert_throw(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """Revert the preview: armature and ball play what they did before, and data created for the throw is removed."""
    settings = body.beyond_mocap_throw
    channels.check_local(body, settings.flown)
    channels.check_editable(body)
    flown.restore_ball(scene, body)
    current_action = channels.find_playing_action(body)[0]
    if settings.rigged and current_action is not None and current_action.get(MARK):
        rigged.remove_throw(body)
    elif settings.before.kept:
        saved_state.restore_playback(settings.before, body, MARK)
    _reset_results(settings)


def apply_throw(body: bpy.types.Object) -> None:
    """Apply the preview: the throw becomes the armature's own motion, its ball a normal object."""
    settings = body.beyond_mocap_throw
    channels.check_local(body, settings.flown)
    current_action = channels.find_playing_action(body)[0]
    if current_action is not None and current_action.get(MARK):
        for name in (MARK, *rig_bake.BAKE_PROPERTIES):
            current_action.pop(name, None)
    saved_state.discard_saved_state(settings.before, MARK)
    flown.apply_ball(body)
    _reset_results(settings)


def list_figures(result: "ThrowPreview") -> list[str]:
    """List lines "name: value" about a throw."""
    thrown, joined, fps = result.thrown, result.joined, result.order.fps
    velocity = thrown.launch.velocity
    speed, level_speed = float(np.linalg.norm(velocity)), float(np.linalg.norm(velocity[:2]))
    elevation = np.degrees(np.arctan2(velocity[2], level_speed))
    limb = "Wrist" if result.order.action == "throw" else "Ankle"
    lines = [f"Release frame: {joined.release * fps:.2f}", f"Ball speed: {speed:.1f} m/s",
             f"Launch angle: {elevation:.0f}\N{DEGREE SIGN}", f"Target error: {100.0 * thrown.impact_error:.1f} cm",
             f"Flight to target: {result.seconds:.2f} s", f"{limb} correction: {100.0 * thrown.displacement:.1f} cm",
             f"Lowest speed: {thrown.min_speed:.1f} m/s"]
    if np.isfinite(result.usual_jerk):
        lines.append(f"Transition jerk: {100.0 * result.jerk / result.usual_jerk:.0f} %")
    return lines


def describe_throw(result: "ThrowPreview") -> str:
    """Describe in a line what one asks of a throw first: how fast the ball is, and how near it comes to the target."""
    thrown = result.thrown
    return (f"the ball leaves at {float(np.linalg.norm(thrown.launch.velocity)):.1f} m/s and passes "
            f"{100.0 * thrown.impact_error:.1f} cm from the target")


def _reset_results(settings) -> None:
    for name in RESULTS:
        settings.property_unset(name)


def find_outdated(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find an armature whose preview is not up to date.

    Each request is started once, also if undo or redo restores it.
    """
    requested = {}
    for body in scene.objects:
        if body.type != "ARMATURE" or body.library is not None:
            continue
        settings = body.beyond_mocap_throw
        if settings.made and settings.live and settings.made_of:
            requested[body.name] = order.build_digest(scene, body, settings.made)
    if _state["restored"]:
        _state["begun"].update(_state["ended"] & requested.items())
        _state["restored"] = False
    for name, digest in requested.items():
        body = scene.objects[name]
        if digest != body.beyond_mocap_throw.made_of and _state["begun"].get(name) != digest:
            _state["begun"][name] = digest
            return body
    return None


def start_update(scene: bpy.types.Scene, body: bpy.types.Object) -> background.Job:
    """Regenerate an armature's throw in a thread, on its present frame."""
    settings = body.beyond_mocap_throw
    task = order.build_request(scene, body, settings.made, settings.frame or settings.asked)
    return background.Job(KIND, lambda *asking: made.generate_throw(task, *asking))


def finish_update(scene: bpy.types.Scene, job: background.Job) -> None:
    """Show a thread's result as an undo step if it is still requested; raise its BeyondMocapError if it failed."""
    if background.is_cancelled(job):
        return
    if job.error is not None:
        raise job.error
    task = job.result.order
    body = scene.objects.get(task.body)
    if body is None or not body.beyond_mocap_throw.made:
        return
    if order.build_digest(scene, body, task.action) == task.digest:
        show_throw(scene, body, job.result)
        _state["ended"].add((body.name, task.digest))
        bpy.ops.ed.undo_push(message=f"Update {body.name} {task.action}")
    elif _state["begun"].get(body.name) == task.digest:  # it may be requested again
        del _state["begun"][body.name]


def process_updates(scene: bpy.types.Scene) -> bool:
    """Show finished results and start due updates; return whether something runs or has to wait."""
    active = bpy.context.view_layer.objects.active
    if active is not None and active.mode not in MODES:  # undo steps contain only the active object in other modes
        return True
    name = _state["job"][0] if _state["job"] else ""
    if _state["job"]:
        uid, job = _state["job"][1:]
        if not job.poll() and not job.is_stale:
            return True
        _state["job"] = None
        if uid != scene.session_uid:
            _state["begun"].pop(name, None)
        else:
            _attempt_update(scene, name, lambda: finish_update(scene, job))
    body = find_outdated(scene)
    if body is not None:
        _attempt_update(scene, body.name,
                        lambda: _state.update(job=(body.name, scene.session_uid, start_update(scene, body))))
    return body is not None


def _attempt_update(scene: bpy.types.Scene, name: str, call) -> None:
    """Call a function; if it fails, show at the armature why its unchanged preview is out of date."""

    def show_message(text: str) -> None:
        body = scene.objects.get(name)
        if body is not None:
            body.beyond_mocap_throw.messages = text

    call_or_describe(call, show_message, f"{name}: the preview cannot be updated")


def note_restored() -> None:
    """Note that undo or redo restored previews, which are not regenerated."""
    _state["restored"] = True


def clear_state() -> None:
    """Clear all state when another file is opened or the extension is disabled."""
    background.cancel_jobs(KIND)
    _state.update(job=None, begun={}, ended=set(), restored=False)


WATCHER = Watcher(name="Throws", watched_types=WATCHED_TYPES, settle=process_updates, busy_operators=HELD_BY,
                  restored=note_restored, loaded=clear_state, ends=clear_state)
