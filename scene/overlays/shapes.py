"""Vertex arrays in metres, float32: triangles as (3 N, 3) points, lines as (2 N, 3) points."""

from __future__ import annotations

import numpy as np

from ...beyond_mocap.base.vectors import cross_product, unit_vector

SOLE = np.array([  # outline of a left shoe, length 1, heel at x = 0, toes at x = 1, the body's middle at -y
    (0.02, 0.00), (0.05, 0.10), (0.17, 0.15), (0.32, 0.14), (0.48, 0.15), (0.65, 0.19), (0.80, 0.18), (0.92, 0.11),
    (0.99, -0.01), (0.98, -0.11), (0.90, -0.17), (0.76, -0.18), (0.60, -0.14), (0.44, -0.10), (0.28, -0.11),
    (0.13, -0.13), (0.04, -0.10),
])  # fmt: skip
HEEL_SHARE = 0.2  # share of a shoe's length behind the ankle
LENGTHS = (0.22, 0.32)  # metres, limits of a shoe's length
USUAL = 0.28  # metres of a shoe without toe joints
CIRCLE = 24  # segments
BARB = 0.14, 0.08  # metres along and across an arrow


def build_soles(heel: np.ndarray, toe: np.ndarray, direction: np.ndarray, side: np.ndarray, height: float):
    """Build shoe soles of N stances with K corners each.

    Args:
        heel: (N, 2) metres of the heel joints.
        toe: (N, 2) metres of the toe joints.
        direction: (N,) radians.
        side: (N,) 0 left, 1 right.
        height: metres above the ground.
    Returns:
        Triangles (N * K * 3, 3), and outlines as lines (N * K * 2, 3).
    """
    span = np.linalg.norm(toe - heel, axis=1)
    jointed = span > 0.02
    length = np.where(jointed, np.clip(1.9 * span, *LENGTHS), USUAL)
    ahead = np.stack([np.cos(direction), np.sin(direction)], axis=1)
    aside = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) * np.where(side == 0, 1.0, -1.0)[:, None]
    outline = SOLE - [HEEL_SHARE, 0.0]
    x, y = outline[:, 0] * length[:, None], outline[:, 1] * length[:, None]
    corners = heel[:, None] + x[..., None] * ahead[:, None] + y[..., None] * aside[:, None]
    middle = np.broadcast_to((heel + 0.3 * length[:, None] * ahead)[:, None], corners.shape)
    after = np.roll(corners, -1, axis=1)
    return (place_on_ground(np.stack([middle, corners, after], axis=2).reshape(-1, 2), height),
            place_on_ground(np.stack([corners, after], axis=2).reshape(-1, 2), height))


