"""Drawn lines as paths: dense or sparse polylines rounded to curves that a body can follow; tables of points
`x_m,y_m[,z_m]`; and B-splines with control points (Path editing §4.6.6).
"""

from __future__ import annotations

import os

import numpy as np

from ..base.errors import InputError, format_count
from ..base.time_series import find_runs, interpolate_columns
from ..base.vectors import distances_along, unit_vectors
from ..files.tables import parse_number, read_rows
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path, SplinePath
from ..motion.path.smooth_spline import fit_smoothing_spline

ROUNDING = 0.15
"""Metres over which corners are rounded, about."""
SHORTEST = 0.2
"""Metres that a line needs at least."""
_SAMPLE = 1 / 4  # of the rounding, between samples of the line
_PIECE = 1 / 2  # of the rounding, a piece of the spline
_LONGEST = 5000  # roundings: longer lines are rounded more
_HAIRPIN = 5.0  # roundings from the tip of a hairpin to where the line starts to swing out
_LARGEST = (6 / 7) ** 3 / np.sqrt(7)  # largest value of x (1 - x^2)^3
_ORDER = 3  # the change of curvature has a cost, so that a constant curvature is kept up to the line's ends

COLUMNS = ("x_m", "y_m", "z_m")
_SHORT = {name[0]: name for name in COLUMNS}
_LEAST_METRES, _MOST_METRES = 1e-6, 1e5  # of a table


def fit_line(line: np.ndarray, name: str, rounding: float = ROUNDING, closed: bool = False) -> SplinePath:
    """Fit a smooth path along a polyline; its parameter is about metres along it.

    Repeated points are dropped. Corners are rounded over some `rounding` metres; smooth lines of radius 1 m or more are
    kept within a millimetre (up to 750 m of them), and the ends of an open line exactly.

    Args:
        line: (N, 3) metres.
        name: of the line, for messages.
        rounding: metres.
        closed: join the last point to the first.
    Returns:
        The spline path.
    Raises:
        InputError: for fewer than two different points, values that are not finite, or lines shorter than SHORTEST.
    """
    line = _check_line(line, name, closed)
    length = distances_along(line)[-1]
    rounding = max(min(rounding, length / 12), length / _LONGEST)
    sampled, along = _resample_line(_thin_line(line, rounding * _SAMPLE), rounding * _SAMPLE)
    sampled = _widen_hairpins(sampled, along, rounding, closed)
    pieces = max(int(np.ceil(along[-1] / (rounding * _PIECE))), 8)
    if closed:
        spline = fit_smoothing_spline(sampled[:-1], along[:-1], pieces, rounding, _ORDER, closed=True,
                                      domain=(0.0, along[-1]))
    else:
        weights = np.ones(len(along))
        spline = fit_smoothing_spline(sampled, along, pieces, stiff=rounding, order=_ORDER, weights=weights,
                                      keep_ends=True)
    return SplinePath(*spline, closed=closed)


def build_b_spline(points: np.ndarray, degree: int) -> SplinePath:
    """Build the B-spline of control points; it starts at the first and ends at the last, its parameter is 0 to 1.

    Knots: those of each end repeated degree + 1 times, the others even: P + degree + 1 of them (§4.6.6 says minus one,
    which cannot be).

    Args:
        points: (P, 3) metres.
        degree: 1 or more, less than P.
    Returns:
        The spline path.
    Raises:
        InputError: for another degree, or for points that `fit_line` rejects.
    """
    points = np.asarray(points, dtype=float)
    _check_line(points, "control points", closed=False)
    _check_degree(len(points), degree)
    return SplinePath(_build_knots(len(points), degree), points, degree)


def fit_control_points(path: Path, count: int, degree: int) -> np.ndarray:
    """Fit the control points of the B-spline nearest to a path, with the same ends.

    Least squares over even steps of arc length, so that control points are even too.

    Args:
        path: to approximate.
        count: of control points.
        degree: 1 or more, less than `count`.
    Returns:
        (count, 3) metres, for `build_b_spline`.
    Raises:
        InputError: for another degree.
    """
    from scipy.interpolate import BSpline

    _check_degree(count, degree)
    places, share = _sample_evenly(path, max(8 * count, 200))
    origin = places.mean(axis=0)
    places = places - origin
    design = BSpline.design_matrix(share, _build_knots(count, degree), degree).toarray()
    ends = places[[0, -1]]
    inner = np.linalg.lstsq(design[:, 1:-1], places - design[:, [0, -1]] @ ends, rcond=None)[0]
    return np.concatenate([ends[:1], inner, ends[1:]]) + origin


