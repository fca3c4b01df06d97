"""Play Live: while the scene plays, the holder of the ball repeats their user's strikes and passes to the chosen
player.

`follow` detects the strikes of each stream's user. While the user has not struck, the likely answers are planned in a
thread, from where all players stand; the one that answers the strike is inserted into the running scene, and then the
players who have no part in it watch. The characters and the ball are those of the passing scene.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError, InputError, UserCancelledError
from ...beyond_mocap.base.fixes import Fix
from ..core import background
from ..core.live import Watcher, call_or_describe, is_playing
from ..core.measure import frames_per_second
from ..passes import generate as make
from ..passes.settings import PLAYED
from . import follow, rally_keys, rally_status
from .rally_clock import RallyClock

if TYPE_CHECKING:
    from ...beyond_mocap.passes.answers_ahead import AnswerRequest
    from ...beyond_mocap.passes.hits import HitMotion
    from ...beyond_mocap.passes.live_passes import LivePass, Rally
    from .new_rally import NewRally
    from .settings import StreamSettings

LEFT_SECONDS = 20.0
"""Seconds before a player's standing ends at which it is continued."""

_session: dict[str, object] = {}


def apply_rally(scene: bpy.types.Scene, new_rally: NewRally) -> None:
    """Apply a rally to characters and ball, and answer the user's strikes from now on."""
    stop_rally()
    make.session.store_library(new_rally.library, new_rally.order.unit)
    _session.update(scene=scene.session_uid, means=new_rally.means, seen=None, latest={}, unwritten=set(),
                    keys=rally_keys.RallyKeys(), drawn=compute_rally_seconds(scene), watchers=None, steps=0,
                    clock=RallyClock())
    _wait_for_strike(scene, new_rally.rally)
    for name in ("strikes", "figures", "messages"):
        scene.beyond_mocap_passes.property_unset(name)
    scene.beyond_mocap_passes.made_of = PLAYED
    _session["keys"].write_all(scene, new_rally.rally, [player.name for player in new_rally.rally.scene.players])
    follow.add_hit_call(receive_strike)
    follow.add_update_call(_update_or_end)
    follow.add_frame_call(_answer_or_end)
    rally_status.write_status(get_current_rally())


def stop_rally(is_undone: bool = False) -> None:
    """Stop answering; what was played stays, and a pass that is partly written is finished where its keys are still
    there, unless the scene has been undone.
    """
    keys, uid = _session.get("keys"), _session.get("scene")
    _clear_session()
    for scene in () if is_undone or keys is None else bpy.data.scenes:
        if scene.session_uid == uid:
            keys.finish_pass(scene)


def _clear_session() -> None:
    background.cancel_jobs("live")
    if _session.get("watchers"):
        _session["watchers"].cancel()
    follow.remove_call(receive_strike)
    follow.remove_call(_update_or_end)
    follow.remove_call(_answer_or_end)
    _session.clear()


def write_rest() -> None:
    """Write what was not written with the last passes, so that nothing waits for their players to stand."""
    for scene in bpy.data.scenes:
        if _session.get("unwritten") and scene.session_uid == _session["scene"]:
            _write_rest(scene)


def get_current_rally() -> Rally | None:
    """The rally that is being played, or None."""
    return _session.get("rally")


def compute_rally_seconds(scene: bpy.types.Scene) -> float:
    """Compute the time of the scene's frame on the rally's clock."""
    frame = math.floor(scene.frame_current_final + 1e-4) - scene.beyond_mocap_passes.start_frame
    return frame / frames_per_second(scene)


def find_target(scene: bpy.types.Scene) -> str:
    """Find the receiver of the next pass: the chosen player, otherwise the next in the list who has a stream of their
    own, otherwise the next in the list.
    """
    names = [row.name for row in scene.beyond_mocap_passes.players]
    chosen, holder = scene.beyond_mocap_stream.target, get_current_rally().holder
    if chosen in names and chosen != holder:
        return chosen
    if not names:
        raise InputError("players", "the list is empty", "two or more", "choose a sample, and press Play Live again")
    after = names.index(holder) + 1 if holder in names else 0
    in_turn = [name for name in names[after:] + names[:after] if name != holder]
    users = {stream.player for stream in follow.list_received(scene)}
    return next((name for name in in_turn if name in users), in_turn[0])


