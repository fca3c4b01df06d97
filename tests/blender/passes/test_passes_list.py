"""The lists of a passing scene: what is picked, typed and dragged is what the core is asked for."""

import importlib
import math
import pathlib

import bpy
import pytest
from conftest import EXTENSION
from undo import assert_one_step, press_operator

SAMPLES = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "passes"
NAMES = ("three", "six", "volley_net", "racquet", "dropped")


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.passes.{name}")


def settings():
    return bpy.context.scene.beyond_mocap_passes


def asked(room):
    bpy.context.view_layer.update()
    return room("scene_lists").build_scene(bpy.context.scene)


def test_every_sample_can_be_chosen(core, room):
    assert {name for name, *_ in room("settings").SAMPLES} == set(core("passes.scene_json").SAMPLES)
    for name in NAMES:
        press_operator(bpy.ops.beyond_mocap.passes_sample, sample=name)
        assert len(asked(room).passes) == len(core("passes.scene_json").SAMPLES[name]["passes"])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("scale", (1.0, 0.01))
def test_what_is_filled_in_is_asked_for(core, room, name, scale):
    bpy.context.scene.unit_settings.scale_length = scale
    press_operator(bpy.ops.beyond_mocap.passes_from_json, filepath=str(SAMPLES / f"{name}.json"))
    wanted, found = core("passes.scene_json").read_scene(SAMPLES / f"{name}.json"), asked(room)
    assert found.passes == wanted.passes and found.ball == wanted.ball and found.net == wanted.net
    assert (found.repeat, found.seed, found.serve) == (wanted.repeat, wanted.seed, wanted.serve)
    assert found.fps == 24.0 and wanted.fps == 30.0  # strikes fall on the scene's frames
    for one, other in zip(found.players, wanted.players, strict=True):
        assert one.name == other.name and one.part == other.part and one.side == other.side
        assert one.place == pytest.approx(other.place, abs=1e-5)
        assert math.cos(one.facing - wanted.find_facing(one.name)) > 1 - 1e-6
        assert (one.tool is None) == (one.part != "tool")
        if other.tool is not None:
            assert one.tool.length == other.tool.length and one.tool.reach == other.tool.reach


def test_a_file_written_is_the_scene_that_is_shown(core, room, tmp_path):
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="volley_net")
    bpy.data.objects["Ann place"].location = (-2.5, 1.25, 0.0)
    settings().passes[0].bounces = 2
    press_operator(bpy.ops.beyond_mocap.passes_to_json, filepath=str(tmp_path / "out.json"))
    read = core("passes.scene_json").read_scene(tmp_path / "out.json")
    assert read.players[0].place == (-2.5, 1.25) and read.passes[0].bounces == 2
    for one, other in zip(read.players, asked(room).players, strict=True):
        assert one.facing == pytest.approx(other.facing, abs=1e-9) and one.place == other.place


def test_weights_of_bones_are_typed(core, room):
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="three")
    settings().weights.bones, settings().weights.velocity = "left foot 2, head=0.5,", 3.0
    found = asked(room).weights
    assert dict(found.bones) == {"left foot": 2.0, "head": 0.5} and found.velocity == 3.0
    room("scene_lists").fill_lists(bpy.context, asked(room))
    assert dict(asked(room).weights.bones) == {"left foot": 2.0, "head": 0.5}
    settings().weights.bones = "left foot"
    with pytest.raises(core("base.errors").InputError, match="bone weights"):
        asked(room)


def test_a_sample_replaces_what_was_there(room):
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="six")
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="three")
    assert sorted(thing.name for thing in bpy.data.objects) == ["Ann place", "Ben place", "Cho place"]
    assert len(asked(room).players) == 3


def test_rows_are_added_moved_and_removed(room):
    edit = bpy.ops.beyond_mocap.passes_list
    for _ in range(3):
        press_operator(edit, rows="players", what="ADD")
    for _ in range(3):
        press_operator(edit, rows="passes", what="ADD")
    names = [row.name for row in settings().players]
    assert [(row.who, row.to) for row in settings().passes] == list(zip(names, [*names[1:], names[0]]))
    assert len(asked(room).players) == 3
    settings().players[0].name = "Zoe"
    settings().players[0].name = settings().players[1].name
    assert settings().players[0].name == "Zoe", "another's name"
    assert settings().passes[0].who == "Zoe" == settings().passes[2].to
    press_operator(edit, rows="passes", what="UP")
    assert settings().active_pass == 1 and settings().passes[1].to == "Zoe"
    settings().active_player = 0
    press_operator(edit, rows="players", what="REMOVE")
    assert len(settings().players) == 2 and len(settings().passes) == 1 and len(bpy.data.objects) == 2


def test_each_is_one_step_of_undo():
    assert_one_step(bpy.ops.beyond_mocap.passes_sample, sample="three")
    assert_one_step(bpy.ops.beyond_mocap.passes_list, rows="players", what="ADD")
    assert_one_step(
        bpy.ops.beyond_mocap.passes_list, rows="passes", what="DOWN" if settings().active_pass == 0 else "UP"
    )
    assert_one_step(bpy.ops.beyond_mocap.passes_list, rows="players", what="REMOVE")


def test_what_cannot_be_is_told(room, core):
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="three")
    settings().passes[0].to = settings().passes[0].who
    with pytest.raises(core("base.errors").InputError, match="both passer and receiver"):
        asked(room)
    with pytest.raises(RuntimeError, match="both passer and receiver"):
        press_operator(bpy.ops.beyond_mocap.passes_to_json, filepath="/nowhere/out.json")
    settings().passes[0].to = "Ben"
    bpy.data.objects.remove(bpy.data.objects["Cho place"])
    with pytest.raises(core("base.errors").InputError, match="player Cho: .*no place"):
        asked(room)
    settings().active_pass = 9
    with pytest.raises(RuntimeError, match="no active row"):
        press_operator(bpy.ops.beyond_mocap.passes_list, rows="passes", what="REMOVE")
