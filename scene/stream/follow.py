"""The streams that are received, and the armatures that follow their users.

A timer updates them where there is a window; scripts call `update_streams`. Strikes are detected in a thread for each
stream, and also taken before each frame of a playback is evaluated. What arrives changes nothing but the pose
of each stream's character, which is created with the first frame. The user starts and stops each stream; all stop when
a file is loaded or the extension is disabled, and one that an undo has removed stops as well.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ...beyond_mocap.motion import motion as motions
from ...beyond_mocap.passes.stream import bvh_stream, live_hits
from ...beyond_mocap.passes.stream import listener as listening
from ..core import window
from ..core.live import Watcher, call_or_describe
from . import streamed_body
from .settings import find_status, find_stream, get_key, list_statuses, list_streams

if TYPE_CHECKING:
    from ...beyond_mocap.passes.hits import HitMotion
    from .settings import StreamSettings, StreamStatus

TICK, IDLE = 1.0 / 60.0, 0.25  # s between two timer calls, with and without a stream
STATUS_SECONDS = 0.25  # s between two status updates
_HOLD_SECONDS = 0.002  # s between two looks of a thread that waits
MOST_BODIES = 20  # characters created in one stream: a sender that keeps changing its skeleton is stopped


@dataclass(eq=False, repr=False, kw_only=True)
class ReceivedStream:
    """A stream that is received.

    Attributes:
        key: the stream's scene and number, as `settings.get_key`.
        listener: receives its frames.
        hits: detects strikes in them.
        seen: number of the last frame that was shown.
        written: number of the quarter second of the last status update, so that all streams share one redraw.
        bodies: characters created.
        latencies: s from sender to pose, of the last frames.
    """

    key: tuple[int, int]
    listener: listening.Listener
    hits: live_hits.LiveHits
    seen: int = 0
    written: int = 0
    bodies: int = 0
    latencies: deque[float] = field(default_factory=lambda: deque(maxlen=60))


_streams: dict[tuple[int, int], ReceivedStream] = {}
_on_hit: list = []
_on_update: list = []
_on_frame: list = []
_skips = {"update": False}


def add_hit_call(call) -> None:
    """Call `call(scene, stream, hit, seconds)` for every detected strike, until `remove_call`."""
    _on_hit.append(call)


def add_update_call(call) -> None:
    """Call `call(scene)` at every update, until `remove_call`."""
    _on_update.append(call)


def add_frame_call(call) -> None:
    """Call `call(scene)` after each change of frame, before it is evaluated, until `remove_call`."""
    _on_frame.append(call)


def skip_update() -> None:
    """Leave out the timer's next update, which comes before the drawing for which the user waits."""
    _skips["update"] = True


def remove_call(call) -> None:
    """Stop calling `call`."""
    for calls in (_on_hit, _on_update, _on_frame):
        if call in calls:
            calls.remove(call)


def start_listening(stream: StreamSettings) -> listening.Listener:
    """Start to receive a stream as its settings say.

    Raises:
        InputError: if it is received already, its port, player or armature is that of another stream, the port is in
        use, or the suit's file is no BVH file; nothing is changed then.
    """
    clip = bpy.path.abspath(stream.clip) if stream.clip else ""
    hierarchy = bvh_stream.read_hierarchy(clip) if clip else None
    _check_can_start(stream)
    one = listening.Listener(stream.port, stream.protocol, hierarchy, stream.unit or None).start()
    hits = live_hits.LiveHits(one, stream.part, "" if stream.side == "either" else stream.side,
                              stream.threshold or None)
    key = get_key(stream)
    _streams[key] = ReceivedStream(key=key, listener=one, hits=hits.start())
    write_status(key)
    return one


def _check_can_start(stream: StreamSettings) -> None:
    """Raise an InputError if a stream is received already, or shares player, armature or port with one that is."""
    where = f"stream {stream.number}"
    if get_key(stream) in _streams:
        raise InputError(where, "is already received", "one that is stopped", "press Stop Stream")
    for other in list_received(stream.id_data):
        if stream.player and other.player == stream.player:
            raise InputError(where, f"{stream.player} already repeats the strikes of stream {other.number}",
                             "another player", "choose one under Player, or none")
        if stream.body is not None and other.body == stream.body:
            raise InputError(where, f"armature {stream.body.name} follows stream {other.number}",
                             "an armature of its own", "choose another one under Streamed Body, or none")
    for (scene, number), received in _streams.items():
        listener = received.listener
        if listener.port == stream.port and (listener.protocol == "udp") == (stream.protocol == "udp"):
            other = f"stream {number}" + " of another scene" * (scene != stream.id_data.session_uid)
            raise InputError(where, f"{other} receives on port {stream.port}", "a port of its own",
                             "choose another port, here and in the sender")


