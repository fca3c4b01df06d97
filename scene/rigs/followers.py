"""The bones that go with a part of the body although they do not carry it: IK targets, poles, helper bones."""

from __future__ import annotations

import re
from collections.abc import Iterator

import bpy

from .controls import Override

_NAMED = (
    (re.compile(r"(?i)^(.*:)?(ik_foot|foot_ik)(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "foot"),
    (re.compile(r"(?i)^(.*:)?(ik_hand|hand_ik)(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "hand"),
    (re.compile(r"(?i)^(.*:)?toe_ik(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "toe"),
    (re.compile(r"(?i)^(.*:)?thigh_ik_target(?=[_\-. ]?[lr]$)"), "upper_leg"),
    (re.compile(r"(?i)^(.*:)?upper_arm_ik_target(?=[_\-. ]?[lr]$)"), "upper_arm"),
)
_LEFT = re.compile(r"(?i)(l|left)$")
_ENDLESS = 99


def list_targets(rig: bpy.types.Object, table: dict[str, str], overrides: list[Override]) -> dict[str, str]:
    """IK targets -> the part they follow, carriers first: those of the overriding constraints, and those known by name.

    table: part -> bone. Bones of the table itself follow nothing.
    """
    part_of, found = {bone: part for part, bone in table.items()}, {}
    for override in overrides:
        constraint, part = _constraint(rig, override), part_of.get(override.bone, "")
        if part.partition(" ")[2] in ("lower_leg", "lower_arm"):
            found |= dict(_goals(rig, constraint, part))
    found = dict(_named(rig)) | found
    known = [name for name in found if name in rig.data.bones and found[name] in table and name not in part_of]
    depth = {name: len(rig.data.bones[name].parent_recursive) for name in known}
    return {name: found[name] for name in sorted(known, key=lambda name: (depth[name], name))}


def list_followers(
    rig: bpy.types.Object, controls: dict[str, str], shown: dict[str, str], near: float
) -> dict[str, str]:
    """Bones that go with a part -> the part: what its bones copy, targets and poles of its inverse kinematics, and
    known names.

    controls, shown: part -> the bone that moves it, that shows it. near: metres of the armature within which a helper
    bone rests where a part does.
    """
    part_of = {bone: part for table in (controls, shown) for part, bone in table.items()}
    trunk, held = _trunk(rig, controls), _held(rig)
    found: dict[str, str] = {}
    for bone, constraint in _constraints(rig):
        part = part_of.get(bone.name) or _part_at(rig, bone.name, shown, near)
        if part is None:
            continue
        leads = [(name, end) for name, end in _goals(rig, constraint, part) if end in shown]
        if constraint.type.startswith("COPY_") and bone.name in part_of and constraint.subtarget not in held:
            leads = [(constraint.subtarget, part)]
        for name, end in leads:
            for free in _free_above(rig, name, part_of.keys() | trunk):
                found.setdefault(free, end)
    found |= {name: part for name, part in _named(rig) if part in shown}
    return {name: part for name, part in found.items() if name not in part_of}


def _constraint(rig: bpy.types.Object, override: Override) -> bpy.types.Constraint:
    return rig.pose.bones[override.bone].constraints[override.constraint]


def _constraints(rig: bpy.types.Object) -> Iterator[tuple[bpy.types.PoseBone, bpy.types.Constraint]]:
    """All constraints of the rig's bones that aim at the rig itself."""
    for bone in rig.pose.bones:
        for constraint in bone.constraints:
            if getattr(constraint, "target", None) == rig:
                yield bone, constraint


def _goals(rig: bpy.types.Object, constraint: bpy.types.Constraint, part: str) -> Iterator[tuple[str, str]]:
    """Target and pole of inverse kinematics on a part's bone, each with the part that it leads."""
    if constraint.type != "IK" or constraint.target != rig:
        return
    end, upper = _ends(part)
    yield constraint.subtarget, end
    if constraint.pole_target == rig and constraint.pole_subtarget:
        yield constraint.pole_subtarget, upper


def _ends(part: str) -> tuple[str, str]:
    """The end of the limb to which a part belongs, and its upper part."""
    side, kind = part.partition(" ")[::2]
    arm = kind in ("lower_arm", "upper_arm", "hand")
    return (f"{side} hand", f"{side} upper_arm") if arm else (f"{side} foot", f"{side} upper_leg")


def _named(rig: bpy.types.Object) -> Iterator[tuple[str, str]]:
    """Bones whose names say which part they lead, and the part."""
    for bone in rig.data.bones:
        for pattern, kind in _NAMED:
            if pattern.match(bone.name):
                yield bone.name, f"{'left' if _LEFT.search(bone.name) else 'right'} {kind}"


def _trunk(rig: bpy.types.Object, controls: dict[str, str]) -> set[str]:
    """The bones above hips and thighs, which go with the whole body."""
    parts = [part for part in ("hips", "left upper_leg", "right upper_leg") if part in controls]
    return {bone.name for part in parts for bone in rig.data.bones[controls[part]].parent_recursive}


def _held(rig: bpy.types.Object) -> set[str]:
    """The bones that inverse kinematics pose."""
    chains = [(bone, one) for bone in rig.pose.bones for one in bone.constraints if one.type in ("IK", "SPLINE_IK")]
    return {
        up.name for bone, one in chains for up in (bone, *bone.parent_recursive[: (one.chain_count or _ENDLESS) - 1])
    }


def _part_at(rig: bpy.types.Object, name: str, shown: dict[str, str], near: float) -> str | None:
    """The part that rests where a helper bone does."""
    at = rig.data.bones[name].head_local
    return next((part for part, bone in shown.items() if (rig.data.bones[bone].head_local - at).length < near), None)


def _free_above(rig: bpy.types.Object, name: str, taken: set[str]) -> Iterator[str]:
    """A bone and those above it up to one that is taken, but for those with constraints."""
    bone = rig.data.bones.get(name)
    while bone is not None and bone.name not in taken:
        if len(rig.pose.bones[bone.name].constraints) == 0:
            yield bone.name
        bone = bone.parent
