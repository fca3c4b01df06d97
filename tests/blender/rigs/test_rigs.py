"""One motion on the rigs of other programs: the same directions in the world whatever they rest like, feet that stand,
and everything that a user may get wrong."""

import importlib
import json
import os
import pathlib
import subprocess
import sys

import bpy
import numpy as np
import pytest
import sample_rigs as rigs
from undo import assert_one_step, collect_state, press_operator

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
START = 5
LIMBS = [("left upper_arm", "left lower_arm"), ("left lower_arm", "left hand"), ("right upper_arm", "right lower_arm"),
         ("right lower_arm", "right hand"), ("left upper_leg", "left lower_leg"), ("left lower_leg", "left foot"),
         ("right upper_leg", "right lower_leg"), ("right lower_leg", "right foot"), ("neck", "head")]
FAMILIES = {"mixamo": rigs.create_mixamo, "unreal": rigs.create_unreal, "metahuman": rigs.create_metahuman,
            "own": lambda **o: rigs.create_rig(rigs.NAMELESS, "Own", **{"arms": 0.6, "rolls": 0.7, **o})}


@pytest.fixture
def rooms(extension):
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}")
            for name in ("rigs.armature", "core.action", "core.channels", "core.take_record", "rigs.bone_maps",
                         "rigs.rig_bake", "rigs.control_study", "rigs.fit", "rigs.key_reduction", "rigs.rig")}


@pytest.fixture(scope="session")
def clip(core):
    """Two seconds of a recorded jog, with a turn."""
    found = core("files.bvh.bvh").read_bvh(SAMPLE / "jogging_turn_left.bvh").motion
    return core("motion.motion").resample(found, 30.0).frames(0, 60)


@pytest.fixture
def body(rooms, clip):
    """An armature of the recording's own skeleton that plays it from frame START on."""
    bpy.context.scene.render.fps = 30
    made = rooms["rigs.armature"].create_armature(bpy.context, clip.skeleton, "Body")
    rooms["core.action"].write_motion(made, clip, bpy.context.scene, START)
    return made


@pytest.fixture(scope="session")
def rigify(tmp_path_factory):
    """The file of a control rig that Rigify itself generated, in a process of its own."""
    out = tmp_path_factory.mktemp("rigify") / "rig.blend"
    script = pathlib.Path(__file__).parents[1] / "rigify_rig.py"
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(out.parent)}
    done = subprocess.run([sys.executable, "-P", script, out], env=environment, capture_output=True, text=True)
    assert out.is_file(), done.stdout + done.stderr
    return out


def bake(rooms, rig, body, **wishes):
    scene = bpy.context.scene
    table = rooms["rigs.bone_maps"].find_bone_map(rig)
    source = rooms["rigs.fit"].read_source(body, scene)
    options = rooms["rigs.fit"].BakeOptions(**wishes)
    return table, rooms["rigs.rig_bake"].apply_bake(rooms["rigs.rig_bake"].prepare_bake(rig, table, source, scene,
            options))


def directions(rig, table, frames=range(START, START + 60, 6)):
    """World directions (F, L, 3) of the limbs, and where the hips are."""
    parts = [part for pair in LIMBS for part in pair]
    points = rigs.read_heads(rig, [table[part] for part in parts], frames)
    along = points[:, 1::2] - points[:, 0::2]
    hips = rigs.read_heads(rig, [table["left upper_leg"], table["right upper_leg"]], frames).mean(axis=1)
    return along / np.linalg.norm(along, axis=-1, keepdims=True), hips


def degrees(a, b):
    return np.degrees(np.arccos(np.clip(np.sum(a * b, axis=-1), -1, 1)))


