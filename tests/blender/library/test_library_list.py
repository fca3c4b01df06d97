"""The library's clips as a list, the folder that is watched, and the folder that was moved."""

import importlib
import re
import shutil

import bpy
import pytest
import synthetic_motion
from undo import assert_one_step, collect_state


@pytest.fixture
def rooms(extension):
    names = ("library.clips", "library.recordings", "rigs.armature", "core.action", "core.session")
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}") for name in names}


@pytest.fixture
def folder(core, tmp_path):
    """Three clips, two of them with words."""
    top = tmp_path / "project" / "library"
    (top / "kicks").mkdir(parents=True)
    for name, frames in (("walk", 91), ("kicks/low", 61), ("other", 61)):
        core("files.bvh.bvh").write_bvh(top / f"{name}.bvh", synthetic_motion.build_motion(core, frames))
    (top / "walk.txt").write_text("0 3 walking front\n")
    (top / "kicks/low.txt").write_text("0 2 kick right low\n1.2 kick right low\n")
    return top


@pytest.fixture
def listed(folder):
    """The folder's clips in the list."""
    bpy.context.scene.beyond_mocap.library_folder = str(folder)
    bpy.ops.beyond_mocap.list_clips()
    return bpy.context.window_manager.beyond_mocap_clips


def shown(listing):
    return [clip.path for clip in listing.shown]


def test_a_folder_is_listed_without_being_built(listed):
    assert shown(listed) == ["kicks/low.bvh", "other.bvh", "walk.bvh"]
    low, other, walk = listed.shown
    assert low.name == "low" and low.words.split()[0] == "kick" and set(low.words.split()) == {"kick", "right", "low"}
    assert "1 key moment" in low.figures and low.figures.startswith("2.0 s") and walk.seconds == pytest.approx(3.0)
    assert other.words == "" and [clip.mark for clip in listed.shown] == [3, 3, 3]


@pytest.mark.parametrize("asked, found", [
    ("", ["kicks/low.bvh", "other.bvh", "walk.bvh"]),
    ("kick", ["kicks/low.bvh"]), ("low right", ["kicks/low.bvh"]), ("WALK", ["walk.bvh"]), ("low left", []),
    ("oth", ["other.bvh"]),
])
def test_what_is_looked_for(listed, asked, found):
    listed.find = asked
    assert shown(listed) == found and listed.total == 3
    listed.find = ""
    assert len(listed.shown) == 3


def test_order_and_the_chosen_clip_stays_chosen(listed):
    listed.active = 0
    listed.order = "SECONDS"
    assert shown(listed) == ["walk.bvh", "kicks/low.bvh", "other.bvh"] and listed.active == 1
    listed.order = "WORDS"
    assert shown(listed)[-1] == "other.bvh"
    listed.order = "NAME"


def test_a_build_lists_speeds_and_quality(listed):
    bpy.ops.beyond_mocap.build_library()
    low, other, walk = listed.shown
    assert "m/s" in walk.figures and walk.mark in (0, 1, 2) and "foot slide: " in walk.messages
    assert "no labels: not used" in other.messages.splitlines() and "no labels" not in walk.messages


def test_a_library_without_words_is_built_with_proposed_ones_and_says_so(listed, folder):
    for text in folder.rglob("*.txt"):
        text.unlink()
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    assert len(listed.shown) == 3 and all(clip.words for clip in listed.shown)
    assert all("labels: proposed" in clip.messages.splitlines() for clip in listed.shown)
    first, proposed, *_ = bpy.context.scene.beyond_mocap.library_gaps.splitlines()
    assert re.match(r"\d+ warnings: Proposed labels", first) and proposed.startswith("labels proposed for 3 clips")
    assert "--" not in proposed


def test_what_a_library_lacks_is_shown(listed):
    bpy.ops.beyond_mocap.build_library()
    gaps = bpy.context.scene.beyond_mocap.library_gaps
    count, missing = re.match(r"(\d+) warnings: Clips without labels, (\d+) motions? missing", gaps).groups()
    assert int(count) == 1 + int(missing) + ("left out" in gaps.splitlines()[0])
    assert "hardly any turns in place: add some" in gaps
    assert "1 clip has no labels and is not used: other.bvh; " in gaps
    assert "Proposed" not in gaps
    assert not any("proposed" in clip.messages for clip in listed.shown)


def test_a_library_that_cannot_be_built_is_listed_all_the_same(listed, folder):
    (folder / "walk.txt").write_text("5 6 walking\n")
    with pytest.raises(RuntimeError, match="frames 0 to 90"):
        bpy.ops.beyond_mocap.build_library()
    assert len(listed.shown) == 3


def test_a_clip_comes_in_as_it_was_recorded(listed, folder, core, rooms):
    bpy.context.scene.render.fps = 30
    assert bpy.ops.beyond_mocap.import_clip(path="kicks/low.bvh") == {"FINISHED"}
    rig = bpy.context.object
    assert rig.name == "low" and rig["beyond_mocap_clip"] == "kicks/low.bvh"
    assert [o.type for o in rig.children] == ["MESH"]
    read = rooms["core.action"].read_motion(rig, bpy.context.scene)
    wanted = core("files.bvh.bvh").read_bvh(folder / "kicks/low.bvh").motion
    assert abs(read.root_positions - wanted.root_positions).max() < 1e-5
    assert_one_step(bpy.ops.beyond_mocap.import_clip, path="walk.bvh", dressed=False)


