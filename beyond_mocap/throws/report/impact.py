"""Where the ball of a generated throw goes, against where it was to go (Fredriksson §4.5, §8.2).

The ball is held until the release and leaves with the place and velocity that it has then between two frames, read off
a spline of the body's rotations: by places alone a hand that throws, seen 30 times a second, is a tenth too slow.
"""

from __future__ import annotations

import numpy as np

from ...ball.flight import Launch, find_crossing, fly
from ...ball.physics import BASEBALL, Ball
from ...motion import quaternion
from ...motion.between_frames import cubic_at
from ...motion.motion import Motion, pose_kinematics

WALL = 4.0
"""m from the thrower to the target that all of his threw at, a square of 3 m (Fredriksson §8.2)."""
_HALF = 0.02  # frames before and after the release between which the ball's velocity is read
_LONGEST = 8.0  # s


def let_go(
    motion: Motion, joint: int, grip: np.ndarray, release: float, shift: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Place (3,) m and velocity (3,) m/s at the fractional frame `release` of a ball that a hand joint holds.

    grip: (3,) m, the ball's centre in the joint's own axes. shift: (T, 3) m, how far from the motion's the hand is in
    each frame, for networks whose joints float.
    """
    from scipy.interpolate import CubicSpline

    frames = np.clip(release + np.array([-_HALF, 0.0, _HALF]), 0.0, len(motion) - 1)
    places, turns = pose_kinematics(motion.skeleton, *cubic_at(motion, frames))
    ball = places[:, joint] + quaternion.rotate(turns[:, joint], np.asarray(grip, float))
    if shift is not None:
        ball = ball + CubicSpline(np.arange(len(motion)), shift)(frames)
    return ball[1], (ball[2] - ball[0]) * motion.fps / (frames[2] - frames[0])


def impact(place: np.ndarray, velocity: np.ndarray, target: np.ndarray, ball: Ball = BASEBALL) -> np.ndarray:
    """(3,) m: where a ball without spin, let go at `place` (3,) m with velocity (3,) m/s, first crosses the upright
    plane through the target square to the level line to it, or meets the ground before; NaN where it does neither."""
    return find_crossing(fly(Launch(0.0, place, velocity), ball, _LONGEST), target)
