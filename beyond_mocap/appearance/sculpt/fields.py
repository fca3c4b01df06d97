"""Distance fields: functions of points that are negative inside a solid, about metres near its surface.

Points are (N, 3) m and results (N,) m throughout. Solids are joined with a smooth blend (the polynomial smooth minimum
of Quilez 2013, "Smooth minimum"), so shoulders, hips and fingers have no seams.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Field = Callable[[np.ndarray], np.ndarray]


def build_ellipsoid(centre, radii) -> Field:
    """Build an ellipsoid.

    Args:
        centre: (3,) m.
        radii: (3,) m along x, y and z.
    """
    middle, half = np.array(centre, dtype=float), np.array(radii, dtype=float)

    def measure(points: np.ndarray) -> np.ndarray:
        scaled = (points - middle) / half
        first = np.linalg.norm(scaled, axis=1)
        return first * (first - 1.0) / np.maximum(np.linalg.norm(scaled / half, axis=1), 1e-9)

    return measure


def build_cone(start, end, first: float, last: float) -> Field:
    """Build a capsule whose radius changes from `first` to `last`, m."""
    low, along = np.array(start, dtype=float), np.subtract(end, start).astype(float)

    def measure(points: np.ndarray) -> np.ndarray:
        share = np.clip((points - low) @ along / (along @ along), 0.0, 1.0)
        return np.linalg.norm(points - low - share[:, None] * along, axis=1) - (first + share * (last - first))

    return measure


def build_chain(nodes) -> Field:
    """Build capsules from node to node; nodes are rows (x, y, z, radius) m."""
    rows = np.array(nodes, dtype=float)
    cones = [build_cone(a[:3], b[:3], a[3], b[3]) for a, b in zip(rows, rows[1:])]
    return lambda points: np.min([cone(points) for cone in cones], axis=0)


def build_loft(table, roundness: float = 2.0) -> Field:
    """Build a solid from sections across the vertical.

    Args:
        table: rows (z, x and y of the middle, extents to the front, back, left and right) m, z rising or falling; y may
            be left out, then it is 0.
        roundness: exponent of the sections: 2 is an ellipse, more is boxier.
    """
    from scipy.interpolate import PchipInterpolator

    rows = np.array(sorted(map(tuple, table)), dtype=float)
    if rows.shape[1] == 6:
        rows = np.insert(rows, 2, 0.0, axis=1)
    curve = PchipInterpolator(rows[:, 0], rows[:, 1:])
    low, high = rows[0, 0], rows[-1, 0]

    def measure(points: np.ndarray) -> np.ndarray:
        height = np.clip(points[:, 2], low, high)
        x, y, front, back, left, right = curve(height).T
        ahead, aside = points[:, 0] - x, points[:, 1] - y
        deep, wide = np.where(ahead > 0.0, front, back), np.where(aside > 0.0, left, right)
        first = (np.abs(ahead / deep) ** roundness + np.abs(aside / wide) ** roundness) ** (1.0 / roundness)
        slope = np.hypot(ahead / deep**2, aside / wide**2) / np.maximum(np.hypot(ahead / deep, aside / wide), 1e-9)
        across = np.where(first > 0.3, (first - 1.0) / np.maximum(slope, 1e-9), -np.minimum(deep, wide) * (1.0 - first))
        beyond = np.abs(points[:, 2] - height)
        return np.where(beyond > 0.0, np.hypot(np.maximum(across, 0.0), beyond), across)

    return measure


def join(blend: float, *fields: Field) -> Field:
    """Join solids smoothly; `blend` is about the width in metres over which they merge."""

    def measure(points: np.ndarray) -> np.ndarray:
        result = fields[0](points)
        for field in fields[1:]:
            result = blend_minimum(result, field(points), blend)
        return result

    return measure


def carve(blend: float, solid: Field, *tools: Field) -> Field:
    """Carve tools out of a solid, with edges rounded over `blend` metres."""

    def measure(points: np.ndarray) -> np.ndarray:
        result = solid(points)
        for tool in tools:
            result = -blend_minimum(-result, tool(points), blend)
        return result

    return measure


def blend_minimum(first: np.ndarray, second: np.ndarray, blend: float) -> np.ndarray:
    """Compute the smooth minimum of two distances (N,) m."""
    near = np.clip(0.5 + 0.5 * (second - first) / blend, 0.0, 1.0)
    return second + (first - second) * near - blend * near * (1.0 - near)


def mirror(field: Field) -> Field:
    """Mirror a solid from the left to the right."""
    return lambda points: field(points * np.array([1.0, -1.0, 1.0]))


def place(field: Field, origin, turn: np.ndarray) -> Field:
    """Place a solid given in a frame of its own: `turn` (3, 3) rotates that frame's axes, `origin` (3,) m is moved
    to."""
    return lambda points: field((points - np.asarray(origin)) @ turn)
