"""Technical frames: where a rigid cluster of markers is in each frame, by singular values (Fredriksson §3.4.2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# A cluster tells its turn about its own longest line only by what lies off that line: below this part of its length
# (root mean squares) half a millimetre of noise on a hand's breadth already turns it by ten degrees.
_OFF_THE_LINE = 0.03


class RigidFit(NamedTuple):
    """`rotation @ model + shift` lies nearest to what was seen.

    rotation: (..., 3, 3) right-handed matrices. shift: (..., 3) m. rms: (...,) m, root of the weighted mean squared
    distance. sound: (...,) bool, False where the markers do not determine the rotation (fewer than three, or nearly on
    one line): it is one of many that fit as well. Without any marker seen, rotation, shift and rms are NaN."""

    rotation: np.ndarray
    shift: np.ndarray
    rms: np.ndarray
    sound: np.ndarray


def rigid_fit(model: np.ndarray, seen: np.ndarray, weights: np.ndarray | None = None) -> RigidFit:
    """The rigid motions that carry clusters `model` (..., N, 3) m nearest to `seen` (..., N, 3) m, all frames at once.

    weights: (..., N) >= 0, how much each marker counts; None: all alike. A marker that is NaN in either cluster counts
    nothing. Leading axes are matched by numpy's rules, so that one shape (N, 3) fits a whole trial (T, N, 3).

    The factors of the cross-covariance C of both clusters about their means (eq. 3.12-3.13) give the rotation
    (eq. 3.14), with the last direction turned round where it would mirror (eq. 3.15)."""
    model, seen, weight = _counted(model, seen, weights)
    total = weight.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = weight / total[..., None]
    share = np.where(np.isfinite(share), share, 0.0)
    model_mean = np.einsum("...n,...nc->...c", share, model)
    seen_mean = np.einsum("...n,...nc->...c", share, seen)
    model_arms, seen_arms = model - model_mean[..., None, :], seen - seen_mean[..., None, :]
    covariance = np.einsum("...n,...ni,...nj->...ij", share, seen_arms, model_arms)
    left, size, right = np.linalg.svd(covariance)
    mirrors = np.linalg.det(np.einsum("...ij,...jk->...ik", left, right)) < 0.0
    sign = np.where(mirrors, -1.0, 1.0)
    left[..., 2] *= sign[..., None]
    rotation = np.einsum("...ij,...jk->...ik", left, right)
    shift = seen_mean - np.einsum("...ij,...j->...i", rotation, model_mean)
    away = np.einsum("...ij,...nj->...ni", rotation, model_arms) - seen_arms
    rms = np.sqrt(np.einsum("...n,...nc,...nc->...", share, away, away))
    # what a turn about the longest line costs is the sum of the two smaller values; their sizes are lengths squared
    sound = (size[..., 1] + sign * size[..., 2] > _OFF_THE_LINE**2 * size[..., 0]) & (np.sum(weight > 0.0, axis=-1) > 2)
    known = np.where(total > 0.0, 1.0, np.nan)
    return RigidFit(rotation * known[..., None, None], shift * known[..., None], rms * known, sound)


def _counted(model, seen, weights):
    """Both clusters with zeros for what counts nothing, and the weights (..., N), over common leading axes."""
    model, seen = np.broadcast_arrays(np.asarray(model, dtype=float), np.asarray(seen, dtype=float))
    there = np.isfinite(model).all(axis=-1) & np.isfinite(seen).all(axis=-1)
    weight = np.where(there, 1.0 if weights is None else np.asarray(weights, dtype=float), 0.0)
    counts = (weight > 0.0)[..., None]
    return np.where(counts, model, 0.0), np.where(counts, seen, 0.0), np.where(weight > 0.0, weight, 0.0)


def placed(fit: RigidFit, model: np.ndarray) -> np.ndarray:
    """Where the fitted motions carry points `model` (..., N, 3) m: (..., N, 3) m."""
    return np.einsum("...ij,...nj->...ni", fit.rotation, model) + fit.shift[..., None, :]


def taken_back(fit: RigidFit, seen: np.ndarray) -> np.ndarray:
    """Where points `seen` (..., N, 3) m lie in the model's own frame: (..., N, 3) m."""
    return np.einsum("...ji,...nj->...ni", fit.rotation, seen - fit.shift[..., None, :])


def mean_rotation(rotations: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """The mean (3, 3) of rotation matrices (T, 3, 3): the one nearest to all by squared chords, NaN left out.

    weights: (T,) or None. The same as the dominant eigenvector of the quaternions' outer products (Markley et al. 2007,
    the [46] of Fredriksson §5.2.1), found from the matrices' sum. Without any rotation: the identity."""
    rotations = np.asarray(rotations, dtype=float)
    weight = np.isfinite(rotations).all(axis=(-1, -2)) * (1.0 if weights is None else np.asarray(weights, dtype=float))
    if not np.any(weight > 0.0):
        return np.eye(3)
    total = np.einsum("t,tij->ij", weight, np.where(weight[:, None, None] > 0.0, rotations, 0.0))
    left, _, right = np.linalg.svd(total)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return left @ right