def receive_strike(scene: bpy.types.Scene, stream: StreamSettings, hit: HitMotion, seconds: float) -> None:
    """Store the strike of a stream's user if the player who has the ball repeats it."""
    if stream.number in [one.number for one in follow.list_own_streams(scene, get_current_rally().holder)]:
        store_strike(hit, seconds)


def store_strike(hit: HitMotion, seconds: float) -> None:
    """Store a user's strike of `seconds` on the monotonic clock; only the latest one counts."""
    _session["pending"] = hit, seconds


def _update_or_end(scene: bpy.types.Scene) -> None:
    """Update the rally; an error ends it, and the streams go on."""
    call_or_describe(lambda: update_rally(scene), _end_rally, "Play Live has stopped because of an error")


def _answer_or_end(scene: bpy.types.Scene) -> None:
    """Answer a strike in the playback; an error ends the rally."""
    call_or_describe(lambda: answer_in_playback(scene), _end_rally, "Play Live has stopped because of an error")


def answer_in_playback(scene: bpy.types.Scene) -> None:
    """Insert the answer to the user's strike, if it is planned, before a frame of the playback is evaluated."""
    if scene.session_uid != _session.get("scene") or scene.beyond_mocap_passes.made_of != PLAYED:
        return
    _finish_pass(scene)  # this frame may be one that is not written yet
    if is_playing():
        _session["clock"].note_frame(time.monotonic(), compute_rally_seconds(scene))
    else:
        _session["clock"].forget_frames()
    _collect_answer()
    if _session["pending"] is not None and _session["watchers"] is None and is_playing():
        _answer_strike(scene, find_target(scene), before_frame=True)
    _session["drawn"] = compute_rally_seconds(scene)


def update_rally(scene: bpy.types.Scene) -> None:
    """Insert the answer to the user's strike as soon as it is planned; while they have not struck, plan ahead."""
    if get_current_rally() is None or scene.session_uid != _session["scene"]:
        return
    if scene.beyond_mocap_passes.made_of != PLAYED:
        _end_rally("The scene has been updated or cleared: press Play Live to continue")
        return
    _session["drawn"] = compute_rally_seconds(scene)
    if not _finish_pass(scene):
        _write_rest(scene)
    _update_target(scene)
    _collect_answer()
    _show_watchers(scene)
    try:
        target = find_target(scene)
    except InputError as error:
        return _end_rally(str(error))
    if _session["watchers"] is not None:  # the next answers begin where they stand then
        pass
    elif _session["pending"] is not None:
        _answer_strike(scene, target)
    else:
        _session["keys"].note_edits(scene)
        if "job" not in _session:
            _plan_ahead(scene, target)
    if get_current_rally().end - _session["drawn"] < LEFT_SECONDS:
        _session["rally"] = get_current_rally().keep_standing()
        _session["unwritten"] |= {*get_current_rally().players}
    # a moment's halt is not seen when they stand
    if _session["unwritten"] and _session["drawn"] >= get_current_rally().ready_time:
        _write_rest(scene)


def answer_now(scene: bpy.types.Scene, hit: HitMotion) -> LivePass:
    """Answer a strike at once, for scripts: the pass is computed and inserted before this returns."""
    if get_current_rally() is None:
        raise InputError("play live", "no rally is being played", "a rally", "press Play Live",
                         fixes=(Fix("press", "beyond_mocap.stream_play"),))
    piece = _build_answer(*_collect_order(_build_request(scene, hit, find_target(scene))), None, None)
    _apply_pass(scene, piece)
    while not _session["watchers"].poll():
        time.sleep(0.005)
    _show_watchers(scene)
    _write_rest(scene)
    return piece


def _build_request(scene, hit: HitMotion, target: str) -> AnswerRequest:
    """Build the request that answers a hit of the user."""
    return _session["ahead"].request_for(hit, target, scene.beyond_mocap_stream.bounces)


def _collect_order(request: AnswerRequest) -> tuple:
    """Collect what a pass needs: library, rally, hit, receiver, bounces."""
    return _session["means"].library, get_current_rally(), request.strike.hit, request.target, request.bounces


