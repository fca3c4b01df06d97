"""What a baked action remembers: how the rig was before, and with which keys it was baked."""

from __future__ import annotations

import json

import bpy
import numpy as np

from ...beyond_mocap.base.digest import hex_digest
from ...beyond_mocap.base.errors import InputError
from ..core import channels
from .driven import Driven
from .posing import CHANNELS

MARK = "beyond_mocap_rig"
BEFORE = "beyond_mocap_before"
KEYS = "beyond_mocap_keys"
"""Digest of the keys that were baked: with others somebody has worked on them."""


def remembered(rig: bpy.types.Object, driven: Driven) -> dict:
    """How the rig was before, for `remove`; what an earlier bake remembered where it is still on."""
    playing, slot = channels.playing(rig)
    if playing is not None and playing.get(MARK) and BEFORE in playing:
        return json.loads(playing[BEFORE])
    bones = rig.pose.bones
    return {
        "action": playing.name if playing else "", "slot": slot.identifier if slot else "",
        "bones": {name: {c: list(getattr(bones[name], c)) for c in CHANNELS} for name in driven.controls.bones},
        "switches": [[s.bone, s.name, s.before] for s in driven.controls.switches],
        "constraints": [[o.bone, o.constraint, bones[o.bone].constraints[o.constraint].influence]
                        for o in driven.overrides],
    }


def note(rig: bpy.types.Object) -> None:
    """Remember the keys of the action that the rig plays as those that were baked."""
    channels.playing(rig)[0][KEYS] = _digest(rig)


def is_as_baked(rig: bpy.types.Object) -> bool:
    """Whether nobody has changed the keys of the baked action that the rig plays."""
    return channels.playing(rig)[0].get(KEYS) == _digest(rig)


def _digest(rig: bpy.types.Object) -> str:
    parts: list = []
    for place, curve in sorted(channels.curves(*channels.playing(rig)).items()):
        points = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get("co", points)
        parts += [repr(place), points]
    return hex_digest(*parts, digits=64)


def keep_own(rig: bpy.types.Object) -> list[str]:
    """A baked action on which somebody has worked is the user's own from now on; a line about it."""
    playing, _ = channels.playing(rig)
    if playing is None or not playing.get(MARK) or is_as_baked(rig):
        return []
    for name in (MARK, BEFORE, KEYS):
        if name in playing:
            del playing[name]
    return [f"keys of the bake before were changed by hand: it is kept as the action {playing.name}"]


def remove(rig: bpy.types.Object) -> None:
    """Take a baked action off a rig and out of the file; the rig is as before. InputError where it plays none."""
    playing, _ = channels.playing(rig) if rig is not None else (None, None)
    if playing is None or not playing.get(MARK):
        raise InputError(f"rig {rig.name if rig else ''}", "it plays no action that was baked here", "a baked rig",
                         "Bake to Rig first")
    channels.check_free(rig)
    before = json.loads(playing.get(BEFORE, "{}"))
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
    for bone, name, value in before.get("constraints", []):
        if bone in rig.pose.bones and name in rig.pose.bones[bone].constraints:
            rig.pose.bones[bone].constraints[name].influence = value
    found = bpy.data.actions.get(before.get("action", ""))
    if found is not None:
        slot = next((slot for slot in found.slots if slot.identifier == before.get("slot")), None)
        channels.assign(rig, found, slot)
