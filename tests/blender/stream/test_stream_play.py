"""Play live: strikes of the streamed body become passes of the scene's players, while the scene goes on."""

import pathlib
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from conftest import EXTENSION, find_free_port
from stream_room import room  # noqa: F401
from undo import assert_one_step, press_operator

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend"
CLIPS = SAMPLE / "passes" / "library"
OPS = bpy.ops.beyond_mocap


@pytest.fixture(scope="module")
def cache_folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def playing(room, cache_folder):
    """Three players stand, Ann has the ball; 24 frames a second, from frame 5 on."""
    scene = bpy.context.scene
    scene.render.fps = 24
    chosen = bpy.context.preferences.addons[EXTENSION].preferences
    chosen.cache_folder = str(cache_folder)
    OPS.passes_sample(sample="three")
    scene.beyond_mocap_passes.library_folder, scene.beyond_mocap_passes.start_frame = str(CLIPS), 5
    scene.frame_set(5)
    assert press_operator(OPS.stream_play) == {"FINISHED"}
    yield scene
    chosen.property_unset("cache_folder")


def told():
    return bpy.context.window_manager.beyond_mocap_streaming


@cache
def kick(core, name="volley_pass"):
    return core("passes.hits").detect_hits(core("files.bvh.bvh").read_bvh(CLIPS / f"{name}.bvh").motion).strongest


def places(scene, frames):
    """The ball at some frames, metres."""
    ball, found = scene.beyond_mocap_passes.rally, []
    for frame in frames:
        scene.frame_set(frame)
        found.append(ball.matrix_world.translation[:])
    return np.array(found)


def follow_until(room, is_true):
    """Update until something is true."""
    end = time.monotonic() + 120.0
    while not is_true():
        assert time.monotonic() < end, told().played
        room("stream.follow").update_streams(bpy.context.scene)
        time.sleep(0.02)


@contextmanager
def kicking(core, port):
    """A user who kicks again and again."""
    stop = threading.Event()
    sender = core("passes.stream.sender").Sender(CLIPS / "volley_pass.bvh", port, loop=True)
    thread = threading.Thread(target=sender.send_file, args=(stop.is_set,))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def test_all_stand_and_the_ball_lies(playing, room):
    assert (
        room("stream.play").get_current_rally().holder == "Ann" and told().playing
        and told().played.startswith("Ann has the ball")
    )
    assert all(row.body is not None for row in playing.beyond_mocap_passes.players)
    assert playing.frame_end >= 5 + 60 * 24
    assert np.ptp(places(playing, (5, 100, 900)), axis=0).max() < 1e-6
    playing.frame_set(5 + 60 * 24)  # and they go on to stand, however long the user waits
    room("stream.play").update_rally(playing)
    assert playing.frame_end > 120 * 24
    assert all(row.body.animation_data.action.frame_range[1] > 120 * 24 for row in playing.beyond_mocap_passes.players)


def test_a_strike_is_answered_from_now_on(playing, room, core):
    playing.frame_set(5 + 48)
    bodies = [row.body for row in playing.beyond_mocap_passes.players]
    before = places(playing, range(5, 53))
    playing.frame_set(5 + 48)
    piece = room("stream.play").answer_now(playing, kick(core))
    assert (piece.giver, piece.receiver, piece.clip) == ("Ann", "Ben", "volley_pass.bvh")
    np.testing.assert_allclose(places(playing, range(5, 53)), before, atol=1e-6)
    struck = 53 + piece.strike * 24
    way = places(playing, range(53, 53 + 120))
    speed = np.linalg.norm(np.diff(way, axis=0), axis=1) * 24
    assert speed[: int(struck) - 54].max() < 4.0 < speed.max() < 20.0
    assert [row.body for row in playing.beyond_mocap_passes.players] == bodies
    assert (
        "Ben has the ball, passes so far: 1" in told().played and "Ann played volley_pass.bvh to Ben" in told().played
    )


def read_keys(room, scene, name):
    """A player's first frame, and rotations (F, J, 4)."""
    body = scene.beyond_mocap_passes.players[name].body
    return room("core.action").find_first_frame(body), room("core.action").read_motion(body, scene).rotations


def plan_ahead(play, core, scene):
    """Update until the answer to the kick is planned."""
    ahead, end = play._session["ahead"], time.monotonic() + 120.0
    while ahead.find(ahead.request_for(kick(core), "Ben", 0)) is None and time.monotonic() < end:
        play.update_rally(scene)
        time.sleep(0.01)