def _build_answer(library, one, hit: HitMotion, target: str, bounces: int, progress, cancelled) -> LivePass:
    from ...beyond_mocap.passes.live_passes import build_answer

    return build_answer(library, one, hit, target, bounces, progress=progress, cancelled=cancelled)


def _start_planning(request: AnswerRequest) -> None:
    """Plan an answer in a thread; another one that is being planned is cancelled."""
    order = _collect_order(request)

    def work(progress, cancelled, _hurry):
        def is_cancelled() -> bool:
            follow.wait_for_strikes()
            return cancelled()

        return _build_answer(*order, progress, is_cancelled)

    _session["job"] = request, background.Job("live", work)


def _collect_answer() -> None:
    """Collect the answer that has just been planned, or its error; one that was cancelled is no longer waited for."""
    if "job" not in _session or not _session["job"][1].poll():
        return
    request, job = _session.pop("job")
    if isinstance(job.error, UserCancelledError):
        _session["pending"] = None
    elif job.error is None or isinstance(job.error, BeyondMocapError):
        _session["ahead"].add(request, job.error or job.result)
    else:
        raise job.error


def _answer_strike(scene, target: str, before_frame: bool = False) -> None:
    """Plan the answer to the user's strike if it is not planned yet; insert it as soon as the holder can act."""
    hit, seconds = _session["pending"]
    try:
        request = _build_request(scene, hit, target)
        answer = _session["ahead"].find(request)
        if isinstance(answer, BeyondMocapError):
            raise answer
        if answer is None and ("job" not in _session or _session["job"][0].key != request.key):
            _start_planning(request)
        if answer is None or compute_rally_seconds(scene) < get_current_rally().ready_time:
            return
        _apply_pass(scene, answer, hit, seconds, before_frame)
    except BeyondMocapError as error:
        _session["pending"] = None
        bpy.context.window_manager.beyond_mocap_streaming.played = str(error)


def _plan_ahead(scene, target: str) -> None:
    """Plan the likeliest answer that is not planned yet."""
    from ...beyond_mocap.annotation.striking import SIDED_PARTS

    stream = follow.find_main_stream(scene, get_current_rally().holder)
    others = [player.name for player in get_current_rally().scene.players
              if player.name not in (target, get_current_rally().holder)]
    side = stream.side if stream.part in SIDED_PARTS and stream.side != "either" else ""
    try:
        request = _session["ahead"].choose_next(stream.part, side, [target, *others],
                                                scene.beyond_mocap_stream.bounces)
    except BeyondMocapError:  # a part that the library's skeleton lacks: said when the user strikes
        return
    if request is not None:
        _start_planning(request)


def _apply_pass(scene, piece: LivePass, hit: HitMotion | None = None, seconds: float = 0.0,
                before_frame: bool = False) -> None:
    """Insert a pass that answers a hit of `seconds` on the monotonic clock; what takes long is left to the updates that
    follow, since the user waits for the next drawing.
    """
    from .watchers import PlannedWatchers

    background.cancel_jobs("live")  # planning in a thread would slow down the writing
    _session.pop("job", None)
    begin, delay = _find_beginning(scene, seconds)
    if bpy.app.background:  # where edits are not watched
        _session["keys"].mark_edits()
    next_rally, is_playing_now = get_current_rally().add_pass(piece, begin), is_playing()
    shown = scene.frame_current if is_playing_now else None
    if not _session["keys"].replace_pass(scene, next_rally, piece.motions, begin, shown):
        if before_frame:
            return
        _session["keys"].write_all(scene, next_rally, piece.motions)
    _session["watchers"] = PlannedWatchers(_session["means"].library, get_current_rally(), piece, begin)
    _session["latest"][follow.find_main_stream(scene, piece.giver).number] = hit
    _wait_for_strike(scene, next_rally)
    _session["unwritten"] |= {*piece.motions}
    if not is_playing_now:
        _finish_pass(scene)
    elif before_frame:
        follow.skip_update()
    scene.beyond_mocap_stream.target = ""
    rally_status.write_status(next_rally, piece, (delay, time.monotonic() - seconds) if seconds else None)
    rally_status.add_note(_session["keys"])


