"""Conversions between metres, seconds (also on a track's clock), Blender units and frames.

The scene decides; nothing here changes its frame rate or unit scale.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import bpy
import numpy as np


def units_per_metre(scene: bpy.types.Scene) -> float:
    """Return the Blender units in one metre, by the scene's unit scale (used only with a unit system)."""
    settings = scene.unit_settings
    return 1.0 if settings.system == "NONE" else 1.0 / settings.scale_length


def frames_per_second(scene: bpy.types.Scene) -> float:
    """Return the scene's frame rate, for example 23.976 for 24 with a base of 1.001."""
    return scene.render.fps / scene.render.fps_base


def whole_frames(start: float, duration: float, fps: float) -> np.ndarray:
    """Return the whole scene frames (F,) within `duration` seconds from the fractional frame `start`."""
    first, last = np.ceil(start - 1e-4), np.floor(start + duration * fps + 1e-4)
    return np.arange(first, max(first, last) + 1)


class Clock(NamedTuple):
    """A clock that shows `start_time` seconds on frame `start_frame`, at `fps` frames per second."""

    start_frame: float
    start_time: float
    fps: float

    def to_frame(self, seconds: float) -> float:
        """Return the (fractional) frame at which the clock shows `seconds`."""
        return self.start_frame + (seconds - self.start_time) * self.fps

    def to_whole_frame(self, seconds: float) -> int:
        """Return the whole frame nearest to `seconds`."""
        return round_frame(self.to_frame(seconds))

    def to_seconds(self, frame: float) -> float:
        """Return the time on a frame, rounded to the microsecond for display; `to_whole_frame` inverts it."""
        return round(self.start_time + (frame - self.start_frame) / self.fps, 6)

    def to_text(self) -> str:
        """Format the clock as exact text; `from_text` inverts it."""
        return f"{self.start_frame!r} {self.start_time!r} {self.fps!r}"

    @classmethod
    def from_text(cls, text: str) -> "Clock | None":
        """Parse a text of `to_text`; None for an empty one."""
        return cls(*map(float, text.split())) if text else None


def build_scene_clock(scene: bpy.types.Scene) -> Clock:
    """Build the clock of the scene's settings."""
    settings = scene.beyond_mocap
    return Clock(float(settings.start_frame), float(settings.start_time), float(frames_per_second(scene)))


def round_frame(frame: float) -> int:
    """Round to the nearest whole frame; halves go up, for negative frames too."""
    return math.floor(frame + 0.5)
