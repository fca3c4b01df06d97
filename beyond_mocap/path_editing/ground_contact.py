"""The ground under the feet on a new path: its height and slope at each stance, and between stances.

Also the stretches where a path bends more tightly, or climbs more steeply, than feet can follow: there no foot is
planted, and a message names them.

The ground of a foot is one plane for each stance, through the ground under its heel and its toe. During a swing it is
blended from plane to plane, and raised where something protrudes in between (a stair's edge). So the roughness of the
ground never shakes a foot, and stairs have no corners.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import minimum_filter1d

from ..base.easing import quintic_step_by_powers
from ..base.errors import TimedMessage, format_count
from ..base.time_series import find_runs, hann_smooth, interpolate_columns
from ..base.vectors import arctan2, cross_on_ground
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path
from ..motion.path.terrain import Terrain

STEEPEST = 0.7
"""Slope of the ground under a foot beyond which it is an edge, on which the foot stays flat."""
CLEARANCE, MOST_LIFT = 0.02, 0.35
"""Metres that a foot in the air keeps above the ground, or as many as it had; and the metres that it is raised for that
at most."""
SEARCH_ABOVE = 1.0
"""Metres above the path below which the ground is searched: a bridge overhead is no ground."""
_EVERY = 0.03  # metres between the samples of a path's height
_BEYOND = 1.5  # metres by which its ends are extrapolated
_ROUNDS = 4  # Newton steps to find the nearest place of the path
_EDGE, _SHORT_STEP = 0.2, 0.3  # share of a swing at either end, and metres of a step, blended by time
_LONGEST_SWING = 1.5  # seconds; a foot that is in the air for longer follows the ground below it

Surface = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""(places (N, 2) m, frames (N,) int in which a foot is there) -> heights (N,) m and slopes (N, 2), by x and by y."""
TIGHT_RADIUS = 0.3
"""Metres of radius, about a foot's length, below which a bend is too tight to walk on."""
STEEP_DEGREES = 60.0
"""Degrees from which on a path is too steep to be ground."""
LASTING_METRES = 0.5
"""Metres of path, within one metre, that must be tight or steep: a single corner is only a corner."""
_JOIN_SECONDS = 0.5  # seconds; a shorter gap joins two such stretches
_FADE = 0.12  # seconds; twice that is the blend from planted to free feet
_AS_OWN = 1.5  # factor on the curvature or slope of the motion's own path up to which the motion can follow


@dataclass(frozen=True, eq=False)
class Footing:
    """The ground of two feet in T frames.

    Attributes:
        height: (T, 2) metres at each toe.
        slope: (T, 2, 2) rise by x and by y, world frame.
        lift: (T, 2) metres by which a foot in the air is raised.
    """

    height: np.ndarray
    slope: np.ndarray
    lift: np.ndarray

    @property
    def normal(self) -> np.ndarray:
        """(T, 2, 3) unit normals of the ground."""
        up = np.concatenate([-self.slope, np.ones((*self.slope.shape[:2], 1))], axis=2)
        return up / np.linalg.norm(up, axis=2, keepdims=True)


def is_level(path: Path, arc: ArcLength) -> bool:
    """Return whether a path has the same height everywhere."""
    heights = path.at(arc.parameter_at(np.linspace(0.0, arc.length, 200)))[:, 2]
    return bool(np.ptp(heights) < 1e-4)


