"""Where a body strikes the ball: the striking parts' surfaces, and their distance from the ball's.

Parts are bodies of revolution, because a skeleton has no skin: the foot a capsule from its ankle to its toe tip, the
head a ball around the middle from its joint to its tip, the chest and the hands balls around their joints. Polish
brings these surfaces to the ball, evaluation measures how near they came.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import Humanoid, Limb, identify
from ..motion.skeleton import Skeleton
from ..motion.track import BALL_RADIUS

BODY_PARTS = ("foot", "head", "chest", "hand")
FOOT_RADIUS, HEAD_RADIUS, CHEST_RADIUS, HAND_RADIUS = 0.05, 0.10, 0.12, 0.05
_HERE = np.zeros(3)
_HERE.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Surface:
    """A striking surface: all that is within `radius` metres of the line between two points that joints carry.

    part: "foot", "head", "chest" or "hand". side: "left", "right" or "" (head, chest). start and end: a joint's index
    and the point (3,) in metres in that joint's own frame."""

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


def part_surfaces(skeleton: Skeleton, part: str, sides: Iterable[str] = ("left", "right")) -> tuple[Surface, ...]:
    """The surfaces of a part of BODY_PARTS: of foot and hand one for each of `sides`; none where there is none."""
    body = identify(skeleton)
    if part == "foot":
        return tuple(_foot(skeleton, side, getattr(body, side)) for side in sides)
    if part == "hand":
        hands = [(side, getattr(body, side).hand) for side in sides if getattr(body, side).hand is not None]
        return tuple(Surface("hand", side, HAND_RADIUS, (hand, _HERE), (hand, _HERE)) for side, hand in hands)
    if part == "head" and body.head is not None:
        return (_head(skeleton, body),)
    chest = (body.chest, _HERE)
    return (Surface("chest", "", CHEST_RADIUS, chest, chest),) if part == "chest" else ()


def faster_middle(found: Sequence[Surface], places: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """The way (T, 3) m of the middle of that surface of `found` which comes furthest from the first frame to the last.

    places (T, J, 3) m and rotations (T, J, 4): joints, world."""
    middles = [np.mean(surface.line(places, rotations), axis=0) for surface in found]
    return max(middles, key=lambda way: float(np.linalg.norm(way[-1] - way[0])))


def ball_gap(
    line: tuple[np.ndarray, np.ndarray], radius: float, ball: np.ndarray, ball_radius: float = BALL_RADIUS
) -> np.ndarray:
    """Signed gap (...,) m between a surface and the ball's, negative where they overlap.

    line: the surface's two ends (..., 3) m, world; radius: the surface's, m; ball (..., 3): the ball's centre, m."""
    return np.linalg.norm(ball - nearest_on(line, ball), axis=-1) - radius - ball_radius


def nearest_on(line: Sequence[np.ndarray], place: np.ndarray) -> np.ndarray:
    """The point (..., 3) m of a line from one end (..., 3) m to the other that is nearest to `place` (..., 3) m."""
    start, end = line
    along = end - start
    share = np.sum((place - start) * along, axis=-1) / np.maximum(np.sum(along * along, axis=-1), 1e-12)
    return start + np.clip(share, 0.0, 1.0)[..., None] * along


def smallest_gap(
    found: Sequence[Surface], positions: np.ndarray, rotations: np.ndarray, ball: np.ndarray
) -> np.ndarray:
    """The smallest gap (...,) m of the surfaces `found`, NaN without any; see `ball_gap`.

    positions (..., J, 3) m and rotations (..., J, 4): joints, world; ball (..., 3): its centre, m."""
    gaps = [ball_gap(s.line(positions, rotations), s.radius, ball) for s in found]
    return np.min(gaps, axis=0) if gaps else np.full(np.shape(ball)[:-1], np.nan)


def _foot(skeleton: Skeleton, side: str, limb: Limb) -> Surface:
    """From the ankle to the toe joint, or to the foot's end site where the skeleton has no toe joint."""
    if limb.toe is not None:
        return Surface("foot", side, FOOT_RADIUS, (limb.foot, _HERE), (limb.toe, _HERE))
    return Surface("foot", side, FOOT_RADIUS, (limb.foot, _HERE), (limb.foot, skeleton.tip(limb.foot)))


def _head(skeleton: Skeleton, body: Humanoid) -> Surface:
    middle = (body.head, 0.5 * skeleton.tip(body.head))
    return Surface("head", "", HEAD_RADIUS, middle, middle)
