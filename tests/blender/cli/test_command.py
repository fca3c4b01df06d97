"""The commands inside Blender: the same verbs, Blender's own formats, the contract's exit status."""

import importlib
import pathlib
import subprocess
import sys

import bpy
import numpy as np
import pytest

TOP = pathlib.Path(__file__).resolve().parents[3]
SAMPLE = TOP / "sample_blend"


@pytest.fixture(scope="module")
def order(library_folder, tmp_path_factory):
    """Arguments of a short synthesis."""
    folder = tmp_path_factory.mktemp("order")
    rows = "\n".join(f"{t / 10},{t / 5},0,{t / 5 + 1},0,0.11" for t in range(40))
    (folder / "track.csv").write_text(f"time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m\n{rows}\n")
    (folder / "words.txt").write_text("")
    return ["synthesize", "--library", str(library_folder), "--track", str(folder / "track.csv"),
            "--annotations", str(folder / "words.txt")]


@pytest.fixture
def run(extension):
    return importlib.import_module(f"{extension.__name__}.operators.command").run


@pytest.mark.parametrize("suffix", (".bvh", ".blend", ".fbx", ".glb", ".usdc"))
def test_every_form_comes_out(run, order, tmp_path, suffix):
    out = tmp_path / f"player{suffix}"
    assert run([*order, "--out", str(out)]) == 0
    assert out.stat().st_size > 1000
    assert [path.name for path in tmp_path.iterdir()] == [out.name], "something was left beside it"


def test_the_blend_file_holds_the_player_and_the_ball(run, order, tmp_path):
    assert run([*order, "--out", str(tmp_path / "player.blend"), "--fps", "25"]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "player.blend"))
    scene = bpy.context.scene
    assert scene.render.fps == 25 and scene.frame_start == 0 and scene.frame_end == 97
    assert {"Player", "Ball"} <= {thing.name for thing in bpy.data.objects}
    assert bpy.data.objects["Player"].animation_data.action_slot is not None
    scene.frame_set(50)
    ball = bpy.data.objects["Ball"].matrix_world.translation
    assert tuple(ball) == pytest.approx((5.0, 0.0, 0.11), abs=0.05)


def test_exit_status(run, order, tmp_path, capfd):
    assert run(["no-such-verb"]) == 2
    assert run([*order, "--out", str(tmp_path / "player.xyz")]) == 2
    assert run([*order, "--out", str(tmp_path / "nowhere" / "player.blend")]) == 2
    (tmp_path / "words.txt").write_text("2 header subtle\n")
    assert run([*order[:-1], str(tmp_path / "words.txt"), "--out", str(tmp_path / "player.blend")]) == 3
    assert "Traceback" not in capfd.readouterr().err
    assert list(tmp_path.glob("player*")) == []


@pytest.mark.parametrize("suffix", (".bvh", ".blend", ".fbx", ".glb", ".usdc"))
def test_a_ride_comes_out_in_every_form(run, tmp_path, suffix):
    (tmp_path / "bend.csv").write_text("x_m,y_m\n0,0\n1,0\n2,1\n2,3\n")
    out = tmp_path / "out" / f"rider{suffix}"
    out.parent.mkdir()
    walk = SAMPLE / "library" / "walking_1_2.bvh"
    assert run(["path", str(walk), "--path", str(tmp_path / "bend.csv"), "--out", str(out)]) == 0
    assert out.stat().st_size > 1000 and [path.name for path in out.parent.iterdir()] == [out.name]


def test_the_blend_file_of_a_ride_holds_the_rider_on_its_path(run, tmp_path):
    (tmp_path / "line.csv").write_text("x_m,y_m\n5,-2\n5,20\n")
    walk = SAMPLE / "library" / "walking_1_2.bvh"
    words = ["path", str(walk), "--path", str(tmp_path / "line.csv"), "--out", str(tmp_path / "rider.blend")]
    assert run(words) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "rider.blend"))
    scene, player = bpy.context.scene, bpy.data.objects["Player"]
    scene.frame_set(scene.frame_end)
    hips = player.matrix_world @ player.pose.bones[0].head
    assert hips.x == pytest.approx(5.0, abs=0.1) and hips.y > 0.0


