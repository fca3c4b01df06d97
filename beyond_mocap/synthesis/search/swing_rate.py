"""Swings played slower or faster around their touch, until the foot is as fast as its ball needs.

A kick is recorded with one ball and played for another. Played faster as a whole, its run-up would not fit the player's
speed; so only the tenths of a second around the touch are, and what they gain on the clip is given back before and
after.
"""

from __future__ import annotations

import numpy as np

_SWING_SECONDS = 0.11  # s from the touch at which a swing has its clip's own rate again: a shank swings for as long
_AROUND_SECONDS = 0.45  # s from the touch at which nothing is left over


def retime_swing(frame: np.ndarray, touch: float, fps: float, rate: float) -> np.ndarray:
    """Play the frames around a touch at another rate.

    Args:
        frame: (W,) fractional library frames that are shown, at one playback rate.
        touch: fractional index among them of the touch, whose own frame stays.
        fps: library frames per second.
        rate: of the swing at the touch, relative to the others'.
    Returns:
        (W,) fractional library frames, the first and the last as they were.
    """
    away = np.arange(len(frame)) - touch
    width = min(_AROUND_SECONDS * fps, touch, len(frame) - 1 - touch)
    if width < 2.0 or rate == 1.0:
        return frame
    # an odd bump of slope 1 at the touch: the playback rate changes by `rate` there, and nothing is left at its ends
    bump = away * np.exp(-0.5 * (away / (_SWING_SECONDS * fps)) ** 2)
    bump *= np.clip(1.0 - (away / width) ** 2, 0.0, None) ** 2
    return frame + (frame[1] - frame[0]) * (rate - 1.0) * bump
