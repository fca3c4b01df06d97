"""Which way a player's body is turned while he moves: towards the ball when slow, along his way when fast.

Facing is not the direction of travel (../shared/metrics.md: torso and travel are 77 degrees apart in the median at 0.5
to 1 m/s, 47 at 1 to 2, about 31 above); what turns it away is mostly the ball.
"""

from __future__ import annotations

import numpy as np

from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.track import SampledTrack, zero_phase_hann
from .gaits import without_short_runs
from .vocabulary import DIRECTIONS

_SPEEDS = np.array([0.8, 1.5, 2.5, 4.0, 6.0])
_MOST_TURNED = np.array([np.pi, 1.3, 0.6, 0.2, 0.0])
_AT_FEET = (1.0, 2.5)
_WINDOW = 2.0
_SHORTEST = 1.5


def wanted_offset(track: SampledTrack) -> np.ndarray:
    """(T,) radians from the direction of travel to where the body should face, counterclockwise, in -pi .. pi.

    The ball's direction, as far as legs can turn aside at that speed: all the way round below 0.8 m/s, not at all at 6.
    Zero where the ball is unknown; at his own feet a player follows it along his way.
    """
    away = track.ball[:, :2] - track.positions
    known = np.isfinite(away).all(axis=1)
    distance = np.linalg.norm(np.where(known[:, None], away, 1.0), axis=1)
    share = np.where(known, np.clip((distance - _AT_FEET[0]) / (_AT_FEET[1] - _AT_FEET[0]), 0.0, 1.0), 0.0)
    to_ball = arctan2(away[:, 1], away[:, 0])
    offset = np.where(known, quaternion.wrapped(to_ball - track.direction), 0.0) * share
    most = np.interp(track.speed, _SPEEDS, _MOST_TURNED)
    offset = np.clip(offset, -most, most)
    steady = zero_phase_hann(np.stack([np.cos(offset), np.sin(offset)], axis=1), track.fps, _WINDOW)
    return arctan2(steady[:, 1], steady[:, 0])


def direction_words(offset: np.ndarray, fps: float) -> list[str]:
    """The words for walking that way at each of `offset` (T,) radians (`wanted_offset`): front, back, or to a side,
    none for less than _SHORTEST seconds. Facing to the left of one's way is walking to the right."""
    quarter = np.round(quaternion.wrapped(offset) / (np.pi / 2.0)).astype(int) % 4
    return [DIRECTIONS[-number] for number in without_short_runs(quarter, int(_SHORTEST * fps))]
