"""Ball release: a hand that holds the ball, or a foot that strikes a ball at rest.

Both are points carried by joints, between frames too (`motion.motion`): the ball in the hand, the ends of the foot's
line. Their position and velocity at one instant determine how the ball leaves.

A ball at rest leaves along the line from the foot to its centre `SPEED_RATIO` times as fast as the foot moves:
(1 + e) M / (M + m) for a foot of effective mass M, about 1.2 in good kicks (Lees and Nolan 1998, J. Sports Sci. 16,
211-234; Kellis and Katis 2007, J. Sports Sci. Med. 6, 154-165). Across that line friction carries the ball's surface
along with the foot up to its limit, as the ground does at a bounce (`ball.physics`), which causes spin (Asai, Carre,
Akatsuka and Haake 2002, Sports Eng. 5, 183-192): a ball struck below its middle rises and spins backward.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..annotation.striking import FOOT_RADIUS
from ..ball.contact import find_striking_surface
from ..ball.physics import Ball
from ..base.errors import InputError
from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion, compute_pose, forward_kinematics, sample_frames_cubic
from ..synthesis.construct.move_body_part import arm_chain

BEFORE, AFTER = 0.4, 0.4
"""Seconds before and after the release within which a wrist or ankle may be moved."""
_CONTACT_SPEED = 0.8  # m/s; a slower foot is in contact with the ground
_STEP = 1e-3  # frames, step of numerical derivatives
SPEED_RATIO = 1.2
"""Speed of the ball divided by that of the foot, along the line between them."""
_SIDES = np.radians(np.linspace(-90.0, 90.0, 61))  # directions from the foot to the ball that are tried
_FARTHEST, _HALVINGS = 0.6, 24  # m from the middle of the foot to a ball that it touches, and steps of the bisection
_GAP_COST = 1e3  # for each metre of gap, against 1 - cos of the angle between launch and target
FRICTION = 0.4
"""Coulomb friction coefficient of shoe on ball: 0.3 to 0.5 (Asai et al. 2002)."""


@dataclass(frozen=True, eq=False)
class InHand:
    """A ball that a hand throws.

    Attributes:
        side: "left" or "right".
        grip: (3,) m, centre of the ball in the hand joint's own axes.
        spin: (3,) rad/s of the ball at the release.
    """

    side: str
    grip: np.ndarray
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    free_coordinates = 0

    def list_joints(self, motion: Motion) -> tuple[int, int, int]:
        """Return shoulder, elbow and wrist joint; InputError if the body lacks one."""
        joints = arm_chain(getattr(identify_joints(motion.skeleton), self.side))
        if None in joints:
            raise InputError("throw", f"a skeleton without a {self.side} arm or hand", "a skeleton with arms and hands")
        return joints

    def compute_points(self, motion: Motion, places: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """Compute the ball positions (N, 1, 3) m from joint positions and rotations."""
        hand = self.list_joints(motion)[2]
        return (places[:, hand] + quaternion.rotate(turns[:, hand], self.grip))[:, None]

    def compute_launch(self, points, velocities, rest, ball: Ball):
        """Return position, velocity and spin (N, 3) of the ball, and the gap (N, 0)."""
        return points[:, 0], velocities[:, 0], np.broadcast_to(self.spin, points[:, 0].shape), points[:, 0, :0]

    def find_frame_range(self, motion: Motion, frame: float) -> tuple[int, int]:
        """Return the first and last frame in which the wrist may be moved."""
        return int(np.ceil(frame - BEFORE * motion.fps)), int(np.floor(frame + AFTER * motion.fps))

    def find_rest_position(self, motion: Motion, frame: float, target: np.ndarray, ball: Ball) -> np.ndarray:
        """Return zero: a held ball has no position at rest."""
        return np.zeros(3)


@dataclass(frozen=True, eq=False)
class AtFoot:
    """A ball at rest that is kicked.

    Attributes:
        side: "left" or "right".
        position: (3,) m of the ball's centre, None: to be chosen.
    """

    side: str
    position: np.ndarray | None = None

    @property
    def free_coordinates(self) -> int:
        """Number of coordinates of the ball's position that may be chosen."""
        return 2 if self.position is None else 0

    def list_joints(self, motion: Motion) -> tuple[int, int, int]:
        """Return hip, knee and ankle joint."""
        return getattr(identify_joints(motion.skeleton), self.side).leg

    def find_surface(self, motion: Motion):
        """Return the striking surface of the foot."""
        return find_striking_surface(motion.skeleton, "foot", self.side)

    def compute_points(self, motion: Motion, places: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """Compute both ends (N, 2, 3) m of the foot's line from joint positions and rotations."""
        return np.stack(self.find_surface(motion).compute_line(places, turns), axis=1)

    def compute_launch(self, points, velocities, rest, ball: Ball):
        """Return position, velocity and spin (N, 3) of the ball, and the gap (N, 1) m."""
        found = strike_ball(points, velocities, FOOT_RADIUS, rest, ball)
        return rest, found.velocity, found.spin, found.gap[:, None]

    def find_frame_range(self, motion: Motion, frame: float) -> tuple[int, int]:
        """Return the first and last frame of the foot's swing, at most BEFORE and AFTER seconds around `frame`."""
        first = max(int(np.ceil(frame - BEFORE * motion.fps)), 0)
        last = min(int(np.floor(frame + AFTER * motion.fps)), len(motion) - 1)
        near = replace(motion, root_positions=motion.root_positions[first : last + 1],
                       rotations=motion.rotations[first : last + 1])  # fmt: skip
        middle = self.compute_points(near, *forward_kinematics(near)).mean(axis=1)
        slow = np.linalg.norm(np.gradient(middle, 1.0 / motion.fps, axis=0), axis=-1) < _CONTACT_SPEED
        before, after = np.flatnonzero(slow[: int(frame) - first]), np.flatnonzero(slow[int(frame) + 2 - first :])
        return (first + int(before[-1]) + 1 if len(before) else first,
                int(frame) + 1 + int(after[0]) if len(after) else last)  # fmt: skip

    def find_rest_position(self, motion: Motion, frame: float, target: np.ndarray, ball: Ball) -> np.ndarray:
        """Choose the initial position (3,) m of the ball: the given one, or in contact with the foot."""
        if self.position is not None:
            return np.asarray(self.position, float)
        ends, velocities = sample_points_and_velocities(self, motion, np.array([frame]))
        return find_rest_positions(ends, velocities, target, ball)[0]


def compute_launch(
    motion: Motion, part: InHand | AtFoot, frame: float, target: np.ndarray, ball: Ball
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute how the ball leaves a motion at a fractional frame.

    Args:
        motion: the motion, unchanged.
        part: hand or foot.
        frame: fractional frame of the release.
        target: (3,) m; determines on which side of the foot a ball of free position is.
        ball: kind of ball.
    Returns:
        Position (3,) m, velocity (3,) m/s and spin (3,) rad/s.
    """
    points, velocities = sample_points_and_velocities(part, motion, np.array([frame]))
    rest = part.find_rest_position(motion, frame, np.asarray(target, float), ball)
    return tuple(value[0] for value in part.compute_launch(points, velocities, rest[None], ball)[:3])


def sample_points(motion: Motion, part: InHand | AtFoot, frames: np.ndarray) -> np.ndarray:
    """Compute the ball in the hand, or the ends of the foot's line, (N, K, 3) m, at fractional frames (N,)."""
    root, local = sample_frames_cubic(motion, frames)
    return part.compute_points(motion, *compute_pose(motion.skeleton, root, local))


def sample_points_and_velocities(part: InHand | AtFoot, motion: Motion, frames: np.ndarray) -> tuple[np.ndarray,
        np.ndarray]:
    """Compute the points (N, K, 3) m of hand or foot and their velocities (N, K, 3) m/s at fractional frames (N,)."""
    count = len(frames)
    found = sample_points(motion, part, np.concatenate([frames, frames - _STEP, frames + _STEP]))
    return found[:count], (found[2 * count :] - found[count : 2 * count]) * (0.5 * motion.fps / _STEP)


def find_rest_positions(ends: np.ndarray, velocities: np.ndarray, target: np.ndarray, ball: Ball) -> np.ndarray:
    """Find where balls on the ground touch a foot and leave it most nearly towards the target.

    Args:
        ends: (N, 2, 3) m, both ends of the foot's line.
        velocities: (N, 2, 3) m/s of the ends.
        target: (3,) m.
        ball: kind of ball.
    Returns:
        (N, 3) m, centres of the balls; nearest to the foot where no ball on the ground touches it.
    """
    count = len(_SIDES)
    middle = ends.mean(axis=1) * [1.0, 1.0, 0.0] + [0.0, 0.0, ball.radius]
    ahead = np.arctan2(*(target - middle)[:, 1::-1].T)
    angle = (ahead[:, None] + _SIDES).ravel()
    direction = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    middle, ends, velocities = (np.repeat(one, count, axis=0) for one in (middle, ends, velocities))
    low, high = np.zeros(len(angle)), np.full(len(angle), _FARTHEST)
    for _ in range(_HALVINGS):  # the gap grows along each direction
        distance = 0.5 * (low + high)
        overlaps = strike_ball(ends, velocities, FOOT_RADIUS, middle + distance[:, None] * direction, ball).gap < 0.0
        low, high = np.where(overlaps, distance, low), np.where(overlaps, high, distance)
    centre = middle + high[:, None] * direction
    struck = strike_ball(ends, velocities, FOOT_RADIUS, centre, ball)
    aside = np.arctan2(struck.velocity[:, 1], struck.velocity[:, 0]) - np.repeat(ahead, count)
    cost = 1.0 - np.cos(aside) + _GAP_COST * np.abs(struck.gap)
    best = np.argmin(cost.reshape(-1, count), axis=1)
    return centre.reshape(-1, count, 3)[np.arange(len(best)), best]


@dataclass(frozen=True, eq=False)
class StruckBall:
    """How N balls leave a foot.

    Attributes:
        velocity: (N, 3) m/s.
        spin: (N, 3) rad/s.
        gap: (N,) m between foot and ball, negative where they overlap.
        share: (N,) contact point as a share from the foot's first end to its other.
    """

    velocity: np.ndarray
    spin: np.ndarray
    gap: np.ndarray
    share: np.ndarray


def strike_ball(ends: np.ndarray, velocities: np.ndarray, radius: float, centre: np.ndarray, ball: Ball) -> StruckBall:
    """Compute how balls leave a foot that strikes them.

    Args:
        ends: (N, 2, 3) m, both ends of the foot's line.
        velocities: (N, 2, 3) m/s of the ends.
        radius: m, radius of the foot about that line.
        centre: (N, 3) m, centres of the balls.
        ball: kind of ball.
    """
    along = ends[:, 1] - ends[:, 0]
    share = np.sum((centre - ends[:, 0]) * along, axis=-1) / np.maximum(np.sum(along * along, axis=-1), 1e-12)
    share = np.clip(share, 0.0, 1.0)
    to_centre = centre - ends[:, 0] - share[:, None] * along
    distance = np.maximum(np.linalg.norm(to_centre, axis=-1), 1e-9)
    normal = to_centre / distance[:, None]
    foot = velocities[:, 0] + share[:, None] * (velocities[:, 1] - velocities[:, 0])
    # along the normal: elastic push; across it: rolling contact, limited by friction
    into = np.sum(foot * normal, axis=-1)
    push = SPEED_RATIO * into[:, None] * normal
    across = foot - into[:, None] * normal
    wanted = across * ball.inertia / (1.0 + ball.inertia)
    most = FRICTION * SPEED_RATIO * np.maximum(into, 0.0) / np.maximum(np.linalg.norm(wanted, axis=-1), 1e-12)
    drag = wanted * np.minimum(1.0, most)[:, None]
    spin = np.cross(-normal, drag) / (ball.inertia * ball.radius)
    return StruckBall(push + drag, spin, distance - radius - ball.radius, share)
