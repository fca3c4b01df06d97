"""Clips come in from BVH files and go out again."""

import importlib
import os

import bpy
import numpy as np
import pytest
import synthetic_motion
from undo import assert_one_step, collect_state


@pytest.fixture
def rooms(extension):
    names = ("rigs.armature", "core.action")
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}") for name in names}


@pytest.fixture
def clip(core, tmp_path):
    """A clip file, and the motion that a reader finds in it."""
    bvh = core("files.bvh.bvh")
    path = tmp_path / "clip.bvh"
    bvh.write_bvh(path, synthetic_motion.build_motion(core))
    return path, bvh.read_bvh(path).motion


@pytest.fixture
def folder(core, tmp_path):
    """A folder with two clips in it and one below it."""
    (tmp_path / "below").mkdir()
    for name in ("a", "b", "below/c"):
        core("files.bvh.bvh").write_bvh(tmp_path / f"{name}.bvh", synthetic_motion.build_motion(core))
    return tmp_path


def play_at_clip_rate():
    bpy.context.scene.render.fps = 30


def test_operator_gives_what_the_functions_give(core, rooms, clip):
    path, motion = clip
    play_at_clip_rate()
    bpy.ops.beyond_mocap.import_clips(filepath=str(path))
    body = bpy.context.object
    assert body.name == "clip" and body.animation_data.action.name == "clip"
    read = rooms["core.action"].read_motion(body, bpy.context.scene)
    assert read.skeleton.has_same_bones(motion.skeleton, 0.0)
    np.testing.assert_allclose(read.root_positions, motion.root_positions, atol=1e-6)
    np.testing.assert_allclose(read.rotations, motion.rotations, atol=1e-6)
    other = rooms["rigs.armature"].create_armature(bpy.context, motion.skeleton, "by function")
    rooms["core.action"].write_motion(other, motion, bpy.context.scene)
    again = rooms["core.action"].read_motion(other, bpy.context.scene)
    assert np.array_equal(again.rotations, read.rotations) and np.array_equal(again.root_positions, read.root_positions)


def test_motion_of_smpl_is_imported(core, rooms, clip, tmp_path):
    smpl, bones = core("files.smpl.smpl"), core("files.smpl.smpl_skeleton")
    still = bones.build_smpl_pose(1.75)
    motion = core("motion.motion").Motion(still.skeleton, np.repeat(still.root_positions, 30, axis=0),
                                          np.repeat(still.rotations, 30, axis=0), 30.0)
    smpl.write_smpl(tmp_path / "stands.npz", motion)
    play_at_clip_rate()
    bpy.ops.beyond_mocap.import_clips(filepath=str(tmp_path / "stands.npz"))
    assert {bone.name for bone in bpy.context.object.data.bones} == set(bones.JOINTS)
    assert len(rooms["core.action"].read_motion(bpy.context.object, bpy.context.scene)) == 30


def test_export_writes_what_was_imported(core, rooms, clip, tmp_path):
    path, motion = clip
    play_at_clip_rate()
    bpy.ops.beyond_mocap.import_clips(filepath=str(path))
    assert bpy.ops.beyond_mocap.export_bvh(filepath=str(tmp_path / "out.bvh")) == {"FINISHED"}
    out = core("files.bvh.bvh").read_bvh(tmp_path / "out.bvh").motion
    kinematics = core("motion.motion").forward_kinematics
    np.testing.assert_allclose(kinematics(out)[0], kinematics(motion)[0], atol=1e-5)


def test_many_files_and_a_folder(folder):
    bpy.ops.beyond_mocap.import_clips(directory=str(folder), files=[{"name": "a.bvh"}, {"name": "b.bvh"}])
    assert sorted(o.name for o in bpy.context.selected_objects) == ["a", "b"]
    bpy.ops.beyond_mocap.import_clips(filepath=str(folder))
    assert sorted(o.name for o in bpy.context.selected_objects) == ["a.001", "b.001", "c"]


