"""Where a body is when it strikes, and where the ball then lies: what links a motion to a flight.

All is given in the body's own frame at each frame: the origin is the root's place on the ground, +x its heading, z the
height. Whoever puts the body at a place with a facing turns and moves it; heights stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..annotation.striking import BODY_PARTS, Surface, part_surfaces
from ..base.errors import InputError
from ..base.vectors import unit_vector, unit_vectors
from ..motion import quaternion
from ..motion.humanoid import heading_from_positions, identify
from ..motion.motion import Motion, at_frames, pose_kinematics
from ..motion.skeleton import Skeleton
from ..motion.track import BALL_RADIUS

PARTS = (*BODY_PARTS, "tool")

JOINT_RADIUS = 0.06
"""Metres around a joint that strikes, where it is none of PARTS."""
_SECONDS = 1.0 / 120.0  # to either side, over which a part's speed is measured


@dataclass(frozen=True)
class Tool:
    """A straight thing in the hand, `length` m beyond the hand's joint along the line of the forearm; it strikes with
    its last `reach` m, all within `radius` m of that line. The defaults are a tennis racquet's."""

    name: str = "racquet"
    length: float = 0.66
    radius: float = 0.015
    reach: float = 0.26

    def __post_init__(self):
        if not (0.0 < self.length < np.inf and 0.0 <= self.reach <= self.length and 0.0 < self.radius < np.inf):
            raise InputError("tool", str(self), "a length, a reach up to its length, a radius")

    def __str__(self):
        return f"{self.name}: {self.length:g} m long, strikes with {self.reach:g} m, {self.radius:g} m thick"

    def for_body(self, size: float) -> Tool:
        """The tool for work in the size of the library, which the body is `size` times as large as: it keeps its
        own."""
        return replace(self, length=self.length / size, radius=self.radius / size, reach=self.reach / size)


def striking_surface(skeleton: Skeleton, part: str, side: str = "", tool: Tool | None = None) -> Surface:
    """The surface of a body that meets the ball: a part of PARTS (with the side for foot, hand and tool), or a joint by
    its name. InputError for a side that a part needs and for what the skeleton lacks."""
    if part in ("foot", "hand", "tool") and side not in ("left", "right"):
        raise InputError("part", f"{part} of side {side!r}", "left or right")
    if part == "tool":
        return _tool(skeleton, side, tool or Tool())
    if part in BODY_PARTS:
        found = part_surfaces(skeleton, part, (side,))
        if found:
            return found[0]
    elif part in skeleton.names:
        joint = (skeleton.index(part), np.zeros(3))
        return Surface(part, side, JOINT_RADIUS, joint, joint)
    raise InputError("part", f"{part!r}, which the skeleton lacks", f"one of {', '.join(PARTS)}, or a joint's name")


def _tool(skeleton: Skeleton, side: str, tool: Tool) -> Surface:
    hand = getattr(identify(skeleton), side).hand
    if hand is None:
        raise InputError("part", f"a tool in the {side} hand, which the skeleton lacks", "a skeleton with hands")
    along = unit_vector(skeleton.offsets[hand])
    ends = ((hand, far * along) for far in (tool.length - tool.reach, tool.length))
    return Surface("tool", side, tool.radius, *ends)


@dataclass(frozen=True, eq=False)
class StruckFrom:
    """A striking surface at N frames, in the body's own frame of each: start, end (N, 3) m of its line; radius m;
    velocity (N, 3) m/s of its middle over the ground."""

    start: np.ndarray
    end: np.ndarray
    radius: float
    velocity: np.ndarray


def struck_from(motion: Motion, frames: np.ndarray, surface: Surface) -> StruckFrom:
    """The surface at fractional `frames` (N,) of a motion (its own rate)."""
    frames = np.asarray(frames, dtype=float)
    step = _SECONDS * motion.fps
    (before, _, _), (lines, root, heading), (after, _, _) = (
        _lines(motion, frames + offset, surface) for offset in (-step, 0.0, step)
    )
    taken = np.clip(frames + step, 0, len(motion) - 1) - np.clip(frames - step, 0, len(motion) - 1)
    velocity = (after - before).mean(axis=0) * (motion.fps / np.maximum(taken, 1e-9))[:, None]
    back = quaternion.about_up(-heading)
    start, end = (quaternion.rotate(back, line - root * [1.0, 1.0, 0.0]) for line in lines)
    return StruckFrom(start, end, surface.radius, quaternion.rotate(back, velocity))


def _lines(motion: Motion, frames: np.ndarray, surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Both ends (2, N, 3) m of the surface's line, root (N, 3) m and heading (N,) rad."""
    root, local = at_frames(motion, frames)
    places, world = pose_kinematics(motion.skeleton, root, local)
    return np.array(surface.line(places, world)), root, heading_from_positions(motion.skeleton, places)


def ball_centre(struck: StruckFrom, normal: np.ndarray, ball_radius: float = BALL_RADIUS) -> np.ndarray:
    """(N, 3) m: the centre of a ball that touches the surface on the ray from its middle along `normal` (N, 3), in the
    frame of `struck`; never lower than its radius above the ground."""
    along = 0.5 * (struck.end - struck.start)
    half = np.linalg.norm(along, axis=-1)
    unit = along / np.maximum(half, 1e-9)[:, None]
    normal = unit_vectors(normal)
    slope = np.abs(np.sum(normal * unit, axis=-1))
    apart = struck.radius + ball_radius
    beside = apart / np.maximum(np.sqrt(np.maximum(1.0 - slope**2, 0.0)), 1e-9)
    beyond = half * slope + np.sqrt(np.maximum((half * slope) ** 2 - half**2 + apart**2, 0.0))
    centre = 0.5 * (struck.start + struck.end) + np.where(beside * slope <= half, beside, beyond)[:, None] * normal
    centre[:, 2] = np.maximum(centre[:, 2], ball_radius)
    return centre


def in_world(own: np.ndarray, place: np.ndarray, facing: np.ndarray | float) -> np.ndarray:
    """Points (N, 3) m of a body's own frame in the world, for a body at `place` (2,) m that faces `facing` rad."""
    level = quaternion.turned_level(np.asarray(own)[..., :2], np.asarray(facing, dtype=float))
    return np.concatenate([level + place, np.asarray(own)[..., 2:]], axis=-1)
