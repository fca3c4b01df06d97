"""Where a body strikes the ball: the striking parts' surfaces, and their distance from the ball's.

Parts are bodies of revolution, because a skeleton has no skin: the foot a capsule from its ankle to its toe tip, the
head a ball around the middle from its joint to its tip, the chest and the hands balls around their joints. Polish
brings these surfaces to the ball, evaluation measures how near they came.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from . import quaternion
from .humanoid import Humanoid, Limb, identify
from .skeleton import Skeleton
from .track import BALL_RADIUS

FOOT_RADIUS, HEAD_RADIUS, CHEST_RADIUS, HAND_RADIUS = 0.05, 0.10, 0.12, 0.05
_FOOT_WORDS = {"kick", "foot", "volley", "bicycle", "slide", "pass", "dribble", "trap", "tackle", "receive"}
# stomp is a keeper's punch
_HAND_WORDS = {"throw", "throwb", "catch", "catchb", "stomp", "save", "dive"}
_CATCHING = {"catch", "catchb", "throw", "throwb"}
_FLIGHT_SECONDS = 0.6
_HERE = np.zeros(3)
_HERE.setflags(write=False)


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


def meeting_words(played: Iterable[str], asked: Iterable[str]) -> tuple[str, ...]:
    """The words that say which part meets the ball at a key moment: those that are played, else those asked for."""
    played = tuple(played)
    return played if striking_part(played) else tuple(asked)


def met_within(words: Iterable[str]) -> float:
    """Seconds after a key moment in which the ball may be met: 0, but for dives by hand, whose key is where the ball is
    met or, in recordings without a ball, where the body takes off."""
    words = set(words)
    return _FLIGHT_SECONDS if "dive" in words and striking_part(words) == "hand" else 0.0


def by_both_hands(words: Iterable[str]) -> bool:
    """Whether the words ask for a ball between both hands, where both come near enough."""
    return bool(_CATCHING & set(words))


@dataclass(frozen=True, eq=False)
class Surface:
    """A striking surface: all that is within `radius` metres of the line between two points that joints carry.

    part: "foot", "head", "chest" or "hand". side: "left", "right" or "" (head, chest). start and end: a joint's index
    and the point (3,) in metres in that joint's own frame.
    """

    part: str
    side: str
    radius: float
    start: tuple[int, np.ndarray]
    end: tuple[int, np.ndarray]

    def line(self, positions: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both ends (..., 3) m, world, from joint positions (..., J, 3) m and world rotations (..., J, 4)."""
        return tuple(
            positions[..., joint, :] + quaternion.rotate(rotations[..., joint, :], point)
            for joint, point in (self.start, self.end)
        )


def surfaces(skeleton: Skeleton, words: Iterable[str]) -> tuple[Surface, ...]:
    """The surfaces that may meet the ball by these words: one per limb, of the side that is named or of both (a dive's
    side is where it goes: either hand serves); none for words that touch no ball or a part that the skeleton lacks."""
    words, body = set(words), identify(skeleton)
    part = striking_part(words)
    named = set() if part == "hand" and "dive" in words else words
    sides = [side for side in ("left", "right") if side in named] or ["left", "right"]
    limbs = [(side, getattr(body, side)) for side in sides]
    if part == "foot":
        return tuple(_foot(skeleton, side, limb) for side, limb in limbs)
    if part == "hand":
        hands = [(side, limb.hand) for side, limb in limbs if limb.hand is not None]
        return tuple(Surface("hand", side, HAND_RADIUS, (hand, _HERE), (hand, _HERE)) for side, hand in hands)
    if part == "head" and body.head is not None:
        return (_head(skeleton, body),)
    chest = (body.chest, _HERE)
    return (Surface("chest", "", CHEST_RADIUS, chest, chest),) if part == "chest" else ()


def faster_middle(found: Sequence[Surface], places: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """The way (T, 3) m of the middle of that surface of `found` which comes furthest from the first frame to the last.

    places (T, J, 3) m and rotations (T, J, 4): joints, world.
    """
    middles = [np.mean(surface.line(places, rotations), axis=0) for surface in found]
    return max(middles, key=lambda way: float(np.linalg.norm(way[-1] - way[0])))


def ball_gap(
    line: tuple[np.ndarray, np.ndarray], radius: float, ball: np.ndarray, ball_radius: float = BALL_RADIUS
) -> np.ndarray:
    """Signed gap (...,) m between a surface and the ball's, negative where they overlap.

    line: the surface's two ends (..., 3) m, world; radius: the surface's, m; ball (..., 3): the ball's centre, m.
    """
    return np.linalg.norm(ball - nearest_on(line, ball), axis=-1) - radius - ball_radius


def nearest_on(line: tuple[np.ndarray, np.ndarray], place: np.ndarray) -> np.ndarray:
    """The point (..., 3) m of a line from one end (..., 3) m to the other that is nearest to `place` (..., 3) m."""
    start, end = line
    along = end - start
    share = np.sum((place - start) * along, axis=-1) / np.maximum(np.sum(along * along, axis=-1), 1e-12)
    return start + np.clip(share, 0.0, 1.0)[..., None] * along


def contact_gap(
    skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray, words: Iterable[str], ball: np.ndarray
) -> np.ndarray:
    """The smallest gap (...,) m of the surfaces that may meet the ball by these words, NaN without any; see `ball_gap`.

    positions (..., J, 3) m and rotations (..., J, 4): joints, world; ball (..., 3): its centre, m.
    """
    found = [ball_gap(s.line(positions, rotations), s.radius, ball) for s in surfaces(skeleton, words)]
    return np.min(found, axis=0) if found else np.full(np.shape(ball)[:-1], np.nan)


def _foot(skeleton: Skeleton, side: str, limb: Limb) -> Surface:
    """From the ankle to the toe joint, or to the foot's end site where the skeleton has no toe joint."""
    if limb.toe is not None:
        return Surface("foot", side, FOOT_RADIUS, (limb.foot, _HERE), (limb.toe, _HERE))
    return Surface("foot", side, FOOT_RADIUS, (limb.foot, _HERE), (limb.foot, _tip(skeleton, limb.foot)))


def _head(skeleton: Skeleton, body: Humanoid) -> Surface:
    middle = (body.head, 0.5 * _tip(skeleton, body.head))
    return Surface("head", "", HEAD_RADIUS, middle, middle)


def _tip(skeleton: Skeleton, joint: int) -> np.ndarray:
    """From a joint to its first end site (3,) m in the joint's frame; zero where it has none."""
    return next((o for p, o in zip(skeleton.end_parents, skeleton.end_offsets) if p == joint), _HERE)
