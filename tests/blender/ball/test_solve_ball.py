"""The ball of imported tracking, solved in Blender: an object of its own, and touches that become key moments."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest
from conftest import EXTENSION
from undo import assert_one_step, collect_state, press_operator

MATCH = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "match"
KICKS = {"player1": (8.5, 24.8), "player2": (16.5,)}  # as the sample's words say
RECEIVED = {"player1": (17.9,), "player2": (10.2,)}


@pytest.fixture
def lanes():
    return importlib.import_module(f"{EXTENSION}.scene.timeline.label_tracks")


@pytest.fixture
def match():
    """The sample's two players, at a film's rate and in centimetres, without their words."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base, scene.unit_settings.scale_length = 24, 1.001, 0.01
    files = [{"name": "player1.csv"}, {"name": "player2.csv"}]
    bpy.ops.beyond_mocap.import_tracking(directory=str(MATCH), files=files)
    for player in scene.beyond_mocap.players:
        dot, player.annotation_file = player.dot, ""
        for track in list(dot.animation_data.nla_tracks):
            dot.animation_data.nla_tracks.remove(track)
    return scene


def touches(kind):
    rows = bpy.context.scene.beyond_mocap_passes.touches
    return {name: tuple(row.time for row in rows if row.kind == kind and row.name == name) for name in KICKS}


def test_the_sample_s_touches_are_found_and_become_key_moments(match, lanes):
    assert press_operator(bpy.ops.beyond_mocap.solve_ball) == {"FINISHED"}
    for name in KICKS:
        assert touches("kick")[name] == pytest.approx(KICKS[name], abs=0.05)
        assert set(RECEIVED[name]) <= {round(time, 1) for time in touches("receive")[name]}
    assert press_operator(bpy.ops.beyond_mocap.accept_touches) == {"FINISHED"}
    for player in match.beyond_mocap.players:
        moments = lanes.list_moments(player.dot)
        kicks = [moment.key.time for moment in moments if moment.key.words[0] == "kick"]
        assert kicks == pytest.approx(KICKS[player.name], abs=0.05)
    before = collect_state()
    assert "none selected with labels" in refused(bpy.ops.beyond_mocap.accept_touches)
    assert collect_state() == before


def refused(operator):
    with pytest.raises(RuntimeError) as told:
        press_operator(operator)
    return str(told.value)


def test_the_ball_is_where_the_samples_have_it(match):
    press_operator(bpy.ops.beyond_mocap.solve_ball)
    table = np.genfromtxt(MATCH / "player1.csv", delimiter=",", names=True)
    ball, off = bpy.data.objects["Solved Ball"], []
    clock = importlib.import_module(f"{EXTENSION}.scene.core.measure").build_scene_clock(match)
    for row in table[:: len(table) // 20]:
        frame = clock.to_frame(row["time_s"])
        match.frame_set(int(np.floor(frame)), subframe=frame - np.floor(frame))
        off.append(
            np.linalg.norm(np.array(ball.matrix_world.translation) / 100.0 - [row[f"ball_{axis}_m"] for axis in "xyz"])
        )
    assert np.median(off) < 0.03 and max(off) < 0.3, off


def test_a_key_moment_that_is_there_already_stays_alone(match, lanes):
    press_operator(bpy.ops.beyond_mocap.solve_ball)
    bpy.ops.beyond_mocap.choose_player(player="player2")
    match.frame_set(int(round(16.4 * 24 / 1.001)))
    bpy.ops.beyond_mocap.add_moment(words="kick left")
    press_operator(bpy.ops.beyond_mocap.accept_touches, active=True)
    player = match.beyond_mocap.players["player2"]
    words = [moment.key.words for moment in lanes.list_moments(player.dot)]
    assert words.count(("kick",)) == 0 and ("receive", "foot") in words and ("kick", "left") in words
    assert not lanes.has_label_tracks(match.beyond_mocap.players["player1"].dot) or not lanes.list_moments(
        match.beyond_mocap.players["player1"].dot
    )


def test_each_is_one_step_of_undo(match):
    assert_one_step(bpy.ops.beyond_mocap.solve_ball)
    assert_one_step(bpy.ops.beyond_mocap.accept_touches)


def test_solved_again_it_is_the_same_ball_and_still_carried(match):
    press_operator(bpy.ops.beyond_mocap.solve_ball)
    ball, data = bpy.data.objects["Solved Ball"], bpy.data.armatures.new("Stick")
    ball.name, stick = "My Ball", bpy.data.objects.new("Stick", data)
    match.collection.objects.link(stick)
    bpy.context.view_layer.objects.active = stick
    bpy.ops.object.mode_set(mode="EDIT")
    data.edit_bones.new("Bone").tail = 0.0, 0.0, 1.0
    bpy.ops.object.mode_set(mode="OBJECT")
    ball.select_set(True)
    press_operator(bpy.ops.beyond_mocap.take_ball, bone="Bone", first=20, last=40)
    press_operator(bpy.ops.beyond_mocap.solve_ball)
    assert "Solved Ball" not in bpy.data.objects and ball.animation_data.action.name.endswith("carried")
    press_operator(bpy.ops.beyond_mocap.free_ball)
    assert ball.animation_data.action.name.endswith("path") and not len(ball.constraints)


def test_without_a_ball_it_says_so(tmp_path):
    lines = ["time_s,x_m,y_m", *(f"{0.1 * n:.1f},{0.2 * n:.2f},0" for n in range(40))]
    (tmp_path / "alone.csv").write_text("\n".join(lines))
    bpy.ops.beyond_mocap.import_tracking(filepath=str(tmp_path / "alone.csv"))
    before = collect_state()
    assert "ball" in refused(bpy.ops.beyond_mocap.solve_ball)
    assert collect_state() == before
