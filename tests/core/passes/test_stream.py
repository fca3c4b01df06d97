"""A BVH stream taken apart, listened to, sent, and the hits in it."""

import random
import socket
import threading
import time

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.passes.stream.bvh_stream import BvhStream, read_hierarchy
from beyond_mocap.passes.stream.listener import LOOPBACK, Listener, convert_poses
from beyond_mocap.passes.stream.live_hits import LiveHits
from beyond_mocap.passes.stream.sender import Sender
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gestures import build_strike


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Two seconds of walking at 60 frames a second."""
    path = tmp_path_factory.mktemp("stream") / "walk.bvh"
    bvh.write_bvh(path, build_gait(1.4, 2.0, 60.0))
    return path


@pytest.fixture(scope="module")
def text(clip):
    return clip.read_text()


@pytest.fixture
def port():
    """A port that nobody uses just now."""
    with socket.socket() as one:
        one.bind((LOOPBACK, 0))
        return one.getsockname()[1]


def rows_of(text):
    return text.split("Frame Time:")[1].split("\n", 1)[1].strip().split("\n")


def wait_for(condition, seconds=60.0):
    """The limit is for what never comes; a busy machine gets there long before."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    assert condition()


@pytest.mark.parametrize("size", [1, 7, 100, 10**6])
def test_a_file_in_pieces_is_the_file(clip, text, size):
    """However the network cuts it."""
    stream, frames, data = BvhStream(), [], text.encode()
    for start in range(0, len(data), size):
        frames += stream.feed(data[start : start + size])
    motion = bvh.read_bvh(clip).motion
    root, rotations = stream.rows.compute_poses(np.array([frame.values for frame in frames]))
    assert len(frames) == len(motion) and stream.invalid_count == 0 and stream.frame_time == pytest.approx(1 / 60.0,
            abs=1e-6)
    assert stream.rows.skeleton.has_same_bones(motion.skeleton)
    np.testing.assert_allclose(root, motion.root_positions, atol=1e-9)
    np.testing.assert_allclose(np.abs(np.sum(rotations * motion.rotations, axis=-1)), 1.0, atol=1e-9)


def test_the_neuron_form_needs_a_hierarchy(clip, text):
    rows = " || ".join("0 Avatar00 " + row for row in rows_of(text)[:5]) + " ||"
    blind = BvhStream()
    assert blind.feed(rows.encode()) == [] and blind.invalid_count == 5 and "hierarchy" in blind.last_error
    told = BvhStream(read_hierarchy(clip))
    assert len(told.feed(rows.encode())) == 5 and told.invalid_count == 0


def test_only_the_first_avatar_is_taken(clip, text):
    stream, row = BvhStream(read_hierarchy(clip)), rows_of(text)[0]
    frames = stream.feed(f"0 Anna {row} || 1 Bert {row} || 0 Anna {row} ||".encode())
    assert len(frames) == 2 and stream.other_avatars == 1 and stream.invalid_count == 0


def test_rubbish_is_no_avatar_and_after_a_loss_another_one_may_come(clip, text):
    stream = BvhStream(read_hierarchy(clip))
    assert stream.feed(b"hello there friend\n7 Nobody 1 2 ||") == [] and stream.invalid_count == 2
    for name in ("First", "Second"):
        assert len(stream.feed(f"0 {name} {rows_of(text)[0]} ||".encode())) == 1 and stream.other_avatars == 0
        stream.drop_partial()


def test_the_clock_is_read(clip, text):
    stream = BvhStream(read_hierarchy(clip))
    frames = stream.feed(f"# a remark\n# sent 12.5\n{rows_of(text)[0]}\n{rows_of(text)[1]}\n".encode())
    assert [frame.sent for frame in frames] == [12.5, None]


def test_a_hierarchy_that_comes_again_changes_nothing(text):
    stream = BvhStream()
    stream.feed(text.encode())
    rows = stream.rows
    assert len(stream.feed(text.encode())) == len(rows_of(text)) and stream.rows is rows


@pytest.mark.parametrize("rubbish", [
    b"hello there\n", b"\x00\xff\xfe\x80\n", b"1 2 3\n", b"nan " * 60 + b"\n", b"1e300 " * 60 + b"\n", b"}}}{{{\n",
    b"HIERARCHY\nROOT a\n{\nOFFSET x y z\n}\n", b"HIERARCHY\n}\n", b"||||||\n",
    b"MOTION\nFrames: many\nFrame Time: x\n",
    b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 9 a b c\n}\n",
])  # fmt: skip
def test_rubbish_is_counted_and_left_out(text, rubbish):
    stream = BvhStream()
    stream.feed(text.encode())
    before, skeleton = stream.invalid_count, stream.rows.skeleton
    assert stream.feed(rubbish) == []
    assert stream.rows.skeleton is skeleton
    assert len(stream.feed((rows_of(text)[0] + "\n").encode())) == 1
    assert stream.invalid_count > before or rubbish.startswith((b"||", b"MOTION"))


