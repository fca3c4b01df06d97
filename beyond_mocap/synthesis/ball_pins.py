"""Pins of the ball: its trajectory is moved so that it goes through a place at a key moment.

    pins = assign_ball_pins(plan.pins, timeline)
    ball = lead_ball_to_pins(times, ball, pins, list_fixed_times(timeline, touches))

A pin belongs to the key moment nearest to it, and acts when that key moment is played. The ball is shifted by the same
for a moment around it, and eased back to its own trajectory within FADE_SECONDS, or at the next touch if that is
earlier.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..annotation import KeyMoment, Timeline
from ..annotation.ball_contact import find_striking_part
from ..motion.track import BALL_RADIUS
from .construct.contact_geometry import ease_around

if TYPE_CHECKING:
    from .plan import Pin, PlayerTouch

BALL = "ball"

FADE_SECONDS = 0.6
"""Seconds before and after a pin within which the ball is back on its own trajectory."""

KEY_REACH = 0.2
"""Seconds from a key moment within which a pin belongs to it."""

SAME_TOUCH = 0.1
"""Seconds from a pin within which a touch is the pinned one."""

_WHOLE = 0.05  # s before and after a pin in which the ball has its whole shift: the frames around the touch
_LOWEST = (-np.inf, -np.inf, BALL_RADIUS)  # m


def list_ball_keys(timeline: Timeline) -> list[KeyMoment]:
    """List the key moments at which the body meets the ball."""
    return [key for key in timeline.keys if find_striking_part(key.words) and not key.misses_ball]


def list_fixed_times(timeline: Timeline, touches: Iterable[PlayerTouch] = ()) -> list[float]:
    """List the seconds at which a pin of another moment leaves the ball where it is: all its touches."""
    return [*(key.resolved_time for key in list_ball_keys(timeline)), *(touch.time for touch in touches)]


def assign_ball_pins(pins: Iterable[Pin], timeline: Timeline) -> tuple[Pin, ...]:
    """Give each pin of the ball the time at which its key moment is played; one without a key moment keeps its own.

    Args:
        pins: of all parts, in order of time.
        timeline: the annotations, with key moments at the touches that they mean.
    Returns:
        The pins of the ball, no two at one key moment and none in the ground.
    """
    ball_pins, keys = [pin for pin in pins if pin.part == BALL], list_ball_keys(timeline)
    pairs = [(min(abs(pin.time - key.time), abs(pin.time - key.resolved_time)), number, row)
             for number, pin in enumerate(ball_pins) for row, key in enumerate(keys)]
    moments: dict[int, float] = {}
    for away, number, row in sorted(pairs):
        if away <= KEY_REACH and number not in moments and keys[row].resolved_time not in moments.values():
            moments[number] = keys[row].resolved_time
    return tuple(replace(pin, time=moments.get(number, pin.time), position=np.maximum(pin.position, _LOWEST))
                 for number, pin in enumerate(ball_pins))


def lead_ball_to_pins(times: np.ndarray, ball: np.ndarray, pins: Sequence[Pin], fixed: Sequence[float]) -> np.ndarray:
    """Lead the ball's trajectory through its pins, each at the frame nearest to it.

    Args:
        times: (T,) s, at an even rate.
        ball: (T, 3) m, NaN where it is unknown.
        pins: of `assign_ball_pins`; those outside the times and where the ball is unknown have no effect.
        fixed: s at which the ball stays where it is, except within SAME_TOUCH of a pin.
    Returns:
        (T, 3) m; the same array without pins.
    """
    out = ball
    for pin in pins:
        frame = find_pinned_frame(times, pin)
        if frame is None or not np.isfinite(ball[frame]).all():
            continue
        others = [other.time for other in pins if other is not pin]
        stops = [*others, *(second for second in fixed if abs(second - pin.time) > SAME_TOUCH)]
        low = max([pin.time - FADE_SECONDS, *(second for second in stops if second < pin.time)])
        high = min([pin.time + FADE_SECONDS, *(second for second in stops if second > pin.time)])
        share = ease_around(times, low, max(pin.time - _WHOLE, low), min(pin.time + _WHOLE, high), high)
        place = np.maximum(pin.position, _LOWEST)
        out = np.maximum(out + share[:, None] * (place - ball[frame]), _LOWEST)
        out[frame] = place
    return out


def find_pinned_frame(times: np.ndarray, pin: Pin) -> int | None:
    """Find the frame nearest to a pin; None if the pin is more than half a frame outside the times (T,) s."""
    frame = int(np.argmin(np.abs(times - pin.time)))
    half = 0.5 * float(times[1] - times[0]) if len(times) > 1 else 0.0
    return frame if abs(float(times[frame]) - pin.time) <= half + 1e-9 else None
