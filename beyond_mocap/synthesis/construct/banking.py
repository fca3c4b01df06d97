"""Bodies lean into the curves that they run, as far as the recording does not do so yet.

What carries a body round a curve of lateral acceleration a is its lean, a / g to the line from foot to hips; in
recordings the legs lean by 0.7 to 0.8 of that and the trunk by a quarter. A piece that was recorded in a gentler curve
than it plays in leans too little by the difference of the two accelerations.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.humanoid import identify
from ...motion.motion import world_rotation
from ...motion.skeleton import Skeleton
from ...motion.track import zero_phase_hann

GRAVITY = 9.81
LEGS, TRUNK = 0.5, 0.2
"""Share of a / g by which legs and trunk lean."""

MOST_LEAN = 0.2
"""Radians of lean that are added at most."""

SLOW = (1.5, 3.0)
"""Metres per second below which nobody leans, and from which on all of it counts."""

_SECONDS = 0.6


def missing_lean(
    speed: np.ndarray, direction: np.ndarray, velocity: np.ndarray, turn: np.ndarray, seams: np.ndarray, fps: float,
    slow: tuple[float, float] = SLOW,
) -> np.ndarray:
    """(T,) a / g, to the left, that the track asks for beyond what the recording had; softly limited so that legs get
    at most MOST_LEAN, and nothing below SLOW.

    speed (T,) m/s and direction (T,) in radians of travel on the track; velocity (T, 2) m/s of the recording in its
    facing frame and turn (T,) radians since the frame before; seams (S,): frames across which a recording's direction
    says nothing; slow: as SLOW.
    """
    own_speed = np.linalg.norm(velocity, axis=1)
    own_turn = turn + np.diff(arctan2(velocity[:, 1], velocity[:, 0]), prepend=arctan2(*velocity[:1, ::-1].T))
    own_turn[seams] = own_turn[np.minimum(seams + 1, len(turn) - 1)]
    asked = speed * quaternion.wrapped(np.diff(direction, prepend=direction[:1]))
    fast = np.clip((np.minimum(speed, own_speed) - slow[0]) / (slow[1] - slow[0]), 0.0, 1.0)
    turns = asked - own_speed * quaternion.wrapped(own_turn)
    lean = zero_phase_hann((fast * np.clip(turns * fps / GRAVITY, -1.0, 1.0))[:, None], fps, _SECONDS)[:, 0]
    most = MOST_LEAN / LEGS
    return most * np.tanh(lean / most)


def bent_forward(skeleton: Skeleton, rotations: np.ndarray, direction: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Local rotations (T, J, 4) of a body whose trunk leans forward, in its direction of travel (T,), by angle (T,)."""
    spine = identify(skeleton).spine
    if not spine:
        return rotations
    out = rotations.copy()
    left = np.stack([-np.sin(direction), np.cos(direction), np.zeros(len(direction))], axis=1)
    above = world_rotation(skeleton, rotations, skeleton.parents[spine[0]])
    turn = quaternion.about_axis(quaternion.rotate(quaternion.inverse(above), left), angle)
    out[:, spine[0]] = quaternion.multiply(turn, rotations[:, spine[0]])
    return out


def banked(skeleton: Skeleton, rotations: np.ndarray, direction: np.ndarray, lean: np.ndarray) -> np.ndarray:
    """Local rotations (T, J, 4) of a body that leans to the left of its direction of travel (T,) by lean (T,) as a / g.

    The body turns about its root, legs and all, and the trunk turns back a part of the way above the hips.
    """
    axis = np.stack([np.cos(direction), np.sin(direction), np.zeros(len(direction))], axis=1)
    out = rotations.copy()
    out[:, 0] = quaternion.multiply(quaternion.about_axis(axis, -LEGS * lean), rotations[:, 0])
    spine = identify(skeleton).spine
    if spine:
        above = world_rotation(skeleton, rotations, skeleton.parents[spine[0]])
        back = quaternion.rotate(quaternion.inverse(above), axis)
        turn = quaternion.about_axis(back, (LEGS - TRUNK) * lean)
        out[:, spine[0]] = quaternion.multiply(turn, rotations[:, spine[0]])
    return out
