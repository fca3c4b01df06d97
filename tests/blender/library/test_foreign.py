"""Motions from FBX, glTF and USD: what Blender's exporters wrote comes back where it was."""

import importlib

import bmesh
import bpy
import numpy as np
import pytest
import synthetic_motion
from mathutils import Vector
from undo import assert_one_step, collect_state


@pytest.fixture
def rooms(extension):
    names = ("rigs.armature", "core.action", "library.foreign", "stage.body")
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}") for name in names}


EXPORTERS = {
    ".fbx": lambda path: bpy.ops.export_scene.fbx(
        filepath=path, add_leaf_bones=False, bake_anim_simplify_factor=0.0, bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False),
    ".glb": lambda path: bpy.ops.export_scene.gltf(filepath=path, export_format="GLB"),
    ".usdc": lambda path: bpy.ops.wm.usd_export(filepath=path, export_animation=True),
}


def exported(core, rooms, path, fps=30, lie=lambda rig: None):
    """A known motion on an armature with a body, written by Blender's exporter; the motion. The file is empty after.
    lie: how the armature object itself is moved, turned and scaled before it gets its motion."""
    motion = synthetic_motion.build_motion(core, 61, float(fps))
    scene = bpy.context.scene
    scene.render.fps = fps
    scene.frame_start, scene.frame_end = 1, 61
    rig = rooms["rigs.armature"].create_armature(bpy.context, motion.skeleton, "Somebody")
    lie(rig)
    rooms["core.action"].write_motion(rig, motion, scene, 1.0)
    rooms["stage.body"].create_character(rig, "Somebody", (1, 0, 0), scene.collection, scene, motion)
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
    before = collect_state()
    takes = rooms["library.foreign"].read_takes(path)
    assert collect_state() == before and bpy.context.scene.name == "Scene"
    back = takes[0].motion
    assert back.fps == pytest.approx(fps) and len(takes) == 1
    assert set(back.skeleton.names) == set(motion.skeleton.names)
    assert len(back) == len(motion)
    apart = np.linalg.norm(
        places_of(core, back, motion.skeleton.names) - places_of(core, motion, motion.skeleton.names), axis=-1
    )
    assert apart.max() < 1e-3, apart.max()
    clip = rooms["library.foreign"].to_bvh_clip(back)
    apart = np.linalg.norm(
        places_of(core, clip.motion, motion.skeleton.names) - places_of(core, motion, motion.skeleton.names), axis=-1
    )
    assert apart.max() < 1e-3, apart.max()


@pytest.mark.parametrize("ending", [".fbx", ".glb"])
def test_an_armature_that_is_turned_moved_and_scaled(core, rooms, tmp_path, ending):
    def lie(rig):
        rig.location, rig.rotation_euler, rig.scale = (3.0, -1.0, 0.5), (1.2, 0.3, -0.7), (2.0, 2.0, 2.0)

    path = tmp_path / f"clip{ending}"
    motion = exported(core, rooms, path, 30, lie)
    back = rooms["library.foreign"].read_takes(path)[0].motion
    apart = np.linalg.norm(places_of(core, back, motion.skeleton.names)[:, 0] - motion.root_positions, axis=-1)
    assert apart.max() < 1e-3
    grown = np.linalg.norm(back.skeleton.offsets[back.skeleton.index("LeftLeg")])
    assert grown == pytest.approx(
        2.0 * np.linalg.norm(motion.skeleton.offsets[motion.skeleton.index("LeftLeg")]), rel=1e-3
    )


def test_several_animations_of_one_file(core, rooms, tmp_path):
    path = tmp_path / "two.glb"
    scene = bpy.context.scene
    scene.render.fps = 30
    motion = synthetic_motion.build_motion(core, 61)
    rig = rooms["rigs.armature"].create_armature(bpy.context, motion.skeleton, "Somebody")
    for name, count in (("short", 31), ("long", 61)):
        rooms["core.action"].write_motion(rig, motion.frames(0, count), scene, 1.0, name)
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", export_animation_mode="ACTIONS")
    bpy.ops.wm.read_homefile(use_empty=True)
    takes = rooms["library.foreign"].read_takes(path)
    assert [len(take.motion) for take in takes] == [61, 31] and "long" in takes[0].name
    bpy.ops.beyond_mocap.import_clips(filepath=str(path))
    assert len([thing for thing in bpy.data.objects if thing.type == "ARMATURE"]) == 2


