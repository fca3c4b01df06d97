"""What lets a ball go: a hand that holds it, or a foot that meets it where it lies.

Both are points that joints carry, between frames too (`motion.motion`): the ball in the hand, the ends of the
foot's line. Where they are and how they move at one instant says how the ball leaves.

A ball that lies leaves along the line from the foot's surface to its centre `RATIO` times as fast as the foot comes:
(1 + e) M / (M + m) for a foot of effective mass M, some 1.2 in good kicks (Lees and Nolan 1998, J. Sports Sci. 16,
211-234; Kellis and Katis 2007, J. Sports Sci. Med. 6, 154-165). Across it the foot takes the ball's surface along as
far as friction goes, as the ground does at a bounce (`ball.physics`), which gives spin (Asai, Carre, Akatsuka and Haake
2002, Sports Eng. 5, 183-192): a ball met below its middle rises and spins backward.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..annotation.striking import FOOT_RADIUS
from ..ball.contact import striking_surface
from ..ball.physics import Ball
from ..base.errors import InputError
from ..base.vectors import unit_vector
from ..motion import quaternion
from ..motion.humanoid import identify
from ..motion.motion import Motion, cubic_at, forward_kinematics, pose_kinematics
from ..synthesis.construct.carry import arm, leg

BEFORE, AFTER = 0.4, 0.4
"""Seconds before and after the release within which a wrist or ankle may be moved."""
_ASHORE = 0.8  # m/s, a foot that is slower stands
_STEP = 1e-3  # of frames, in differences
RATIO = 1.2
"""Speed of the ball over that of the foot, along the line between them."""
FRICTION = 0.4
"""Coulomb's, of shoe on ball: 0.3 to 0.5 (Asai et al. 2002)."""


