"""Where the body strikes the ball: the distance from the striking part's surface to the ball's, at a key moment.

Parts are bodies of revolution, because a skeleton has no skin: the foot a capsule from its ankle to its toe tip, the
head a ball around the middle from its joint to its tip, the chest and the hands balls around their joints.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..motion.humanoid import Humanoid
from ..motion.skeleton import Skeleton

BALL_RADIUS = 0.11
FOOT_RADIUS, HEAD_RADIUS, CHEST_RADIUS, HAND_RADIUS = 0.05, 0.10, 0.12, 0.05
_FOOT_WORDS = {"kick", "foot", "volley", "bicycle", "slide", "pass", "dribble", "trap", "tackle", "receive"}
# stomp is a keeper's punch
_HAND_WORDS = {"throw", "throwb", "catch", "catchb", "stomp", "save", "dive"}


def striking_part(words: Iterable[str]) -> str | None:
    """Which part meets the ball: "foot", "head", "chest" or "hand"; None for words that touch no ball.

    A receive is taken with the foot unless it says body or chest (Faustino App. A: receive foot | body).
    """
    words = set(words)
    if "header" in words or "head" in words:
        return "head"
    if {"chest", "body"} & words:
        return "chest"
    if _HAND_WORDS & words:
        return "hand"
    return "foot" if _FOOT_WORDS & words else None


def contact_gap(
    skeleton: Skeleton, body: Humanoid, positions: np.ndarray, tips: np.ndarray, words: Iterable[str], ball: np.ndarray
) -> float:
    """Signed gap in metres between striking surface and ball surface, negative where they overlap; NaN without a part.

    positions (J, 3) and tips (E, 3): joints and end sites, world, m; ball (3,): its centre, m. A side among the words
    picks the limb, else the nearer one counts.
    """
    words = set(words)
    part = striking_part(words)
    sides = [side for side in ("left", "right") if side in words] or ["left", "right"]
    limbs = [getattr(body, side) for side in sides]
    if part == "foot":
        gaps = [_segment_distance(ball, positions[l.foot], _tip(skeleton, positions, tips, l)) for l in limbs]
        return min(gaps) - FOOT_RADIUS - BALL_RADIUS
    if part == "hand":
        hands = [limb.hand for limb in limbs if limb.hand is not None]
        return min((_distance(ball, positions[h]) for h in hands), default=np.nan) - HAND_RADIUS - BALL_RADIUS
    if part == "head" and body.head is not None:
        return _distance(ball, _head_middle(skeleton, positions, tips, body.head)) - HEAD_RADIUS - BALL_RADIUS
    if part == "chest":
        return _distance(ball, positions[body.chest]) - CHEST_RADIUS - BALL_RADIUS
    return np.nan


def _tip(skeleton: Skeleton, positions: np.ndarray, tips: np.ndarray, limb) -> np.ndarray:
    """The foremost point of a foot: the toe joint, or a foot's end site where the skeleton has no toe joint."""
    if limb.toe is not None:
        return positions[limb.toe]
    ends = [i for i, parent in enumerate(skeleton.end_parents) if parent == limb.foot]
    return tips[ends[0]] if ends else positions[limb.foot]


def _head_middle(skeleton: Skeleton, positions: np.ndarray, tips: np.ndarray, head: int) -> np.ndarray:
    ends = [i for i, parent in enumerate(skeleton.end_parents) if parent == head]
    return 0.5 * (positions[head] + tips[ends[0]]) if ends else positions[head]


def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b))


def _segment_distance(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Distance of a point to the segment from start to end, all (3,) m."""
    along = end - start
    share = np.clip(np.dot(point - start, along) / max(np.dot(along, along), 1e-12), 0.0, 1.0)
    return _distance(point, start + share * along)