@pytest.mark.parametrize("family", FAMILIES)
def test_limbs_point_where_the_sources_do(core, rooms, body, family):
    rig = FAMILIES[family]()
    table, baked = bake(rooms, rig, body, plants_feet=False)
    mine, hips = directions(rig, table)
    source, source_hips = directions(body, rooms["rigs.bone_maps"].find_bone_map(body))
    arms = degrees(mine[:, :4], source[:, :4])
    assert arms.max() < 1.0, arms.max()  # nothing may turn an arm
    assert degrees(mine[:, 4:8], source[:, 4:8]).max() < 8.0  # legs reach the footprints of other legs
    np.testing.assert_allclose(hips[:, :2], source_hips[:, :2], atol=2e-3)
    assert not [line for line in baked.messages if "rig itself" in line]


POSES = {"T": {}, "A": {"arms": 0.85, "legs": 0.15}, "rolled": {"rolls": 1.3}, "stray": {"tails": "stray", "arms": 0.4},
         "lying": {"y_up": True}, "centimetres": {"units": 100.0}}


def test_rest_poses_rolls_axes_and_units_do_not_matter(rooms, body):
    found = {}
    for name, options in POSES.items():
        rig = rigs.create_rig(rigs.MIXAMO, name, **options)
        table, _ = bake(rooms, rig, body)
        found[name] = directions(rig, table)
    for name, (limbs, hips) in found.items():
        assert degrees(limbs, found["T"][0]).max() < 0.3, name
        np.testing.assert_allclose(hips, found["T"][1], atol=2e-3, err_msg=name)


def test_where_the_object_lies_does_not_matter(rooms, body):
    straight = rigs.create_mixamo()
    table, _ = bake(rooms, straight, body)
    expected = directions(straight, table)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.location, parent.rotation_euler = (3, -2, 0.5), (0.2, 0.1, 1.0)
    moving = rigs.create_mixamo()
    moving.parent, moving.location = parent, (100, 50, 10)
    for frame, z in ((1, 0.0), (80, 2.0)):
        parent.location.z = z
        parent.keyframe_insert("location", frame=frame)
    bake(rooms, moving, body)
    found = directions(moving, table)
    assert degrees(found[0], expected[0]).max() < 0.05
    np.testing.assert_allclose(found[1], expected[1], atol=1e-4)


def test_a_generated_rigify_rig(rooms, body, rigify):
    rig = rigs.append_rigify(rigify)
    table, baked = bake(rooms, rig, body)
    assert table["left upper_leg"] == "thigh_fk.L" and table["root"] == "root" and table["hips"] == "torso"
    assert rig.pose.bones["thigh_parent.L"]["IK_FK"] == 1.0
    assert any("FK" in line for line in baked.messages)
    shown = {part: f"DEF-{name}.{side[0].upper()}" for side in ("left", "right") for part, name in {
        f"{side} upper_arm": "upper_arm", f"{side} lower_arm": "forearm", f"{side} hand": "hand",
        f"{side} upper_leg": "thigh", f"{side} lower_leg": "shin", f"{side} foot": "foot"}.items()}
    limbs = [pair for pair in LIMBS if pair[0] in shown]
    frames = range(START, START + 60, 6)
    points = rigs.read_heads(rig, [shown[p] for pair in limbs for p in pair], frames)
    source = rigs.read_heads(body, [rooms["rigs.bone_maps"].find_bone_map(body)[p] for pair in limbs for p in pair],
                             frames)
    a, b = (p[:, 1::2] - p[:, 0::2] for p in (points, source))
    off = degrees(a / np.linalg.norm(a, axis=-1, keepdims=True), b / np.linalg.norm(b, axis=-1, keepdims=True))
    assert off[:, :4].max() < 1.5 and off.max() < 12.0, off.max(axis=0)


def test_feet_stand_on_the_rigs_own_legs(core, rooms, body, clip):
    for size in (0.9, 1.0, 1.12):
        _, baked = bake(rooms, rigs.create_mixamo(size=size), body)
        source, bare, after = baked.slides
        assert after.worst_mm < source.worst_mm + 3.0 and after.cm_s < source.cm_s + 1.0, (size, baked.slides)
    _, child = bake(rooms, rigs.create_mixamo(size=0.6), body)
    assert any("steps scaled" in line for line in child.messages)


