"""Made kicks at a target: of all ways to swing the leg of `synthetic.kicks`, the one whose foot sends the ball there.

What a foot gives a ball that lies is `released.struck`'s law. A kick is aimed as people aim: the whole approach turns
to the target, a harder kick is swung faster, and the ball rises as the foot meets it lower or with its toes less down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..annotation.striking import FOOT_RADIUS
from ..ball.flight import meet_wall
from ..ball.physics import FOOTBALL, Ball
from ..base.arctangent import arctan2
from ..base.errors import InputError
from ..base.time_series import interpolate
from ..motion import quaternion
from ..motion.motion import Motion, place
from ..motion.retargeting.adult import LEG, adult_skeleton
from ..motion.retargeting.neutral import Neutral, neutral_stance
from ..motion.skeleton import Skeleton
from ..synthetic.kicks import BEFORE, KICKS, KickStyle, contact, kicked
from .struck import struck

SLOWEST, FASTEST = 6.0, 36.0
"""m/s of a ball."""
_CLEAR = 0.05  # m that the toe joint is above the ground at the contact of an instep kick
_INSIDE = 0.35  # where along the foot, from ankle to toe joint, the inside meets the ball
_STEEP = 0.5  # sine of the foot's slope above which it is an instep's
_LOFTS = np.linspace(-16.0, 20.0, 5)  # degrees, tried for an instep kick
_LIFTS = np.linspace(0.05, -0.03, 5)  # m, tried for one with the inside
_ROUNDS = 6
_HIT = 0.01  # m, near enough


@dataclass(frozen=True, eq=False, kw_only=True)
class Kick:
    """A made kick.

    motion: the body. contact: s at which the foot meets the ball. foot: "left" or "right". ball: (3,) m, where the
    ball's centre lies until then. velocity: (3,) m/s and spin: (3,) rad/s, as it leaves.
    """

    motion: Motion
    contact: float
    foot: str
    ball: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


def kick(
    target: tuple[float, float, float] = (11.0, 0.0, 1.0),
    speed: float = 20.0,
    foot: str = "right",
    style: str | KickStyle = "instep",
    skeleton: Skeleton | None = None,
    fps: float = 120.0,
    ball: Ball = FOOTBALL,
) -> Kick:
    """A kick out of three steps of a ball that lies at the origin, through `target` (3,) m.

    speed: of the ball as it leaves, m/s. fps: frames per second. skeleton: any humanoid one, default the project's
    adult. style: a name of KICKS, or somebody's own. InputError for a target out of reach at that speed, an unknown
    foot or style.
    """
    how = style if isinstance(style, KickStyle) else KICKS.get(style)
    if foot not in ("left", "right") or how is None:
        raise InputError("kick", f"{style} with the {foot} foot", f"left or right, {' or '.join(KICKS)}")
    if not SLOWEST <= speed <= FASTEST:
        raise InputError("kick", f"{speed:g} m/s", f"{SLOWEST:g} to {FASTEST:g} m/s")
    neutral = neutral_stance(skeleton or adult_skeleton())
    return _Aim(how, neutral, foot, ball).at(np.asarray(target, dtype=float), speed, fps)


class _Aim:
    """What one way of kicking can do with a ball: launches along +X by how the foot meets it."""

    def __init__(self, style: KickStyle, neutral: Neutral, foot: str, ball: Ball):
        self.style, self.neutral, self.foot, self.ball = style, neutral, foot, ball
        steep = _slopes(contact(style, neutral, foot, [(0.0, 0.0)])[0])[0] > _STEEP
        self.ways = self._cleared(_LOFTS) if steep else np.stack([_LIFTS, np.zeros_like(_LIFTS)], axis=-1)
        launches = self.launches_of(self.ways)
        rising = arctan2(launches[:, 5], np.hypot(launches[:, 3], launches[:, 4]))
        order = np.argsort(rising)
        self.rising, self.ways, self.launches = rising[order], self.ways[order], launches[order]

    def _cleared(self, lofts: np.ndarray) -> np.ndarray:
        """Ways (N, 2) (lift, loft) with the toes just over the ground."""
        ends, _ = contact(self.style, self.neutral, self.foot, [(0.0, loft) for loft in lofts])
        return np.stack([(_CLEAR - ends[:, 1, 2]) / (self.neutral.leg / LEG), lofts], axis=-1)

    def launches_of(self, ways: np.ndarray) -> np.ndarray:
        """The ball's place m, velocity m/s and spin rad/s (N, 9) at the table's pace, in ways (N, 2) of (lift,
        loft)."""
        ends, velocities = contact(self.style, self.neutral, self.foot, ways)
        middle = velocities.mean(axis=1)
        centre = np.stack([_touching(*each, self.ball.radius) for each in zip(ends, middle)])
        found = struck(ends, velocities, FOOT_RADIUS, centre, self.ball)
        return np.concatenate([centre, found.velocity, found.spin], axis=-1)

    def at(self, target: np.ndarray, speed: float, fps: float) -> Kick:
        """The kick whose ball flies through the target, the ball at the origin."""
        away = float(np.hypot(target[0], target[1]))
        start = np.array([0.0, 0.0, self.ball.radius])
        fallen = 0.5 * self.ball.gravity * (away / speed) ** 2
        up, side = float(np.arctan2(target[2] - self.ball.radius + fallen, away)), 0.0
        near = False
        for number in range(_ROUNDS + 2):
            way = interpolate(up, self.rising, self.ways)
            exact = near or number >= _ROUNDS
            launch = self.launches_of(way[None])[0] if exact else interpolate(up, self.rising, self.launches)
            centre, velocity, spin = np.split(launch, 3)
            rate = speed / float(np.linalg.norm(velocity))
            turn = float(np.arctan2(target[1], target[0]) - np.arctan2(velocity[1], velocity[0])) + side
            spun = quaternion.rotate(quaternion.about_up(np.array(turn)), np.stack([rate * velocity, rate * spin]))
            met, _ = meet_wall(start, spun[0], self.ball, target[:2], target[:2], spin=spun[1])
            near = near or bool(np.linalg.norm(met - target) < _HIT)
            if exact and np.linalg.norm(met - target) < _HIT:
                break
            up += float(np.arctan2(target[2] - met[2], away))
            side += float((met[0] * target[1] - met[1] * target[0]) / away**2)
        if np.linalg.norm(met - target) > 5.0 * _HIT:
            raise InputError(
                "kick", f"a ball of {speed:g} m/s passes the target by {np.linalg.norm(met - target):.2f} m",
                "a target that it can reach", "kick faster, or aim lower or nearer",
            )
        motion = kicked(self.style, self.neutral, self.foot, lift=way[0], loft=way[1], rate=rate, turn=turn, fps=fps)
        back = start - quaternion.rotate(quaternion.about_up(np.array(turn)), centre)
        return Kick(motion=place(motion, 0.0, back), contact=BEFORE / rate, foot=self.foot, ball=start,
                    velocity=spun[0], spin=spun[1])


def _slopes(ends: np.ndarray) -> np.ndarray:
    """Sines (N,) of how steeply feet with ends (N, 2, 3) point down."""
    return (ends[:, 0, 2] - ends[:, 1, 2]) / np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1)


def _touching(ends: np.ndarray, velocity: np.ndarray, radius: float) -> np.ndarray:
    """The centre (3,) m of a ball on the ground that the foot's line (2, 3) m touches as it comes with `velocity` (3,).

    A foot that points down meets it where its line is square to where it goes; a level one with its inside.
    """
    line = ends[1] - ends[0]
    along, far = line / np.linalg.norm(line), FOOT_RADIUS + radius
    normal = velocity - velocity @ along * along
    normal /= np.linalg.norm(normal)
    if abs(along[2]) > _STEEP:
        share = (radius - far * normal[2] - ends[0, 2]) / line[2]
        if 0.0 <= share <= 1.0:
            return ends[0] + share * line + far * normal
        point = ends[int(share > 1.0)]
        normal = _rising_to(point, normal, np.zeros(3), radius, far)
    else:
        point = ends[0] + _INSIDE * line
        normal = _rising_to(point, normal, along, radius, far)
    return point + far * normal


def _rising_to(point: np.ndarray, normal: np.ndarray, along: np.ndarray, height: float, far: float) -> np.ndarray:
    """The unit vector (3,) square to `along` (or free, where that is zero) by which `point` is `far` m from a centre at
    `height` m, as near to `normal` as may be."""
    up = np.array([0.0, 0.0, 1.0]) - along[2] * along
    level = normal - normal @ up / (up @ up) * up
    level /= np.linalg.norm(level)
    rise = np.clip((height - point[2]) / far / np.sqrt(up @ up), -0.9, 0.9)
    return np.sqrt(1.0 - rise**2) * level + rise * up / np.sqrt(up @ up)
