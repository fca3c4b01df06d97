"""The timeline's operators: what they do to strips, one step of undo each, and what they say when something is
missing."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest
from undo import assert_one_step, collect_state

ops = bpy.ops.beyond_mocap


@pytest.fixture
def room(extension):
    """The scene's modules by name."""
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def player(tmp_path):
    """Twelve seconds with words, at 24 frames per second."""
    time = np.arange(0.0, 12.01, 0.1)
    (tmp_path / "player1.csv").write_text("time_s,x_m,y_m\n" + "".join(f"{t:.1f},{3 * t:.3f},1\n" for t in time))
    (tmp_path / "player1.txt").write_text("2.413 4 running left\n4 6 jogging\n6.02 kick right low\n9 header -jump\n")
    ops.import_tracking(filepath=str(tmp_path / "player1.csv"))
    return bpy.context.scene.beyond_mocap.players[0]


@pytest.fixture
def asked(room, core):
    """What the first player's strips ask for, as text."""
    def read():
        scene = bpy.context.scene
        return core("annotation").format_timeline(
            room("timeline.strips").read_player_timeline(scene.beyond_mocap.players[0], scene))
    return read


def dot():
    return bpy.context.scene.beyond_mocap.players[0].dot


def select(*names):
    for track in dot().animation_data.nla_tracks:
        for strip in track.strips:
            strip.select = strip.name.rstrip() in names


def pick(index):
    ops.go_to_moment(strip="Moments", index=index)


def test_text_and_file(player, asked, tmp_path):
    before = asked()
    assert before == "2.413 4 running left\n4 6 jogging\n6.02 kick right low\n9 header -jump\n"
    assert_one_step(ops.words_to_text)
    text = bpy.data.texts["player1 labels"]
    assert text.as_string() == before and bpy.context.scene.beyond_mocap.players[0].annotation_text == text
    assert ops.export_words(filepath=str(tmp_path / "out.txt")) == {"FINISHED"}
    assert (tmp_path / "out.txt").read_text() == before
    text.write("10 11 walking\n")
    assert_one_step(ops.read_words)
    assert asked() == before + "10 11 walking\n"


def test_add_span(player, asked):
    scene = bpy.context.scene
    scene.frame_set(1 + 24 * 7)
    assert_one_step(ops.add_span, words="walking -dribble")
    assert "7 8 walking -dribble\n" in asked()
    bpy.context.scene.use_preview_range = True
    bpy.context.scene.frame_preview_start, bpy.context.scene.frame_preview_end = 1, 25
    assert_one_step(ops.add_span, words="standing")
    assert "0 1 standing\n" in asked()
    ops.add_span(words="sprinting", start=10.0, end=11.5)
    assert "10 11.5 sprinting\n" in asked()
    refused("labels", ops.add_span, words="3 walking")
    refused("not after the start", ops.add_span, words="walking", start=3.0, end=2.0)


def test_split_and_join(player, asked):
    before = asked()
    bpy.context.scene.frame_set(1 + 24 * 3)
    assert_one_step(ops.split_span)
    assert asked().startswith("2.413 3 running left\n3 4 running left\n")
    select("running left")
    assert_one_step(ops.join_spans)
    assert asked() == before
    select("running left", "jogging")
    ops.join_spans()
    assert asked().startswith("2.413 6 running left\n6.02")
    bpy.context.scene.frame_set(1)
    refused("no span is under the playhead", ops.split_span)
    select("running left")
    refused("two or more", ops.join_spans)


def test_moments(player, asked):
    bpy.context.scene.frame_set(1 + 24 * 8)
    refused("Select a key moment first", ops.delete_moment)
    assert_one_step(ops.add_moment, words="receive foot")
    assert "8 receive foot\n" in asked()
    assert_one_step(ops.move_moment, frames=-24)
    assert "7 receive foot\n" in asked()
    bpy.context.scene.frame_set(1 + 24 * 20)
    assert_one_step(ops.move_moment)
    assert "20 receive foot\n" in asked()
    assert_one_step(ops.delete_moment)
    assert "receive" not in asked()
    assert_one_step(ops.go_to_moment, strip="Moments", index=0)
    assert bpy.context.scene.frame_current == 145
    refused("one of this strip", ops.go_to_moment, strip="Moments", index=7)
    assert_one_step(ops.edit_words, words="kick left top")
    assert "6.02 kick left top\n" in asked()


