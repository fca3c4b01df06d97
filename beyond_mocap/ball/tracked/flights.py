"""Replace the trajectory between touches by flights, where one launch explains the samples of a stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.time_series import interpolate_columns
from ..batch import simulate_trajectories
from ..physics import FOOTBALL
from .fit import LONGEST, Stretches, collect_stretches, fit_launches
from .samples import Samples
from .trajectory import BallPiece

STEP = 0.02  # s between the stored moments of a flight
_SHORTEST, _MIN_DISTANCE = 0.25, 2.5  # s, m, the shortest stretch that is fitted
_GOOD_RESIDUAL, _MAX_RESIDUAL = 0.1, 0.2  # m root mean square: as good as the samples; the worst that is accepted
_MAX_HEIGHT_RESIDUAL = 0.25  # m root mean square in height, the worst that is accepted
_RESIDUAL_RATIO = 2.5  # times the curves' residual, at most
_MAX_FILLED_RESIDUAL = 1.2  # m root mean square to filled-in samples, at most
_MEASURED_WEIGHT = 5.0  # 1/m, weights above this belong to measured samples
# times the median, and m: an outlier; least share of inliers
_OUTLIER_RATIO, _MIN_OUTLIER, _MIN_INLIER_SHARE = 3.0, 0.4, 0.85
_SHIFT_SECONDS = 0.4  # s in which a shift from the flight may change direction
_SCATTER, _USUAL_SHIFT = 0.08, 0.3  # m, scatter of samples; m, usual size of a shift
_MAX_END_MISS = 0.5  # m from the position of the next touch, at most
_MIN_PASSED_HEIGHT = 0.6  # m, above this a foot hardly reaches the ball
_BATCH = 256  # flights of about equal length that are simulated together: a step costs hardly more than that of one
_MIN_AIR_HEIGHT = 0.35  # m of the centre above its rest: higher is a flight


def replace_by_flights(samples: Samples, pieces: list[BallPiece], moments: np.ndarray, heights: bool,
                       cancelled=None, ends: np.ndarray | None = None) -> list[BallPiece]:
    """Replace pieces between neighbouring touches by flights, where these fit.

    Args:
        samples: the ball's samples.
        pieces: in order, without gaps within a window.
        moments: (K,) s of the touches.
        heights: whether the heights of the samples are used.
        cancelled: called between batches; True cancels the work.
        ends: (E,) s of the touches of which a flight has to have one; None: any.
    Returns:
        The pieces with flights in place of those they explain.
    Raises:
        UserCancelledError: if `cancelled` returns True.
    """
    groups = _group_pieces(pieces, moments)
    groups = [group for group in groups if _is_worth_fitting(group) and (ends is None or _has_end(group, ends))]
    if not groups:
        return pieces
    spans = [_build_span(group, heights) for group in groups]
    stretches = _collect_stretches(samples, spans, heights)
    flights, deviations = _fit_flights(stretches, spans, cancelled)
    # A ball that arrives high at a touch also leaves from there: fit the stretches after such touches again.
    if not heights and len(high := _find_start_heights(groups, flights, deviations)):
        for number, height in high.items():
            spans[number][2][2] = height
        refitted = list(high)
        spans_again = [spans[number] for number in refitted]
        fits = _fit_flights(_collect_stretches(samples, spans_again, heights), spans_again, cancelled)
        for number, flight, deviation in zip(refitted, *fits):
            flights[number], deviations[number] = flight, deviation
    replaced = _replace_pieces(pieces, groups, stretches, flights, deviations)
    return replaced if heights else _add_falls(replaced)


def _collect_stretches(samples: Samples, spans, heights: bool) -> Stretches:
    return collect_stretches(samples.times, _mask_heights(samples, heights), samples.is_measured, samples.is_used,
                             spans)


def _fit_flights(stretches: Stretches, spans, cancelled) -> tuple[list[BallPiece], list[tuple]]:
    return _simulate_pieces(stretches, fit_launches(stretches, FOOTBALL, cancelled), spans)


def _find_start_heights(groups, flights, deviations) -> dict[int, float]:
    """Find the start heights m, by number, of stretches that begin where a flight ends high."""
    found = {}
    for number in range(1, len(groups)):
        together = abs(groups[number - 1][-1].end - groups[number][0].start) < 1e-6
        height = float(flights[number - 1].positions[-1, 2])
        if together and height > _MIN_PASSED_HEIGHT and _is_good_fit(groups[number - 1], deviations[number - 1]):
            found[number] = height
    return found


def _replace_pieces(pieces, groups, stretches, flights, deviations) -> list[BallPiece]:
    """Replace each group of pieces that a flight fits by that flight."""
    index = {id(piece): number for number, piece in enumerate(pieces)}
    replaced, removed = {}, set()
    for number, (group, flight, off) in enumerate(zip(groups, flights, deviations)):
        if _is_good_fit(group, off):
            numbers = [index[id(piece)] for piece in group]
            replaced[numbers[0]] = _align_flight(flight, stretches, number, _find_end_points(group))
            removed.update(numbers)
    kept = [number for number in range(len(pieces)) if number not in removed or number in replaced]
    return [replaced.get(number, pieces[number]) for number in kept]


def _group_pieces(pieces: list[BallPiece], moments: np.ndarray) -> list[list[BallPiece]]:
    """Group the pieces between each two neighbouring touches, if they follow each other without a gap."""
    groups: list[list[BallPiece]] = []
    touched = set(np.round(moments, 6).tolist())
    open_group: list[BallPiece] | None = None
    for piece in pieces:
        if open_group and abs(open_group[-1].end - piece.start) > 1e-6:
            open_group = None
        if round(piece.start, 6) in touched:
            open_group = []
        if open_group is not None:
            open_group.append(piece)
            if round(piece.end, 6) in touched:
                groups.append(open_group)
                open_group = None
    return groups


def _is_worth_fitting(group: list[BallPiece]) -> bool:
    seconds = group[-1].end - group[0].start
    way = sum(np.linalg.norm(piece.positions[-1, :2] - piece.positions[0, :2]) for piece in group)
    return bool(_SHORTEST <= seconds <= LONGEST and way >= _MIN_DISTANCE)


def _has_end(group: list[BallPiece], ends: np.ndarray) -> bool:
    """Return whether a group begins or ends at one of some touches (E,) s."""
    return any(np.abs(ends - edge).min(initial=np.inf) < 1e-6 for edge in (group[0].start, group[-1].end))


def _find_end_points(group: list[BallPiece]) -> tuple[np.ndarray, np.ndarray]:
    """Start of the first piece and end of the last, (3,) m each."""
    return group[0].positions[0], group[-1].positions[-1]


def _build_span(group: list[BallPiece], heights: bool):
    mask = np.array([1.0, 1.0, 1.0 if heights else np.nan])
    start, end = _find_end_points(group)
    return group[0].start, group[-1].end, start * mask, end * mask, group[0].velocities[0] * mask


def _mask_heights(samples: Samples, heights: bool) -> np.ndarray:
    return samples.positions if heights else samples.positions * [1.0, 1.0, np.nan]


def _simulate_pieces(stretches: Stretches, launches, spans) -> tuple[list[BallPiece], list[tuple]]:
    """Simulate the launches as pieces and measure their deviations.

    Returns:
        Pieces, and per piece the root mean squares m: horizontal and vertical to measured samples, to filled-in
            samples, and the distance m at the end.
    """
    found: list[BallPiece] = [None] * len(spans)
    deviations: list[tuple] = [None] * len(spans)
    order = np.argsort(stretches.seconds, kind="stable")
    for low in range(0, len(order), _BATCH):
        some = order[low : low + _BATCH]
        grid = np.arange(int(np.ceil(stretches.seconds[some].max() / STEP)) + 1) * STEP
        places, speeds = simulate_trajectories(launches.place[some], launches.velocity[some], launches.spin[some],
                                               FOOTBALL, grid)
        for row, number in enumerate(some):
            piece = _build_piece(grid, places[row], speeds[row], spans[number], launches.spin[number])
            found[number], deviations[number] = piece, _measure_deviation(piece, stretches, number, spans[number])
    return found, deviations


def _build_piece(grid, places, speeds, span, spin) -> BallPiece:
    """Build the piece of one flight, cut to its span, with an interpolated end."""
    seconds = span[1] - span[0]
    inside = grid < seconds - 1e-3
    share = (seconds - grid[inside][-1]) / STEP
    last = min(np.count_nonzero(inside), len(grid) - 1)
    end = places[last - 1] + share * (places[last] - places[last - 1])
    end_speed = speeds[last - 1] + share * (speeds[last] - speeds[last - 1])
    times = np.append(grid[inside], seconds)
    places, speeds = np.vstack([places[inside], end]), np.vstack([speeds[inside], end_speed])
    high = places[:, 2].max() - FOOTBALL.radius
    return BallPiece(times=span[0] + times, positions=places, velocities=speeds,
                     kind="flight" if high > _MIN_AIR_HEIGHT else "roll", spin=spin, residual=np.nan,
                     bounces=span[0] + _detect_bounces(times, places, speeds))  # fmt: skip


def _detect_bounces(times, places, speeds) -> np.ndarray:
    """Detect bounces: seconds at which the velocity turns upward near the ground."""
    turns = np.flatnonzero((speeds[:-1, 2] < -0.3) & (speeds[1:, 2] > 0.1))
    falls = np.maximum(places[turns, 2] - FOOTBALL.radius, 0.0) / -speeds[turns, 2]
    return times[turns] + np.minimum(falls, times[turns + 1] - times[turns])


def _measure_deviation(piece: BallPiece, stretches: Stretches, number: int, span) -> tuple[float, float, float, float]:
    """Measure root mean squares m of a flight to its samples (horizontal, vertical, filled in) and its miss m at the
    end.
    """
    since, weight = stretches.since[number], stretches.weight[number]
    at = interpolate_columns(since, piece.times - span[0], piece.positions[:, :2])
    off = np.linalg.norm(at - stretches.points[number, :, :2], axis=1)
    seen = _find_inliers(off, weight > _MEASURED_WEIGHT)
    filled = (weight > 0) & ~(weight > _MEASURED_WEIGHT)
    end = float(np.linalg.norm(piece.positions[-1, :2] - span[3][:2]))
    height = np.interp(since, piece.times - span[0], piece.positions[:, 2])
    high = np.abs(height - stretches.points[number, :, 2])[seen & (stretches.weight_z[number] > _MEASURED_WEIGHT)]
    return _compute_rms(off[seen]), _compute_rms(high), _compute_rms(off[filled]), end


def _find_inliers(off: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Find inliers (K,) bool among measured samples; where too few are inliers, all measured samples."""
    if not measured.any():
        return measured
    near = measured & (off < max(_MIN_OUTLIER, _OUTLIER_RATIO * float(np.median(off[measured]))))
    return near if near.sum() >= _MIN_INLIER_SHARE * measured.sum() else measured


