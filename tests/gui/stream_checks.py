"""Live Stream and Play Live in the window: a body does what arrives, strikes are answered while the scene plays."""

import math
import time

import bpy
import mathutils
import numpy as np
from ball_checks import find_object, isolate_panel, select_objects
from live_answers import (
    KICK,
    PORT,
    end_playing,
    get_rally,
    get_scene,
    get_stream_status,
    measure_answer,
    measure_fast_answers,
    play_scene,
    players_stand,
    read_keys,
    start_sending,
)
from tab import (
    PICTURES,
    SPEED_COUNTS,
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

SENT = {}


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
        found = yield from measure_fast_answers(PORT, 15 if SPEED_COUNTS else 2)
        seconds, drawing = np.median(found, axis=0)
        output.write_line(f"     fast drawing: {1.0 / drawing:.0f} drawings per second; {len(found)} answers were "
                          f"drawn after {seconds:.2f} s (median), {found[:, 0].max():.2f} s (worst)")
        report_time("fast drawing: drawn, s", seconds, 0.3)
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
