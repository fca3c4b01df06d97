"""Two-bone inverse kinematics as one functional step: with numpy for use, with jax as a layer inside the training.

The knee or elbow bends or stretches until the limb has the length that is asked for, then the whole limb turns to the
target by the shortest arc (Fredriksson §3.3.1, §7.7.3). `motion.limb` does the same over all frames of a finished
motion; here one frame follows another, nothing may look ahead, and every step must have a derivative."""

from __future__ import annotations

import numpy as np

from ...motion.limb import soft_distance

_ONES = np.ones((3, 1))
_CROSS = np.zeros((9, 3))  # the nine products of two vectors' components -> their cross product
_CROSS[[5, 6, 1], [0, 1, 2]], _CROSS[[7, 2, 3], [0, 1, 2]] = 1.0, -1.0
_SKEW = np.zeros((3, 9))  # a vector -> the matrix of the cross product with it
_SKEW[[0, 1, 2], [7, 2, 3]], _SKEW[[0, 1, 2], [5, 6, 1]] = 1.0, -1.0
_EYE = np.eye(3)
_STRAIGHT = 0.03  # weight of the given hinge against the sine of the bend that the limb shows itself
_TINY = 1e-12  # m^2: roots keep a finite derivative at zero


def toward(predicted, wanted, share):
    """The point that is reached for, (..., 3) m: between what was predicted and what is wanted (..., 3), at `share` of
    the way (§7.7.3: a linearly interpolated point, so that joints are not over-corrected)."""
    return predicted + share * (wanted - predicted)


def bend_to(top, middle, end, target, hinge, xp, soft: float = 0.01):
    """World turns that bring a limb's end joint to `target`.

    top, middle, end, target: (..., 3) metres, world. hinge: (..., 3) unit, world, about which the middle joint bends
    (upper bone x lower bone of a bent limb); it only counts where the limb is nearly straight. xp: numpy or jax.numpy.
    soft: metres below full length from where the limb eases (`motion.limb.soft_distance`).

    Returns turn_upper, turn_lower (..., 3, 3), to be put left of the bones' world rotations, and the end joint's new
    place (..., 3). Bones keep their lengths; a target out of reach is neared along its line, one too close to `top` is
    kept away by the difference of the bones.
    """
    upper, lower = middle - top, end - middle
    long_upper, long_lower = _length(upper, xp), _length(lower, xp)
    along, down = upper / long_upper, lower / long_lower
    axis = _cross(along, down) + _STRAIGHT * hinge
    axis = _unit(axis - _dot(axis, along) * along, xp)
    way = target - top
    asked = _length(way, xp)
    # a limb that is already as straight as that stays so
    reach = xp.maximum(_eased(asked, long_upper, long_lower, soft, xp), xp.minimum(asked, _length(end - top, xp)))
    cosine = (reach * reach - long_upper * long_upper - long_lower * long_lower) / (2.0 * long_upper * long_lower)
    cosine = xp.clip(cosine, -1.0, 1.0)
    # held off zero after the square: in float32 no number between 1 - 1e-9 and 1 keeps the root's derivative finite
    bent = cosine * along + xp.sqrt(xp.maximum(1.0 - cosine * cosine, 2e-9)) * _cross(axis, along)
    swing = _shortest(_unit(long_upper * along + long_lower * bent, xp), way / asked)
    return swing, swing @ _shortest(down, bent), top + way * (reach / asked)


def _eased(asked, upper, lower, soft, xp):
    """The reach that is played for an asked one, metres."""
    longest = upper + lower
    return xp.maximum(soft_distance(asked, longest, soft, xp), xp.abs(upper - lower) + 0.02 * longest)


def _shortest(one, other):
    """Rotations (..., 3, 3) that turn unit `one` (..., 3) to unit `other` by the shortest arc."""
    cosine = _dot(one, other)[..., None]
    axis = _cross(one, other)
    skew = (axis @ _SKEW).reshape(*axis.shape[:-1], 3, 3)
    return cosine * _EYE + skew + axis[..., :, None] * (axis[..., None, :] / (1.0 + cosine + 1e-9))


def _cross(a, b):
    products = a[..., :, None] * b[..., None, :]
    return products.reshape(*products.shape[:-2], 9) @ _CROSS


def _dot(a, b):
    return (a * b) @ _ONES


def _length(v, xp):
    return xp.sqrt((v * v) @ _ONES + _TINY)


def _unit(v, xp):
    return v / _length(v, xp)
