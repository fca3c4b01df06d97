"""Clips as assets: actions with catalog, tags and a picture, here or in a file of their own."""

import importlib
import shutil
from pathlib import Path

import bpy
import numpy as np
import pytest
from undo import assert_one_step, collect_state, press_operator

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend" / "library"


@pytest.fixture
def assets(extension):
    return importlib.import_module(f"{extension.__name__}.scene.library.assets")


@pytest.fixture
def library(tmp_path):
    folder = tmp_path / "library"
    folder.mkdir()
    for name in ("kick_low_top", "jogging_2_9"):
        for ending in (".bvh", ".txt"):
            shutil.copy(SAMPLE / (name + ending), folder)
    bpy.context.scene.beyond_mocap.library_folder = str(folder)
    bpy.ops.beyond_mocap.list_clips()
    return folder


def pixels(item):
    values = np.empty(len(item.preview.image_pixels_float), np.float32)
    item.preview.image_pixels_float.foreach_get(values)
    return values.reshape(*reversed(tuple(item.preview.image_size)), 4)


def test_shown_clips_become_assets_of_this_file(assets, library, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "own.blend"))
    bpy.ops.beyond_mocap.list_clips()
    assert_one_step(bpy.ops.beyond_mocap.make_assets, which="SHOWN")
    assert sorted(action.name for action in bpy.data.actions) == ["jogging_2_9", "kick_low_top"]
    kick = bpy.data.actions["kick_low_top"]
    assert {"kick", "right", "low", "top"} <= {tag.name for tag in kick.asset_data.tags}
    assert kick.asset_data.catalog_id == assets.compute_catalog_id("Beyond Mocap/Kick")
    assert "4.8 s" in kick.asset_data.description
    drawn = pixels(kick)
    assert drawn.shape == (256, 256, 4) and 0.05 < np.mean(drawn[..., 3] > 0.5) < 0.7
    text = (tmp_path / assets.CATALOGS).read_text()
    assert f"{kick.asset_data.catalog_id}:Beyond Mocap/Kick:" in text and "Beyond Mocap/Jogging" in text
    assert not bpy.data.objects and not bpy.data.armatures
    bpy.ops.beyond_mocap.make_assets(which="CHOSEN")
    assert (tmp_path / assets.CATALOGS).read_text() == text


def test_as_a_file_of_their_own(assets, library, tmp_path):
    before = collect_state()
    target = tmp_path / "clips.blend"
    assert bpy.ops.beyond_mocap.make_assets(which="SHOWN", apart=True, filepath=str(target)) == {"FINISHED"}
    assert collect_state() == before and (tmp_path / assets.CATALOGS).is_file()
    with pytest.raises(RuntimeError, match="already exists"):
        bpy.ops.beyond_mocap.make_assets(which="SHOWN", apart=True, filepath=str(target))
    with bpy.data.libraries.load(str(target), assets_only=True) as (there, here):
        assert sorted(there.actions) == ["jogging_2_9", "kick_low_top"]
        here.actions = list(there.actions)
    kick = bpy.data.actions["kick_low_top"]
    assert kick.asset_data is not None and np.mean(pixels(kick)[..., 3] > 0.5) > 0.05


def test_what_selected_armatures_play(assets, library):
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    own = bpy.context.object.animation_data.action
    assert own.asset_data is None
    bpy.ops.ed.undo_push(message="before")
    assert press_operator(bpy.ops.beyond_mocap.make_assets, which="SELECTED") == {"FINISHED"}
    assert bpy.data.actions["kick_low_top"].asset_data is not None
    bpy.ops.ed.undo()
    assert bpy.data.actions["kick_low_top"].asset_data is None
    bpy.ops.ed.redo()
    own = bpy.data.actions["kick_low_top"]
    assert own.asset_data is not None and "kick" in {tag.name for tag in own.asset_data.tags}
    for item in bpy.context.selected_objects:
        item.select_set(False)
    with pytest.raises(RuntimeError, match="no selected armature"):
        bpy.ops.beyond_mocap.make_assets(which="SELECTED")


def test_an_asset_of_the_users_stays_his_when_a_file_is_written(assets, library, tmp_path):
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    own = bpy.context.object.animation_data.action
    own.asset_mark()
    own.asset_data.description, own.asset_data.catalog_id = "mine", assets.compute_catalog_id("Mine")
    own.asset_data.tags.new("precious")
    before, target = collect_state(), tmp_path / "walk.v2"
    assert press_operator(bpy.ops.beyond_mocap.make_assets, which="SELECTED", apart=True,
                          filepath=str(target)) == {"FINISHED"}
    assert collect_state() == before and own.asset_data.description == "mine" and len(own.asset_data.tags) == 1
    with bpy.data.libraries.load(str(tmp_path / "walk.v2.blend"), assets_only=True) as (there, _):
        assert list(there.actions) == ["kick_low_top"]
    bpy.ops.beyond_mocap.remove_clip()
    assert bpy.data.actions["kick_low_top"].asset_data.description == "mine"


def test_catalogs_are_added_to_those_above(assets, tmp_path):
    (tmp_path / assets.CATALOGS).write_text("# mine\nVERSION 1\n\n1f5a:Chairs:Chairs\n")
    (tmp_path / "below").mkdir()
    assert assets.define_catalogs(tmp_path / "below", ["Beyond Mocap/Kick"]) == tmp_path / assets.CATALOGS
    text = (tmp_path / assets.CATALOGS).read_text()
    assert "1f5a:Chairs:Chairs\n" in text and text.count("Beyond Mocap/Kick") == 1


@pytest.mark.parametrize("words, catalog", [
    (("kick", "right", "running"), "Kick"), (("walking", "front"), "Walking"), (("getting_up", "back"), "Getting up"),
    ((), "Other"),
])
def test_catalog_by_words(assets, words, catalog):
    assert assets.choose_catalog(words) == f"Beyond Mocap/{catalog}"


def test_bad_places_and_clips(library, tmp_path):
    before = collect_state()
    with pytest.raises(RuntimeError, match="no file given"):
        bpy.ops.beyond_mocap.make_assets(which="SHOWN", apart=True)
    with pytest.raises(RuntimeError, match="clips.blend"):
        bpy.ops.beyond_mocap.make_assets(which="SHOWN", apart=True, filepath=str(tmp_path / "nowhere" / "clips.blend"))
    (library / "kick_low_top.bvh").write_text("broken")
    with pytest.raises(RuntimeError, match="kick_low_top.bvh"):
        bpy.ops.beyond_mocap.make_assets(which="SHOWN")
    assert collect_state() == before
    bpy.context.window_manager.beyond_mocap_clips.find = "nothing like it"
    with pytest.raises(RuntimeError, match="no clip in the list"):
        bpy.ops.beyond_mocap.make_assets(which="CHOSEN")
    bpy.context.window_manager.beyond_mocap_clips.find = ""
