"""Compute where a body part is when it strikes and where the ball then is: the link between a motion and a flight.

All values are in the body's own frame at each frame: origin at the root's position on the ground, +x along its
heading, z the height. To place the body, rotate and move them; heights stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..annotation.striking import BODY_PARTS, SIDED_PARTS, Surface, build_part_surfaces
from ..base.errors import InputError
from ..base.vectors import unit_vector, unit_vectors
from ..motion import quaternion
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.motion import Motion, compute_pose, sample_frames
from ..motion.skeleton import Skeleton
from ..motion.track import BALL_RADIUS

PARTS = (*BODY_PARTS, "tool")

JOINT_RADIUS = 0.06
"""m: radius of a striking joint that is not one of PARTS."""
_SECONDS = 1.0 / 120.0  # s before and after, over which a part's velocity is measured


@dataclass(frozen=True)
class Tool:
    """A straight tool in the hand that strikes the ball. The defaults are those of a tennis racquet.

    Attributes:
        name: what it is called in messages.
        length: m beyond the hand's joint, along the line of the forearm.
        radius: m, half its thickness.
        reach: m at its end that strike the ball.
    """

    name: str = "racquet"
    length: float = 0.66
    radius: float = 0.015
    reach: float = 0.26

    def __post_init__(self):
        if not (0.0 < self.length < np.inf and 0.0 <= self.reach <= self.length and 0.0 < self.radius < np.inf):
            raise InputError("tool", str(self), "a length, a reach up to its length, a radius")

    def __str__(self):
        return f"{self.name}: {self.length:g} m long, strikes with {self.reach:g} m, {self.radius:g} m thick"

    def scale_to_library(self, size: float) -> Tool:
        """Scale the tool to the library's body size, so that it keeps its own size on the body.

        Args:
            size: the body's size, as a multiple of the library's.
        Returns:
            The scaled tool.
        """
        return replace(self, length=self.length / size, radius=self.radius / size, reach=self.reach / size)


def find_striking_surface(skeleton: Skeleton, part: str, side: str = "", tool: Tool | None = None) -> Surface:
    """Find the surface of a body that meets the ball.

    Args:
        skeleton: the body's skeleton.
        part: one of PARTS, or the name of a joint.
        side: "left" or "right", for foot, hand and tool.
        tool: the tool for the part "tool"; None: the default one.
    Returns:
        The surface.
    Raises:
        InputError: if a side is missing or the skeleton lacks the part.
    """
    if part in SIDED_PARTS and side not in ("left", "right"):
        raise InputError("part", f"{part} of side {side!r}", "left or right")
    if part == "tool":
        return _build_tool_surface(skeleton, side, tool or Tool())
    if part in BODY_PARTS:
        found = build_part_surfaces(skeleton, part, (side,))
        if found:
            return found[0]
    elif part in skeleton.names:
        joint = (skeleton.index(part), np.zeros(3))
        return Surface(part, side, JOINT_RADIUS, joint, joint)
    raise InputError("part", f"{part!r}, which the skeleton lacks", f"one of {', '.join(PARTS)}, or a joint's name")


def _build_tool_surface(skeleton: Skeleton, side: str, tool: Tool) -> Surface:
    hand = getattr(identify_joints(skeleton), side).hand
    if hand is None:
        raise InputError("part", f"a tool in the {side} hand, which the skeleton lacks", "a skeleton with hands")
    along = unit_vector(skeleton.offsets[hand])
    ends = ((hand, far * along) for far in (tool.length - tool.reach, tool.length))
    return Surface("tool", side, tool.radius, *ends)


@dataclass(frozen=True, eq=False)
class StrikeSurface:
    """A striking surface at N frames, in the body's own frame at each.

    Attributes:
        start: (N, 3) m, one end of its line.
        end: (N, 3) m, the other end.
        radius: m around the line.
        velocity: (N, 3) m/s of its middle relative to the ground.
    """

    start: np.ndarray
    end: np.ndarray
    radius: float
    velocity: np.ndarray


def sample_strike_surface(motion: Motion, frames: np.ndarray, surface: Surface) -> StrikeSurface:
    """Sample a striking surface of a motion.

    Args:
        motion: the motion.
        frames: (N,) fractional frames at the motion's own rate.
        surface: the surface.
    Returns:
        The surface at these frames, in the body's own frame.
    """
    frames = np.asarray(frames, dtype=float)
    step = _SECONDS * motion.fps
    (before, _, _), (lines, root, heading), (after, _, _) = (
        _sample_lines(motion, frames + offset, surface) for offset in (-step, 0.0, step)
    )
    duration = np.clip(frames + step, 0, len(motion) - 1) - np.clip(frames - step, 0, len(motion) - 1)
    velocity = (after - before).mean(axis=0) * (motion.fps / np.maximum(duration, 1e-9))[:, None]
    back = quaternion.from_up_angle(-heading)
    start, end = (quaternion.rotate(back, line - root * [1.0, 1.0, 0.0]) for line in lines)
    return StrikeSurface(start, end, surface.radius, quaternion.rotate(back, velocity))


def _sample_lines(motion: Motion, frames: np.ndarray, surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample the ends (2, N, 3) m of the surface's line, the root (N, 3) m and its heading (N,) rad."""
    root, local = sample_frames(motion, frames)
    places, world = compute_pose(motion.skeleton, root, local)
    return np.array(surface.compute_line(places, world)), root, compute_heading_from_positions(motion.skeleton, places)


def compute_ball_centre(surface: StrikeSurface, normal: np.ndarray, ball_radius: float = BALL_RADIUS) -> np.ndarray:
    """Compute the centre of a ball that touches the surface on the ray from its middle along `normal`.

    Args:
        surface: the striking surface at N frames.
        normal: (N, 3) direction from the surface to the ball, in the same frame.
        ball_radius: m.
    Returns:
        (N, 3) m in the same frame, never lower than the ball's radius above the ground.
    """
    along = 0.5 * (surface.end - surface.start)
    half = np.linalg.norm(along, axis=-1)
    unit = along / np.maximum(half, 1e-9)[:, None]
    normal = unit_vectors(normal)
    # The surface is a capsule. If the ray leaves it beside the line, the centre is at `beside` from the middle;
    # if it leaves at one of the round ends, at `beyond`.
    slope = np.abs(np.sum(normal * unit, axis=-1))
    distance = surface.radius + ball_radius
    beside = distance / np.maximum(np.sqrt(np.maximum(1.0 - slope**2, 0.0)), 1e-9)
    beyond = half * slope + np.sqrt(np.maximum((half * slope) ** 2 - half**2 + distance**2, 0.0))
    centre = 0.5 * (surface.start + surface.end) + np.where(beside * slope <= half, beside, beyond)[:, None] * normal
    centre[:, 2] = np.maximum(centre[:, 2], ball_radius)
    return centre


def convert_to_world(points: np.ndarray, position: np.ndarray, heading: np.ndarray | float) -> np.ndarray:
    """Convert points from a body's own frame to the world.

    Args:
        points: (N, 3) m in the body's own frame.
        position: (2,) m, the body's position on the ground, world frame.
        heading: rad, the body's heading.
    Returns:
        (N, 3) m, world frame.
    """
    level = quaternion.rotate_level(np.asarray(points)[..., :2], np.asarray(heading, dtype=float))
    return np.concatenate([level + position, np.asarray(points)[..., 2:]], axis=-1)
