"""What users do to strips with Blender's tools: said as before, and put in order.

Without a window Blender's NLA operators cannot run, so that what they do to the data is done here by hand; the window
tests press them.
"""

import importlib

import bpy
import pytest


@pytest.fixture
def room(extension):
    """The scene's modules by name."""
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def parse(core):
    return core("annotation").parse_timeline


@pytest.fixture
def dot(room, parse):
    """Two spans and two key moments at 25 frames per second."""
    made = bpy.data.objects.new("dot", None)
    bpy.context.scene.collection.objects.link(made)
    timeline = parse("1.013 3.007 running\n3.007 5 walking\n2.222 kick\n4.444 header\n")
    room("timeline.strip_writing").write_timeline(made, timeline, room("core.measure").Clock(1.0, 0.0, 25.0),
                                                  (0.0, 8.0))
    return made


@pytest.fixture
def tidied(room, core, dot):
    """What the strips say once they are in order; it is the same as before, and nothing more is to be done then."""
    def put():
        before = room("timeline.label_tracks").read_timeline(dot)
        assert room("timeline.strip_events").normalize_object(dot)
        assert not room("timeline.strip_events").normalize_object(dot)
        assert room("timeline.label_tracks").read_timeline(dot) == before
        for track in dot.animation_data.nla_tracks:
            ends = [
                (strip.frame_start, strip.frame_end) for strip in sorted(track.strips, key=lambda one: one.frame_start)
            ]
            assert all(first[1] <= second[0] for first, second in zip(ends, ends[1:]))
            for strip in track.strips:
                assert (strip.scale, strip.frame_start % 1, strip.frame_end % 1) == (1.0, 0.0, 0.0)
                assert (strip.action_frame_start, strip.action_frame_end) == (strip.frame_start, strip.frame_end)
                assert strip.action.users == 1
        return core("annotation").format_timeline(before)
    return put


def lane(dot, name):
    return dot.animation_data.nla_tracks[name]


def strip_of(dot, name):
    return next(strip for track in dot.animation_data.nla_tracks for strip in track.strips if strip.name == name)


def split(dot, track, strip, frame, action=None):
    """Both halves play the same action, each its part of it."""
    end, action_end = strip.frame_end, strip.action_frame_end
    strip.action_frame_end = strip.frame_end_raw = frame
    second = lane(dot, track).strips.new(strip.name, frame + 1000, strip.action)
    second.action_frame_start, second.action_frame_end = frame, action_end
    second.frame_start_raw, second.frame_end_raw = frame, end
    return second


def test_in_order_already(room, dot):
    assert not room("timeline.strip_events").normalize_object(dot)
    assert not room("timeline.strip_events").normalize_strips(bpy.context.scene)


def test_dragged(dot, tidied):
    walking = strip_of(dot, "walking")
    walking.frame_end_raw, walking.frame_start_raw = 141.4, 91.4
    assert tidied() == "1.013 3.007 running\n2.222 kick\n3.6 5.6 walking\n4.444 header\n"


def test_scaled(dot, tidied):
    walking = strip_of(dot, "walking")
    walking.scale = 1.5
    assert tidied().splitlines()[2] == "3.007 6 walking"


def test_resized_over_its_neighbour_and_back_takes_no_second_lane(dot, tidied):
    running = strip_of(dot, "running")
    running.frame_end_raw = 70.2
    running.action_frame_end = 70.2
    assert tidied().splitlines()[0] == "1.013 2.76 running"
    assert [track.name for track in dot.animation_data.nla_tracks] == ["Automatic", "Words", "Moments"]


def test_split(dot, tidied, room):
    running = strip_of(dot, "running")
    running.action.pose_markers.new("throwb").frame = 30
    running.action.pose_markers.new("stomp").frame = 60
    split(dot, "Words", running, 40)
    asked = tidied()
    assert [line for line in asked.splitlines() if "running" in line] == ["1.013 1.56 running", "1.56 3.007 running"]
    assert [line for line in asked.splitlines() if "throwb" in line or "stomp" in line] == ["1.16 throwb", "2.36 stomp"]
    assert {len(strip.action.pose_markers) for strip in lane(dot, "Words").strips if "running" in strip.name} == {1}


def test_the_lane_of_moments_split(dot, tidied):
    split(dot, "Moments", strip_of(dot, "Moments"), 80)
    assert tidied().count("kick") == 1


def test_the_lane_of_moments_dragged(dot, tidied):
    moments = strip_of(dot, "Moments")
    moments.frame_start_raw, moments.frame_end_raw = moments.frame_start + 10, moments.frame_end + 10
    assert "2.64 kick" in tidied()


def test_duplicated(dot, tidied):
    """Onto a track of its own; at first where it was, then dragged away."""
    running = strip_of(dot, "running")
    track = dot.animation_data.nla_tracks.new(prev=lane(dot, "Moments"))
    copy = track.strips.new("running", 26, running.action)
    copy.frame_start_raw, copy.frame_end_raw = 226, 276
    assert tidied().splitlines()[-1] == "9 11 running"
    assert track.name == "Words 2"