@pytest.mark.parametrize("ending", ["standing", "saving"])
def test_an_answer_that_is_planned_ahead_begins_at_once(playing, room, core, ending):
    """Within the update in which the strike is noticed, and the same pass as when it is planned then. It is written
    into the keys that are there, so that no step of undo lacks those before it; the long standing after it is written
    when the players stand, or the file is saved.
    """
    play, body = room("stream.play"), playing.beyond_mocap_passes.players[0].body
    playing.frame_set(5 + 48)
    action, (start, before) = body.animation_data.action, read_keys(room, playing, "Ann")
    plan_ahead(play, core, playing)
    play.store_strike(kick(core), time.monotonic())
    play.update_rally(playing)
    assert play.get_current_rally().passes == 1 and "The answer began 0." in told().played
    assert play._session["pending"] is None
    first, within = read_keys(room, playing, "Ann")
    assert body.animation_data.action == action and first == start == 5 and len(within) == len(before)
    np.testing.assert_allclose(within[:48], before[:48], atol=1e-6)
    assert np.abs(within[48 + 24] - before[48 + 24]).max() > 0.01 and np.abs(within[-1] - within[-2]).max() < 1e-6
    if ending == "standing":
        playing.frame_set(int(5 + 24 * play.get_current_rally().ready_time) + 1)
        play.update_rally(playing)
    else:
        play.WATCHER.saving()
    first, whole = read_keys(room, playing, "Ann")
    shown = round((play.get_current_rally().ready_time + 3.0) * 24)
    assert first == 5 and len(whole) > 60 * 24 and np.abs(whole[-1] - whole[-25]).max() > 1e-4, "they stand, and sway"
    np.testing.assert_allclose(np.abs((whole[:shown] * within[:shown]).sum(axis=-1)), 1.0, atol=1e-5)


def play_and_strike(play, scene, core, clock, frames, in_playback):
    """Let a playback come to frames at moments of the clock; a strike at 100.75 s is noticed before the last frame is
    evaluated, or after it."""
    for clock.moment, frame in frames.items():
        scene.frame_set(frame)
        if in_playback and clock.moment == max(frames):
            play.store_strike(kick(core), 100.75)
        play.answer_in_playback(scene)
    if not in_playback:
        clock.moment = 100.9
        play.store_strike(kick(core), 100.75)
        play.update_rally(scene)


def test_an_answer_begins_with_the_strike(playing, room, core, monkeypatch):
    """However slow the playback is: the strike is dated by when the frames came, also where it is noticed after the
    last one, and where the playback drops none. What was drawn already stays, and what was before the strike. Only what
    is drawn next is written at once, and all before the frame after it.
    """
    play, clock = room("stream.play"), SimpleNamespace(moment=0.0)
    monkeypatch.setattr(play, "is_playing", lambda: True)
    monkeypatch.setattr(play, "time", SimpleNamespace(monotonic=lambda: clock.moment))
    plan_ahead(play, core, playing)
    stand, first = dict(play._session), read_keys(room, playing, "Ann")[1]
    for frames, begins, in_playback in (
        ({100: 40, 101: 64}, 58, True), ({100: 40, 101: 64, 102: 88}, 64, True), ({100: 62, 101: 64}, 64, True),
        ({99: 16, 100: 40}, 58, False), ({99: 39, 100: 40}, 41, False), ({100: 40}, 40, False),
    ):
        play_and_strike(play, playing, core, clock, frames, in_playback)
        count = playing.frame_current + 1 - 5
        at_once = read_keys(room, playing, "Ann")[1]
        assert np.array_equal(at_once[count + 1 :], first[count + 1 :])
        play.answer_in_playback(playing)  # of the next frame
        last = read_keys(room, playing, "Ann")[1]
        assert np.array_equal(at_once[:count], last[:count]) and np.abs(last - first)[count + 20 :].max() > 0.1
        changed = np.abs(last - first).max(axis=(1, 2)) > 1e-5
        assert 5 + np.argmax(changed) == begins + 1, "where it blends in, the first frame is the old one"
        play._session.update({**stand, "watchers": None, "drawn": 0.0, "clock": type(stand["clock"])()})
        play._session.pop("job", None)
        play._session["keys"].write_all(playing, stand["rally"], stand["rally"].players)


def test_frames_that_are_not_played_have_no_pace(playing, room, monkeypatch):
    play, clock = room("stream.play"), SimpleNamespace(moment=0.0, plays=False)
    monkeypatch.setattr(play, "is_playing", lambda: clock.plays)
    monkeypatch.setattr(play, "time", SimpleNamespace(monotonic=lambda: clock.moment))
    for clock.moment, frame, clock.plays in ((90.0, 2, False), (90.1, 90, False), (95.0, 16, True), (96.0, 40, True)):
        playing.frame_set(frame)
        play.answer_in_playback(playing)
    assert play._session["clock"].find_seconds(96.5) == pytest.approx(play.compute_rally_seconds(playing) + 0.5)


