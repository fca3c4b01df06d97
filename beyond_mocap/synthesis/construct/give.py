"""The body gives where its feet would slide: root and facing move a little with the foot that stands.

The feet then have less to make up for by their legs (`foot_plant`). Too much of it and the pelvis surges and stops with
every step to keep feet still, which looks worse than what it mends: the weight is small, and what drifts away from the
track is taken back by `on_track.pulled_to_track`.
"""

from __future__ import annotations

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...motion.foot_plant import firmness
from ...motion.humanoid import identify
from ...motion.motion import pose_kinematics
from ...motion.skeleton import Skeleton

GIVE = 0.1  # weight of a standing foot's movement
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
    squares = BandedLeastSquares(count, _UNKNOWNS)
    for side, limb in enumerate((body.left, body.right)):
        firm = firmness(standing[:, side])
        for point, joint in enumerate((limb.foot, limb.toe_or_foot)):
            place = places[:, joint, :2]
            arm, moves = (place - root[:, :2])[:-1], np.diff(place, axis=0)
            weight = GIVE * np.minimum(firm[1:, point], firm[:-1, point])
            one = np.ones(len(weight))
            for axis, swing in ((_ROOT_X, -arm[:, 1]), (_ROOT_Y, arm[:, 0])):
                stencil = {axis: -one, _TURN: -swing, axis + _UNKNOWNS: one, _TURN + _UNKNOWNS: swing}
                squares.add(stencil, weight, -moves[:, axis])
    for axis, kind in ((_ROOT_X, 0), (_ROOT_Y, 0), (_TURN, 1)):
        squares.add_difference(3, STIFF[kind] / scale**4, axis)
        squares.add_value(STAY[kind] * scale**2, axis)
    found = squares.solve()
    return found[:, :2], found[:, _TURN]
