"""Live Stream and Play Live in the window: a body does what arrives, strikes are answered while the scene plays."""

import math
import os
import threading
import time

import bpy
import mathutils
import numpy as np
from ball_checks import find_object, isolate_panel, select_objects
from tab import (
    PICTURES,
    assert_no_errors_since,
    click_operator,
    copy_sample,
    import_module,
    output,
    report_time,
    run_operator,
    wait_until,
    window,
)

PORT = 7361 + os.getpid() % 997  # another session's stream may be on this machine
KICK = "passes/library/volley_pass.bvh"
SENT = {}


def get_stream_status():
    """How the stream does."""
    return bpy.context.window_manager.beyond_mocap_streaming


def get_scene():
    """The window's scene, looked up each time, since undo replaces it."""
    return window.window.scene


def start_sending(clip, loop=True, port=PORT, report=lambda frames: None):
    """Begin to send a clip; returns what ends it."""
    sender = import_module("beyond_mocap.passes.stream.sender").Sender(copy_sample() / clip, port, loop=loop)
    stop = threading.Event()
    thread = threading.Thread(target=sender.send_file, args=(stop.is_set, report))
    thread.start()

    def stop_sending():
        stop.set()
        thread.join(5.0)

    return stop_sending


def set_view(place, distance):
    """Turn the view."""
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_location, view.view_distance = place, distance
    view.view_rotation = mathutils.Euler((math.radians(70), 0.0, math.radians(25))).to_quaternion()


def check_a_body_does_what_arrives():
    mark = len(output.text())
    bpy.data.objects.remove(find_object("Cube"))
    get_scene().beyond_mocap_stream.port = PORT
    back = yield from isolate_panel("draw_streams")
    yield from click_operator("stream_start")
    yield from wait_until(lambda: get_stream_status().on and get_stream_status().state == "waiting",
                          what=lambda: get_stream_status().state)
    SENT["end"] = start_sending("passes/library/volley_pass.bvh")
    yield from wait_until(lambda: get_scene().beyond_mocap_stream.body is not None)
    set_view((0.0, 0.0, 0.9), 5.0)
    yield from wait_until(lambda: "Latency" in get_stream_status().figures and get_stream_status().hit)
    places = set()

    def iter_positions():
        places.add(tuple(round(value, 3) for value in get_scene().beyond_mocap_stream.body.pose.bones[0].location))
        return len(places) > 2

    yield from wait_until(iter_positions, what="it stands still")
    output.write_line(f"     {' ; '.join(get_stream_status().figures.splitlines())} ; {get_stream_status().hit}")
    yield from window.move_pointer(300, 300)
    yield 1.0
    window.save_picture(PICTURES / "stream.png")
    back()
    assert_no_errors_since(mark)


def check_a_stopped_stream_is_reported():
    mark = len(output.text())
    SENT.pop("end")()
    yield from wait_until(lambda: get_stream_status().state == "stalled" and "no frame for" in get_stream_status().line,
                          what=lambda: get_stream_status().line)
    assert_no_errors_since(mark)


def check_strikes_are_answered_while_the_scene_plays():
    mark = len(output.text())
    get_scene().sync_mode = "FRAME_DROP"
    bpy.ops.beyond_mocap.passes_sample(sample="three")
    get_scene().beyond_mocap_passes.library_folder = str(copy_sample() / "passes" / "library")
    get_scene().beyond_mocap_stream.body.location = (2.5, 3.5, 0.0)
    set_view((0.0, 0.5, 0.6), 11.0)
    back = yield from isolate_panel("draw_play_live")
    yield from click_operator("stream_play")
    yield from wait_until(lambda: get_stream_status().playing)
    bpy.ops.screen.animation_play()
    end = start_sending("passes/library/volley_pass.bvh")
    try:
        rally = import_module("scene.stream.play").get_current_rally
        yield from wait_until(lambda: rally() is None or rally().passes >= 1)
        assert rally() is not None, get_stream_status().played
        frame, passes, holder = get_scene().frame_current, rally().passes, rally().holder
        output.write_line(f"     {' / '.join(get_stream_status().played.splitlines())} ; frame {frame}")
        yield from window.move_pointer(300, 300)
        yield 1.5
        window.save_picture(PICTURES / "play_live.png")
        yield from wait_until(lambda: get_scene().frame_current != frame, 60.0, "the scene goes on")
        assert (holder == "Ben" or passes > 1) and find_object("Passing Ball").animation_data
    finally:
        end()
        bpy.ops.screen.animation_cancel(restore_frame=False)
    select_objects(get_scene().beyond_mocap_passes.players["Cho"].body.name)
    yield from wait_until(lambda: import_module("scene.stream.play").find_target(get_scene()) == "Cho" or rally().holder
                          == "Cho")
    yield from click_operator("stream_end")
    yield from wait_until(lambda: rally() is None and not get_stream_status().playing)
    back()
    assert_no_errors_since(mark)


