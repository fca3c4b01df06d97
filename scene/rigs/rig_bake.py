"""Baking a motion onto the user's own rig: retargeted, feet planted with its legs, and written to its controls as one
action.

The rig's driven bones become a skeleton of the core (`rigs.driven`); the core retargets the motion (`retarget`) and
plants the feet (`foot_plant`, both in `rigs.fit`); `rigs.controls` converts the resulting pose to channels. The baked
action stores the rig's previous state, and with which keys it was baked.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...beyond_mocap.base.digest import hex_digest
from ...beyond_mocap.base.errors import InputError, format_count
from ..core import channels
from ..path_editing import edited_bodies
from .bone_curves import build_bone_curves, build_setting_curves, compute_bone_poses
from .control_study import CHANNELS
from .controls import PREVIOUS_STATE, read_previous_state
from .driven import DrivenRig
from .fit import BakeOptions, FittedMotion, Slide, SourceMotion

_REPORTED_DISTANCE = 1e-3  # metres from which a deviation is reported
MARK = "beyond_mocap_rig"
KEYS = "beyond_mocap_keys"  # digest of the baked keys: if it differs, the user has edited them
BAKE_PROPERTIES = (MARK, PREVIOUS_STATE, KEYS)  # custom properties of a bake that can be removed


@dataclass
class BakeResult:
    """The result of a bake.

    Attributes:
        action: the new action.
        frames: (F,) scene frames.
        scale: legs of the rig relative to the source's.
        slides: of the source, of the rig before and after planting.
        messages: messages for the user.
    """

    action: bpy.types.Action
    frames: np.ndarray
    scale: float
    slides: tuple[Slide, Slide, Slide]
    messages: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class PreparedBake:
    """A motion prepared for a rig that is still unchanged.

    Attributes:
        name: of the source.
        driven: the rig.
        fit: the motion on its skeleton.
        frames: (F,) scene frames.
        curves: as for `channels.create_action`.
        heads: (F, B, 3) of the driven bones, armature space.
        messages: messages for the user.
    """

    name: str
    driven: DrivenRig
    fit: FittedMotion
    frames: np.ndarray
    curves: dict
    heads: np.ndarray
    messages: list[str]


def prepare_bake(
    rig: bpy.types.Object, table: dict[str, str], source: SourceMotion, scene: bpy.types.Scene, options: BakeOptions
) -> PreparedBake:
    """Prepare a bake of `source` onto the rig's bones; InputError where the map or the rig cannot be used."""
    driven = DrivenRig(rig, table, scene, options.bakes_ik)
    fit = FittedMotion(driven, source, options)
    frames = source.start + np.arange(len(source.motion))
    turns, places, messages = compute_bone_poses(driven, fit.motion, frames, options.root)
    basis, heads = driven.controls.compute_channels(turns, places)
    curves = build_bone_curves(rig, basis) | build_setting_curves(driven, options.bakes_ik)
    return PreparedBake(source.name, driven, fit, frames=frames, curves=curves, heads=heads,
                        messages=[*_describe_rig(driven, options), *messages, *fit.messages])


def apply_bake(prepared: PreparedBake) -> BakeResult:
    """Apply a prepared bake to its rig as a new action."""
    rig, driven = prepared.driven.rig, prepared.driven
    reverted = edited_bodies.revert_path_edits(rig)
    previous_state, kept_messages = record_previous_state(rig, driven), keep_edited_bake(rig)
    channels.remove_marked_action(rig, MARK)
    action = channels.create_action(rig, f"{prepared.name} on {rig.name}", prepared.frames, prepared.curves)
    action[MARK], action[PREVIOUS_STATE] = True, json.dumps(previous_state)
    record_keys(rig)
    for switch in driven.controls.switches:
        rig.pose.bones[switch.bone][switch.name] = switch.value
    _restore_influences(rig, previous_state)
    messages = [*reverted, *prepared.messages, *kept_messages, *_describe_deviation(driven, prepared.frames,
                                                                                    prepared.heads, driven.scene)]
    return BakeResult(action, prepared.frames, prepared.fit.scale, prepared.fit.slides, messages)


def _describe_rig(driven: DrivenRig, options: BakeOptions) -> list[str]:
    """Describe what the user has to know about this rig."""
    lines = []
    if driven.controls.switches:
        names = sorted({switch.name for switch in driven.controls.switches})
        lines.append(f"set to FK on {format_count(len(driven.controls.switches), 'bone')}: {', '.join(names)}")
    if driven.overrides and not options.bakes_ik:
        names = ", ".join(f"{one.bone} ({one.kind})" for one in driven.overrides[:4])
        lines.append(f"{format_count(len(driven.overrides), 'constraint')} switched off (influence 0): {names}")
    if driven.followers:
        lines.append(f"IK targets baked too: {', '.join(driven.followers)}")
    bones = driven.rig.pose.bones
    scaled = [bone for bone in driven.table.values() if max(abs(one - 1.0) for one in bones[bone].scale) > 1e-3]
    if scaled:
        lines.append(f"{', '.join(scaled[:4])}: scaled in the pose, so the rig misses its computed positions")
    locked = [bone for part, bone in driven.table.items()
              if any(bones[bone].lock_rotation) or part in ("hips", "root") and any(bones[bone].lock_location)]
    if locked:
        lines.append(f"locked channels were keyed on {', '.join(locked[:4])}")
    if driven.controls.unreliable:
        lines.append(f"{', '.join(driven.controls.unreliable[:4])}: carried by more than one bone, may be inaccurate")
    return lines


