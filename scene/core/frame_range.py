"""The scene's frame range: a fresh scene gets that of what is imported into it, another one grows."""

from __future__ import annotations

import bpy
import numpy as np

from . import window

FRESH = (1, 250)  # first and last frame of Blender's new files


def fit_range(scene: bpy.types.Scene, last: float, things: list[bpy.types.Object]) -> None:
    """Let the scene end where what was imported ends; a scene that has other animation only grows.

    Args:
        scene: the scene.
        last: scene frame (may be fractional) of the end of what was imported.
        things: the imported objects.
    """
    if (scene.frame_start, scene.frame_end) == FRESH and not _has_other_animation(scene, things):
        _set_end(scene, max(scene.frame_start + 1, int(np.floor(last + 1e-4))))
    extend_range(scene, last)


def extend_range(scene: bpy.types.Scene, last: float) -> None:
    """Extend the scene's frame range to `last`."""
    _set_end(scene, max(scene.frame_end, int(np.floor(last + 1e-4))))


def _set_end(scene: bpy.types.Scene, last: int) -> None:
    """Set the scene's last frame, and show the new range in the timelines."""
    if scene.frame_end != last:
        scene.frame_end = last
        window.show_range(scene)


def _has_other_animation(scene: bpy.types.Scene, things: list[bpy.types.Object]) -> bool:
    """Return whether another object than these plays an action or strips, or is a marker cloud."""
    others = [thing for thing in scene.objects if thing not in things]
    return any(thing.beyond_mocap_cloud.on or thing.animation_data is not None
               and (thing.animation_data.action is not None or len(thing.animation_data.nla_tracks))
               for thing in others)
