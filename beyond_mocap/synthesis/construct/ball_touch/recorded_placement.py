"""Place the ball that was recorded with a clip on the body that is synthesized from it.

At a touch the clip is laid over the synthesized body so that the part that touches the ball is at the same place, and
what the recording lacks between part and ball is taken away. Between two touches the ball goes over from the placement
of the one to that of the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....motion import quaternion
from ....motion.humanoid import compute_heading
from ....motion.motion import Motion
from ....motion.track import BALL_RADIUS
from .recorded_touches import NEAR, NearestParts

_LYING = 0.05  # m above rest up to which a ball keeps its height where it is brought to the part
_LIFTED = 0.3  # m above rest from which on a ball is as much higher or lower as the part that touches it


@dataclass(frozen=True, eq=False, kw_only=True)
class Placements:
    """How the recorded ball is placed by a touch, for a touch in each of N frames.

    Attributes:
        recorded: (N, 3) m, the ball's centre in the clip.
        anchor: (N, 3) m, the part's nearest point in the clip.
        target: (N, 2) m, where that point comes to lie on the pitch.
        turn: (N,) rad, by which the clip is turned about the vertical.
        lift: (N,) m, by which the ball is higher than recorded.
    """

    recorded: np.ndarray
    anchor: np.ndarray
    target: np.ndarray
    turn: np.ndarray
    lift: np.ndarray

    @classmethod
    def from_bodies(cls, recorded: np.ndarray, parts: NearestParts, clip: Motion, shown: Motion) -> Placements:
        """Find the placements of a ball (N, 3) m in N frames of a clip, for the body that is shown with it."""
        turn = compute_heading(shown) - compute_heading(clip)
        level = quaternion.rotate_level((recorded - parts.recorded)[:, :2], turn)
        lift = (parts.shown - parts.recorded)[:, 2] * _find_share_of_lift(recorded[:, 2], _LIFTED)
        ball = np.column_stack([parts.shown[:, :2] + level, recorded[:, 2] + lift])
        move = find_move_to_part(ball, parts)
        return cls(recorded=recorded, anchor=parts.recorded, target=parts.shown[:, :2] + move[:, :2], turn=turn,
                   lift=lift + move[:, 2])

    def place(self, touch: np.ndarray) -> np.ndarray:
        """Place the ball of each frame as the touch in frame `touch` (N,) says: (N, 3) m, world."""
        apart = (self.recorded - self.anchor[touch])[:, :2]
        level = quaternion.rotate_level(apart, self.turn[touch]) + self.target[touch]
        whole = np.clip(self.recorded[touch, 2] - BALL_RADIUS, 1e-6, _LIFTED)
        height = self.recorded[:, 2] + self.lift[touch] * _find_share_of_lift(self.recorded[:, 2], whole)
        return np.column_stack([level, np.maximum(height, BALL_RADIUS)])

    def place_between(self, touches: np.ndarray) -> np.ndarray:
        """Place the ball by the touches (K,): between two of them by both, before the first and after the last by it.
        """
        frames = np.arange(len(self.recorded))
        number = np.searchsorted(touches, frames)
        before, after = touches[np.maximum(number - 1, 0)], touches[np.minimum(number, len(touches) - 1)]
        share = np.clip((frames - before) / np.maximum(after - before, 1), 0.0, 1.0)[:, None]
        return (1.0 - share) * self.place(before) + share * self.place(after)


def _find_share_of_lift(height: np.ndarray, whole: np.ndarray | float) -> np.ndarray:
    """Find the share of a lift that a ball's centre at `height` (N,) m has: none at the ground, so that it lies there
    as recorded, and all of it from `whole` m above rest on.
    """
    return np.clip((height - BALL_RADIUS) / whole, 0.0, 1.0)


def find_move_to_part(ball: np.ndarray, parts: NearestParts) -> np.ndarray:
    """Find what lets a ball touch the part that it is near to or inside: along the ground where the ball lies,
    otherwise straight to or from the part, and not through the floor.

    Args:
        ball: (N, 3) m, the ball's centre.
        parts: the parts.
    Returns:
        (N, 3) m, 0 where the ball is not near.
    """
    apart = ball - parts.shown
    straight = parts.reach / np.maximum(np.linalg.norm(apart, axis=1), 1e-6)
    height = np.maximum(parts.shown[:, 2] + apart[:, 2] * straight, BALL_RADIUS)
    height = np.where(ball[:, 2] <= BALL_RADIUS + _LYING, ball[:, 2], height)
    level = np.sqrt(np.maximum(parts.reach**2 - (height - parts.shown[:, 2]) ** 2, 0.0))
    share = level / np.maximum(np.linalg.norm(apart[:, :2], axis=1), 1e-6) - 1.0
    move = np.column_stack([share[:, None] * apart[:, :2], height - ball[:, 2]])
    return np.where((np.abs(parts.gap) <= NEAR)[:, None], move, 0.0)