def test_a_thousand_spoilt_streams_raise_nothing(text):
    chance = random.Random(6)
    for _ in range(300):
        data = bytearray(text[: chance.randrange(200, 6000)].encode())
        for _ in range(chance.randrange(1, 30)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        stream = BvhStream()
        stream.feed(bytes(data), whole=chance.random() < 0.5)
        stream.feed(text.encode())


def test_a_line_without_an_end_does_not_fill_the_memory():
    stream = BvhStream()
    for _ in range(40):
        stream.feed(b"1 " * 50000)
    assert stream.invalid_count and len(stream._partial) <= 2 << 20


@pytest.mark.parametrize("way, protocol", [("udp", "udp"), ("tcp", "tcp"), ("serve", "call")])
@pytest.mark.parametrize("form", ["bvh", "neuron"])
def test_what_is_sent_arrives(clip, port, way, protocol, form):
    sender = Sender(clip, port, way, form, rate=400.0)
    thread = threading.Thread(target=sender.send_file, args=(lambda: False,))
    if way == "serve":
        thread.start()
        time.sleep(0.1)
    listener = Listener(port, protocol, read_hierarchy(clip) if form == "neuron" else None).start()
    try:
        if way != "serve":
            thread.start()
        thread.join(10.0)
        wait_for(lambda: listener.measure_status().frames >= len(sender.rows))
        motion, status = bvh.read_bvh(clip).motion, listener.measure_status()
        skeleton, root, rotations = convert_poses(listener.frames_since(0))
        np.testing.assert_allclose(root, motion.root_positions, atol=1e-5)
        assert status.invalid_count == 0 and skeleton.has_same_bones(motion.skeleton)
        assert (status.delay is not None and 0.0 <= status.delay < 10.0) == (form == "bvh")
        assert [one.number for one in listener.frames_since(status.frames - 3)] == list(
            range(status.frames - 2, status.frames + 1)
        )
    finally:
        listener.stop()
    assert not listener.is_running and listener.measure_status().state == "stopped"


def test_it_listens_to_this_machine_only(port):
    listener = Listener(port).start()
    try:
        assert listener._server.getsockname()[0] == "127.0.0.1"
    finally:
        listener.stop()


def test_a_port_in_use_is_told(port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind((LOOPBACK, port))
        with pytest.raises(InputError, match=f"port {port}: not available"):
            Listener(port, "udp").start()


def test_a_port_is_free_again_after_stop(port):
    for protocol in ("udp", "tcp", "udp"):
        listener = Listener(port, protocol).start()
        listener.stop()
        listener.stop()
        assert not listener.is_running


@pytest.mark.parametrize("arguments, said", [(dict(port=80), "1024"), (dict(protocol="smoke"), "udp, tcp")])
def test_bad_input_is_told(arguments, said):
    with pytest.raises(InputError, match=said):
        Listener(**arguments)


def test_nobody_listening_is_told(clip, port):
    with pytest.raises(InputError, match="no listener"):
        Sender(clip, port, "tcp").send_file(lambda: False)


def test_a_sender_that_goes_and_comes_again(clip, port):
    listener = Listener(port, "tcp").start()
    try:
        Sender(clip, port, "tcp", rate=600.0).send_file(lambda: False)
        wait_for(lambda: listener.measure_status().state == "ended")
        assert "closed" in listener.measure_status().line
        before = listener.measure_status().frames
        Sender(clip, port, "tcp", rate=600.0).send_file(lambda: False)
        wait_for(lambda: listener.measure_status().frames == 2 * before)
    finally:
        listener.stop()


def test_a_stream_that_stops_is_told(clip, port, monkeypatch):
    monkeypatch.setattr("beyond_mocap.passes.stream.listener.STALL_SECONDS", 0.1)
    listener = Listener(port).start()
    try:
        Sender(clip, port, rate=600.0).send_file(lambda: False)
        wait_for(lambda: listener.measure_status().state == "stalled")
        assert "no frame for" in listener.measure_status().line
    finally:
        listener.stop()


def test_rubbish_over_the_network_hangs_nothing(port):
    listener = Listener(port).start()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for _ in range(50):
                out.sendto(b"x" + random.Random(6).randbytes(500), (LOOPBACK, port))
        wait_for(lambda: listener.measure_status().invalid_count >= 50)
        assert "invalid pieces" in listener.measure_status().line and listener.is_running
    finally:
        listener.stop()


def test_another_hierarchy_takes_no_frame_from_the_body_that_is_shown(port, text):
    """Frames keep the hierarchy that they came with, also while the next one's first frame is not there yet."""
    listener = Listener(port).start()
    other = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n}\n"
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.connect((LOOPBACK, port))
            for piece in (text.split("MOTION")[0], rows_of(text)[0], rows_of(text)[1], other, "1 2"):
                out.send(piece.encode())
        wait_for(lambda: listener.measure_status().invalid_count == 1)
        skeleton, root, _ = convert_poses(listener.frames_since(0))
        assert len(root) == 2 and len(skeleton.names) > 10
    finally:
        listener.stop()


def test_a_second_connection_takes_over(clip, port):
    listener = Listener(port, "tcp").start()
    try:
        with socket.create_connection((LOOPBACK, port)):
            time.sleep(0.1)
            Sender(clip, port, "tcp", rate=600.0).send_file(lambda: False)
            wait_for(lambda: listener.measure_status().frames == 121)
    finally:
        listener.stop()


class Played:
    """Stands for a listener: frames of a motion that have arrived up to some second."""

    def __init__(self, path):
        stream = BvhStream()
        self.frames, self.now, self.late = stream.feed(path.read_bytes()), 0.0, None
        self.step = stream.frame_time

    def frames_since(self, number):
        from beyond_mocap.passes.stream.listener import StreamFrame

        count = min(int(self.now / self.step) + 1, len(self.frames))
        some = enumerate(self.frames[number:count], start=number)
        return [StreamFrame(
            number=n + 1, time=n * self.step, sent=self.late and n * self.step - self.late, values=frame.values,
            rows=frame.rows,
        ) for n, frame in some]


@pytest.mark.parametrize("fps, every", [(30.0, 0.05), (60.0, 0.05), (120.0, 0.05), (60.0, 0.5)])
def test_a_kick_is_recognised_once_while_it_arrives(tmp_path, fps, every):
    """Also by a busy program that looks every half second: at its next look."""
    made = build_strike("kick low top", fps=fps)
    bvh.write_bvh(tmp_path / "kick.bvh", made.motion)
    played = Played(tmp_path / "kick.bvh")
    watch, found = LiveHits(played), []
    for played.now in np.arange(0.0, made.motion.duration, every):
        hit = watch.find_new_hit()
        found += [(*hit, played.now)] if hit else []
    assert len(found) == 1
    hit, moment, now = found[0]
    assert hit.side == "right" and abs(moment - made.key) < 0.1 and now - made.key < 0.15 + every


def test_a_strike_is_dated_by_when_it_was_sent(tmp_path):
    """Unless the sender has another clock."""
    bvh.write_bvh(tmp_path / "kick.bvh", build_strike("kick low top", fps=60.0).motion)
    played, moments = Played(tmp_path / "kick.bvh"), []
    played.now = 1000.0
    for played.late in (None, 0.1, 50.0, -50.0):
        moments.append(LiveHits(played).find_new_hit()[1])
    assert np.allclose(moments, moments[0] - np.array([0.0, 0.1, 0.0, 0.0]))


def test_the_thread_finds_the_kick_once_says_an_error_once_and_ends_with_the_listener(tmp_path):
    made = build_strike("kick low top", fps=60.0)
    bvh.write_bvh(tmp_path / "kick.bvh", made.motion)
    played, threads = Played(tmp_path / "kick.bvh"), threading.active_count()
    played.is_running, played.now = True, 1000.0  # all has arrived
    watch, lacks = LiveHits(played).start(), LiveHits(played, "tail").start()
    wait_for(lambda: not watch._found.empty() and not lacks._found.empty())
    assert watch.take_hit()[0].side == "right"
    with pytest.raises(InputError, match="tail"):
        lacks.take_hit()
    played.frames = played.frames + played.frames[-1:]  # they look again
    wait_for(lambda: watch._last_number == lacks._last_number == len(played.frames))
    played.is_running = False
    wait_for(lambda: threading.active_count() == threads)
    assert watch.take_hit() is None and lacks.take_hit() is None


def test_walking_is_no_hit(tmp_path, clip):
    played = Played(clip)
    watch = LiveHits(played)
    for played.now in np.arange(0.0, 2.0, 0.1):
        assert watch.find_new_hit() is None


def test_the_verb_sends_a_clip(clip, port, capsys):
    listener = Listener(port, "tcp").start()
    try:
        assert main(["stream", str(clip), "--port", str(port), "--tcp", "--fps", "600"]) == 0
        assert "121 frames sent" in capsys.readouterr().out
    finally:
        listener.stop()
    assert main(["stream", str(clip), "--port", "80"]) == 2
    assert main(["stream", str(clip.with_name("none.bvh"))]) == 2
    assert main(["stream", str(clip), "--port", str(port), "--tcp"]) == 2
    assert "no listener" in capsys.readouterr().err