def test_soles_are_on_the_ground(rooms, body):
    rig = rigs.create_mixamo()
    table, _ = bake(rooms, rig, body)
    toes = rigs.read_heads(rig, [table["left toe"], table["right toe"]], range(START, START + 60))[..., 2]
    assert np.percentile(toes, 3) == pytest.approx(0.02, abs=0.012)  # the ball of the foot rests 2 cm high


def test_bones_keep_their_rotation_mode_without_jumps(rooms, body):
    rig = rigs.create_mixamo()
    modes = {"mixamorig:LeftArm": "XYZ", "mixamorig:RightArm": "ZYX", "mixamorig:Hips": "YXZ",
             "mixamorig:LeftUpLeg": "AXIS_ANGLE"}
    expected = None
    for chosen in ({}, modes):
        for bone, mode in chosen.items():
            rig.pose.bones[bone].rotation_mode = mode
        table, baked = bake(rooms, rig, body)
        found = directions(rig, table)[0]
        expected = found if expected is None else expected
    assert degrees(found, expected).max() < 0.05
    assert {bone: rig.pose.bones[bone].rotation_mode for bone in modes} == modes
    curves = rooms["core.channels"].collect_curves(baked.action, rig.animation_data.action_slot)
    for bone in ("LeftArm", "RightArm", "Hips"):
        path, sample = f'pose.bones["mixamorig:{bone}"].rotation_euler', rooms["core.channels"].sample_curve
        values = [sample(curves[path, i], baked.frames) for i in range(3)]
        assert np.abs(np.diff(values, axis=1)).max() < 1.0


@pytest.mark.parametrize("way", ("SMOOTH", "STRAIGHT"))
def test_root_motion_and_the_rest_make_the_whole(rooms, body, way):
    rig = rigs.create_unreal()
    table, _ = bake(rooms, rig, body)
    bones, frames = list(table.values()), range(START, START + 60, 7)
    whole = rigs.read_heads(rig, bones[1:], frames)
    assert np.ptp(rigs.read_heads(rig, ["root"], frames), axis=0).max() < 1e-6
    bake(rooms, rig, body, root=way)
    np.testing.assert_allclose(rigs.read_heads(rig, bones[1:], frames), whole, atol=1e-5)
    root = rigs.read_heads(rig, ["root"], range(START, START + 60))[:, 0]
    assert np.abs(root[:, 2]).max() < 1e-4 and np.linalg.norm(root[-1] - root[0]) > 2.0
    hips = rigs.read_heads(rig, ["pelvis"], range(START, START + 60))[:, 0]
    if way == "SMOOTH":
        assert np.linalg.norm((root - hips)[:, :2], axis=1).max() < 0.12
        assert np.abs(np.diff(root, n=3, axis=0)).max() < 0.5 * np.abs(np.diff(hips, n=3, axis=0)).max()
    else:
        across = np.cross(root[-1] - root[0], [0, 0, 1])
        assert np.abs((root - root[0]) @ across).max() < 1e-4 * np.linalg.norm(across)


def test_in_place_and_its_way_make_the_whole(rooms, body):
    rig = rigs.create_unreal()
    table, _ = bake(rooms, rig, body, root="SMOOTH")
    bones, frames = list(table.values()), range(START, START + 60, 7)
    whole, ways = rigs.read_heads(rig, bones, frames), []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        ways.append(np.array(rig.matrix_world @ rig.pose.bones["root"].matrix))
    bake(rooms, rig, body, root="IN_PLACE")
    found = rigs.read_heads(rig, bones, frames)
    assert np.ptp(found[:, bones.index("pelvis"), :2], axis=0).max() < 0.3
    for number, way in enumerate(ways):
        moved = way @ np.linalg.inv(ways[0])
        np.testing.assert_allclose(found[number] @ moved[:3, :3].T + moved[:3, 3], whole[number], atol=2e-5)


