"""How far joints turn: limits on the angles of a chain's joints, held exactly (Fredriksson §5.3.1).

A hinge is kept as angles and cannot leave its limits. A joint that turns all ways is kept as a quaternion; its angles
are read here, of the two triples that mean the same rotation the one that offends less, and brought back to the limits
after each step. At a limit that the markers pull against, the joint's turn in that direction is held still, so that the
other directions find their best beside it (Bertsekas 1982, projected Newton methods).

Within some degrees of the pole of its axis order a joint's outer angles mean nothing; only the middle one's limit counts
there.
"""

from __future__ import annotations

import numpy as np

from ..motion import quaternion
from .chain import Chain, Poses, own_axes

_NEAR_POLE = 0.12  # cosine of the middle angle below which the outer ones mean nothing: 7 degrees
_AT = 1e-7  # radians
_HELD = 1e6  # curvature, m2 per radian2, of a turn that is held still


def limited(chain: Chain) -> list[int]:
    """The joints that turn all ways and have limits; the root has none."""
    bound = np.isfinite(chain.low).any(axis=1) | np.isfinite(chain.high).any(axis=1)
    return [joint for joint in range(1, len(chain.skeleton)) if bound[joint] and chain.turning[joint]]


def angles_of(chain: Chain, joint: int, local: np.ndarray) -> np.ndarray:
    """Angles (3, F) rad of a joint's rotations (4, F): of both triples the one within the limits, or nearer to them."""
    one = quaternion.to_euler(local.T, chain.order[joint]).T
    other = np.stack([one[0] + np.pi, np.pi - one[1], one[2] + np.pi])
    one, other = (_near_the_middle(chain, joint, angles) for angles in (one, other))
    better = _offence(chain, joint, other) < _offence(chain, joint, one) - 1e-9
    return np.where(better, other, one)


def _near_the_middle(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """Angles without the full turns that separate them from the middle of their limits."""
    low, high = chain.low[joint], chain.high[joint]
    middle = np.where(np.isfinite(low) & np.isfinite(high), 0.5 * (low + high), 0.0)[:, None]
    return middle + quaternion.wrapped(angles - middle)


def _offence(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """By how many radians (F,) angles (3, F) leave the limits, all together."""
    low, high = chain.low[joint][:, None], chain.high[joint][:, None]
    return np.sum(np.maximum(angles - high, 0.0) + np.maximum(low - angles, 0.0), axis=0)


def _counts(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """Which angles (3, F) mean something: all, but near the pole the middle one alone."""
    away = np.abs(np.cos(angles[1])) >= _NEAR_POLE
    return np.stack([away, np.ones_like(away), away])


def held_back(chain: Chain, joints: list[int], at: Poses) -> Poses:
    """The poses with these joints brought back to their limits."""
    local = at.local.copy()
    for joint in joints:
        angles = angles_of(chain, joint, at.local[joint])
        inside = np.clip(angles, chain.low[joint][:, None], chain.high[joint][:, None])
        inside = np.where(_counts(chain, joint, angles), inside, angles)
        beyond = np.any(inside != angles, axis=0)
        if np.any(beyond):
            local[joint][:, beyond] = quaternion.from_euler(inside[:, beyond].T, chain.order[joint]).T
    return Poses(at.root, local, at.angles)


def hold(chain: Chain, joints: list[int], at: Poses, gradient: np.ndarray, curvature: np.ndarray) -> np.ndarray:
    """Hold still, in place in the turns' own curvature (J, 3, 3, F), what is at a limit and would go on; which joints
    are held so: (J, F) bool.

    gradient: (J, 3, F), of half the cost by each joint's turns.
    """
    held = np.zeros((len(chain.skeleton), gradient.shape[-1]), dtype=bool)
    for joint in joints:
        angles = angles_of(chain, joint, at.local[joint])
        basis = own_axes(chain, joint, angles)
        stopped = _stopped(chain, joint, angles, np.einsum("abf,af->bf", basis, gradient[joint]))
        stopped &= _counts(chain, joint, angles)
        held[joint] = stopped.any(axis=0)
        if held[joint].any():
            _hold_directions(curvature[joint], basis, stopped)
    for joint in chain.hinges:
        stopped = _stopped(chain, joint, at.angles[joint], gradient[joint]) & chain.free[joint][:, None]
        held[joint] = stopped.any(axis=0)
        for axis in range(3):
            curvature[joint][axis, axis] += np.where(stopped[axis], _HELD, 0.0)
    return held


def _stopped(chain: Chain, joint: int, angles: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Which angles (3, F) stand at a limit while the cost's slope (3, F) leads beyond it."""
    low, high = chain.low[joint][:, None], chain.high[joint][:, None]
    return ((angles >= high - _AT) & (slope < 0.0)) | ((angles <= low + _AT) & (slope > 0.0))


def _hold_directions(curvature: np.ndarray, basis: np.ndarray, stopped: np.ndarray) -> None:
    """Make turns stiff (3, 3, F), in place, along the directions in which the stopped angles (3, F) grow."""
    frames = np.flatnonzero(stopped.any(axis=0))
    rates = np.linalg.pinv(np.moveaxis(basis[..., frames], -1, 0))  # rows: how each angle grows with a turn
    stiff = _HELD * np.einsum("fna,fnb,nf->abf", rates, rates, stopped[:, frames])
    curvature[..., frames] += stiff
