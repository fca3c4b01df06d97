"""Ground height of any mesh: triangles sorted into a grid of square cells seen from above."""

from __future__ import annotations

import numpy as np

from ...base.errors import InputError
from ..skeleton import frozen_array

_EDGE = 1e-9  # barycentric tolerance: a point on an edge is on both its triangles
_STEEPEST = 1e-6  # upward part of a triangle's normal below which it is a wall, which has no height
_ENTRIES = 8  # entries per triangle in all cells together, at most


class Terrain:
    """A mesh to stand on.

    Walls are no ground, bridges are: every surface counts, in whichever direction its normal points.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray):
        """Build the grid of a mesh.

        Args:
            vertices: (V, 3) metres, world.
            triangles: (F, 3) vertex indices.
        Raises:
            InputError: if an index is out of range or a vertex is not finite.
        """
        corners = _corners(vertices, triangles)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normals, axis=1)
        flat = np.abs(normals[:, 2]) > _STEEPEST * np.where(size > 0.0, size, np.inf)
        corners, normals = corners[flat], normals[flat]
        sides = corners[:, 1:] - corners[:, :1]
        self._normals = frozen_array(normals / (np.sign(normals[:, 2]) * size[flat])[:, None])
        self._first = frozen_array(corners[:, 0])
        self._inverse = frozen_array(np.linalg.inv(sides[:, :, :2]))  # (dx, dy) @ inverse = shares of the two sides
        self._rise = frozen_array(sides[:, :, 2])
        self._sort(corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1))

    def heights(self, places: np.ndarray, below: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the highest ground not above a limit.

        Args:
            places: (N, 2) metres, world.
            below: (N,) metres, the limits.
        Returns:
            Heights (N,) in metres and unit normals (N, 3), upward; NaN where there is no ground.
        """
        places, below = np.asarray(places, dtype=float), np.asarray(below, dtype=float)
        asked, triangle = self._candidates(places)
        shares = np.einsum("pi,pij->pj", places[asked] - self._first[triangle, :2], self._inverse[triangle])
        height = self._first[triangle, 2] + np.einsum("pi,pi->p", shares, self._rise[triangle])
        inside = (shares >= -_EDGE).all(axis=1) & (shares.sum(axis=1) <= 1.0 + _EDGE) & (height <= below[asked])
        asked, triangle, height = asked[inside], triangle[inside], height[inside]
        # sorted by place, then height: the last entry of each place is its highest ground
        order = np.lexsort((height, asked))
        asked, triangle, height = asked[order], triangle[order], height[order]
        highest = np.flatnonzero(np.diff(asked, append=-1))
        heights, normals = np.full(len(places), np.nan), np.full((len(places), 3), np.nan)
        heights[asked[highest]], normals[asked[highest]] = height[highest], self._normals[triangle[highest]]
        return heights, normals

    def _sort(self, low: np.ndarray, high: np.ndarray) -> None:
        """Build the grid, as fine as the triangles allow, from their bounds (F, 2) each."""
        self._origin = low.min(axis=0) if len(low) else np.zeros(2)
        extent = high.max(axis=0) - self._origin if len(low) else np.ones(2)
        self._cell = max(np.sqrt(np.prod(extent) / max(len(low), 1)), 1e-6)
        while True:
            first, last = (np.floor((end - self._origin) / self._cell).astype(int) for end in (low, high))
            wide = last - first + 1
            count = np.prod(wide, axis=1)
            if count.sum() <= _ENTRIES * len(low):
                break
            self._cell *= 2.0
        self._shape = np.floor(extent / self._cell).astype(int) + 1
        # one entry for every cell that a triangle's bounds cover, row by row; then sorted by cell, `_begin` pointing to
        # each
        triangle = np.repeat(np.arange(len(low)), count)
        step = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
        row, column = first[triangle, 0] + step // wide[triangle, 1], first[triangle, 1] + step % wide[triangle, 1]
        cell = row * self._shape[1] + column
        self._inhabitants = triangle[np.argsort(cell, kind="stable")]
        self._begin = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=np.prod(self._shape)))])

    def _candidates(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find pairs of a requested place and a triangle in the same cell: (P,) and (P,), the places rising."""
        cell = np.floor((places - self._origin) / self._cell)
        on = np.flatnonzero(((cell >= 0) & (cell < self._shape)).all(axis=1))
        number = cell[on].astype(int) @ np.array([self._shape[1], 1])
        begin, count = self._begin[number], np.diff(self._begin)[number]
        step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        return np.repeat(on, count), self._inhabitants[np.repeat(begin, count) + step]


def _corners(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Collect the positions (F, 3, 3) of the triangles' corners, or raise InputError."""
    vertices, triangles = np.asarray(vertices, dtype=float).reshape(-1, 3), np.asarray(triangles).reshape(-1, 3)
    if not np.isfinite(vertices).all():
        raise InputError("ground", "a vertex that is not finite", "metres")
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        wrong = triangles.min() if triangles.min() < 0 else triangles.max()
        raise InputError("ground", f"a triangle of vertex {wrong}", f"vertices 0 to {len(vertices) - 1}")
    return vertices[triangles.astype(int)]
