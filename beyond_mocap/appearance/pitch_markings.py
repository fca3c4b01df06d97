"""The lines of a pitch, from the marks of its sport: strips and discs in metres around the centre spot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .sports import Sport

CHORD = 3.0  # degrees, an arc's longest chord


@dataclass(frozen=True, eq=False)
class Marking:
    """A line's centre, or the edge of a spot.

    Attributes:
        points: (N, 2) metres; x along the length, y to the left; closed where the first is the last.
        width: of the line, m; 0: the points are the edge of a filled spot, counter-clockwise.
        colour: name of a paint.
    """

    points: np.ndarray
    width: float
    colour: str = "white"


def build_markings(sport: Sport, size: tuple[float, float]) -> list[Marking]:
    """Build all lines of a pitch.

    A mark's numbers are metres and degrees. The kinds: `halfway`; `circle` and `centre` (a spot) with a radius, at the
    centre; and at both ends, x inwards from the end line, y from the middle, an angle of 0 inwards: `across` (x), a
    line over the whole width; `box` (depth, width); `line` (x, y, x, y ..); `arc` (x, y, radius, from, to); `spot`
    (x, y, radius). `along` (y) is a line of the whole length, y in from each touchline, and `corner` (radius) the arcs
    there. Options: `width` of the line, `colour`, and `dash`, the lengths of a piece and of the gap after it.

    Args:
        sport: whose lines.
        size: length and width of the pitch, m.
    Returns:
        The lines, the outline first.
    """
    length, width = size
    found = [Marking(_build_outline(length, width, sport.rounding), sport.line)]
    if sport.behind:
        found.append(Marking(_build_outline(length + 2.0 * sport.behind, width, 0.0), sport.line))
    for kind, *rest in sport.marks:
        options = rest.pop() if rest and isinstance(rest[-1], dict) else {}
        wide = 0.0 if kind in ("spot", "centre") else options.get("width", sport.line)
        for points in _BUILDERS[kind](size, sport.rounding, *rest):
            pieces = _cut_dashes(points, *options["dash"]) if "dash" in options else [points]
            found += [Marking(piece, wide, options.get("colour", "white")) for piece in pieces]
    return found


def _build_outline(length: float, width: float, rounding: float) -> np.ndarray:
    """Build a closed rectangle with corners of a radius, counter-clockwise."""
    x, y = length / 2.0, width / 2.0
    if not rounding:
        return np.array([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)])
    corners = [_build_arc((a * (x - rounding), b * (y - rounding)), rounding, start, start + 90.0)
               for a, b, start in ((1, -1, -90.0), (1, 1, 0.0), (-1, 1, 90.0), (-1, -1, 180.0))]
    return np.concatenate([*corners, corners[0][:1]])


def _at_both_ends(size: tuple[float, float], points) -> list[np.ndarray]:
    """Turn points (N, 2), x inwards from an end line, into those of the left and of the right end."""
    left = np.asarray(points, float) - (size[0] / 2.0, 0.0)
    return [left, -left]


def _build_halfway(size, _rounding):
    return [np.array([(0.0, -size[1] / 2.0), (0.0, size[1] / 2.0)])]


def _build_circle(_size, _rounding, radius):
    return [_build_arc((0.0, 0.0), radius, 0.0, 360.0)]


def _build_across(size, rounding, x):
    """Build lines over the width, which rounded corners shorten."""
    cut = rounding - np.sqrt(rounding**2 - (rounding - x) ** 2) if x < rounding else 0.0
    y = size[1] / 2.0 - cut
    return _at_both_ends(size, [(x, -y), (x, y)])


def _build_along(size, _rounding, inside):
    x, y = size[0] / 2.0, size[1] / 2.0 - inside
    return [np.array([(-x, side * y), (x, side * y)]) for side in (-1.0, 1.0)]


def _build_box(size, _rounding, depth, width):
    return _at_both_ends(size, [(0.0, width / 2.0), (depth, width / 2.0), (depth, -width / 2.0), (0.0, -width / 2.0)])


def _build_line(size, _rounding, *numbers):
    return _at_both_ends(size, np.reshape(numbers, (-1, 2)))


def _build_end_arc(size, _rounding, x, y, radius, start, end):
    return _at_both_ends(size, _build_arc((x, y), radius, start, end))


def _build_spot(size, _rounding, x, y, radius):
    return [edge[:-1] for edge in _at_both_ends(size, _build_arc((x, y), radius, 0.0, 360.0))]


def _build_centre(_size, _rounding, radius):
    return [_build_arc((0.0, 0.0), radius, 0.0, 360.0)[:-1]]


def _build_corners(size, _rounding, radius):
    x, y = size[0] / 2.0, size[1] / 2.0
    return [_build_arc((a * x, b * y), radius, start, start + 90.0)
            for a, b, start in ((-1, -1, 0.0), (1, -1, 90.0), (1, 1, 180.0), (-1, 1, 270.0))]


_BUILDERS = {
    "halfway": _build_halfway, "circle": _build_circle, "centre": _build_centre, "across": _build_across,
    "along": _build_along, "box": _build_box, "line": _build_line, "arc": _build_end_arc, "spot": _build_spot,
    "corner": _build_corners,
}  # fmt: skip


def _build_arc(centre: tuple[float, float], radius: float, start: float, end: float) -> np.ndarray:
    """Build points (N, 2) of an arc between two angles in degrees."""
    angles = np.radians(np.linspace(start, end, max(16, int((end - start) / CHORD)) + 1))
    return np.array(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _cut_dashes(points: np.ndarray, piece: float, gap: float) -> list[np.ndarray]:
    """Cut a line (N, 2) into pieces with gaps; the first begins with the line."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    pieces = []
    for start in np.arange(0.0, along[-1] - 1e-6, piece + gap):
        end = min(start + piece, along[-1])
        inner = along[(along > start + 1e-6) & (along < end - 1e-6)]
        at = np.concatenate([[start], inner, [end]])
        pieces.append(np.stack([np.interp(at, along, column) for column in points.T], axis=1))
    return pieces