def test_edit_words_of_a_span(player, asked):
    select("jogging")
    assert_one_step(ops.edit_words, words="jogging dribble")
    assert "4 6 jogging dribble\n" in asked()
    select()
    refused("click the name", ops.edit_words, words="walking")
    refused("numbers", ops.add_moment, words="#")


def test_mirror_side(player, asked):
    select("running left", "jogging")
    pick(0)
    assert_one_step(ops.mirror_side)
    assert "running right" in asked() and "6.02 kick left low" in asked() and "4 6 jogging" in asked()
    select("jogging")
    pick(1)
    refused("left or right", ops.mirror_side)


def test_the_shown_player_is_selected(player, tmp_path):
    ops.import_tracking(filepath=str(tmp_path / "player1.csv"))
    assert_one_step(ops.choose_player, player="player1")
    assert bpy.context.scene.beyond_mocap.active_player == 0
    assert [thing.name for thing in bpy.context.selected_objects] == ["player1 dot"]
    refused("not in the list", ops.choose_player, player="nobody")


def test_a_dot_appended_to_another_file(player, asked, tmp_path, room):
    before = asked()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "first.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.beyond_mocap.start_frame = 60, 11
    bpy.ops.wm.append(directory=str(tmp_path / "first.blend" / pathlib.Path("Object")) + "/", filename="player1 dot")
    found = bpy.data.objects["player1 dot"]
    found.select_set(True)
    assert_one_step(ops.player_from_dot)
    new = bpy.context.scene.beyond_mocap.players[0]
    assert (new.name, new.dot.name) == ("player1", "player1 dot") and pathlib.Path(new.tracking_file).is_file()
    assert asked() == before
    assert room("timeline.label_tracks").list_moments(new.dot)[0].frame == round(11 + 6.02 * 60)
    bpy.context.scene.frame_set(11 + 60)
    assert new.dot.matrix_world.translation.x == pytest.approx(3.0, abs=1e-3)
    refused("appended from another file", ops.player_from_dot)


def test_saved_and_loaded(player, asked, tmp_path):
    before = asked()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert asked() == before


def test_saved_in_a_session_without_the_extension(player, asked, tmp_path, extension):
    before = asked()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    extension.unregister()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "again.blend"))
    extension.register()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "again.blend"))
    assert asked() == before


def test_what_is_wrong_is_told(player, room):
    scene, checks = bpy.context.scene, room("timeline.label_checks")
    select("jogging")
    ops.edit_words(words="joging")
    lines = bpy.context.window_manager.beyond_mocap_problems.lines
    assert [(line.frame, line.target) for line in lines] == [(97, "player1 dot")]
    assert "'joging' is not in the vocabulary" in lines[0].line and "jogging" in lines[0].line
    ops.edit_words(words="jogging")
    assert not lines
    next(track for track in dot().animation_data.nla_tracks if track.name == "Words").strips[0].name = "4 times"
    ops.add_span(words="walking", start=4.5, end=5.0)
    assert [line for _, line in checks.list_problems(scene, dot())] == [
        "'4 times': labels have no numbers and no '#'; rename it", "'jogging' and 'walking' overlap; shorten one"]


def test_nobody_there():
    for operator in (ops.add_span, ops.add_moment, ops.split_span, ops.words_to_text, ops.choose_player,
                     ops.read_words):
        refused("Import tracking", operator)


def refused(message, operator, **arguments):
    """The operator reports `message` and the scene is as before."""
    before = collect_state()
    with pytest.raises(RuntimeError, match=message):
        operator(**arguments)
    assert collect_state() == before
