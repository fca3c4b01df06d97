"""Figures of riders: on the path, at their speed, on their feet. Worked out in a thread once a rider is at rest, since
they take longer than a picture while a path is dragged; kept as JSON with the rider."""

from __future__ import annotations

import json
from time import perf_counter

import bpy

from .. import background
from . import riders as rides
from . import source
from .settings import riders

KIND = "path figures"
REST, LOOK, WAIT = 0.8, 0.4, 0.05  # seconds: without a change, between two looks, between two looks at the thread

_measured: dict[int, int] = {}  # by session_uid of the armature: the number of what was measured
_since: dict[int, tuple[int, float]] = {}  # likewise: the number of what is shown, and since when
_running: list[tuple[background.Job, int, int]] = []  # at most one, with the armature's session_uid and the number


def measure(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """Work out a rider's figures at once; nothing happens where it was not brought up to date in this session."""
    shown = rides.shown(body)
    if shown is not None:
        _keep(body, shown.number, _figures(shown, _ground(scene, body)))


def _figures(shown, ground) -> dict:
    from ...beyond_mocap.evaluation.path_ride import figures

    return figures(shown.source, shown.ridden, shown.path, ground)


def _ground(scene: bpy.types.Scene, body: bpy.types.Object):
    ground = body.beyond_mocap_ride.ground
    return source.ground_of(scene, ground, source.ground_digest(ground))


def _keep(body: bpy.types.Object, number: int, figures: dict) -> None:
    ride = body.beyond_mocap_ride
    known = json.loads(ride.figures) if ride.figures else {}
    ride.figures = json.dumps({**known, **figures})
    _measured[body.session_uid] = number


def _tick() -> float:
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None or bpy.app.is_job_running("RENDER"):
        return LOOK
    if _running:
        return _collect(window.scene)
    for body in riders(window.scene):
        shown = rides.shown(body)
        if shown is not None and _rests(body.session_uid, shown.number):
            ground = _ground(window.scene, body)
            job = background.Job(KIND, lambda *_, shown=shown, ground=ground: _figures(shown, ground))
            _running.append((job, body.session_uid, shown.number))
            return WAIT
    return LOOK


def _rests(uid: int, number: int) -> bool:
    """Whether what is shown has been the same for a while, and is not measured yet."""
    if _since.get(uid, (0, 0.0))[0] != number:
        _since[uid] = number, perf_counter()
    return _measured.get(uid) != number and perf_counter() - _since[uid][1] > REST


def _collect(scene: bpy.types.Scene) -> float:
    job, uid, number = _running[0]
    if not job.poll():
        return WAIT
    _running.clear()
    _measured[uid] = number
    body = next((body for body in riders(scene) if body.session_uid == uid), None)
    shown = rides.shown(body) if body is not None else None
    if job.error is None and shown is not None and shown.number == number:
        _keep(body, number, job.result)
    elif job.error is not None:
        print(f"Beyond Mocap: no figures of a ride: {job.error}")
    return LOOK


def register():
    """Measure from now on, where there is a window."""
    if not bpy.app.background:
        bpy.app.timers.register(_tick, first_interval=1.0, persistent=True)


def unregister():
    """Measure no more."""
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    background.stop(KIND)
    for kept in (_measured, _since, _running):
        kept.clear()
