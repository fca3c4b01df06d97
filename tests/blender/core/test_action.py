"""A motion becomes an action and comes back the same, at any frame rate, which stays as it was."""

import importlib

import bpy
import numpy as np
import pytest
import synthetic_motion

RATES = {"24": (24, 1.0), "23.976": (24, 1.001), "30": (30, 1.0), "60": (60, 1.0)}


@pytest.fixture
def rooms(extension):
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}")
            for name in ("rigs.armature", "core.action", "core.channels")}


@pytest.fixture
def body(core, rooms):
    return rooms["rigs.armature"].create_armature(bpy.context, synthetic_motion.build_skeleton(core), "Body")


def set_rate(name):
    render = bpy.context.scene.render
    render.fps, render.fps_base = RATES[name]
    return render.fps / render.fps_base


def assert_same(a, b, tolerance=2e-6):
    assert len(a) == len(b) and a.fps == pytest.approx(b.fps)
    np.testing.assert_allclose(a.root_positions, b.root_positions, atol=tolerance)
    assert np.abs(np.sum(a.rotations * b.rotations, axis=-1)).min() > 1 - 1e-6
    np.testing.assert_allclose(a.rotations * np.sign(a.rotations[:1, :, :1] * b.rotations[:1, :, :1]), b.rotations,
                               atol=tolerance)


@pytest.mark.parametrize("rate", RATES)
def test_there_and_back(core, rooms, body, rate):
    fps = set_rate(rate)
    motion = synthetic_motion.build_motion(core)
    rooms["core.action"].write_motion(body, motion, bpy.context.scene)
    assert_same(rooms["core.action"].read_motion(body, bpy.context.scene), core("motion.motion").resample(motion, fps))
    render = bpy.context.scene.render
    assert (render.fps, pytest.approx(render.fps_base)) == RATES[rate]


def test_what_blender_poses_is_what_the_core_computes(core, rooms, body):
    scene = bpy.context.scene
    set_rate("30")
    scene.unit_settings.scale_length = 0.5  # the armature was made at scale 1: it is now half as large
    body.location, body.rotation_euler, body.scale = (3, -2, 0.5), (0.3, 0.2, 1.1), (2, 2, 2)
    motion = synthetic_motion.build_motion(core)
    rooms["core.action"].write_motion(body, motion, scene, start=10)
    positions, _ = core("motion.motion").forward_kinematics(motion)
    for frame in (10, 25, 70):
        scene.frame_set(frame)
        posed = np.array([(body.matrix_world @ body.pose.bones[name].matrix).translation
                          for name in synthetic_motion.NAMES]) * 0.5
        np.testing.assert_allclose(posed, positions[frame - 10], atol=2e-5)
    assert_same(rooms["core.action"].read_motion(body, scene), motion, 1e-5)


def test_a_fractional_start_keys_whole_frames_only(core, rooms, body):
    set_rate("30")
    motion = synthetic_motion.build_motion(core)
    action = rooms["core.action"].write_motion(body, motion, bpy.context.scene, start=4.25)
    assert tuple(action.frame_range) == (5, 64)
    read = rooms["core.action"].read_motion(body, bpy.context.scene)
    root, _ = core("motion.motion").sample_frames(motion, np.arange(60) + 0.75)
    np.testing.assert_allclose(read.root_positions, root, atol=2e-6)


def test_signs_are_continuous(core, rooms, body):
    motion = synthetic_motion.build_motion(core, frames=200)
    action = rooms["core.action"].write_motion(body, motion, bpy.context.scene)
    curves = rooms["core.channels"].collect_curves(action, body.animation_data.action_slot)
    for bone in synthetic_motion.NAMES:
        path = f'pose.bones["{bone}"].rotation_quaternion'
        values = np.stack([rooms["core.channels"].sample_curve(curves[path, i], np.arange(1, 160)) for i in range(4)],
                          axis=1)
        assert np.sum(values[1:] * values[:-1], axis=1).min() > 0


@pytest.mark.parametrize("mode", ("XYZ", "ZXY", "YZX", "AXIS_ANGLE"))
def test_other_rotation_modes_are_read(core, rooms, body, mode):
    bone = body.pose.bones["LeftLeg"]
    bone.rotation_mode = mode
    for frame in (1, 3):
        values = (0.4, 0.1 * frame, -0.7) if mode != "AXIS_ANGLE" else (0.2 * frame, 0.6, 0.8, 0.0)
        path = "rotation_axis_angle" if mode == "AXIS_ANGLE" else "rotation_euler"
        setattr(bone, path, values)
        bone.keyframe_insert(path, frame=frame)
    read = rooms["core.action"].read_motion(body, bpy.context.scene)
    positions, _ = core("motion.motion").forward_kinematics(read)
    for frame in (1, 2, 3):
        bpy.context.scene.frame_set(frame)
        posed = np.array([body.pose.bones[name].matrix.translation for name in read.skeleton.names])
        np.testing.assert_allclose(posed, positions[frame - 1], atol=1e-6)


def test_the_action_before_is_kept(core, rooms, body):
    body.keyframe_insert("location", frame=1)
    before = body.animation_data.action
    rooms["core.action"].write_motion(body, synthetic_motion.build_motion(core), bpy.context.scene)
    assert before.use_fake_user and before in list(bpy.data.actions)


def test_marked_results_do_not_pile_up(core, rooms, body):
    for _ in range(3):
        rooms["core.channels"].remove_marked_action(body, "take")
        action = rooms["core.action"].write_motion(body, synthetic_motion.build_motion(core), bpy.context.scene,
                                                   name="Take")
        action["take"] = True
    assert [action.name for action in bpy.data.actions] == ["Take"]
    body.animation_data.action["take"] = False
    rooms["core.channels"].remove_marked_action(body, "take")
    assert body.animation_data.action is not None


def test_missing_things_are_named(core, rooms, body):
    error = core("base.errors").InputError
    with pytest.raises(error, match="plays no action"):
        rooms["core.action"].read_motion(body, bpy.context.scene)
    with pytest.raises(error, match="no key on any bone"):
        rooms["core.action"].read_motion(body, bpy.context.scene, bpy.data.actions.new("Empty"))
    with rooms["rigs.armature"]._edit_mode(bpy.context, body):
        body.data.edit_bones.remove(body.data.edit_bones["Neck"])
    with pytest.raises(error, match="bones missing: Neck"):
        rooms["core.action"].write_motion(body, synthetic_motion.build_motion(core), bpy.context.scene)
