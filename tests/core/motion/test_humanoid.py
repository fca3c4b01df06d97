"""Which joint is what, in the families of names that recordings and rigs use."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.humanoid import compute_heading, identify_joints, measure_leg_length, split_joint_name
from beyond_mocap.motion.motion import place_motion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.gait import build_gait

# hips, spine, neck, head, then an arm (shoulder, upper, lower, hand) and a leg (upper, lower, foot, toe); {} the side
FAMILIES = {
    "CMU": "Hips Spine,Spine1 Neck Head {Left|Right}Shoulder,Arm,ForeArm,Hand {Left|Right}UpLeg,Leg,Foot,ToeBase",
    "Mixamo": "mixamorig:Hips mixamorig:Spine mixamorig:Neck mixamorig:Head "
    "mixamorig:{Left|Right}Shoulder,Arm,ForeArm,Hand mixamorig:{Left|Right}UpLeg,Leg,Foot,ToeBase",
    "Bandai": "Hips Spine,Chest Neck Head Shoulder,UpperArm,LowerArm,Hand{_L|_R} UpperLeg,LowerLeg,Foot,Toes{_L|_R}",
    "Unreal": "pelvis spine_01,spine_02 neck_01 head "
    "clavicle,upperarm,lowerarm,hand{_l|_r} thigh,calf,foot,ball{_l|_r}",
    "Rigify": "DEF-hips DEF-spine DEF-neck DEF-head "
    "DEF-shoulder,upper_arm,forearm,hand{.L|.R} DEF-thigh,shin,foot,toe{.L|.R}",
    "LAFAN1": "Hips Spine,Spine1,Spine2 Neck Head {Left|Right}Shoulder,Arm,ForeArm,Hand {Left|Right}UpLeg,Leg,Foot,Toe",
    "blanks": "Hips Spine Neck Head "
    "{Left_|Right_}Shoulder,Upper_Arm,Lower_Arm,Hand {Left_|Right_}Upper_Leg,Lower_Leg,Foot,Toe",
}


def limb(pattern: str, side: int) -> list[str]:
    """The names of one limb of a family, e.g. "{Left|Right}UpLeg,Leg" -> ["LeftUpLeg", "LeftLeg"] for side 0."""
    start, stop = pattern.index("{"), pattern.index("}")
    mark = pattern[start + 1 : stop].split("|")[side]
    if stop == len(pattern) - 1:
        first, *more = pattern[:start].split(",")
        prefix = "DEF-" if first.startswith("DEF-") else ""
        return [name + mark for name in (first, *(prefix + m for m in more))]
    return [pattern[:start] + mark + name for name in pattern[stop + 1 :].split(",")]


def family_skeleton(family: str) -> Skeleton:
    hips, spine, neck, head, arm, leg = FAMILIES[family].split(" ")
    names, parents = [hips, *spine.split(","), neck, head], [-1]
    parents += list(range(len(names) - 1))
    chest = len(names) - 3
    for pattern, base in ((arm, chest), (leg, 0)):
        for side in (0, 1):
            joints = limb(pattern, side)
            parents += [base, *range(len(names), len(names) + len(joints) - 1)]
            names += joints
    return Skeleton(names, parents, np.ones((len(names), 3)))


@pytest.mark.parametrize("family", FAMILIES)
def test_families_of_names(family):
    skeleton = family_skeleton(family)
    body = identify_joints(skeleton)
    hips, spine, neck, head, arm, leg = FAMILIES[family].split(" ")
    assert skeleton.names[body.hips] == hips and skeleton.names[body.neck] == neck and skeleton.names[body.head] == head
    assert [skeleton.names[j] for j in body.spine] == spine.split(",") and body.chest == body.spine[-1]
    for side, found in ((0, body.left), (1, body.right)):
        arm_joints = (found.shoulder, found.upper_arm, found.lower_arm, found.hand)
        leg_joints = (found.upper_leg, found.lower_leg, found.foot, found.toe)
        assert [skeleton.names[j] for j in arm_joints + leg_joints] == limb(arm, side) + limb(leg, side)
    assert [body.mirror[j] for j in body.mirror] == list(range(len(skeleton)))
    assert body.mirror[body.left.hand] == body.right.hand and body.mirror[body.hips] == body.hips


@pytest.mark.parametrize(
    "name, side, part",
    [
        ("LeftUpLeg", "left", "upleg"),
        ("LHipJoint", "left", "hipjoint"),
        ("RThumb", "right", "thumb"),
        ("upperarm_r", "right", "upperarm"),
        ("Leg", "", "leg"),
        ("LowerBack", "", "lowerback"),
        ("Root", "", "root"),
        ("Hand_L", "left", "hand"),
        ("thigh.R", "right", "thigh"),
        ("mixamorig:RightFoot", "right", "foot"),
        ("Bip01 L Thigh", "left", "thigh"),
        ("Neck", "", "neck"),
        ("Ribs", "", "ribs"),
    ],
)
def test_sides_and_parts(name, side, part):
    assert split_joint_name(name) == (side, part)


def test_a_body_without_legs_is_refused():
    with pytest.raises(InputError, match="left upper_leg"):
        identify_joints(Skeleton(("Hips", "Spine"), (-1, 0), np.zeros((2, 3))))


def test_legs_without_length_are_refused():
    """A scale by which their motion is transferred would be zero or endless."""
    skeleton = build_gait(1.4, 0.5).skeleton
    legs = [skeleton.names.index(f"Left{part}") for part in ("Leg", "Foot")]
    offsets = np.array(skeleton.offsets)
    offsets[legs] = 0.0
    with pytest.raises(InputError, match="no length from LeftUpLeg to LeftFoot.*OFFSET"):
        identify_joints(replace(skeleton, offsets=offsets))


def test_arms_are_not_taken_for_legs_that_lack():
    names = ["Hips", *(f"{side}{part}" for side in ("Left", "Right") for part in ("Arm", "ForeArm", "Hand"))]
    offsets = [[0, 0, 1], *([0.0, side * step, 0.4 * (step < 0.2)] for side in (1, -1) for step in (0.15, 0.3, 0.25))]
    with pytest.raises(InputError, match="no joint found for left upper_leg"):
        identify_joints(Skeleton(names, [-1, 0, 1, 2, 0, 4, 5], np.array(offsets, float)))


def test_toes_and_arms_may_be_missing():
    full = family_skeleton("LAFAN1")
    keep = [i for i, n in enumerate(full.names) if not any(word in n for word in ("Toe", "Arm", "Hand", "Shoulder"))]
    new = {old: i for i, old in enumerate(keep)}
    body = identify_joints(
        Skeleton([full.names[i] for i in keep], [new.get(full.parents[i], -1) for i in keep], full.offsets[keep])
    )
    assert body.left.toe is None and body.left.toe_or_foot == body.left.foot and body.right.hand is None


@pytest.mark.parametrize("angle", [0.0, 1.0, -2.5, np.pi / 2])
def test_heading_is_where_the_body_faces(angle):
    motion = place_motion(build_gait(1.4, 1.0), angle)
    off = (compute_heading(motion) - angle + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(off).max() < np.radians(15.0) and abs(np.mean(off)) < np.radians(3.0)


def test_heading_runs_on_through_whole_turns():
    walk = build_gait(0.0, 4.0)
    spin = place_motion(walk, np.linspace(0, 4 * np.pi, len(walk)))
    assert np.ptp(compute_heading(spin)) == pytest.approx(4 * np.pi, abs=0.2)


def test_leg_length_is_thigh_plus_shank():
    skeleton = family_skeleton("CMU")
    assert measure_leg_length(skeleton) == pytest.approx(2 * np.sqrt(3))
