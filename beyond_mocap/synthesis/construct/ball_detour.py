"""Keep the ball out of the body: where its trajectory leads through it, it goes round by the smallest smooth detour.

Feeds, flights and touches know the body as a point. A ball that passes close by would fly through a chest, one that is
kicked would leave through the other leg. The body stays as it is. Each time the ball would be inside, it is moved aside
in the one direction that needs the least; the move grows from the touch before and fades to the touch behind, or within
`DETOUR_SECONDS`. Where a foot, a head, a chest or a hand touches the ball, it stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...annotation.body_solid import BodySolid, build_solid_surfaces
from ...annotation.striking import Surface
from ...base.easing import quintic_step_by_powers
from ...motion.motion import compute_pose
from ...motion.skeleton import Skeleton
from ...motion.track import BALL_RADIUS

DETOUR_SECONDS = 0.5
"""Seconds over which a detour begins and ends where no touch does."""

_CLEARANCE, _TOLERANCE = 0.01, 0.002  # m that a ball which passes keeps from the body; m inside that are ignored
_NEAR = 1.6  # m from the root within which a body reaches a ball at most
_TOGETHER = 0.1  # s without the ball inside after which another detour begins
_IN_THE_AIR = 0.5  # m above which a ball may also go over the body
_STEP, _FARTHEST = 0.02, 1.2  # m, lengths of detours that are tried
_LONGEST = 0.4  # s that one direction serves: a body turns
_ROUNDS = 5  # most rounds: a detour may lead into another part of the body
_LEVEL = [(np.cos(angle), np.sin(angle), 0.0) for angle in np.radians(np.arange(0.0, 360.0, 15.0))]
_SHARES = np.linspace(0.0, 1.0, 11)  # of a surface's line, from which its contacts are tried
_AROUND = np.array([(np.cos(up) * x, np.cos(up) * y, np.sin(up))
                    for up in np.radians(np.arange(-60.0, 61.0, 7.5)) for x, y, _ in _LEVEL])
_FARTHEST_CONTACT = 0.3  # m, as the noise of a measured ball
_RISING = [(0.0, 0.0, 1.0), *((0.7 * x, 0.7 * y, 0.7) for x, y, _ in _LEVEL[::3])]


def find_free_contact(skeleton: Skeleton, surface: Surface, positions: np.ndarray, rotations: np.ndarray,
                      ball: np.ndarray) -> np.ndarray:
    """Find where a ball touches a striking surface without being inside the rest of the body.

    Args:
        skeleton: the skeleton.
        surface: the surface.
        positions: (J, 3) m, world.
        rotations: (J, 4) world.
        ball: (3,) m, its centre where it touches the surface.
    Returns:
        The nearest such place (3,) m, no lower than the ball; the ball's own where it is free or none is near enough.
    """
    solid, still = BodySolid.from_pose(build_solid_surfaces(skeleton), positions[None], rotations[None]), ball[None]
    if solid.measure_gaps(still, np.zeros(1, int))[0] > -_CLEARANCE:
        return ball
    start, end = surface.compute_line(positions, rotations)
    middles = start + _SHARES[:, None] * (end - start)
    places = (middles[:, None] + (surface.radius + BALL_RADIUS) * _AROUND).reshape(-1, 3)
    apart = np.linalg.norm(places - ball, axis=1)
    near = (places[:, 2] >= ball[2] - _TOLERANCE) & (apart <= _FARTHEST_CONTACT)
    places, apart = places[near], apart[near]
    free = np.flatnonzero(solid.measure_gaps(places, np.zeros(len(places), int)) > -_TOLERANCE)
    return places[free[np.argmin(apart[free])]] if len(free) else ball


@dataclass(frozen=True, eq=False)
class _NearBody:
    """The frames in which the ball may be inside the body, and the body there.

    Attributes:
        frames: (W,) output frames, ascending.
        solid: the body in these frames.
        free: (T,) bool, all output frames in which the ball may move.
        fps: frames per second.
    """

    frames: np.ndarray
    solid: BodySolid
    free: np.ndarray
    fps: float

    def find_inside(self, path: np.ndarray) -> np.ndarray:
        """Return the output frames (N,) in which the ball is inside the body and may move."""
        rows = np.flatnonzero(self.free[self.frames])
        gaps = self.solid.measure_gaps(path[self.frames[rows]], rows)
        return self.frames[rows[gaps < -_TOLERANCE]]

    def group(self, inside: np.ndarray) -> list[np.ndarray]:
        """Group frames (N,) that one detour serves: close together, soon over, without a touch between them."""
        touches, groups = np.cumsum(~self.free), [inside[:1]]
        for frame in inside[1:]:
            first, last = groups[-1][[0, -1]]
            close = frame - last <= max(_TOGETHER * self.fps, 1.0) and frame - first < _LONGEST * self.fps
            together = close and touches[frame] == touches[last]
            groups = [*groups[:-1], np.append(groups[-1], frame)] if together else [*groups, np.array([frame])]
        return groups


def lead_ball_around_body(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, ball: np.ndarray,
                          held: Sequence[tuple[int, int]], fps: float) -> np.ndarray:
    """Lead a ball's trajectory around the body, wherever it is inside.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, the motion on the pitch, which does not change.
        rotations: (T, J, 4) local.
        ball: (T, 3) m, its centre, world, NaN where it is unknown.
        held: first and last frame of each touch; there the ball stays.
        fps: frames per second.
    Returns:
        (T, 3) m; the same values in all frames that no detour needs.
    """
    path, free = np.array(ball, dtype=float), np.isfinite(ball).all(axis=1)
    frames = np.flatnonzero(free & (np.linalg.norm(ball - root, axis=1) < _NEAR))
    if not len(frames):
        return path
    for first, last in held:
        free[max(first, 0) : last + 1] = False
    posed = compute_pose(skeleton, root[frames], rotations[frames])
    solid = BodySolid.from_pose(build_solid_surfaces(skeleton), *posed)
    body = _NearBody(frames, solid, free, fps)
    for _ in range(_ROUNDS):
        inside = body.find_inside(path)
        if not len(inside):
            return path
        for group in body.group(inside):
            span, move = _compute_detour(body, path, group)
            path[span] += move
    return _push_out(body, path)


def _compute_detour(body: _NearBody, path: np.ndarray, group: np.ndarray) -> tuple[slice, np.ndarray | float]:
    """Compute which frames of the trajectory move, and by how much (W, 3) m, to lead it out of the body in a group's.
    """
    directions = np.array(_LEVEL + _RISING if path[group, 2].mean() > _IN_THE_AIR else _LEVEL)
    lengths = _measure_ways_out(body, path, group, directions)
    longest = lengths.max(axis=0)
    best = int(np.argmin(longest))
    if not np.isfinite(longest[best]):
        return slice(0), 0.0
    low, high = _find_ends(body, group)
    reach = int(np.ceil(DETOUR_SECONDS * body.fps))
    frames = np.arange(max(group[0] - reach, 0), min(group[-1] + reach + 1, len(path)))
    shares = np.array([_build_profile(frames, frame, low, high, body.fps) for frame in group])
    move = np.max(shares * lengths[:, best, None], axis=0)[:, None] * directions[best]
    return slice(frames[0], frames[-1] + 1), move


def _measure_ways_out(body: _NearBody, path: np.ndarray, group: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Measure how far (G, D) m a ball has to move in each direction to be outside; inf where it is too far."""
    tried = np.arange(round(_FARTHEST / _STEP) + 1) * _STEP
    balls = path[group][:, None, None] + tried[:, None] * directions[:, None]  # (G, D, L, 3)
    rows = np.repeat(np.searchsorted(body.frames, group), balls[0, ..., 0].size)
    gaps = body.solid.measure_gaps(balls.reshape(-1, 3), rows).reshape(balls.shape[:-1])
    outside = gaps >= _CLEARANCE
    return np.where(outside.any(axis=2), tried[np.argmax(outside, axis=2)], np.inf)