def get_rally():
    """The rally that is played; None where there is none."""
    return import_module("scene.stream.play").get_current_rally()


def find_strike_frame():
    """Number of the sent frame in which the clip's part is fastest, from 1."""
    motion = import_module("beyond_mocap.files.bvh.bvh").read_bvh(copy_sample() / KICK).motion
    return import_module("beyond_mocap.passes.hits").detect_hits(motion).strongest.key + 1


class AnswerTimes:
    """Notes when a streamed strike is done, noticed in its thread, answered and drawn, and the scene's frames."""

    def __init__(self, port):
        self.seconds, self.worked, self.drawings, self.frames = {}, 0.0, [], []
        self.passes, self.strike = get_rally().passes, find_strike_frame()
        streams = import_module("scene.stream.follow")._streams.values()
        self.hits = next(one.hits for one in streams if one.listener.port == port)
        self.play = import_module("scene.stream.play")

    def note_sent(self, count):
        """A frame has been sent."""
        if count == self.strike:
            self.seconds["struck"] = time.monotonic()

    def find_new_hit(self):
        """As of `LiveHits`, which calls it in its thread."""
        found = type(self.hits).find_new_hit(self.hits)
        if found is not None:
            self.seconds.setdefault("noticed", time.monotonic())
        return found

    def apply_pass(self, *arguments):
        """As of `play`; the time of the processor is that of the main thread."""
        start, worked = time.monotonic(), time.thread_time()
        self.apply(*arguments)
        if get_rally() is not None and get_rally().passes > self.passes and "written" not in self.seconds:
            self.seconds.update(began=start, written=time.monotonic())
            self.worked = time.thread_time() - worked

    def note_frame(self, scene, *_):
        """The playback has come to a frame."""
        self.frames.append((time.monotonic(), scene.frame_current))

    def note_drawing(self):
        """The view has been drawn."""
        self.drawings.append(time.monotonic())
        if "written" in self.seconds:
            self.seconds.setdefault("drawn", self.drawings[-1])

    def __enter__(self):
        self.apply, self.play._apply_pass = self.play._apply_pass, self.apply_pass
        self.hits.find_new_hit = self.find_new_hit
        bpy.app.handlers.frame_change_pre.append(self.note_frame)
        self.drawing = bpy.types.SpaceView3D.draw_handler_add(self.note_drawing, (), "WINDOW", "POST_PIXEL")
        return self

    def __exit__(self, *_):
        self.play._apply_pass = self.apply
        del self.hits.find_new_hit
        bpy.app.handlers.frame_change_pre.remove(self.note_frame)
        bpy.types.SpaceView3D.draw_handler_remove(self.drawing, "WINDOW")

    def measure_drawing(self):
        """Seconds from one drawing to the next, up to the strike."""
        until = [moment for moment in self.drawings if moment < self.seconds["struck"]]
        return float(np.median(np.diff(until)))

    def find_struck_frame(self):
        """The frame of the scene at the moment of the strike, were it drawn without a pause."""
        times, frames = np.transpose(self.frames)
        return float(np.interp(self.seconds["struck"], times, frames))


def read_keys(name):
    """A player's keys: the frame of the first one, and rotations (F, n)."""
    action, body = import_module("scene.core.action"), get_scene().beyond_mocap_passes.players[name].body
    motion = action.read_motion(body, get_scene())
    return action.find_first_frame(body), motion.rotations.reshape(len(motion), -1)


