"""Convert motions to actions of an armature and back, by time: the scene keeps its frame rate.

A bone's pose is a rotation in its own rest frame B, the core's local rotation q one in the armature's frame: q = B pose
B^-1. Where the armature object is rotated by O in the scene, the root includes that rotation: q_root = O B pose B^-1.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.vectors import unit_vectors
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion, sample_frames
from ..rigs import armature
from . import channels
from .measure import frames_per_second, whole_frames

PLACEMENT = "beyond_mocap_placement"
"""Custom property of an action: the 16 numbers of the armature's matrix when the motion was written, so that overlays
follow the body when it is moved."""


@dataclass(frozen=True, eq=False)
class RestPose:
    """What turns a motion into the keys of an armature; once it is read, no bpy is needed.

    Attributes:
        names: joints, the root first.
        paths: data path of the root's location, then of each joint's rotation.
        placement: of the armature in the scene.
        rotations: (J, 4) at rest, in the armature's space.
        head: (3,) of the root's bone, in the armature's space.
    """

    names: tuple[str, ...]
    paths: tuple[str, ...]
    placement: armature.Placement
    rotations: np.ndarray
    head: np.ndarray

    @staticmethod
    def from_body(body: bpy.types.Object, names: tuple[str, ...], placement: armature.Placement) -> RestPose:
        """Read the rest pose of an armature that has a bone for every name."""
        paths = (_build_path(names[0], "location"), *(_build_path(name, "rotation_quaternion") for name in names))
        return RestPose(names, paths, placement, armature.compute_rest_rotations(body, names),
                        np.array(body.data.bones[names[0]].head_local))

    def build_curves(self, root: np.ndarray, rotations: np.ndarray) -> dict[str, tuple[str, np.ndarray]]:
        """Build the values of every curve, as `channels.create_action` takes them.

        Args:
            root: (F, 3) m, world.
            rotations: (F, J, 4) local rotations.
        Returns:
            Data path -> (bone, values (F, n)).
        """
        rest, local = self.rotations, rotations.copy()
        local[:, 0] = quaternion.multiply(quaternion.inverse(self.placement.rotation), local[:, 0])
        pose = quaternion.unify_signs(quaternion.multiply(quaternion.inverse(rest), quaternion.multiply(local, rest)))
        location = quaternion.rotate(quaternion.inverse(rest[0]), self.placement.to_armature(root) - self.head)
        values = (location, *np.moveaxis(pose, 1, 0))
        return dict(zip(self.paths, zip((self.names[0], *self.names), values)))


def write_motion(body: bpy.types.Object, motion: Motion, scene: bpy.types.Scene, start: float | None = None,
                 name: str | None = None, generated: bool = False) -> bpy.types.Action:
    """Write a motion as a new action with a key on every whole scene frame.

    Args:
        body: an armature with a bone for every joint.
        motion: the motion.
        scene: says frame rate and unit scale.
        start: scene frame (may be fractional) of the motion's first frame; None for the scene's first.
        name: of the action.
        generated: mark the keys, see `channels.create_action`.
    Returns:
        The action.
    Raises:
        InputError: if the armature cannot play the motion.
    """
    frames, curves = build_keys(body, motion, scene, start)
    action = channels.create_action(body, name or f"{body.name} motion", frames, curves, generated)
    action[PLACEMENT] = [number for row in body.matrix_world for number in row]
    return action


def build_keys(body: bpy.types.Object, motion: Motion, scene: bpy.types.Scene, start: float | None = None):
    """Build the keys that `write_motion` writes, as `channels.create_action` takes them.

    Returns:
        Whole scene frames (F,), and the values of every curve.
    Raises:
        InputError: if the armature cannot play the motion.
    """
    channels.check_local(body)
    channels.check_editable(body)
    if getattr(body, "beyond_mocap_ride", None) is not None and body.beyond_mocap_ride.on:  # not there for batch.py
        raise InputError(f"armature {body.name}", "its path is being edited", "an armature without a path edit",
                         "press Apply or Revert first")
    missing = [joint for joint in motion.skeleton.names if joint not in body.data.bones]
    if missing:
        raise InputError(f"armature {body.name}", f"bones missing: {', '.join(missing[:3])}", "a bone for every joint")
    fps = frames_per_second(scene)
    start = float(scene.frame_start) if start is None else start
    frames = whole_frames(start, motion.duration, fps)
    root, rotations = sample_frames(motion, (frames - start) * (motion.fps / fps))
    rest = RestPose.from_body(body, motion.skeleton.names, armature.find_placement(body, scene))
    for bone in motion.skeleton.names:
        body.pose.bones[bone].rotation_mode = "QUATERNION"
    return frames, rest.build_curves(root, rotations)


def read_motion(body: bpy.types.Object, scene: bpy.types.Scene, action: bpy.types.Action | None = None,
                slot=None) -> Motion:
    """Read the motion that an action plays on an armature, at the scene's frame rate, from the first to the last key.

    Curves of any rotation mode are read; what has no curve keeps its present pose. Constraints and drivers are not part
    of an action and are not read.

    Args:
        body: the armature.
        scene: says frame rate and unit scale.
        action: the action; None for the one that the armature plays.
        slot: its slot; None for the first that fits.
    Returns:
        The motion, metres, world.
    Raises:
        InputError: if there is no action or no key on a bone.
    """
    if action is None:
        action, slot = channels.find_playing_action(body)
    if action is None:
        raise InputError(f"armature {body.name}", "it plays no action", "an action with keys")
    slot = slot or next((s for s in action.slots if s.target_id_type == "OBJECT"), None)
    curves = channels.collect_curves(action, slot) if slot is not None else {}
    key_range = channels.find_key_range({key: curve for key, curve in curves.items()
                                         if key[0].startswith("pose.bones")})
    if key_range is None:
        raise InputError(f"action {action.name}", "no key on any bone", "an action with keys on bones")
    frames = np.arange(key_range[0], key_range[1] + 1)
    skeleton = armature.build_skeleton(body, scene)
    placement, rest = armature.find_placement(body, scene), armature.compute_rest_rotations(body, skeleton.names)
    pose = np.stack([_sample_rotation(body.pose.bones[name], curves, frames) for name in skeleton.names], axis=1)
    local = quaternion.multiply(quaternion.multiply(rest, pose), quaternion.inverse(rest))
    local[:, 0] = quaternion.multiply(placement.rotation, local[:, 0])
    root = body.pose.bones[skeleton.names[0]]
    location = _sample_property(root, "location", curves, frames)
    place = np.array(root.bone.head_local) + quaternion.rotate(rest[0], location)
    return Motion(skeleton, placement.to_world(place), local, frames_per_second(scene))


def find_first_frame(body: bpy.types.Object) -> int | None:
    """Find the first whole frame on which the armature's action has a key; None where it plays none."""
    action, slot = channels.find_playing_action(body)
    key_range = channels.find_key_range(channels.collect_curves(action, slot)) if action else None
    return key_range[0] if key_range else None