def test_files_without_a_motion_are_told(rooms, tmp_path):
    broken = tmp_path / "broken.fbx"
    broken.write_bytes(b"Kaydara FBX Binary  \0\x1a\0" + b"\1" * 300)
    bpy.ops.mesh.primitive_cube_add()
    box = tmp_path / "box.glb"
    bpy.ops.export_scene.gltf(filepath=str(box), export_format="GLB")
    before = collect_state()
    for path, told in ((broken, "cannot be read"), (box, "no armature"), (tmp_path / "gone.glb", "no such file"),
                       (tmp_path / "x.abc", "no such file")):
        with pytest.raises(Exception, match=told):
            rooms["library.foreign"].read_takes(path)
    assert collect_state() == before


def test_the_operator_gives_what_the_functions_give(core, rooms, tmp_path):
    path = tmp_path / "clip.glb"
    motion = exported(core, rooms, path)
    bpy.context.scene.render.fps = 30
    assert_one_step(bpy.ops.beyond_mocap.import_clips, filepath=str(path))
    rig = bpy.context.object
    assert rig.name == "clip" and [o.type for o in bpy.data.objects] == ["ARMATURE"]
    read = rooms["core.action"].read_motion(rig, bpy.context.scene)
    apart = np.linalg.norm(
        places_of(core, read, motion.skeleton.names) - places_of(core, motion, motion.skeleton.names), axis=-1
    )
    assert apart.max() < 1e-3


@pytest.fixture
def mixed(core, rooms, tmp_path):
    """A library of a BVH, an FBX and a GLB clip with words beside them, and a broken FBX."""
    folder = tmp_path / "library"
    (folder / "below").mkdir(parents=True)
    core("files.bvh.bvh").write_bvh(folder / "walk.bvh", synthetic_motion.build_motion(core, 91))
    exported(core, rooms, folder / "below" / "jog.fbx")
    exported(core, rooms, folder / "low.glb")
    (folder / "broken.fbx").write_bytes(b"Kaydara FBX Binary  \0\x1a\0" + b"\1" * 300)
    (folder / "walk.txt").write_text("0 3 walking front\n")
    (folder / "below/jog.txt").write_text("0 2 jogging front\n")
    (folder / "low.txt").write_text("0 2 kick right low\n1.2 kick right low\n")
    bpy.context.scene.beyond_mocap.library_folder = str(folder)
    return folder


def test_a_library_of_foreign_clips_is_built_and_a_broken_one_left_out(core, mixed):
    before = collect_state()
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    listing = bpy.context.window_manager.beyond_mocap_clips
    paths = {clip.path: clip.words for clip in listing.shown}
    assert set(paths) == {"walk.bvh", "below/jog.fbx", "low.glb"} and paths["below/jog.fbx"].startswith("jogging")
    assert (mixed / ".beyond_mocap/converted/below/jog.fbx.bvh").is_file()
    after = collect_state()
    assert {key for key in before if before[key] != after[key]} <= {"settings", "scenes"}
    core("library.build").build_library(mixed)  # as the command line does, afterwards
    bpy.ops.beyond_mocap.import_clip(path="below/jog.fbx", dressed=False)
    assert bpy.context.object.name == "jog"


def test_a_clip_is_converted_once_and_again_when_it_changes(core, rooms, mixed):
    foreign = rooms["library.foreign"]
    assert len(foreign.ConversionQueue(mixed, None).remaining) == 3
    bpy.ops.beyond_mocap.build_library()
    assert [path.name for path in foreign.ConversionQueue(mixed, None).remaining] == ["broken.fbx"]
    exported(core, rooms, mixed / "low.glb", 60)
    assert sorted(path.name for path in foreign.ConversionQueue(mixed, None).remaining) == ["broken.fbx", "low.glb"]


def test_a_folder_of_broken_clips_alone(tmp_path):
    (tmp_path / "a.fbx").write_bytes(b"no FBX")
    bpy.context.scene.beyond_mocap.library_folder = str(tmp_path)
    with pytest.raises(RuntimeError, match="no clip in the folder"):
        bpy.ops.beyond_mocap.build_library()