def _find_ends(body: _NearBody, group: np.ndarray) -> tuple[int | None, int | None]:
    """Find the last frame before a group and the first one behind it in which the ball may not move, if near enough."""
    reach = int(DETOUR_SECONDS * body.fps)
    before = np.flatnonzero(~body.free[max(group[0] - reach, 0) : group[0]])
    after = np.flatnonzero(~body.free[group[-1] + 1 : group[-1] + 1 + reach])
    low = int(max(group[0] - reach, 0) + before[-1]) if len(before) else None
    return low, int(group[-1] + 1 + after[0]) if len(after) else None


def _build_profile(frames: np.ndarray, frame: int, low: int | None, high: int | None, fps: float) -> np.ndarray:
    """Build the share (W,) at `frames` (W,) of a move that is whole at a frame: 0 from its ends on.

    At a touch the ball changes its course anyway, so there the share begins with a slope; elsewhere it eases in.
    """
    reach = DETOUR_SECONDS * fps
    before = (frames - (frame - reach if low is None else low)) / (reach if low is None else frame - low)
    after = ((frame + reach if high is None else high) - frames) / (reach if high is None else high - frame)
    sides = ((np.minimum(side, 1.0), end) for side, end in ((before, low), (after, high)))
    shares = [quintic_step_by_powers(ramp) if end is None else 1.0 - (1.0 - np.maximum(ramp, 0.0)) ** 2
              for ramp, end in sides]
    return np.minimum(*shares)


def _push_out(body: _NearBody, path: np.ndarray) -> np.ndarray:
    """Move the ball out of the body where no detour has, frame by frame."""
    for _ in range(_ROUNDS):
        inside = body.find_inside(path)
        path[inside, :2] += body.solid.compute_way_out(path[inside], np.searchsorted(body.frames, inside))
    return path
