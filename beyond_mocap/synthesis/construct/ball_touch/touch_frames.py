"""When the ball is met: touches, and their frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....annotation.ball_contact import build_surfaces
from ....motion.skeleton import Skeleton

SHORTEST_EASE = 0.12
"""Seconds before and after a strike in which the body is eased at least."""

_LONGEST_EASE = 0.5  # s in which it is eased at most


@dataclass(frozen=True)
class Touch:
    """A key moment in which the ball is met.

    Attributes:
        frame: output frame, fractional.
        words: labels of the clip that plays there, sides after mirroring.
        entry: frames before `frame` within which the body may be changed.
        leave: frames after it.
        misses: whether the body reaches for the ball and misses it by design (`near_miss`).
        place: (3,) m of the ball that the body has to meet, None where the ball may move within its noise.
    """

    frame: float
    words: tuple[str, ...]
    entry: float
    leave: float
    misses: bool = False
    place: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class TouchFrames:
    """A touch in frames.

    Attributes:
        words: labels of the clip.
        frame: the nearest frame.
        held: the two frames around it, in which the touch is held.
        low: frame before which the body does not change.
        high: frame after which it does not.
        bounds: held frames of the touches before and after.
        is_fixed: whether the ball stays where it is at `frame`.
    """

    words: frozenset[str]
    frame: int
    held: tuple[int, int]
    low: int
    high: int
    bounds: tuple[int, int]
    is_fixed: bool = False


def iter_touch_frames(skeleton: Skeleton, touches: Sequence[Touch], count: int, fps: float):
    """Generate the touches that some part can serve.

    Args:
        skeleton: the skeleton.
        touches: the touches.
        count: number of frames of the motion.
        fps: frames per second.
    Returns:
        (number, moment) of each, in order of time.
    """
    shortest, longest = SHORTEST_EASE * fps, _LONGEST_EASE * fps
    order = sorted((t.frame, k) for k, t in enumerate(touches)
                   if not t.misses and build_surfaces(skeleton, t.words))
    held = [compute_contact_frames(frame, count) for frame, _ in order]
    # held frames of all touches, with sentinels far outside on both sides, so ends[place + 1] is this touch
    ends = [(-count, -count), *held, (2 * count, 2 * count)]
    for place, (frame, number) in enumerate(order):
        touch, (first, last) = touches[number], held[place]
        before, after = ends[place][1], ends[place + 2][0]
        low = max(int(first - np.clip(touch.entry, shortest, longest)), before)
        high = min(int(np.ceil(last + np.clip(touch.leave, shortest, longest))), after)
        yield number, TouchFrames(words=frozenset(touch.words), frame=find_nearest_frame(frame, count),
                                   held=held[place], low=low, high=high, bounds=(before, after),
                                  is_fixed=touch.place is not None)


def find_nearest_frame(frame: float, count: int) -> int:
    """Return the whole frame, of `count`, nearest to a fractional one."""
    return int(np.clip(np.rint(frame), 0, count - 1))


def compute_contact_frames(frame: float, count: int) -> tuple[int, int]:
    """Return the two frames, of `count`, around a fractional one in which a touch is held.

    Twice the same where the frame is nearly whole.
    """
    if abs(frame - find_nearest_frame(frame, count)) < 0.02:
        frame = find_nearest_frame(frame, count)
    return find_nearest_frame(np.floor(frame), count), find_nearest_frame(np.ceil(frame), count)
