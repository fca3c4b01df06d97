"""Rigs as other programs make them: their bone names, rest poses, units and axes, on one made body. And a way to look.

The body stands 1.75 m tall, looks along -Y as Blender's characters do, its soles on the ground.
"""

import importlib

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

CENTRE = {  # part -> (its parent, head)
    "hips": (None, (0, 0.0, 0.98)), "spine1": ("hips", (0, 0.01, 1.08)), "spine2": ("spine1", (0, 0.015, 1.20)),
    "spine3": ("spine2", (0, 0.02, 1.33)), "neck": ("spine3", (0, 0.03, 1.48)), "head": ("neck", (0, 0.01, 1.58)),
}
SIDE = {
    "shoulder": ("spine3", (0.03, 0.01, 1.43)), "upper_arm": ("shoulder", (0.17, 0.02, 1.42)),
    "lower_arm": ("upper_arm", (0.45, 0.03, 1.42)), "hand": ("lower_arm", (0.70, 0.02, 1.42)),
    "fingers": ("hand", (0.79, 0.015, 1.42)),
    "upper_leg": ("hips", (0.10, 0.0, 0.93)), "lower_leg": ("upper_leg", (0.10, -0.015, 0.51)),
    "foot": ("lower_leg", (0.10, 0.02, 0.09)), "toe": ("foot", (0.10, -0.12, 0.02)),
}
ENDS = {"head": (0, 0.0, 1.77), "fingers": (0.86, 0.01, 1.42), "toe": (0.10, -0.20, 0.02)}

MIXAMO = {
    "hips": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2", "neck": "Neck", "head": "Head",
    **{f"{s} {part}": side + name for s, side in (("left", "Left"), ("right", "Right")) for part, name in {
        "shoulder": "Shoulder", "upper_arm": "Arm", "lower_arm": "ForeArm", "hand": "Hand", "fingers": "HandMiddle1",
        "upper_leg": "UpLeg", "lower_leg": "Leg", "foot": "Foot", "toe": "ToeBase"}.items()},
}
MIXAMO = {part: f"mixamorig:{name}" for part, name in MIXAMO.items()}
UNREAL = {
    "hips": "pelvis", "spine1": "spine_01", "spine2": "spine_02", "spine3": "spine_03", "neck": "neck_01",
    "head": "head",
    **{f"{s} {part}": f"{name}_{s[0]}" for s in ("left", "right") for part, name in {
        "shoulder": "clavicle", "upper_arm": "upperarm", "lower_arm": "lowerarm", "hand": "hand",
        "fingers": "middle_01",
        "upper_leg": "thigh", "lower_leg": "calf", "foot": "foot", "toe": "ball"}.items()},
}
NAMELESS = {part: f"Bone.{number:03d}" for number, part in enumerate(UNREAL)}


def compute_part_positions(arms=0.0, legs=0.0):
    """Heads and ends of all parts, metres: arms lowered by `arms` radians from a T, legs spread by `legs`."""
    found = {part: (parent, Vector(head)) for part, (parent, head) in CENTRE.items()}
    ends = {"head": Vector(ENDS["head"])}
    for side, sign in (("left", 1), ("right", -1)):
        for part, (parent, head) in SIDE.items():
            point = Vector(head)
            if part in ("lower_arm", "hand", "fingers"):
                point = _rotate_about(point, Vector(SIDE["upper_arm"][1]), arms)
            if part in ("lower_leg", "foot", "toe"):
                point = _rotate_about(point, Vector(SIDE["upper_leg"][1]), -legs)
            parent = parent if parent in CENTRE else f"{side} {parent}"
            found[f"{side} {part}"] = (parent, Vector((sign * point.x, point.y, point.z)))
        for part, pivot, angle in (("fingers", "upper_arm", arms), ("toe", "upper_leg", -legs)):
            point = _rotate_about(Vector(ENDS[part]), Vector(SIDE[pivot][1]), angle)
            ends[f"{side} {part}"] = Vector((sign * point.x, point.y, point.z))
    drop = Vector((0, 0, found["left toe"][1].z - SIDE["toe"][1][2]))  # it stands on the ground, legs spread or not
    return {part: (parent, head - drop) for part, (parent, head) in found.items()}, {
        p: e - drop for p, e in ends.items()
    }


def _rotate_about(point, pivot, angle):
    return pivot + Matrix.Rotation(angle, 3, "Y") @ (point - pivot)


