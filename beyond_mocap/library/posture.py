"""How people of a library stand, walk, jog and run, learned from the library itself, and which frames do not belong.

Folders of motion capture hold fights, pushes, dances and stumbles beside walks, often labelled *walking* by their
speed. What most of the locomotion at one speed has in common is found by concentration: a Gaussian fitted to the
nearest 60 % of the frames again and again, from the median on, until it rests (the steps of the minimum covariance
determinant, Rousseeuw and Van Driessen 1999). Frames far outside of it show boxing, not walking.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..annotation import DISCRETE
from ..base.time_series import time_derivative
from ..motion import quaternion
from ..motion.humanoid import Humanoid

SPEED_EDGES = (0.4, 1.2, 2.0, 3.0, 4.5)  # m/s between the classes in which postures are compared
BELONGING = 1.6
"""Multiple of the core's own radius within which a frame belongs. On a library of five folders, 2 % of the frames of
calm walks lie outside, and 70 to 100 % of those of fights, celebrations, juggling and volleys."""

_CORE_SHARE = 0.6
_ROUNDS = 20  # of concentration; it rests after some ten
_GROWING_ROUNDS = 5
_SAMPLED = 4000  # frames of a class that are fitted
_FEWEST = 200  # frames with which a class has a region of its own
_HAND_SPEED = 0.2  # m/s, added to the hands' speed before its logarithm
_LEAST_VARIANCE = 1e-3


def compute_postures(positions: np.ndarray, facing: np.ndarray, fps: float, body: Humanoid) -> np.ndarray:
    """Compute the posture of every frame: directions of arms and trunk, how fast the hands move, hips and step width.

    Args:
        positions: (T, J, 3) m, world.
        facing: (T,) rad.
        fps: frames per second.
        body: the skeleton's joints.
    Returns:
        (T, K) float32; directions are unit vectors in the body's frame, lengths in leg lengths.
    """
    hips = positions[:, body.hips]
    local = quaternion.rotate_about_up(positions - hips[:, None] * np.array([1.0, 1.0, 0.0]), -facing[:, None])
    limbs = (body.left, body.right)
    leg = np.mean([np.linalg.norm(local[:1, limb.foot] - local[:1, limb.upper_leg], axis=-1)[0] for limb in limbs])
    leg = max(leg, 1e-3)
    width = local[:, body.left.foot, 1:2] - local[:, body.right.foot, 1:2]
    columns = [local[:, body.hips, 2:] / leg, width / leg]
    arms = [limb for limb in limbs if None not in (limb.upper_arm, limb.lower_arm, limb.hand)]
    for limb in arms:
        columns += [_compute_direction(local, limb.upper_arm, limb.lower_arm),
                    _compute_direction(local, limb.lower_arm, limb.hand)]
    if len(arms) == 2:
        shoulders = 0.5 * (local[:, body.left.upper_arm] + local[:, body.right.upper_arm])
        trunk = shoulders - local[:, body.hips]
        speed = np.mean([np.linalg.norm(time_derivative(local[:, limb.hand], fps), axis=1) for limb in arms], axis=0)
        columns += [trunk / np.maximum(np.linalg.norm(trunk, axis=1, keepdims=True), 1e-9),
                    np.log(speed + _HAND_SPEED)[:, None]]
    return np.concatenate(columns, axis=1).astype(np.float32)


def _compute_direction(local: np.ndarray, start: int, end: int) -> np.ndarray:
    """Compute the unit vectors (T, 3) from one joint to another."""
    bone = local[:, end] - local[:, start]
    return bone / np.maximum(np.linalg.norm(bone, axis=1, keepdims=True), 1e-9)


@dataclass(frozen=True, eq=False)
class NormalPostures:
    """The regions of normal locomotion of a library, one for each class of SPEED_EDGES.

    Attributes:
        regions: class -> (middle (K,), inverse covariance (K, K), radius), only where it has frames enough.
    """

    regions: Mapping[int, tuple[np.ndarray, np.ndarray, float]]

    def measure_strangeness(self, posture: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Measure how far postures lie from normal locomotion at their speed.

        Args:
            posture: (T, K) of `compute_postures`.
            speed: (T,) m/s.
        Returns:
            (T,) float32 in radii of the region: up to 1 a frame belongs; 0 where the library has no region.
        """
        kind, out = np.digitize(speed, SPEED_EDGES), np.zeros(len(posture), np.float32)
        for k in np.unique(kind) if self.regions else ():
            middle, inverse, radius = self.regions[min(self.regions, key=lambda other: (abs(other - k), other))]
            away = posture[kind == k] - middle
            squared = np.maximum(np.einsum("ij,ij->i", away @ inverse, away), 0.0)
            out[kind == k] = np.sqrt(squared) / (BELONGING * radius)
        return out


def fit_normal_postures(frames, is_recorded: np.ndarray) -> NormalPostures:
    """Learn the regions of normal locomotion from a library's frames without an action's label.

    Args:
        frames: the library's frames, N of them.
        is_recorded: (N,) bool, frames of recordings.
    """
    actions = [i for i, word in enumerate(frames.vocabulary) if word in DISCRETE]
    is_learned = is_recorded & ~frames.words[:, actions].any(axis=1)
    kind = np.digitize(frames.speed, SPEED_EDGES)
    regions = {k: _fit_region(frames.posture[is_learned & (kind == k)]) for k in range(len(SPEED_EDGES) + 1)}
    return NormalPostures({k: region for k, region in regions.items() if region is not None})


def _fit_region(postures: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Fit the core of postures (M, K): its middle, inverse covariance and radius; None for too few."""
    if len(postures) < _FEWEST:
        return None
    chosen = postures[np.unique(np.linspace(0, len(postures) - 1, _SAMPLED).astype(int))].astype(float)
    middle = np.median(chosen, axis=0)
    spread = np.median(np.abs(chosen - middle), axis=0) + np.sqrt(_LEAST_VARIANCE)
    squared = np.sum(((chosen - middle) / spread) ** 2, axis=1)
    count = int(_CORE_SHARE * len(chosen))
    for number in range(_ROUNDS + _GROWING_ROUNDS):
        if number < _ROUNDS:
            core = chosen[np.argsort(squared, kind="stable")[:count]]
        else:  # the ends of a swing are rare: what is not far from the core belongs to it
            core = chosen[squared <= BELONGING**2 * np.sort(squared)[count - 1]]
        middle = core.mean(axis=0)
        inverse = np.linalg.inv(np.cov(core.T) + _LEAST_VARIANCE * np.eye(chosen.shape[1]))
        away = chosen - middle
        squared = np.einsum("ij,ij->i", away @ inverse, away)
    return middle, inverse, float(np.sqrt(np.sort(squared)[count - 1]))