@pytest.mark.parametrize("name", ["Ann", "Ben"])
def test_keys_that_the_user_has_changed_are_written_again(playing, room, core, monkeypatch, name):
    """By the update after the frame, which shows no part of the pass; and the strike is not lost."""
    play, body = room("stream.play"), playing.beyond_mocap_passes.players[name].body
    monkeypatch.setattr(play, "is_playing", lambda: True)
    plan_ahead(play, core, playing)
    curves = room("core.channels").collect_curves(*room("core.channels").find_playing_action(body))
    points = next(iter(curves.values())).keyframe_points
    points.remove(points[10])
    before = read_keys(room, playing, "Ann")[1]
    play.store_strike(kick(core), time.monotonic())
    play.answer_in_playback(playing)
    assert play.get_current_rally().passes == 0 and np.array_equal(read_keys(room, playing, "Ann")[1], before)
    play.update_rally(playing)
    assert play.get_current_rally().passes == 1
    assert {len(curve.keyframe_points) for curve in room("core.channels").collect_curves(
        *room("core.channels").find_playing_action(body)).values()} == {len(read_keys(room, playing, name)[1])}


def set_key(room, body, frame, value):
    """Edit a value of a body's first curve, as in the Graph Editor; returns how to read it."""
    curves = room("core.channels").collect_curves(*room("core.channels").find_playing_action(body))
    key, points = next((key, curve.keyframe_points) for key, curve in curves.items())
    next(point for point in points if point.co.x == frame).co.y = value

    def read():
        action = room("core.channels").find_playing_action(body)
        return room("core.channels").collect_curves(*action)[key].evaluate(frame)

    return read


def test_edits_before_a_pass_that_begins_later_stay(playing, room, core, monkeypatch):
    """The strike is later than the frame that is drawn, and keys between them are edited before it is answered, and
    while the pass is partly written.
    """
    play, body = room("stream.play"), playing.beyond_mocap_passes.players["Ann"].body
    clock = SimpleNamespace(moment=0.0)
    monkeypatch.setattr(play, "is_playing", lambda: True)
    monkeypatch.setattr(play, "time", SimpleNamespace(monotonic=lambda: clock.moment))
    plan_ahead(play, core, playing)
    early = set_key(room, body, 50, 7.0)
    play._session["keys"].mark_edits()
    play_and_strike(play, playing, core, clock, {99: 16, 100: 40}, in_playback=False)
    late = set_key(room, body, 52, 8.0)
    play.answer_in_playback(playing)
    assert play.get_current_rally().passes == 1 and (early(), late()) == (7.0, 8.0)
    play.write_rest()
    assert (early(), late()) == (7.0, 8.0)


@pytest.mark.parametrize("event", ["error", "undo", "edit", "removal"])
def test_a_pass_that_is_partly_written_is_finished(playing, room, core, monkeypatch, event):
    """Also where the rally ends, and around what the user edits meanwhile; not after an undo."""
    play, body = room("stream.play"), playing.beyond_mocap_passes.players["Ann"].body
    monkeypatch.setattr(play, "is_playing", lambda: True)
    plan_ahead(play, core, playing)
    playing.frame_set(53)
    play.store_strike(kick(core), time.monotonic())
    play.answer_in_playback(playing)
    partly = read_keys(room, playing, "Ann")[1]
    assert play.get_current_rally().passes == 1
    if event == "error":
        play._end_rally("an error")
    elif event == "undo":
        play.WATCHER.restored()
    elif event == "edit":
        early = set_key(room, body, 20, 7.0)
        play.update_rally(playing)
        assert early() == 7.0
    else:
        action = room("core.channels").find_playing_action(body)
        points = next(iter(room("core.channels").collect_curves(*action).values())).keyframe_points
        points.remove(points[10])
        play.update_rally(playing)
        assert "Keys were added, removed or moved, and have been written again: Ann" in told().played
    whole = read_keys(room, playing, "Ann")[1]
    assert (np.abs(whole[80:1500] - partly[80:1500]).max() > 0.1) == (event != "undo")
    assert (play.get_current_rally() is None) == (event in ("error", "undo"))


