"""Pins of the ball: its trajectory is moved so that it goes through a place at a key moment.

    pins = assign_ball_pins(plan.pins, timeline)
    ball = lead_ball_to_pins(times, ball, pins.values(), list_key_times(timeline))

A pin belongs to the key moment nearest to it, within KEY_REACH, and acts when that is played; without one it has no
effect. The ball is shifted by the same for a moment around it, and eased back to its own trajectory within
FADE_SECONDS, or at the next touch if that is earlier. That is where the body looks for the ball and meets it; a solved
ball is then led from touch to touch as ever (`resolved_touches.apply_trajectory`), so that it keeps rolling or flying.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..annotation import KeyMoment, Timeline
from ..annotation.ball_contact import find_striking_part
from ..motion.track import BALL_RADIUS
from .construct.contact_geometry import ease_around
from .pin import BALL, Pin

FADE_SECONDS = 0.6
"""Seconds before and after a pin within which the ball is back on its own trajectory."""

KEY_REACH = 0.2
"""Seconds from a key moment within which a pin belongs to it."""

SAME_TOUCH = 0.1
"""Seconds from a pin within which a touch is the pinned one."""

_WHOLE = 0.05  # s before and after a pin in which the ball has its whole shift: the frames around the touch


def list_ball_keys(timeline: Timeline) -> list[KeyMoment]:
    """List the key moments at which the body meets the ball."""
    return [key for key in timeline.keys if find_striking_part(key.words) and not key.misses_ball]


def list_key_times(timeline: Timeline) -> list[float]:
    """List the seconds at which the key moments with the ball are played."""
    return [key.resolved_time for key in list_ball_keys(timeline)]


def assign_ball_pins(pins: Iterable[Pin], timeline: Timeline) -> dict[Pin, Pin]:
    """Assign each pin of the ball to the key moment nearest to it.

    Args:
        pins: of all parts.
        timeline: the annotations, with key moments at the touches that they mean.
    Returns:
        The pins that have a key moment, no two the same one -> the pin when that is played, not in the ground.
    """
    ball_pins, keys = [pin for pin in pins if pin.part == BALL], list_ball_keys(timeline)
    pairs = [(min(abs(pin.time - key.time), abs(pin.time - key.resolved_time)), number, row)
             for number, pin in enumerate(ball_pins) for row, key in enumerate(keys)]
    moments: dict[int, int] = {}
    for away, number, row in sorted(pairs):
        if away <= KEY_REACH and number not in moments and row not in moments.values():
            moments[number] = row
    return {ball_pins[number]: _play_pin(ball_pins[number], keys[row]) for number, row in sorted(moments.items())}


def _play_pin(pin: Pin, key: KeyMoment) -> Pin:
    """Move a pin to the time at which its key moment is played, and out of the ground."""
    x, y, z = pin.position
    return replace(pin, time=key.resolved_time, position=(x, y, max(z, BALL_RADIUS)))


def lead_ball_to_pins(times: np.ndarray, ball: np.ndarray, pins: Iterable[Pin], fixed: Sequence[float]) -> np.ndarray:
    """Lead the ball's trajectory through its pins, each at the frame nearest to it.

    Args:
        times: (T,) s, at an even rate.
        ball: (T, 3) m, NaN where it is unknown.
        pins: when they are played; those outside the times and where the ball is unknown have no effect.
        fixed: s of all touches; none but the pinned ones move.
    Returns:
        (T, 3) m; the same array without pins.
    """
    out = ball
    for pin in pins:
        frame = find_pinned_frame(times, pin)
        if frame is None or not np.isfinite(ball[frame]).all():
            continue
        stops = [second for second in fixed if abs(second - pin.time) > SAME_TOUCH]
        low = max([pin.time - FADE_SECONDS, *(second for second in stops if second < pin.time)])
        high = min([pin.time + FADE_SECONDS, *(second for second in stops if second > pin.time)])
        share = ease_around(times, low, max(pin.time - _WHOLE, low), min(pin.time + _WHOLE, high), high)
        lowest = np.minimum(out[:, 2], pin.position[2])
        out = out + share[:, None] * (np.asarray(pin.position) - ball[frame])
        out[:, 2] = np.maximum(out[:, 2], lowest)
        out[frame] = pin.position
    return out


def find_pinned_frame(times: np.ndarray, pin: Pin) -> int | None:
    """Find the frame nearest to a pin; None if the pin is more than half a frame outside the times (T,) s."""
    frame = int(np.argmin(np.abs(times - pin.time)))
    half = 0.5 * float(times[1] - times[0]) if len(times) > 1 else 0.0
    return frame if abs(float(times[frame]) - pin.time) <= half + 1e-9 else None
