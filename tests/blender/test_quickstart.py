"""The file that an animator opens first: small, free of anybody's paths, and three buttons lead to two moving
players."""

import importlib
import pathlib
import shutil

import bpy

SAMPLE = pathlib.Path(__file__).resolve().parents[2] / "sample_blend"


def test_three_buttons(extension, sample_cache, tmp_path):
    for folder in ("library", "match"):
        shutil.copytree(SAMPLE / folder, tmp_path / folder, ignore=shutil.ignore_patterns(".beyond_mocap"))
    shutil.copytree(sample_cache, tmp_path / "library" / ".beyond_mocap")
    shutil.copy(SAMPLE / "quickstart.blend", tmp_path)
    assert (tmp_path / "quickstart.blend").stat().st_size < 1e6
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "quickstart.blend"))
    settings = bpy.context.scene.beyond_mocap
    paths = [settings.library_folder]
    paths += [path for player in settings.players for path in (player.tracking_file, player.annotation_file)]
    paths += [player.dot.beyond_mocap_dot.tracking_file for player in settings.players]
    assert len(paths) == 7 and all(path.startswith("//") for path in paths)
    rooms = {
        name: importlib.import_module(f"{extension.__name__}.scene.{name}")
        for name in ("timeline.strips", "player.tracks")
    }
    for player in settings.players:
        track = rooms["player.tracks"].read_track(settings, player)
        on_disk = rooms["timeline.strips"].read_written_labels(player, settings.rate, track)
        asked = rooms["timeline.strips"].read_player_timeline(player, bpy.context.scene)
        assert (asked.spans, asked.keys) == (on_disk.spans, on_disk.keys), "run sample_blend/make_quickstart.py again"
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    assert bpy.ops.beyond_mocap.accept() == {"FINISHED"}
    bodies = [player.body for player in settings.players]
    before = [body.pose.bones[0].matrix.translation.copy() for body in bodies]
    bpy.context.scene.frame_set(300)
    assert all((body.pose.bones[0].matrix.translation - at).length > 1.0 for body, at in zip(bodies, before))
    assert bpy.context.scene.camera.parent.animation_data.action is not None
