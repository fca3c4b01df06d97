"""Feet held where they stand: each stance's slide is taken out by moving the foot, and the leg follows by two-bone IK.

Which frames are stance is known from the recording and carried along (../shared/metrics.md); here nothing is guessed from
the motion itself. A stance is not pinned to one point and blended in and out; instead each foot's shift over the ground is
one smooth curve D(t) that cancels the velocity of the point that carries the foot while it stands and may do anything
gentle in between: the least squares problem of `shift`, one banded system for the whole motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded
from scipy.ndimage import maximum_filter1d

from ..motion import quaternion
from ..motion.humanoid import Limb, identify
from ..motion.motion import pose_kinematics
from ..motion.skeleton import Skeleton
from .reach import two_bone

SMOOTH = 0.02
PULL = 2e-4
MOST_DROP = 0.10
MOST_SHIFT = 0.25
EASE = 0.012
HOLD = 1e6
"""Weight of a shift that is given: so much more than all else that it stays."""


@dataclass(frozen=True, eq=False)
class Planted:
    """root (T, 3) m; rotations (T, J, 4) local; correction (T, 2) m by which each foot was moved; miss (T, 2) m that IK
    was short of its target."""

    root: np.ndarray
    rotations: np.ndarray
    correction: np.ndarray
    miss: np.ndarray


def plant(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, standing: np.ndarray, fps: float) -> Planted:
    """The motion with its feet held on the ground, z = 0, wherever `standing` (T, 2, 2) says that heels and toes stand.

    root (T, 3) m and rotations (T, J, 4) local: the motion laid out. The feet keep their own rotation but for a turn about
    the vertical that holds a flat foot's direction; the pelvis is lowered where a leg could not reach.
    """
    body = identify(skeleton)
    places, world = pose_kinematics(skeleton, root, rotations)
    scale = 30.0 / fps
    goals = [_goal(places, world, limb, standing[:, side], scale) for side, limb in enumerate((body.left, body.right))]
    root = root.copy()
    root[:, 2] -= _drop(places, (body.left, body.right), [goal for goal, _ in goals], int(round(4 * fps / 30.0)))
    correction, miss = np.zeros((len(root), 2)), np.zeros((len(root), 2))
    out = rotations
    for side, limb in enumerate((body.left, body.right)):
        target, foot = goals[side]
        chain = (limb.upper_leg, limb.lower_leg, limb.foot)
        reached = two_bone(skeleton, root, out, chain, target, end_rotation=foot, soft=EASE)
        out, miss[:, side] = reached.rotations, reached.miss
        correction[:, side] = np.linalg.norm(target - places[:, limb.foot], axis=1)
    return Planted(root, out, correction, miss)


def _goal(places: np.ndarray, world: np.ndarray, limb: Limb, stands: np.ndarray, scale: float):
    """Where the ankle goes (T, 3) and the foot's world rotation (T, 4)."""
    heel, toe = places[:, limb.foot], places[:, limb.toe_or_foot]
    weight = _firmness(stands)
    along = toe - heel if limb.toe is not None else quaternion.rotate(world[:, limb.foot], np.array([1.0, 0.0, 0.0]))
    yaw = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
    flat = np.min(weight, axis=1)
    turn = shift(np.diff(yaw)[:, None], flat[:, None], scale)[:, 0]
    spin = quaternion.about_up(turn)
    toe = heel + quaternion.rotate(spin, toe - heel)
    ground, weight = _held(np.stack([np.diff(heel[:, :2], axis=0), np.diff(toe[:, :2], axis=0)], axis=1), weight, scale)
    lift = _lift(heel[:, 2], toe[:, 2], weight, scale)
    return heel + np.column_stack([ground, lift]), quaternion.multiply(spin, world[:, limb.foot])


def _firmness(stands: np.ndarray) -> np.ndarray:
    """(T, 2) how firmly heel and toe stand: 1, half in a stance's first and last frame, when it is still arriving, else 0."""
    padded = np.pad(stands, ((1, 1), (0, 0)), mode="edge")
    inner = stands & padded[:-2] & padded[2:]
    return np.where(inner, 1.0, np.where(stands, 0.5, 0.0))


