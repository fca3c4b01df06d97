"""Play Live in the window, measured: from a streamed strike to the first drawing of its answer."""

import os
import subprocess
import threading
import time

import bpy
import numpy as np
from tab import copy_sample, import_module, output, report_time, run_operator, wait_until, window

PORT = 7361 + os.getpid() % 997  # another session's stream may be on this machine
KICK = "passes/library/volley_pass.bvh"


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
        bpy.app.handlers.frame_change_pre.insert(0, self.note_frame)  # before the writing
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

    def count_drawings(self):
        """Drawings that ended since the strike was noticed, up to the first one of the answer."""
        return sum(self.seconds["noticed"] < moment <= self.seconds["drawn"] for moment in self.drawings)

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
    play, hit = import_module("scene.stream.play"), find_streamed_hit()

    def is_planned():
        """For now: the end of the last stream may look like one more strike, after which another player has the ball"""
        ahead, target = play._session["ahead"], play.find_target(get_scene())
        return play._session["watchers"] is None and ahead.find(ahead.request_for(hit, target, 0)) is not None

    yield from wait_until(lambda: players_stand() and is_planned(), what="the answer is planned ahead")
    names = get_rally().holder, play.find_target(get_scene())
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
    return noted


def report_answer(noted, changed, label):
    """Say and check when an answer began; from frame `changed` on passer and receiver both move by it."""
    struck, rate = noted.seconds["struck"], get_scene().render.fps
    after = {name: noted.seconds[name] - struck for name in ("noticed", "began", "written", "drawn")}
    drawing, delay = noted.measure_drawing(), changed - noted.find_struck_frame()
    output.write_line(f"     {label}: after the strike, s: noticed {after['noticed']:.2f}, the drawing under way ended "
                      f"{after['began']:.2f}, in the keys {after['written']:.2f} (processor {noted.worked:.3f}), drawn "
                      f"{after['drawn']:.2f}; one drawing takes {drawing:.2f}")
    drawn = noted.count_drawings()
    assert drawn <= 3, f"{drawn} drawings after it was noticed"  # that under way, and the next: on any machine
    assert -1.0 <= delay <= max(0.3, after["noticed"]) * rate + 1.0, (
        f"its first frame is {delay} after the strike's")
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


def show_fast_drawing():
    """Let the software draw about as fast as a graphics card would: a small window, only the view is drawn, wireframes,
    bodies without meshes. Return what undoes it."""
    space = window.find_area("VIEW_3D").spaces.active
    others = [(area, area.type) for area in window.window.screen.areas if area.type != "VIEW_3D"]
    meshes = [one for one in bpy.data.objects if one.type == "MESH" and one.parent and not one.hide_viewport]
    size, shading = (window.window.width, window.window.height), space.shading.type
    for area, _ in others:
        area.type = "CONSOLE"
    for mesh in meshes:
        mesh.hide_viewport = True
    space.shading.type, space.overlay.show_overlays = "WIREFRAME", False
    resize_window(480, 360)

    def back():
        resize_window(*size)
        space.shading.type, space.overlay.show_overlays = shading, True
        for area, kind in others:
            area.type = kind
        for mesh in meshes:
            mesh.hide_viewport = False

    return back


def resize_window(width, height):
    """Resize Blender's window."""
    found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", "Blender"], capture_output=True, text=True,
                           check=True).stdout.split()
    subprocess.run(["xdotool", "windowsize", found[0], str(width), str(height)], check=True)


def measure_fast_answers(port, count):
    """Seconds by the clock of `count` strikes in turn, each from when it was sent to the first drawing of its answer,
    and seconds of a drawing, while the drawing is fast."""
    back, found = show_fast_drawing(), []
    try:
        for number in range(count):
            noted = yield from measure_answer(port, f"fast drawing, strike {number + 1}")
            found.append((noted.seconds["drawn"] - noted.seconds["struck"], noted.measure_drawing()))
    finally:
        back()
    return np.array(found)
