"""Riders follow while curves, settings and grounds are edited, also while a point is being dragged; once at rest, their
figures are worked out.

Blender says after every change that something has changed; a timer, which runs during modal operators too, then
compares what each rider's motion was made of with what there is now. Our own writes are such changes too, and find
nothing to do. An edit from a timer is no undo step: undo brings back the state before, and riders are brought up to
date with that. Figures (on the path, at their speed, on their feet) take longer than a picture while a path is dragged,
so a thread works them out; they are kept as JSON with the rider.
"""

from __future__ import annotations

import json
from functools import partial
from time import perf_counter

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError
from ..core import background
from ..core.live import Watcher, attempt
from . import curve
from . import riders as rides
from .carrier import recheck_sources
from .settings import riders

MATTERS = (bpy.types.Object, bpy.types.Curve, bpy.types.Mesh, bpy.types.Armature, bpy.types.Action, bpy.types.Scene)
KIND = "path figures"
REST, LOOK, WAIT = 0.8, 0.4, 0.05  # seconds: without a change, between two looks, between two looks at the thread
KNOWN = '"root_error_m"'  # in the figures of a rider that was measured

_failed: dict[int, int] = {}  # by session_uid of the armature: the number of what could not be measured
_since: dict[int, tuple[int, float]] = {}  # likewise: the number of what is shown, and since when
_running: list[tuple[background.Job, int, int]] = []  # at most one, with the armature's session_uid and the number


def follow(scene: bpy.types.Scene) -> int:
    """Bring all live riders of a scene up to date; how many had to be. Those that cannot follow are told why."""
    count = 0
    for body in riders(scene):
        if not body.beyond_mocap_ride.live or body.mode == "EDIT" or body.library is not None:
            continue
        failed = f"{body.name}: the motion could not be worked out here"
        count += bool(attempt(lambda: rides.renew(scene, body), partial(rides.tell, body.beyond_mocap_ride), failed))
    return count


def measure(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """Work out a rider's figures at once; nothing happens where it was not brought up to date in this session."""
    shown = rides.shown(body)
    if shown is not None:
        _keep(body, _figures(shown, _ground(scene, body)))


def _figures(shown, ground) -> dict:
    from ...beyond_mocap.path_editing.path_ride import figures

    return figures(shown.source, shown.ridden, shown.path, ground)


def _ground(scene: bpy.types.Scene, body: bpy.types.Object):
    ground = body.beyond_mocap_ride.ground
    return curve.ground_of(scene, ground, curve.ground_digest(scene, ground))


def _keep(body: bpy.types.Object, figures: dict) -> None:
    """Beside those that are known while a path is dragged."""
    ride = body.beyond_mocap_ride
    ride.figures = json.dumps({**(json.loads(ride.figures) if ride.figures else {}), **figures})


def _tick() -> float:
    if bpy.app.is_job_running("RENDER"):
        return LOOK
    if _running:
        return _collect()
    window, waiting = next(((window, body) for window, body in _seen() if _waits(body)), (None, None))
    if waiting is None:
        return LOOK
    shown = rides.shown(waiting)
    try:
        with bpy.context.temp_override(window=window):  # a timer has none, and the ground is the window's
            ground = _ground(window.scene, waiting)
    except BeyondMocapError:  # told where the rider is brought up to date
        _failed[waiting.session_uid] = shown.number
        return LOOK
    _running.append((background.Job(KIND, lambda *_: _figures(shown, ground)), waiting.session_uid, shown.number))
    return WAIT


def _seen() -> list[tuple[bpy.types.Window, bpy.types.Object]]:
    """The riders of all windows' scenes."""
    return [(window, body) for window in bpy.context.window_manager.windows for body in riders(window.scene)]


def _waits(body: bpy.types.Object) -> bool:
    """Whether what is shown of a rider has been the same for a while, and is not measured."""
    shown, uid = rides.shown(body), body.session_uid
    if shown is None or KNOWN in body.beyond_mocap_ride.figures or _failed.get(uid) == shown.number:
        return False
    if _since.get(uid, (0, 0.0))[0] != shown.number:
        _since[uid] = shown.number, perf_counter()
    return perf_counter() - _since[uid][1] > REST


def _collect() -> float:
    job, uid, number = _running[0]
    if not job.poll():
        return WAIT
    _running.clear()
    body = next((body for _, body in _seen() if body.session_uid == uid), None)
    shown = rides.shown(body) if body is not None else None
    if job.error is not None:
        _failed[uid] = number
        print(f"Beyond Mocap: no figures of a ride: {job.error}")
    elif shown is not None and shown.number == number:
        _keep(body, job.result)
    return LOOK


def forget() -> None:
    """Measure no more."""
    background.stop(KIND)
    for kept in (_failed, _since, _running):
        kept.clear()


WATCHER = Watcher(
    name="Path editing", matters=MATTERS, follow=follow, restored=recheck_sources, loaded=rides.forget,
    ends=rides.forget,
    framed=lambda _scene: WATCHER.mark(),  # an edit that a change of frame brings into force is told by nothing else
)
FIGURES = Watcher(name="Figures of path editing", look=_tick, ends=forget)
