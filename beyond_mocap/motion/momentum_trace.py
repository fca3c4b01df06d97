"""What physics says about a motion, frame by frame: centre of mass, flights, ground force and support polygon.

All of it follows from the motion alone. A body that obeys physics flies along the parabolas, has no ground force while
it flies, and its force meets the ground within the support polygon. Where that fails, the motion is wrong there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.vectors import cross_on_ground
from . import quaternion
from .contacts import estimate_recorded_floor
from .humanoid import Humanoid, identify_joints
from .mass import compute_centre_of_mass
from .motion import Motion, forward_kinematics
from .retargeting.neutral import NeutralStance, build_neutral_stance
from .supports import (
    GRAVITY,
    LOW,
    LOWEST,
    Stances,
    find_lying_stretches,
    find_stances,
    find_support_phases,
    list_flights,
)

FORCE_SECONDS = 1.0 / 30.0
"""Seconds to either side over which the ground force is a mean, weighted by a triangle; at least a frame."""

_TOUCHES = 0.01  # m above a foot's lowest corner up to which others touch the ground with it
_HALF_WIDTHS = 0.042, 0.055, 0.026  # of the leg's length: of a boot at heel, ball and tip (`appearance.body`)
_LEAST_SUPPORT = 0.2 * GRAVITY  # m/s^2 of vertical force below which its line says nothing about the ground


@dataclass(frozen=True, eq=False, kw_only=True)
class MomentumTrace:
    """The trace of a motion of T frames with F flights.

    Attributes:
        fps: frames per second.
        centre: (T, 3) m, the centre of mass, world.
        force: (T, 3) m/s^2, ground force per mass: acceleration of the centre of mass, and what holds up its weight.
        flights: (F, 2) frames between which nothing carries the body.
        corners: (T, 2, 6, 3) m, of the soles, left and right: heel, ball and tip, each left and right, world.
        is_down: (T, 2, 6) bool, corners that stand on the ground.
        ground: m, height of the ground.
    """

    fps: float
    centre: np.ndarray
    force: np.ndarray
    flights: np.ndarray
    corners: np.ndarray
    is_down: np.ndarray
    ground: float

    def __len__(self) -> int:
        return len(self.centre)

    def find_flight(self, frame: float) -> int | None:
        """Find the flight that a frame lies in; None while something carries the body."""
        inside = np.flatnonzero((self.flights[:, 0] < frame) & (frame < self.flights[:, 1]))
        return int(inside[0]) if len(inside) else None

    def is_force_of_flight(self, frame: int) -> bool:
        """Return whether all that the force of a frame is a mean of lies in one flight: it should be zero."""
        reach, flight = _count_reach(self.fps), self.find_flight(frame)
        return flight is not None and bool(self.flights[flight, 0] <= frame - reach
                                           and frame + reach <= self.flights[flight, 1])

    def sample_parabola(self, flight: int, frames: np.ndarray) -> np.ndarray:
        """Sample the parabola of a flight: it leaves and lands where and when the centre of mass does.

        Args:
            flight: its number.
            frames: (N,) frames.
        Returns:
            (N, 3) m, world.
        """
        first, last = self.flights[flight]
        ends = np.stack([np.interp([first, last], np.arange(len(self)), axis) for axis in self.centre.T], axis=1)
        points = ends[0] + ((frames - first) / (last - first))[:, None] * (ends[1] - ends[0])
        points[:, 2] += 0.5 * GRAVITY / self.fps**2 * (frames - first) * (last - frames)
        return points

    @cached_property
    def deviations(self) -> np.ndarray:
        """(F,) m, greatest distance of the centre of mass from the parabola of each flight."""
        frames = [np.arange(int(np.ceil(first)), int(last) + 1) for first, last in self.flights]
        away = [self.sample_parabola(flight, at) - self.centre[at] for flight, at in enumerate(frames)]
        return np.array([np.linalg.norm(one, axis=1).max(initial=0.0) for one in away])

    def build_support_polygon(self, frame: int) -> np.ndarray:
        """Build the support polygon: the convex hull of all that stands on the ground.

        Returns:
            (K, 2) m, corners counterclockwise, world; none where no foot stands.
        """
        return _build_convex_hull(self.corners[frame, ..., :2][self.is_down[frame]])

    def find_force_origin(self, frame: int) -> np.ndarray:
        """Find where the ground force acts: where its line through the centre of mass meets the ground, or the point of
        the support polygon nearest to that.

        Returns:
            (3,) m, world.
        """
        centre, force, polygon = self.centre[frame], self.force[frame], self.build_support_polygon(frame)
        point = centre[:2]
        if force[2] > _LEAST_SUPPORT:
            point = point - (centre[2] - self.ground) / force[2] * force[:2]
        return np.append(_find_nearest_point(polygon, point) if len(polygon) else point, self.ground)


def trace_momentum(motion: Motion) -> MomentumTrace:
    """Trace centre of mass, flights, ground force and standing soles of a motion on level ground.

    Args:
        motion: T frames, world, Z up.
    Returns:
        The trace.
    Raises:
        InputError: if the skeleton has no hips or legs.
    """
    body = identify_joints(motion.skeleton)
    positions, rotations = forward_kinematics(motion)
    centre = compute_centre_of_mass(body, positions)
    stances, ground = find_stances(motion.skeleton, positions, motion.fps), estimate_recorded_floor(motion)[0]
    lying = find_lying_stretches(motion.skeleton, positions - [0.0, 0.0, ground])
    phases = find_support_phases(stances, centre, motion.fps, lying)
    corners = _place_soles(body, build_neutral_stance(motion.skeleton, motion), positions, rotations)
    return MomentumTrace(fps=motion.fps, centre=centre, force=measure_ground_force(centre, motion.fps),
                         flights=list_flights(phases, len(motion)), corners=corners,
                         is_down=_find_standing_corners(corners[..., 2], stances), ground=ground)


def measure_ground_force(centre: np.ndarray, fps: float) -> np.ndarray:
    """Measure the force per mass that the ground gives a body, as a mean over FORCE_SECONDS to either side.

    A second difference over h seconds is the mean acceleration over +-h, weighted by a triangle. The first and the last
    values are repeated where it would reach beyond the motion.

    Args:
        centre: (T, 3) m, the centre of mass, world.
        fps: frames per second.
    Returns:
        (T, 3) m/s^2, world; the weight alone where the motion is too short.
    """
    reach, force = _count_reach(fps), np.tile([0.0, 0.0, GRAVITY], (len(centre), 1))
    if len(centre) > 2 * reach:
        inner = centre[2 * reach :] - 2.0 * centre[reach:-reach] + centre[: -2 * reach]
        force += np.pad(inner * (fps / reach) ** 2, ((reach, reach), (0, 0)), mode="edge")
    return force


def _count_reach(fps: float) -> int:
    """Count the frames to either side over which the force is a mean."""
    return max(int(round(FORCE_SECONDS * fps)), 1)


def _place_soles(body: Humanoid, neutral: NeutralStance, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Place the corners (T, 2, 6, 3) m of both soles; positions (T, J, 3) m and rotations (T, J, 4), world."""
    heel_width, ball_width, tip_width = (neutral.leg * share for share in _HALF_WIDTHS)
    soles = []
    for limb, ball in zip((body.left, body.right), neutral.ball):
        drop = neutral.ankle_height + ball[2]  # of the ball of the foot to the ground
        ahead = np.zeros(3) if limb.toe is not None else ball  # without toes, all hangs on the ankle
        parts = ((limb.foot, [-neutral.heel, 0.0, -neutral.ankle_height], heel_width),
                 (limb.toe_or_foot, ahead - [0.0, 0.0, drop], ball_width),
                 (limb.toe_or_foot, ahead + [neutral.tip, 0.0, -drop], tip_width))
        soles.append(np.stack([
            positions[:, joint] + quaternion.rotate(
                quaternion.multiply(rotations[:, joint], quaternion.inverse(neutral.rotations[joint])),
                np.asarray(offset) + [0.0, side * width, 0.0])
            for joint, offset, width in parts for side in (1.0, -1.0)], axis=1))
    return np.stack(soles, axis=1)