def _describe_deviation(driven: DrivenRig, frames: np.ndarray, heads: np.ndarray, scene: bpy.types.Scene) -> list[str]:
    """Describe where Blender poses the rig differently from the computed pose, checked on a few frames."""
    now, subframe, worst, where = scene.frame_current, scene.frame_subframe, 0.0, ""
    for i in np.unique(np.linspace(0, len(frames) - 1, 4).astype(int)):
        scene.frame_set(int(frames[i]))
        for number, bone in enumerate(driven.controls.bones):
            matrix = np.array(driven.rig.pose.bones[bone].matrix)
            off = float(np.linalg.norm(matrix[:3, 3] - heads[i, number])) * driven.placement.scale
            if off > worst:
                worst, where = off, bone
    scene.frame_set(now, subframe=subframe)
    if worst > _REPORTED_DISTANCE:
        return [f"{where} is up to {1000 * worst:.0f} mm from its computed position; check the rig's constraints"]
    return []


def record_previous_state(rig: bpy.types.Object, driven: DrivenRig) -> dict:
    """Record the rig's state for `remove_bake`; what an earlier bake that is still on has recorded is kept."""
    playing, slot = channels.find_playing_action(rig)
    bones = rig.pose.bones
    now = {
        "action": playing.name if playing else "", "slot": slot.identifier if slot else "",
        "bones": {name: {c: list(getattr(bones[name], c)) for c in CHANNELS} for name in driven.controls.bones},
        "switches": [[s.bone, s.name, s.before] for s in driven.controls.switches],
        "constraints": [[o.bone, o.constraint, bones[o.bone].constraints[o.constraint].influence]
                        for o in driven.overrides],
    }
    earlier = read_previous_state(rig)
    if not earlier:
        return now
    known = {(bone, name) for kind in ("switches", "constraints") for bone, name, _ in earlier[kind]}
    return {**earlier, "bones": now["bones"] | earlier["bones"],
            **{kind: earlier[kind] + [row for row in now[kind] if (row[0], row[1]) not in known]
               for kind in ("switches", "constraints")}}


def record_keys(rig: bpy.types.Object) -> None:
    """Record the keys of the action that the rig plays as the baked ones."""
    channels.find_playing_action(rig)[0][KEYS] = _compute_key_digest(rig)


def has_baked_keys(rig: bpy.types.Object) -> bool:
    """Whether the keys of the baked action that the rig plays are unchanged."""
    return channels.find_playing_action(rig)[0].get(KEYS) == _compute_key_digest(rig)


def _compute_key_digest(rig: bpy.types.Object) -> str:
    parts: list = []
    for place, curve in sorted(channels.collect_curves(*channels.find_playing_action(rig)).items()):
        points = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get("co", points)
        parts += [repr(place), points]
    return hex_digest(*parts, digits=64)


def keep_edited_bake(rig: bpy.types.Object) -> list[str]:
    """Keep a baked action with edited keys as the user's own; returns a message about it."""
    playing, _ = channels.find_playing_action(rig)
    if playing is None or not playing.get(MARK) or has_baked_keys(rig):
        return []
    for name in (MARK, PREVIOUS_STATE, KEYS):
        if name in playing:
            del playing[name]
    return [f"the previous bake has edited keys and is kept as the action {playing.name}"]


def remove_bake(rig: bpy.types.Object) -> None:
    """Remove a baked action from a rig and the file and restore the rig's state; InputError where it plays none."""
    playing, _ = channels.find_playing_action(rig) if rig is not None else (None, None)
    if playing is None or not playing.get(MARK):
        raise InputError(f"rig {rig.name if rig else ''}", "plays no baked action", "a baked rig",
                         "press Bake to Rig first")
    channels.check_editable(rig)
    before = json.loads(playing.get(PREVIOUS_STATE, "{}"))
    rig.animation_data.action = None
    if playing.users - playing.use_fake_user == 0:
        bpy.data.actions.remove(playing)
    for name, values in before.get("bones", {}).items():
        for channel, value in values.items():
            if name in rig.pose.bones:
                setattr(rig.pose.bones[name], channel, value)
    for bone, name, value in before.get("switches", []):
        if bone in rig.pose.bones:
            rig.pose.bones[bone][name] = value
    _restore_influences(rig, before)
    found = bpy.data.actions.get(before.get("action", ""))
    if found is not None:
        slot = next((slot for slot in found.slots if slot.identifier == before.get("slot")), None)
        channels.assign_action(rig, found, slot)


def _restore_influences(rig: bpy.types.Object, state: dict) -> None:
    """Restore the influences of constraints that a bake has switched off."""
    for bone, name, value in state.get("constraints", []):
        if bone in rig.pose.bones and name in rig.pose.bones[bone].constraints:
            rig.pose.bones[bone].constraints[name].influence = value
