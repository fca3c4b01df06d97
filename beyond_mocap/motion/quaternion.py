"""Rotations as unit quaternions (w, x, y, z); every function takes any leading axes.

Conventions: `multiply(a, b)` rotates by b first, then by a; `rotate(q, v)` rotates column vectors; angles are radians.
Euler angles are intrinsic, in the order of their letters ("ZXY": about Z, then the rotated X, then the rotated Y),
which is how BVH channels are read (Faustino §4.2.1 eq. 30-31 is the case "ZXY").
"""

from __future__ import annotations

import numpy as np

from ..base.vectors import arctan2, cross_product, dot_products, measure_lengths, unit_vectors

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
IDENTITY.setflags(write=False)
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
_AXES = {"X": 0, "Y": 1, "Z": 2}


def identity(*shape: int) -> np.ndarray:
    """Build identity rotations: (*shape, 4)."""
    out = np.zeros((*shape, 4))
    out[..., 0] = 1.0
    return out


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compose rotations.

    Args:
        a: (..., 4) the rotation applied second.
        b: (..., 4) the rotation applied first.
    Returns:
        (..., 4) b followed by a.
    """
    a, b = np.asarray(a), np.asarray(b)
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    w = aw * bw - ax * bx - ay * by - az * bz
    out = np.empty((*w.shape, 4), w.dtype)  # filled by component: twice as fast as a stack of four
    out[..., 0], out[..., 1] = w, aw * bx + ax * bw + ay * bz - az * by
    out[..., 2], out[..., 3] = aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw
    return out


def inverse(q: np.ndarray) -> np.ndarray:
    """Invert unit quaternions: (..., 4) -> (..., 4)."""
    return np.asarray(q) * _CONJUGATE


def normalize(q: np.ndarray) -> np.ndarray:
    """Scale quaternions (..., 4) to length one; a zero quaternion becomes the identity."""
    return unit_vectors(np.asarray(q, dtype=float), IDENTITY, 1e-12)


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Rotate vectors.

    Args:
        q: (..., 4) rotations.
        v: (..., 3) vectors.
    Returns:
        (..., 3).
    """
    q, v = np.asarray(q), np.asarray(v)
    w, u = q[..., :1], q[..., 1:]
    t = 2.0 * cross_product(u, v)
    return v + w * t + cross_product(u, t)