def find_changed_frame(before, after):
    """The first frame on which keys differ; those before it have to be there, and as they were."""
    assert before[0] == after[0], "keys before the pass are missing"
    count = min(len(before[1]), len(after[1]))
    same = (np.abs(before[1][:count] - after[1][:count]) < 1e-4).all(axis=1)
    return before[0] + int(np.argmin(same))


def players_stand():
    """Whether the last pass is over and all of it is in the keys."""
    play = import_module("scene.stream.play")
    return play.compute_rally_seconds(get_scene()) > get_rally().ready_time and not play._session["unwritten"]


def measure_answer(port, label):
    """Stream a clip with a strike to a port; say when its answer begins. In the scene that is the same however slowly
    the view is drawn."""
    ahead = import_module("scene.stream.play")._session["ahead"]
    target = import_module("scene.stream.play").find_target(get_scene())
    request = ahead.request_for(find_streamed_hit(), target, 0)
    yield from wait_until(lambda: ahead.find(request) is not None, what="the answer is planned ahead")
    yield from wait_until(players_stand)
    names = get_rally().holder, target
    before = [read_keys(name) for name in names]
    with AnswerTimes(port) as noted:
        yield from wait_until(lambda: len(noted.drawings) > 4)
        end = start_sending(KICK, False, port, noted.note_sent)
        try:
            yield from wait_until(lambda: "drawn" in noted.seconds, 60.0,
                                  lambda: f"{noted.seconds} {get_stream_status().played}")
        finally:
            end()
    changed = [find_changed_frame(old, read_keys(name)) for old, name in zip(before, names)]
    report_answer(noted, max(changed), label)


def report_answer(noted, changed, label):
    """Say and check when an answer began; from frame `changed` on passer and receiver both move by it."""
    struck, rate = noted.seconds["struck"], get_scene().render.fps
    after = {name: noted.seconds[name] - struck for name in ("noticed", "began", "written", "drawn")}
    drawing, delay = noted.measure_drawing(), changed - noted.find_struck_frame()
    output.write_line(f"     {label}: after the strike, s: noticed {after['noticed']:.2f}, the drawing under way ended "
                      f"{after['began']:.2f}, in the keys {after['written']:.2f} (processor {noted.worked:.3f}), drawn "
                      f"{after['drawn']:.2f}; one drawing takes {drawing:.2f}")
    assert -1.0 <= delay <= max(0.3, after["noticed"]) * rate + 1.0, f"its first frame is {delay} after the strike's"
    report_time(f"{label}: in the scene, {delay:.1f} frames, s", delay / rate, 0.3)
    report_time(f"{label}: noticed and written, s", after["noticed"] + noted.worked, 0.3)
    report_time(f"{label}: drawn, s", after["drawn"], 0.3 + 2.0 * drawing)


def find_streamed_hit():
    """The clip's strike as it is recognised under way."""
    motion = import_module("beyond_mocap.files.bvh.bvh").read_bvh(copy_sample() / KICK).motion
    return import_module("beyond_mocap.passes.hits").detect_hits(motion).strongest


def play_scene():
    """Begin Play Live with the streams that there are, and play the scene."""
    get_scene().frame_set(1)
    bpy.ops.beyond_mocap.passes_sample(sample="three")
    get_scene().beyond_mocap_passes.library_folder = str(copy_sample() / "passes" / "library")
    run_operator("beyond_mocap.stream_play")
    yield from wait_until(lambda: get_stream_status().playing)
    bpy.ops.screen.animation_play()


def end_playing():
    """End the playback and, where no undo has done it, Play Live."""
    bpy.ops.screen.animation_cancel(restore_frame=False)
    if get_rally() is not None:
        bpy.ops.beyond_mocap.stream_end()


def show_small_wireframe():
    """Draw as little as can be: a small view, wireframes, no overlays. Return what undoes it."""
    area = window.find_area("VIEW_3D")
    space, others = area.spaces.active, {*window.window.screen.areas}
    kept = space.shading.type
    with bpy.context.temp_override(window=window.window, area=area):
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.7)
    added = next(one for one in window.window.screen.areas if one not in others)
    added.type = "CONSOLE"
    space.shading.type, space.overlay.show_overlays = "WIREFRAME", False

    def back():
        space.shading.type, space.overlay.show_overlays = kept, True
        with bpy.context.temp_override(window=window.window, area=added):
            bpy.ops.screen.area_close()

    return back


