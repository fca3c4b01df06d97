"""A pin: a place and a time for a part of the body, for what it looks at, or for the ball."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.errors import InputError

GAZE, BALL = "gaze", "ball"
PARTS = ("left_hand", "right_hand", "left_foot", "right_foot", GAZE, BALL)


@dataclass(frozen=True)
class Pin:
    """A part of the body held at a place, or the ball led through it.

    Attributes:
        time: s on the track's clock from which on it holds.
        part: one of PARTS; hands and feet are pinned by their joint (wrist, ankle), the gaze is turned to the place,
            the ball's centre goes through it (`ball_pins`).
        position: (x, y, z) m, world.
        hold: s for which it holds, 0 for a moment; 0 for the ball.
    Raises:
        InputError: for an unknown part, for NaN or infinite values, and for a ball that holds.
    """

    time: float
    part: str
    position: tuple[float, float, float]
    hold: float = 0.0

    def __post_init__(self):
        if self.part not in PARTS:
            raise InputError("pin", f"part {self.part!r}", f"one of {', '.join(PARTS)}", "correct the part")
        object.__setattr__(self, "time", float(self.time))
        object.__setattr__(self, "hold", float(self.hold))
        object.__setattr__(self, "position", tuple(float(value) for value in self.position))
        if len(self.position) != 3 or not all(map(math.isfinite, (*self.position, self.time, self.hold))):
            found = f"{self.time:g} s, {self.position}, {self.hold:g} s"
            raise InputError("pin", found, "a finite time, position and hold", "correct the pin")
        if self.hold < 0.0:
            raise InputError("pin", f"a hold of {self.hold:g} s", "0 s or more", "correct the pin")
        if self.part == BALL and self.hold:
            raise InputError("pin", f"a hold of {self.hold:g} s", "0 s for the ball, which passes", "correct the pin")

    @property
    def end(self) -> float:
        """Seconds at which the part is released."""
        return self.time + self.hold
