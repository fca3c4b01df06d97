"""Replace the trajectory between touches by flights, where one launch explains the samples of a stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.time_series import interpolate
from ..batch import courses
from ..physics import FOOTBALL
from .fit import LONGEST, Stretches, fit_launches, gathered
from .path import BallPiece
from .samples import Samples

STEP = 0.02  # s between the stored moments of a flight
_SHORTEST, _LEAST_WAY = 0.25, 2.5  # s, m, the shortest stretch that is fitted
_WELL, _BARELY = 0.1, 0.2  # m root mean square: as good as the samples; the worst that is accepted
_BARELY_HIGH = 0.25  # m root mean square in height, the worst that is accepted
_WORSE = 2.5  # times the curves' residual, at most
_FILLED_OFF = 1.2  # m root mean square to filled-in samples, at most
_TRUSTED = 5.0  # 1/m, weights above this belong to measured samples
_STRAY, _STRAY_LEAST, _MOST_SOUND = 3.0, 0.4, 0.85  # times the median, and m: an outlier; least share of inliers
_WAVE = 0.4  # s in which a shift from the flight may change direction
_SCATTER, _SHIFTED = 0.08, 0.3  # m, scatter of samples; m, usual size of a shift
_END_OFF = 0.5  # m from the position of the next touch, at most
_HIGH = 0.6  # m, above this a foot hardly reaches the ball
_AIR = 0.35  # m of the centre above its rest: higher is a flight


def flown(samples: Samples, pieces: list[BallPiece], moments: np.ndarray, heights: bool,
          cancelled=None) -> list[BallPiece]:
    """Replace pieces between neighbouring touches by flights, where these fit.

    Args:
        samples: the ball's samples.
        pieces: in order, without gaps within a window.
        moments: (K,) s of the touches.
        heights: whether the heights of the samples are used.
        cancelled: called between batches; True cancels the work.
    Returns:
        The pieces with flights in place of those they explain.
    Raises:
        Cancelled: if `cancelled` returns True.
    """
    groups = _between(pieces, moments)
    groups = [group for group in groups if _worth(group)]
    if not groups:
        return pieces
    spans = [_span(group, heights) for group in groups]
    stretches = _stretches(samples, spans, heights)
    flights, offs = _fitted(stretches, spans, cancelled)
    # A ball that arrives high at a touch also leaves from there: fit the stretches after such touches again.
    if not heights and len(high := _from_above(groups, flights, offs)):
        for number, height in high.items():
            spans[number][2][2] = height
        again = list(high)
        spans_again = [spans[number] for number in again]
        found = _fitted(_stretches(samples, spans_again, heights), spans_again, cancelled)
        for number, flight, off in zip(again, *found):
            flights[number], offs[number] = flight, off
    exchanged = _exchanged(pieces, groups, stretches, flights, offs)
    return exchanged if heights else _dropped(exchanged)


def _stretches(samples: Samples, spans, heights: bool) -> Stretches:
    return gathered(samples.times, _heights(samples, heights), samples.measured, samples.used, spans)


def _fitted(stretches: Stretches, spans, cancelled) -> tuple[list[BallPiece], list[tuple]]:
    return _followed(stretches, fit_launches(stretches, FOOTBALL, cancelled), spans)


def _from_above(groups, flights, offs) -> dict[int, float]:
    """Find the start heights m, by number, of stretches that begin where a flight ends high."""
    found = {}
    for number in range(1, len(groups)):
        together = abs(groups[number - 1][-1].end - groups[number][0].start) < 1e-6
        height = float(flights[number - 1].positions[-1, 2])
        if together and height > _HIGH and _fits(groups[number - 1], offs[number - 1]):
            found[number] = height
    return found


def _exchanged(pieces, groups, stretches, flights, offs) -> list[BallPiece]:
    """Replace each group of pieces that a flight fits by that flight."""
    index = {id(piece): number for number, piece in enumerate(pieces)}
    replaced, gone = {}, set()
    for number, (group, flight, off) in enumerate(zip(groups, flights, offs)):
        if _fits(group, off):
            numbers = [index[id(piece)] for piece in group]
            replaced[numbers[0]] = _brought(flight, stretches, number, _ends(group))
            gone.update(numbers)
    kept = [number for number in range(len(pieces)) if number not in gone or number in replaced]
    return [replaced.get(number, pieces[number]) for number in kept]


def _between(pieces: list[BallPiece], moments: np.ndarray) -> list[list[BallPiece]]:
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


def _worth(group: list[BallPiece]) -> bool:
    seconds = group[-1].end - group[0].start
    way = sum(np.linalg.norm(piece.positions[-1, :2] - piece.positions[0, :2]) for piece in group)
    return bool(_SHORTEST <= seconds <= LONGEST and way >= _LEAST_WAY)


def _ends(group: list[BallPiece]) -> tuple[np.ndarray, np.ndarray]:
    """Start of the first piece and end of the last, (3,) m each."""
    return group[0].positions[0], group[-1].positions[-1]


def _span(group: list[BallPiece], heights: bool):
    mask = np.array([1.0, 1.0, 1.0 if heights else np.nan])
    start, end = _ends(group)
    return group[0].start, group[-1].end, start * mask, end * mask, group[0].velocities[0] * mask


def _heights(samples: Samples, heights: bool) -> np.ndarray:
    return samples.positions if heights else samples.positions * [1.0, 1.0, np.nan]


def _followed(stretches: Stretches, launches, spans) -> tuple[list[BallPiece], list[tuple]]:
    """Simulate the launches as pieces and measure their deviations.

    Returns:
        Pieces, and per piece the root mean squares m: horizontal and vertical to measured samples, to filled-in
            samples, and the distance m at the end.
    """
    found: list[BallPiece] = [None] * len(spans)
    offs: list[tuple] = [None] * len(spans)
    order = np.argsort(stretches.seconds, kind="stable")
    for low in range(0, len(order), 64):
        some = order[low : low + 64]
        grid = np.arange(int(np.ceil(stretches.seconds[some].max() / STEP)) + 1) * STEP
        places, speeds = courses(launches.place[some], launches.velocity[some], launches.spin[some], FOOTBALL, grid)
        for row, number in enumerate(some):
            piece = _piece(grid, places[row], speeds[row], spans[number], launches.spin[number])
            found[number], offs[number] = piece, _off(piece, stretches, number, spans[number])
    return found, offs


def _piece(grid, places, speeds, span, spin) -> BallPiece:
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
                     kind="flight" if high > _AIR else "roll", spin=spin, residual=np.nan,
                     bounces=span[0] + _bounces(times, places, speeds))  # fmt: skip


def _bounces(times, places, speeds) -> np.ndarray:
    """Detect bounces: seconds at which the velocity turns upward near the ground."""
    turns = np.flatnonzero((speeds[:-1, 2] < -0.3) & (speeds[1:, 2] > 0.1))
    falls = np.maximum(places[turns, 2] - FOOTBALL.radius, 0.0) / -speeds[turns, 2]
    return times[turns] + np.minimum(falls, times[turns + 1] - times[turns])


def _off(piece: BallPiece, stretches: Stretches, number: int, span) -> tuple[float, float, float, float]:
    """Measure root mean squares m of a flight to its samples (horizontal, vertical, filled in) and its miss m at the
    end.
    """
    since, weight = stretches.since[number], stretches.weight[number]
    at = interpolate(since, piece.times - span[0], piece.positions[:, :2])
    off = np.linalg.norm(at - stretches.points[number, :, :2], axis=1)
    seen = _sound(off, weight > _TRUSTED)
    made = (weight > 0) & ~(weight > _TRUSTED)
    end = float(np.linalg.norm(piece.positions[-1, :2] - span[3][:2]))
    height = np.interp(since, piece.times - span[0], piece.positions[:, 2])
    high = np.abs(height - stretches.points[number, :, 2])[seen & (stretches.weight_z[number] > _TRUSTED)]
    return _rms(off[seen]), _rms(high), _rms(off[made]), end


def _sound(off: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Find inliers (K,) bool among measured samples; where too few are inliers, all measured samples."""
    if not measured.any():
        return measured
    near = measured & (off < max(_STRAY_LEAST, _STRAY * float(np.median(off[measured]))))
    return near if near.sum() >= _MOST_SOUND * measured.sum() else measured


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def _fits(group: list[BallPiece], off: tuple) -> bool:
    measured, high, made, end = off
    own = [piece.residual for piece in group if np.isfinite(piece.residual)]
    limit = np.clip(_WORSE * max(own, default=0.0), _WELL, _BARELY)
    return measured <= limit and high <= _BARELY_HIGH and made <= _FILLED_OFF and end <= _END_OFF


