"""A motion onto somebody's own rig: retargeted, feet planted on its legs, and laid down on its controls as one action.

The rig's driven bones become a skeleton of the core (`rigs.driven`); the core carries the motion over (`retarget`) and
plants the feet (`foot_plant`, both in `rigs.fit`); `rigs.controls` turns the pose that comes out into channels.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..core import channels
from ..path_editing import riders
from .bake_record import BEFORE, MARK, keep_own, note, remembered
from .bone_curves import bone_curves, setting_curves, wanted
from .driven import Driven
from .fit import BakeOptions, Fit, Slide
from .source import Source

_OFF = 1e-3  # metres that are told


@dataclass
class Baked:
    """What came of it. slides: of the source, of the rig before and after planting; told: lines for the user."""

    action: bpy.types.Action
    frames: np.ndarray
    scale: float
    slides: tuple[Slide, Slide, Slide]
    told: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A motion worked out for a rig, which is still as it was: frames (F,) of the scene; curves as `channels.animate`
    takes them; heads (F, B, 3) of the driven bones, in the armature's space; told: lines for the user."""

    name: str
    driven: Driven
    fit: Fit
    frames: np.ndarray
    curves: dict
    heads: np.ndarray
    told: list[str]


def fitted(
    rig: bpy.types.Object, table: dict[str, str], source: Source, scene: bpy.types.Scene, options: BakeOptions
) -> Fitted:
    """`source` on the rig's bones. InputError where the map or the rig does not serve."""
    driven = Driven(rig, table, scene, options.bakes_ik)
    fit = Fit(driven, source, options)
    frames = source.start + np.arange(len(source.motion))
    turns, places, told = wanted(driven, fit.motion, frames, options.root)
    basis, heads = driven.controls.basis(turns, places)
    curves = bone_curves(rig, basis) | setting_curves(driven, options.bakes_ik)
    return Fitted(source.name, driven, fit, frames=frames, curves=curves, heads=heads,
                  told=[*_told(driven, options), *told, *fit.told])


def lay(one: Fitted) -> Baked:
    """Let the rig play what was worked out for it, as a new action."""
    rig, driven = one.driven.rig, one.driven
    left = riders.leave(rig)
    before, kept = remembered(rig, driven), keep_own(rig)
    channels.discard(rig, MARK)
    made = channels.animate(rig, f"{one.name} on {rig.name}", one.frames, one.curves)
    made[MARK], made[BEFORE] = True, json.dumps(before)
    note(rig)
    for switch in driven.controls.switches:
        rig.pose.bones[switch.bone][switch.name] = switch.value
    told = [*left, *one.told, *kept, *_off(driven, one.frames, one.heads, driven.scene)]
    return Baked(made, one.frames, one.fit.scale, one.fit.slides, told)


def _told(driven: Driven, options: BakeOptions) -> list[str]:
    """What the user has to know about this rig."""
    lines = []
    if driven.controls.switches:
        names = sorted({switch.name for switch in driven.controls.switches})
        lines.append(f"set to FK on {len(driven.controls.switches)} bones: {', '.join(names)}")
    if driven.overrides and not options.bakes_ik:
        names = ", ".join(f"{one.bone} ({one.kind})" for one in driven.overrides[:4])
        lines.append(f"{len(driven.overrides)} constraints switched off (influence 0): {names}")
    if driven.followers:
        lines.append(f"IK targets baked too: {', '.join(driven.followers)}")
    bones = driven.rig.pose.bones
    locked = [bone for part, bone in driven.table.items()
              if any(bones[bone].lock_rotation) or part in ("hips", "root") and any(bones[bone].lock_location)]
    if locked:
        lines.append(f"locked channels were keyed all the same on {', '.join(locked[:4])}")
    if driven.controls.loose:
        lines.append(f"{', '.join(driven.controls.loose[:4])}: carried by more than one bone, may be off")
    return lines


def _off(driven: Driven, frames: np.ndarray, heads: np.ndarray, scene: bpy.types.Scene) -> list[str]:
    """A line where Blender poses the rig elsewhere than it was worked out, looked at in a few frames."""
    now, subframe, worst, where = scene.frame_current, scene.frame_subframe, 0.0, ""
    for i in np.unique(np.linspace(0, len(frames) - 1, 4).astype(int)):
        scene.frame_set(int(frames[i]))
        for number, bone in enumerate(driven.controls.bones):
            matrix = np.array(driven.rig.pose.bones[bone].matrix)
            off = float(np.linalg.norm(matrix[:3, 3] - heads[i, number])) * driven.placement.scale
            if off > worst:
                worst, where = off, bone
    scene.frame_set(now, subframe=subframe)
    if worst > _OFF:
        return [f"the rig itself holds {where} up to {1000 * worst:.0f} mm from where it should be (constraints?)"]
    return []
