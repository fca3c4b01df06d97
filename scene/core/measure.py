"""What a scene's units and frames mean: metres and seconds on one side, Blender units and frames on the other.

The scene decides. Nothing here, and nothing that asks here, changes a scene's frame rate or unit scale.
"""

from __future__ import annotations

import bpy
import numpy as np


def units_per_metre(scene: bpy.types.Scene) -> float:
    """Blender units in one metre, by the scene's unit scale (which counts only where a unit system is chosen)."""
    settings = scene.unit_settings
    return 1.0 if settings.system == "NONE" else 1.0 / settings.scale_length


def frames_per_second(scene: bpy.types.Scene) -> float:
    """The scene's frame rate, 23.976 for 24 with a base of 1.001."""
    return scene.render.fps / scene.render.fps_base


def whole_frames(start: float, duration: float, fps: float) -> np.ndarray:
    """The whole scene frames (F,) within `duration` seconds from the fractional frame `start`."""
    first, last = np.ceil(start - 1e-4), np.floor(start + duration * fps + 1e-4)
    return np.arange(first, max(first, last) + 1)