def test_helper_bones_are_left_alone_or_follow(rooms, body):
    rig = rigs.create_unreal()
    table, baked = bake(rooms, rig, body)
    curves = rooms["core.channels"].collect_curves(baked.action, rig.animation_data.action_slot)
    keyed = {path.split('"')[1] for path, _ in curves}
    assert keyed == set(table.values())
    _, baked = bake(rooms, rig, body, bakes_ik=True)
    pairs = rigs.read_heads(rig, ["ik_foot_l", "foot_l", "ik_hand_r", "hand_r", "ik_hand_l", "hand_l"],
                            (START, START + 30))
    np.testing.assert_allclose(pairs[:, 0::2], pairs[:, 1::2], atol=1e-4)
    assert any("ik_foot_l" in line for line in baked.messages)


@pytest.mark.parametrize("bakes_ik", (False, True))
def test_inverse_kinematics_on_the_rig(rooms, body, bakes_ik):
    plain, rig = (rigs.create_rig(rigs.MIXAMO, name, root="root",
                                  extra=[("target.L", "root", "left foot")] if name == "IK" else ())
                  for name in ("Plain", "IK"))
    constraint = rig.pose.bones["mixamorig:LeftLeg"].constraints.new("IK")
    constraint.target, constraint.subtarget, constraint.chain_count = rig, "target.L", 2
    table, _ = bake(rooms, plain, body)
    _, baked = bake(rooms, rig, body, bakes_ik=bakes_ik)
    bpy.context.scene.frame_set(START + 20)
    assert constraint.influence == (1.0 if bakes_ik else 0.0)
    bones = [table["left foot"], table["left lower_leg"]]
    a, b = (rigs.read_heads(one, bones, range(START, START + 60, 6)) for one in (rig, plain))
    assert np.linalg.norm(a - b, axis=-1).max() < 2e-3 if not bakes_ik else np.linalg.norm(a - b,
                                                                                           axis=-1)[:, 0].max() < 5e-3
    assert any(("target.L" if bakes_ik else "switched off") in line for line in baked.messages), baked.messages


def test_fewer_keys_stay_within_the_tolerance(rooms, body):
    rig, scene = rigs.create_mixamo(), bpy.context.scene
    rig.pose.bones["mixamorig:LeftArm"].rotation_mode = "XZY"
    table, _ = bake(rooms, rig, body)
    ends = [
        table[part] for part in ("head", "left hand", "right hand", "left foot", "right foot", "left toe", "right toe")
    ]
    frames = range(START, START + 60)
    before, limbs = rigs.read_heads(rig, ends, frames), directions(rig, table, frames)[0]
    for tolerance, turn, most in ((0.002, 1.0, 0.5), (0.01, 3.0, 0.3)):
        table, _ = bake(rooms, rig, body)
        had, left = rooms["rigs.key_reduction"].reduce_keys(rig, table, scene, tolerance, np.radians(turn))
        assert left < most * had, (had, left)
        assert np.linalg.norm(rigs.read_heads(rig, ends, frames) - before, axis=-1).max() < 1.02 * tolerance + 1e-4
        assert degrees(directions(rig, table, frames)[0], limbs).max() < 6.0
    for bone in rig.pose.bones:
        assert bone.rotation_mode != "QUATERNION" or np.linalg.norm(bone.matrix.to_quaternion()) == pytest.approx(
            1, abs=1e-5
        )


