"""Retargeting: the same body in other axes is the same motion, other bodies keep directions, feet and knees."""

import glob
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import compute_heading, identify_joints, measure_leg_length
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.joint_pairs import pair_joints, read_bone_map, write_bone_map
from beyond_mocap.motion.retargeting.retarget import Retargeter
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.gait import build_gait

MOCAP = Path(__file__).resolve().parents[4] / "shared/data/mocap"
RECORDED = {
    "cmu10": "10_01", "lmd/Player1": "P1_S01", "lafan1": "walk1_subject1", "runs15": "left05", "bandai": "run_normal",
    "sprinter": "0900", "keeper": "GK01_trial01", "getup": "faceup", "cmu_jumps": "118_01", "cmu_pitch": "124_01",
}  # fmt: skip


def retarget(motion, skeleton, bone_map=None, **how):
    """The motion on another skeleton, studied by itself."""
    return Retargeter(motion, skeleton, bone_map, **how).retarget(motion)


def other_axes(motion: Motion, seed: int) -> Motion:
    """The same posed body whose joints' axes, and with them the rest pose, are turned at random."""
    skeleton = motion.skeleton
    axes = quaternion.normalize(np.random.default_rng(seed).normal(size=(len(skeleton), 4)))
    seen = lambda joints, vectors: quaternion.rotate(quaternion.inverse(axes[list(joints)]), vectors)  # noqa: E731
    offsets = np.concatenate([np.zeros((1, 3)), seen(skeleton.parents[1:], skeleton.offsets[1:])])
    tips = seen(skeleton.end_parents, skeleton.end_offsets)
    turned = Skeleton(skeleton.names, skeleton.parents, offsets, skeleton.end_parents, tips)
    world = quaternion.multiply(forward_kinematics(motion)[1], axes)
    world[:, 1:] = quaternion.multiply(quaternion.inverse(world[:, list(skeleton.parents[1:])]), world[:, 1:])
    return Motion(turned, motion.root_positions, world, motion.fps)


def apart(a: Motion, b: Motion) -> float:
    """The largest distance in metres of any joint."""
    return float(np.abs(forward_kinematics(a)[0] - forward_kinematics(b)[0]).max())


def without(motion: Motion, *parts: str) -> Motion:
    """The motion with some joints taken out, children carried by the joint above."""
    skeleton, (places, world) = motion.skeleton, forward_kinematics(motion)
    kept = [i for i, name in enumerate(skeleton.names) if not any(name.endswith(part) for part in parts)]
    parents = [skeleton.parents[i] for i in kept]
    parents = [next((p for p in above(skeleton, p) if p in kept), -1) for p in parents]
    local = quaternion.inverse(world[:, parents])
    offsets = quaternion.rotate(local, places[:, kept] - places[:, parents])[0]
    offsets[0] = 0.0
    turns = quaternion.multiply(local, world[:, kept])
    turns[:, 0] = world[:, kept[0]]
    new = Skeleton([skeleton.names[i] for i in kept], [kept.index(p) if p >= 0 else -1 for p in parents], offsets)
    return Motion(new, motion.root_positions, turns, motion.fps)


def above(skeleton: Skeleton, joint: int) -> list[int]:
    chain = []
    while joint >= 0:
        chain.append(joint)
        joint = skeleton.parents[joint]
    return chain


