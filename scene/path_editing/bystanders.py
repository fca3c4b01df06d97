"""Bystanders: bodies of a scene that ride no path, such as kept ones and players; where they are when, for riders to
keep clear of them."""

from __future__ import annotations

from time import perf_counter

import bpy
import numpy as np

from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..rigs.bone_curves import is_carried
from . import rig_look, rig_parts
from .rig_source import Played, playing_strips
from .rigs import carrier_of, rides_as_rig

HIPS = 0.9  # metres that hips are above the ground, about: only whether bodies are on one floor depends on it
_A_SECOND = 5  # looks at a rig
_PATIENCE = 4.0  # seconds for all


def bystanders(context: bpy.types.Context, patience: float = _PATIENCE) -> tuple[list, list[str]]:
    """Followers of the core that cannot be asked to give way: the bodies of players, and all other animated armatures
    that are visible and do not hang on a rider. And a line for each that is left out: for want of time after `patience`
    seconds, or since it cannot be read."""
    begun, found, left = perf_counter(), [], []
    for body in sorted(_bodies(context), key=rides_as_rig):  # the quick ones first
        try:
            found.append(_follower(context.scene, body, begun + patience))
        except BeyondMocapError as error:
            left.append(f"{body.name} is left out: {error}")
    return found, left


def _bodies(context) -> list[bpy.types.Object]:
    scene, layer = context.scene, context.view_layer
    players = {player.body.name for player in scene.beyond_mocap.players if player.body is not None}
    found = [body for body in scene.objects if body.type == "ARMATURE" and not body.beyond_mocap_ride.on]
    return [
        body for body in found
        if _is_animated(body)
        and (body.name in players or body.visible_get(view_layer=layer) and not _hangs_on_rider(body))
    ]  # fmt: skip


def _is_animated(body) -> bool:
    return channels.playing(body)[0] is not None or bool(playing_strips(body))


def _hangs_on_rider(body) -> bool:
    """Whether it shows what a rider does, as a character does that was retargeted from it."""
    constraints = [one for thing in (body, *body.pose.bones) for one in thing.constraints if not one.mute]
    holders = [getattr(one, "target", None) for one in constraints]
    while body.parent is not None:
        body = body.parent
        holders.append(body)
    return any(one is not None and one.type == "ARMATURE" and one.beyond_mocap_ride.on for one in holders)


def _follower(scene, body, until: float):
    """Where its hips are over the ground. InputError past the time `until`."""
    from ...beyond_mocap.path_editing.detour import Follower

    if perf_counter() > until:
        raise _late()
    try:
        if rides_as_rig(body):
            raise InputError(body.name, "a rig")
        read = carrier_of(body).read(scene)
        frames, hips = read.first + np.arange(len(read.motion)), read.motion.root_positions
    except BeyondMocapError:  # it is looked at instead
        frames, hips = _looked_at(scene, body, until)
    if not np.isfinite(hips).all():
        raise InputError("its pose", "a place that is no number", "numbers", "look at its keys")
    return Follower(name=body.name, times=frames / frames_per_second(scene), places=hips - (0.0, 0.0, HIPS))


def _looked_at(scene, body, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Some frames (F,) and its hips (F, 3) on them, metres; the middle of its bones where it has no hips."""
    frames = _frames(scene, body)
    parts = rig_parts.of_rig(body)
    names = [parts.shown["hips"]] if parts else [bone.name for bone in body.data.bones]
    rows = []
    with rig_look.alone(body, scene) as side:
        for frame in frames:
            if perf_counter() > until:
                raise _late()
            side.frame_set(int(frame))
            shown = body.evaluated_get(side.view_layers[0].depsgraph)
            middle = np.mean([shown.pose.bones[name].head[:] for name in names], axis=0)
            rows.append(np.array(shown.matrix_world) @ [*middle, 1.0])
    return frames, np.array(rows)[:, :3] / units_per_metre(scene)


def _frames(scene, body) -> np.ndarray:
    """Whole frames from the first to the last of its motion, about `_A_SECOND`."""
    try:
        played = Played(body, scene).frames
        first, last = int(played[0]), int(played[-1])
    except BeyondMocapError:  # a pose alone
        first = last = scene.frame_start
    if is_carried(body):
        first, last = min(first, scene.frame_start), max(last, scene.frame_end)
    step = max(int(frames_per_second(scene) / _A_SECOND), 1)
    return np.unique([*range(first, last, step), last, last + (first == last)])


def _late() -> InputError:
    found, expected = "too slow to be looked at as well", "a quick one"
    return InputError("its rig", found, expected, "hide what is not needed, or bake its motion")
