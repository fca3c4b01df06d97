"""Armatures of many kinds that walk the same walk, for path editing: each returns an armature object with its
motion."""

import bpy
import numpy as np
import sample_rigs as rigs
from mathutils import Vector

START, FRAMES = 5, 60


def add_keys(rig, path, index, frames, values, group="", interpolation="LINEAR"):
    """One curve on the action that an object plays, made where there is none."""
    data = rig.animation_data_create()
    if data.action is None:
        action = bpy.data.actions.new(f"{rig.name} walk")
        slot = action.slots.new(id_type="OBJECT", name=rig.name)
        action.layers.new("Layer").strips.new(type="KEYFRAME").channelbag(slot, ensure=True)
        bpy.context.view_layer.update()
        data.action, data.action_slot = action, slot
    bag = data.action.layers[0].strips[0].channelbag(data.action_slot)
    curve = bag.fcurves.new(path, index=index)
    curve.keyframe_points.add(len(frames))
    curve.keyframe_points.foreach_set("co", np.column_stack([frames, values]).astype(np.float32).ravel())
    for point in curve.keyframe_points:
        point.interpolation = interpolation
    curve.update()
    return curve


def build_bone_path(bone, channel):
    return f'pose.bones["{bone}"].{channel}'


def add_travel(rig, bone, frames, places, interpolation="LINEAR"):
    """Let a bone's head go by `places` (F, 3) from where it rests, in the armature's space."""
    rest = np.array(rig.data.bones[bone].matrix_local.to_3x3())
    for index, values in enumerate((np.asarray(places) @ rest).T):
        add_keys(rig, build_bone_path(bone, "location"), index, frames, values, bone, interpolation)


def create_ik_rig(pole=True, root=True, cog=True, every=1, frames=FRAMES, interpolation="LINEAR"):
    """A control rig made by hand: deform legs with inverse kinematics on foot controls with poles, a COG above the
    hips, a root above all, the feet and poles hanging on the root. Feet stand still in turn; keys on every `every`th
    frame."""
    above = "root" if root else None
    extra = [("foot_ctrl.L", above, "left foot"), ("foot_ctrl.R", above, "right foot")]
    names = {part: name for part, name in rigs.UNREAL.items()}
    rig = rigs.create_rig(names, "Hand Rig", root="root" if root else None, extra=[])
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bones = rig.data.edit_bones

    def add_bone(name, head, parent):
        bone = bones.new(name)
        bone.head, bone.tail, bone.use_deform = head, Vector(head) + Vector((0, 0.1, 0)), False
        bone.parent = bones[parent] if parent else None

    for name, parent, part in extra:
        side = "l" if name.endswith("L") else "r"
        add_bone(name, bones[f"foot_{side}"].head.copy(), parent)
        if pole:
            add_bone(f"knee_pole.{name[-1]}", bones[f"calf_{side}"].head + Vector((0, -0.6, 0)), parent)
    if cog:
        add_bone("COG", bones["pelvis"].head.copy(), above)
        bones["pelvis"].parent = bones["COG"]
    bpy.ops.object.mode_set(mode="OBJECT")
    for side in "LR":
        ik = rig.pose.bones[f"calf_{side.lower()}"].constraints.new("IK")
        ik.target, ik.subtarget, ik.chain_count = rig, f"foot_ctrl.{side}", 2
        if pole:
            ik.pole_target, ik.pole_subtarget = rig, f"knee_pole.{side}"
            ik.pole_angle = _compute_pole_angle(rig, side.lower())
        turn = rig.pose.bones[f"foot_{side.lower()}"].constraints.new("COPY_ROTATION")
        turn.target, turn.subtarget = rig, f"foot_ctrl.{side}"
        turn.target_space = turn.owner_space = "POSE"
        turn.mix_mode = "REPLACE"
    _align_rest_poses(rig)
    frames = np.arange(START, START + frames, every)
    mover = "COG" if cog else "pelvis"
    forward = 1.2 * (frames - START) / 30.0
    bob = 0.02 * np.cos(4 * np.pi * (frames - START) / 30.0) - 0.11
    add_travel(rig, mover, frames, np.column_stack([0 * forward, -forward, bob]), interpolation)
    for side, shift in (("L", 0.0), ("R", 0.5)):
        way, lift = _compute_foot_path(frames, shift)
        place = np.column_stack([0 * way, -way, lift])
        add_travel(rig, f"foot_ctrl.{side}", frames, place, interpolation)
        if pole:
            add_travel(rig, f"knee_pole.{side}", frames, np.column_stack([0 * forward, -forward, 0 * forward]),
                       interpolation)
    return rig


def _compute_foot_path(frames, shift):
    """How far a foot has come and how high it is: it stands for half of each second-long stride of 1.2 m."""
    phase = (frames - START) / 30.0 + shift
    whole, part = np.floor(phase), phase % 1.0
    swing = np.clip((part - 0.5) / 0.5, 0.0, 1.0)
    smooth = swing * swing * (3 - 2 * swing)
    return 1.2 * (whole + smooth - shift) + 0.3, 0.12 * np.sin(np.pi * swing) ** 2


def _compute_pole_angle(rig, side):
    """The angle with which the knee looks at its pole at rest (the usual formula)."""
    base, ik = rig.data.bones[f"thigh_{side}"], rig.data.bones[f"calf_{side}"]
    pole = rig.data.bones[f"knee_pole.{side.upper()}"].head_local
    normal = (ik.tail_local - base.head_local).cross(pole - base.head_local)
    axis = normal.cross(base.vector)
    x = base.matrix_local.to_3x3().col[0]
    angle = x.angle(axis)
    return -angle if x.cross(axis).angle(base.vector) < 1 else angle