def build_straight_points(path: Path, count: int) -> np.ndarray:
    """Build even control points on a straight line from the start of a path to its end: a neutral start (§4.6.6).

    If the path ends where it starts, the line leads to its farthest place.

    Args:
        path: whose ends are used.
        count: of control points.
    Returns:
        (count, 3) metres.
    Raises:
        InputError: for fewer than two points.
    """
    _check_degree(count, 1)
    places, _ = _sample_evenly(path, 200)
    first, last = places[0], places[-1]
    if np.linalg.norm(last - first) < SHORTEST:
        last = places[np.argmax(np.linalg.norm(places - first, axis=1))]
    return first + np.linspace(0.0, 1.0, count)[:, None] * (last - first)


def _check_degree(count: int, degree: int) -> None:
    """Raise InputError if a B-spline of `count` control points cannot have this degree."""
    if not 1 <= degree < count:
        raise InputError("control points", f"{count} points for degree {degree}", f"{max(degree, 1) + 1} or more",
                         "use more points or a lower degree")


def _build_knots(count: int, degree: int) -> np.ndarray:
    """Build (count + degree + 1,) knots from 0 to 1."""
    return np.concatenate([np.zeros(degree), np.linspace(0.0, 1.0, count - degree + 1), np.ones(degree)])


def _sample_evenly(path: Path, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Sample places (count, 3) at even steps of arc length, with their share (count,) of the path."""
    share, arc = np.linspace(0.0, 1.0, count), ArcLength(path)
    u = arc.parameter_at(share * arc.length)
    u[-1] = path.domain[1] - (1e-12 * (path.domain[1] - path.domain[0]) if path.closed else 0.0)
    return path.at(u), share


def _check_line(line: np.ndarray, name: str, closed: bool) -> np.ndarray:
    """Check a line; return it without repeated points, closed if requested, or raise InputError."""
    line = np.asarray(line, dtype=float)
    if line.ndim != 2 or line.shape[1] != 3:
        raise InputError(name, f"is an array of shape {line.shape}", "points with three coordinates")
    if not np.isfinite(line).all():
        where = np.flatnonzero(~np.isfinite(line).all(axis=1))[0]
        raise InputError(name, f"point {where + 1} is not finite", "finite coordinates in metres")
    if closed and len(line):
        line = np.concatenate([line, line[:1]])
    if len(line):
        line = line[np.append(True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-9)]
    if len(line) < 2:
        raise InputError(name, "all points are equal", "at least two different points", "draw a longer line")
    if (length := distances_along(line)[-1]) < SHORTEST:
        raise InputError(name, f"is {length:.3g} m long", f"{SHORTEST} m or more", "draw a longer line")
    return line


def _thin_line(line: np.ndarray, step: float) -> np.ndarray:
    """Average points denser than `step` metres, so that their noise does not lengthen the line."""
    along = distances_along(line)
    cell = np.floor(along / step).astype(int)
    first = np.flatnonzero(np.diff(cell, prepend=-1))
    count = np.diff(np.append(first, len(line)))
    if count.max() == 1:
        return line
    means = np.add.reduceat(line, first, axis=0) / count[:, None]
    means[0], means[-1] = line[0], line[-1]
    return means


def _widen_hairpins(line: np.ndarray, along: np.ndarray, rounding: float, closed: bool) -> np.ndarray:
    """Add room to turn (M, 3) where the line, `along` (M,) metres, turns by more than a right angle.

    Before the tip the line swings to the outer side, after it to the inner one, by up to `rounding` metres: a body on a
    line that reverses would have to stop and turn on the spot.
    """
    step, count = along[1], len(line) - closed
    reach = max(int(round(rounding / step)), 1)
    inner = np.arange(count) if closed else np.arange(reach, count - reach)
    came, goes = _compute_directions(line, inner, reach, count)
    excess = np.zeros(count)
    excess[inner] = np.arccos(np.clip(np.einsum("mi,mi->m", came, goes), -1.0, 1.0)) / (np.pi / 2) - 1.0
    # `excess`: angle beyond a right one, in right angles. Closed lines are rolled so that no turn spans the array's
    # end.
    first = int(np.argmin(excess)) if closed else 0  # no turn there
    turns = [np.arange(*turn) + first for turn in find_runs(np.roll(excess, -first) > 0.0)]
    if not turns:
        return line
    places = step * np.array([np.average(turn, weights=excess[turn % count]) for turn in turns])
    out = line.copy()
    for turn, place, room in zip(turns, places, _measure_room(places, along[-1], closed)):
        peak, wide = turn[np.argmax(excess[turn % count])] % count, min(_HAIRPIN * rounding, room)
        off = along - place
        if closed:
            off = (off + along[-1] / 2) % along[-1] - along[-1] / 2
        off = np.clip(off / wide, -1.0, 1.0)
        swing = excess[peak] * wide / _HAIRPIN * off * (1.0 - off**2) ** 3 / _LARGEST
        out += swing[:, None] * _compute_outer_side(came[peak - inner[0]], goes[peak - inner[0]])
    return out


def _compute_directions(line: np.ndarray, at: np.ndarray, reach: int, period: int) -> tuple[np.ndarray, ...]:
    """Compute unit directions (M, 3) from `reach` samples before to samples `at` (M,), and from there to `reach` after.

    period: samples of a lap, for closed lines.
    """
    before, after = (at - reach) % period, (at + reach) % period
    chords = line[at] - line[before], line[after] - line[at]
    return tuple(unit_vectors(chord, min_length=1e-12) for chord in chords)


def _measure_room(places: np.ndarray, length: float, closed: bool) -> np.ndarray:
    """Measure the metres (P,) from each turn to the next one or to the line's end; places (P,) metres along it,
    rising.
    """
    before = places[-1] - length if closed else 0.0
    after = places[0] + length if closed else length
    return np.minimum(np.diff(places, prepend=before), np.diff(places, append=after))


def _compute_outer_side(came: np.ndarray, goes: np.ndarray) -> np.ndarray:
    """Compute the horizontal unit vector (3,) to the side to which a line turns, from its directions before and
    after.
    """
    side = np.array([goes[1] - came[1], came[0] - goes[0], 0.0])  # left of the turn's tip
    size = np.linalg.norm(side)
    side = side / size if size > 1e-6 else np.array([1.0, 0.0, 0.0])
    return -side if came[0] * goes[1] - came[1] * goes[0] < -1e-9 else side


def _resample_line(line: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Resample a polyline evenly: samples (M, 3) about `step` metres apart, and metres (M,) along it."""
    along = distances_along(line)
    even = np.linspace(0.0, along[-1], max(int(np.ceil(along[-1] / step)) + 1, 16))
    return interpolate_columns(even, along, line), even


def read_curve(path: str | os.PathLike) -> np.ndarray:
    """Read the points of a path from a CSV file, in the order of its rows.

    z is 0 if the column is missing; other columns are ignored. Columns may also be named x, y and z, and be separated
    by semicolons or tabs; then numbers may have decimal commas.

    Args:
        path: of the file.
    Returns:
        (N, 3) metres, N >= 2, pitch frame.
    Raises:
        InputError: with the line, if a cell is not a number or is beyond 10 km; if the file has fewer than two
            different points, or more than 100 km of path.
    """
    names, points = COLUMNS[:2], []
    for place, row in read_rows(path, names, _SHORT, ",;\t"):
        if not points:
            names = COLUMNS if "z_m" in row else names
        points.append([parse_number(row[name], name, place) for name in names])
    line = np.zeros((len(points), 3))
    if points:
        line[:, : len(names)] = points
    if not len(line) or np.ptp(line, axis=0).max() < _LEAST_METRES:
        what = format_count(len(line), "point") + (", all at one place" if len(line) > 1 else "")
        raise InputError(path, what, "at least two rows under x_m,y_m[,z_m] with different places", "add points")
    if (length := np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) > _MOST_METRES:
        most = f"at most {_MOST_METRES / 1000:.0f} km"
        raise InputError(path, f"a path of {length / 1000:.0f} km", most, "check the unit")
    return line