def _find_standing_corners(heights: np.ndarray, stances: Stances) -> np.ndarray:
    """Find which corners (T, 2, 6) of soles, heights in metres, stand on the ground: low ones of feet that carry
    weight.
    """
    limit = np.maximum(np.percentile(heights, LOWEST, axis=0) + LOW, heights.min(axis=2, keepdims=True) + _TOUCHES)
    stands = np.stack([stances.compute_share(side, len(heights), 1.0) >= 1.0 for side in (0, 1)], axis=1)
    return stands[..., None] & (heights < limit)


def _build_convex_hull(points: np.ndarray) -> np.ndarray:
    """Build the convex hull (K, 2) of points (N, 2), counterclockwise.

    Source: Andrew 1979, "Another efficient algorithm for convex hulls in two dimensions", Inf. Process. Lett. 9.
    """
    ordered = sorted({(x, y) for x, y in points.tolist()})  # few points: faster without numpy
    if len(ordered) < 3:
        return np.array(ordered).reshape(-1, 2)
    corners = []
    for line in (ordered, ordered[::-1]):
        chain: list[tuple[float, float]] = []
        for x, y in line:
            while len(chain) > 1:
                (a, b), (c, d) = chain[-2:]
                if (c - a) * (y - d) - (d - b) * (x - c) > 0.0:
                    break
                chain.pop()
            chain.append((x, y))
        corners += chain[:-1]
    return np.array(corners)


def _find_nearest_point(polygon: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Find the point of a convex polygon (K, 2), counterclockwise, nearest to a point (2,)."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    if len(polygon) > 2 and (cross_on_ground(edges, point - polygon) >= 0.0).all():
        return point
    along = np.sum((point - polygon) * edges, axis=1) / np.maximum(np.sum(edges**2, axis=1), 1e-12)
    near = polygon + np.clip(along, 0.0, 1.0)[:, None] * edges
    return near[np.argmin(np.linalg.norm(near - point, axis=1))]