def _compute_rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def _is_good_fit(group: list[BallPiece], deviation: tuple) -> bool:
    measured, high, filled, end = deviation
    own = [piece.residual for piece in group if np.isfinite(piece.residual)]
    limit = np.clip(_RESIDUAL_RATIO * max(own, default=0.0), _GOOD_RESIDUAL, _MAX_RESIDUAL)
    return (measured <= limit and high <= _MAX_HEIGHT_RESIDUAL and filled <= _MAX_FILLED_RESIDUAL
            and end <= _MAX_END_MISS)


def _align_flight(piece: BallPiece, stretches: Stretches, number: int,
                  ends: tuple[np.ndarray, np.ndarray]) -> BallPiece:
    """Align a flight with its touches and samples.

    Its ends are moved horizontally onto the touches. A slow horizontal shift stands for wind, pitch and knuckling,
    limited to what the measured samples show.
    """
    seconds = piece.end - piece.start
    shift = np.stack([ends[0] - piece.positions[0], ends[1] - piece.positions[-1]])[:, :2]
    measured = stretches.weight[number] > _MEASURED_WEIGHT
    since = stretches.since[number][measured]
    after = piece.times - piece.start
    there = interpolate_columns(since, after, piece.positions[:, :2])
    inliers = _find_inliers(np.linalg.norm(there - stretches.points[number][measured, :2], axis=1),
                            np.ones(len(since), bool))
    measured = np.flatnonzero(measured)[inliers]
    since, there = since[inliers], there[inliers]
    waves, _ = _build_shift_shapes(since / seconds, seconds)
    off = stretches.points[number][measured, :2] - there - waves[:, :2] @ shift
    # Ridge regression of the shapes that are zero at both ends, on what the end shifts leave.
    slow = waves[:, 2:]
    coefficients = np.linalg.solve(slow.T @ slow + (_SCATTER / _USUAL_SHIFT) ** 2 * np.eye(slow.shape[1]), slow.T @ off)
    shapes, slopes = _build_shift_shapes((piece.times - piece.start) / seconds, seconds)
    both = np.vstack([shift, coefficients])
    places, speeds = piece.positions.copy(), piece.velocities.copy()
    places[:, :2] += shapes @ both
    speeds[:, :2] += slopes @ both
    higher = ends[1][2] - places[-1, 2] if np.isfinite(stretches.end[number, 2]) else 0.0
    places[:, 2] = np.maximum(places[:, 2] + shapes[:, 1] * higher, FOOTBALL.radius)
    path = interpolate_columns(since, piece.times - piece.start, places[:, :2])
    residual = _compute_rms(np.linalg.norm(path - stretches.points[number][measured, :2],
                                           axis=1)) if len(measured) else np.nan
    return replace(piece, positions=places, velocities=speeds, residual=residual)