def test_contacts_stored_on_an_action_are_read_from_it_and_from_its_strips(rooms, body):
    scene, record = bpy.context.scene, rooms["core.take_record"]
    action, slot = rooms["core.channels"].find_playing_action(body)
    assert rooms["rigs.fit"].read_source(body, scene).foot_contacts is None
    frames, contacts = np.arange(START, START + 60), np.zeros((60, 2), bool)
    contacts[10:20, 0] = contacts[50:, 1] = True
    record.store_contacts(action, frames, contacts)
    source = rooms["rigs.fit"].read_source(body, scene)
    assert source.start == START
    np.testing.assert_array_equal(source.foot_contacts, contacts)
    body.animation_data.action = None
    strip = body.animation_data.nla_tracks.new().strips.new("later", START + 100, action)
    strip.action_slot = slot
    np.testing.assert_array_equal(rooms["rigs.fit"].read_source(body, scene).foot_contacts, contacts)
    strip.scale = 2.0
    np.testing.assert_array_equal(rooms["rigs.fit"].read_source(body, scene).foot_contacts[:119:2], contacts)


def test_nla_strips_are_baked_as_they_play(rooms, body):
    expected = rooms["rigs.fit"].read_source(body, bpy.context.scene)
    data = body.animation_data
    action, slot = data.action, data.action_slot
    data.action = None
    strip = data.nla_tracks.new().strips.new("clip", START, action)
    strip.action_slot = slot
    found = rooms["rigs.fit"].read_source(body, bpy.context.scene)
    assert found.start == START and len(found.motion) == len(expected.motion)
    np.testing.assert_allclose(found.motion.root_positions, expected.motion.root_positions, atol=1e-5)
    assert np.abs(np.sum(found.motion.rotations * expected.motion.rotations, axis=-1)).min() > 1 - 1e-6


# ---------------------------------------------------------------- operators


def choose(rig, body):
    settings = bpy.context.scene.beyond_mocap.rig
    settings.source, settings.target = body, rig
    return settings


def test_the_button_does_what_the_function_does(rooms, body):
    plain, rig = rigs.create_mixamo(), rigs.create_mixamo()
    table, _ = bake(rooms, plain, body)
    settings = choose(rig, body)
    assert rooms["rigs.rig"].read_bone_list(settings) == table
    assert press_operator(bpy.ops.beyond_mocap.bake_to_rig) == {"FINISHED"}
    frames = range(START, START + 60, 9)
    np.testing.assert_array_equal(
        rigs.read_heads(rig, list(table.values()), frames), rigs.read_heads(plain, list(table.values()), frames)
    )
    assert "slide" in settings.messages


def test_baking_is_one_step_for_undo(body):
    choose(rigs.create_mixamo(), body)
    assert_one_step(bpy.ops.beyond_mocap.bake_to_rig)


def test_a_removed_bake_leaves_nothing_behind(rooms, body):
    rig = rigs.create_unreal()
    bone = rig.pose.bones["thigh_l"]
    bone.rotation_mode, bone.rotation_euler = "XYZ", (0.1, 0.2, 0.3)
    rig.pose.bones["pelvis"].keyframe_insert("location", frame=3)
    own = rig.animation_data.action.name
    settings = choose(rig, body)
    settings.root = "SMOOTH"
    channels = rooms["rigs.control_study"].CHANNELS
    before = {b.name: [tuple(getattr(b, c)) for c in channels] for b in rig.pose.bones}
    actions = sorted(a.name for a in bpy.data.actions)
    press_operator(bpy.ops.beyond_mocap.bake_to_rig)
    press_operator(bpy.ops.beyond_mocap.bake_to_rig)
    assert len(bpy.data.actions) == len(actions) + 1
    bpy.context.scene.frame_set(START + 30)
    press_operator(bpy.ops.beyond_mocap.unbake)
    assert rig.animation_data.action.name == own and sorted(a.name for a in bpy.data.actions) == actions
    assert {b.name: [tuple(getattr(b, c)) for c in channels] for b in rig.pose.bones} == before


