"""Where a ball comes to the plane of its target: square to the line from launch to target, or on the ground before."""

from __future__ import annotations

import numpy as np

from .flight import Flight

_STEP = 1.0 / 480.0


def crossing(flight: Flight, target: np.ndarray) -> np.ndarray:
    """(3,) m: the ball's centre where it first meets the upright plane through `target` (3,) m that is square to the
    line from its launch, or the ground before that; NaN where it does neither by the flight's end."""
    start = np.asarray(flight.launch.position, float)
    level = (np.asarray(target, float) - start) * [1.0, 1.0, 0.0]
    far = float(np.linalg.norm(level))
    level /= max(far, 1e-9)
    last = min([flight.end, *flight.bounces[:1], *([flight.rolls_from] if flight.rolls_from is not None else [])])
    if last <= flight.launch.time:  # it leaves along the ground
        last = flight.end
    times = np.append(np.arange(flight.launch.time, last, _STEP), last)
    gone = (flight.at(times) - start) @ level
    beyond = np.flatnonzero(gone >= far)
    if not len(beyond):
        return flight.at([last])[0] if last < flight.end else np.full(3, np.nan)
    low, high = times[max(beyond[0] - 1, 0)], times[beyond[0]]
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (flight.at([middle])[0] - start) @ level >= far else (middle, high)
    return flight.at([high])[0]