def build_path_surface(path: Path, arc: ArcLength, passed: np.ndarray) -> Surface:
    """Build a surface with the path's own height, level across it.

    Args:
        path: the path.
        arc: its arc length.
        passed: (T,) metres along the path where the body is in each frame.
    Returns:
        The surface.
    """
    count = int(np.clip(arc.length / _EVERY, 8, 20000)) + 1
    at = np.linspace(0.0, arc.length, count)
    u = arc.parameter_at(at)
    line, along = path.at(u), path.at(u, 1)
    level = np.maximum(np.linalg.norm(along[:, :2], axis=1), 1e-9)
    slope = np.clip(along[:, 2] / level, -3.0, 3.0)
    table = np.column_stack([line, along[:, :2] / level[:, None], slope])
    whole = arc.length

    def sample_table(s: np.ndarray) -> np.ndarray:
        inside = s % whole if path.closed and whole > 0.0 else np.clip(s, 0.0, whole)
        return interpolate_columns(inside, at, table)

    def sample_surface(places: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the nearest place of the path for each place, and its height and slope."""
        # Start where the body is, then step along the tangent: a path that crosses itself keeps its own level.
        s = passed[frames].copy()
        for _ in range(_ROUNDS):
            here = sample_table(s)
            ahead = np.sum((places - here[:, :2]) * here[:, 3:5], axis=1)
            s = s + np.clip(ahead / np.sqrt(1.0 + here[:, 5] ** 2), -0.5, 0.5)
            if not path.closed:
                s = np.clip(s, 0.0, whole)
        here = sample_table(s)
        ahead = np.sum((places - here[:, :2]) * here[:, 3:5], axis=1)
        return here[:, 2] + here[:, 5] * np.clip(ahead, -_BEYOND, _BEYOND), here[:, 5:6] * here[:, 3:5]

    return sample_surface


def build_mesh_surface(terrain: Terrain, origin: np.ndarray) -> Surface:
    """Build a surface from a mesh, with the height of the path beyond the mesh.

    Args:
        terrain: the mesh.
        origin: (T, 3) metres on the path where the body is in each frame.
    Returns:
        The surface.
    """

    def sample_surface(places: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Look up height and slope of the mesh below the path's level."""
        below = origin[frames, 2] + SEARCH_ABOVE
        height, normal = terrain.find_heights(places, below)
        none = ~np.isfinite(height)
        if none.any():  # the path may be drawn on a floor below the hill
            height[none], normal[none] = terrain.find_heights(places[none], np.full(none.sum(), np.inf))
            none = ~np.isfinite(height)
        steep = none | (np.abs(normal[:, 2]) < 0.3)
        slope = -normal[:, :2] / np.where(steep, 1.0, normal[:, 2])[:, None]
        return np.where(none, origin[frames, 2], height), np.where(steep[:, None], 0.0, slope)

    return sample_surface


def compute_footing(feet: np.ndarray, standing: np.ndarray, clear: np.ndarray, fps: float, surface: Surface) -> Footing:
    """Compute the ground under two feet.

    Args:
        feet: (T, 2, 2, 2) metres, left and right, heel and toe, x and y.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe.
        clear: (T, 2) metres of each foot above its own ground.
        fps: frames per second.
        surface: the ground.
    Returns:
        Height, slope and lift of each foot.
    """
    sides = [_compute_side(feet[:, side], standing[:, side].any(axis=1), clear[:, side], fps, surface)
             for side in (0, 1)]
    return Footing(*(np.stack(parts, axis=1) for parts in zip(*sides)))


def _compute_side(feet: np.ndarray, stands: np.ndarray, clear: np.ndarray, fps: float, surface: Surface):
    """Compute heights (T,), slopes (T, 2) and lifts (T,) of one foot; feet (T, 2, 2), heel and toe."""
    spans = _find_stances(stands, fps)
    firsts, ends = np.array(spans).T
    middle = (firsts + ends - 1) // 2
    sums = np.concatenate([np.zeros((1, 2, 2)), np.cumsum(feet, axis=0)])
    # `before` and `after` index the stances around each frame; `time_share` is the time of the swing between them, from
    # 0 to 1.
    mean = (sums[ends] - sums[firsts]) / (ends - firsts)[:, None, None]
    height, slope = _fit_planes(mean[:, 0], mean[:, 1], middle, surface)
    before = np.clip(np.searchsorted(firsts, np.arange(len(feet)), side="right") - 1, 0, len(spans) - 1)
    after = np.minimum(before + 1, len(spans) - 1)
    time_share = (np.arange(len(feet)) - ends[before] + 1) / np.maximum(firsts[after] - ends[before] + 1, 1)
    time_share = np.clip(np.where(after == before, 0.0, time_share), 0.0, 1.0)
    toe = feet[:, 1]
    share = _compute_swing_share(toe, mean[before, 1], mean[after, 1], time_share)
    a, b = (height[at] + np.sum(slope[at] * (toe - mean[at, 1]), axis=1) for at in (before, after))
    found = a + (b - a) * share
    tilt = slope[before] + (slope[after] - slope[before]) * share[:, None]
    return found, tilt, _compute_lift(feet, found, tilt, clear=clear, time_share=time_share, which=before,
                                      surface=surface)


def _compute_swing_share(toe: np.ndarray, here: np.ndarray, there: np.ndarray, time_share: np.ndarray) -> np.ndarray:
    """Compute the progress of a foot from stance to stance, from 0 to 1.

    By distance over the ground, but by time, `time_share` (T,), at take-off and landing and where a step is short.
    """
    by_time = quintic_step_by_powers(time_share)
    step = there - here
    length = np.sum(step * step, axis=1)
    by_place = np.clip(np.sum((toe - here) * step, axis=1) / np.maximum(length, 1e-9), 0.0, 1.0)
    x = np.clip(np.minimum(time_share, 1.0 - time_share) / _EDGE, 0.0, 1.0) * np.clip(length / _SHORT_STEP**2, 0.0, 1.0)
    return by_time + (by_place - by_time) * x * x * (3.0 - 2.0 * x)


def _find_stances(stands: np.ndarray, fps: float) -> list[tuple[int, int]]:
    """Find (first, end) of every stance (T,), and moments in between where a foot is long in the air."""
    count, longest = len(stands), max(int(_LONGEST_SWING * fps), 1)
    spans = find_runs(stands)
    edges = [(-1, 0), *spans, (count, count)]
    for (_, last), (first, _) in zip(edges[:-1], edges[1:]):
        gap = first - last
        inner = np.linspace(last, first, gap // longest + 2)[1:-1].astype(int) if gap > longest else []
        ends = [at for at in (last if last == 0 else None, first - 1 if first == count else None) if at is not None]
        spans += [(int(at), int(at) + 1) for at in {*inner, *ends} if gap > 0]
    return sorted(set(spans))


def _fit_planes(heel: np.ndarray, toe: np.ndarray, frames: np.ndarray, surface: Surface) -> tuple[np.ndarray,
        np.ndarray]:
    """Fit the ground under feet with heels and toes (S, 2): height (S,) at the toe and slope (S, 2)."""
    high, slope = surface(np.concatenate([toe, heel]), np.tile(frames, 2))
    (at_toe, at_heel), slope = np.split(high, 2), 0.5 * np.add(*np.split(slope, 2))
    along = toe - heel
    length = np.linalg.norm(along, axis=1)
    known = length > 0.03
    along = along / np.maximum(length, 1e-9)[:, None]
    rise = np.where(known, (at_toe - at_heel) / np.maximum(length, 1e-9), 0.0)
    own = np.sum(slope * along, axis=1)
    edge = np.abs(rise) > STEEPEST
    slope = slope + np.where(known, rise - own, 0.0)[:, None] * along
    slope = np.where(edge[:, None], 0.0, np.clip(slope, -STEEPEST, STEEPEST))
    return np.where(edge, np.maximum(at_toe, at_heel), at_toe), slope


def _compute_lift(feet: np.ndarray, height: np.ndarray, slope: np.ndarray, clear: np.ndarray, time_share: np.ndarray,
                  which: np.ndarray, surface: Surface) -> np.ndarray:
    """Compute the lift (T,) m of a foot in the air that keeps heel and toe out of the ground: one bump for each
    swing.
    """
    lift = np.zeros(len(feet))
    aloft = np.flatnonzero((time_share > 0.0) & (time_share < 1.0))
    if not len(aloft):
        return lift
    real, _ = surface(feet[aloft].reshape(-1, 2), np.repeat(aloft, 2))
    lever = np.sum(slope[aloft, None] * (feet[aloft] - feet[aloft, 1:]), axis=2)
    lacks = real.reshape(-1, 2) - (height[aloft, None] + lever)
    lacks = lacks.max(axis=1) + np.minimum(clear[aloft], CLEARANCE) - clear[aloft]
    bump = 16.0 * (time_share * (1.0 - time_share)) ** 2
    needed = np.maximum(lacks, 0.0) / np.maximum(bump[aloft], 0.15)
    most = np.zeros(which.max() + 1)
    # The highest lift that any frame of a swing needs, `which` (T,) being the number of the swing.
    np.maximum.at(most, which[aloft], needed)
    lift[aloft] = (np.minimum(most, MOST_LIFT)[which] * bump)[aloft]
    return lift


def find_tight_bends(path: Path, at: np.ndarray, arc: np.ndarray, own: np.ndarray, fps: float) -> np.ndarray:
    """Find the frames within a tight bend.

    Args:
        path: the path.
        at: (T,) its parameters.
        arc: (T,) metres along it.
        own: (T,) 1/m, curvature of the motion's own path: what the motion could follow, it still can.
        fps: frames per second.
    Returns:
        (T,) bool.
    """
    bend = compute_curvature(path, at)
    return _select_lasting((bend > 1.0 / TIGHT_RADIUS) & (bend > _AS_OWN * own), arc, fps)


def find_steep_stretches(tangent: np.ndarray, arc: np.ndarray, own: np.ndarray, fps: float) -> np.ndarray:
    """Find the frames within a steep stretch.

    Args:
        tangent: (T, 3) tangents of any length.
        arc: (T,) metres along the path.
        own: (T,) radians, slope of the motion's own path.
        fps: frames per second.
    Returns:
        (T,) bool.
    """
    slope = arctan2(np.abs(tangent[:, 2]), np.linalg.norm(tangent[:, :2], axis=1))
    return _select_lasting((slope > np.radians(STEEP_DEGREES)) & (slope > _AS_OWN * np.abs(own)), arc, fps)


def compute_curvature(path: Path, at: np.ndarray) -> np.ndarray:
    """Compute the curvature (T,) 1/m of a path over the ground at parameters `at` (T,)."""
    first, second = path.at(at, 1)[:, :2], path.at(at, 2)[:, :2]
    return np.abs(cross_on_ground(first, second)) / np.maximum(np.linalg.norm(first, axis=1), 1e-6) ** 3


def compute_free_share(free: np.ndarray, fps: float) -> np.ndarray:
    """Compute the share of the constructed motion against the planted one around free stretches.

    Args:
        free: (T,) bool, frames in which no foot is planted.
        fps: frames per second.
    Returns:
        (T,) from 0 to 1, smooth from the borders of each stretch on.
    """
    wide = int(round(_FADE * fps))
    inner = minimum_filter1d(free.astype(float), 2 * wide + 1, mode="nearest")
    return hann_smooth(inner, wide)


def report_strain(tight: np.ndarray, steep: np.ndarray, fps: float) -> tuple[TimedMessage, ...]:
    """Report the stretches where feet are not planted.

    Args:
        tight: (T,) bool, frames within a tight bend.
        steep: (T,) bool, frames within a steep stretch.
        fps: frames per second.
    Returns:
        One message for each kind of stretch, with its seconds.
    """
    lines = []
    for which, what in ((tight, f"the path bends more tightly than {TIGHT_RADIUS:g} m radius"),
                        (steep, f"the path is steeper than {STEEP_DEGREES:g} degrees")):
        spans = [(first / fps, (end - 1) / fps) for first, end in find_runs(which)]
        if spans:
            more = f" and {format_count(len(spans) - 1, 'more time')}" if len(spans) > 1 else ""
            when = f"from {spans[0][0]:.1f} s to {spans[0][1]:.1f} s{more}"
            lines.append(TimedMessage(f"{what} {when}: feet are not planted there; smooth the path", *spans))
    return tuple(lines)


def _select_lasting(bad: np.ndarray, arc: np.ndarray, fps: float) -> np.ndarray:
    """Select the frames of `bad` (T,) where it holds for LASTING_METRES metres within the metre around."""
    if not bad.any():
        return bad
    step = np.abs(np.diff(arc, prepend=arc[:1]))
    bad_length, passed = np.cumsum(step * bad), np.cumsum(step)
    first = np.clip(passed - 0.5, 0.0, max(passed[-1] - 1.0, 0.0))
    within = np.interp(first + 1.0, passed, bad_length) - np.interp(first, passed, bad_length)
    return _join_stretches(within >= LASTING_METRES, fps)


def _join_stretches(which: np.ndarray, fps: float) -> np.ndarray:
    """Fill the gaps of at most _JOIN_SECONDS seconds between true frames of `which` (T,)."""
    out, gap = which.copy(), int(_JOIN_SECONDS * fps)
    spans = find_runs(which)
    for (_, end), (first, _) in zip(spans[:-1], spans[1:]):
        if first - end <= gap:
            out[end:first] = True
    return out
