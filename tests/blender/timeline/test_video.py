"""The reference video: on every frame of the scene its own frame, at any rate of either; small numbered pictures."""

import math
from fractions import Fraction
from importlib import import_module

import bpy
import numpy as np
import pytest
from conftest import EXTENSION

PICTURES = 40


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """A sequence of numbered pictures: the number in bits, a column each; returns the first one's path."""
    folder = tmp_path_factory.mktemp("sequence")
    for number in range(1, PICTURES + 1):
        pixels = np.zeros((8, 48, 4), np.float32)
        pixels[..., 3] = 1.0
        for bit in range(6):
            pixels[:, 8 * bit : 8 * bit + 8, :3] = number >> bit & 1
        image = bpy.data.images.new("picture", 48, 8)
        image.pixels.foreach_set(pixels.ravel())
        image.filepath_raw, image.file_format = str(folder / f"shot_{number:04d}.png"), "PNG"
        image.save()
        bpy.data.images.remove(image)
    return str(folder / "shot_0001.png")


@pytest.fixture
def video():
    return import_module(f"{EXTENSION}.scene.timeline.video")


@pytest.fixture
def scene():
    return bpy.context.scene


def shown(scene):
    """The number, from 1, of the clip's frame that a clip editor shows now."""
    return scene.frame_current - scene.beyond_mocap.video.clip.frame_start + 1


def wrong_frames(scene, rate, begins, frames=range(-30, 90)):
    """Scene frames on which another picture is up than the one that a video of `rate` shows at that second. Two
    thousandths of a frame before one ends the next may be up."""
    fps = Fraction(scene.render.fps) / Fraction(scene.render.fps_base).limit_denominator(10000)
    settings, wrong = scene.beyond_mocap, []
    for frame in frames:
        scene.frame_set(frame)
        seconds = Fraction(settings.start_time).limit_denominator(10000) + Fraction(frame - settings.start_frame) / fps
        exact = (seconds - Fraction(begins)) * Fraction(rate)
        if shown(scene) - 1 not in {math.floor(exact), math.floor(exact + Fraction(1, 500))}:
            wrong.append(frame)
    return wrong


@pytest.mark.parametrize("fps, base", [(24, 1.0), (24, 1.001), (25, 1.0), (30, 1.0), (60, 1.0), (60, 1.001)])
@pytest.mark.parametrize("rate", ["25", "50", "24000/1001", "30000/1001", "12"])
def test_the_picture_of_every_frame_is_the_one_of_its_second(video, scene, pictures, fps, base, rate):
    scene.render.fps, scene.render.fps_base = fps, base
    video.show_clip(scene, video.load_clip(pictures), float(Fraction(rate)))
    assert wrong_frames(scene, rate, 0) == []


@pytest.mark.parametrize("begins", ["1/2", "-3/4", "1/25", "12"])
def test_a_changed_setting_counts_at_once(video, scene, pictures, begins):
    scene.render.fps = 25
    video.show_clip(scene, video.load_clip(pictures), 25.0)
    scene.frame_set(10)
    scene.beyond_mocap.video.begins = float(Fraction(begins))
    bpy.context.view_layer.update()
    assert shown(scene) == 10 + math.floor(-25 * Fraction(begins))
    assert wrong_frames(scene, "25", begins) == []


def test_the_scenes_clock_and_rate_count(video, scene, pictures):
    video.show_clip(scene, video.load_clip(pictures), 25.0)
    settings = scene.beyond_mocap
    settings.start_frame, settings.start_time, settings.video.begins = 101, 2700.0, 2700.0
    scene.render.fps = 60
    assert wrong_frames(scene, "25", 2700, range(95, 200)) == []
    scene.render.fps = 30
    bpy.context.view_layer.update()
    assert wrong_frames(scene, "25", 2700, range(95, 200)) == []


def test_a_movie_says_its_own_rate(video, scene, pictures, tmp_path):
    movie = made_movie(tmp_path / "movie.avi", pictures)
    assert bpy.ops.beyond_mocap.load_video(filepath=movie) == {"FINISHED"}
    scene = bpy.context.scene
    scene.render.fps = 60
    assert scene.beyond_mocap.video.clip.source == "MOVIE" and scene.beyond_mocap.video.rate == 50.0
    assert wrong_frames(scene, "50", 0) == []


