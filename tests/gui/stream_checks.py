"""Live Stream and Play Live in the window: a body does what arrives, strikes are answered while the scene plays."""

import math
import threading
import time

import bpy
import mathutils
from ball_checks import choose, own_tab, press, thing, until
from tab import PICTURES, assert_no_trouble_since, output, room, sample, window

LIMIT = 500
PORT = 7361
SENT = {}


def told():
    """How the stream does."""
    return bpy.context.window_manager.beyond_mocap_streaming


def scene():
    """The window's scene, looked up each time, since undo replaces it."""
    return window.window.scene


def send(clip, loop=True):
    """Begin to send a clip; returns what ends it."""
    sender = room("beyond_mocap.stream.sender").Sender(sample() / clip, PORT, loop=loop)
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
    assert told().on and told().state == "waiting"
    SENT["end"] = send("passes/library/volley_pass.bvh")
    yield from until(lambda: scene().beyond_mocap_stream.body is not None)
    look_from((0.0, 0.0, 0.9), 5.0)
    yield from until(lambda: "Latency" in told().figures and told().hit)
    body, places = scene().beyond_mocap_stream.body, set()
    for _ in range(10):
        yield 0.2
        places.add(tuple(round(value, 3) for value in body.pose.bones[0].location))
    assert len(places) > 2, "it stands still"
    output.say(f"     {' ; '.join(told().figures.splitlines())} ; {told().hit}")
    yield from window.move(300, 300)
    yield 1.0
    window.picture(PICTURES / "stream.png")
    back()
    assert_no_trouble_since(mark)


def check_a_stream_that_stops_is_told():
    mark = len(output.text())
    SENT.pop("end")()
    yield from until(lambda: told().state == "stalled")
    assert "no frame for" in told().line
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
    yield from until(lambda: told().playing, 240.0)
    bpy.ops.screen.animation_play()
    end = send("passes/library/volley_pass.bvh")
    try:
        rally = room("scene.stream.play").rally
        yield from until(lambda: rally() is None or rally().passes >= 1, 120.0)
        assert rally() is not None, told().played
        frame, holder = scene().frame_current, rally().holder
        output.say(f"     {' / '.join(told().played.splitlines())} ; frame {frame}")
        yield from window.move(300, 300)
        yield 1.5
        window.picture(PICTURES / "play_live.png")
        assert scene().frame_current != frame, "the scene does not go on"
        assert holder == "Ben" and thing("Passing Ball").animation_data
    finally:
        end()
        bpy.ops.screen.animation_cancel(restore_frame=False)
    choose(scene().beyond_mocap_passes.players["Cho"].body.name)
    yield from until(lambda: room("scene.stream.play").target(scene()) == "Cho" or rally().holder == "Cho")
    yield from press("stream_end")
    assert rally() is None and not told().playing
    back()
    assert_no_trouble_since(mark)


def check_it_is_stopped():
    mark = len(output.text())
    back = yield from own_tab("stream")
    start = time.monotonic()
    yield from press("stream_stop")
    assert not told().on and time.monotonic() - start < 20.0
    back()
    assert_no_trouble_since(mark)