def stop_listening(key: tuple[int, int] | None = None) -> None:
    """Stop receiving a stream; None: all."""
    for one in [one for one in _streams if key in (None, one)]:
        _streams.pop(one).listener.stop()


def find_listener(scene: bpy.types.Scene, number: int = 1) -> listening.Listener | None:
    """Find what receives a stream; None if it is not received."""
    received = _streams.get((scene.session_uid, number))
    return None if received is None else received.listener


def list_received(scene: bpy.types.Scene) -> list[StreamSettings]:
    """List the streams of a scene that are received."""
    return [stream for stream in list_streams(scene) if get_key(stream) in _streams]


def check_players(scene: bpy.types.Scene) -> None:
    """Raise an InputError if the player of a stream that is received is not in the passing scene."""
    names = [row.name for row in scene.beyond_mocap_passes.players]
    for stream in list_received(scene):
        if stream.player and stream.player not in names:
            raise InputError(f"stream {stream.number}", f"no player {stream.player!r} in the passing scene",
                             f"one of {', '.join(names)}", "press Stop Stream, and choose one under Player, or none")


def list_own_streams(scene: bpy.types.Scene, name: str) -> list[StreamSettings]:
    """List the streams whose strikes a player repeats: their own, otherwise those of no player, otherwise all."""
    received = list_received(scene)
    own = [stream for stream in received if stream.player == name]
    return own or [stream for stream in received if not stream.player] or received


def find_main_stream(scene: bpy.types.Scene, name: str) -> StreamSettings:
    """Find the stream that says what counts as a player's strike: their own, or the scene's first one."""
    return next(iter(list_own_streams(scene, name)), scene.beyond_mocap_stream)


def update_streams(scene: bpy.types.Scene) -> list[HitMotion]:
    """Show what has arrived in a scene, update the status of each stream, and list the strikes just detected.

    A stream in which something goes wrong is stopped with a message; the others go on.
    """
    hits = []
    for key, received in list(_streams.items()):
        hit = _call_or_stop(key, lambda one=received: _update_stream(scene, one))
        hits += [] if hit is None else [hit]
    for call in list(_on_update):
        call(scene)
    return hits


def _call_or_stop(key: tuple[int, int], action):
    """Call an action for a stream; an error stops the stream."""
    return call_or_describe(action, lambda reason: _give_up(key, reason),
                            f"Stream {key[1]} has stopped because of an error")


def _update_stream(scene: bpy.types.Scene, received: ReceivedStream) -> HitMotion | None:
    """Pose a stream's character by the latest frame, detect hits, and update the status."""
    (of, number), now = received.key, time.monotonic()
    stream = find_stream(scene, number) if of == scene.session_uid else None
    if stream is None:
        return None
    latest = received.listener.latest_frame()
    if latest is not None and latest.number != received.seen:
        received.seen = latest.number
        if _show_frame(scene, stream, received, latest):
            received.latencies.append(time.monotonic() - (latest.time if latest.sent is None else latest.sent))
    found = _take_hit(scene, find_stream(scene, number), received)
    if int(now / STATUS_SECONDS) != received.written:
        received.written = int(now / STATUS_SECONDS)
        write_status(received.key)
    return found


def _show_frame(scene, stream: StreamSettings, received: ReceivedStream, latest) -> bool:
    """Pose the streamed character; return False if it had to be created first, which takes longer.

    Raises:
        InputError: if the skeleton has changed too often.
    """
    skeleton, root, rotations = listening.convert_poses([latest])
    can_show = streamed_body.can_show(stream.body, scene, skeleton)
    if not can_show:
        if received.bodies >= MOST_BODIES:
            raise InputError(f"stream {stream.number}", f"the skeleton has changed {MOST_BODIES} times", "one skeleton",
                             "the stream is stopped: check the sender")
        received.bodies += 1
        name = "Stream" if stream.number == 1 else f"Stream {stream.number}"
        motion = motions.Motion(skeleton, root, rotations, 60.0)
        stream.body = streamed_body.create_body(bpy.context, motion, name, stream.number)
        # one undo step, so that undo does not remove the new character silently
        if not bpy.app.background:
            bpy.ops.ed.undo_push(message="Streamed Character")
            stream = find_stream(scene, received.key[1])
    streamed_body.pose_body(stream.body, scene, skeleton, root[0], rotations[0])
    return can_show