def direction(motion: Motion, joint: int, child: int) -> np.ndarray:
    places, _ = forward_kinematics(motion)
    bone = places[:, child] - places[:, joint]
    return bone / np.linalg.norm(bone, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def run() -> Motion:
    return build_gait(3.0, 3.0, 60.0, turn_rate=0.5, seed=3)


def test_the_same_skeleton_gives_the_motion_back(run):
    same = retarget(run, run.skeleton)
    assert apart(same, run) < 1e-9
    assert np.abs(same.rotations - run.rotations).max() < 1e-6
    assert same.fps == run.fps


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rest_poses_do_not_matter(run, seed):
    tall = build_gait(2.0, 2.0, 30.0, build_adult_skeleton(2.0))
    tall = renamed(tall, lambda i, old: f"Tall:{old}")
    plain = retarget(run, tall.skeleton, example=tall)
    assert apart(retarget(other_axes(run, seed), tall.skeleton, example=tall), plain) < 1e-6
    turned = other_axes(tall, seed + 10)
    assert apart(retarget(run, turned.skeleton, example=turned), plain) < 1e-6


def test_the_same_gait_on_another_body_is_what_retargeting_gives():
    small, tall = build_adult_skeleton(1.6), build_adult_skeleton(1.9)
    ratio = measure_leg_length(tall) / measure_leg_length(small)
    walk = build_gait(1.4, 3.0, 60.0, small)
    there = retarget(walk, tall)
    wanted = forward_kinematics(walk)[0] * ratio
    ankle = forward_kinematics(there)[0][:, 0, 2].mean() - wanted[:, 0, 2].mean()
    assert abs(ankle) < 1e-3
    assert np.abs(forward_kinematics(there)[0] - wanted).max() < 2e-3
    assert apart(retarget(there, small), walk) < 2e-3


def test_a_tilted_hinge_and_other_proportions_keep_directions_and_standing_feet(run):
    skeleton = build_adult_skeleton(1.7)
    offsets = skeleton.offsets.copy()
    factors = {"LeftLeg": 1.12, "RightLeg": 1.12, "LeftFoot": 0.9, "RightFoot": 0.9, "LeftForeArm": 1.2}
    for name, factor in factors.items():
        offsets[skeleton.index(name)] *= factor
    other = Skeleton(skeleton.names, skeleton.parents, offsets, skeleton.end_parents, skeleton.end_offsets)
    there = retarget(run, other)
    body = identify_joints(other)
    for limb in (body.left, body.right):
        bones = ((limb.upper_arm, limb.lower_arm, 1e-6), (limb.lower_arm, limb.hand, 1e-6), (limb.foot, limb.toe, 0.03))
        for high, low, most in bones:
            assert np.abs(direction(there, high, low) - direction(run, high, low)).max() < most
    scale = measure_leg_length(other) / measure_leg_length(run.skeleton)
    feet = [body.left.foot, body.right.foot]
    moved = forward_kinematics(there)[0][:, feet, :2] - scale * forward_kinematics(run)[0][:, feet, :2]
    assert np.percentile(np.abs(moved), 99) < 0.02
    assert np.median(np.abs(moved)) < 1e-6


def test_knees_and_feet_keep_their_way(run):
    there = retarget(run, other_axes(build_gait(1.5, 1.0, 30.0), 5).skeleton,
                     example=other_axes(build_gait(1.5, 1.0, 30.0), 5))
    body = identify_joints(there.skeleton)
    ahead = np.stack([np.cos(compute_heading(there)), np.sin(compute_heading(there)), np.zeros(len(there))], axis=1)
    for limb in (body.left, body.right):
        thigh, shank = direction(there, limb.upper_leg, limb.lower_leg), direction(there, limb.lower_leg, limb.foot)
        left = np.cross([0.0, 0.0, 1.0], ahead)
        assert np.all(np.sum(np.cross(thigh, shank) * left, axis=1) > -1e-3)
    feet = direction(there, body.left.foot, body.left.toe) + direction(there, body.right.foot, body.right.toe)
    assert np.mean(np.sum(feet * ahead, axis=1)) > 0.6


@pytest.mark.parametrize(
    "parts", [("Toe", "ToeBase"), ("Shoulder",), ("Head", "Neck"), ("Spine1", "Spine2"), ("Hand",)]
)
def test_missing_joints_degrade_gracefully(run, parts):
    poor = without(run, *parts)
    there, back = retarget(run, poor.skeleton, example=poor), retarget(poor, run.skeleton, example=run)
    assert np.all(np.isfinite(there.rotations)) and np.all(np.isfinite(back.rotations))
    legs = [run.skeleton.index(side + part) for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot")]
    assert np.abs(forward_kinematics(back)[0][:, legs] - forward_kinematics(run)[0][:, legs]).max() < 0.03
    most = 0.45 if "Hand" in parts else 0.25  # a forearm that ends nowhere shows no direction
    assert np.abs(forward_kinematics(back)[0] - forward_kinematics(run)[0]).max() < most


def test_bones_stay_as_they_are(run):
    there = retarget(run, build_adult_skeleton(1.5))
    places, _ = forward_kinematics(there)
    lengths = np.linalg.norm(places[:, 1:] - places[:, list(there.skeleton.parents[1:])], axis=-1)
    assert np.ptp(lengths, axis=0).max() < 1e-12


def renamed(motion: Motion, name) -> Motion:
    names = tuple(name(i, old) for i, old in enumerate(motion.skeleton.names))
    return replace(motion, skeleton=replace(motion.skeleton, names=names))


def test_joints_without_names_are_found_by_structure(run):
    blind = renamed(run, lambda i, old: f"J{i}")
    assert apart(retarget(blind, run.skeleton, example=run), run) < 1e-6
    turned = other_axes(blind, 4)
    assert apart(retarget(turned, run.skeleton, example=run), run) < 1e-6
    there = retarget(run, turned.skeleton, example=turned)
    assert apart(there, run) < 1e-6


def test_a_saved_map_goes_before_names(run, tmp_path):
    blind = renamed(run, lambda i, old: f"J{i}")
    table = dict(zip(blind.skeleton.names, run.skeleton.names))
    (tmp_path / "map.json").write_text(json.dumps(table))
    assert apart(retarget(blind, run.skeleton, tmp_path / "map.json", example=run), run) < 1e-6
    write_bone_map(tmp_path / "saved.json", pair_joints(blind, run.skeleton), blind.skeleton, run.skeleton)
    saved = read_bone_map(tmp_path / "saved.json")
    assert saved["J0"] == "Hips" and set(saved.items()) <= set(table.items())
    assert apart(retarget(blind, run.skeleton, {"J0": "Hips"}, example=run), run) < 1e-6


def test_unnamed_sides_are_paired(run):
    blind = renamed(run, lambda i, old: f"J{i}")
    assert identify_joints(blind.skeleton).mirror == identify_joints(run.skeleton).mirror


@pytest.mark.parametrize(
    "text, found",
    [
        ("{", "not JSON"),
        ("[1]", "not an object"),
        ('{"Hips": 3}', "not an object"),
        ('{"Hip": "Hips"}', "no joint 'Hip'"),
    ],
)
def test_bad_maps_are_told_in_one_line(run, tmp_path, text, found):
    path = tmp_path / "map.json"
    path.write_text(text)
    with pytest.raises(InputError, match=found) as told:
        retarget(run, run.skeleton, path)
    assert "map.json" in str(told.value) and "\n" not in str(told.value)


def test_a_body_without_legs_is_told(run):
    skeleton = Skeleton(("root", "a", "b"), (-1, 0, 1), np.ones((3, 3)))
    legless = Motion(skeleton, np.zeros((2, 3)), quaternion.identity(2, 3), 30.0)
    for motion, target in ((run, skeleton), (legless, run.skeleton)):
        with pytest.raises(InputError, match="no joint found for left upper_leg.*bone map") as told:
            retarget(motion, target)
        assert "\n" not in str(told.value)


FAMILIES = {
    "mixamo": "mixamorig:Hips mixamorig:Spine mixamorig:Neck mixamorig:Head mixamorig:{S}Shoulder mixamorig:{S}Arm "
    "mixamorig:{S}ForeArm mixamorig:{S}Hand mixamorig:{S}UpLeg mixamorig:{S}Leg mixamorig:{S}Foot "
    "mixamorig:{S}ToeBase",
    "unreal": "pelvis spine_01 neck_01 head clavicle_{s} upperarm_{s} lowerarm_{s} hand_{s} thigh_{s} calf_{s} "
    "foot_{s} ball_{s}",
    "rigify": "DEF-spine DEF-spine.001 DEF-spine.004 DEF-spine.006 DEF-shoulder.{i} DEF-upper_arm.{i} "
    "DEF-forearm.{i} DEF-hand.{i} DEF-thigh.{i} DEF-shin.{i} DEF-foot.{i} DEF-toe.{i}",
    "mvn": "Hips Chest Neck Head {S}Collar {S}Shoulder {S}Elbow {S}Wrist {S}Hip {S}Knee {S}Ankle {S}Toe",
    "vrm": "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Neck J_Bip_C_Head J_Bip_{i}_Shoulder J_Bip_{i}_UpperArm "
    "J_Bip_{i}_LowerArm J_Bip_{i}_Hand J_Bip_{i}_UpperLeg J_Bip_{i}_LowerLeg J_Bip_{i}_Foot J_Bip_{i}_ToeBase",
    "biped": "Bip001_Pelvis Bip001_Spine Bip001_Neck Bip001_Head Bip001_{i}_Clavicle Bip001_{i}_UpperArm "
    "Bip001_{i}_Forearm Bip001_{i}_Hand Bip001_{i}_Thigh Bip001_{i}_Calf Bip001_{i}_Foot Bip001_{i}_Toe0",
    "makehuman": "root spine05 neck01 head clavicle.{i} upperarm01.{i} lowerarm01.{i} wrist.{i} upperleg01.{i} "
    "lowerleg01.{i} foot.{i} toe1-1.{i}",
    "smpl": "Pelvis Spine1 Neck Head {i}_Collar {i}_Shoulder {i}_Elbow {i}_Wrist {i}_Hip {i}_Knee {i}_Ankle {i}_Foot",
    "asf": "root lowerback lowerneck head {s}clavicle {s}humerus {s}radius {s}wrist {s}femur {s}tibia {s}foot {s}toes",
    "bandai": "Hips Spine Neck Head Shoulder_{i} UpperArm_{i} LowerArm_{i} Hand_{i} UpperLeg_{i} LowerLeg_{i} "
    "Foot_{i} Toes_{i}",
}


@pytest.mark.parametrize("family", FAMILIES)
def test_families_of_names(run, family):
    words = FAMILIES[family].split()
    plain = "Hips Spine Neck Head {S}Shoulder {S}Arm {S}ForeArm {S}Hand {S}UpLeg {S}Leg {S}Foot {S}ToeBase".split()
    names = {}
    for ours, theirs in zip(plain, words):
        for side in ("Left", "Right"):
            fill = {"S": side, "i": side[0], "s": side[0].lower()}
            names[ours.format(**fill)] = theirs.format(**fill)
    slim = without(run, "Spine1", "Spine2")
    named = renamed(slim, lambda i, old: names[old])
    assert identify_joints(named.skeleton) == identify_joints(slim.skeleton)


def recorded(folder: str) -> Motion:
    found = sorted(path for path in glob.glob(str(MOCAP / folder / "*.bvh")) if RECORDED[folder] in path)
    if not found:
        pytest.skip(f"no recordings in {MOCAP / folder}")
    motion = bvh.read_bvh(found[0]).motion
    step = max(1, round(motion.fps / 30.0))
    some = slice(0, 200 * step, step)
    return Motion(motion.skeleton, motion.root_positions[some], motion.rotations[some], motion.fps / step)


@pytest.mark.parametrize("folder", RECORDED)
def test_recordings_go_and_come_back(folder):
    motion = recorded(folder)
    assert apart(retarget(motion, motion.skeleton), motion) < 1e-6
    body = identify_joints(motion.skeleton)
    limbs = [(s.upper_leg, s.lower_leg, s.foot, s.lower_arm, s.hand) for s in (body.left, body.right)]
    for other in ("lafan1", "lmd/Player1", "cmu10"):
        example = recorded(other)
        back = retarget(retarget(motion, example.skeleton, example=example), motion.skeleton, example=motion)
        error = np.linalg.norm(forward_kinematics(back)[0] - forward_kinematics(motion)[0], axis=-1)
        assert error[:, sum(limbs, ())].mean() < 0.025
        assert np.percentile(error[:, sum(limbs, ())], 95) < 0.045


@pytest.mark.parametrize("folder", RECORDED)
def test_recordings_are_found_by_structure_alone(folder):
    motion = recorded(folder)
    blind = renamed(motion, lambda i, old: f"J{i}")
    assert apart(retarget(blind, motion.skeleton, example=motion), motion) < 0.05


def test_footprints_can_be_kept_on_other_legs(run):
    longer = Skeleton(run.skeleton.names, run.skeleton.parents, run.skeleton.offsets * 1.08, run.skeleton.end_parents,
                      run.skeleton.end_offsets * 1.08)
    for keeps, ratio in ((True, 1.0), (False, 1.08)):
        found = Retargeter(run, longer, keeps_travel=keeps).retarget(run)
        travel = [np.linalg.norm(m.root_positions[-1, :2] - m.root_positions[0, :2]) for m in (found, run)]
        assert travel[0] / travel[1] == pytest.approx(ratio, abs=0.01)


def test_a_suits_wearers_look_where_they_looked():
    """Suits measure each wearer: the joint of the head lies elsewhere, and the axes are the same."""
    walk = build_gait(1.4, 2.0, 60.0)
    head, rotations = identify_joints(walk.skeleton).head, walk.rotations.copy()
    rotations[:, head] = quaternion.multiply(rotations[:, head], quaternion.from_axis_angle([0.0, 0.0, 1.0], 0.5))
    aside = replace(walk, rotations=rotations)
    offsets = 0.9 * walk.skeleton.offsets
    offsets[head] = quaternion.rotate(quaternion.from_axis_angle([0.0, 1.0, 0.0], 0.6), offsets[head])
    found = retarget(aside, replace(walk.skeleton, offsets=offsets))
    ours, theirs = (forward_kinematics(one)[1][:, head] for one in (found, aside))
    turns = quaternion.to_rotation_vector(quaternion.multiply(ours, quaternion.inverse(theirs)))
    assert np.degrees(np.linalg.norm(turns, axis=-1)).mean() < 5.0
