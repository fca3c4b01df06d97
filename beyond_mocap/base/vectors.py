"""Vectors: length one, cross products, angles, the way along a line."""

from __future__ import annotations

import numpy as np


def unit_vectors(vectors: np.ndarray, otherwise: np.ndarray | float | None = None, least: float = 1e-9) -> np.ndarray:
    """Vectors at length one.

    Args:
        vectors: (..., K), any unit.
        otherwise: (..., K), what stands for vectors no longer than `least`; None divides them by `least`, so that zero
            vectors stay zero.
        least: length below which a vector is not stretched to length one, in its unit.
    Returns:
        (..., K).
    """
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit = vectors / np.maximum(length, least)
    return unit if otherwise is None else np.where(length > least, unit, otherwise)


def unit_vector(vector: np.ndarray, otherwise: np.ndarray | None = None, least: float = 1e-9) -> np.ndarray:
    """One vector at length one: as `unit_vectors`, but its length comes from a dot product, which rounds differently.

    Args:
        vector: (K,), any unit.
        otherwise: (K,), what stands for a vector no longer than `least`; None divides it by `least`.
        least: length below which it is not stretched to length one, in its unit.
    Returns:
        (K,).
    """
    length = np.linalg.norm(vector)
    return otherwise if otherwise is not None and not length > least else vector / max(length, least)


def nearest_axis(vector: np.ndarray) -> np.ndarray:
    """The coordinate axis, with its sign, that lies nearest to a vector.

    Args:
        vector: (3,), any unit.
    Returns:
        (3,), unit.
    """
    number = int(np.argmax(np.abs(vector)))
    return np.eye(3)[number] * np.sign(vector[number])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products, several times faster than `numpy.cross` on long arrays.

    Args:
        a, b: (..., 3).
    Returns:
        (..., 3).
    """
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def cross_level(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vertical component of the cross products of vectors on the ground: positive where b lies to the left of a.

    Args:
        a, b: (..., K), K at least 2; the first two components count.
    Returns:
        (...).
    """
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def skew_matrix(v: np.ndarray, xp=np) -> np.ndarray:
    """The matrix whose product with a vector is the cross product v x vector.

    Args:
        v: (..., 3).
        xp: array module, numpy or jax.numpy.
    Returns:
        (..., 3, 3).
    """
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    zero = xp.zeros_like(x)
    return xp.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*v.shape[:-1], 3, 3)


def distance_along(line: np.ndarray) -> np.ndarray:
    """Distance along a polyline from its first point to each.

    Args:
        line: (N, K), m.
    Returns:
        (N,), m.
    """
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def arctan2(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """`numpy.arctan2` in radians of arrays that go together.

    numpy works out a column of a wider array by another formula, up to two units in the last place away, whenever the
    result happens to lie right behind that array in memory. Contiguous copies never touch what comes out."""
    return np.arctan2(np.asarray(y, order="C"), np.asarray(x, order="C"))