def _align_rest_poses(rig):
    """The foot controls rest as the feet do, so that copying their rotation turns nothing."""
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bones = rig.data.edit_bones
    for side in "LR":
        control, foot = bones[f"foot_ctrl.{side}"], bones[f"foot_{side.lower()}"]
        control.head, control.tail, control.roll = foot.head, foot.tail, foot.roll
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()


def create_quadruped():
    """A dog of few bones that trots straight on, keyed on its root bone and legs."""
    data = bpy.data.armatures.new("Dog")
    rig = bpy.data.objects.new("Dog", data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    made = {}
    def add_bone(name, head, tail, parent=None):
        bone = data.edit_bones.new(name)
        bone.head, bone.tail = head, tail
        bone.parent = data.edit_bones[parent] if parent else None
        made[name] = bone
    add_bone("pelvis", (0, 0.4, 0.6), (0, 0.3, 0.6))
    add_bone("spine", (0, 0.3, 0.6), (0, -0.2, 0.6), "pelvis")
    add_bone("chest", (0, -0.2, 0.6), (0, -0.4, 0.62), "spine")
    add_bone("neck", (0, -0.4, 0.62), (0, -0.6, 0.75), "chest")
    add_bone("head", (0, -0.6, 0.75), (0, -0.8, 0.75), "neck")
    for side, x in (("L", 0.1), ("R", -0.1)):
        for name, y, parent in (("thigh", 0.4, "pelvis"), ("upper_arm", -0.3, "chest")):
            low = {"thigh": ("shin", "foot"), "upper_arm": ("forearm", "hand")}[name]
            add_bone(f"{name}.{side}", (x, y, 0.55), (x, y + 0.05, 0.3), parent)
            add_bone(f"{low[0]}.{side}", (x, y + 0.05, 0.3), (x, y, 0.05), f"{name}.{side}")
            add_bone(f"{low[1]}.{side}", (x, y, 0.05), (x, y - 0.08, 0.0), f"{low[0]}.{side}")
    bpy.ops.object.mode_set(mode="OBJECT")
    for bone in rig.pose.bones:
        bone.rotation_mode = "XYZ"
    frames = np.arange(START, START + FRAMES)
    add_travel(rig, "pelvis", frames, np.column_stack([0 * frames, -1.5 * (frames - START) / 30.0,
                                                       0.02 * np.sin(frames)]))
    for side, shift in (("L", 0.0), ("R", np.pi)):
        for name in ("thigh", "upper_arm"):
            add_keys(rig, build_bone_path(f"{name}.{side}", "rotation_euler"), 0, frames,
                     0.5 * np.sin(0.4 * frames + shift))
    return rig


def add_props(rig, hips):
    """A sword that hangs on nothing and goes with the body, keyed; a bag on the hips; a stone that stays where it
    lies."""
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bones = rig.data.edit_bones
    for name, parent, head in (("sword", None, (0.8, 0, 1)), ("bag", hips, (0, 0.2, 1)), ("stone", None, (0, 1, 0))):
        bone = bones.new(name)
        bone.head, bone.tail = head, Vector(head) + Vector((0, 0, 0.2))
        bone.parent = bones[parent] if parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def move_to_object(rig, channels):
    """What a body's first bone goes over the ground is gone by the object instead."""
    action, slot = channels.find_playing_action(rig)
    bone = rig.data.bones[0]
    found = channels.collect_curves(action, slot)
    where = build_bone_path(bone.name, "location")
    frames = channels.read_keys(found[where, 0])["co"][:, 0]
    local = np.stack([channels.read_keys(found[where, i])["co"][:, 1] for i in range(3)], axis=1)
    rest = np.array(bone.matrix_local.to_3x3())
    way = (local @ rest.T) * [1.0, 1.0, 0.0]
    bag = action.layers[0].strips[0].channelbag(slot)
    for index in range(3):
        bag.fcurves.remove(found[where, index])
    for index, values in enumerate((local - way @ rest).T):
        add_keys(rig, where, index, frames, values, bone.name)
    for index in range(3):
        add_keys(rig, "location", index, frames, way[:, index])
    return rig


def parent_to_empty(rig, size=1.0):
    """Hang an armature on an Empty that moves, turned and larger."""
    empty = bpy.data.objects.new("Platform", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.scale, empty.rotation_euler = (size, size, size), (0.0, 0.0, 1.0)
    for index, end in enumerate((2.0, 1.0, 0.4)):
        add_keys(empty, "location", index, [1, 120], [0.0, end])
    rig.parent = empty
    bpy.context.view_layer.update()


def move_to_strip(rig, **settings):
    """The action becomes an NLA strip."""
    data = rig.animation_data
    action, slot = data.action, data.action_slot
    data.action = None
    strip = data.nla_tracks.new().strips.new("walk", START, action)
    strip.action_slot = slot
    for name, value in settings.items():
        setattr(strip, name, value)
    return rig


def cycle_curves(rig, channels):
    """All curves go on for ever, places with an offset."""
    for curve in channels.collect_curves(*channels.find_playing_action(rig)).values():
        modifier = curve.modifiers.new("CYCLES")
        modifier.mode_after = modifier.mode_before = "REPEAT_OFFSET"