def create_rig(names, name="Rig", arms=0.0, legs=0.0, tails="along", rolls=0.0, units=1.0, y_up=False, root=None,
               extra=(), size=1.0):
    """An armature object with the body's bones under `names` (part -> name).

    arms, legs: rest pose, see `places`. tails: "along" the limb, or "stray": all to one side, as importers leave them.
    rolls: radians times the bone's number. units: per metre (100 for cm, the object is then scaled by 0.01). y_up: Y is
    up in the armature's own space, the object is turned. root: name of a root bone on the ground. extra: (name, parent
    name, part at whose head it stands) of more bones. size: of the body, 1 as above.
    """
    data = bpy.data.armatures.new(name)
    rig = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(rig)
    inward = (Matrix.Rotation(-np.pi / 2, 3, "X") if y_up else Matrix.Identity(3)) * units * size
    found, ends = compute_part_positions(arms, legs)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    if root:
        bone = data.edit_bones.new(root)
        bone.head, bone.tail = (0, 0, 0), inward @ Vector((0, 0.2, 0))
    for number, (part, (parent, head)) in enumerate(found.items()):
        if part not in names:
            continue
        bone = data.edit_bones.new(names[part])
        child = next((h for p, (above, h) in found.items() if above == part
                      and p.rpartition(" ")[0] == part.rpartition(" ")[0]), None)
        tail = child if child is not None else ends.get(part, head + Vector((0, 0, 0.1)))
        if tails == "stray":
            tail = head + Vector((0.03, 0.05, 0.02))
        bone.head, bone.tail = inward @ head, inward @ tail
        bone.roll = rolls * number
        above = names.get(parent) if parent else root
        bone.parent = data.edit_bones[above] if above else None
    for extra_name, above, part in extra:
        bone = data.edit_bones.new(extra_name)
        head = found[part][1] if part else Vector()
        bone.head, bone.tail = inward @ head, inward @ (head + Vector((0, 0, 0.05)))
        bone.parent = data.edit_bones[above] if above else None
    bpy.ops.object.mode_set(mode="OBJECT")
    if units != 1.0:
        rig.scale = (1 / units,) * 3
    if y_up:
        rig.rotation_euler = Euler((np.pi / 2, 0, 0))
    bpy.context.view_layer.update()
    return rig


def create_mixamo(**options):
    """As Mixamo's FBX comes in: T pose, centimetres, object at 0.01 and turned, no root bone."""
    return create_rig(MIXAMO, "Mixamo", **{"units": 100.0, "y_up": True, **options})


def create_unreal(**options):
    """The mannequin: A pose, root bone, twist bones and IK bones, stray tails as the FBX importer leaves them."""
    extra = [(f"{limb}_twist_01_{s}", f"{limb}_{s}", f"{side} {part}") for side, s in (("left", "l"), ("right", "r"))
             for limb, part in (("upperarm", "lower_arm"), ("lowerarm", "hand"), ("thigh", "lower_leg"),
                                ("calf", "foot"))]
    extra += [("ik_foot_root", "root", None), ("ik_foot_l", "ik_foot_root", "left foot"),
              ("ik_foot_r", "ik_foot_root", "right foot"), ("ik_hand_root", "root", None),
              ("ik_hand_gun", "ik_hand_root", "right hand"), ("ik_hand_l", "ik_hand_gun", "left hand"),
              ("ik_hand_r", "ik_hand_gun", "right hand")]
    return create_rig(UNREAL, "Mannequin", **{"arms": 0.9, "legs": 0.12, "tails": "stray", "units": 100.0,
                                              "root": "root", "extra": extra, **options})


def create_metahuman(**options):
    """MetaHuman's body: five spine bones, two neck bones, twist and corrective bones."""
    rig = create_unreal(**{"root": "root", **options})
    rig.name = "MetaHuman"
    bones = rig.data.edit_bones
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for new, low, high in (("spine_04", "spine_03", "neck_01"), ("spine_05", "spine_04", "neck_01"),
                           ("neck_02", "neck_01", "head")):
        bone = bones.new(new)
        bone.head = (bones[low].head * 0.6 + bones[high].head * 0.4)
        bone.tail = bone.head + (bones[low].tail - bones[low].head)
        bone.parent = bones[low]
        for child in list(bones[low].children):
            if child.name in (high, "clavicle_l", "clavicle_r"):
                child.parent = bone
    for side in "lr":
        for limb in ("upperarm", "thigh", "calf", "lowerarm"):
            for what in (f"{limb}_correctiveRoot_{side}", f"{limb}_twist_02_{side}"):
                bone = bones.new(what)
                bone.head, bone.tail, bone.parent = (
                    bones[f"{limb}_{side}"].head,
                    bones[f"{limb}_{side}"].tail,
                    bones[f"{limb}_{side}"],
                )
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def append_rigify(file):
    """The control rig that rigify_rig.py saved, appended."""
    with bpy.data.libraries.load(str(file)) as (theirs, mine):
        mine.objects = [name for name in theirs.objects if not name.startswith("WGT")]
    rig = next(thing for thing in mine.objects if thing.type == "ARMATURE")
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.update()
    return rig


def read_heads(rig, bones, frames):
    """Where Blender shows the heads of bones in the world: (F, B, 3) units."""
    scene, found = bpy.context.scene, []
    for frame in frames:
        scene.frame_set(int(frame))
        found.append([np.array((rig.matrix_world @ rig.pose.bones[bone].matrix).translation) for bone in bones])
    return np.array(found)


def read_all_keys(extension, rig):
    """All keys of the action that a rig plays: by channel, frames and values as text of their bits."""
    channels = importlib.import_module(f"{extension}.scene.core.channels")
    curves = channels.collect_curves(*channels.find_playing_action(rig))
    return {f"{path}[{index}]": channels.read_keys(curve)["co"].tobytes().hex()
            for (path, index), curve in curves.items()}
