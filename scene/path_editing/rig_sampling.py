"""Sample what Blender shows of an armature, frame by frame, with constraints, drivers, NLA and parents.

Sampling uses a scene of its own, so that the user's scene stays at its frame with its poses, and nothing else in it is
evaluated for every frame.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.vectors import unit_vectors
from ...beyond_mocap.motion import quaternion

TURNS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
_WIDTHS = {"location": 3, "rotation_quaternion": 4, "rotation_euler": 3, "rotation_axis_angle": 4, "scale": 3}


@dataclass(frozen=True, eq=False)
class RigSamples:
    """F sampled frames of an armature.

    Attributes:
        frames: (F,) scene frames.
        world_matrices: (F, 4, 4) matrices of the object, Blender units.
        basis: (F, 4, 4) the object's own part of these.
        bones: names.
        poses: (F, B, 4, 4) pose matrices, armature space.
        modes: rotation mode of each bone.
        channels: channel -> (F, B, n) values.
        others: data path -> (F, n) values of other requested properties.
    """

    frames: np.ndarray
    world_matrices: np.ndarray
    basis: np.ndarray
    bones: list[str]
    poses: np.ndarray
    modes: list[str]
    channels: dict[str, np.ndarray]
    others: dict[str, np.ndarray]

    def find_bone(self, bone: str) -> int:
        """Find the index of a bone."""
        return self.bones.index(bone)

    def compute_own_rotations(self, bone: int) -> np.ndarray:
        """Compute the rotations (F, 4) of a bone's own channels, in any rotation mode."""
        mode = self.modes[bone]
        return to_rotations(mode, self.channels[find_rotation_channel(mode)][:, bone])


def find_rotation_channel(mode: str) -> str:
    """Return the rotation channel that a rotation mode uses."""
    return TURNS.get(mode, "rotation_euler")


def to_rotations(mode: str, values: np.ndarray) -> np.ndarray:
    """Convert the values (F, n) of a rotation mode's channel to rotations (F, 4)."""
    if mode == "QUATERNION":
        return quaternion.normalize(values)
    if mode == "AXIS_ANGLE":
        return quaternion.from_axis_angle(unit_vectors(values[:, 1:]), values[:, 0])
    order = mode[::-1]  # Blender names the axes in the order in which they are applied to a point
    return quaternion.from_euler(values[:, ["XYZ".index(letter) for letter in order]], order)


@contextmanager
def create_private_scene(rig: bpy.types.Object, scene: bpy.types.Scene):
    """Create a scene with only this object and what it depends on, at the rate of `scene`; it is removed afterwards.

    Hidden objects, and armatures in rest position, are posed meanwhile.
    """
    side = bpy.data.scenes.new(f"{rig.name} alone")
    hidden, position = rig.hide_viewport, rig.data.pose_position if rig.type == "ARMATURE" else "POSE"
    try:
        if hidden:
            rig.hide_viewport = False
        if position != "POSE":
            rig.data.pose_position = "POSE"
        side.render.fps, side.render.fps_base = scene.render.fps, scene.render.fps_base
        side.unit_settings.system = scene.unit_settings.system
        side.unit_settings.scale_length = scene.unit_settings.scale_length
        side.collection.objects.link(rig)
        yield side
    finally:
        if position != "POSE":
            rig.data.pose_position = position
        if hidden:
            rig.hide_viewport = True
        bpy.data.scenes.remove(side)


def sample_rig(rig: bpy.types.Object, side: bpy.types.Scene, frames: np.ndarray, others: list[str] = ()) -> RigSamples:
    """Sample an armature at scene frames.

    Args:
        rig: the armature.
        side: the scene of `create_private_scene`.
        frames: (F,) scene frames, fractional.
        others: data paths of further properties to sample.
    Returns:
        The samples.
    """
    count, bones = len(frames), [bone.name for bone in rig.pose.bones]
    poses = np.empty((count, len(bones), 4, 4), np.float32)
    world_matrices, basis = np.empty((count, 4, 4)), np.empty((count, 4, 4))
    channels = {name: np.empty((count, len(bones), width), np.float32) for name, width in _WIDTHS.items()}
    more: dict[str, list] = {path: [] for path in others}
    for row, frame in enumerate(frames):
        whole = int(np.floor(frame + 1e-6))
        side.frame_set(whole, subframe=float(np.clip(frame - whole, 0.0, 0.999999)))
        evaluated = rig.evaluated_get(side.view_layers[0].depsgraph)
        evaluated.pose.bones.foreach_get("matrix", poses[row].reshape(-1))
        for name, table in channels.items():
            evaluated.pose.bones.foreach_get(name, table[row].reshape(-1))
        world_matrices[row], basis[row] = np.array(evaluated.matrix_world), np.array(evaluated.matrix_basis)
        for path, rows in more.items():
            rows.append(to_numbers(evaluated.path_resolve(path)))
    modes = [bone.rotation_mode for bone in rig.pose.bones]
    return RigSamples(np.asarray(frames, float), world_matrices, basis, bones=bones,
                      poses=poses.swapaxes(-1, -2).astype(float), modes=modes,
                      channels={name: table.astype(float) for name, table in channels.items()},
                      others={path: np.array(rows, float).reshape(count, -1) for path, rows in more.items()})


def to_numbers(value) -> list[float]:
    """Convert a property's value to a list of numbers."""
    try:
        return [float(one) for one in value]
    except TypeError:
        return [float(value)]
