"""A pass that is struck as an armature's motion shows it: what is read, what is played, what is told."""

import importlib
import pathlib
import shutil

import bpy
import numpy as np
import pytest
from conftest import EXTENSION
from undo import collect_state, press_operator

LIBRARY = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "passes" / "library"
USED = ("volley_pass", "volley_toss", "volley_attack", "volley_receive", "ready", "walking_1_2", "standing_turn",
        "walking_0")  # fmt: skip


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    """A library of few clips, so that it is built in a moment."""
    folder = tmp_path_factory.mktemp("clips")
    for path in LIBRARY.iterdir():
        if path.stem.startswith(USED):
            shutil.copy(path, folder)
    return folder


@pytest.fixture
def actor(clips):
    """Three players, at a film's rate; the first pass is to be like what an armature does from frame 11 on: a toss."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base, scene.frame_start = 24, 1.001, 11
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="three")
    settings().library_folder = str(clips)
    bpy.ops.beyond_mocap.import_clips(filepath=str(clips / "volley_toss.bvh"))
    first().actor = bpy.context.object
    return bpy.context.object


def settings():
    return bpy.context.scene.beyond_mocap_passes


def first():
    return settings().passes[0]


def asked(room):
    bpy.context.view_layer.update()
    return room("passes.scene_lists").build_scene(bpy.context.scene)


def test_its_strongest_strike_is_the_example(actor, room, core):
    hit = asked(room).passes[0].example.hit
    motion = room("core.action").read_motion(actor, bpy.context.scene)
    found = max((core("passes.hits").detect_hits(motion, "foot", side).strongest for side in ("left", "right")),
                key=lambda one: one.max_speed if one else 0.0)
    assert (hit.key, hit.side, hit.max_speed) == (found.key, found.side, found.max_speed)
    assert np.array_equal(hit.vectors, found.vectors) and np.array_equal(hit.times, found.times)
    assert asked(room).passes[1].example is None


def test_a_stretch_of_it_is_in_scene_frames(actor, room):
    whole = asked(room).passes[0].example.hit
    first().actor_cut = True
    first().actor_first, first().actor_last = 11 + whole.first - 8, 11 + whole.last + 8
    hit = asked(room).passes[0].example.hit
    assert hit.key - 8 + whole.first == pytest.approx(whole.key, abs=1)
    assert hit.max_speed == pytest.approx(whole.max_speed, rel=0.02)
    first().actor_last = 11 + whole.first
    with pytest.raises(Exception, match=f"pass 1.*no strike by foot on frames .* to {11 + whole.first}"):
        asked(room)


def test_an_edited_action_is_another_example(actor, room):
    before, live = asked(room).passes[0].example.hit, room("passes.live")
    settings().made_of = room("passes.generate").build_order(bpy.context.scene).digest
    assert not live.find_edit(bpy.context.scene)
    bpy.ops.beyond_mocap.import_clips(filepath=str(LIBRARY / "volley_attack.bvh"))
    other = bpy.context.object
    actor.animation_data.action = other.animation_data.action
    actor.animation_data.action_slot = other.animation_data.action_slot
    assert asked(room).passes[0].example.hit.max_speed > 1.2 * before.max_speed
    assert live.find_edit(bpy.context.scene)


def test_what_is_like_it_is_played(actor, room, core, clips):
    """As with the same recording named as a clip, whatever the kind."""
    library = room("core.session").find_library(str(clips), None) or core("library.build").build_library(str(clips))
    planned = core("passes.passes").plan_scene
    first().kind = "attack"
    shown = planned(library, asked(room)).strikes[0]
    first().actor, first().clip = None, "volley_toss.bvh"
    named = planned(library, asked(room)).strikes[0]
    first().clip = ""
    usual = planned(library, asked(room)).strikes[0]
    paths = [library.clips[one.order.clip].path for one in (shown, named, usual)]
    assert paths[0] == paths[1] != paths[2]


def test_a_scene_is_made_with_it(actor, room):
    settings().repeat = 1
    while len(settings().passes) > 1:
        settings().passes.remove(1)
    assert press_operator(bpy.ops.beyond_mocap.passes_make) == {"FINISHED"}
    assert not room("passes.live").find_edit(bpy.context.scene)


def still():
    """The field names an armature that plays nothing."""
    bpy.context.object.animation_data_clear()


def own():
    """The field names a body of the scene."""
    settings().players[1].body = first().actor


def beyond():
    """The stretch lies behind its motion."""
    first().actor_cut, first().actor_first, first().actor_last = True, 900, 950


def backward():
    """The stretch ends before it begins."""
    first().actor_cut, first().actor_first, first().actor_last = True, 30, 20


def lost():
    """The armature is deleted."""
    bpy.data.objects.remove(first().actor)


def unlinked():
    """The armature is deleted in the view, and kept by the field alone."""
    bpy.ops.object.delete()


@pytest.mark.parametrize("wrong, said", [
    (still, "plays no action"), (own, "plays this scene itself"), (beyond, "no motion on frames 900 to 950"),
    (backward, "frames 30 to 20"), (lost, "volley_toss.* is no longer in the scene"),
    (unlinked, "volley_toss.* is no longer in the scene"),
])
def test_what_cannot_be_is_told_and_changes_nothing(actor, wrong, said):
    wrong()
    bpy.context.view_layer.update()
    before = collect_state()
    with pytest.raises(RuntimeError, match=f"pass 1: Like Armature: .*{said}"):
        press_operator(bpy.ops.beyond_mocap.passes_make)
    assert collect_state() == before


def test_without_the_one_that_is_gone(actor, room):
    lost()
    first().actor_known = ""
    assert asked(room).passes[0].example is None
    first().clip = "volley_toss.bvh"
    assert asked(room).passes[0].example.clip == "volley_toss.bvh"


def test_a_file_says_that_it_is_left_out(actor, room, core, tmp_path):
    settings().passes[1].clip = "volley_pass.bvh"
    press_operator(bpy.ops.beyond_mocap.passes_to_json, filepath=str(tmp_path / "out.json"))
    read = core("passes.scene_json").read_scene(tmp_path / "out.json")
    assert read.passes[0].example is None and read.passes[1].example.clip == "volley_pass.bvh"
    assert "pass 1" in room("passes.scene_lists").list_lost_examples(settings())
    first().actor = None
    assert not room("passes.scene_lists").list_lost_examples(settings())