def _take_hit(scene, stream: StreamSettings, received: ReceivedStream) -> HitMotion | None:
    """Take a strike that has been detected, show it in the panel and pass it on."""
    try:
        found = received.hits.take_hit()
    except BeyondMocapError as error:
        find_status(received.key).hit = str(error)
        return None
    if found is None:
        return None
    hit, seconds = found
    side = f"{hit.side} " if hit.side else ""
    find_status(received.key).hit = f"{side}{hit.part}, {hit.max_speed:.1f} m/s"
    for call in list(_on_hit):
        call(scene, stream, hit, seconds)
    return hit


def wait_for_strikes() -> None:
    """Wait, in a thread that plans, until the strikes that have just been noticed are taken: the work would slow down
    the drawing after which they are.
    """
    while any(received.hits.is_hit_waiting for received in list(_streams.values())):
        time.sleep(_HOLD_SECONDS)


def take_strikes(scene: bpy.types.Scene) -> None:
    """Pass on the strikes that have been detected, before a frame is evaluated: it already shows what answers them."""
    if not _on_frame or bpy.app.is_job_running("RENDER"):
        return
    for stream in list_received(scene):
        key = get_key(stream)
        _call_or_stop(key, lambda stream=stream, key=key: _take_hit(scene, stream, _streams[key]))
    for call in list(_on_frame):
        call(scene)


def write_status(key: tuple[int, int]) -> None:
    """Write the status of a stream for the panel."""
    status, received = _find_or_create_status(key), _streams.get(key)
    if received is None:
        status.on, status.state, status.line, status.figures = False, "stopped", "", ""
        return
    measured = received.listener.measure_status()
    lines = [f"Frames: {measured.frames}", f"Frame Rate: {measured.rate:.0f}"]
    if received.latencies and measured.state == "receiving":
        from statistics import median  # with what it loads, a hundredth of what enabling takes

        latency_name = "Latency" if measured.delay is not None else "Latency, from Arrival"
        lines.append(f"{latency_name}: {1000.0 * median(received.latencies):.0f} ms")
    if measured.invalid_count:
        lines.append(f"Invalid Pieces: {measured.invalid_count}")
    status.on, status.state, status.line = True, measured.state, measured.line
    status.figures = "\n".join(lines)


def write_stopped() -> None:
    """Write the status of streams that have been stopped without it, as by opening a file."""
    keys = [(status.scene, status.number) for status in list_statuses() if status.on]
    stopped = [key for key in keys if key not in _streams]
    for key in stopped:
        write_status(key)
    if stopped:
        window.redraw_editors()


def _find_or_create_status(key: tuple[int, int]) -> StreamStatus:
    """Find the status of a stream, or create it; that of the first one is used where none is received by it."""
    status, first = find_status(key), bpy.context.window_manager.beyond_mocap_streaming
    if status is None:
        status = first if key[1] == 1 and not first.on else first.further.add()
        status.scene, status.number = key
    return status


def _give_up(key: tuple[int, int], reason: str) -> None:
    """Stop a stream because of an error; its message stays."""
    stop_listening(key)
    write_status(key)
    status = find_status(key)
    status.state, status.line = "failed", reason


def _run_timer() -> float:
    """Update the streams, and return the seconds until the next call."""
    write_stopped()
    if _skips["update"]:
        _skips["update"] = False
        return TICK
    if not _streams and not _on_update:
        return IDLE
    if bpy.app.is_job_running("RENDER"):
        return IDLE
    before = _collect_texts()
    for shown in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=shown):
            update_streams(shown.scene)
    if _collect_texts() != before:
        window.redraw_editors()
    return TICK


def _collect_texts() -> list[str]:
    """Collect the texts of the panel that change by themselves."""
    return [*(status.figures for status in list_statuses()), bpy.context.window_manager.beyond_mocap_streaming.played]


def _stop_removed() -> None:
    """Stop the streams that no scene has any more, after an undo."""
    there = {get_key(stream) for scene in bpy.data.scenes for stream in list_streams(scene)}
    for key in _streams.keys() - there:
        stop_listening(key)


def _end_session() -> None:
    stop_listening()
    _on_hit.clear()
    _on_update.clear()
    _on_frame.clear()


WATCHER = Watcher(name="Stream", look=_run_timer, framing=take_strikes, restored=_stop_removed, closing=stop_listening,
                  ends=_end_session)