def build_rails(path: np.ndarray, inner: float, outer: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Build two bands along a path.

    Args:
        path: (T, 2) metres.
        inner: metres from the path to the bands.
        outer: metres from the path to their outer edges.
        height: metres above the ground.
    Returns:
        Triangles (12 (T - 1), 3), and the path point of each corner.
    """
    aside = compute_left(path)
    bands = [_build_band(path + sign * inner * aside, path + sign * outer * aside, height) for sign in (1.0, -1.0)]
    return tuple(np.concatenate(parts) for parts in zip(*bands))


def _build_band(left: np.ndarray, right: np.ndarray, height: float) -> tuple[np.ndarray, np.ndarray]:
    a, b = np.arange(len(left) - 1), np.arange(1, len(left))
    corners = np.stack([left[a], right[a], right[b], left[a], right[b], left[b]], axis=1)
    owner = np.stack([a, a, b, a, b, b], axis=1)
    return place_on_ground(corners.reshape(-1, 2), height), owner.ravel()


def build_curtain(path: np.ndarray, top: np.ndarray, foot: float) -> np.ndarray:
    """Build an upright band along path (T, 2) m from height `foot` to top (T,) m: triangles (6 (T - 1), 3)."""
    low = place_on_ground(path, foot)
    high = np.concatenate([path, top[:, None]], axis=1).astype(np.float32)
    a, b = slice(None, -1), slice(1, None)
    return np.stack([low[a], low[b], high[b], low[a], high[b], high[a]], axis=1).reshape(-1, 3)


def build_polyline(points: np.ndarray) -> np.ndarray:
    """Build lines (2 (T - 1), 3) through points (T, 3) m."""
    return np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 3).astype(np.float32)


def build_bars(path: np.ndarray, at: np.ndarray, half_width: float, height: float) -> np.ndarray:
    """Build bars across path (T, 2) m at its points `at` (S,): lines (2 S, 3)."""
    aside = compute_left(path)[at] * half_width
    return place_on_ground(np.stack([path[at] - aside, path[at] + aside], axis=1).reshape(-1, 2), height)


def build_circle(centre, radius: float, up: bool = False) -> np.ndarray:
    """Build a circle about centre (3,) m, flat, or also upright in two planes: lines (n, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, CIRCLE + 1)
    c, s, zero = radius * np.cos(angle), radius * np.sin(angle), np.zeros(CIRCLE + 1)
    rings = [np.stack(parts, axis=1) for parts in ((c, s, zero), (c, zero, s), (zero, c, s))]
    return np.concatenate([build_polyline(ring + centre) for ring in (rings if up else rings[:1])])


def build_disc(radius: float) -> np.ndarray:
    """Build a flat disc about the origin: triangles (3 CIRCLE, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, CIRCLE + 1)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)
    return np.stack([0.0 * rim[:-1], rim[:-1], rim[1:]], axis=1).reshape(-1, 3).astype(np.float32)


def build_cross(centre, size: float) -> np.ndarray:
    """Build a three-dimensional cross: lines (6, 3)."""
    arms = np.eye(3).repeat(2, axis=0) * np.tile([size, -size], 3)[:, None]
    return (arms + centre).astype(np.float32)


def build_arrows(places: np.ndarray, headings: np.ndarray, length: float, height: float) -> np.ndarray:
    """Build flat arrows.

    Args:
        places: (N, 2) m, where they begin.
        headings: (N,) rad from +x.
        length: m.
        height: m above the ground.
    Returns:
        Lines (6 N, 3): shaft, left barb, right barb of each.
    """
    ahead = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    aside = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    tips, back = places + length * ahead, places + (length - BARB[0]) * ahead
    corners = [places, tips, tips, back + BARB[1] * aside, tips, back - BARB[1] * aside]
    return place_on_ground(np.stack(corners, axis=1).reshape(-1, 2), height)


def build_arrow(start: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Build an upright arrow from start to tip, both (3,) m: lines (6, 3), shaft and two barbs."""
    way = unit_vector(tip - start)
    aside = unit_vector(cross_product(way, np.array([0.0, 0.0, 1.0])), np.array([1.0, 0.0, 0.0]), 1e-3)
    back = tip - min(BARB[0], 0.5 * float(np.linalg.norm(tip - start))) * way
    return np.stack([start, tip, tip, back + BARB[1] * aside, tip, back - BARB[1] * aside]).astype(np.float32)


def list_figure_pairs(parents) -> np.ndarray:
    """List the joints (B, 2) that the lines of a stick figure join, without the root's own line."""
    return np.array([(parent, joint) for joint, parent in enumerate(parents) if parent >= 0])


def compute_left(path: np.ndarray) -> np.ndarray:
    """Compute unit vectors (T, 2) to the left of a path (T, 2); where it stays in place, those of the frame before."""
    step = np.gradient(path, axis=0) if len(path) > 1 else np.ones((1, 2))
    length = np.linalg.norm(step, axis=1)
    moving = length > 1e-4
    if not moving.any():
        return np.tile([0.0, 1.0], (len(path), 1))
    last = np.maximum.accumulate(np.where(moving, np.arange(len(path)), -1))
    step = step[np.where(last < 0, np.argmax(moving), last)]
    step = step / np.linalg.norm(step, axis=1, keepdims=True)
    return np.stack([-step[:, 1], step[:, 0]], axis=1)


def place_on_ground(points: np.ndarray, height: float) -> np.ndarray:
    """Build points (N, 3) float32 from points (N, 2) m at one height."""
    return np.concatenate([points, np.full((len(points), 1), height)], axis=1).astype(np.float32)
