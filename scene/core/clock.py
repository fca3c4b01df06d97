"""Seconds on a track's clock against frames of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

from .measure import frames_per_second


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


def of_scene(scene: bpy.types.Scene) -> Clock:
    """The clock that the scene's settings set against its frames."""
    settings = scene.beyond_mocap
    return Clock(float(settings.start_frame), float(settings.start_time), float(frames_per_second(scene)))


def nearest_frame(frame: float) -> int:
    """The whole frame nearest to a fractional one; halves go up, for negative ones too."""
    return math.floor(frame + 0.5)
