"""Files for engines, read back: joints, meshes, root bone, scale and rate are what the program expects."""

import importlib
import json
import pathlib
import shutil
from types import SimpleNamespace

import bmesh
import bpy
import numpy as np
import pytest
import sample_characters as characters
import sample_rigs as rigs
from conftest import EXTENSION
from mathutils import Matrix

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
RATE, FRAMES = 30, 50
LOOKED_AT = (0, 20, 45)
JOINTS = ("Head", "LeftHand", "RightFoot", "LeftToeBase")


@pytest.fixture
def player(core):
    """A Mixamo character that plays a recorded jog with a turn, in centimetres and turned as its importer leaves it."""
    bpy.context.scene.render.fps = RATE
    room = {name: importlib.import_module(f"{EXTENSION}.scene.{name}")
            for name in ("rigs.armature", "core.action")}
    found = core("files.bvh.bvh").read_bvh(SAMPLE / "jogging_turn_left.bvh").motion
    clip = core("motion.motion").resample(found, float(RATE)).frames(0, FRAMES)
    one = bpy.context.scene.beyond_mocap.players.add()
    one.name, one.body = "Ada", room["rigs.armature"].create_armature(bpy.context, clip.skeleton, "Ada")
    room["core.action"].write_motion(one.body, clip, bpy.context.scene, 1)
    rig = rigs.create_mixamo()
    characters.add_mesh(rig, EXTENSION)
    one.character = rig
    bpy.context.scene.frame_end = FRAMES
    return one


def read_heads(rig, offset):
    return rigs.read_heads(rig, [find_bone(rig, name) for name in JOINTS], [offset + frame for frame in LOOKED_AT])


def find_bone(rig, name):
    return next(bone.name for bone in rig.data.bones if bone.name.endswith(name))


def read_vertices(mesh, offset):
    """Sorted heights and extents of a mesh at the frames: exporters order and split vertices in their own ways."""
    found = []
    for frame in LOOKED_AT:
        bpy.context.scene.frame_set(offset + frame)
        evaluated = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
        points = np.array([evaluated.matrix_world @ vertex.co for vertex in evaluated.data.vertices])
        found.append([points.min(axis=0), points.max(axis=0)])
    return np.array(found)


