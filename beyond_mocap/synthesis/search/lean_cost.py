"""Choose pieces by how they lean: a body in a bend, a start or a stop leans as its track is accelerated.

Speed and turning alone cannot tell a run that brakes from one that cruises: both pass the same speed. Their leans can,
and what the pieces lean right is not left to the polish (`motion.lean`), which may move footprints by decimetres only.
"""

from __future__ import annotations

import numpy as np

from ...base.easing import smoothstep
from ...base.time_series import hann_smooth, time_derivative
from ...motion import quaternion
from ...motion.lean import MOST_ACCELERATION
from ...motion.supports import GRAVITY
from ...motion.track import SampledTrack

FREE_LEAN = 0.05  # slope, 3 degrees, that costs nothing: a single stance of a recording tells no more
_SPEEDS = (1.8, 2.8)  # m/s between which a lean begins to count: a walk's tells little, and its labels and pose more
_ACCELERATION_SECONDS = 0.35  # s to either side over which the track's acceleration is smoothed


def compute_wanted_lean(track: SampledTrack, size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Compute how far a body leans on a track.

    Args:
        track: T frames, in the library's size.
        size: how many times as tall as the library's skeleton the player is: gravity is the same for all.
    Returns:
        (T, 2) slope ahead and to the left of the travel, a / g up to half of gravity; and (T,) from 0 to 1, how much
        it counts: not for a slow body, whose steps decide, nor where the track is not known.
    """
    reach = max(int(round(_ACCELERATION_SECONDS * track.fps)), 1)
    smooth = np.stack([hann_smooth(axis, reach) for axis in track.velocity.T], axis=1)
    acceleration = size * quaternion.rotate_level(time_derivative(smooth, track.fps), -track.direction)
    size = np.linalg.norm(acceleration, axis=1, keepdims=True)
    slope = acceleration * np.minimum(1.0, MOST_ACCELERATION / np.maximum(size, 1e-9)) / GRAVITY
    return slope, smoothstep(track.speed, *_SPEEDS) * track.valid


def compute_lean_cost(lean: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Compute how far leans are from what is wanted, beyond what costs nothing.

    Args:
        lean: (K, 2) slopes ahead and to the left.
        wanted: (2,) slopes.
    Returns:
        (K,) slope.
    """
    # column by column: einsum over pairs takes four times as long, and this runs over the whole library in every slot
    ahead, left = (column - value for column, value in zip(lean.T, wanted.astype(np.float32)))
    return np.maximum(np.sqrt(ahead * ahead + left * left) - np.float32(FREE_LEAN), 0.0)
