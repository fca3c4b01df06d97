"""A rig's driven bones as a skeleton of the core, upright and facing +X whatever the rig's orientation; and the bones
that belong to a part of the body without carrying it: IK targets, poles, helper bones.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.vectors import find_nearest_axis
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core import channels
from . import armature, bone_maps
from .controls import Controls, Override, list_overrides

_TARGET_NAMES = ((re.compile(r"(?i)^(.*:)?(ik_foot|foot_ik)(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "foot"),
                 (re.compile(r"(?i)^(.*:)?(ik_hand|hand_ik)(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "hand"),
                 (re.compile(r"(?i)^(.*:)?toe_ik(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "toe"),
                 (re.compile(r"(?i)^(.*:)?thigh_ik_target(?=[_\-. ]?[lr]$)"), "upper_leg"),
                 (re.compile(r"(?i)^(.*:)?upper_arm_ik_target(?=[_\-. ]?[lr]$)"), "upper_arm"))
_LEFT = re.compile(r"(?i)(l|left)$")
_WHOLE_CHAIN = 99


def check_rig(rig: bpy.types.Object | None, source: bpy.types.Object | None = None) -> None:
    """Check that an object can be baked onto (InputError with the next step).

    Args:
        rig: the target.
        source: the armature whose motion is baked.
    """
    if rig is None or rig.type != "ARMATURE":
        raise InputError("rig", "no armature is chosen", "the rig to bake to", "choose it in the panel or select it")
    where = f"rig {rig.name}"
    if rig == source:
        raise InputError(where, "is the source itself", "another armature", "choose the rig to bake to")
    if rig.library is not None:
        raise InputError(where, f"is linked from {rig.library.filepath}", "a rig of this file",
                         "make a library override (Object, Library Override, Make) or append it")
    if rig.override_library is not None and rig.override_library.is_system_override:
        raise InputError(where, "its library override is not editable", "an editable override",
                         "make it editable in the outliner (Library Override, Make Editable)")
    if rig.name not in bpy.context.view_layer.objects or not rig.visible_get():
        raise InputError(where, "is hidden or excluded", "a visible rig, which Blender poses",
                         "show it in the outliner")
    if rig.data.pose_position == "REST":
        raise InputError(where, "is set to its rest position, in which nothing moves", "pose position",
                         "press Pose Position in the armature's properties")
    if rig.mode == "EDIT":
        raise InputError(where, "its bones are being edited", "object or pose mode", "leave edit mode with Tab")
    channels.check_editable(rig)


class DrivenRig:
    """A rig's driven bones as a skeleton of the core."""

    def __init__(self, rig: bpy.types.Object, table: dict[str, str], scene: bpy.types.Scene, bakes_ik: bool = False):
        """Analyse the rig.

        Args:
            rig: the armature.
            table: part -> bone name.
            scene: of the rig.
            bakes_ik: bake IK targets too.
        Raises:
            InputError: if the map does not fit.
        """
        bone_maps.check_bone_map(rig, table)
        self.rig, self.scene = rig, scene
        self.table = {part: table[part] for part in bone_maps.PARTS if part in table}
        self.placement = armature.find_placement(rig, scene)
        self.overrides = list_overrides(rig, list(self.table.values()))
        self.followers = list_targets(rig, self.table, self.overrides) if bakes_ik else {}
        bones = [*self.table.values(), *self.followers]
        movers = [self.table["hips"], *([self.table["root"]] if "root" in self.table else []), *self.followers]
        self.controls = Controls(rig, bones, movers, self.overrides)
        self.parts = [part for part in self.table if part != "root"]
        self.rest_rotations = dict(zip(bones, self.controls.rest_rotations))
        self.rest_positions = dict(zip(bones, self.controls.rest_positions))
        self.upright = compute_upright_rotation({part: self.rest_positions[bone] for part, bone in self.table.items()})
        self.skeleton = self._build_skeleton()
        self.sole = self._measure_sole()

    def find_bone(self, part: str) -> str:
        """Return the bone of a part."""
        return self.table[part]

    def rest_heads(self, *parts: str) -> np.ndarray:
        """Return the positions (n, 3) of parts at rest, in the armature's space."""
        return np.array([self.rest_positions[self.find_bone(part)] for part in parts])

    def to_metres(self, vectors: np.ndarray) -> np.ndarray:
        """Convert vectors of the armature's space to the core's upright metres."""
        return quaternion.rotate(self.upright, vectors) * self.placement.scale

    def _build_skeleton(self) -> Skeleton:
        """Build the skeleton of the driven parts from their carriers and rest positions."""
        names = [bone_maps.JOINTS[part] for part in self.parts]
        parents, bones = [], list(self.table.values())
        for part in self.parts:
            control = self.controls.carriers[bones.index(self.find_bone(part))]
            carrier = bones[control.position_carrier] if control.position_carrier >= 0 else None
            above = [p for p in self.parts if self.find_bone(p) == carrier]
            parents.append(-1 if part == "hips" else self.parts.index(above[0]) if above else 0)
        heads = self.to_metres(self.rest_heads(*self.parts))
        offsets = heads - heads[np.maximum(parents, 0)]
        tips = {part: tip for part in self.parts if (tip := self._find_tip(part, parents)) is not None}
        ends = tuple(self.parts.index(part) for part in tips)
        return Skeleton(tuple(names), tuple(parents), offsets, ends, np.array(list(tips.values())).reshape(-1, 3))

    def _find_tip(self, part: str, parents: list[int]) -> np.ndarray | None:
        """Find where a hand's fingers begin or a foot ends, metres from its joint; None where the rig does not show it.
        """
        kind = part.partition(" ")[2]
        if kind not in ("hand", "foot", "toe") or self.parts.index(part) in parents:
            return None
        bone = self.rig.data.bones[self.find_bone(part)]
        fingers = [np.array(child.head_local) for child in bone.children if not re.search(r"(?i)twist|ik", child.name)]
        at = np.array(bone.head_local)
        tip = self.to_metres((np.mean(fingers, axis=0) if fingers and kind == "hand" else np.array(bone.tail_local))
                             - at)
        if kind == "hand":
            toward = self.to_metres(np.subtract(*self.rest_heads(part, f"{part.partition(' ')[0]} lower_arm"))) \
                if f"{part.partition(' ')[0]} lower_arm" in self.table else tip
        else:
            toward = np.array([1.0, 0.0, 0.0])
        length = np.linalg.norm(tip) * np.linalg.norm(toward)
        return tip if length > 1e-9 and tip @ toward > 0.5 * length else None

    def _measure_sole(self) -> float:
        """Measure how high the foremost joint of a foot is above the floor of the rig at rest, metres."""
        ends = [part for part in ("left toe", "right toe") if part in self.table] or ["left foot", "right foot"]
        level = float(self.to_metres(self.rest_heads(*ends))[:, 2].min())
        leg = float(np.linalg.norm(self.to_metres(np.subtract(*self.rest_heads("left upper_leg", "left foot")))))
        if -0.02 * leg <= level <= 0.16 * leg:
            return max(level, 0.0)  # the armature's origin is on the floor
        tails = [self.to_metres(np.array(self.rig.data.bones[self.find_bone(part)].tail_local))[2] for part in ends]
        return float(np.clip(level - min(tails), 0.0, 0.16 * leg))


