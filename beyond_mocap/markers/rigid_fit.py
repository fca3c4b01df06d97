"""Technical frames: fit the rigid motion of a marker cluster in each frame by singular values (Fredriksson section
3.4.2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Only the extent off its longest line determines how a cluster turns about that line. Below this share of its length
# (root mean squares), half a millimetre of noise on a hand's breadth already rotates it by ten degrees.
_MIN_WIDTH_SHARE = 0.03


class RigidFit(NamedTuple):
    """The rigid motion `rotation @ model + shift` that lies nearest to the recorded markers.

    Without any visible marker, rotation, shift and rms are NaN.

    Attributes:
        rotation: (..., 3, 3) right-handed rotation matrices.
        shift: (..., 3) metres.
        rms: (...,) metres, root of the weighted mean squared distance.
        is_determined: (...,) bool, False where the markers do not determine the rotation (fewer than three, or nearly
            on one line); the rotation is then one of many that fit equally well.
    """

    rotation: np.ndarray
    shift: np.ndarray
    rms: np.ndarray
    is_determined: np.ndarray


def fit_rigid(model: np.ndarray, seen: np.ndarray, weights: np.ndarray | None = None) -> RigidFit:
    """Fit the rigid motions that bring clusters nearest to the recorded markers, all frames at once.

    The cross-covariance of both clusters about their means (eq. 3.12-3.13) is factored into singular values, which give
    the rotation (eq. 3.14); the last direction is reversed where the result would be a reflection (eq. 3.15).

    Args:
        model: (..., N, 3) metres, the cluster. Leading axes broadcast, so one shape (N, 3) fits a whole trial (T, N,
            3).
        seen: (..., N, 3) metres, the recorded markers; a marker that is NaN in either cluster has no weight.
        weights: (..., N) >= 0, the weight of each marker; None weights all equally.
    Returns:
        Rotation, shift, rms and whether the fit is determined, over the leading axes.
    Source: Fredriksson section 3.4.2, equations (3.12) to (3.15).
    """
    model, seen, weight = _zero_unweighted(model, seen, weights)
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
    # rotating about the longest line changes the misfit by the sum of the two smaller singular values;
    # these are squared lengths, hence the squared share
    sound = (size[..., 1] + sign * size[..., 2] > _MIN_WIDTH_SHARE**2 * size[..., 0]) & (np.sum(weight > 0.0, axis=-1)
            > 2)
    known = np.where(total > 0.0, 1.0, np.nan)  # NaN marks frames without a visible marker
    return RigidFit(rotation * known[..., None, None], shift * known[..., None], rms * known, sound)


def _zero_unweighted(model, seen, weights):
    """Return both clusters with zeros where a marker has no weight, and the weights (..., N), broadcast together."""
    model, seen = np.broadcast_arrays(np.asarray(model, dtype=float), np.asarray(seen, dtype=float))
    visible = np.isfinite(model).all(axis=-1) & np.isfinite(seen).all(axis=-1)
    weight = np.where(visible, 1.0 if weights is None else np.asarray(weights, dtype=float), 0.0)
    counts = (weight > 0.0)[..., None]
    return np.where(counts, model, 0.0), np.where(counts, seen, 0.0), np.where(weight > 0.0, weight, 0.0)


def place_points(fit: RigidFit, model: np.ndarray) -> np.ndarray:
    """Move points with fitted motions.

    Args:
        fit: the fitted motions.
        model: (..., N, 3) metres, points in the model's frame.
    Returns:
        (..., N, 3) metres, the points in the world.
    """
    return np.einsum("...ij,...nj->...ni", fit.rotation, model) + fit.shift[..., None, :]


def to_model_frame(fit: RigidFit, seen: np.ndarray) -> np.ndarray:
    """Convert points of the world to the model's own frame.

    Args:
        fit: the fitted motions.
        seen: (..., N, 3) metres, world.
    Returns:
        (..., N, 3) metres, in the model's frame.
    """
    return np.einsum("...ji,...nj->...ni", fit.rotation, seen - fit.shift[..., None, :])


def compute_mean_rotation(rotations: np.ndarray) -> np.ndarray:
    """Compute the mean of rotation matrices: the rotation nearest to all by squared chords.

    The result equals the dominant eigenvector of the quaternions' outer products, computed from the sum of the
    matrices.

    Args:
        rotations: (T, 3, 3) rotation matrices; NaN ones are left out.
    Returns:
        (3, 3) the mean rotation; the identity if there is no rotation.
    Source: Markley et al. 2007, reference [46] of Fredriksson section 5.2.1.
    """
    rotations = np.asarray(rotations, dtype=float)
    weight = np.isfinite(rotations).all(axis=(-1, -2)) * 1.0
    if not np.any(weight > 0.0):
        return np.eye(3)
    total = np.einsum("t,tij->ij", weight, np.where(weight[:, None, None] > 0.0, rotations, 0.0))
    left, _, right = np.linalg.svd(total)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return left @ right
