"""The poses of a rig's driven bones, or of an exported root, at each frame; the curves of the bones' channels.

With S the rotation and size from the armature's space to the core's skeleton, O the object's rotation in the scene, W_j
the core's world rotation of a joint and R_j its bone's rotation at rest, the bone's pose is O^-1 W_j S R_j.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion, forward_kinematics
from ..core.measure import frames_per_second, units_per_metre
from ..path_editing import keys
from ..path_editing.rig_sampling import find_rotation_channel
from . import armature, bone_maps
from .driven import DrivenRig, compute_upright_axes

ROOT_BONE = "root"


def compute_bone_poses(driven: DrivenRig, motion: Motion, frames: np.ndarray, root: str):
    """Compute the poses of the driven bones.

    Args:
        driven: the rig.
        motion: on its skeleton.
        frames: (F,) scene frames.
        root: one of `rig.ROOTS`.
    Returns:
        Rotations (F, 3, 3) and heads (F, 3) in the armature's space, by bone, and messages.
    """
    heads, world = forward_kinematics(motion)
    hips = heads[:, driven.parts.index("hips")]
    messages = []
    if root != "KEEP":
        root_rotation, root_place = _compute_root_path(driven, motion, heads, "straight" if root == "STRAIGHT"
                                                       else "smooth")
    if root == "IN_PLACE":  # the root's path is removed from everything: the body stays where it started
        back = quaternion.multiply(root_rotation[:1], quaternion.inverse(root_rotation))
        world = quaternion.multiply(back[:, None], world)
        hips = quaternion.rotate(back, hips - root_place) + root_place[:1]
        root_rotation, root_place = (np.repeat(values[:1], len(hips), axis=0) for values in (root_rotation, root_place))
    if root in ("SMOOTH", "STRAIGHT") and "root" not in driven.table:
        messages.append("no root bone: the hips carry the whole motion; Export Motion can add one to a copy")
    object_rotation, object_origin = sample_placements(driven.rig, driven.scene, frames)
    scale = driven.placement.scale

    def to_bone_rotations(turn: np.ndarray, bone: str) -> np.ndarray:
        to_rest = quaternion.multiply(turn, driven.upright)
        return quaternion.to_matrix(quaternion.multiply(quaternion.inverse(object_rotation),
                                                        to_rest)) @ driven.rest_rotations[bone]

    def to_armature_space(points: np.ndarray) -> np.ndarray:
        return quaternion.rotate(quaternion.inverse(object_rotation), points - object_origin) / scale

    rotations = {driven.find_bone(part): to_bone_rotations(world[:, i], driven.find_bone(part)) for i,
                 part in enumerate(driven.parts)}
    places = {driven.find_bone("hips"): to_armature_space(hips)}
    if "root" in driven.table:
        bone = driven.find_bone("root")
        if root == "KEEP":  # it stays at rest
            rotations[bone] = np.repeat(driven.rest_rotations[bone][None], len(frames), axis=0)
            places[bone] = np.repeat(driven.rest_positions[bone][None], len(frames), axis=0)
        else:
            rotations[bone] = to_bone_rotations(root_rotation, bone)
            places[bone] = to_armature_space(root_place)
    _compute_followers(driven, rotations, places, hips=hips, world=world, motion=motion, placed=to_armature_space)
    return rotations, places, messages


def _compute_root_path(driven: DrivenRig, motion: Motion, heads: np.ndarray, kind: str):
    """Compute the root's rotation (F, 4) and position (F, 3), world: on the ground under the pelvis, as at rest."""
    from ...beyond_mocap.motion.humanoid import compute_heading_from_positions
    from ...beyond_mocap.motion.path.smooth_spline import compute_root_path

    middle = heads[:, [driven.parts.index(f"{side} upper_leg") for side in ("left", "right")]].mean(axis=1)
    facing = np.unwrap(compute_heading_from_positions(motion.skeleton, heads))
    line, yaw = compute_root_path(middle[:, :2], facing, motion.fps, kind)
    turn = quaternion.from_up_angle(yaw)
    rest = driven.to_metres(driven.rest_heads("left upper_leg", "right upper_leg").mean(axis=0))
    root_offset = driven.to_metres(driven.rest_heads("root")[0]) - rest if "root" in driven.table else np.zeros(3)
    root_offset = np.array([root_offset[0], root_offset[1], 0.0])
    return turn, np.column_stack([line, np.zeros(len(line))]) + quaternion.rotate(turn, root_offset)


