"""The body gives where its feet would slide: root and facing move a little with the foot that stands.

The feet then have less to make up for by their legs (`foot_plant`). Too much of it and the pelvis surges and stops with
every step to keep feet still, which looks worse than what it mends: the weight is small, and what drifts away from the
track is taken back by `on_track.pulled_to_track`.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from ..motion.humanoid import identify
from ..motion.motion import pose_kinematics
from ..motion.skeleton import Skeleton
from .foot_plant import firmness

GIVE = 0.1
STIFF = (2.0, 0.2)
STAY = (0.02, 5e-4)
"""Weights of the third difference and of the whole, for metres of the root and for radians of facing."""

_ROOT_X, _ROOT_Y, _TURN, _UNKNOWNS = 0, 1, 2, 3


def give(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, standing: np.ndarray, fps: float
) -> tuple[np.ndarray, np.ndarray]:
    """Metres (T, 2) by which the root moves on the ground, and radians (T,) by which the body turns about it.

    root (T, 3) m and rotations (T, J, 4) local: the motion laid out; standing (T, 2, 2) bool: heels and toes. With f a
    point that stands, a its arm from the root and J a quarter turn, minimizes sum GIVE w |r' + t' J a + f'|^2 + STIFF
    |r''', t'''|^2 + STAY |r, t|^2, differences per frame at 30 frames per second: one banded system.
    """
    body = identify(skeleton)
    places, _ = pose_kinematics(skeleton, root, rotations)
    count, scale = len(root), 30.0 / fps
    band, right = np.zeros((4 * _UNKNOWNS, _UNKNOWNS * count)), np.zeros(_UNKNOWNS * count)
    for side, limb in enumerate((body.left, body.right)):
        firm = firmness(standing[:, side])
        for point, joint in enumerate((limb.foot, limb.toe_or_foot)):
            place = places[:, joint, :2]
            arm, moves = (place - root[:, :2])[:-1], np.diff(place, axis=0)
            weight = GIVE * np.minimum(firm[1:, point], firm[:-1, point])
            one = np.ones(len(weight))
            for axis, swing in ((_ROOT_X, -arm[:, 1]), (_ROOT_Y, arm[:, 0])):
                stencil = {axis: -one, _TURN: -swing, axis + _UNKNOWNS: one, _TURN + _UNKNOWNS: swing}
                _add(band, right, stencil, weight, -moves[:, axis])
    for axis, kind in ((_ROOT_X, 0), (_ROOT_Y, 0), (_TURN, 1)):
        if count > 3:
            third = {axis + _UNKNOWNS * k: np.full(count - 3, c) for k, c in enumerate((-1.0, 3.0, -3.0, 1.0))}
            _add(band, right, third, np.full(count - 3, STIFF[kind] / scale**4), np.zeros(count - 3))
        band[0, axis::_UNKNOWNS] += STAY[kind] * scale**2
    found = solveh_banded(band[: 1 + _UNKNOWNS * min(3, count - 1) + 2], right, lower=True).reshape(count, _UNKNOWNS)
    return found[:, :2], found[:, _TURN]


def _add(
    band: np.ndarray, right: np.ndarray, stencil: dict[int, np.ndarray], weight: np.ndarray, goal: np.ndarray
) -> None:
    """Adds sum_t weight_t (sum_i c_i,t x_{i + UNKNOWNS t} - goal_t)^2 to a symmetric system in lower banded form."""
    def at(row: int) -> slice:
        return slice(row, row + _UNKNOWNS * len(weight), _UNKNOWNS)

    for i, a in stencil.items():
        right[at(i)] += weight * a * goal
        for j, b in stencil.items():
            if i >= j:
                band[i - j, at(j)] += weight * a * b
