"""Keeps the streamed body, the figures and what is made of hits up to date: from a timer where there is a window, from
scripts by calling `look`.

What arrives never changes anything but the streamed body's pose. It is made when its first frame is here.
"""

from __future__ import annotations

import statistics
import time
from collections import deque

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError
from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.passes.hits import HitMotion
from ...beyond_mocap.passes.stream.listener import Listener, poses
from ..core import window
from ..core.live import Watcher, attempt
from . import receiver, streamed

TICK, IDLE = 1.0 / 60.0, 0.25
TOLD_EVERY = 0.25
LOOKED_EVERY = 0.1
MOST_BODIES = 20
"""Streamed bodies that a session makes: a sender that changes its skeleton again and again is stopped."""

_state = {"seen": 0, "told": 0.0, "looked": 0.0, "bodies": 0, "windowed": False}
_shown: deque[float] = deque(maxlen=60)
_on_hit: list = []
_on_look: list = []


def on_hit(action) -> None:
    """`action(scene, hit, seconds)` is called for every strike that is recognised, until `forget`."""
    _on_hit.append(action)


def on_look(action) -> None:
    """`action(scene)` is called at every look, until `forget`."""
    _on_look.append(action)


def forget(action) -> None:
    """Call it no more."""
    for actions in (_on_hit, _on_look):
        if action in actions:
            actions.remove(action)


def began() -> None:
    """A stream has been started."""
    _state.update(seen=0, told=0.0, looked=0.0, bodies=0)
    _shown.clear()
    tell()


def look(scene: bpy.types.Scene) -> HitMotion | None:
    """Show what has arrived in a scene, tell how it does, and say which strike has just been recognised, if any."""
    listener, found = receiver.listener(), None
    if listener is not None:
        found = _receive(scene, listener)
    for action in list(_on_look):
        action(scene)
    return found


def _receive(scene: bpy.types.Scene, listener: Listener) -> HitMotion | None:
    now = time.monotonic()
    latest = listener.latest()
    if latest is not None and latest.number != _state["seen"]:
        _state["seen"] = latest.number
        if _show(scene, listener, latest) == "posed":
            _shown.append(time.monotonic() - (latest.time if latest.sent is None else latest.sent))
        if receiver.listener() is None:  # given up
            return None
    found = None
    if now - _state["looked"] >= LOOKED_EVERY:
        _state["looked"] = now
        found = _hit(scene)
    if now - _state["told"] >= TOLD_EVERY:
        _state["told"] = now
        tell()
    return found


def _show(scene, listener: Listener, latest) -> str:
    """Pose the streamed body: "posed", "made" where it had to be made first, "" where it could not be."""
    settings, (skeleton, root, rotations) = scene.beyond_mocap_stream, poses([latest])
    made = "posed"
    if not streamed.fits(settings.body, scene, skeleton):
        if _state["bodies"] >= MOST_BODIES:
            _give_up(f"The skeleton has changed {MOST_BODIES} times, so the stream is left: look at the sender")
            return ""
        _state["bodies"] += 1
        settings.body = streamed.create(bpy.context, Motion(skeleton, root, rotations, 60.0))
        if not bpy.app.background:
            bpy.ops.ed.undo_push(message="Streamed Body")
        made = "made"
    streamed.pose(settings.body, scene, skeleton, root[0], rotations[0])
    return made


def _hit(scene) -> HitMotion | None:
    watch = receiver.hits()
    try:
        found = watch.look()
    except BeyondMocapError as error:
        bpy.context.window_manager.beyond_mocap_streaming.hit = str(error)
        return None
    if found is None:
        return None
    hit, seconds = found
    side = f"{hit.side} " if hit.side else ""
    bpy.context.window_manager.beyond_mocap_streaming.hit = f"{side}{hit.part}, {hit.max_speed:.1f} m/s"
    for action in list(_on_hit):
        action(scene, hit, seconds)
    return hit


def tell() -> None:
    """Write down for the panel how the stream does."""
    told, listener = bpy.context.window_manager.beyond_mocap_streaming, receiver.listener()
    if listener is None:
        told.on, told.state, told.line, told.figures = False, "stopped", "", ""
        return
    status = listener.status()
    lines = [f"Frames: {status.frames}", f"Frames a Second: {status.rate:.0f}"]
    if _shown and status.state == "receiving":
        what = "Latency" if status.way is not None else "Latency, from Arrival"
        lines.append(f"{what}: {1000.0 * statistics.median(_shown):.0f} ms")
    if status.rubbish:
        lines.append(f"Left Out: {status.rubbish}")
    told.on, told.state, told.line, told.figures = True, status.state, status.line, "\n".join(lines)


def _give_up(why: str) -> None:
    """The stream ends by itself; what is told stays."""
    receiver.stop()
    tell()
    told = bpy.context.window_manager.beyond_mocap_streaming
    told.state, told.line = "failed", why


def _tick() -> float:
    if receiver.listener() is None and not _on_look:
        if bpy.context.window_manager.beyond_mocap_streaming.on:
            tell()
            window.redraw()
        return IDLE
    if bpy.app.is_job_running("RENDER"):
        return IDLE
    before = (told := bpy.context.window_manager.beyond_mocap_streaming).figures, told.played
    for shown in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=shown):
            attempt(lambda: look(shown.scene), _give_up, "The stream has ended by an error")
    told = bpy.context.window_manager.beyond_mocap_streaming
    if (told.figures, told.played) != before:
        window.redraw()
    return TICK


def _end() -> None:
    _on_hit.clear()
    _on_look.clear()


WATCHER = Watcher(name="Stream", look=_tick, ends=_end)