def _brought(piece: BallPiece, stretches: Stretches, number: int, ends: tuple[np.ndarray, np.ndarray]) -> BallPiece:
    """Align a flight with its touches and samples.

    Its ends are moved horizontally onto the touches. A slow horizontal shift stands for wind, pitch and knuckling,
    limited to what the measured samples show.
    """
    seconds = piece.end - piece.start
    shift = np.stack([ends[0] - piece.positions[0], ends[1] - piece.positions[-1]])[:, :2]
    measured = stretches.weight[number] > _TRUSTED
    since = stretches.since[number][measured]
    after = piece.times - piece.start
    there = interpolate(since, after, piece.positions[:, :2])
    sound = _sound(np.linalg.norm(there - stretches.points[number][measured, :2], axis=1), np.ones(len(since), bool))
    measured = np.flatnonzero(measured)[sound]
    since, there = since[sound], there[sound]
    waves, _ = _waves(since / seconds, seconds)
    off = stretches.points[number][measured, :2] - there - waves[:, :2] @ shift
    # Ridge regression of the shapes that are zero at both ends, on what the end shifts leave.
    slow = waves[:, 2:]
    size = np.linalg.solve(slow.T @ slow + (_SCATTER / _SHIFTED) ** 2 * np.eye(slow.shape[1]), slow.T @ off)
    every, slopes = _waves((piece.times - piece.start) / seconds, seconds)
    both = np.vstack([shift, size])
    places, speeds = piece.positions.copy(), piece.velocities.copy()
    places[:, :2] += every @ both
    speeds[:, :2] += slopes @ both
    higher = ends[1][2] - places[-1, 2] if np.isfinite(stretches.end[number, 2]) else 0.0
    places[:, 2] = np.maximum(places[:, 2] + every[:, 1] * higher, FOOTBALL.radius)
    path = interpolate(since, piece.times - piece.start, places[:, :2])
    residual = _rms(np.linalg.norm(path - stretches.points[number][measured, :2], axis=1)) if len(measured) else np.nan
    return replace(piece, positions=places, velocities=speeds, residual=residual)


