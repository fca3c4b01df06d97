"""What a scene's units and frames mean: metres and seconds (also on a track's clock), Blender units and frames.

The scene decides. Nothing here, and nothing that asks here, changes a scene's frame rate or unit scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Clock:
    """On frame `start_frame` the clock shows `start_time` seconds; `fps` frames go by in a second."""

    start_frame: float
    start_time: float
    fps: float

    def frame(self, seconds: float) -> float:
        """The (fractional) frame at which the clock shows `seconds`."""
        return self.start_frame + (seconds - self.start_time) * self.fps

    def whole(self, seconds: float) -> int:
        """The whole frame nearest to `seconds`."""
        return nearest_frame(self.frame(seconds))

    def seconds(self, frame: float) -> float:
        """What the clock shows on a frame, to the microsecond, so that it reads well; `whole` leads back."""
        return round(self.start_time + (frame - self.start_frame) / self.fps, 6)

    def spelled(self) -> str:
        """As text, exact; `read` leads back."""
        return f"{self.start_frame!r} {self.start_time!r} {self.fps!r}"

    @classmethod
    def read(cls, text: str) -> "Clock | None":
        """The clock that `spelled` has written; None for an empty text."""
        return cls(*map(float, text.split())) if text else None


def scene_clock(scene: bpy.types.Scene) -> Clock:
    """The clock that the scene's settings set against its frames."""
    settings = scene.beyond_mocap
    return Clock(float(settings.start_frame), float(settings.start_time), float(frames_per_second(scene)))


def nearest_frame(frame: float) -> int:
    """The whole frame nearest to a fractional one; halves go up, for negative ones too."""
    return math.floor(frame + 0.5)
