"""Live updates: edited bodies follow while curves, settings and grounds are edited; at rest, their figures are
measured.

Blender reports that something has changed after every change; a timer, which runs during modal operators too, then
compares the inputs of each path edit with the present ones. Our own writes are such changes too, and lead to no work.
An edit from a timer is no undo step: undo restores the state before, and edited bodies are updated to that. Figures
(distance, speed, feet) take longer than one redraw while a path is dragged, so a thread computes them; they are stored
as JSON with the armature.
"""

from __future__ import annotations

import json
from functools import partial
from time import perf_counter

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError
from ..core import background
from ..core.live import Watcher, call_or_describe
from . import armature_adapter, curve, edited_bodies
from .settings import list_edited_bodies

MATTERS = (bpy.types.Object, bpy.types.Curve, bpy.types.Mesh, bpy.types.Armature, bpy.types.Action, bpy.types.Scene)
KIND = "path figures"
REST, LOOK, WAIT = 0.8, 0.4, 0.05  # seconds: without a change before measuring, between two checks, during a job
KNOWN = '"root_error_m"'  # in the figures of a body that was measured

_failed: dict[int, int] = {}  # by session_uid of the armature: number of the edit that could not be measured
_since: dict[int, tuple[int, float]] = {}  # likewise: number of the current edit, and since when
_running: list[tuple[background.Job, int, int]] = []  # at most one, with the armature's session_uid and the number


def update_all(scene: bpy.types.Scene) -> int:
    """Update all live edited bodies of a scene; returns how many changed. Errors become messages of the body."""
    count = 0
    for body in list_edited_bodies(scene):
        if not body.beyond_mocap_ride.live or body.mode == "EDIT" or body.library is not None:
            continue
        failed = f"{body.name}: the motion cannot be computed"
        count += bool(call_or_describe(lambda: edited_bodies.update_motion(scene, body),
                                       partial(edited_bodies.store_messages, body.beyond_mocap_ride), failed))
    return count


def measure_body(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """Measure an edited body at once; nothing happens if this session has not computed it."""
    computed = edited_bodies.find_computed_edit(body)
    if computed is not None:
        _store_figures(body, _measure_edit(computed, _load_ground(scene, body)))


def _measure_edit(computed, ground) -> dict:
    from ...beyond_mocap.path_editing.path_metrics import measure_path_edit

    return measure_path_edit(computed.source, computed.edited, computed.path, ground)


def _load_ground(scene: bpy.types.Scene, body: bpy.types.Object):
    ground = body.beyond_mocap_ride.ground
    return curve.load_ground(scene, ground, curve.compute_ground_digest(scene, ground))


def _store_figures(body: bpy.types.Object, figures: dict) -> None:
    """Store figures beside those that are computed while a path is dragged."""
    edit = body.beyond_mocap_ride
    edit.figures = json.dumps({**(json.loads(edit.figures) if edit.figures else {}), **figures})


def _run_timer() -> float:
    """Check once: start to measure a body at rest, or collect a result; returns the seconds until the next check."""
    if bpy.app.is_job_running("RENDER"):
        return LOOK
    if _running:
        return _collect_result()
    window, waiting = next(((window, body) for window, body in _list_visible_bodies() if _is_waiting(body)),
                           (None, None))
    if waiting is None:
        return LOOK
    computed = edited_bodies.find_computed_edit(waiting)
    try:
        with bpy.context.temp_override(window=window):  # a timer has none, and the ground is the window's
            ground = _load_ground(window.scene, waiting)
    except BeyondMocapError:  # reported where the body is updated
        _failed[waiting.session_uid] = computed.number
        return LOOK
    _running.append((background.Job(KIND, lambda *_: _measure_edit(computed, ground)), waiting.session_uid,
                     computed.number))
    return WAIT


def _list_visible_bodies() -> list[tuple[bpy.types.Window, bpy.types.Object]]:
    """List the edited bodies of the scenes of all windows."""
    return [(window, body) for window in bpy.context.window_manager.windows
            for body in list_edited_bodies(window.scene)]


def _is_waiting(body: bpy.types.Object) -> bool:
    """Return whether an edited body has been at rest for a while and is not measured."""
    computed, uid = edited_bodies.find_computed_edit(body), body.session_uid
    if computed is None or KNOWN in body.beyond_mocap_ride.figures or _failed.get(uid) == computed.number:
        return False
    if _since.get(uid, (0, 0.0))[0] != computed.number:
        _since[uid] = computed.number, perf_counter()
    return perf_counter() - _since[uid][1] > REST


def _collect_result() -> float:
    """Store the result of a finished job if its body has not changed since."""
    job, uid, number = _running[0]
    if not job.poll():
        return WAIT
    _running.clear()
    body = next((body for _, body in _list_visible_bodies() if body.session_uid == uid), None)
    computed = edited_bodies.find_computed_edit(body) if body is not None else None
    if job.error is not None:
        _failed[uid] = number
        print(f"Beyond Mocap: cannot measure a path edit: {job.error}")
    elif computed is not None and computed.number == number:
        _store_figures(body, job.result)
    return LOOK


def stop_measuring() -> None:
    """Stop measuring."""
    background.cancel_jobs(KIND)
    for table in (_failed, _since, _running):
        table.clear()


WATCHER = Watcher(
    name="Path editing", watched_types=MATTERS, follow=update_all,
    restored=lambda: armature_adapter.invalidate_sources(),
    loaded=lambda: edited_bodies.clear_caches(), ends=lambda: edited_bodies.clear_caches(),
    framed=lambda _scene: WATCHER.mark_dirty(),  # the only report of edits that take effect with a change of frame
)
FIGURES = Watcher(name="Figures of path editing", look=_run_timer, ends=stop_measuring)
