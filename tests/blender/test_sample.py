"""Load Sample: each task's sample moves, in a scene of its own where there is content; the extension is only read."""

import importlib
import pathlib
import shutil

import bpy
import pytest
from conftest import EXTENSION
from fake_layout import create_context, list_cut_panels
from undo import assert_one_step, collect_state

QUICK = ("PATH", "MARKERS")
MOVING = {"PLAYER": 1, "MATCH": 8, "PATH": 1, "PASSES": 3, "THROW": 1, "MARKERS": 1}


def import_module(name):
    return importlib.import_module(f"{EXTENSION}.{name}")


@pytest.fixture(scope="module", autouse=True)
def used_library(sample_cache):
    """The sample's library has been used before; that of its passes, whose cache is below the same folder, has not."""
    library = import_module("scene.core.sample").FOLDER / "library"
    cache = import_module("scene.core.preferences").find_cache_folder(str(library))
    shutil.copytree(sample_cache, cache, dirs_exist_ok=True)


@pytest.fixture(autouse=True)
def fresh_file():
    """The file that Blender starts with, which has a cube, a light and a camera."""
    bpy.ops.wm.read_homefile(use_empty=False)
    yield
    bpy.ops.wm.read_homefile(use_empty=True)


def read_pose(body):
    return [tuple(bone.matrix.translation) for bone in body.pose.bones]