def test_values_that_the_user_has_edited_stay(playing, room, core):
    """Before the pass, when it is written and when all is written again; the panel names what the pass replaces."""
    play, body = room("stream.play"), playing.beyond_mocap_passes.players["Ann"].body
    plan_ahead(play, core, playing)
    playing.frame_set(53)
    early, late = set_key(room, body, 20, 7.0), set_key(room, body, 60, 8.0)
    play.store_strike(kick(core), 0.0)
    play.update_rally(playing)
    assert early() == 7.0 and late() != 8.0
    assert "replaced keys that were edited after its beginning: Ann" in told().played
    play.write_rest()
    assert early() == 7.0 and told().played.count("edited") == 1
    for name in ("Ann", "Ben"):
        action = room("core.channels").find_playing_action(playing.beyond_mocap_passes.players[name].body)
        points = room("core.channels").collect_curves(*action).popitem()[1].keyframe_points
        points.remove(points[3])
    play._session["unwritten"] = {"Ann", "Ben"}
    play.write_rest()
    assert "Keys were added, removed or moved, and have been written again: Ann, Ben" in told().played


def test_who_has_no_part_watches(playing, room, core):
    """They turn to the ball and stand so, and the next answers are planned from there."""
    play, facing = room("stream.play"), core("motion.humanoid").compute_heading
    playing.frame_set(5 + 48)
    play.answer_now(playing, kick(core))
    rally = play.get_current_rally()
    cho = rally.players["Cho"]
    x, y = (rally.ball.positions[-1] - cho.motion.root_positions[-1])[:2]
    turned = [np.degrees(np.angle(np.exp(1j * (np.arctan2(y, x) - facing(cho.motion.frames(*span))[0]))))
              for span in ((40, 41), (len(cho.motion) - 1, len(cho.motion)))]
    assert abs(turned[0]) > 35.0 and abs(turned[1]) < 12.0, turned
    motion = room("core.action").read_motion(playing.beyond_mocap_passes.players["Cho"].body, playing)
    assert abs(facing(motion.frames(40, 41))[0] - facing(motion.frames(400, 401))[0]) > 0.5
    assert play._session["ahead"].rally is rally


def test_who_watches_late_is_written_whole(playing, room, core):
    """Where a slow playback has gone past the pass before they are planned."""
    play = room("stream.play")
    plan_ahead(play, core, playing)
    play.store_strike(kick(core), 0.0)
    play.update_rally(playing)
    end = time.monotonic() + 120.0
    while not play._session["watchers"].poll() and time.monotonic() < end:
        time.sleep(0.01)
    playing.frame_set(int(5 + 24 * (play.get_current_rally().ready_time + 8.0)))
    before, old = play.get_current_rally(), read_keys(room, playing, "Cho")[1]
    play.update_rally(playing)
    now = read_keys(room, playing, "Cho")[1]
    assert play.get_current_rally() is not before and play._session["watchers"] is None
    assert np.abs(now[: len(old)] - old).max() > 0.01 and np.abs(now[:240] - old[:240]).max() < 1e-5


def test_a_rally_that_waits_makes_no_step(playing, room, core, monkeypatch):
    """A step for each pass, and none for standing on."""
    play, steps = room("stream.play"), []
    window = SimpleNamespace(background=False, is_job_running=lambda _kind: False)
    ops = SimpleNamespace(ed=SimpleNamespace(undo_push=lambda message: steps.append(message)))
    monkeypatch.setattr(play, "bpy", SimpleNamespace(app=window, ops=ops, data=bpy.data, context=bpy.context))
    playing.frame_set(5 + 60 * 24)
    play.update_rally(playing)
    assert not play._session["unwritten"] and not steps, "they stand on for a minute more"
    play.answer_now(playing, kick(core))
    play.write_rest()
    assert steps == ["Live Pass"]


def test_whom_the_user_chooses_gets_it(playing, room, core):
    play = room("stream.play")
    with pytest.raises(RuntimeError, match="Ann has the ball"):
        press_operator(OPS.stream_target, number=1)
    with pytest.raises(RuntimeError, match="1 to 3"):
        press_operator(OPS.stream_target, number=7)
    OPS.stream_target(number=3)
    assert playing.beyond_mocap_stream.target == "Cho"
    assert play.answer_now(playing, kick(core)).receiver == "Cho"
    ben = next(row.body for row in playing.beyond_mocap_passes.players if row.name == "Ben")
    play.update_rally(playing)
    bpy.context.view_layer.objects.active = ben
    play.update_rally(playing)
    assert play.find_target(playing) == "Ben"


def test_a_stream_is_answered(playing, room, core):
    """A kick that arrives over the network, told by what it is and laid into the scene."""
    port = playing.beyond_mocap_stream.port = find_free_port()
    OPS.stream_start()
    sender = core("passes.stream.sender").Sender(CLIPS / "volley_toss.bvh", port)
    thread = threading.Thread(target=sender.send_file, args=(lambda: False,))
    thread.start()
    follow_until(room, lambda: room("stream.play").get_current_rally().passes)
    thread.join()
    assert room("stream.play").get_current_rally().passes == 1 and "Ann played volley_toss" in told().played