def test_the_chosen_clip_comes_in(listed):
    listed.active = 2
    bpy.ops.beyond_mocap.import_clip(dressed=False)
    assert bpy.context.object.name == "walk"


def test_clips_that_cannot_be_read_change_nothing(listed, folder):
    (folder / "other.bvh").write_text("nothing")
    before = collect_state()
    for path, told in (("gone.bvh", "no such file"), ("other.bvh", "other.bvh")):
        with pytest.raises(RuntimeError, match=told):
            bpy.ops.beyond_mocap.import_clip(path=path)
    assert collect_state() == before


def test_without_a_folder_or_clips(tmp_path):
    with pytest.raises(RuntimeError, match="No clips listed"):
        bpy.ops.beyond_mocap.import_clip()
    for operator in (bpy.ops.beyond_mocap.list_clips, bpy.ops.beyond_mocap.build_library):
        with pytest.raises(RuntimeError, match="Choose the library's folder"):
            operator()
    (tmp_path / "empty").mkdir()
    bpy.context.scene.beyond_mocap.library_folder = str(tmp_path / "empty")
    bpy.ops.beyond_mocap.list_clips()
    assert bpy.context.window_manager.beyond_mocap_clips.total == 0
    bpy.context.scene.beyond_mocap.library_folder = str(tmp_path / "nowhere")
    with pytest.raises(RuntimeError, match="no such folder"):
        bpy.ops.beyond_mocap.list_clips()
    assert bpy.context.window_manager.beyond_mocap_clips.missing


def test_the_list_is_not_saved_with_the_file(listed, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert b"kicks/low.bvh" not in (tmp_path / "kept.blend").read_bytes()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert bpy.context.window_manager.beyond_mocap_clips.total == 0


def test_news_tell_what_is_new_changed_and_gone(folder, rooms, core):
    look, news = rooms["library.clips"].list_files, rooms["library.clips"].describe_changes
    before = look(str(folder))
    assert sorted(before) == ["kicks/low.bvh", "kicks/low.txt", "other.bvh", "walk.bvh", "walk.txt"]
    assert news(before, before) == ""
    for name in ("a", "b", "c"):
        core("files.bvh.bvh").write_bvh(folder / f"{name}.bvh", synthetic_motion.build_motion(core, 20))
    (folder / "walk.txt").write_text("0 2.5 walking front\n")
    (folder / "kicks/low.bvh").unlink()
    assert news(before, look(str(folder))) == "3 new clips, 1 removed clip, 1 changed label file"
    assert look(str(folder / "nowhere")) is None


def test_watching_says_it_and_builds_nothing(listed, folder, rooms, core):
    watch, settings = rooms["library.clips"], bpy.context.scene.beyond_mocap
    assert not settings.library_watch
    core("files.bvh.bvh").write_bvh(folder / "new.bvh", synthetic_motion.build_motion(core, 20))
    watch._scan_folder()
    assert listed.news == "" and not watch._scan_state
    settings.library_watch = True
    watch._scan_folder()
    watch._scan_state["thread"].join()
    watch._scan_folder()
    assert listed.news == "1 new clip" and listed.total == 3
    bpy.ops.beyond_mocap.list_clips()
    assert listed.news == "" and listed.total == 4


def test_a_project_that_was_moved_finds_its_library(listed, folder, tmp_path):
    blend = tmp_path / "project" / "scenes" / "shot.blend"
    blend.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), relative_remap=False)
    shutil.move(tmp_path / "project", tmp_path / "elsewhere")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "elsewhere" / "scenes" / "shot.blend"))
    settings = bpy.context.scene.beyond_mocap
    assert settings.library_folder == "//../library"
    assert not bpy.context.window_manager.beyond_mocap_clips.missing
    bpy.ops.beyond_mocap.list_clips()
    assert bpy.context.window_manager.beyond_mocap_clips.total == 3


def test_a_library_that_is_nowhere_near_is_chosen_anew(listed, folder, tmp_path):
    settings = bpy.context.scene.beyond_mocap
    shutil.move(folder, tmp_path / "clips")
    with pytest.raises(RuntimeError, match="no such folder, and no similar one"):
        bpy.ops.beyond_mocap.relink_library()
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "notes.txt").write_text("no clip")
    with pytest.raises(RuntimeError, match="no recordings in the folder"):
        bpy.ops.beyond_mocap.relink_library(directory=str(tmp_path / "empty"))
    assert settings.library_folder == str(folder)
    assert_one_step(bpy.ops.beyond_mocap.relink_library, directory=str(tmp_path / "clips"))
    assert bpy.context.scene.beyond_mocap.library_folder == str(tmp_path / "clips")