def test_work_on_a_bake_is_kept_when_it_is_baked_again(rooms, body):
    rig = rigs.create_mixamo()
    settings = choose(rig, body)
    press_operator(bpy.ops.beyond_mocap.bake_to_rig)
    press_operator(bpy.ops.beyond_mocap.reduce_keys)
    actions = len(bpy.data.actions)
    press_operator(bpy.ops.beyond_mocap.bake_to_rig)
    assert len(bpy.data.actions) == actions and "edited keys" not in settings.messages
    own = rig.animation_data.action
    curve = next(iter(rooms["core.channels"].collect_curves(own, rig.animation_data.action_slot).values()))
    curve.keyframe_points[7].co.y += 0.1
    value = curve.keyframe_points[7].co.y
    press_operator(bpy.ops.beyond_mocap.bake_to_rig)
    assert own.name in settings.messages and rig.animation_data.action != own
    assert own.use_fake_user and curve.keyframe_points[7].co.y == value
    press_operator(bpy.ops.beyond_mocap.unbake)
    assert rig.animation_data.action is None and own.name in bpy.data.actions


def test_all_selected_rigs_at_once(rooms, body):
    several = [rigs.create_mixamo(), rigs.create_unreal(), rigs.create_metahuman()]
    choose(several[0], body)
    for one in several:
        one.select_set(True)
    press_operator(bpy.ops.beyond_mocap.bake_to_rig, targets="SELECTED")
    assert all(rooms["core.channels"].find_playing_action(one)[0] for one in several)


def test_all_players_get_a_rig_each(rooms, body, clip):
    settings = bpy.context.scene.beyond_mocap
    mesh = bpy.data.objects.new("Skin", bpy.data.meshes.new("Skin"))
    bpy.context.scene.collection.objects.link(mesh)
    rig = rigs.create_mixamo()
    mesh.parent = rig
    mesh.modifiers.new("Armature", "ARMATURE").object = rig
    settings.rig.target = rig
    for number in range(2):
        player = settings.players.add()
        player.name, player.body = f"P{number}", body
    press_operator(bpy.ops.beyond_mocap.bake_to_rig, targets="PLAYERS")
    first, second = (player.rig for player in settings.players)
    assert first == rig and second not in (None, rig) and second.children[0].modifiers[0].object == second
    assert rooms["core.channels"].find_playing_action(second)[0] and rooms["core.channels"].find_playing_action(first)[
        0]


def test_a_strip_in_tweak_mode_is_told(rooms, body):
    rig = rigs.create_mixamo()
    choose(rig, body)
    press_operator(bpy.ops.beyond_mocap.bake_to_rig)
    data = rig.animation_data
    own = data.action
    data.nla_tracks.new().strips.new("own", 1, own)
    data.action = None
    data.use_tweak_mode = True
    for verb in (bpy.ops.beyond_mocap.bake_to_rig, bpy.ops.beyond_mocap.unbake, bpy.ops.beyond_mocap.reduce_keys):
        assert "leave tweak mode" in complaint(verb)
    assert data.use_tweak_mode and data.action == own
    motion, data = rooms["core.action"].read_motion(body, bpy.context.scene), body.animation_data
    data.nla_tracks.new().strips.new("own", 1, data.action)
    data.action, before = None, len(bpy.data.actions)
    data.use_tweak_mode = True
    with pytest.raises(Exception, match="leave tweak mode"):
        rooms["core.action"].write_motion(body, motion, bpy.context.scene)
    assert len(bpy.data.actions) == before