def _dropped(pieces: list[BallPiece]) -> list[BallPiece]:
    """Add falls: where heights are unknown, a ball that arrives high at a player falls from there."""
    out = []
    for piece in pieces:
        joined = out and abs(out[-1].end - piece.start) < 1e-6
        above = out[-1].positions[-1, 2] - piece.positions[0, 2] if joined else 0.0
        out.append(_falling(piece, float(out[-1].positions[-1, 2])) if above > 1e-6 else piece)
    return out


def _falling(piece: BallPiece, height: float) -> BallPiece:
    """Build the same piece with a fall from `height` m down to its own trajectory."""
    since = piece.times - piece.start
    falls = height - 0.5 * FOOTBALL.gravity * since**2
    higher = falls > piece.positions[:, 2]
    places, speeds = piece.positions.copy(), piece.velocities.copy()
    places[higher, 2], speeds[higher, 2] = falls[higher], -FOOTBALL.gravity * since[higher]
    return replace(piece, positions=places, velocities=speeds)


def _waves(share: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Build shift shapes over a stretch.

    Args:
        share: (n,) of the stretch, 0 to 1.
        seconds: s, its duration.
    Returns:
        Shapes (n, 2 + W): one is 1 at the start, one is 1 at the end, the others are 0 at both; and their slopes 1/s.
    """
    count = int(np.clip(round(seconds / _WAVE), 1, 6))
    angles = np.pi * np.arange(1, count + 1)
    values = np.column_stack([1.0 - share, share, np.sin(share[:, None] * angles)])
    one = np.ones_like(share)
    return values, np.column_stack([-one, one, angles * np.cos(share[:, None] * angles)]) / seconds