def add_ball(scene, places, name="Ball", kind="MESH"):
    """A sphere, or an empty, with a key on every frame from frame 1 on; its mesh lies beside its origin."""
    data = None
    if kind == "MESH":
        data = bpy.data.meshes.new(name)
        mesh = bmesh.new()
        bmesh.ops.create_icosphere(mesh, subdivisions=1, radius=0.11)
        bmesh.ops.translate(mesh, verts=mesh.verts, vec=(0.0, 0.0, 0.2))
        mesh.to_mesh(data)
        mesh.free()
    ball = bpy.data.objects.new(name, data)
    scene.collection.objects.link(ball)
    for frame, place in enumerate(places, 1):
        ball.location = place - np.array([0.0, 0.0, 0.2 if kind == "MESH" else 0.0])
        ball.keyframe_insert("location", frame=frame)
    for curve in find_curves(ball):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    return ball


def find_curves(thing):
    action = thing.animation_data.action
    return action.layers[0].strips[0].channelbag(thing.animation_data.action_slot).fcurves


def build_kicked_ball(motion, frame, start=(0.3, 0.1, 0.11)):
    """A ball that lies beside the body until a frame, and then leaves at 12 m/s."""
    after = np.maximum(np.arange(len(motion)) - frame, 0) / motion.fps
    return motion.root_positions[frame] * [1, 1, 0] + start + after[:, None] * [12.0, 0.0, 0.0]


@pytest.mark.parametrize("ending", sorted(EXPORTERS))
def test_an_animated_ball_beside_the_armature_comes_back(core, rooms, tmp_path, ending):
    scene, path = bpy.context.scene, tmp_path / f"kick{ending}"
    planted = build_kicked_ball(synthetic_motion.build_motion(core, 61), 30)

    def lie(rig):
        add_ball(scene, planted).data.name = "Icosphere"  # as Blender names a new mesh
        add_ball(scene, planted + 8.0, "Ball.001")

    motion = exported(core, rooms, path, 30, lie)
    before = collect_state()
    take = rooms["library.foreign"].read_takes(path)[0]
    assert collect_state() == before
    assert np.abs(take.ball - planted[: len(motion)]).max() < 2e-3
    assert any("2 balls" in note for note in take.notes)


def test_a_bone_named_ball_is_the_ball_and_a_root_above_the_hips_is_kept(core, rooms, tmp_path):
    scene, path = bpy.context.scene, tmp_path / "root.fbx"
    scene.render.fps = 30
    motion = synthetic_motion.build_motion(core, 61)
    planted = build_kicked_ball(motion, 30)
    skeleton_type, motion_type = core("motion.skeleton").Skeleton, core("motion.motion").Motion
    own = motion.skeleton
    whole = skeleton_type(("Root", *own.names, "Ball"), (-1, *(parent + 1 for parent in own.parents), 0),
                          np.vstack([np.zeros(3), own.offsets, [0.0, 0.0, 0.5]]))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (61, 1, 1))
    rig = rooms["rigs.armature"].create_armature(bpy.context, whole, "Somebody")
    turned = motion_type(whole, np.zeros((61, 3)), np.concatenate([still, motion.rotations, still], axis=1), 30.0)
    rooms["core.action"].write_motion(rig, turned, scene, 1.0)
    for name, places in ((own.names[0], motion.root_positions), ("Ball", planted)):
        bone = rig.pose.bones[name]
        for frame, place in enumerate(places, 1):
            moved = Vector(place) - bone.bone.head_local + bone.parent.bone.head_local  # the root stays at the origin
            bone.location = bone.bone.matrix_local.to_3x3().inverted() @ moved
            bone.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, 61
    EXPORTERS[".fbx"](str(path))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.beyond_mocap.library_folder = str(tmp_path)
    (tmp_path / "root.txt").write_text("0 2 walking\n")
    take = rooms["library.foreign"].read_takes(path)[0]
    assert sorted(take.motion.skeleton.names) == sorted(own.names)
    assert np.abs(take.motion.root_positions - motion.root_positions).max() < 2e-3
    assert np.abs(take.ball - planted).max() < 2e-3
    queue = rooms["library.foreign"].ConversionQueue(tmp_path, None)
    queue.convert_next()
    clip = core("files.bvh.bvh").read_bvh(tmp_path / ".beyond_mocap/converted/root.fbx.bvh")
    assert [(joint.name, joint.is_moving) for joint in clip.form.above] == [("Root", False)]
    assert np.abs(clip.motion.root_positions - motion.root_positions).max() < 2e-3
    library = core("library.build").build_library(tmp_path)
    assert library.clips[0].ball is not None