def test_a_copy_plays_nothing_and_a_bad_map_copies_nothing(rooms, body):
    settings = bpy.context.scene.beyond_mocap
    rig = rigs.create_mixamo()
    bone = rig.pose.bones[0]
    bone.keyframe_insert("location", frame=1)
    data = rig.animation_data
    data.nla_tracks.new().strips.new("own", 1, data.action)
    data.action = None
    twin = rooms["rigs.armature"].copy_rig(rig, "twin")
    assert len(twin.animation_data.nla_tracks) == 0 and len(data.nla_tracks) == 1
    settings.rig.target = rig
    for number in range(2):
        player = settings.players.add()
        player.name, player.body = f"P{number}", body
    settings.rig.bones["hips"].bone = "no such bone"
    before = len(bpy.data.objects)
    assert "no bone no such bone" in complaint(bpy.ops.beyond_mocap.bake_to_rig, targets="PLAYERS")
    assert len(bpy.data.objects) == before and not any(player.rig for player in settings.players)


def test_players_with_rigs_of_their_own_need_no_chosen_one(rooms, body):
    player = bpy.context.scene.beyond_mocap.players.add()
    player.name, player.body, player.rig = "P", body, rigs.create_unreal()
    for one in bpy.context.selected_objects:
        one.select_set(False)
    assert press_operator(bpy.ops.beyond_mocap.bake_to_rig, targets="PLAYERS") == {"FINISHED"}
    assert rooms["core.channels"].find_playing_action(player.rig)[0]


def test_maps_are_kept_by_skeleton_and_written_to_files(rooms, tmp_path):
    rig = rigs.create_mixamo()
    settings = choose(rig, None)
    table = rooms["rigs.rig"].read_bone_list(settings)
    settings.bones["left toe"].bone = ""
    press_operator(bpy.ops.beyond_mocap.keep_bone_map)
    settings.target = rigs.create_mixamo()  # another armature with the same bones
    assert "left toe" not in rooms["rigs.rig"].read_bone_list(settings) and "stored" in settings.messages
    assert rooms["rigs.bone_maps"].load_stored_map(rigs.create_unreal()) is None
    bpy.ops.beyond_mocap.save_bone_map("EXEC_DEFAULT", filepath=str(tmp_path / "map.json"))
    press_operator(bpy.ops.beyond_mocap.map_bones)
    assert rooms["rigs.rig"].read_bone_list(settings) == table
    bpy.ops.beyond_mocap.load_bone_map("EXEC_DEFAULT", filepath=str(tmp_path / "map.json"))
    assert "left toe" not in rooms["rigs.rig"].read_bone_list(settings)
    for path in rooms["rigs.bone_maps"].find_map_folder().iterdir():
        path.unlink()


def complaint(operator, **arguments):
    """The one line that an operator refuses with; nothing may have changed."""
    before = collect_state()
    with pytest.raises(RuntimeError) as error:
        operator("EXEC_DEFAULT", **arguments)
    assert collect_state() == before
    lines = [line for line in str(error.value).strip().splitlines() if line and not line.startswith("Location:")]
    assert len(lines) == 1 and "Traceback" not in lines[0], lines
    return lines[0]


def test_wrong_choices_are_told_in_one_line(rooms, body, tmp_path):
    bake_to_rig = bpy.ops.beyond_mocap.bake_to_rig
    bpy.ops.object.select_all(action="DESELECT")
    assert "Choose the rig" in complaint(bake_to_rig)
    settings = choose(body, body)
    assert "source itself" in complaint(bake_to_rig)
    rig = rigs.create_mixamo()
    settings.target, settings.source = rig, rigs.create_unreal()
    assert "plays no action" in complaint(bake_to_rig)
    settings.source = body
    settings.bones["left hand"].bone = settings.bones["right hand"].bone
    assert "both" in complaint(bake_to_rig)
    settings.bones["left hand"].bone = "nowhere"
    assert "no bone nowhere" in complaint(bake_to_rig)
    press_operator(bpy.ops.beyond_mocap.map_bones)
    rig.hide_viewport = True
    assert "hidden" in complaint(bake_to_rig)
    rig.hide_viewport = False
    rig.scale = (1, 2, 1)
    assert "Ctrl-A" in complaint(bake_to_rig)
    rig.scale = (0.01,) * 3
    rig.data.pose_position = "REST"
    assert "rest position" in complaint(bake_to_rig)
    rig.data.pose_position = "POSE"
    load, save = bpy.ops.beyond_mocap.load_bone_map, bpy.ops.beyond_mocap.save_bone_map
    assert "no such file" in complaint(load, filepath=str(tmp_path / "none.json"))
    for text, said in (("{", "not JSON"), ("[]", "no object"), ('{"bones": {"tail": "x"}}', "unknown part 'tail'"),
                       (json.dumps({"bones": {"hips": "mixamorig:Hips"}}), "no bone for left upper_leg")):
        (tmp_path / "map.json").write_text(text)
        assert said in complaint(load, filepath=str(tmp_path / "map.json"))
    assert complaint(save, filepath=str(tmp_path / "nowhere" / "map.json"))
    bpy.ops.object.select_all(action="DESELECT")
    assert "selected" in complaint(bake_to_rig, targets="SELECTED")
    assert "no selected player" in complaint(bake_to_rig, targets="PLAYERS")