def _add_falls(pieces: list[BallPiece]) -> list[BallPiece]:
    """Add falls: where heights are unknown, a ball that arrives high at a player falls from there."""
    out = []
    for piece in pieces:
        continues = out and abs(out[-1].end - piece.start) < 1e-6
        above = out[-1].positions[-1, 2] - piece.positions[0, 2] if continues else 0.0
        out.append(_build_fall(piece, float(out[-1].positions[-1, 2])) if above > 1e-6 else piece)
    return out


def _build_fall(piece: BallPiece, height: float) -> BallPiece:
    """Build the same piece with a fall from `height` m down to its own trajectory."""
    since = piece.times - piece.start
    falls = height - 0.5 * FOOTBALL.gravity * since**2
    higher = falls > piece.positions[:, 2]
    places, speeds = piece.positions.copy(), piece.velocities.copy()
    places[higher, 2], speeds[higher, 2] = falls[higher], -FOOTBALL.gravity * since[higher]
    return replace(piece, positions=places, velocities=speeds)


def _build_shift_shapes(share: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Build shift shapes over a stretch.

    Args:
        share: (n,) of the stretch, 0 to 1.
        seconds: s, its duration.
    Returns:
        Shapes (n, 2 + W): one is 1 at the start, one is 1 at the end, the others are 0 at both; and their slopes 1/s.
    """
    count = int(np.clip(round(seconds / _SHIFT_SECONDS), 1, 6))
    angles = np.pi * np.arange(1, count + 1)
    values = np.column_stack([1.0 - share, share, np.sin(share[:, None] * angles)])
    one = np.ones_like(share)
    return values, np.column_stack([-one, one, angles * np.cos(share[:, None] * angles)]) / seconds
