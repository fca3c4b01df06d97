"""What Blender shows of an armature, frame by frame: constraints, drivers, NLA and parents counted in.

Looked at in a scene of its own, so that the user's scene stays at its frame with its poses as they are, and nothing
else in it has to be worked out for every frame.
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
class Look:
    """F frames of an armature. frames (F,) of the scene; lies (F, 4, 4): the object in the world, units; basis
    (F, 4, 4): its own share of that; bones: their names; poses (F, B, 4, 4) in the armature's space; modes: rotation
    mode of each bone; channels: channel -> (F, B, n); others: data path -> (F, n) of what else was asked for."""

    frames: np.ndarray
    lies: np.ndarray
    basis: np.ndarray
    bones: list[str]
    poses: np.ndarray
    modes: list[str]
    channels: dict[str, np.ndarray]
    others: dict[str, np.ndarray]

    def number(self, bone: str) -> int:
        """A bone's number."""
        return self.bones.index(bone)

    def own(self, bone: int) -> np.ndarray:
        """Rotations (F, 4) of a bone's own channels, whatever its rotation mode."""
        mode = self.modes[bone]
        return turns(mode, self.channels[channel_of(mode)][:, bone])


def channel_of(mode: str) -> str:
    """The channel that counts in a rotation mode."""
    return TURNS.get(mode, "rotation_euler")


def turns(mode: str, values: np.ndarray) -> np.ndarray:
    """Rotations (F, 4) of the values (F, n) of `channel_of` a rotation mode."""
    if mode == "QUATERNION":
        return quaternion.normalized(values)
    if mode == "AXIS_ANGLE":
        return quaternion.about_axis(unit_vectors(values[:, 1:]), values[:, 0])
    order = mode[::-1]  # Blender names the axes in the order in which they are applied to a point
    return quaternion.from_euler(values[:, ["XYZ".index(letter) for letter in order]], order)


@contextmanager
def alone(rig: bpy.types.Object, scene: bpy.types.Scene):
    """A scene in which only the armature (or another object) is, and what it hangs on, at the rate of `scene`; gone
    afterwards. What is switched off or shown at rest is posed meanwhile."""
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


def look(rig: bpy.types.Object, side: bpy.types.Scene, frames: np.ndarray, others: list[str] = ()) -> Look:
    """The armature at scene frames (F,), in the scene `alone`; others: data paths of more properties to note."""
    count, bones = len(frames), [bone.name for bone in rig.pose.bones]
    poses = np.empty((count, len(bones), 4, 4), np.float32)
    lies, basis = np.empty((count, 4, 4)), np.empty((count, 4, 4))
    channels = {name: np.empty((count, len(bones), width), np.float32) for name, width in _WIDTHS.items()}
    more: dict[str, list] = {path: [] for path in others}
    for row, frame in enumerate(frames):
        whole = int(np.floor(frame + 1e-6))
        side.frame_set(whole, subframe=float(np.clip(frame - whole, 0.0, 0.999999)))
        shown = rig.evaluated_get(side.view_layers[0].depsgraph)
        shown.pose.bones.foreach_get("matrix", poses[row].reshape(-1))
        for name, table in channels.items():
            shown.pose.bones.foreach_get(name, table[row].reshape(-1))
        lies[row], basis[row] = np.array(shown.matrix_world), np.array(shown.matrix_basis)
        for path, rows in more.items():
            rows.append(numbers_of(shown.path_resolve(path)))
    modes = [bone.rotation_mode for bone in rig.pose.bones]
    return Look(np.asarray(frames, float), lies, basis, bones=bones, poses=poses.swapaxes(-1, -2).astype(float),
                modes=modes, channels={name: table.astype(float) for name, table in channels.items()},
                others={path: np.array(rows, float).reshape(count, -1) for path, rows in more.items()})


def numbers_of(value) -> list[float]:
    """A property's value as numbers."""
    try:
        return [float(one) for one in value]
    except TypeError:
        return [float(value)]