def test_onto_the_selected_armature(core, clip, folder):
    bpy.ops.beyond_mocap.import_clips(filepath=str(clip[0]))
    bpy.ops.beyond_mocap.import_clips(filepath=str(folder / "a.bvh"), reuse=True)
    assert [o.name for o in bpy.data.objects] == ["clip"]
    assert sorted(action.name for action in bpy.data.actions) == ["a", "clip"]
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "kept.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "kept.blend"))
    assert sorted(action.name for action in bpy.data.actions) == ["a", "clip"], "the unused action was lost"


def test_mirrored_twice_is_as_before(core, rooms, clip):
    play_at_clip_rate()
    bpy.ops.beyond_mocap.import_clips(filepath=str(clip[0]))
    before = rooms["core.action"].read_motion(bpy.context.object, bpy.context.scene)
    bpy.ops.beyond_mocap.mirror()
    once = rooms["core.action"].read_motion(bpy.context.object, bpy.context.scene)
    np.testing.assert_allclose(once.root_positions[0], before.root_positions[0], atol=1e-5)
    assert np.abs(once.rotations - before.rotations).max() > 0.1
    bpy.ops.beyond_mocap.mirror()
    twice = rooms["core.action"].read_motion(bpy.context.object, bpy.context.scene)
    places = core("motion.motion").forward_kinematics
    np.testing.assert_allclose(places(twice)[0], places(before)[0], atol=1e-4)


def test_undo(clip):
    assert_one_step(bpy.ops.beyond_mocap.import_clips, filepath=str(clip[0]))
    assert_one_step(bpy.ops.beyond_mocap.mirror)
    assert_one_step(bpy.ops.beyond_mocap.add_stage, camera=False)
    assert_one_step(bpy.ops.beyond_mocap.add_stage, camera=True)


@pytest.mark.parametrize("content, found", [
    (None, "no such file"),
    (b"", "clip.bvh"),
    (b"\0\1\2binary", "clip.bvh"),
    (b"HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n", "clip.bvh"),
])
def test_a_bad_file_changes_nothing(tmp_path, folder, content, found):
    path = tmp_path / "clip.bvh"
    if content is not None:
        path.write_bytes(content)
    before = collect_state()
    with pytest.raises(RuntimeError, match=found):
        bpy.ops.beyond_mocap.import_clips(directory=str(tmp_path), files=[{"name": "a.bvh"}, {"name": "clip.bvh"}])
    assert collect_state() == before


def test_nothing_given_and_nothing_selected():
    before = collect_state()
    for operator, message in ((bpy.ops.beyond_mocap.import_clips, "no file given"),
                              (bpy.ops.beyond_mocap.mirror, "Select an armature"),
                              (bpy.ops.beyond_mocap.export_bvh, "Select an armature"),
                              (bpy.ops.beyond_mocap.remove_player, "No players in the list")):
        with pytest.raises(RuntimeError, match=message):
            operator()
    assert collect_state() == before


def test_an_armature_without_motion(core, rooms, tmp_path):
    bpy.context.view_layer.objects.active = rooms["rigs.armature"].create_armature(
        bpy.context, synthetic_motion.build_skeleton(core), "Still"
    )
    with pytest.raises(RuntimeError, match="plays no action"):
        bpy.ops.beyond_mocap.mirror()
    with pytest.raises(RuntimeError, match="plays no action"):
        bpy.ops.beyond_mocap.export_bvh(filepath=str(tmp_path / "out.bvh"))


def test_a_folder_that_cannot_be_written(clip, tmp_path):
    bpy.ops.beyond_mocap.import_clips(filepath=str(clip[0]))
    target = tmp_path / "locked" / "out.bvh"
    if os.geteuid():
        target.parent.mkdir(mode=0o500)
    with pytest.raises(RuntimeError, match="locked"):
        bpy.ops.beyond_mocap.export_bvh(filepath=str(target))
    assert not list(tmp_path.glob("locked/*"))


def test_the_stage_is_made_once():
    for _ in range(2):
        bpy.ops.beyond_mocap.add_stage()
    assert len([c for c in bpy.data.collections if c.name.startswith("Stage")]) == 1
    assert len(bpy.data.cameras) == 1 and bpy.context.scene.camera is not None