def test_linked_duplicates_of_the_lane_of_moments_count_once(dot, room):
    track = dot.animation_data.nla_tracks.new()
    track.strips.new("Moments", 1, strip_of(dot, "Moments").action.copy())
    assert [moment.labels for moment in room("timeline.label_tracks").list_moments(dot)] == [("kick",), ("header",)]


def test_renamed(dot, tidied, room):
    strip_of(dot, "running").name = "Jogging left"
    strip_of(dot, "Moments").action.pose_markers[0].name = "Receive"
    assert tidied().splitlines()[:2] == ["1.013 3.007 jogging left", "2.222 receive"]
    assert strip_of(dot, "jogging left").action.name == "dot jogging left"
    strip_of(dot, "walking").name = "3 times"
    assert not room("timeline.strip_events").normalize_object(dot) and strip_of(dot, "3 times")


def test_muted_and_heard_again(dot, room, core):
    strip_of(dot, "running").mute = True
    assert not room("timeline.strip_events").normalize_object(dot)
    strip_of(dot, "running").mute = False
    assert room("timeline.label_tracks").read_timeline(dot).spans[0].start == 1.013


def test_an_automatic_strip_that_is_touched_becomes_asked_for(dot, tidied, room, parse):
    laid = room("timeline.label_tracks").read_clock(dot)
    room("timeline.strip_writing").show_automatic_spans(dot, parse("0 1.013 standing\n5 6 walking\n"), laid)
    assert not room("timeline.strip_events").normalize_object(dot)
    standing = strip_of(dot, "standing")
    standing.frame_start_raw = standing.action_frame_start = 11
    assert tidied().splitlines()[0] == "0.4 1.013 standing"
    standing = strip_of(dot, "standing")
    assert not standing.mute and "standing" in [strip.name for strip in lane(dot, "Words").strips]


def test_put_onto_the_lane_of_automatic_ones_it_is_still_asked_for(dot, room):
    action = strip_of(dot, "running").action
    lane(dot, "Words").strips.remove(strip_of(dot, "running"))
    lane(dot, "Automatic").strips.new("running", 26, action)
    assert room("timeline.label_tracks").read_timeline(dot).spans[0].words == ("running",)
    room("timeline.strip_events").normalize_object(dot)
    assert room("timeline.label_tracks").read_timeline(dot).spans[0].start == 1.013


def test_deleted(dot, room):
    lane(dot, "Words").strips.remove(strip_of(dot, "running"))
    assert not room("timeline.strip_events").normalize_object(dot)
    assert len(room("timeline.label_tracks").read_timeline(dot).spans) == 1
    for track in list(dot.animation_data.nla_tracks):
        dot.animation_data.nla_tracks.remove(track)
    assert room("timeline.label_tracks").read_timeline(dot).spans == ()


def test_no_strip_is_touched_while_one_is_edited(dot, room):
    strip_of(dot, "running").frame_end_raw = 90
    strip_of(dot, "running").select = True
    dot.animation_data.nla_tracks.active = lane(dot, "Words")
    dot.animation_data.use_tweak_mode = True
    if dot.animation_data.use_tweak_mode:
        assert not room("timeline.strip_events").normalize_strips(bpy.context.scene)
        dot.animation_data.use_tweak_mode = False


def test_another_frame_rate_of_the_scene(room, tmp_path, core):
    (tmp_path / "player1.csv").write_text("time_s,x_m,y_m\n" + "".join(f"{t / 10},{t / 5},0\n" for t in range(101)))
    (tmp_path / "player1.txt").write_text("2.413 4.017 running\n6.022 kick\n")
    bpy.ops.beyond_mocap.import_tracking(filepath=str(tmp_path / "player1.csv"))
    scene = bpy.context.scene
    player = scene.beyond_mocap.players[0]
    before = room("timeline.strips").read_player_timeline(player, scene)
    scene.render.fps, scene.render.fps_base = 24, 1.001
    scene.beyond_mocap.start_frame = 101
    assert room("timeline.strips").read_player_timeline(player, scene) == before
    assert room("timeline.strip_events").normalize_strips(scene)
    assert room("timeline.strips").read_player_timeline(player, scene) == before
    assert room("timeline.label_tracks").list_moments(player.dot)[0].frame == round(101 + 6.022 * 24 / 1.001)
    scene.render.fps = 30
    strip = next(strip for track, strip in room("timeline.label_tracks").iter_strips(player.dot) if strip.name
                 == "running")
    strip.name = "take 5 #"  # which nobody can read: all of it waits, and says so
    stands = strip.frame_start, player.dot.beyond_mocap_lanes.clock
    room("timeline.strip_events").normalize_strips(scene)
    assert (strip.frame_start, player.dot.beyond_mocap_lanes.clock) == stands
    strip.name = "running"
    assert room("timeline.strip_events").normalize_strips(scene) and room("timeline.strips").read_player_timeline(
        player, scene) == before
    scene.render.fps = 24
    room("timeline.strip_events").normalize_strips(scene)
    scene.frame_set(101 + 120)
    assert player.dot.matrix_world.translation.x == pytest.approx(2 * 120 / (24 / 1.001), abs=1e-3)