def _build_path(bone: str, name: str) -> str:
    return f'pose.bones["{bpy.utils.escape_identifier(bone)}"].{name}'


def _sample_property(bone: bpy.types.PoseBone, name: str, curves: dict, frames: np.ndarray) -> np.ndarray:
    """Sample a pose bone's property over frames: (F, n)."""
    path, current = _build_path(bone.name, name), getattr(bone, name)
    columns = [channels.sample_curve(curves[path, i], frames) if (path, i) in curves else np.full(len(frames), value)
               for i, value in enumerate(current)]
    return np.stack(columns, axis=1)


def _sample_rotation(bone: bpy.types.PoseBone, curves: dict, frames: np.ndarray) -> np.ndarray:
    """Sample a pose bone's rotation over frames, in any rotation mode: (F, 4)."""
    if bone.rotation_mode == "QUATERNION":
        return quaternion.normalize(_sample_property(bone, "rotation_quaternion", curves, frames))
    if bone.rotation_mode == "AXIS_ANGLE":
        angle, *axis = _sample_property(bone, "rotation_axis_angle", curves, frames).T
        axis = np.stack(axis, axis=1)
        return quaternion.from_axis_angle(unit_vectors(axis), angle)
    # Blender names the axes in the order in which they are applied to a point, the core as nested frames: reversed
    order = bone.rotation_mode[::-1]
    turns = _sample_property(bone, "rotation_euler", curves, frames)
    return quaternion.from_euler(turns[:, ["XYZ".index(letter) for letter in order]], order)