@dataclass(frozen=True, eq=False)
class InHand:
    """A ball that a hand throws. side: "left" or "right"; grip (3,) m: its centre in the hand joint's own axes;
    spin (3,) rad/s that it leaves with."""

    side: str
    grip: np.ndarray
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    free = 0

    def chain(self, motion: Motion) -> tuple[int, int, int]:
        """Shoulder, elbow, wrist; InputError for a body without them."""
        joints = arm(getattr(identify(motion.skeleton), self.side))
        if None in joints:
            raise InputError("throw", f"a body without a {self.side} arm and hand", "a skeleton with arms and hands")
        return joints

    def points(self, motion: Motion, places: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """(N, 1, 3) m: the ball."""
        hand = self.chain(motion)[2]
        return (places[:, hand] + quaternion.rotate(turns[:, hand], self.grip))[:, None]

    def leaves(self, points, velocities, rest, ball: Ball):
        """Position, velocity and spin (N, 3), and gap (N, 0)."""
        return points[:, 0], velocities[:, 0], np.broadcast_to(self.spin, points[:, 0].shape), points[:, 0, :0]

    def span(self, motion: Motion, frame: float) -> tuple[int, int]:
        """First and last frame at which the wrist may be moved."""
        return int(np.ceil(frame - BEFORE * motion.fps)), int(np.floor(frame + AFTER * motion.fps))

    def rest(self, motion: Motion, frame: float, target: np.ndarray, ball: Ball) -> np.ndarray:
        """A held ball lies nowhere."""
        return np.zeros(3)


@dataclass(frozen=True, eq=False)
class AtFoot:
    """A ball that lies and is kicked. side: "left" or "right"; place (3,) m of its centre, None: where it suits."""

    side: str
    place: np.ndarray | None = None

    @property
    def free(self) -> int:
        """Coordinates of the ball's place that may be chosen."""
        return 2 if self.place is None else 0

    def chain(self, motion: Motion) -> tuple[int, int, int]:
        """Hip, knee, ankle."""
        return leg(getattr(identify(motion.skeleton), self.side))

    def surface(self, motion: Motion):
        """What strikes."""
        return striking_surface(motion.skeleton, "foot", self.side)

    def points(self, motion: Motion, places: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """(N, 2, 3) m: both ends of the foot's line."""
        return np.stack(self.surface(motion).line(places, turns), axis=1)

    def leaves(self, points, velocities, rest, ball: Ball):
        """Position, velocity and spin (N, 3), and gap (N, 1) m."""
        found = strike_ball(points, velocities, FOOT_RADIUS, rest, ball)
        return rest, found.velocity, found.spin, found.gap[:, None]

    def span(self, motion: Motion, frame: float) -> tuple[int, int]:
        """First and last frame of the foot's swing, at most BEFORE and AFTER."""
        first = max(int(np.ceil(frame - BEFORE * motion.fps)), 0)
        last = min(int(np.floor(frame + AFTER * motion.fps)), len(motion) - 1)
        near = replace(motion, root_positions=motion.root_positions[first : last + 1],
                       rotations=motion.rotations[first : last + 1])  # fmt: skip
        middle = self.points(near, *forward_kinematics(near)).mean(axis=1)
        slow = np.linalg.norm(np.gradient(middle, 1.0 / motion.fps, axis=0), axis=-1) < _ASHORE
        before, after = np.flatnonzero(slow[: int(frame) - first]), np.flatnonzero(slow[int(frame) + 2 - first :])
        return (first + int(before[-1]) + 1 if len(before) else first,
                int(frame) + 1 + int(after[0]) if len(after) else last)  # fmt: skip

    def rest(self, motion: Motion, frame: float, target: np.ndarray, ball: Ball) -> np.ndarray:
        """(3,) m: where the ball lies, to begin with."""
        if self.place is not None:
            return np.asarray(self.place, float)
        points, velocities = carried(self, motion, np.array([frame]))
        middle = points[0].mean(axis=0)
        ahead = (target - middle) * [1.0, 1.0, 0.0]
        ahead = unit_vector(ahead)
        apart, up = FOOT_RADIUS + ball.radius, ball.radius - middle[2]
        level = middle + np.sqrt(max(apart**2 - up**2, 0.25 * apart**2)) * ahead
        return np.array([level[0], level[1], ball.radius])


def leaving(
    motion: Motion, part: InHand | AtFoot, frame: float, target: np.ndarray, ball: Ball
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position (3,) m, velocity (3,) m/s and spin (3,) rad/s with which the ball leaves the motion as it is, at the
    fractional `frame`; target (3,) m: on which side of the foot a ball lies whose place is free."""
    points, velocities = carried(part, motion, np.array([frame]))
    rest = part.rest(motion, frame, np.asarray(target, float), ball)
    return tuple(value[0] for value in part.leaves(points, velocities, rest[None], ball)[:3])


def grip_point(motion: Motion, part: InHand | AtFoot, frames: np.ndarray) -> np.ndarray:
    """(N, K, 3) m: the ball in the hand, or the ends of the foot's line, at fractional frames (N,)."""
    root, local = cubic_at(motion, frames)
    return part.points(motion, *pose_kinematics(motion.skeleton, root, local))


def carried(part: InHand | AtFoot, motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, K, 3) m of the part and their velocities (N, K, 3) m/s at fractional frames (N,)."""
    count = len(frames)
    found = grip_point(motion, part, np.concatenate([frames, frames - _STEP, frames + _STEP]))
    return found[:count], (found[2 * count :] - found[count : 2 * count]) * (0.5 * motion.fps / _STEP)


@dataclass(frozen=True, eq=False)
class Struck:
    """How balls (N) leave: velocity (N, 3) m/s and spin (N, 3) rad/s; gap (N,) m between foot and ball, negative where
    they overlap; share (N,) of the way from the foot's first end to its other at which they touch."""

    velocity: np.ndarray
    spin: np.ndarray
    gap: np.ndarray
    share: np.ndarray


def strike_ball(ends: np.ndarray, velocities: np.ndarray, radius: float, centre: np.ndarray, ball: Ball) -> Struck:
    """Balls at `centre` (N, 3) m struck by a foot whose line has `ends` (N, 2, 3) m and moves with `velocities`
    (N, 2, 3) m/s; radius: the foot's about that line, m."""
    along = ends[:, 1] - ends[:, 0]
    share = np.sum((centre - ends[:, 0]) * along, axis=-1) / np.maximum(np.sum(along * along, axis=-1), 1e-12)
    share = np.clip(share, 0.0, 1.0)
    way = centre - ends[:, 0] - share[:, None] * along
    far = np.maximum(np.linalg.norm(way, axis=-1), 1e-9)
    normal = way / far[:, None]
    foot = velocities[:, 0] + share[:, None] * (velocities[:, 1] - velocities[:, 0])
    into = np.sum(foot * normal, axis=-1)
    push = RATIO * into[:, None] * normal
    across = foot - into[:, None] * normal
    wanted = across * ball.inertia / (1.0 + ball.inertia)
    most = FRICTION * RATIO * np.maximum(into, 0.0) / np.maximum(np.linalg.norm(wanted, axis=-1), 1e-12)
    drag = wanted * np.minimum(1.0, most)[:, None]
    spin = np.cross(-normal, drag) / (ball.inertia * ball.radius)
    return Struck(push + drag, spin, far - radius - ball.radius, share)
