"""What sprints cost a player: metres run above high speed, of which the body recovers within minutes.

The exertion of one moment and the speeds after it are enough to continue, so a part of a match starts with that of its
first second (`Plan.exertion`).

Source: high-speed running from 5.5 m/s (19.8 km/h) on: Bradley 2009, "High-intensity running in English FA Premier
League soccer matches", J. Sports Sci. 27. Oxygen uptake halves in 0.64 min after an all-out effort, as an exponential
of 55 s does.
"""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from ..motion.track import Track, smooth_positions

HIGH_SPEED = 5.5
"""m/s above which running exhausts."""

RECOVERY_SECONDS = 60.0
"""s in which the exertion falls to 37 %."""

_FPS = 10.0  # samples per second of a track that is measured


def compute_exertion(speed: np.ndarray, fps: float, before: float = 0.0) -> np.ndarray:
    """Compute the exertion: the distance gained on a runner at high speed, forgotten exponentially.

    Args:
        speed: (T,) m/s.
        fps: frames per second.
        before: m, exertion in the first frame.
    Returns:
        (T,) m, 0 or more.
    """
    excess = np.maximum(speed - HIGH_SPEED, 0.0)
    gained = np.concatenate([[before], 0.5 * (excess[1:] + excess[:-1]) / fps])[: len(speed)]
    decay = float(np.exp(-1.0 / (RECOVERY_SECONDS * fps)))
    # scipy.signal has this filter, but loading it takes a quarter of a take's time
    return np.array(list(accumulate(gained.tolist(), lambda total, now: now + decay * total)))


def measure_exertion(track: Track, time: float, before: float = 0.0) -> float:
    """Measure the exertion at one time of a track.

    Args:
        track: a cleaned track.
        time: s, within it.
        before: m, exertion at its first sample.
    Returns:
        m.
    """
    seconds = time - track.times[0]
    count = int(seconds * _FPS) + 1
    if count < 2:
        return before
    times, fps = np.linspace(track.times[0], time, count), (count - 1) / seconds
    places = np.stack([np.interp(times, track.times, axis) for axis in track.positions.T], axis=1)
    velocity = np.gradient(smooth_positions(places, fps), axis=0) * fps
    return float(compute_exertion(np.linalg.norm(velocity, axis=1), fps, before)[-1])