def select_within_a_pass():
    """While a pass is played, select all: the step of undo that it makes has the players' whole motion."""
    yield from wait_until(players_stand)
    bpy.ops.screen.animation_cancel(restore_frame=False)  # else a slow machine may be past the pass already
    passes, names = get_rally().passes, [row.name for row in get_scene().beyond_mocap_passes.players]
    end = start_sending(KICK, False)
    try:
        yield from wait_until(lambda: get_rally().passes > passes, 60.0)
    finally:
        end()
    assert not players_stand()
    before = {name: read_keys(name) for name in names}
    assert {first for first, _ in before.values()} == {get_scene().beyond_mocap_passes.start_frame}
    run_operator("object.select_all", action="SELECT")
    bpy.ops.screen.animation_play()
    yield from wait_until(players_stand, 60.0)
    run_operator("ed.undo")  # what was written then
    yield 0.5
    for name in names:
        first, values = read_keys(name)
        assert first == before[name][0] and np.abs(values - before[name][1]).max() < 1e-4, name


def check_one_streams_answer_comes_at_once():
    mark = len(output.text())
    yield from play_scene()
    try:
        yield from measure_answer(PORT, "one stream")
        back = show_small_wireframe()
        yield from measure_answer(PORT, "one stream, a small view with wireframes")
        back()
        yield from select_within_a_pass()
    finally:
        end_playing()
    assert_no_errors_since(mark)


def list_streamed():
    """The characters of both streams."""
    first = get_scene().beyond_mocap_stream
    return [stream.body for stream in (first, *first.further)]


def move_both(ends):
    """Send another motion to each stream, until both characters have moved; a picture is taken. What ends the senders
    is added to `ends`."""
    def list_poses():
        return [tuple(round(value, 2) for value in body.pose.bones[0].rotation_quaternion) for body in list_streamed()]

    for body, place in zip(list_streamed(), ((-2.0, 3.5, 0.0), (1.5, 3.5, 0.0))):
        body.location = place
    before = list_poses()
    for clip, port in (("library/standing_turn_left.bvh", PORT), ("library/standing_turn_right.bvh", PORT + 1)):
        ends.append(start_sending(clip, port=port))
    yield from wait_until(lambda: all(new != old for new, old in zip(list_poses(), before)), what="both move")
    yield from window.move_pointer(300, 300)
    yield 1.5
    window.save_picture(PICTURES / "two_streams.png")


def check_two_users_pass_to_each_other():
    mark = len(output.text())
    back = yield from isolate_panel("draw_streams")
    yield from click_operator("stream_list")
    yield from wait_until(lambda: len(get_scene().beyond_mocap_stream.further) == 1)
    second = get_scene().beyond_mocap_stream.further[0]
    assert second.port == PORT + 1
    get_scene().beyond_mocap_stream.player, second.player = "Ann", "Ben"
    yield from click_operator("stream_start", "number=2")
    status = get_stream_status().further[0]
    yield from wait_until(lambda: status.on and status.state == "waiting", what=lambda: status.line)
    yield from play_scene()
    ends = []
    try:
        for port, other in ((PORT, PORT + 1), (PORT + 1, PORT)):
            ends.append(start_sending("library/standing_2.bvh", port=other))  # the other user stands meanwhile
            yield from measure_answer(port, "two streams")
            ends.pop()()
        assert (get_rally().holder, get_rally().passes) == ("Ann", 2)
        yield from move_both(ends)
    finally:
        for end in ends:
            end()
        end_playing()
    yield from click_operator("stream_stop", "number=2")
    yield from wait_until(lambda: not get_stream_status().further[0].on)
    assert get_stream_status().on, "the first goes on"
    back()
    assert_no_errors_since(mark)


def check_it_is_stopped():
    mark = len(output.text())
    back = yield from isolate_panel("draw_streams")
    start = time.monotonic()
    yield from click_operator("stream_stop")
    yield from wait_until(lambda: not get_stream_status().on)
    report_time("stopped, s", time.monotonic() - start, 20.0)
    back()
    assert_no_errors_since(mark)