def compute_upright_rotation(heads: dict[str, np.ndarray]) -> np.ndarray:
    """Compute the rotation (4,) of `compute_upright_axes`."""
    return quaternion.from_matrix(compute_upright_axes(heads))


def compute_upright_axes(heads: dict[str, np.ndarray]) -> np.ndarray:
    """Compute the rotation (3, 3), by quarter turns, that makes a body upright along Z and facing +X.

    Args:
        heads: part -> its position (3,) at rest, in the armature's space; thighs and feet are needed.
    Returns:
        (3, 3).
    """
    legs = [heads["left upper_leg"], heads["right upper_leg"]]
    up = find_nearest_axis(np.mean(legs, axis=0) - 0.5 * (heads["left foot"] + heads["right foot"]))
    across = legs[0] - legs[1]
    left = find_nearest_axis(across - (across @ up) * up)
    return np.stack([np.cross(left, up), left, up])


def list_targets(rig: bpy.types.Object, table: dict[str, str], overrides: list[Override]) -> dict[str, str]:
    """List IK targets -> the part they follow, carriers first: of the overriding constraints, and known by name.

    Args:
        rig: the armature.
        table: part -> bone; these bones follow nothing.
        overrides: constraints on driven bones.
    Returns:
        Bone -> part.
    """
    part_of, found = {bone: part for part, bone in table.items()}, {}
    for override in overrides:
        constraint = rig.pose.bones[override.bone].constraints[override.constraint]
        part = part_of.get(override.bone, "")
        if part.partition(" ")[2] in ("lower_leg", "lower_arm"):
            found |= dict(_iter_ik_goals(rig, constraint, part))
    found = dict(_iter_named_targets(rig)) | found
    known = [name for name in found if name in rig.data.bones and found[name] in table and name not in part_of]
    depth = {name: len(rig.data.bones[name].parent_recursive) for name in known}
    return {name: found[name] for name in sorted(known, key=lambda name: (depth[name], name))}