def from_axis_angle(axis: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Build rotations about an axis.

    Args:
        axis: (..., 3) unit axes.
        angle: (...,) radians.
    Returns:
        (..., 4).
    """
    half = 0.5 * np.asarray(angle, dtype=float)
    return np.concatenate([np.cos(half)[..., None], np.sin(half)[..., None] * np.asarray(axis, dtype=float)], axis=-1)


def from_up_angle(angle: np.ndarray) -> np.ndarray:
    """Build rotations (..., 4) by `angle` (...,) radians about the world's up axis Z."""
    half = 0.5 * np.asarray(angle, dtype=float)
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def rotate_level(v: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotate vectors on the ground (..., 2) by `angle` (...,) radians about the world's up axis: (..., 2)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = v[..., 0], v[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def rotate_about_up(v: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotate vectors (..., 3) by `angle` (...,) radians about the world's up axis: (..., 3)."""
    return np.concatenate([rotate_level(v[..., :2], angle), v[..., 2:]], axis=-1)


def from_rotation_vector(v: np.ndarray) -> np.ndarray:
    """Convert rotation vectors (..., 3) in radians to quaternions (..., 4): the exponential map."""
    v = np.asarray(v, dtype=float)
    angle = measure_lengths(v)[..., None]
    half = 0.5 * angle
    scale = np.where(angle > 1e-9, np.sin(half) / np.maximum(angle, 1e-9), 0.5 - angle**2 / 48.0)
    return np.concatenate([np.cos(half), scale * v], axis=-1)


def to_rotation_vector(q: np.ndarray) -> np.ndarray:
    """Convert quaternions (..., 4) to rotation vectors (..., 3) of at most pi radians: the logarithm map, shorter
    direction.
    """
    q = np.asarray(q, dtype=float)
    q = np.where(q[..., :1] < 0.0, -q, q)
    length = measure_lengths(q[..., 1:])[..., None]
    angle = 2.0 * arctan2(length, q[..., :1])
    scale = np.where(length > 1e-9, angle / np.maximum(length, 1e-9), 2.0)
    return scale * q[..., 1:]


def from_euler(angles: np.ndarray, order: str) -> np.ndarray:
    """Convert intrinsic Euler angles to quaternions.

    Args:
        angles: (..., n) radians.
        order: n letters of XYZ, the axes in their order.
    Returns:
        (..., 4).
    """
    angles = np.asarray(angles, dtype=float)
    out = None
    for index, letter in enumerate(order):
        half = 0.5 * angles[..., index]
        rotation = np.zeros((*half.shape, 4))
        rotation[..., 0] = np.cos(half)
        rotation[..., 1 + _AXES[letter]] = np.sin(half)
        out = rotation if out is None else multiply(out, rotation)
    return identity(*angles.shape[:-1]) if out is None else out


def to_euler(q: np.ndarray, order: str) -> np.ndarray:
    """Convert quaternions to intrinsic Tait-Bryan angles.

    Args:
        q: (..., 4) rotations.
        order: a permutation of XYZ.
    Returns:
        (..., 3) radians; the middle angle within +-90 degrees. At the pole, where only the sum of the outer angles is
        determined, the third is zero; the rotation is the same.
    """
    i, j, k = (_AXES[letter] for letter in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    m = to_matrix(q)
    sine = np.clip(sign * m[..., i, k], -1.0, 1.0)
    # the middle angle from both its sine and cosine: arcsin alone loses half the digits near 90 degrees
    cosine = np.hypot(m[..., i, i], m[..., i, j])
    middle = arctan2(sine, cosine)
    first = arctan2(-sign * m[..., j, k], m[..., k, k])
    pole = cosine < 1e-9
    first = np.where(pole, arctan2(sign * m[..., k, j], m[..., j, j]), first)
    # from what remains after undoing the first rotation: near the pole both outer angles are noise, their sum is not
    residual = np.cos(first)[..., None] * m[..., j, :] + sign * np.sin(first)[..., None] * m[..., k, :]
    third = np.where(pole, 0.0, arctan2(sign * residual[..., i], residual[..., j]))
    return np.stack([first, middle, third], axis=-1)


def to_matrix(q: np.ndarray) -> np.ndarray:
    """Convert unit quaternions (..., 4) to rotation matrices (..., 3, 3)."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(m: np.ndarray) -> np.ndarray:
    """Convert rotation matrices (..., 3, 3) to unit quaternions (..., 4) with w >= 0."""
    m = np.asarray(m, dtype=float)
    return from_axes(*(m[..., axis] for axis in range(3)))


def from_axes(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Convert the directions (..., 3) of three axes, a rotation matrix's columns, to quaternions (..., 4), w >= 0."""
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = ([axis[..., row] for row in range(3)] for axis in (x, y, z))
    trace = xx + yy + zz
    # four ways to solve, each safe where its own component is the largest (Shepperd 1978)
    squares = (trace, 2.0 * xx - trace, 2.0 * yy - trace, 2.0 * zz - trace)
    a, s = (zy - yz, xz - zx, yx - xy), (xy + yx, xz + zx, yz + zy)
    rows = ((a[0], 1.0 + squares[1], s[0], s[1]), (a[1], s[0], 1.0 + squares[2], s[2]),
            (a[2], s[1], s[2], 1.0 + squares[3]))
    q, largest = np.empty((4, *trace.shape)), trace
    q[0], (q[1], q[2], q[3]) = 1.0 + trace, a
    for square, row in zip(squares[1:], rows):
        if np.any(is_larger := square > largest):
            for component, values in enumerate(row):
                np.copyto(q[component, ...], values, where=is_larger)
            largest = np.maximum(square, largest)
    np.negative(q, out=q, where=q[0] < 0.0)
    return np.ascontiguousarray(normalize(_move_last(q)))


def rotation_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute the shortest rotation that turns vectors a (..., 3) onto b (..., 3): (..., 4); opposites about any axis.
    """
    a = np.asarray(a, dtype=float)
    b = np.asarray(b, dtype=float)
    a = unit_vectors(a, min_length=1e-12)
    b = unit_vectors(b, min_length=1e-12)
    dot = dot_products(a, b)[..., None]
    axis = cross_product(a, b)
    if np.any(is_opposite := dot < -1.0 + 1e-9):
        other = np.where(np.abs(a[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
        axis = np.where(is_opposite, cross_product(a, other), axis)
    return normalize(np.concatenate([np.maximum(1.0 + dot, 0.0), axis], axis=-1))


def unify_signs(q: np.ndarray) -> np.ndarray:
    """Choose the signs of rotations (T, ..., 4) so that neighbours in time are close (q and -q rotate alike)."""
    out = np.array(q, dtype=float)
    flips = dot_products(out[1:], out[:-1]) < 0.0
    if flips.any():
        out[1:] *= np.where(np.cumsum(flips, axis=0) % 2 == 1, -1.0, 1.0)[..., None]
    return out


def match_signs(q: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Choose the signs of rotations (..., 4) that are nearer to `reference` (..., 4)."""
    return np.where(dot_products(q, reference)[..., None] < 0.0, -q, q)


def average(q: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Average rotations by weight: the eigenvector of sum w q q^T (Markley et al. 2007).

    Args:
        q: (N, 4).
        weight: (..., N).
    Returns:
        (..., 4), with w of 0 or more.
    """
    out = np.linalg.eigh(np.einsum("...n,ni,nj->...ij", weight, q, q))[1][..., -1]
    return np.where(out[..., :1] >= 0.0, out, -out)


def slerp(a: np.ndarray, b: np.ndarray, weight: float | np.ndarray) -> np.ndarray:
    """Interpolate rotations on the sphere along the shorter arc.

    Args:
        a, b: (..., 4) rotations at weights 0 and 1.
        weight: (...,).
    Returns:
        (..., 4).
    Source: Faustino 2016, equation (8).
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    weight = np.asarray(weight, dtype=float)
    dot = dot_products(a, b)
    theta = np.arccos(np.clip(np.abs(dot), 0.0, 1.0))
    small = theta < 1e-4
    sine = np.where(small, 1.0, np.sin(theta))
    wa = np.where(small, 1.0 - weight, np.sin((1.0 - weight) * theta) / sine)
    wb = np.where(small, weight, np.sin(weight * theta) / sine)
    wb = np.where(dot < 0.0, -wb, wb)
    mixed = np.empty((4, *wa.shape))
    for component in range(4):
        mixed[component] = wa * a[..., component] + wb * b[..., component]
    return np.ascontiguousarray(normalize(_move_last(mixed)))


def _move_last(components: np.ndarray) -> np.ndarray:
    """View (K, ...) as (..., K), in a tenth of the time that numpy's function takes: short calls are many."""
    return components.transpose(*range(1, components.ndim), 0)


def to_yaw(q: np.ndarray) -> np.ndarray:
    """Return the angle (...,) in radians of the rotation about Z nearest to rotations (..., 4) (their twist)."""
    q = np.asarray(q)
    return 2.0 * arctan2(q[..., 3], q[..., 0])


def wrap_angle(angle):
    """Wrap angles (...) in radians to the range from -pi up to pi."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
