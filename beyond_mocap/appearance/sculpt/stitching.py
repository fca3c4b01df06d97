"""Join pieces into one closed surface: borders are folded inwards to hems and stitched to what is below them."""

from __future__ import annotations

import numpy as np

from .meshing import Piece, list_borders


class Surface:
    """A surface that grows piece by piece.

    Attributes:
        vertices: rows (3,) m.
        faces: tuples of vertex indices, counterclockwise from outside.
        materials: a number for each face.
    """

    def __init__(self) -> None:
        self.vertices: list[np.ndarray] = []
        self.faces: list[tuple[int, ...]] = []
        self.materials: list[int] = []

    def add(self, piece: Piece) -> list[list[int]]:
        """Add a piece; return its borders, largest first, in the direction of its faces."""
        start = len(self.vertices)
        self.vertices.extend(piece.vertices)
        self.faces.extend(tuple(v + start for v in face) for face in piece.faces)
        self.materials.extend(piece.materials)
        borders = sorted(list_borders(piece.faces), key=len, reverse=True)
        return [[v + start for v in border] for border in borders]

    def middle(self, border: list[int]) -> np.ndarray:
        """Compute the middle (3,) m of a border."""
        return np.mean([self.vertices[v] for v in border], axis=0)

    def extend(self, border: list[int], points: np.ndarray, material: int) -> list[int]:
        """Extend the surface beyond a border to `points` (N, 3) m, one for each of its vertices; return the new
        border."""
        start = len(self.vertices)
        self.vertices.extend(points)
        made = list(range(start, start + len(border)))
        for i, j in _list_pairs(len(border)):
            self.faces.append((border[j], border[i], made[i], made[j]))
            self.materials.append(material)
        return made

    def bridge(self, first: list[int], second: list[int], axis, material: int) -> None:
        """Stitch two borders together around an axis (3,), both in the direction of their own faces."""
        other = second[::-1]
        a, b = self._measure_angles(first, axis), self._measure_angles(other, axis)
        if a[-1] < 0.0:
            a, b = -a, -b
        shift = int(np.argmin(np.abs(np.angle(np.exp(1j * (self._measure_start(other, first[0], axis)))))))
        other, b = other[shift:] + other[:shift], np.concatenate([b[shift:], b[:shift] + 2.0 * np.pi])
        b = b - b[0]
        self._stitch(first, other, (a, b), material)

    def _stitch(self, first, other, angles, material: int) -> None:
        a, b = (np.append(one, 2.0 * np.pi) for one in angles)
        i = j = 0
        while i < len(first) or j < len(other):
            p, q = first[i % len(first)], other[j % len(other)]
            more = i < len(first), j < len(other)
            if all(more) and abs(a[i + 1] - b[j + 1]) < 0.35 * min(a[i + 1] - a[i], b[j + 1] - b[j]):
                i, j = i + 1, j + 1
                self.faces.append((first[i % len(first)], p, q, other[j % len(other)]))
            elif not more[1] or (more[0] and a[i + 1] < b[j + 1]):
                i += 1
                self.faces.append((first[i % len(first)], p, q))
            else:
                j += 1
                self.faces.append((p, q, other[j % len(other)]))
            self.materials.append(material)

    def _flatten(self, border: list[int], axis) -> np.ndarray:
        """Compute the complex places (N,) of a border's vertices around its middle, across an axis."""
        along = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
        side = np.array([1.0, 0.0, 0.0]) if abs(along[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        right = side - (side @ along) * along
        right /= np.linalg.norm(right)
        points = np.array([self.vertices[v] for v in border]) - self.middle(border)
        return points @ right + 1j * (points @ np.cross(along, right))

    def _measure_angles(self, border: list[int], axis) -> np.ndarray:
        """Measure how far a border has gone around its middle at each vertex, radians from its first one."""
        flat = self._flatten(border, axis)
        return np.concatenate([[0.0], np.cumsum(np.angle(flat[1:] / flat[:-1]))])

    def _measure_start(self, border: list[int], vertex: int, axis) -> np.ndarray:
        """Measure the angles (N,) between a border's vertices and another vertex."""
        along = self._flatten([vertex, *border], axis)  # around nearly the same middle
        return np.angle(along[1:] / along[0])


def _list_pairs(count: int) -> list[tuple[int, int]]:
    return [(i, (i + 1) % count) for i in range(count)]