def test_what_cannot_be_answered_is_told_and_changes_nothing(playing, room, core):
    play = room("stream.play")
    actions = {row.name: row.body.animation_data.action.name for row in playing.beyond_mocap_passes.players}
    tail = replace(kick(core), part="tail")
    play.store_strike(tail, 0.0)
    end = time.monotonic() + 60.0
    while "has the ball" in told().played and time.monotonic() < end:
        play.update_rally(playing)
        time.sleep(0.02)
    assert play.get_current_rally().passes == 0 and play.get_current_rally().holder == "Ann" and told().played
    assert actions == {row.name: row.body.animation_data.action.name for row in playing.beyond_mocap_passes.players}


def test_stop_playing(playing, room):
    assert OPS.stream_end() == {"FINISHED"}
    assert room("stream.play").get_current_rally() is None and not told().playing
    with pytest.raises(RuntimeError, match="press Play Live first"):
        OPS.stream_end()


def test_a_file_that_is_loaded_ends_it(playing, room):
    bpy.ops.wm.read_homefile(use_empty=True)
    assert room("stream.play").get_current_rally() is None


def test_it_is_one_step(playing, room):
    OPS.stream_end()
    OPS.passes_clear()
    assert_one_step(OPS.stream_play)
    assert room("stream.play").get_current_rally() is None and "Undo has ended" in told().played


def test_an_armature_can_show_how(playing, room, monkeypatch):
    """Its strike nearest to the present frame, without any stream, by the script of the how-to; not one that has none.
    """
    with pytest.raises(RuntimeError, match="no strike with the foot"):
        bpy.context.view_layer.objects.active = playing.beyond_mocap_passes.players[1].body
        press_operator(OPS.stream_act)
    page = (SAMPLE.parent / "docs" / "how-to" / "stream-live-motion.md").read_text("utf-8")
    script = page.split("### From a script")[1].split("```python")[1].split("```")[0]
    printed = []
    monkeypatch.chdir(SAMPLE.parent)
    exec(script, {"print": printed.append})
    assert "passes so far: 1" in printed[0] and "Ann played volley_toss" in printed[0]
    assert room("stream.play").get_current_rally() is None


def test_a_scene_that_is_cleared_ends_it(playing, room):
    OPS.passes_clear()
    assert all(row.body is None for row in playing.beyond_mocap_passes.players)
    room("stream.play").update_rally(playing)
    assert room("stream.play").get_current_rally() is None and "cleared" in told().played


def test_choosing_is_one_step(playing):
    assert_one_step(OPS.stream_target, number=3)


def test_an_unknown_holder_is_told(playing):
    with pytest.raises(RuntimeError, match="holder"):
        press_operator(OPS.stream_play, holder="Zoe")


def test_two_users_pass_to_each_other(playing, room, core):
    """Ann's user kicks to Ben, whose user kicks back; a kick of one who has no ball does nothing."""
    press_operator(OPS.stream_list, what="ADD")
    first, second = playing.beyond_mocap_stream, playing.beyond_mocap_stream.further[0]
    first.port, second.port, first.player, second.player = find_free_port(), find_free_port(), "Ann", "Cho"
    for number in (1, 2):
        press_operator(OPS.stream_start, number=number)
    rally = room("stream.play").get_current_rally
    with kicking(core, second.port):  # Cho's user, while Ann has the ball
        follow_until(room, lambda: bool(told().further[0].hit))
    assert rally().passes == 0
    with kicking(core, first.port):
        follow_until(room, lambda: rally().passes == 1)
    assert rally().holder == "Cho", "the next with a user, not Ben, who is the next of the list"
    playing.frame_set(int(5 + 24 * rally().ready_time) + 2)
    with kicking(core, second.port):
        follow_until(room, lambda: rally().passes == 2)
    assert rally().holder == "Ann"


def test_a_player_of_no_scene_is_told(playing, room):
    playing.beyond_mocap_stream.port, playing.beyond_mocap_stream.player = find_free_port(), "Zoe"
    OPS.stream_start()
    with pytest.raises(RuntimeError, match="no player 'Zoe' in the passing scene"):
        press_operator(OPS.stream_play)


def test_a_renamed_player_keeps_the_stream(playing):
    playing.beyond_mocap_stream.player = "Ann"
    playing.beyond_mocap_passes.players["Ann"].name = "Anna"
    assert playing.beyond_mocap_stream.player == "Anna"