def test_long_chains_of_bones_are_mapped(rooms):
    """Braids and ropes: more bones below each other than Python's functions may call each other."""
    rig = rigs.create_mixamo()
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    above = rig.data.edit_bones["mixamorig:Head"]
    for number in range(1100):
        bone = rig.data.edit_bones.new(f"braid_{number}")
        bone.head, bone.tail, bone.parent = above.tail, above.tail + above.vector.normalized(), above
        above = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    assert rooms["rigs.bone_maps"].find_bone_map(rig)["head"] == "mixamorig:Head"


def test_a_rig_without_legs_is_told(body):
    arms = {part: name for part, name in rigs.MIXAMO.items() if "leg" not in part and "foot" not in part
            and "toe" not in part}
    rig = rigs.create_rig(arms, "Torso")
    settings = choose(rig, body)
    assert "no legs" in settings.messages and "bone map" in settings.messages
    assert "no legs" in complaint(bpy.ops.beyond_mocap.bake_to_rig)


def test_linked_rigs_are_told_and_overrides_work(rooms, body, tmp_path):
    rig = rigs.create_unreal()
    file = str(tmp_path / "rig.blend")
    bpy.data.libraries.write(file, {rig})
    bpy.data.objects.remove(rig)
    with bpy.data.libraries.load(file, link=True) as (theirs, mine):
        mine.objects = list(theirs.objects)
    linked = mine.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    settings = choose(linked, body)
    assert "library override" in complaint(bpy.ops.beyond_mocap.bake_to_rig)
    override = linked.override_create(remap_local_usages=True)
    override.override_library.is_system_override = False
    settings.target = override
    assert press_operator(bpy.ops.beyond_mocap.bake_to_rig) == {"FINISHED"}
    assert rooms["core.channels"].find_playing_action(override)[0] is not None


def test_a_rig_in_an_overridden_collection_is_copied_beside_it(rooms, tmp_path):
    room = bpy.data.collections.new("Character")
    bpy.context.scene.collection.children.link(room)
    rig = rigs.create_unreal()
    room.objects.link(rig)
    bpy.context.scene.collection.objects.unlink(rig)
    file = str(tmp_path / "character.blend")
    bpy.data.libraries.write(file, {room})
    bpy.data.batch_remove([rig, room])
    with bpy.data.libraries.load(file, link=True) as (theirs, mine):
        mine.collections = list(theirs.collections)
    bpy.context.scene.collection.children.link(mine.collections[0])
    over = mine.collections[0].override_hierarchy_create(
        bpy.context.scene, bpy.context.view_layer, do_fully_editable=True
    )
    rig = next(one for one in over.all_objects if one.type == "ARMATURE")
    twin = rooms["rigs.armature"].copy_rig(rig, "twin")
    bpy.context.view_layer.update()
    assert twin.name in bpy.context.view_layer.objects
