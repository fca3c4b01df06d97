"""The stream that is received, and the armature that follows the user.

A timer updates it where there is a window; scripts call `update_stream`. What arrives changes nothing but the pose of
the streamed character, which is created with the first frame. The user starts and stops the one listener of the
session; it also stops when a file is loaded or the extension is disabled.
"""

from __future__ import annotations

import statistics
import time
from collections import deque
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.motion import motion as motions
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.passes.stream import bvh_stream, live_hits
from ...beyond_mocap.passes.stream import listener as listening
from ..core import action, window
from ..core.live import Watcher, call_or_describe
from ..core.measure import frames_per_second
from ..result import bake
from ..rigs import armature
from ..stage import body

if TYPE_CHECKING:
    from ...beyond_mocap.motion.skeleton import Skeleton
    from ...beyond_mocap.passes.hits import HitMotion

TICK, IDLE = 1.0 / 60.0, 0.25  # s between two timer calls, with and without a stream
STATUS_SECONDS, DETECT_SECONDS = 0.25, 0.05  # s between two status updates, and two hit detections
MOST_BODIES = 20  # characters created in one stream: a sender that keeps changing its skeleton is stopped

MARK = "beyond_mocap_stream"
SHIRT = (0.55, 0.55, 0.58)

_session: dict[str, object] = {}
_state = {"seen": 0, "written": 0.0, "looked": 0.0, "bodies": 0}
_latencies: deque[float] = deque(maxlen=60)
_on_hit: list = []
_on_look: list = []


def add_hit_call(call) -> None:
    """Call `call(scene, hit, seconds)` for every detected strike, until `remove_call`."""
    _on_hit.append(call)


def add_update_call(call) -> None:
    """Call `call(scene)` at every update, until `remove_call`."""
    _on_look.append(call)


def remove_call(call) -> None:
    """Stop calling `call`."""
    for calls in (_on_hit, _on_look):
        if call in calls:
            calls.remove(call)


def reset_status() -> None:
    """Reset the status for a stream that has started."""
    _state.update(seen=0, written=0.0, looked=0.0, bodies=0)
    _latencies.clear()
    write_status()


def update_stream(scene: bpy.types.Scene) -> HitMotion | None:
    """Show what has arrived in a scene, update the status, and return the strike that was just detected, if any."""
    listener = get_current_listener()
    found = _receive_frames(scene, listener) if listener is not None else None
    for call in list(_on_look):
        call(scene)
    return found


def _receive_frames(scene: bpy.types.Scene, listener: listening.Listener) -> HitMotion | None:
    """Pose the character by the latest frame, detect hits, and update the status."""
    now = time.monotonic()
    latest = listener.latest_frame()
    if latest is not None and latest.number != _state["seen"]:
        _state["seen"] = latest.number
        if _show_frame(scene, latest) == "posed":
            _latencies.append(time.monotonic() - (latest.time if latest.sent is None else latest.sent))
        if get_current_listener() is None:  # the stream has been stopped
            return None
    found = None
    if now - _state["looked"] >= DETECT_SECONDS:
        _state["looked"] = now
        found = _detect_hit(scene)
    if now - _state["written"] >= STATUS_SECONDS:
        _state["written"] = now
        write_status()
    return found


def _show_frame(scene, latest) -> str:
    """Pose the streamed character.

    Returns:
        "posed", "made" if it was created first, or "" if it could not be created.
    """
    settings, (skeleton, root, rotations) = scene.beyond_mocap_stream, listening.convert_poses([latest])
    result = "posed"
    if not can_show(settings.body, scene, skeleton):
        if _state["bodies"] >= MOST_BODIES:
            _give_up(f"The skeleton has changed {MOST_BODIES} times, so the stream is stopped: check the sender")
            return ""
        _state["bodies"] += 1
        settings.body = create_body(bpy.context, motions.Motion(skeleton, root, rotations, 60.0))
        # one undo step, so that undo does not remove the new character silently
        if not bpy.app.background:
            bpy.ops.ed.undo_push(message="Streamed Character")
        result = "made"
    pose_body(settings.body, scene, skeleton, root[0], rotations[0])
    return result


def _detect_hit(scene) -> HitMotion | None:
    """Detect a strike, show it in the panel and pass it on."""
    try:
        found = _session["hits"].find_new_hit()
    except BeyondMocapError as error:
        bpy.context.window_manager.beyond_mocap_streaming.hit = str(error)
        return None
    if found is None:
        return None
    hit, seconds = found
    side = f"{hit.side} " if hit.side else ""
    bpy.context.window_manager.beyond_mocap_streaming.hit = f"{side}{hit.part}, {hit.max_speed:.1f} m/s"
    for call in list(_on_hit):
        call(scene, hit, seconds)
    return hit


def write_status() -> None:
    """Write the status of the stream for the panel."""
    status_texts, listener = bpy.context.window_manager.beyond_mocap_streaming, get_current_listener()
    if listener is None:
        status_texts.on, status_texts.state, status_texts.line, status_texts.figures = False, "stopped", "", ""
        return
    status = listener.measure_status()
    lines = [f"Frames: {status.frames}", f"Frame Rate: {status.rate:.0f}"]
    if _latencies and status.state == "receiving":
        latency_name = "Latency" if status.delay is not None else "Latency, from Arrival"
        lines.append(f"{latency_name}: {1000.0 * statistics.median(_latencies):.0f} ms")
    if status.invalid_count:
        lines.append(f"Invalid Pieces: {status.invalid_count}")
    status_texts.on, status_texts.state, status_texts.line = True, status.state, status.line
    status_texts.figures = "\n".join(lines)


