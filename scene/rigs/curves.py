"""The curves of a bake: a pose as channels of the driven bones, switches and constraints as keys of their own."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from .driven import Driven


def bone_curves(rig: bpy.types.Object, basis: dict) -> dict[str, tuple[str, np.ndarray]]:
    """Curves for the driven bones' channels, each bone in its own rotation mode."""
    found = {}
    for name, (rotation, location) in basis.items():
        path = f'pose.bones["{bpy.utils.escape_identifier(name)}"]'
        mode = rig.pose.bones[name].rotation_mode
        if location is not None:
            found[f"{path}.location"] = (name, location)
        if mode == "QUATERNION":
            if rotation[0, 0] < 0:
                rotation = -rotation
            found[f"{path}.rotation_quaternion"] = (name, rotation)
        elif mode == "AXIS_ANGLE":
            found[f"{path}.rotation_axis_angle"] = (name, _axis_angles(rotation))
        else:
            found[f"{path}.rotation_euler"] = (name, _euler_curves(rotation, mode))
    return found


def _axis_angles(rotation: np.ndarray) -> np.ndarray:
    """Angle and axis (F, 4) of sign-continuous rotations (F, 4)."""
    length = np.linalg.norm(rotation[:, 1:], axis=1)
    axis = np.where(length[:, None] > 1e-9, rotation[:, 1:] / np.maximum(length, 1e-9)[:, None], [0.0, 1.0, 0.0])
    return np.column_stack([2.0 * np.arctan2(length, rotation[:, 0]), axis])


def _euler_curves(rotation: np.ndarray, mode: str) -> np.ndarray:
    """Blender's Euler angles (F, 3), X Y Z, of rotations (F, 4), without jumps: of the two ways to write a rotation the
    one nearer to the frame before, full turns added."""
    order = mode[::-1]  # Blender names the axes in the order in which they are applied to a point
    angles = quaternion.to_euler(rotation, order)
    out = np.empty_like(angles)
    last = np.zeros(3)
    for frame, first in enumerate(angles):
        other = np.array([first[0] + np.pi, np.pi - first[1], first[2] + np.pi])
        choices = [a - 2.0 * np.pi * np.round((a - last) / (2.0 * np.pi)) for a in (first, other)]
        last = min(choices, key=lambda a: np.abs(a - last).sum())
        out[frame] = last
    found = np.empty_like(out)
    for column, letter in enumerate(order):
        found[:, "XYZ".index(letter)] = out[:, column]
    return found


def setting_curves(driven: Driven, bakes_ik: bool) -> dict[str, tuple[str, np.ndarray]]:
    """Curves of one key each: IK/FK switches, and constraints that are switched off."""
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
