"""A stream in Blender: a body does what arrives, strikes are recognised, and nothing else in the file changes."""

import pathlib
import socket
import threading
import time

import bpy
import numpy as np
import pytest
from conftest import find_free_port
from stream_room import room  # noqa: F401
from undo import assert_one_step, collect_state, press_operator

CLIP = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library" / "kick_low_top.bvh"
OPS = bpy.ops.beyond_mocap


@pytest.fixture
def port():
    bpy.context.scene.beyond_mocap_stream.port = find_free_port()
    return bpy.context.scene.beyond_mocap_stream.port


def told():
    return bpy.context.window_manager.beyond_mocap_streaming


def send(core, port, rate, way="udp", path=CLIP):
    """Start a sender; returns its thread."""
    sender = core("passes.stream.sender").Sender(path, port, way, rate=rate)
    thread = threading.Thread(target=sender.send_file, args=(lambda: False,))
    thread.start()
    return thread


def follow(room, thread, seconds=20.0):
    """Look until the sender has gone and nothing new has arrived for 0.4 s; the strikes that were recognised."""
    stream, found, end = room("stream.follow"), [], time.monotonic() + seconds
    shown, rest = None, end
    while time.monotonic() < min(end, rest):
        found.extend(stream.update_streams(bpy.context.scene))
        latest = (listener := stream.find_listener(bpy.context.scene)) and listener.latest_frame()
        if thread.is_alive() or (latest and latest.number != shown):
            shown, rest = latest and latest.number, time.monotonic() + 0.4
        time.sleep(0.01)
    return found


def test_the_body_does_what_arrives(room, core, port):
    assert press_operator(OPS.stream_start) == {"FINISHED"}
    follow(room, send(core, port, 600.0))
    body = bpy.context.scene.beyond_mocap_stream.body
    assert body is not None and body.name == "Stream" and body.animation_data is None
    motion = core("files.bvh.bvh").read_bvh(CLIP).motion
    places, _ = core("motion.motion").forward_kinematics(motion)
    bpy.context.view_layer.update()
    shown = np.array([(body.matrix_world @ body.pose.bones[name].head)[:] for name in motion.skeleton.names])
    np.testing.assert_allclose(shown, places[-1], atol=2e-3)
    assert told().state in ("receiving", "stalled") and "Frames: 2" in told().figures


def test_its_place_and_units_are_the_scenes(room, core, port):
    bpy.context.scene.unit_settings.system, bpy.context.scene.unit_settings.scale_length = "METRIC", 0.01
    bpy.context.scene.beyond_mocap_stream.protocol = "tcp"  # a busy machine drops datagrams
    OPS.stream_start()
    follow(room, send(core, port, 600.0, "tcp"))
    body = bpy.context.scene.beyond_mocap_stream.body
    motion = core("files.bvh.bvh").read_bvh(CLIP).motion
    bpy.context.view_layer.update()
    hips = body.matrix_world @ body.pose.bones[motion.skeleton.names[0]].head
    np.testing.assert_allclose(np.array(hips) / 100.0, motion.root_positions[-1], atol=2e-3)


def test_it_can_be_put_aside(room, core, port):
    """Moved and turned by the user, and lying as some imported armatures do."""
    bpy.context.scene.beyond_mocap_stream.protocol = "tcp"  # a busy machine drops datagrams
    OPS.stream_start()
    follow(room, send(core, port, 600.0, "tcp"))
    body = bpy.context.scene.beyond_mocap_stream.body
    motion = core("files.bvh.bvh").read_bvh(CLIP).motion
    bpy.context.view_layer.update()
    upright = np.array([(body.matrix_world @ body.pose.bones[name].head)[:] for name in motion.skeleton.names])
    body.location, body.rotation_euler = (3.0, 1.0, 0.0), (0.0, 0.0, np.pi / 2)
    bpy.context.view_layer.update()
    follow(room, send(core, port, 600.0, "tcp"))
    bpy.context.view_layer.update()
    moved = np.array([(body.matrix_world @ body.pose.bones[name].head)[:] for name in motion.skeleton.names])
    np.testing.assert_allclose(moved, upright[:, (1, 0, 2)] * [-1.0, 1.0, 1.0] + [3.0, 1.0, 0.0], atol=2e-3)


def test_a_kick_is_recognised_and_told(room, port, monkeypatch):
    """Each frame arrives at its time in the recording, by a clock of the test: a busy machine delivers frames late and
    in bunches, which are other speeds."""
    OPS.stream_start()
    stream, now, hits = room("stream.follow"), time.monotonic(), []
    monkeypatch.setattr(time, "monotonic", lambda: now)
    header, _, rows = CLIP.read_text("utf-8").partition("MOTION")
    _, frame_time, *rows = rows.strip().splitlines()
    for piece in (header, *rows):
        stream.find_listener(bpy.context.scene)._add_bytes(piece.encode(), whole=True)
        hits += stream.update_streams(bpy.context.scene)
        now += float(frame_time.split()[-1])
    end = time.perf_counter() + 20.0
    while not hits and time.perf_counter() < end:  # the stream's thread looks when it can
        hits += stream.update_streams(bpy.context.scene)
        time.sleep(0.01)
    assert [hit.side for hit in hits] == ["right"] and "right foot" in told().hit