def _held(velocity: np.ndarray, weight: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """The shift (T, 2), and the weights (T, 2) with which it was found: stances that would need more than MOST_SHIFT are
    held less firmly, since a foot that slides looks better than a leg torn after it (give-way order, ../shared/metrics.md)."""
    stance = weight.max(axis=1) > 0
    label = np.cumsum(np.diff(stance, prepend=False)) * stance
    ground = shift(velocity, weight, scale)
    for _ in range(4):
        far = np.zeros(label.max() + 1)
        np.maximum.at(far, label, np.where(stance, np.linalg.norm(ground, axis=1), 0.0))
        if far.max() <= MOST_SHIFT:
            break
        ease = np.minimum(1.0, (MOST_SHIFT / np.maximum(far, 1e-9)) ** 3)
        weight = weight * ease[label][:, None]
        ground = shift(velocity, weight, scale)
    return ground, weight


def shift(velocity: np.ndarray, weight: np.ndarray, scale: float = 1.0, kept: np.ndarray | None = None) -> np.ndarray:
    """The smooth shift D (T, K) that cancels velocities where they carry weight.

    velocity (T - 1, P, K) or, for one point, (T - 1, K): movement per frame of P points; weight (T, P): how firmly each
    point stands. Minimizes sum w |D' + v|^2 + SMOOTH |D'''|^2 + PULL |D|^2 with differences per frame at 30 frames per
    second; `scale` is 30 over the rate, which keeps the balance at other rates. kept: (T, K) shifts that are given, rows of
    NaN where D is free.
    """
    count = len(weight)
    if velocity.ndim == 2:
        velocity = velocity[:, None, :]
    firm = np.minimum(weight[1:], weight[:-1])
    total = firm.sum(axis=1)
    pushed = np.einsum("tp,tpk->tk", firm, velocity)
    right = np.zeros((count, velocity.shape[2]))
    right[1:] -= pushed
    right[:-1] += pushed
    band = np.zeros((4, count))
    _add_differences(band, np.array([-1.0, 1.0]), total)
    _add_differences(band, np.array([-1.0, 3.0, -3.0, 1.0]), np.full(max(count - 3, 0), SMOOTH / scale**4))
    band[0] += PULL * scale**2
    if kept is not None:
        given = ~np.isnan(kept[:, 0])
        band[0] += HOLD * given
        right += HOLD * np.where(given[:, None], kept, 0.0)
    return solveh_banded(band, right, lower=True)


def _add_differences(band: np.ndarray, stencil: np.ndarray, weight: np.ndarray) -> None:
    """Adds sum weight_t (sum_i stencil_i x_{t+i})^2 to a symmetric system in lower banded form."""
    for i, a in enumerate(stencil):
        for j, b in enumerate(stencil[: i + 1]):
            band[i - j, j : j + len(weight)] += weight * a * b


def _lift(heel: np.ndarray, toe: np.ndarray, weight: np.ndarray, scale: float) -> np.ndarray:
    """(T,) metres up: brings the carrying point to the height it has when the foot is flat, toes on the ground, and keeps
    both above it at all times."""
    flat = weight.min(axis=1) > 0
    rest = float(np.median((heel - toe)[flat])) if np.any(flat) else float(np.percentile(heel, 5))
    low = np.stack([heel - max(rest, 0.0), toe], axis=1)
    lift = _settle(-(low * weight).sum(axis=1), weight.sum(axis=1), scale)
    for _ in range(3):
        below = np.minimum(low.min(axis=1) + lift, 0.0)
        if below.min() > -1e-3:
            break
        sunk = np.where(below < -1e-3, 1.0, 0.0)
        lift = lift + _settle(-below * sunk, sunk, scale)
    return lift


def _settle(right: np.ndarray, weight: np.ndarray, scale: float) -> np.ndarray:
    """The smooth curve (T,) that is `right` / `weight` where weight is large, and small elsewhere."""
    band = np.zeros((4, len(weight)))
    _add_differences(band, np.array([-1.0, 3.0, -3.0, 1.0]), np.full(max(len(weight) - 3, 0), SMOOTH / scale**6))
    band[0] += weight + 2e-2
    return solveh_banded(band, right, lower=True)


def _drop(places: np.ndarray, limbs: tuple[Limb, Limb], goals: list[np.ndarray], reach: int) -> np.ndarray:
    """(T,) metres to lower the pelvis so that both ankles can be reached, at most MOST_DROP, without a jerk."""
    need = np.zeros(len(places))
    for limb, goal in zip(limbs, goals):
        hip, knee, ankle = (places[:, j] for j in (limb.upper_leg, limb.lower_leg, limb.foot))
        length = np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(ankle - knee, axis=1) - EASE
        level = np.linalg.norm(goal[:, :2] - hip[:, :2], axis=1)
        highest = goal[:, 2] + np.sqrt(np.maximum(length**2 - level**2, 0.0))
        need = np.maximum(need, np.where(level < length, hip[:, 2] - highest, MOST_DROP))
    need = np.clip(need, 0.0, MOST_DROP)
    window = np.hanning(2 * reach + 3)[1:-1]
    widened = maximum_filter1d(need, 2 * reach + 1, mode="nearest")
    padded = np.pad(widened, reach, mode="edge")
    return np.convolve(padded, window / window.sum(), mode="valid")