def made_movie(path, pictures):
    """The pictures as a movie of 50 frames a second, written by Blender in a scene of its own."""
    scene = bpy.data.scenes.new("Render")
    scene.render.fps, scene.frame_end, scene.render.filepath = 50, PICTURES, str(path.with_suffix(""))
    scene.render.resolution_x, scene.render.resolution_y, scene.render.use_file_extension = 48, 16, True
    editor = scene.sequence_editor_create()
    strip = (editor.strips if hasattr(editor, "strips") else editor.sequences).new_image("shots", pictures, 1, 1)
    for number in range(2, PICTURES + 1):
        strip.elements.append(f"shot_{number:04d}.png")
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "VIDEO"
    scene.render.image_settings.file_format = "FFMPEG"
    scene.render.ffmpeg.format, scene.render.ffmpeg.codec = "AVI", "MPEG4"
    bpy.ops.render.render(animation=True, scene=scene.name)
    bpy.data.scenes.remove(scene)
    return str(next(path.parent.glob("*.avi")))


def test_the_operators_load_move_and_remove(scene, pictures):
    scene.render.fps, scene.render.fps_base = 24, 1.001
    assert bpy.ops.beyond_mocap.load_video(filepath=pictures) == {"FINISHED"}
    video = scene.beyond_mocap.video
    assert video.rate == pytest.approx(23.976, abs=1e-3)
    bpy.ops.beyond_mocap.load_video(filepath=pictures, rate=25.0)
    bpy.ops.beyond_mocap.move_video(frames=5)
    assert (video.rate, video.begins) == (25.0, pytest.approx(0.2))
    assert len(bpy.data.movieclips) == 1
    clip = video.clip
    assert bpy.ops.beyond_mocap.remove_video() == {"FINISHED"}
    assert video.clip is None and scene.active_clip is None and clip.frame_start == 1
    assert not (clip.animation_data and clip.animation_data.drivers)
    assert not bpy.ops.beyond_mocap.move_video.poll() and not bpy.ops.beyond_mocap.show_video.poll()


def test_another_video_leaves_the_first_undriven(video, scene, pictures, tmp_path):
    first, second = video.load_clip(pictures), video.load_clip(made_movie(tmp_path / "other.avi", pictures))
    video.show_clip(scene, first)
    video.show_clip(scene, second)
    video.show_clip(scene, second)
    assert not first.animation_data.drivers and len(second.animation_data.drivers) == 1
    assert scene.active_clip == second


def test_each_step_can_be_undone_and_redone(scene, pictures):
    def state():
        video = bpy.context.scene.beyond_mocap.video
        drivers = sum(len(c.animation_data.drivers) for c in bpy.data.movieclips if c.animation_data)
        return (video.clip.name if video.clip else None, round(video.begins, 4), len(bpy.data.movieclips), drivers)

    bpy.ops.ed.undo_push(message="before")
    for step, arguments in ((bpy.ops.beyond_mocap.load_video, {"filepath": pictures}),
                            (bpy.ops.beyond_mocap.move_video, {"frames": -3}), (bpy.ops.beyond_mocap.remove_video, {})):
        before = state()
        step("EXEC_DEFAULT", True, **arguments)
        after = state()
        assert after != before
        bpy.ops.ed.undo()
        assert state() == before
        bpy.ops.ed.redo()
        assert state() == after


@pytest.mark.parametrize("bad", ["", "/nowhere/film.mp4", "no-movie"])
def test_what_is_no_video_is_told_and_changes_nothing(scene, pictures, tmp_path, bad):
    if bad == "no-movie":
        bad = str(tmp_path / "text.mp4")
        (tmp_path / "text.mp4").write_text("words")
    with pytest.raises(RuntimeError, match="movie"):
        bpy.ops.beyond_mocap.load_video(filepath=bad)
    assert scene.beyond_mocap.video.clip is None and len(bpy.data.movieclips) == 0


def test_it_survives_save_and_load(video, scene, pictures, tmp_path):
    scene.render.fps = 60
    video.show_clip(scene, video.load_clip(pictures), 25.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    scene = bpy.context.scene
    assert wrong_frames(scene, "25", 0) == []
