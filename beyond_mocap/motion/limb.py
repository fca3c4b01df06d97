"""The geometry of a limb of two bones: where the middle joint goes when the end joint is asked to be somewhere.

Tolani, Goswami and Badler 2000 ("Real-time inverse kinematics techniques for anthropomorphic limbs"): the triangle of
upper bone, lower bone and the line to the target leaves one freedom, the direction in which the middle joint points
(the pole)."""

from __future__ import annotations

import numpy as np

from ..base.vectors import cross, unit_vectors
from . import quaternion


def soft_distance(distance: np.ndarray, longest: np.ndarray, soft: float | np.ndarray, xp=np) -> np.ndarray:
    """The reach that is played for an asked one, metres: exact up to `soft` below the limb's length, then it only nears
    it.

    distance (...,) asked, longest (...,) upper plus lower bone, soft one or (...,); C1, so that a knee does not snap
    straight. xp: array module, numpy or jax.numpy.
    """
    start = longest - soft
    beyond = xp.maximum(distance - start, 0.0)
    return xp.where(distance > start, longest - soft * xp.exp(-beyond / soft), distance)


def inner_angle(upper, lower, length) -> np.ndarray:
    """The angle between two bones at the joint between them, by the law of cosines.

    Args:
        upper, lower: (...,), lengths of the bones, m.
        length: (...,), distance between their far ends, m.
    Returns:
        (...,), rad, from 0 folded to pi straight.
    """
    return np.arccos(np.clip((upper**2 + lower**2 - length**2) / (2.0 * upper * lower), -1.0, 1.0))


def bend(
    top: np.ndarray, target: np.ndarray, upper: np.ndarray, lower: np.ndarray, pole: np.ndarray,
    soft: float | np.ndarray = 0.01,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle joint (..., 3), end joint (..., 3) and hinge axis (..., 3) of a limb that reaches for `target`.

    top, target (..., 3) metres, world. upper, lower (...,) bone lengths, metres. pole (..., 3): roughly where the
    middle joint points. soft: metres of soft reach. The hinge is the unit axis about which the middle joint bends:
    direction of the limb x pole. A target out of reach is neared along its line; one too near is kept away by the
    difference of the bones."""
    line = target - top
    asked = np.linalg.norm(line, axis=-1)
    direction = unit_vectors(line, np.array([0.0, 0.0, -1.0]))
    nearest = np.abs(upper - lower) + 0.02 * (upper + lower)
    reach = np.maximum(soft_distance(asked, upper + lower, soft), nearest)
    across = pole - np.sum(pole * direction, axis=-1, keepdims=True) * direction
    across = _unit_across(across, direction)
    along = (upper**2 - lower**2 + reach**2) / (2.0 * reach)
    height = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    middle = top + along[..., None] * direction + height[..., None] * across
    return middle, top + reach[..., None] * direction, cross(direction, across)


def _unit_across(v: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) at length one; any square to `direction` (..., 3) where they have none."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / length if np.all(length > 1e-9) else unit_vectors(v, _any_normal(direction))


def _any_normal(direction: np.ndarray) -> np.ndarray:
    other = np.where(np.abs(direction[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    normal = other - np.sum(other * direction, axis=-1, keepdims=True) * direction
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def bone_frame(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """Rotations (..., 4) that turn -Z onto `direction` (..., 3) and +Y onto the part of -`hinge` that is square to it.

    A leg that hangs straight down with its knee pointing along +X has direction -Z and hinge -Y: the identity.
    """
    left = -(hinge - np.sum(hinge * direction, axis=-1, keepdims=True) * direction)
    left = _unit_across(left, direction)
    forward = cross(left, -direction)
    return quaternion.from_matrix(np.stack([forward, left, -direction], axis=-1))