def test_a_recording_can_be_kept(room, core, port):
    OPS.stream_start()
    follow(room, send(core, port, 200.0))
    bpy.context.scene.frame_set(11)
    assert_one_step(OPS.stream_keep, seconds=1.0)
    OPS.stream_keep(seconds=1.0)
    body = bpy.data.objects["Recorded"]
    first, last = body.animation_data.action.frame_range
    assert first == 11.0 and 20 <= last - first <= 25


@pytest.mark.parametrize("rubbish", [b"hello", b"\xff\x00" * 300, b"1 2 3\n", b"HIERARCHY\n}}}\n", b"HIERARCHY ROOT"])
def test_rubbish_changes_nothing(room, port, rubbish):
    before = collect_state()
    OPS.stream_start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for _ in range(20):
            out.sendto(rubbish, ("127.0.0.1", port))
    end = time.monotonic() + 5.0
    while "invalid pieces" not in told().line and time.monotonic() < end:  # the first alone is "1 invalid piece"
        room("stream.follow").update_streams(bpy.context.scene)
        time.sleep(0.02)
    assert "invalid pieces" in told().line
    OPS.stream_stop()
    after = collect_state()
    assert {name: after[name] for name in before} == before


def test_rubbish_amid_frames_is_left_out(room, core, port):
    OPS.stream_start()
    thread = send(core, port, 200.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for _ in range(20):
            out.sendto(b"rubbish 1 2 3", ("127.0.0.1", port))
            time.sleep(0.02)
    follow(room, thread)
    assert "Invalid Pieces: 2" in told().figures and bpy.context.scene.beyond_mocap_stream.body is not None


def test_a_stream_that_stops_is_told_and_the_pose_stays(room, core, port, monkeypatch):
    monkeypatch.setattr(core("passes.stream.listener"), "STALL_SECONDS", 0.1)
    OPS.stream_start()
    follow(room, send(core, port, 600.0))
    room("stream.follow").write_status((bpy.context.scene.session_uid, 1))
    assert told().state == "stalled" and "no frame" in told().line
    before = [tuple(bone.rotation_quaternion) for bone in bpy.context.scene.beyond_mocap_stream.body.pose.bones]
    room("stream.follow").update_streams(bpy.context.scene)
    assert before == [tuple(bone.rotation_quaternion) for bone in bpy.context.scene.beyond_mocap_stream.body.pose.bones]


def test_a_file_that_is_loaded_ends_the_stream(room, core, port, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    OPS.stream_start()
    listener = room("stream.follow").find_listener(bpy.context.scene)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert room("stream.follow").find_listener(bpy.context.scene) is None and not listener.is_running
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(("127.0.0.1", port))


def test_a_taken_port_is_told(room, port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", port))
        with pytest.raises(RuntimeError, match="not available"):
            press_operator(OPS.stream_start)
    assert not told().on


def test_what_cannot_be_pressed_says_why(room, port):
    with pytest.raises(RuntimeError, match="press Start Stream first"):
        OPS.stream_stop()
    OPS.stream_start()
    with pytest.raises(RuntimeError, match="press Stop Stream first"):
        OPS.stream_start()
    with pytest.raises(RuntimeError, match="nothing has arrived yet"):
        press_operator(OPS.stream_keep)


def test_a_suits_file_that_is_none(room, port, tmp_path):
    bpy.context.scene.beyond_mocap_stream.clip = str(tmp_path / "none.bvh")
    with pytest.raises(RuntimeError, match="no such file"):
        press_operator(OPS.stream_start)
    assert room("stream.follow").find_listener(bpy.context.scene) is None


def test_a_body_that_was_removed_is_made_anew(room, core, port):
    OPS.stream_start()
    follow(room, send(core, port, 600.0))
    bpy.data.objects.remove(bpy.context.scene.beyond_mocap_stream.body)
    follow(room, send(core, port, 600.0))
    assert bpy.context.scene.beyond_mocap_stream.body is not None


def test_a_stream_that_is_given_up_says_why(room, core, port, monkeypatch):
    monkeypatch.setattr(room("stream.follow"), "MOST_BODIES", 0)
    OPS.stream_start()
    follow(room, send(core, port, 600.0))
    told = bpy.context.window_manager.beyond_mocap_streaming
    assert not told.on and told.state == "failed" and "skeleton has changed" in told.line
    scene = bpy.context.scene
    assert room("stream.follow").find_listener(scene) is None and scene.beyond_mocap_stream.body is None


def test_a_chosen_armature_is_used(room, core, port):
    bpy.ops.beyond_mocap.import_clips(filepath=str(CLIP))
    mine = bpy.context.object
    mine.animation_data_clear()
    bpy.context.scene.beyond_mocap_stream.body = mine
    OPS.stream_start()
    follow(room, send(core, port, 600.0))
    assert bpy.context.scene.beyond_mocap_stream.body == mine and "Stream" not in bpy.data.objects
