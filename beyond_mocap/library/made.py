"""Gaits faster than any recording: made ones, on the library's skeleton and in the style of its fastest clip.

Tracked players run at up to 9 m/s, recordings seldom at more than 4 or 5 (../shared/data/README.md). Playing the fastest
clip faster with stretched strides keeps the figures and loses the look: knees pop, the body floats. `motion.gait` makes
running at any speed from published cadences, strides and flight times; here it is made once per library, from just below
the fastest recording up to 9.5 m/s, steady, speeding up, slowing down and in curves, for the path search to choose from.
"""

from __future__ import annotations

import numpy as np

from ..motion.gait import gait
from ..motion.motion import Motion
from ..motion.skeleton import Skeleton
from .scan import CACHE_FOLDER

MADE_FOLDER = f"{CACHE_FOLDER}/made-gait/"
FASTEST = 9.4
STEP = 1.12
FPS = 60.0
STEADY_SECONDS = 2.5
_BANDS = ((2.0, "walking"), (4.0, "jogging"), (5.5, "running"), (np.inf, "sprinting"))


def made_clips(skeleton: Skeleton, example: Motion, fastest: float) -> list[tuple[str, Motion, tuple[str, ...]]]:
    """(name, motion at 60 fps, words) of made running above `fastest` m/s on `skeleton`, styled after `example`; none
    where the recordings are as fast as people get. Names begin with MADE_FOLDER: they are kept beside the cache."""
    out = []
    for name, speed, turn in _courses(fastest):
        motion = gait(speed, None, FPS, skeleton, turn_rate=turn, example=example)
        word = next(word for limit, word in _BANDS if speed.mean() < limit)
        out.append((f"{MADE_FOLDER}{name}.bvh", motion, (word, "front")))
    return out


def _courses(fastest: float) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """(name, speed (T,) m/s, turn rate (T,) rad/s) of every made clip."""
    speeds = []
    speed = max(0.95 * fastest, 0.5)
    while speed < FASTEST:
        speeds.append(speed)
        speed *= STEP
    if not speeds:
        return []
    steady = np.zeros(int(STEADY_SECONDS * FPS))
    out = [(f"steady_{v:.1f}", steady + v, steady) for v in speeds]
    for seconds in (2.5, 5.0):
        ramp = np.linspace(speeds[0], speeds[-1], int(seconds * FPS))
        out += [(f"up_in_{seconds:g}s", ramp, 0 * ramp), (f"down_in_{seconds:g}s", ramp[::-1], 0 * ramp)]
    for v in speeds[::2]:
        # as much sideways acceleration as players show at speed, about 4 m/s^2
        turn = np.sin(np.linspace(0.0, np.pi, int(3.0 * FPS))) * min(1.2, 4.0 / v)
        out.append((f"curve_{v:.1f}", 0 * turn + v, turn))
    return out
