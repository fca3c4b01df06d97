"""Motions as actions of an armature, and actions as motions, by time: the scene keeps its frame rate.

A bone's pose is a turn in its own rest frame B, the core's local rotation q one in the armature's frame:
q = B pose B^-1.
Where the armature object is turned by O in the scene, the root takes that turn along: q_root = O B pose B^-1.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.vectors import unit_vectors
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion, at_frames
from ..rigs import armature
from . import channels
from .measure import frames_per_second, whole_frames

PLACED = "beyond_mocap_placement"
"""Custom property of an action: the 16 numbers of the armature's matrix when the motion was written onto it, so that
what is drawn beside the body follows it when it is moved."""


def write(body: bpy.types.Object, motion: Motion, scene: bpy.types.Scene, start: float | None = None,
          name: str | None = None, generated: bool = False) -> bpy.types.Action:
    """Play `motion` on the armature `body`: a new action `name` with a key on every whole scene frame.

    start: scene frame (may be fractional) at which the motion's first frame is played; the scene's first if None. The
    armature needs a bone for every joint. generated: as for `channels.animate`. Returns the action."""
    frames, curves = keyed(body, motion, scene, start)
    action = channels.animate(body, name or f"{body.name} motion", frames, curves, generated)
    action[PLACED] = [number for row in body.matrix_world for number in row]
    return action


def keyed(body: bpy.types.Object, motion: Motion, scene: bpy.types.Scene, start: float | None = None):
    """What `write` writes, as `channels.animate` takes it: whole scene frames (F,), and the values of every curve.

    InputError where the armature cannot play it."""
    channels.check_local(body)
    channels.check_free(body)
    if getattr(body, "beyond_mocap_ride", None) is not None and body.beyond_mocap_ride.on:  # not there for batch.py
        raise InputError(f"armature {body.name}", "its motion rides a path", "an armature that does not",
                         "press Keep or Leave first")
    missing = [joint for joint in motion.skeleton.names if joint not in body.data.bones]
    if missing:
        raise InputError(f"armature {body.name}", f"no bone {', '.join(missing[:3])}", "a bone for every joint")
    fps = frames_per_second(scene)
    start = float(scene.frame_start) if start is None else start
    frames = whole_frames(start, motion.duration, fps)
    root, rotations = at_frames(motion, (frames - start) * (motion.fps / fps))
    lie, rest = armature.placement(body, scene), armature.rest_rotations(body, motion.skeleton.names)
    rotations[:, 0] = quaternion.multiply(quaternion.inverse(lie.rotation), rotations[:, 0])
    pose = quaternion.multiply(quaternion.inverse(rest), quaternion.multiply(rotations, rest))
    pose = quaternion.continuous(pose)
    root_bone = body.data.bones[motion.skeleton.names[0]]
    shift = lie.to_armature(root) - np.array(root_bone.head_local)
    location = quaternion.rotate(quaternion.inverse(rest[0]), shift)
    curves = {_path(root_bone.name, "location"): (root_bone.name, location)}
    for joint, bone in enumerate(motion.skeleton.names):
        body.pose.bones[bone].rotation_mode = "QUATERNION"
        curves[_path(bone, "rotation_quaternion")] = (bone, pose[:, joint])
    return frames, curves


def read(body: bpy.types.Object, scene: bpy.types.Scene, action: bpy.types.Action | None = None, slot=None) -> Motion:
    """The motion that an action plays on the armature `body`, at the scene's frame rate, from first key to last.

    action and slot: those that the armature plays if None. Curves of any rotation mode are read; what has no curve
    stays as it is posed now. Constraints and drivers are not part of an action and not read."""
    if action is None:
        action, slot = channels.playing(body)
    if action is None:
        raise InputError(f"armature {body.name}", "it plays no action", "an action with keys")
    slot = slot or next((s for s in action.slots if s.target_id_type == "OBJECT"), None)
    curves = channels.curves(action, slot) if slot is not None else {}
    ends = channels.keyed_range({key: curve for key, curve in curves.items() if key[0].startswith("pose.bones")})
    if ends is None:
        raise InputError(f"action {action.name}", "no key on any bone", "an action with keys on bones")
    frames = np.arange(ends[0], ends[1] + 1)
    skeleton = armature.skeleton_of(body, scene)
    lie, rest = armature.placement(body, scene), armature.rest_rotations(body, skeleton.names)
    pose = np.stack([_rotation(body.pose.bones[name], curves, frames) for name in skeleton.names], axis=1)
    local = quaternion.multiply(quaternion.multiply(rest, pose), quaternion.inverse(rest))
    local[:, 0] = quaternion.multiply(lie.rotation, local[:, 0])
    root = body.pose.bones[skeleton.names[0]]
    location = _values(root, "location", curves, frames)
    place = np.array(root.bone.head_local) + quaternion.rotate(rest[0], location)
    return Motion(skeleton, lie.to_world(place), local, frames_per_second(scene))


def first_frame(body: bpy.types.Object) -> int | None:
    """The first whole frame on which the armature's action has a key; None where it plays none."""
    action, slot = channels.playing(body)
    ends = channels.keyed_range(channels.curves(action, slot)) if action else None
    return ends[0] if ends else None


def _path(bone: str, name: str) -> str:
    return f'pose.bones["{bpy.utils.escape_identifier(bone)}"].{name}'


def _values(bone: bpy.types.PoseBone, name: str, curves: dict, frames: np.ndarray) -> np.ndarray:
    """A pose bone's property over frames: (F, n)."""
    path, now = _path(bone.name, name), getattr(bone, name)
    columns = [channels.sample(curves[path, i], frames) if (path, i) in curves else np.full(len(frames), value) for i,
               value in enumerate(now)]
    return np.stack(columns, axis=1)


def _rotation(bone: bpy.types.PoseBone, curves: dict, frames: np.ndarray) -> np.ndarray:
    """A pose bone's rotation over frames, whatever its rotation mode: (F, 4)."""
    if bone.rotation_mode == "QUATERNION":
        return quaternion.normalized(_values(bone, "rotation_quaternion", curves, frames))
    if bone.rotation_mode == "AXIS_ANGLE":
        angle, *axis = _values(bone, "rotation_axis_angle", curves, frames).T
        axis = np.stack(axis, axis=1)
        return quaternion.about_axis(unit_vectors(axis), angle)
    # Blender names the axes in the order in which they are applied to a point, the core as nested frames: the reverse
    order = bone.rotation_mode[::-1]
    turns = _values(bone, "rotation_euler", curves, frames)
    return quaternion.from_euler(turns[:, ["XYZ".index(letter) for letter in order]], order)
