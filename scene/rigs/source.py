"""The motion that an armature plays: its action, or what its NLA strips come to."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from . import armature


@dataclass(frozen=True, eq=False)
class Source:
    """A motion that a body plays, in metres at the scene's rate from scene frame `start`.

    standing (T, 2) bool: feet on the ground as the take carries it; None where only the motion itself can tell.
    """

    motion: Motion
    start: int
    name: str
    standing: np.ndarray | None = None


def source_of(body: bpy.types.Object | None, scene: bpy.types.Scene, standing=None) -> Source:
    """The motion that an armature plays: its action, or, with NLA strips, what these come to.

    standing: function (frames) -> (F, 2) bool of a take, None where there is none.
    """
    if body is None or body.type != "ARMATURE":
        raise InputError("bake to rig", "no motion", "a player with a result or an armature with an action",
                         "synthesize and accept first")
    data = body.animation_data
    strips = [strip for track in (data.nla_tracks if data and data.use_nla else ()) if not track.mute
              for strip in track.strips if not strip.mute]
    playing, _ = channels.playing(body)
    if playing is None and not strips:
        raise InputError(f"armature {body.name}", "it plays no action", "an armature that moves",
                         "synthesize and accept first, or choose another source")
    if strips:
        first, last = _extent(body, strips)
        motion, start, name = evaluated(body, scene, np.arange(first, last + 1)), first, strips[0].name
    else:
        motion, start, name = action.read(body, scene), action.first_frame(body), playing.name
    frames = start + np.arange(len(motion))
    return Source(motion, start, name, None if standing is None else standing(frames))


def _extent(body: bpy.types.Object, strips) -> tuple[int, int]:
    ends = [(strip.frame_start, strip.frame_end) for strip in strips]
    if action.first_frame(body) is not None:
        playing, slot = channels.playing(body)
        ends.append(channels.keyed_range(channels.curves(playing, slot)))
    return int(np.ceil(min(a for a, _ in ends))), int(np.floor(max(b for _, b in ends)))


def evaluated(body: bpy.types.Object, scene: bpy.types.Scene, frames: np.ndarray) -> Motion:
    """The motion that Blender shows on an armature at these frames: NLA, constraints and all."""
    skeleton = armature.skeleton_of(body, scene)
    rest = armature.rest_rotations(body, skeleton.names)
    now, subframe, rows = scene.frame_current, scene.frame_subframe, []
    for frame in frames:
        scene.frame_set(int(frame))
        rows.append([np.array(body.matrix_world @ body.pose.bones[name].matrix) for name in skeleton.names])
    scene.frame_set(now, subframe=subframe)
    poses = np.array(rows)
    turn = poses[:, :, :3, :3] / np.linalg.norm(poses[:, :, :3, :3], axis=2, keepdims=True)
    world = quaternion.multiply(quaternion.from_matrix(turn), quaternion.inverse(rest))
    local = world.copy()
    parents = list(skeleton.parents[1:])
    local[:, 1:] = quaternion.multiply(quaternion.inverse(world[:, parents]), world[:, 1:])
    return Motion(skeleton, poses[:, 0, :3, 3] / units_per_metre(scene), local, frames_per_second(scene))
