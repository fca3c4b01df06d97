"""Clips of a study are rendered by themselves under neutral names: same light and distance for all, nothing left."""

import importlib

import bpy
import numpy as np
import pytest
import synthetic_motion
from undo import collect_state

SMALL = {"engine": "CYCLES", "width": 48, "height": 28, "fps": 10, "samples": 1}


@pytest.fixture
def study(core, tmp_path):
    """A folder with a study: two systems show the same motion, one of them four metres away; training is movies."""
    order, files, bvh = core("study.order"), core("study.order"), core("files.bvh.bvh")
    here = synthetic_motion.build_motion(core, 7)
    there = core("motion.motion").Motion(here.skeleton, here.root_positions + [4.0, 2.0, 0.0], here.rotations, here.fps)
    bvh.write_bvh(tmp_path / "a.bvh", here)
    bvh.write_bvh(tmp_path / "b.bvh", there)
    for name in ("good", "bad"):
        (tmp_path / f"{name}.mp4").write_bytes(name.encode())
    rows = (("good.mp4", "training"), ("bad.mp4", "training"), ("a.bvh", "ours"), ("b.bvh", "theirs"))
    clips = tuple(order.Clip(f"../{file}", system, "s1" if system != "training" else "") for file, system in rows)
    found = order.build_study(clips, 2)
    (tmp_path / "study").mkdir()
    files.write_study(tmp_path / "study", found)
    return tmp_path / "study", {clip.file[3:]: clip.name for clip in found.clips}


def pixels(path):
    """The picture as (H, W, 4), and out of the file again."""
    image = bpy.data.images.load(str(path))
    out = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(out)
    size = image.size[1], image.size[0]
    bpy.data.images.remove(image)
    return out.reshape(*size, 4)


def test_pictures_show_the_same_wherever_a_body_is(study):
    folder, names = study
    before, things = collect_state(), {kind: len(getattr(bpy.data, kind)) for kind in ("objects", "scenes", "meshes",
            "worlds")}
    assert bpy.ops.beyond_mocap.study_render(directory=f"{folder}/", pictures=True, **SMALL) == {"FINISHED"}
    assert collect_state() == before
    assert {kind: len(getattr(bpy.data, kind)) for kind in things} == things
    frames = {file: sorted((folder / "clips" / names[file]).iterdir()) for file in ("a.bvh", "b.bvh")}
    assert [path.name for path in frames["a.bvh"]] == ["0001.png", "0002.png", "0003.png"]
    one, other = (np.array([pixels(path) for path in frames[file]]) for file in ("a.bvh", "b.bvh"))
    assert one.shape == (3, 28, 48, 4) and np.abs(one - other).mean() < 0.01
    assert np.abs(one[0] - one[2]).mean() > 0.01  # it moves
    middle, edge = one[0, 4:24, 18:30, :3], one[0, :, :4, :3]
    assert middle.std() > 1.5 * edge.std()  # a body stands in the middle, floor beside it


def test_movies_are_copied_and_what_is_there_is_left(study):
    folder, names = study
    assert bpy.ops.beyond_mocap.study_render(directory=f"{folder}/", **SMALL) == {"FINISHED"}
    clips = folder / "clips"
    assert sorted(path.name for path in clips.iterdir()) == sorted(f"{name}.mp4" for name in names.values())
    assert (clips / f"{names['good.mp4']}.mp4").read_bytes() == b"good"
    movie = bpy.data.movieclips.load(str(clips / f"{names['a.bvh']}.mp4"))
    assert movie.frame_duration == 3 and movie.fps == 10.0 and tuple(movie.size) == (48, 28)
    bpy.data.movieclips.remove(movie)
    (clips / f"{names['a.bvh']}.mp4").write_bytes(b"kept")
    (clips / f"{names['b.bvh']}.mp4").unlink()
    assert bpy.ops.beyond_mocap.study_render(directory=f"{folder}/", **SMALL) == {"FINISHED"}
    assert (clips / f"{names['a.bvh']}.mp4").read_bytes() == b"kept" and (clips / f"{names['b.bvh']}.mp4").is_file()