def _finish_pass(scene) -> bool:
    """Write the keys of the last pass that are not shown yet, and let the other players watch it; False where its keys
    have been changed by others, which takes a `_write_rest`.
    """
    if _session["watchers"] is not None:
        _session["watchers"].start()
    return _session["keys"].finish_pass(scene)


def _show_watchers(scene) -> None:
    """Insert those who watch the pass as soon as they are planned; who is not by its end goes on as before."""
    planned = _session["watchers"]
    if planned is None or not (planned.poll() or _session["drawn"] >= get_current_rally().ready_time):
        return
    planned.cancel()
    _session["watchers"] = None
    at = max(planned.begin, _session["drawn"])
    rally, names = planned.add_to(get_current_rally(), at)
    if not names:
        return
    # a slow playback may have passed what is written at once
    is_written = at < rally.ready_time and _session["keys"].replace_pass(scene, rally, names, rally.find_frame(at))
    if not is_written:
        _session["keys"].write_all(scene, rally, names)
    _session["unwritten"] |= {*names}
    _use_rally(scene, rally)


def _find_beginning(scene, seconds: float) -> tuple[float, float]:
    """Find when the answer to a strike begins: with the strike, or the frame that was drawn last where that is later,
    since frames that a slow playback drops can still change; but not before the holder can act.

    Args:
        scene: the scene.
        seconds: s of the strike on the monotonic clock; 0: unknown.
    Returns:
        s on the rally's clock, and s since the strike in the scene's time.
    """
    rally, struck = get_current_rally(), None
    if seconds and is_playing():
        struck = _session["clock"].find_seconds(seconds)
    struck = compute_rally_seconds(scene) if struck is None else struck
    begin = rally.find_frame(max(rally.ready_time, struck, _session["drawn"]))
    return begin, begin - struck


def _write_rest(scene) -> None:
    """Write the standing that follows the last passes; it is one step of undo with them."""
    _session["keys"].write_all(scene, get_current_rally(), sorted(_session["unwritten"]))
    _session["unwritten"] = set()
    rally_status.add_note(_session["keys"])
    # who only goes on to stand makes no step
    if get_current_rally().passes > _session["steps"] and not bpy.app.background:
        _session["steps"] = get_current_rally().passes
        bpy.ops.ed.undo_push(message="Live Pass")


def _wait_for_strike(scene, rally: Rally) -> None:
    """Let the rally wait for the next strike of its holder's user."""
    _use_rally(scene, rally)
    _session["pending"] = None
    _session.pop("job", None)


def _use_rally(scene, rally: Rally) -> None:
    """Go on with a rally; nothing is planned for it yet."""
    from ...beyond_mocap.passes.answers_ahead import AnswersAhead

    latest = _session["latest"].get(follow.find_main_stream(scene, rally.holder).number)
    _session.update(rally=rally, ahead=AnswersAhead(_session["means"], rally, latest))


def _update_target(scene) -> None:
    """Make a player that has just been clicked the target."""
    active = bpy.context.view_layer.objects.active
    name = active.name if active is not None else None
    if name == _session.get("seen"):
        return
    _session["seen"] = name
    for row in scene.beyond_mocap_passes.players:
        # a player is clicked by character, mesh or place
        known = {row.body, row.place, *(row.body.children if row.body else ())}
        if active is not None and active in known and row.name != get_current_rally().holder:
            scene.beyond_mocap_stream.target = row.name


def _end_rally(reason: str, is_undone: bool = False) -> None:
    """End the rally with a message."""
    status_texts = bpy.context.window_manager.beyond_mocap_streaming
    status_texts.playing, status_texts.played = False, reason
    stop_rally(is_undone)


def _mark_edits(_scene, depsgraph) -> None:
    """Note that the user may have edited keys of the rally."""
    if _session and any(isinstance(update.id, bpy.types.Action) for update in depsgraph.updates):
        _session["keys"].mark_edits()


def _after_undo() -> None:
    """End the rally after an undo, which changes the scene that the rally knows."""
    if get_current_rally() is not None:
        _end_rally("Undo has ended Play Live: press it to start again", is_undone=True)


WATCHER = Watcher(name="Play Live", changed=_mark_edits, restored=_after_undo, saving=write_rest, closing=stop_rally,
                  ends=stop_rally)
