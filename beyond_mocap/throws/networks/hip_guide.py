"""Where hands and feet would carry the hips: four places say how far a body has come, but hardly which way it faces;
how all of them turn together from one frame to the next says how it turns."""

from __future__ import annotations

import numpy as np

from ...base.vectors import cross_level
from .chains import Chains
from .description import Windows
from .kinematics import Pose, picked, six

GUIDES = 9
"""Values that `carried` has."""
_COUNTS = np.array([1.0, 1.0, 3.0, 3.0]) / 8.0  # feet stand, hands swing
_TINY = 1e-12  # m^2 about their middle; keeps the root's derivative finite


def carried(chains: Chains, pose: Pose, window: Windows, origin, xp=np):
    """Place less `origin` (..., 3) m, and turn as six numbers, of the hips as hands and feet carry them: (..., 9).

    They are turned about the upright and moved as brings the effectors of frame n nearest to where they are wanted in
    n + 1, in least squares in which feet count three times as much (Procrustes; Kabsch 1976 with one axis).
    """
    now = picked(pose.positions, chains.effectors, -2, xp)
    share = _COUNTS[:, None]
    middle, wanted = (now * share).sum(-2), (window.next * share).sum(-2)
    a, b = share * (now - middle[..., None, :]), window.next - wanted[..., None, :]
    along = (a[..., :2] * b[..., :2]).sum((-1, -2))
    across = cross_level(a, b).sum(-1)
    turn = _about_up(along, across, xp)
    place = xp.matmul(turn, (pose.positions[..., chains.hips, :] - middle)[..., None])[..., 0] + wanted
    return xp.concatenate([place - origin, six(xp.matmul(turn, pose.turns[..., chains.hips, :, :]), xp)], axis=-1)


def _about_up(along, across, xp):
    """Rotations (..., 3, 3) about the upright whose cosine and sine are as `along` (...) to `across` (...)."""
    long = xp.sqrt(along * along + across * across + _TINY)
    cosine, sine, nothing = along / long, across / long, xp.zeros_like(along)
    rows = [[cosine, -sine, nothing], [sine, cosine, nothing], [nothing, nothing, nothing + 1.0]]
    return xp.stack([xp.stack(row, -1) for row in rows], -2)
