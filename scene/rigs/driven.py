"""A rig's driven bones as a skeleton of the core, upright and facing +X whatever way the rig lies."""

from __future__ import annotations

import re

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.vectors import nearest_axis
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core import channels
from . import armature, bone_maps
from .controls import Controls, list_overrides
from .followers import list_targets


def check(rig: bpy.types.Object | None, source: bpy.types.Object | None = None) -> None:
    """InputError, with what to do, where an object cannot be baked onto."""
    if rig is None or rig.type != "ARMATURE":
        raise InputError("rig", "no armature is chosen", "the rig to bake to", "choose it in the panel or select it")
    where = f"rig {rig.name}"
    if rig == source:
        raise InputError(where, "it is the source itself", "another armature", "choose the rig to bake to")
    if rig.library is not None:
        raise InputError(where, f"it is linked from {rig.library.filepath}", "a rig of this file",
                         "make a library override (Object, Library Override, Make) or append it")
    if rig.override_library is not None and rig.override_library.is_system_override:
        raise InputError(where, "its library override is not editable", "an editable override",
                         "make it editable in the outliner (Library Override, Make Editable)")
    if rig.name not in bpy.context.view_layer.objects or not rig.visible_get():
        raise InputError(where, "it is hidden or excluded", "a visible rig, which Blender poses",
                         "show it in the outliner")
    if rig.mode == "EDIT":
        raise InputError(where, "its bones are being edited", "object or pose mode", "leave edit mode with Tab")
    channels.check_free(rig)


class Driven:
    """A rig's driven bones as a skeleton of the core."""

    def __init__(self, rig: bpy.types.Object, table: dict[str, str], scene: bpy.types.Scene, bakes_ik: bool = False):
        """table: part -> bone name. Raises InputError where the map does not fit."""
        bone_maps.check(rig, table)
        self.rig, self.scene = rig, scene
        self.table = {part: table[part] for part in bone_maps.PARTS if part in table}
        self.placement = armature.placement(rig, scene)
        self.overrides = list_overrides(rig, list(self.table.values()))
        self.followers = list_targets(rig, self.table, self.overrides) if bakes_ik else {}
        bones = [*self.table.values(), *self.followers]
        movers = [self.table["hips"], *([self.table["root"]] if "root" in self.table else []), *self.followers]
        self.controls = Controls(rig, bones, movers, self.overrides)
        self.parts = [part for part in self.table if part != "root"]
        self.rest_turn = dict(zip(bones, self.controls.rest_turn))
        self.rest_place = dict(zip(bones, self.controls.rest_place))
        self.upright = upright_turn({part: self.rest_place[bone] for part, bone in self.table.items()})
        self.skeleton = self._skeleton()
        self.sole = self._sole()

    def bone(self, part: str) -> str:
        """The bone of a part."""
        return self.table[part]

    def heads(self, *parts: str) -> np.ndarray:
        """Places (n, 3) of parts at rest, in the armature's space."""
        return np.array([self.rest_place[self.bone(part)] for part in parts])

    def metres(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors of the armature's space in the core's upright metres."""
        return quaternion.rotate(self.upright, vectors) * self.placement.scale

    def _skeleton(self) -> Skeleton:
        names = [bone_maps.JOINTS[part] for part in self.parts]
        parents, bones = [], list(self.table.values())
        for part in self.parts:
            ride = self.controls.rides[bones.index(self.bone(part))]
            carrier = bones[ride.place_of] if ride.place_of >= 0 else None
            above = [p for p in self.parts if self.bone(p) == carrier]
            parents.append(-1 if part == "hips" else self.parts.index(above[0]) if above else 0)
        heads = self.metres(self.heads(*self.parts))
        offsets = heads - heads[np.maximum(parents, 0)]
        tips = {part: tip for part in self.parts if (tip := self._tip(part, parents)) is not None}
        ends = tuple(self.parts.index(part) for part in tips)
        return Skeleton(tuple(names), tuple(parents), offsets, ends, np.array(list(tips.values())).reshape(-1, 3))

    def _tip(self, part: str, parents: list[int]) -> np.ndarray | None:
        """Where a hand's fingers begin and a foot ends, metres from its joint; None where the rig does not show it."""
        kind = part.partition(" ")[2]
        if kind not in ("hand", "foot", "toe") or self.parts.index(part) in parents:
            return None
        bone = self.rig.data.bones[self.bone(part)]
        fingers = [np.array(child.head_local) for child in bone.children if not re.search(r"(?i)twist|ik", child.name)]
        at = np.array(bone.head_local)
        tip = self.metres((np.mean(fingers, axis=0) if fingers and kind == "hand" else np.array(bone.tail_local)) - at)
        if kind == "hand":
            toward = self.metres(np.subtract(*self.heads(part, f"{part.partition(' ')[0]} lower_arm"))) \
                if f"{part.partition(' ')[0]} lower_arm" in self.table else tip
        else:
            toward = np.array([1.0, 0.0, 0.0])
        length = np.linalg.norm(tip) * np.linalg.norm(toward)
        return tip if length > 1e-9 and tip @ toward > 0.5 * length else None

    def _sole(self) -> float:
        """How high the foremost joint of a foot stands over the floor that the rig stands on at rest, metres."""
        ends = [part for part in ("left toe", "right toe") if part in self.table] or ["left foot", "right foot"]
        level = float(self.metres(self.heads(*ends))[:, 2].min())
        leg = float(np.linalg.norm(self.metres(np.subtract(*self.heads("left upper_leg", "left foot")))))
        if -0.02 * leg <= level <= 0.16 * leg:
            return max(level, 0.0)  # the armature's origin lies on the floor
        tails = [self.metres(np.array(self.rig.data.bones[self.bone(part)].tail_local))[2] for part in ends]
        return float(np.clip(level - min(tails), 0.0, 0.16 * leg))


def upright_turn(heads: dict[str, np.ndarray]) -> np.ndarray:
    """The turn (4,), by quarter turns, that lets a body stand along Z and face +X.

    heads: part -> its place (3,) at rest, in the armature's space; thighs and feet are needed.
    """
    legs = [heads["left upper_leg"], heads["right upper_leg"]]
    up = nearest_axis(np.mean(legs, axis=0) - 0.5 * (heads["left foot"] + heads["right foot"]))
    across = legs[0] - legs[1]
    left = nearest_axis(across - (across @ up) * up)
    return quaternion.from_matrix(np.stack([np.cross(left, up), left, up]))
