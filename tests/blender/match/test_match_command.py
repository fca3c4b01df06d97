"""A whole match by one command inside Blender: made, and written as a file of everybody."""

import importlib
import pathlib

import bpy
import pytest

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend"


@pytest.fixture
def run(extension):
    return importlib.import_module(f"{extension.__name__}.operators.command").run


@pytest.fixture(scope="module")
def order(sample_cache):
    """Arguments of one second of the small match."""
    small = SAMPLE / "match" / "small"
    return ["match", "--tracking", str(small / "small.dat"), "--library", str(SAMPLE / "library"),
            "--cache", str(sample_cache), "--from", "2", "--to", "3", "--workers", "2", "--no-figures"]


def test_everybody_comes_out_as_one_file(run, order, tmp_path, capfd):
    out = tmp_path / "match.blend"
    assert run([*order, "--out", str(tmp_path / "made"), "--scene", str(out)]) == 0
    assert capfd.readouterr().out.splitlines()[0] == f"{out}: written"  # and no name of a temporary file before it
    bpy.ops.wm.open_mainfile(filepath=str(out))
    scene = bpy.context.scene
    assert scene.render.fps == 30 and (scene.frame_start, scene.frame_end) == (0, 30)
    bodies = [thing for thing in scene.objects if thing.type == "ARMATURE"]
    assert len(bodies) == 8 and all(thing.animation_data.action_slot for thing in bodies)
    assert {"Home 10 Dan Striker", "Away 9 Hana Forward"} <= {thing.name for thing in bodies}
    assert "Match ball" in scene.objects and scene.camera is not None
    out.unlink()
    assert run([*order, "--out", str(tmp_path / "made"), "--scene", str(tmp_path / "match.glb")]) == 0  # made already
    assert (tmp_path / "match.glb").stat().st_size > 100_000
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("name, told", [
    ("match.xyz", ".xyz"), ("nowhere/match.blend", "folder"), ("match", "file type ''"),
])
def test_a_wrong_name_is_told_before_work_begins(run, order, tmp_path, capfd, name, told):
    assert run([*order, "--out", str(tmp_path / "made"), "--scene", str(tmp_path / name)]) == 2
    error = capfd.readouterr().err.strip()
    assert told in error and "\n" not in error
    assert not list(tmp_path.iterdir())