def _give_up(reason: str) -> None:
    """Stop the stream because of an error; its message stays."""
    stop_listening()
    write_status()
    status_texts = bpy.context.window_manager.beyond_mocap_streaming
    status_texts.state, status_texts.line = "failed", reason


def _run_timer() -> float:
    """Update the stream, and return the seconds until the next call."""
    if get_current_listener() is None and not _on_look:
        if bpy.context.window_manager.beyond_mocap_streaming.on:
            write_status()
            window.redraw_editors()
        return IDLE
    if bpy.app.is_job_running("RENDER"):
        return IDLE
    before = (status_texts := bpy.context.window_manager.beyond_mocap_streaming).figures, status_texts.played
    for shown in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=shown):
            call_or_describe(lambda: update_stream(shown.scene), _give_up, "The stream has stopped because of an error")
    status_texts = bpy.context.window_manager.beyond_mocap_streaming
    if (status_texts.figures, status_texts.played) != before:
        window.redraw_editors()
    return TICK


def _end_session() -> None:
    stop_listening()
    _on_hit.clear()
    _on_look.clear()


def start_listening(settings) -> listening.Listener:
    """Start to listen as the settings say.

    Raises:
        InputError: if a stream is received already, the port is in use, or the suit's file is no BVH file; nothing is
        changed then.
    """
    clip = bpy.path.abspath(settings.clip) if settings.clip else ""
    hierarchy = bvh_stream.read_hierarchy(clip) if clip else None
    before = get_current_listener()
    if before is not None:
        raise InputError(f"port {before.port}", "a stream is already received", "one at a time", "press Stop Stream",
                         fixes=(Fix("press", "beyond_mocap.stream_stop"),))
    one = listening.Listener(settings.port, settings.protocol, hierarchy, settings.unit or None).start()
    _session["listener"] = one
    _session["hits"] = live_hits.LiveHits(one, settings.part, "" if settings.side == "either" else settings.side,
                                settings.threshold or None)
    return one


def stop_listening() -> None:
    """Stop listening."""
    one = _session.pop("listener", None)
    _session.clear()
    if one is not None:
        one.stop()


def get_current_listener() -> listening.Listener | None:
    """The listener of the session, or None."""
    return _session.get("listener")


WATCHER = Watcher(name="Stream", look=_run_timer, closing=stop_listening, ends=_end_session)


def can_show(thing: bpy.types.Object | None, scene: bpy.types.Scene, skeleton: Skeleton) -> bool:
    """Whether an object can show this skeleton: an armature of the scene and file with a bone for every joint."""
    return (
        thing is not None and thing.type == "ARMATURE" and thing.library is None and thing.name in scene.objects
        and all(name in thing.data.bones for name in skeleton.names)
    )


def create_body(context: bpy.types.Context, motion: motions.Motion, name: str = "Stream") -> bpy.types.Object:
    """Create a character with the skeleton of `motion`."""
    where = bake.find_or_create_collection(context.scene)
    thing = armature.create_armature(context, motion.skeleton, name, where)
    body.create_character(thing, name, SHIRT, collection=where, scene=context.scene, example=motion)
    thing[MARK] = True
    return thing


def pose_body(
    thing: bpy.types.Object, scene: bpy.types.Scene, skeleton: Skeleton, root: np.ndarray, local: np.ndarray
) -> None:
    """Pose an armature.

    Its location and its rotation about the vertical are left to the user, so that it can stand beside other characters.

    Args:
        thing: the armature.
        scene: the scene.
        skeleton: skeleton of the pose.
        root: (3,) m, root position.
        local: (J, 4) local rotations.
    """
    placement, rest = armature.find_current_placement(thing, scene), armature.compute_rest_rotations(thing,
            skeleton.names)
    # the object's rotation about the vertical turns the streamed motion with it
    turn = quaternion.from_up_angle(quaternion.to_yaw(placement.rotation))
    root, local = placement.origin + quaternion.rotate(turn, root), np.array(local)
    local[0] = quaternion.multiply(quaternion.inverse(placement.rotation), quaternion.multiply(turn, local[0]))
    # pose rotations are relative to the bones' rest rotations
    pose_rotations = quaternion.multiply(quaternion.inverse(rest), quaternion.multiply(local, rest))
    bones = thing.pose.bones
    all_rotations = np.empty((len(bones), 4), np.float32)
    bones.foreach_get("rotation_quaternion", all_rotations.ravel())
    all_rotations[[bones.find(name) for name in skeleton.names]] = pose_rotations
    bones.foreach_set("rotation_quaternion", all_rotations.ravel())
    top = bones[skeleton.names[0]]
    shift = placement.to_armature(root) - np.array(top.bone.head_local)
    top.location = quaternion.rotate(quaternion.inverse(rest[0]), shift)  # assigning also makes Blender update


def keep_recording(context: bpy.types.Context, motion: motions.Motion, name: str = "Recorded") -> bpy.types.Object:
    """Create a character that plays `motion` from the current frame on."""
    if motion.duration * frames_per_second(context.scene) < 1.0:
        raise InputError("stream", "less than a frame", "a second or more", "let the stream run for a while")
    thing = create_body(context, motion, name)
    action.write_motion(thing, motion, context.scene, float(context.scene.frame_current), f"{thing.name} motion")
    return thing
