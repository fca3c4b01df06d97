"""Who is on the stage: where the bodies and the ball of a scene are on every frame, read from their keys.

It needs no take of this session, so that cameras find the bodies in a reopened file too.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ..core import channels
from ..core.measure import units_per_metre
from .ball import is_ball


@dataclass(frozen=True, eq=False)
class Cast:
    """Bodies and ball on consecutive frames.

    Attributes:
        frames: (F,) scene frames.
        bodies: the armatures.
        places: (B, F, 3) metres, the bodies' roots; before its first and after its last key a body stands still.
        ball: (F, 3) metres, NaN where it has no keys; None without a moving ball.
    """

    frames: np.ndarray
    bodies: tuple[bpy.types.Object, ...]
    places: np.ndarray
    ball: np.ndarray | None


def read_cast(scene: bpy.types.Scene) -> Cast | None:
    """Read the moving bodies of a scene, and the ball that moves farthest; None where no body moves."""
    paths = {body: path for body in scene.objects if body.type == "ARMATURE" and not body.hide_render
             for path in [_read_root_keys(body)] if path is not None}
    if not paths:
        return None
    first = min(frames[0] for frames, _ in paths.values())
    frames = np.arange(first, max(frames[-1] for frames, _ in paths.values()) + 1)
    units = units_per_metre(scene)
    places = np.stack([_sample_path(path, frames) for path in paths.values()]) / units
    ball = find_ball(scene)
    flight = _read_keys(ball, "location", ball.location) if ball is not None else None
    path = _sample_path(flight, frames, np.nan) / units if flight is not None else np.full((1, 3), np.nan)
    return Cast(frames, tuple(paths), places, path if np.isfinite(path).any() else None)


def find_ball(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the ball with the most keys; None without a moving ball."""
    balls = [(len(path[0]), thing) for thing in scene.objects if is_ball(thing)
             for path in [_read_keys(thing, "location", thing.location)] if path is not None]
    return max(balls, key=lambda pair: pair[0])[1] if balls else None


def _read_root_keys(body: bpy.types.Object) -> tuple[np.ndarray, np.ndarray] | None:
    """Read frames (F,) and world places (F, 3), in Blender units, of the bone that carries the body."""
    bone = _find_root(body)
    if bone is None:
        return _read_keys(body, "location", body.location)
    found = _read_keys(body, f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].location',
                       body.pose.bones[bone.name].location)
    matrix = np.array(body.matrix_world @ bone.matrix_local)
    return found[0], found[1] @ matrix[:3, :3].T + matrix[:3, 3]


def _find_root(body: bpy.types.Object) -> bpy.types.Bone | None:
    """Find the highest bone in the tree of bones whose location is keyed; None where there is none."""
    keyed = {curve.data_path for _, action, slot in _list_actions(body)
             for curve in channels.collect_curves(action, slot).values() if curve.data_path.endswith("].location")}
    bones = [bone for bone in body.data.bones
             if f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].location' in keyed]
    return min(bones, key=lambda bone: len(bone.parent_recursive), default=None)


def _read_keys(thing: bpy.types.Object, path: str, rest) -> tuple[np.ndarray, np.ndarray] | None:
    """Read frames (F,) and values (F, 3) of an animated vector, from the action or the NLA strips; None without keys.

    Strips follow one another; what they blend is not computed.
    """
    pieces = []
    for strip, action, slot in _list_actions(thing):
        curves = {index: curve for (data_path, index), curve in channels.collect_curves(action, slot).items()
                  if data_path == path}
        limits = channels.find_key_range(curves)
        if limits is not None:
            low, high, start, scale = _find_limits(strip, *limits)
            frames = np.arange(low, high + 1)
            at = start + (frames - low) / scale
            pieces.append((frames, np.stack([channels.sample_curve(curves[i], at) if i in curves
                                             else np.full(len(at), rest[i]) for i in range(3)], axis=1)))
    if not pieces:
        return None
    frames, first = np.unique(np.concatenate([frames for frames, _ in pieces]), return_index=True)
    return frames, np.concatenate([values for _, values in pieces])[first]


def _find_limits(strip: bpy.types.NlaStrip | None, low: int, high: int) -> tuple[int, int, float, float]:
    """Find first and last scene frame of a strip, or of an action with keys from `low` to `high`, the action's frame
    at its start, and its scale.
    """
    if strip is None:
        return low, high, float(low), 1.0
    return int(np.ceil(strip.frame_start)), int(strip.frame_end), strip.action_frame_start, strip.scale


def _list_actions(thing: bpy.types.Object) -> list[tuple]:
    """List what an object plays as (strip, action, slot): its action alone (strip None), or its audible NLA strips."""
    action, slot = channels.find_playing_action(thing)
    if action is not None:
        return [(None, action, slot)]
    data = thing.animation_data
    if data is None or not data.use_nla:
        return []
    return [(strip, strip.action, strip.action_slot) for track in data.nla_tracks if not track.mute
            for strip in track.strips if not strip.mute and strip.action is not None and strip.action_slot is not None]


def _sample_path(path: tuple[np.ndarray, np.ndarray], frames: np.ndarray, outside: float | None = None) -> np.ndarray:
    """Interpolate a path (frames, values) at frames (F,): (F, 3); beyond its ends `outside`, or its end values."""
    return np.stack([np.interp(frames, path[0], values, left=outside, right=outside) for values in path[1].T], axis=1)
