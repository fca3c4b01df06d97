"""Timelines as strips: to the bit there and back, and read right whatever is done to them with Blender's own tools."""

import importlib

import bpy
import numpy as np
import pytest
from undo import assert_one_step

WORDS = ("running", "dribble", "kick", "right", "low", "inside", "my_word", "turn_left", "celebration")


@pytest.fixture
def room(extension):
    """The scene's modules by name."""
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def text(core):
    return core("annotation.text")


@pytest.fixture
def dot():
    """An object of the scene that has nothing yet."""
    made = bpy.data.objects.new("dot", None)
    bpy.context.scene.collection.objects.link(made)
    return made


@pytest.fixture
def clock(room):
    return room("core.measure").Clock(1.0, 0.0, 25.0)


@pytest.fixture
def player(tmp_path):
    """Twelve seconds at 3 m/s, with words."""
    time = np.arange(0.0, 12.01, 0.1)
    lines = ["time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m",
             *(f"{t:.1f},{3 * t:.3f},1,{3 * t + 0.6:.3f},1,0.11" for t in time)]
    (tmp_path / "player1.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "player1.txt").write_text("2.413 4 running\n6.02 kick right low\n")
    bpy.ops.beyond_mocap.import_tracking(filepath=str(tmp_path / "player1.csv"))
    return bpy.context.scene.beyond_mocap.players[0]


def random_timeline(core, dice, count=12):
    """Times with all their digits, overlaps, spans without words, longer names than Blender keeps, names twice."""
    annotation = core("annotation")
    def words(least):
        return tuple(dice.choice(WORDS, dice.integers(least, len(WORDS)), replace=False))
    spans = []
    for _ in range(count):
        start = dice.uniform(-30.0, 90.0)
        spans.append(annotation.Span(start, start + dice.exponential(2.0) + 1e-9, words(0)))
    spans.append(annotation.Span(200.0, 201.0, tuple(f"a_very_long_word_{i}" for i in range(9))))
    keys = [annotation.KeyMoment(dice.uniform(-30.0, 90.0), words(1)) for _ in range(count)]
    return annotation.Timeline(tuple(spans), tuple(keys))


@pytest.mark.parametrize("seed", range(6))
def test_there_and_back_to_the_bit(room, core, text, dot, seed):
    dice = np.random.default_rng(seed)
    clock = room("core.measure").Clock(
        float(dice.integers(-100, 100)), dice.uniform(-50, 50), dice.choice([23.976, 24.0, 25.0, 60.0])
    )
    timeline = random_timeline(core, dice)
    room("timeline.strip_writing").write_timeline(dot, timeline, clock)
    assert room("timeline.label_tracks").read_timeline(dot) == timeline
    assert text.format_timeline(room("timeline.label_tracks").read_timeline(dot)) == text.format_timeline(timeline)
    for track in dot.animation_data.nla_tracks:
        for strip in track.strips:
            assert strip.frame_start == int(strip.frame_start) and strip.frame_end == int(strip.frame_end)
            assert strip.scale == 1.0


@pytest.mark.parametrize("seed", range(3))
def test_another_clock_lays_the_strips_anew_and_says_the_same(room, core, dot, seed):
    dice = np.random.default_rng(seed)
    Clock, lanes, lay_strips = room("core.measure").Clock, room("timeline.label_tracks"), room("timeline.strip_writing")
    timeline = random_timeline(core, dice)
    lay_strips.write_timeline(dot, timeline, Clock(1.0, 0.0, 25.0))
    for clock in (Clock(1.0, 0.0, 120.0), Clock(101.0, -3.3, 23.976), Clock(-40.0, 7.0, 10.0), Clock(1.0, 0.0, 25.0)):
        assert lay_strips.move_to_clock(dot, clock)
        assert lanes.read_timeline(dot) == timeline
        for placed in lanes.list_spans(dot):
            assert (placed.first, placed.last) == room("timeline.strip_lines").compute_frames(placed.span, clock)
        assert [placed.frame for placed in lanes.list_moments(dot)] == [clock.to_whole_frame(key.time)
                                                                        for key in timeline.keys]
    assert not lay_strips.move_to_clock(dot, Clock(1.0, 0.0, 25.0))


def strip_of(dot, name):
    return next(strip for track in dot.animation_data.nla_tracks for strip in track.strips if strip.name == name)


def test_each_end_is_exact_until_it_is_moved_by_a_frame(room, core, text, dot, clock):
    room("timeline.strip_writing").write_timeline(dot, text.parse_timeline("2.413 4.107 running\n3.333 kick\n"), clock)
    read, strip = room("timeline.label_tracks").read_timeline, strip_of(dot, "running")
    assert (strip.frame_start, strip.frame_end) == (61, 104)
    strip.frame_start_raw = 61.6  # less than a frame
    assert read(dot).spans[0].start == 2.413
    strip.frame_start_raw = 63
    assert (read(dot).spans[0].start, read(dot).spans[0].end) == (2.48, 4.107)
    strip.frame_start_raw, strip.frame_end_raw = 61, 110
    assert (read(dot).spans[0].start, read(dot).spans[0].end) == (2.413, 4.36)
    marker = strip_of(dot, "Moments").action.pose_markers[0]
    assert marker.frame == 84 and read(dot).keys[0].time == 3.333
    marker.frame = 85
    assert read(dot).keys[0].time == 3.36
    marker.frame = 84
    assert read(dot).keys[0].time == 3.333


def test_names_are_words(room, core, text, dot, clock):
    room("timeline.strip_writing").write_timeline(dot, text.parse_timeline("2 4 running\n5 6 running\n7 9\n3 kick\n"),
                                                  clock)
    read, InputError = room("timeline.label_tracks").read_timeline, core("base.errors").InputError
    assert strip_of(dot, "running ") and strip_of(dot, "(automatic)")
    strip_of(dot, "running ").name = "Jogging dribble.002"
    strip_of(dot, "(automatic)").name = "walking"
    marker = strip_of(dot, "Moments").action.pose_markers[0]
    marker.name = "kick rigt"
    assert [span.words for span in read(dot).spans] == [("running",), ("jogging", "dribble"), ("walking",)]
    assert read(dot).keys[0].words == ("kick", "rigt")
    for name in ("3 running", "running # away"):
        strip_of(dot, "running").name = name
        with pytest.raises(InputError, match="dot, strip on frame 51: .*numbers"):
            read(dot)
        strip_of(dot, name).name = "running"
    marker.name = ""
    with pytest.raises(InputError, match="key moment on frame 76"):
        read(dot)


def test_muted_is_off(room, text, dot, clock):
    room("timeline.strip_writing").write_timeline(dot, text.parse_timeline("2 4 running\n3 kick\n"), clock)
    strip_of(dot, "running").mute = True
    assert text.format_timeline(room("timeline.label_tracks").read_timeline(dot)) == "3 kick\n"
    dot.animation_data.nla_tracks["Moments"].mute = True
    assert text.format_timeline(room("timeline.label_tracks").read_timeline(dot)) == ""


def test_automatic_strips_are_asked_for_once_touched(room, text, dot, clock):
    lanes, lay_strips, parse = room("timeline.label_tracks"), room("timeline.strip_writing"), text.parse_timeline
    lay_strips.write_timeline(dot, parse("2 4 running\n"), clock)
    lay_strips.show_automatic_spans(dot, parse("0 2 walking\n2 4 running\n4 6 walking\n6 9 jogging\n"), clock)
    strips = [strip for strip in dot.animation_data.nla_tracks["Automatic"].strips]
    assert [strip.name for strip in strips] == ["walking", "walking ", "jogging"] and all(
        strip.mute for strip in strips
    )
    assert text.format_timeline(lanes.read_timeline(dot)) == "2 4 running\n"
    strip_of(dot, "walking").name = "sprinting"
    strip_of(dot, "walking ").frame_end_raw = 145
    strip_of(dot, "jogging").mute = False
    assert text.format_timeline(lanes.read_timeline(dot)) == "0 2 sprinting\n2 4 running\n4 5.76 walking\n6 9 jogging\n"
    lay_strips.show_automatic_spans(
        dot, parse("0 2 sprinting\n2 4 running\n4 5.76 walking\n5.76 6 standing\n6 9 jogging\n"), clock
    )
    assert text.format_timeline(lanes.read_timeline(dot)) == "0 2 sprinting\n2 4 running\n4 5.76 walking\n6 9 jogging\n"
    assert [placed.span.words for placed in lanes.list_spans(dot) if placed.is_automatic] == [("standing",)]


def test_one_by_one(room, core, text, dot, clock):
    lanes, lay_strips, annotation = room("timeline.label_tracks"), room("timeline.strip_writing"), core("annotation")
    first = lay_strips.add_span(dot, annotation.Span(2.0, 4.0, ("running",)), clock)
    second = lay_strips.add_span(dot, annotation.Span(3.0, 5.0, ("dribble",)), clock)
    assert (first.track, second.track) == ("Words", "Words 2")
    kick = lay_strips.add_moment(dot, annotation.KeyMoment(30.123, ("kick",)), clock)
    header = lay_strips.add_moment(dot, annotation.KeyMoment(-5.0, ("header",)), clock)
    assert [moment.labels for moment in lanes.list_moments(dot)] == [("header",), ("kick",)]
    assert [moment.is_selected for moment in lanes.list_moments(dot)] == [True, False]
    lay_strips.select_moment(dot, kick.strip, kick.index)
    lay_strips.change_moment(dot, header.strip, header.index, annotation.KeyMoment(60.0, ("header", "jump")))
    assert [moment.time for moment in lanes.list_moments(dot)] == [30.123, 60.0]
    lay_strips.change_span(dot, second.strip, annotation.Span(4.0, 5.0, ("dribble", "walking")))
    assert text.format_timeline(
        lanes.read_timeline(dot)) == "2 4 running\n4 5 dribble walking\n30.123 kick\n60 header jump\n"
    assert lanes.find_span(dot, 4.5).span.words == ("dribble", "walking") and lanes.find_span(dot, 5.0) is None
    lay_strips.remove_moment(dot, kick.strip, lanes.list_moments(dot)[0].index)
    lay_strips.remove_span(dot, "running")
    assert text.format_timeline(lanes.read_timeline(dot)) == "4 5 dribble walking\n60 header jump\n"
    assert {action.name for action in bpy.data.actions} == {"dot dribble walking", "dot Moments"}


def test_import_tracking_makes_dot_ball_and_strips(room, player):
    strips, scene = room("timeline.strips"), bpy.context.scene
    dot, fps = player.dot, scene.render.fps
    for frame in (1, 1 + 5 * fps):
        scene.frame_set(frame)
        np.testing.assert_allclose(dot.matrix_world.translation, [3 * (frame - 1) / fps, 1, 0], atol=1e-4)
        np.testing.assert_allclose(
            bpy.data.objects["Ball dot"].matrix_world.translation[0], dot.location[0] + 0.6, atol=1e-4
        )
    asked = strips.read_player_timeline(player, scene)
    assert asked.spans[0].start == 2.413 and asked.keys[0].words == ("kick", "right", "low")
    plans = room("result.plans")
    assert plans.build_plan(scene.beyond_mocap, player)[0].timeline == asked
    assert plans.describe_label_source(player) == "strips of player1"
    lanes, lay_strips = room("timeline.label_tracks"), room("timeline.strip_writing")
    moment, = lanes.list_moments(dot)
    assert moment.time == 6.02
    lay_strips.remove_moment(dot, moment.strip, moment.index)
    lay_strips.remove_span(dot, lanes.find_span(dot, 3.0).strip)
    assert strips.read_player_timeline(player, scene).spans == () and strips.read_player_timeline(player,
            scene).keys == ()


def test_the_dot_goes_with_its_player(player):
    player.name, player.shirt = "Ann", (0.0, 1.0, 0.0)
    assert player.dot.name == "Ann dot" and tuple(player.dot.color) == (0.0, 1.0, 0.0, 1.0)
    assert_one_step(bpy.ops.beyond_mocap.remove_player)
    assert not bpy.data.objects and not bpy.data.actions


def test_a_dot_that_was_deleted_in_the_view_comes_back_with_its_words(room, player):
    strips, scene = room("timeline.strips"), bpy.context.scene
    strips.add_span(bpy.context, player, 7.0, 8.0, ("walking",))
    asked, dot = strips.read_player_timeline(player, scene), player.dot
    for collection in dot.users_collection:
        collection.objects.unlink(dot)
    assert strips.read_player_timeline(player, scene) is None
    strips.add_moment(bpy.context, player, 9.0, ("header",))
    assert player.dot == dot and strips.read_player_timeline(player, scene).spans == asked.spans
    assert len(strips.read_player_timeline(player, scene).keys) == 2


def test_bad_words_do_not_keep_the_track_out(room, tmp_path, player):
    (tmp_path / "player1.txt").write_text("kick 3\n")
    assert bpy.ops.beyond_mocap.import_tracking(filepath=str(tmp_path / "player1.csv")) == {"FINISHED"}
    second = bpy.context.scene.beyond_mocap.players[1]
    assert second.dot is not None and room("timeline.strips").read_player_timeline(second, bpy.context.scene) is None
    assert room("result.plans").describe_label_source(second).endswith("player1.txt")


def test_a_first_strip_does_not_put_the_words_of_a_file_out_of_force(room, player):
    """As in a file of the time before strips."""
    for track in list(player.dot.animation_data.nla_tracks):
        player.dot.animation_data.nla_tracks.remove(track)
    player.dot.beyond_mocap_lanes.clock = ""
    strips, scene = room("timeline.strips"), bpy.context.scene
    assert strips.read_player_timeline(player, scene) is None
    strips.add_span(bpy.context, player, 8.0, 9.0, ("walking", "-dribble"))
    asked = strips.read_player_timeline(player, scene)
    assert [span.words for span in asked.spans] == [("running",), ("walking",)] and len(asked.keys) == 1
    assert asked.spans[1].avoid == ("dribble",)


def test_the_track_is_read_once(room, tmp_path, player, monkeypatch):
    tracks = room("player.tracks")
    monkeypatch.setattr(tracks.tracking, "read_track_csv", lambda path: pytest.fail("read again"))
    tracks.read_track(bpy.context.scene.beyond_mocap, player)


@pytest.mark.parametrize("how", ["linked", "override"])
def test_what_another_file_owns_is_left_alone(room, core, text, dot, clock, tmp_path, how):
    room("timeline.strip_writing").write_timeline(dot, text.parse_timeline("2 4 running\n"), clock)
    bpy.data.libraries.write(str(tmp_path / "dot.blend"), {dot})
    with bpy.data.libraries.load(str(tmp_path / "dot.blend"), link=True) as (_, wanted):
        wanted.objects = ["dot"]
    linked = wanted.objects[0]
    if how == "override":
        linked = linked.override_create()
    assert text.format_timeline(room("timeline.label_tracks").read_timeline(linked)) == "2 4 running\n"
    with pytest.raises(core("base.errors").InputError, match="make it local"):
        room("timeline.strip_writing").write_timeline(linked, text.parse_timeline("2 4 walking\n"), clock)