def test_a_ball_beside_a_clip_is_seen(study, core):
    folder, names = study
    times = np.arange(7) / 30.0
    ball = core("synthesis.take").BallPath(times, np.tile([0.0, -0.9, 0.3], (7, 1)) + [0.0, 0.0, 0.0], np.ones(7, bool))
    assert bpy.ops.beyond_mocap.study_render(directory=f"{folder}/", pictures=True, **SMALL) == {"FINISHED"}
    bare = pixels(folder / "clips" / names["a.bvh"] / "0001.png")
    core("files.tables").write_ball(folder.parent / "a.ball.csv", ball)
    assert bpy.ops.beyond_mocap.study_render(directory=f"{folder}/", pictures=True, again=True, **SMALL) == {"FINISHED"}
    assert np.abs(pixels(folder / "clips" / names["a.bvh"] / "0001.png") - bare).max() > 0.1


def test_pictures_that_cannot_be_made_again_stay(study, extension, core, monkeypatch):
    folder, names = study
    shown = folder / "clips" / names["a.bvh"]
    shown.mkdir(parents=True)
    (shown / "0001.png").write_bytes(b"before")

    def broken(_path, *_):
        raise core("base.errors").InputError("film", "no light")

    monkeypatch.setattr(importlib.import_module(f"{extension.__name__}.scene.study"), "render_motion", broken)
    with pytest.raises(RuntimeError, match="no light"):
        bpy.ops.beyond_mocap.study_render(directory=f"{folder}/", pictures=True, again=True, **SMALL)
    assert (shown / "0001.png").read_bytes() == b"before"


@pytest.mark.parametrize("spoil, words", [
    (lambda folder: (folder / "study.json").unlink(), "study.json"),
    (lambda folder: (folder.parent / "b.bvh").unlink(), "b.bvh"),
    (lambda folder: (folder.parent / "good.mp4").unlink(), "good.mp4"),
])
def test_what_is_missing_is_told_before_anything_is_rendered(study, spoil, words):
    folder, _ = study
    spoil(folder)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.beyond_mocap.study_render(directory=f"{folder}/", **SMALL)
    assert not (folder / "clips").exists()


@pytest.mark.parametrize("engine", ["AUTO", "EEVEE", "CYCLES", "WORKBENCH"])
def test_every_engine_of_this_blender_takes_the_settings(extension, engine):
    study = importlib.import_module(f"{extension.__name__}.scene.study")
    scene, name = bpy.context.scene, study.find_engine(engine)
    study._apply_settings(scene, study.RenderLook(name, (64, 36), 25, 3))
    assert scene.render.engine == name and (scene.render.fps, scene.render.resolution_x) == (25, 64)
    assert engine != "AUTO" or name == "CYCLES"  # there is no window here


@pytest.mark.parametrize("engine", ["AUTO", "CYCLES"])
def test_without_the_cycles_add_on_another_engine_renders(extension, engine):
    import addon_utils

    study = importlib.import_module(f"{extension.__name__}.scene.study")
    addon_utils.disable("cycles")
    try:
        name = study.find_engine(engine)
        study._apply_settings(bpy.context.scene, study.RenderLook(name, (64, 36), 25, 3))
    finally:
        addon_utils.enable("cycles")
    assert name.startswith("BLENDER_EEVEE") and bpy.context.scene.render.engine == name
    assert study.find_engine(engine) == "CYCLES"


def test_the_camera_glides_without_lag(extension):
    followed = importlib.import_module(f"{extension.__name__}.scene.study").smooth_path
    time = np.arange(90) / 30.0
    straight = np.stack([3.0 * time, 1.0 - time], axis=1)
    assert np.allclose(followed(straight, 30.0), straight, atol=1e-9)
    shaken = straight + 0.05 * np.sin(2.0 * np.pi * 4.0 * time)[:, None]
    assert np.abs(followed(shaken, 30.0) - straight)[15:-15].max() < 0.005
    assert np.array_equal(followed(straight[:1], 30.0), straight[:1])