def _compute_followers(driven: DrivenRig, turns: dict, places: dict, hips, world, motion: Motion, placed) -> None:
    """Compute the poses of IK targets, which follow their bones rigidly."""
    if not driven.followers:
        return
    heads = _compute_heads(motion, world, hips)
    for bone, part in driven.followers.items():
        carrier = driven.find_bone(part)
        own = driven.rest_rotations[carrier].T @ driven.rest_rotations[bone]
        offset = driven.rest_rotations[carrier].T @ (driven.rest_positions[bone] - driven.rest_positions[carrier])
        turns[bone] = turns[carrier] @ own
        places[bone] = placed(heads[:, driven.parts.index(part)]) + turns[carrier] @ offset


def _compute_heads(motion: Motion, world: np.ndarray, hips: np.ndarray) -> np.ndarray:
    """Compute all joints' positions (F, J, 3) from world rotations and the hips' positions."""
    skeleton, heads = motion.skeleton, np.zeros((*world.shape[:2], 3))
    for joint, parent in enumerate(skeleton.parents):
        heads[:, joint] = hips if parent < 0 else heads[:, parent] + quaternion.rotate(
            world[:, parent], skeleton.offsets[joint])
    return heads


def sample_placements(rig: bpy.types.Object, scene: bpy.types.Scene, frames: np.ndarray) -> tuple[np.ndarray,
        np.ndarray]:
    """Sample the armature object's placement at each frame: rotations (F, 4) and origins (F, 3) metres."""
    still = armature.find_placement(rig, scene)
    if not is_carried(rig):
        return np.repeat(still.rotation[None], len(frames), axis=0), np.repeat(still.origin[None], len(frames), axis=0)
    now, subframe, rows = scene.frame_current, scene.frame_subframe, []
    for frame in frames:
        scene.frame_set(int(frame))
        origin, turn, _ = rig.matrix_world.decompose()
        rows.append((*turn, *origin))
    scene.frame_set(now, subframe=subframe)
    table = np.array(rows)
    return quaternion.unify_signs(table[:, :4]), table[:, 4:] / units_per_metre(scene)


def is_carried(rig: bpy.types.Object) -> bool:
    """Whether something moves the object: its own constraints, or an animated or constrained parent."""
    if len(rig.constraints):
        return True
    parent = rig.parent
    while parent is not None:
        if parent.animation_data is not None or len(parent.constraints):
            return True
        parent = parent.parent
    return False


def name_root_bone(rig: bpy.types.Object) -> str:
    """Name the root bone that a copy of an armature gets: none of its own bones has this name."""
    return ROOT_BONE if ROOT_BONE not in rig.data.bones else f"{ROOT_BONE}_motion"


def build_bone_curves(rig: bpy.types.Object, basis: dict) -> dict[str, tuple[str, np.ndarray]]:
    """Build curves for the driven bones' channels, each bone in its own rotation mode."""
    found = {}
    for name, (rotation, location) in basis.items():
        path = f'pose.bones["{bpy.utils.escape_identifier(name)}"]'
        mode = rig.pose.bones[name].rotation_mode
        if location is not None:
            found[f"{path}.location"] = (name, location)
        if mode == "QUATERNION":
            values = -rotation if rotation[0, 0] < 0 else rotation
        else:
            values = keys.to_rotation_channel(mode,
                                              rotation) if mode == "AXIS_ANGLE" else _compute_euler_curves(rotation,
                    mode)
        found[f"{path}.{find_rotation_channel(mode)}"] = (name, values)
    return found