def list_files(folder):
    return sorted((str(path), path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("which", MOVING)
def test_each_sample_moves_on_a_lit_pitch(which, monkeypatch):
    sample = import_module("scene.core.sample")
    before, start = list_files(sample.FOLDER), bpy.context.scene
    names = sorted(thing.name for thing in start.objects)
    assert bpy.ops.beyond_mocap.load_sample(which=which) == {"FINISHED"}
    scene = bpy.context.scene
    bodies = import_module("operators.sample").find_bodies(scene)
    assert len(bodies) == MOVING[which]
    scene.frame_set(scene.frame_start)
    poses = [read_pose(body) for body in bodies]
    scene.frame_set((scene.frame_start + scene.frame_end) // 2)
    assert all(pose != read_pose(body) for pose, body in zip(poses, bodies))
    assert any(thing.type == "LIGHT" for thing in scene.objects)
    assert any(thing.name.startswith("Grass") for thing in scene.objects)
    assert scene.camera is not None and scene.world is not None
    assert scene != start and sorted(thing.name for thing in start.objects) == names
    last = max(body.animation_data.action.frame_range[1] for body in bodies)
    assert abs(scene.frame_end - last) < 130, "the scene goes on long after the motion"
    assert list_files(sample.FOLDER) == before, "something was written into the extension's folder"
    assert not list_cut_panels(create_context(monkeypatch))


@pytest.mark.parametrize("which", QUICK)
def test_it_is_one_step_of_undo(which):
    assert_one_step(bpy.ops.beyond_mocap.load_sample, which=which)


def test_an_empty_scene_is_filled_itself():
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    assert bpy.ops.beyond_mocap.load_sample(which="PATH") == {"FINISHED"}
    assert bpy.context.scene == scene and len(bpy.data.scenes) == 1
    assert scene.beyond_mocap.task == "PATH"


def test_a_scene_with_video_alone_has_content():
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    length = {"length": 100} if bpy.app.version >= (5, 0, 0) else {"frame_end": 101}
    scene.sequence_editor_create().strips.new_effect(name="Shot", type="COLOR", channel=1, frame_start=1, **length)
    before = scene.render.fps, scene.frame_end
    bpy.ops.beyond_mocap.load_sample(which="PATH")
    assert bpy.context.scene != scene and (scene.render.fps, scene.frame_end) == before


def test_it_has_its_size_in_a_scene_of_centimetres():
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.unit_settings.scale_length = 0.01
    assert bpy.ops.beyond_mocap.load_sample(which="PATH") == {"FINISHED"}


def test_what_is_in_a_scene_stays():
    scene = bpy.context.scene
    scene.beyond_mocap.library_folder = "//mine"
    bpy.ops.beyond_mocap.load_sample(which="PATH")
    sampled = bpy.context.scene
    assert scene.beyond_mocap.library_folder == "//mine" and sampled != scene
    objects = {thing.name for thing in sampled.objects}
    bpy.ops.beyond_mocap.load_sample(which="MARKERS")
    assert {thing.name for thing in sampled.objects} == objects and len(bpy.data.scenes) == 3


def test_two_samples_in_a_file_have_what_is_theirs():
    """Blender numbers names in a file; each scene has one collection of ours, and one ball that flies."""
    for _ in range(2):
        bpy.ops.beyond_mocap.load_sample(which="PLAYER")
        scene = bpy.context.scene
        assert [one.name.split(".")[0] for one in scene.collection.children].count("Beyond Mocap") == 1
        balls = [thing for thing in scene.objects if thing.name.split(".")[0] == "Ball"]
        assert len(balls) == 1 and balls[0].animation_data.action is not None


def test_a_moved_sample_is_found_again(tmp_path):
    """A file of another computer, or of an extension that has moved since, has a path that leads nowhere."""
    settings, sample = import_module("scene.core.settings"), import_module("scene.core.sample")
    bpy.ops.beyond_mocap.load_sample(which="PATH")
    stale = "/somewhere/else/extensions/user_default/beyond_mocap/sample_blend"
    bpy.context.scene.beyond_mocap.library_folder = f"{stale}/library"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "moved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "moved.blend"))
    found = settings.to_absolute_path(bpy.context.scene.beyond_mocap.library_folder)
    assert pathlib.Path(found) == sample.FOLDER / "library"
    assert not bpy.context.window_manager.beyond_mocap_clips.missing
    assert settings.to_absolute_path("C:\\extensions\\beyond_mocap\\sample_blend\\match\\player1.csv") == str(
        sample.FOLDER / "match" / "player1.csv")
    assert settings.to_absolute_path(f"{stale}/nowhere") == f"{stale}/nowhere"
    assert settings.to_absolute_path("/somewhere/library") == "/somewhere/library"


def test_a_sample_that_is_still_there_is_read_where_it_is(tmp_path):
    settings, sample = import_module("scene.core.settings"), import_module("scene.core.sample")
    shutil.copytree(sample.FOLDER / "match", tmp_path / "sample_blend" / "match")
    path = str(tmp_path / "sample_blend" / "match" / "player1.csv")
    assert settings.to_absolute_path(path) == path


def test_an_extension_without_its_sample_says_so_and_changes_nothing(monkeypatch, tmp_path):
    monkeypatch.setattr(import_module("scene.core.sample"), "FOLDER", tmp_path)
    before = collect_state()
    with pytest.raises(RuntimeError, match="the sample is not there.*install the extension again"):
        bpy.ops.beyond_mocap.load_sample(which="PLAYER")
    assert collect_state() == before and len(bpy.data.scenes) == 1


def test_nothing_is_written_into_the_sample():
    """Labels of its clips and reconstructed clips are for a library of one's own; a match and a cache lie elsewhere."""
    sample, preferences = import_module("scene.core.sample"), import_module("scene.core.preferences")
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.beyond_mocap.load_sample(which="MARKERS")
    scene = bpy.context.scene
    scene.beyond_mocap_markers.add = True
    with pytest.raises(RuntimeError, match="belongs to the sample"):
        bpy.ops.beyond_mocap.reconstruct_markers()
    library = str(sample.FOLDER / "library")
    assert not sample.is_in_sample(preferences.find_cache_folder(library))
    assert preferences.find_cache_folder("/somewhere/library") is None
    scene.beyond_mocap_match.tracking_file = str(sample.FOLDER / "match" / "small" / "small.dat")
    assert not sample.is_in_sample(import_module("scene.match.request").choose_output_folder(scene))
    bpy.ops.beyond_mocap.list_clips()
    bpy.ops.beyond_mocap.annotate_clip()
    with pytest.raises(RuntimeError, match="belongs to the sample"):
        bpy.ops.beyond_mocap.save_words(overwrite=True)