def read_back(path):
    """Import a file into an empty scene of its rate."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.render.fps = RATE
    if path.suffix == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(path))
    elif path.suffix == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path))
    elif path.suffix == ".abc":
        bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    else:
        bpy.ops.wm.usd_import(filepath=str(path))
    armature = max((thing for thing in bpy.data.objects if thing.type == "ARMATURE"), default=None,
                   key=lambda one: sum("mixamorig" in bone.name for bone in one.data.bones))
    mesh = max((thing for thing in bpy.data.objects if thing.type == "MESH"), key=lambda one: len(one.data.vertices))
    return armature, mesh


def deliver(tmp_path, **options):
    assert bpy.ops.beyond_mocap.deliver(directory=f"{tmp_path}/", **options) == {"FINISHED"}
    return sorted(tmp_path.iterdir())


@pytest.mark.parametrize("preset", ["UNREAL", "UNITY", "GODOT", "USD"])
def test_a_player_comes_back_with_a_root_on_the_ground(player, tmp_path, preset):
    body = player.character_body
    shown, skin = read_heads(body, 1), read_vertices(body.children[0], 1)
    (path,) = deliver(tmp_path, preset=preset, who="ACTIVE")
    armature, mesh = read_back(path)
    offset = round(armature.animation_data.action.frame_range[0])
    assert np.ptp(armature.animation_data.action.frame_range) == pytest.approx(FRAMES - 1)
    assert np.abs(read_heads(armature, offset) - shown).max() < 1e-3
    assert np.abs(read_vertices(mesh, offset) - skin).max() < 1e-3
    roots = [bone.name for bone in armature.data.bones if bone.parent is None]
    assert roots == ["root"]
    ground = rigs.read_heads(armature, roots, range(offset, offset + FRAMES))[:, 0]
    assert np.abs(ground[:, 2]).max() < 1e-3 and np.linalg.norm(np.diff(ground[[0, -1]], axis=0)) > 2.0
    hips = rigs.read_heads(armature, [find_bone(armature, "Hips")], range(offset, offset + FRAMES))[:, 0]
    assert np.linalg.norm((hips - ground)[:, :2], axis=1).max() < 0.3


def test_unreal_gets_centimetres_and_a_name_it_drops(player, tmp_path):
    (path,) = deliver(tmp_path, preset="UNREAL", who="ACTIVE")
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.unit_settings.scale_length = 0.01
    bpy.ops.import_scene.fbx(filepath=str(path))
    armature = next(thing for thing in bpy.data.objects if thing.type == "ARMATURE")
    assert armature.name == "Armature"
    np.testing.assert_allclose(armature.matrix_world.to_scale(), (1, 1, 1), rtol=1e-4)
    height = armature.data.bones[find_bone(armature, "Head")].head_local.z
    assert 150 < height < 165  # centimetres in the bones themselves


def test_in_place_stays_where_it_began(player, tmp_path):
    (path,) = deliver(tmp_path, preset="GODOT", who="ACTIVE", root="IN_PLACE")
    armature, _ = read_back(path)
    hips = rigs.read_heads(armature, [find_bone(armature, "Hips")], range(FRAMES))[:, 0]
    assert np.ptp(hips[:, :2], axis=0).max() < 0.3


@pytest.mark.parametrize("who", ["ACTIVE", "SCENE"])
def test_alembic_moves_point_by_point(player, tmp_path, who):
    mesh = player.character_body.children[0]
    expected = read_vertices(mesh, 1)
    (path,) = deliver(tmp_path, preset="ALEMBIC", who=who)
    _, read = read_back(path)
    offset = 0 if who == "ACTIVE" else 1  # a player's file begins at 0, the scene's at its own first frame
    assert np.abs(read_vertices(read, offset) - expected).max() < 1e-3


def test_the_whole_scene_as_usd(player, tmp_path):
    expected = read_heads(player.character_body, 1)
    (path,) = deliver(tmp_path, preset="USD", who="SCENE")
    armature, _ = read_back(path)
    assert np.abs(read_heads(armature, 1) - expected).max() < 1e-3


def test_every_player_has_a_file_of_its_own(player, tmp_path):
    players = bpy.context.scene.beyond_mocap.players
    for name in ("Ada", "Eva/Lou"):
        one = players.add()
        one.name = name
        one.body = players[0].body.copy()
        one.body.name = name
        bpy.context.scene.collection.objects.link(one.body)
    found = deliver(tmp_path, preset="GODOT", who="PLAYERS", meshes=False)
    assert len(found) == 3 and all(path.suffix == ".glb" for path in found)
    names = importlib.import_module(f"{EXTENSION}.scene.rigs.engine_files").name_files(["A/b", "a?B", "", "A/b"])
    assert names == ["A_b", "a_B (2)", "player", "A_b (3)"]


def test_what_cannot_be_delivered_is_told_and_leaves_nothing(player, tmp_path):
    def complain(**options):
        with pytest.raises(RuntimeError) as error:
            bpy.ops.beyond_mocap.deliver(**options)
        return str(error.value)

    assert "no folder" in complain(who="ACTIVE")
    assert "cannot be written" in complain(directory=f"{tmp_path}/nowhere/", who="ACTIVE")
    assert "a file for each player" in complain(directory=f"{tmp_path}/", who="SCENE", preset="UNREAL")
    assert "no match is shown" in complain(directory=f"{tmp_path}/", who="MATCH")
    (tmp_path / f"{player.character_body.name}.fbx").mkdir()
    assert "is a folder" in complain(directory=f"{tmp_path}/", who="ACTIVE")
    (tmp_path / f"{player.character_body.name}.fbx").rmdir()
    player.character_body.animation_data.action = None
    assert "does not move" in complain(directory=f"{tmp_path}/", who="ACTIVE")
    assert not list(tmp_path.iterdir())
    assert len(bpy.data.scenes) == 1


@pytest.mark.parametrize("preset", ["UNREAL", "GODOT"])
def test_a_mirrored_mesh_is_not_inside_out(player, tmp_path, preset):
    mesh = player.character_body.children[0]
    mesh.data.transform(Matrix.Scale(-1.0, 4, (1.0, 0.0, 0.0)))
    mesh.data.flip_normals()
    mesh.scale.x = -1.0
    bpy.context.view_layer.update()
    (path,) = deliver(tmp_path, preset=preset, who="ACTIVE")
    _, found = read_back(path)
    shape = bmesh.new()
    shape.from_mesh(found.data)
    assert shape.calc_volume(signed=True) * found.matrix_world.determinant() > 0.0
    shape.free()


def test_the_added_root_bone_takes_no_other_bones_name(player, tmp_path):
    rig = player.character_body
    rig.data.bones["mixamorig:LeftHandMiddle1"].name = "root"
    (path,) = deliver(tmp_path, preset="GODOT", who="ACTIVE")
    armature, _ = read_back(path)
    (root,) = [bone.name for bone in armature.data.bones if bone.parent is None]
    ground = rigs.read_heads(armature, [root], (0, FRAMES - 1))[:, 0]
    assert root != "root" and np.linalg.norm(ground[1] - ground[0]) > 2.0


def test_the_whole_scene_is_what_is_visible(player, tmp_path):
    """The hidden original of the character is not in the file; a scene in which nothing is visible has none."""
    bpy.context.view_layer.objects.active = player.character_body
    bpy.ops.object.mode_set(mode="EDIT")
    (path,) = deliver(tmp_path, preset="GODOT", who="SCENE")
    assert bpy.context.mode == "EDIT_ARMATURE"
    content = path.read_bytes()
    nodes = json.loads(content[20:20 + int.from_bytes(content[12:16], "little")])["nodes"]
    assert {"Ada", "Ada Mixamo"} <= {node["name"] for node in nodes} and "Mixamo" not in {one["name"] for one in nodes}
    bpy.ops.object.mode_set(mode="OBJECT")
    path.unlink()
    for thing in bpy.context.scene.objects:
        thing.hide_viewport = True
    with pytest.raises(RuntimeError, match="nothing to deliver is visible"):
        deliver(tmp_path, preset="ALEMBIC", who="SCENE")
    with pytest.raises(RuntimeError, match="no visible mesh"):
        deliver(tmp_path, preset="ALEMBIC", who="ACTIVE", meshes=False)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("preset", ["USD", "ALEMBIC"])
def test_on_a_full_disk_nothing_is_written(player, tmp_path, monkeypatch, preset):
    """USD's exporter leaves a file cut off and succeeds, Alembic's ends Blender."""
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=0))
    with pytest.raises(RuntimeError, match="No space left|MB needed"):
        deliver(tmp_path, preset=preset, who="ACTIVE")
    assert not list(tmp_path.iterdir())


def test_what_an_exporter_raises_is_one_line():
    describe = importlib.import_module(f"{EXTENSION}.scene.rigs.exporters").describe_failure
    raised = RuntimeError('Error: Python: Traceback (most recent call last):\n  File "x.py", line 1, in write\n'
                          "OSError: [Errno 28] No space left on device\nLocation: ops.py:109\n")
    assert describe(raised) == "No space left on device"
    assert describe(RuntimeError("Error: Cannot open file\n")) == "Cannot open file"
