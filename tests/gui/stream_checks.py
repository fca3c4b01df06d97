"""Live Stream and Play Live in the window: a body does what arrives, strikes are answered while the scene plays."""

import math
import os
import threading
import time

import bpy
import mathutils
from ball_checks import choose, own_tab, thing
from tab import PICTURES, assert_no_trouble_since, output, press, room, sample, until, window, within

PORT = 7361 + os.getpid() % 997  # another session's stream may be on this machine
SENT = {}


def told():
    """How the stream does."""
    return bpy.context.window_manager.beyond_mocap_streaming


def scene():
    """The window's scene, looked up each time, since undo replaces it."""
    return window.window.scene


def send(clip, loop=True):
    """Begin to send a clip; returns what ends it."""
    sender = room("beyond_mocap.passes.stream.sender").Sender(sample() / clip, PORT, loop=loop)
    stop = threading.Event()
    thread = threading.Thread(target=sender.run, args=(stop.is_set,))
    thread.start()

    def end():
        stop.set()
        thread.join(5.0)

    return end


def look_from(place, distance):
    """Turn the view."""
    view = window.area("VIEW_3D").spaces.active.region_3d
    view.view_location, view.view_distance = place, distance
    view.view_rotation = mathutils.Euler((math.radians(70), 0.0, math.radians(25))).to_quaternion()


def check_a_body_does_what_arrives():
    mark = len(output.text())
    bpy.data.objects.remove(thing("Cube"))
    scene().beyond_mocap_stream.port = PORT
    back = yield from own_tab("stream")
    yield from press("stream_start")
    yield from until(lambda: told().on and told().state == "waiting", what=lambda: told().state)
    SENT["end"] = send("passes/library/volley_pass.bvh")
    yield from until(lambda: scene().beyond_mocap_stream.body is not None)
    look_from((0.0, 0.0, 0.9), 5.0)
    yield from until(lambda: "Latency" in told().figures and told().hit)
    places = set()

    def place_after_place():
        places.add(tuple(round(value, 3) for value in scene().beyond_mocap_stream.body.pose.bones[0].location))
        return len(places) > 2

    yield from until(place_after_place, what="it stands still")
    output.say(f"     {' ; '.join(told().figures.splitlines())} ; {told().hit}")
    yield from window.move(300, 300)
    yield 1.0
    window.picture(PICTURES / "stream.png")
    back()
    assert_no_trouble_since(mark)


def check_a_stream_that_stops_is_told():
    mark = len(output.text())
    SENT.pop("end")()
    yield from until(lambda: told().state == "stalled" and "no frame for" in told().line, what=lambda: told().line)
    assert_no_trouble_since(mark)


def check_strikes_are_answered_while_the_scene_plays():
    mark = len(output.text())
    scene().sync_mode = "FRAME_DROP"
    bpy.ops.beyond_mocap.passes_sample(sample="three")
    scene().beyond_mocap_passes.library_folder = str(sample() / "passes" / "library")
    scene().beyond_mocap_stream.body.location = (2.5, 3.5, 0.0)
    look_from((0.0, 0.5, 0.6), 11.0)
    back = yield from own_tab("live")
    yield from press("stream_play")
    yield from until(lambda: told().playing)
    bpy.ops.screen.animation_play()
    end = send("passes/library/volley_pass.bvh")
    try:
        rally = room("scene.stream.play").rally
        yield from until(lambda: rally() is None or rally().passes >= 1)
        assert rally() is not None, told().played
        frame, passes, holder = scene().frame_current, rally().passes, rally().holder
        output.say(f"     {' / '.join(told().played.splitlines())} ; frame {frame}")
        yield from window.move(300, 300)
        yield 1.5
        window.picture(PICTURES / "play_live.png")
        yield from until(lambda: scene().frame_current != frame, 60.0, "the scene goes on")
        assert (holder == "Ben" or passes > 1) and thing("Passing Ball").animation_data
    finally:
        end()
        bpy.ops.screen.animation_cancel(restore_frame=False)
    choose(scene().beyond_mocap_passes.players["Cho"].body.name)
    yield from until(lambda: room("scene.stream.play").target(scene()) == "Cho" or rally().holder == "Cho")
    yield from press("stream_end")
    yield from until(lambda: rally() is None and not told().playing)
    back()
    assert_no_trouble_since(mark)


def check_it_is_stopped():
    mark = len(output.text())
    back = yield from own_tab("stream")
    start = time.monotonic()
    yield from press("stream_stop")
    yield from until(lambda: not told().on)
    within("stopped, s", time.monotonic() - start, 20.0)
    back()
    assert_no_trouble_since(mark)
