"""Motions from FBX, glTF and USD: what Blender's exporters wrote comes back where it was."""

import importlib

import bpy
import made
import numpy as np
import pytest
from undo import state


@pytest.fixture
def rooms(extension):
    names = ("armature", "action", "foreign", "body")
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}") for name in names}


EXPORTERS = {
    ".fbx": lambda path: bpy.ops.export_scene.fbx(
        filepath=path, add_leaf_bones=False, bake_anim_simplify_factor=0.0, bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False),
    ".glb": lambda path: bpy.ops.export_scene.gltf(filepath=path, export_format="GLB"),
    ".usdc": lambda path: bpy.ops.wm.usd_export(filepath=path, export_animation=True),
}


def exported(core, rooms, path, fps=30):
    """A known motion on an armature with a body, written by Blender's exporter; the motion. The file is empty after."""
    motion = made.motion(core, 61, float(fps))
    scene = bpy.context.scene
    scene.render.fps = fps
    scene.frame_start, scene.frame_end = 1, 61
    rig = rooms["armature"].create(bpy.context, motion.skeleton, "Somebody")
    rooms["action"].write(rig, motion, scene, 1.0)
    rooms["body"].create(rig, "Somebody", (1, 0, 0), scene.collection, scene, motion)
    EXPORTERS[path.suffix](str(path))
    bpy.ops.wm.read_homefile(use_empty=True)
    return motion


def places_of(core, motion, names):
    places, _ = core("motion.motion").forward_kinematics(motion)
    return places[:, [motion.skeleton.index(name) for name in names]]


@pytest.mark.parametrize("ending", sorted(EXPORTERS))
@pytest.mark.parametrize("fps", [30, 60])
def test_a_known_motion_comes_back_within_a_millimetre(core, rooms, tmp_path, ending, fps):
    path = tmp_path / f"clip{ending}"
    motion = exported(core, rooms, path, fps)
    bpy.context.scene.render.fps = 24
    before = state()
    takes = rooms["foreign"].read(path)
    assert state() == before and bpy.context.scene.name == "Scene"
    back = takes[0].motion
    assert back.fps == pytest.approx(fps) and len(takes) == 1
    assert set(back.skeleton.names) == set(motion.skeleton.names)
    assert len(back) == len(motion)
    apart = np.linalg.norm(places_of(core, back, motion.skeleton.names) - places_of(core, motion, motion.skeleton.names), axis=-1)
    assert apart.max() < 1e-3, apart.max()
    clip = rooms["foreign"].as_clip(back)
    apart = np.linalg.norm(places_of(core, clip.motion, motion.skeleton.names) - places_of(core, motion, motion.skeleton.names), axis=-1)
    assert apart.max() < 1e-3, apart.max()


def test_files_without_a_motion_are_told(rooms, tmp_path):
    broken = tmp_path / "broken.fbx"
    broken.write_bytes(b"Kaydara FBX Binary  \0\x1a\0" + b"\1" * 300)
    bpy.ops.mesh.primitive_cube_add()
    box = tmp_path / "box.glb"
    bpy.ops.export_scene.gltf(filepath=str(box), export_format="GLB")
    before = state()
    for path, told in ((broken, "cannot be read"), (box, "no armature"), (tmp_path / "gone.glb", "no such file"),
                       (tmp_path / "x.abc", "no such file")):
        with pytest.raises(Exception, match=told):
            rooms["foreign"].read(path)
    assert state() == before