def test_batch_writes_a_scene_without_an_installed_extension(library_folder, tmp_path):
    """A match in a .blend has the extension's own properties."""
    rows = "".join(f"{number / 10},ada,{0.12 * number},0\n" for number in range(21))
    (tmp_path / "game.csv").write_text("time_s,player,x_m,y_m\n" + rows)
    words = ["match", "--tracking", "game.csv", "--library", library_folder, "--out", "made", "--no-figures",
             "--workers", "1", "--scene", "game.blend"]
    command = [sys.executable, "-P", TOP / "batch.py", "--", *words]
    environment = {"BLENDER_USER_RESOURCES": str(tmp_path), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and (tmp_path / "game.blend").stat().st_size > 1000, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("arguments, status", ((["--version"], 0), (["mirror", "missing.bvh", "out.bvh"], 2)))
def test_batch_needs_no_installed_extension(tmp_path, arguments, status):
    command = [sys.executable, "-P", str(TOP / "batch.py"), "--", *arguments]
    environment = {"BLENDER_USER_RESOURCES": str(tmp_path), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == status, done.stderr
    assert ("missing.bvh" in done.stderr) == (status == 2) and "Traceback" not in done.stderr


def test_foreign_recordings_are_converted_first(run, extension, library_folder, tmp_path, capfd):
    bvh = importlib.import_module(f"{extension.__name__}.beyond_mocap.files.bvh.bvh")
    rigs = importlib.import_module(f"{extension.__name__}.scene.rigs.armature")
    action = importlib.import_module(f"{extension.__name__}.scene.core.action")
    source = next(path for path in sorted(library_folder.rglob("*.bvh")) if path.with_suffix(".txt").is_file())
    motion, folder = bvh.read_bvh(source).motion, tmp_path / "library"
    folder.mkdir()
    bpy.context.scene.render.fps = round(motion.fps)
    rig = rigs.create_armature(bpy.context, motion.skeleton, "Somebody")
    action.write_motion(rig, motion, bpy.context.scene, 1.0)
    bpy.context.scene.frame_end = len(motion)
    bpy.ops.export_scene.gltf(filepath=str(folder / "walk.glb"), export_format="GLB")
    (folder / "walk.txt").write_text("0 1 walking\n")
    (folder / "broken.fbx").write_bytes(b"no FBX")
    assert run(["library", str(folder), "--cache", str(tmp_path / "cache")]) == 0
    told = capfd.readouterr()
    assert "1 clip" in told.out and "skipped:" in told.err and "Traceback" not in told.err
    assert (tmp_path / "cache/converted/walk.glb.bvh").is_file() and not (folder / ".beyond_mocap").exists()
    assert run(["library", str(tmp_path / "nowhere")]) == 2


def test_a_root_above_the_hips_comes_back_in_every_form(run, extension, order, library_folder, tmp_path):
    bvh, form = (importlib.import_module(f"{extension.__name__}.beyond_mocap.files.bvh.{name}")
                 for name in ("bvh", "bvh_write"))
    kinematics = importlib.import_module(f"{extension.__name__}.beyond_mocap.motion.motion").forward_kinematics
    foreign = importlib.import_module(f"{extension.__name__}.scene.library.foreign")
    root = form.JointAboveHips(name="World", channels=(), is_moving=False, position=np.array([0.0, 0.5, 0.0]),
                               rotation=np.array([1.0, 0.0, 0.0, 0.0]))
    folder = tmp_path / "library"
    folder.mkdir()
    for source in sorted(library_folder.glob("*.bvh")):
        bvh.write_bvh(folder / source.name, bvh.read_bvh(source).motion, form.BvhForm(above=(root,)))
        if source.with_suffix(".txt").is_file():
            (folder / source.with_suffix(".txt").name).write_bytes(source.with_suffix(".txt").read_bytes())
    order = ["synthesize", "--library", str(folder), *order[3:], "--keep-root", "--no-made"]
    for suffix in (".bvh", ".fbx"):
        assert run([*order, "--out", str(tmp_path / f"player{suffix}")]) == 0
    plain = bvh.read_bvh(tmp_path / "player.bvh")
    take = foreign.read_takes(tmp_path / "player.fbx")[0]
    assert [joint.name for joint in plain.form.above] == ["World"] == [joint.name for joint in take.form.above]
    assert np.allclose(take.form.above[0].position, root.position, atol=1e-4)
    apart = kinematics(plain.motion)[0][:, 0] - kinematics(take.motion)[0][: len(plain.motion), 0]
    assert np.abs(apart).max() < 2e-3