def list_followers(
    rig: bpy.types.Object, controls: dict[str, str], display_bones: dict[str, str], tolerance: float
) -> dict[str, str]:
    """List bones -> the part they belong to: copied bones, targets and poles of inverse kinematics, and known names.

    Args:
        rig: the armature.
        controls, display_bones: part -> the bone that moves it, that displays it.
        tolerance: armature units within which a helper bone rests at a part.
    Returns:
        Bone -> part.
    """
    part_of = {bone: part for table in (controls, display_bones) for part, bone in table.items()}
    trunk, held = _list_trunk_bones(rig, controls), _list_ik_bones(rig)
    found: dict[str, str] = {}
    for bone, constraint in _iter_constraints(rig):
        part = part_of.get(bone.name) or _find_part_at(rig, bone.name, display_bones, tolerance)
        if part is None:
            continue
        led_parts = [(name, end) for name, end in _iter_ik_goals(rig, constraint, part) if end in display_bones]
        if constraint.type.startswith("COPY_") and bone.name in part_of and constraint.subtarget not in held:
            led_parts = [(constraint.subtarget, part)]
        for name, end in led_parts:
            for free in _iter_free_ancestors(rig, name, part_of.keys() | trunk):
                found.setdefault(free, end)
    found |= {name: part for name, part in _iter_named_targets(rig) if part in display_bones}
    return {name: part for name, part in found.items() if name not in part_of}


def _iter_constraints(rig: bpy.types.Object) -> Iterator[tuple[bpy.types.PoseBone, bpy.types.Constraint]]:
    """Iterate over all constraints of the rig's bones that target the rig itself."""
    for bone in rig.pose.bones:
        for constraint in bone.constraints:
            if getattr(constraint, "target", None) == rig:
                yield bone, constraint


def _iter_ik_goals(rig: bpy.types.Object, constraint: bpy.types.Constraint, part: str) -> Iterator[tuple[str, str]]:
    """Iterate over target and pole of inverse kinematics on a part's bone, each with the part that it leads."""
    if constraint.type != "IK" or constraint.target != rig:
        return
    end, upper = _find_limb_ends(part)
    yield constraint.subtarget, end
    if constraint.pole_target == rig and constraint.pole_subtarget:
        yield constraint.pole_subtarget, upper


def _find_limb_ends(part: str) -> tuple[str, str]:
    """Find the end of the limb to which a part belongs, and its upper part."""
    side, kind = part.partition(" ")[::2]
    arm = kind in ("lower_arm", "upper_arm", "hand")
    return (f"{side} hand", f"{side} upper_arm") if arm else (f"{side} foot", f"{side} upper_leg")


def _iter_named_targets(rig: bpy.types.Object) -> Iterator[tuple[str, str]]:
    """Iterate over bones whose names show which part they lead, with the part."""
    for bone in rig.data.bones:
        for pattern, kind in _TARGET_NAMES:
            if pattern.match(bone.name):
                yield bone.name, f"{'left' if _LEFT.search(bone.name) else 'right'} {kind}"


def _list_trunk_bones(rig: bpy.types.Object, controls: dict[str, str]) -> set[str]:
    """List the bones above hips and thighs, which belong to the whole body."""
    parts = [part for part in ("hips", "left upper_leg", "right upper_leg") if part in controls]
    return {bone.name for part in parts for bone in rig.data.bones[controls[part]].parent_recursive}


def _list_ik_bones(rig: bpy.types.Object) -> set[str]:
    """List the bones that inverse kinematics pose."""
    chains = [(bone, one) for bone in rig.pose.bones for one in bone.constraints if one.type in ("IK", "SPLINE_IK")]
    return {
        up.name for bone, one in chains for up in (bone, *bone.parent_recursive[: (one.chain_count or _WHOLE_CHAIN)
                                                                                - 1])
    }


def _find_part_at(rig: bpy.types.Object, name: str, shown: dict[str, str], tolerance: float) -> str | None:
    """Find the part that rests at a helper bone's position."""
    at = rig.data.bones[name].head_local
    return next((part for part, bone in shown.items() if (rig.data.bones[bone].head_local - at).length < tolerance),
                None)


def _iter_free_ancestors(rig: bpy.types.Object, name: str, used: set[str]) -> Iterator[str]:
    """Iterate over a bone and its ancestors up to a used one, except those with constraints."""
    bone = rig.data.bones.get(name)
    while bone is not None and bone.name not in used:
        if len(rig.pose.bones[bone.name].constraints) == 0:
            yield bone.name
        bone = bone.parent
