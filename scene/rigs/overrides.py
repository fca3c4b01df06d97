"""What would hold a driven bone against its channels: switches between IK and FK, and constraints."""

from __future__ import annotations

import re
from dataclasses import dataclass

import bpy

_TO_FK, _FROM_FK = re.compile(r"(?i)ik.*fk"), re.compile(r"(?i)fk.*ik")
_FOLLOW = re.compile(r"(?i)follow")


@dataclass(frozen=True)
class Switch:
    """A number on a pose bone that has to stand at `value` for the controls to count."""

    bone: str
    name: str
    value: float
    before: float


@dataclass(frozen=True)
class Override:
    """A constraint that would hold a driven bone against its channels."""

    bone: str
    constraint: str
    kind: str


def list_switches(rig: bpy.types.Object) -> list[Switch]:
    """Numbers on pose bones that choose between IK and FK, or let a bone follow by halves."""
    found = []
    for bone in rig.pose.bones:
        for name, value in bone.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                continue
            if _TO_FK.search(name) or _FROM_FK.search(name):
                whole = type(value)(1 if _TO_FK.search(name) else 0)
            elif _FOLLOW.search(name) and 0.0 < value < 1.0:
                whole = 1.0
            else:
                continue
            found.append(Switch(bone.name, name, whole, value))
    return found


def list_overrides(rig: bpy.types.Object, bones: list[str]) -> list[Override]:
    """Constraints that hold driven bones: those on them, and inverse kinematics below that reach up to them."""
    driven, found = set(bones), []
    for bone in rig.pose.bones:
        for constraint in bone.constraints:
            if constraint.mute or constraint.influence == 0.0:
                continue
            held = {bone.name}
            if constraint.type in {"IK", "SPLINE_IK"}:
                chain = [bone, *bone.parent_recursive]
                length = constraint.chain_count
                held = {one.name for one in (chain[:length] if length else chain)}
            if held & driven:
                found.append(Override(bone.name, constraint.name, constraint.type))
    return found
