"""Two streams at once: each character follows its own user, and the users pass the ball to each other."""

import pathlib
import threading
import time

import bpy
import numpy as np
import pytest
from conftest import find_free_port
from stream_room import room  # noqa: F401
from undo import press_operator

CLIP = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library" / "kick_low_top.bvh"
OTHER = CLIP.with_name("walking_1_2.bvh")
OPS = bpy.ops.beyond_mocap


@pytest.fixture
def streams():
    """Two streams, each on a port of its own."""
    first = bpy.context.scene.beyond_mocap_stream
    press_operator(OPS.stream_list, what="ADD")
    first.port, first.further[0].port = find_free_port(), find_free_port()
    return first, first.further[0]


def create_armature():
    """The armature Mine, without bones."""
    mine = bpy.data.objects.get("Mine") or bpy.data.objects.new("Mine", bpy.data.armatures.new("Mine"))
    if mine.name not in bpy.context.scene.objects:
        bpy.context.scene.collection.objects.link(mine)
    return mine


def get_status(number):
    """Status of a stream."""
    manager = bpy.context.window_manager.beyond_mocap_streaming
    return next(one for one in (manager, *manager.further) if one.number == number)


def find_listener(room, number):
    """What receives a stream of this scene."""
    return room("stream.follow").find_listener(bpy.context.scene, number)


def start_both():
    for number in (1, 2):
        assert press_operator(OPS.stream_start, number=number) == {"FINISHED"}


def follow_until(room, is_true, seconds=60.0):
    """Update until something is true."""
    end = time.monotonic() + seconds
    while not is_true():
        assert time.monotonic() < end, (get_status(1).line, get_status(2).line)
        room("stream.follow").update_streams(bpy.context.scene)
        time.sleep(0.01)


def send_all(room, core, *sent, form="bvh"):
    """Send clips at once, each to the port of a stream, and follow until all of their frames are shown."""
    senders = [core("passes.stream.sender").Sender(path, stream.port, "tcp", form=form, rate=600.0)
               for stream, path in sent]
    shown = {number: received for (_, number), received in room("stream.follow")._streams.items()}
    wanted = {stream.number: shown[stream.number].listener.measure_status().frames + len(sender.rows)
              for (stream, _), sender in zip(sent, senders)}
    threads = [threading.Thread(target=sender.send_file, args=(lambda: False,)) for sender in senders]
    for thread in threads:
        thread.start()
    follow_until(room, lambda: all(shown[number].seen == count for number, count in wanted.items()))
    for thread in threads:
        thread.join()


def measure_joints(body, motion):
    """Where the joints of a streamed character are, (J, 3) m."""
    bpy.context.view_layer.update()
    return np.array([(body.matrix_world @ body.pose.bones[name].head)[:] for name in motion.skeleton.names])


def assert_shows_the_end(core, stream, path):
    motion = core("files.bvh.bvh").read_bvh(path).motion
    joints, _ = core("motion.motion").forward_kinematics(motion)
    np.testing.assert_allclose(measure_joints(stream.body, motion), joints[-1], atol=2e-3)


def test_each_character_follows_its_own_and_one_goes_on_alone(room, core, streams):
    first, second = streams
    first.protocol = second.protocol = "tcp"  # a busy machine drops datagrams
    start_both()
    send_all(room, core, (first, CLIP), (second, OTHER))
    assert (first.body.name, second.body.name) == ("Stream", "Stream 2")
    assert_shows_the_end(core, first, CLIP)
    assert_shows_the_end(core, second, OTHER)
    press_operator(OPS.stream_stop, number=1)
    send_all(room, core, (second, CLIP))
    assert (get_status(1).on, get_status(2).on) == (False, True)
    assert_shows_the_end(core, first, CLIP)
    assert find_listener(room, 1) is None


def test_a_deleted_character_is_made_anew_and_the_other_stays(room, core, streams):
    for stream in streams:
        stream.protocol = "tcp"
    start_both()
    send_all(room, core, (streams[0], CLIP), (streams[1], OTHER))
    stays = streams[0].body
    bpy.data.objects.remove(streams[1].body)
    bpy.context.scene.frame_set(20)  # as playback does
    send_all(room, core, (streams[1], CLIP))
    assert streams[0].body == stays and get_status(1).on
    assert_shows_the_end(core, streams[0], CLIP)
    assert_shows_the_end(core, streams[1], CLIP)


def test_the_same_avatar_in_both_is_two_users(room, core, streams):
    for stream, path in zip(streams, (CLIP, OTHER)):
        stream.clip, stream.protocol = str(path), "tcp"
    start_both()
    send_all(room, core, *zip(streams, (CLIP, OTHER)), form="neuron")
    for stream, path in zip(streams, (CLIP, OTHER)):
        assert_shows_the_end(core, stream, path)