def _compute_euler_curves(rotation: np.ndarray, mode: str) -> np.ndarray:
    """Compute Blender's Euler angles (F, 3), X Y Z, of rotations (F, 4), without jumps.

    Of the two forms of a rotation the one nearer to the previous frame is used, full turns added.
    """
    order = mode[::-1]  # Blender names the axes in the order in which they are applied to a point
    angles = quaternion.to_euler(rotation, order)
    out = np.empty_like(angles)
    last = np.zeros(3)
    for frame, first in enumerate(angles):
        other = np.array([first[0] + np.pi, np.pi - first[1], first[2] + np.pi])
        choices = [a - 2.0 * np.pi * np.round((a - last) / (2.0 * np.pi)) for a in (first, other)]
        last = min(choices, key=lambda a: np.abs(a - last).sum())
        out[frame] = last
    return out[:, [order.index(letter) for letter in "XYZ"]]


def build_setting_curves(driven: DrivenRig, bakes_ik: bool) -> dict[str, tuple[str, np.ndarray]]:
    """Build curves of one key each: IK/FK switches, and constraints that are switched off."""
    found = {}
    for switch in driven.controls.switches:
        path = f'pose.bones["{bpy.utils.escape_identifier(switch.bone)}"]["{bpy.utils.escape_identifier(switch.name)}"]'
        found[path] = (switch.bone, np.array([[float(switch.value)]]))
    if not bakes_ik:
        for one in driven.overrides:
            path = (f'pose.bones["{bpy.utils.escape_identifier(one.bone)}"]'
                    f'.constraints["{bpy.utils.escape_identifier(one.constraint)}"].influence')
            found[path] = (one.bone, np.array([[0.0]]))
    return found


def compute_root_motion(rig: bpy.types.Object, sampled, options, messages: list[str]):
    """Compute the root motion for an export.

    Args:
        rig: the armature.
        sampled: its sampled poses (`export`).
        options: the export's options.
        messages: gets messages.
    Returns:
        Hips, root bone (None: it has none), the root's path (F, 4, 4) and the matrices (F, 4, 4) that keep the body in
        place; the last two are None where they are not requested.
    """
    if options.root == "KEEP":
        return None, None, None, None
    from ...beyond_mocap.motion.path.smooth_spline import compute_root_path

    table = bone_maps.load_stored_map(rig) or bone_maps.find_bone_map(rig)
    at = {part: sampled.bones.index(table[part]) for part in ("left upper_leg", "right upper_leg")}
    world = sampled.object_matrices[:, None] @ sampled.poses[:, list(at.values())]
    legs = world[:, :, :3, 3]
    across = legs[:, 0] - legs[:, 1]
    facing = np.unwrap(np.arctan2(-across[:, 0], across[:, 1]))
    scene = bpy.context.scene
    units, rate = units_per_metre(scene) / options.units, options.rate or frames_per_second(scene)
    place, yaw = compute_root_path(legs.mean(axis=1)[:, :2] / units, facing, rate,
                                   "straight" if options.root == "STRAIGHT" else "smooth")
    path = np.tile(np.eye(4), (len(yaw), 1, 1))
    path[:, :3, :3] = quaternion.to_matrix(quaternion.from_up_angle(yaw))
    path[:, :2, 3] = place * units
    inward = np.linalg.inv(sampled.object_matrices)
    root_bone = table.get("root")
    if options.root == "IN_PLACE":
        return table["hips"], root_bone, None, inward @ path[:1] @ np.linalg.inv(path) @ sampled.object_matrices
    if root_bone is not None:
        rest = np.array(rig.data.bones[root_bone].matrix_local)
        return table["hips"], root_bone, inward @ path @ _compute_upright_matrix(rig, table) @ rest, None
    messages.append(f"no root bone on the armature: the file has an added one named {name_root_bone(rig)!r}")
    return table["hips"], None, inward @ path @ _compute_upright_matrix(rig, table), None


def _compute_upright_matrix(rig: bpy.types.Object, table: dict[str, str]) -> np.ndarray:
    """Compute the matrix (4, 4) from the armature's space at rest to a body over the origin, facing +X."""
    heads = {part: np.array(rig.data.bones[table[part]].head_local) for part in bone_maps.LEGS}
    axes, out = compute_upright_axes(heads), np.eye(4)
    hips, up = 0.5 * (heads["left upper_leg"] + heads["right upper_leg"]), axes[2]
    turn = out[:3, :3] = axes * np.cbrt(abs(np.linalg.det(np.array(rig.matrix_world.to_3x3()))))
    out[:3, 3] = -turn @ (hips - (hips @ up) * up)
    return out