@pytest.mark.parametrize("change, says", [
    (lambda first, second: setattr(second, "port", first.port), "stream 1 receives on port"),
    (lambda first, second: [setattr(one, "player", "Ann") for one in (first, second)], "Ann already repeats"),
    (lambda first, second: [setattr(one, "body", create_armature()) for one in (first, second)],
     "armature Mine follows stream 1"),
])
def test_port_player_and_armature_are_of_one_stream_only(room, streams, change, says):
    change(*streams)
    OPS.stream_start()
    with pytest.raises(RuntimeError, match=says) as told:
        press_operator(OPS.stream_start, number=2)
    assert len(str(told.value).strip().splitlines()) == 1
    assert find_listener(room, 1).is_running and find_listener(room, 2) is None


@pytest.mark.parametrize("online", [False, True])
def test_both_listen_to_this_machine_only(room, streams, online):
    """With and without Allow Online Access: nothing comes from another machine, and nothing is sent."""
    system = bpy.context.preferences.system
    system.use_online_access = online
    try:
        start_both()
        sockets = [find_listener(room, number)._server for number in (1, 2)]
        assert {one.getsockname()[0] for one in sockets} == {"127.0.0.1"}
    finally:
        system.use_online_access = False


def test_a_saved_file_goes_on_with_both_and_closing_ends_both(room, core, streams, tmp_path):
    for stream, player in zip(streams, ("Ann", "Ben")):
        stream.protocol, stream.player = "tcp", player
    start_both()
    send_all(room, core, (streams[0], CLIP), (streams[1], OTHER))
    ports = [stream.port for stream in streams]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two.blend"))
    listeners = [find_listener(room, number) for number in (1, 2)]
    assert all(one.is_running for one in listeners)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "two.blend"))
    assert not any(one.is_running for one in listeners)
    first = bpy.context.scene.beyond_mocap_stream
    saved = (first, first.further[0])
    assert [(one.port, one.player, one.body.name) for one in saved] == [
        (ports[0], "Ann", "Stream"), (ports[1], "Ben", "Stream 2")]
    start_both()  # on the same ports, which are free again
    send_all(room, core, (saved[0], OTHER), (saved[1], CLIP))
    assert_shows_the_end(core, saved[0], OTHER)
    assert_shows_the_end(core, saved[1], CLIP)
    assert [one.body.name for one in saved] == ["Stream", "Stream 2"]


def test_undo_of_adding_a_stream_ends_it_and_not_the_other(room):
    bpy.context.scene.beyond_mocap_stream.port = find_free_port()
    bpy.ops.ed.undo_push(message="before")
    press_operator(OPS.stream_list, what="ADD")
    bpy.context.scene.beyond_mocap_stream.further[0].port = find_free_port()
    start_both()
    bpy.ops.ed.undo()
    room("stream.follow").update_streams(bpy.context.scene)
    assert not len(bpy.context.scene.beyond_mocap_stream.further)
    assert find_listener(room, 1).is_running and find_listener(room, 2) is None


def test_streams_of_two_scenes_are_their_own(room, streams):
    """The same numbers in another scene: none stands for, stops or shows the state of one in this scene."""
    start_both()
    here, follow = bpy.context.scene, room("stream.follow")
    there = bpy.data.scenes.new("Other")
    try:
        with bpy.context.temp_override(scene=there):
            press_operator(OPS.stream_list, what="ADD")
            with pytest.raises(RuntimeError, match="No stream is received"):
                press_operator(OPS.stream_stop, number=2)
            second = there.beyond_mocap_stream.further[0]
            second.port = here.beyond_mocap_stream.port
            with pytest.raises(RuntimeError, match="stream 1 of another scene receives on port"):
                press_operator(OPS.stream_start, number=2)
            second.port = find_free_port()
            press_operator(OPS.stream_start, number=2)
            assert follow.find_listener(there, 2).is_running
            press_operator(OPS.stream_list, what="REMOVE", number=2)
        assert follow.find_listener(there, 2) is None and follow.find_listener(here, 2).is_running
        assert get_status(2).on
    finally:
        bpy.data.scenes.remove(there)


def test_removing_a_stream_ends_it(room, streams):
    start_both()
    press_operator(OPS.stream_list, what="REMOVE", number=2)
    assert find_listener(room, 2) is None and find_listener(room, 1).is_running
    with pytest.raises(RuntimeError, match="stream 2: is not received"):
        press_operator(OPS.stream_stop, number=2)
