"""Feet: skate on carried contacts, slide per stance, GMD's skating ratio, the ground, and how far the lock moved a
foot.

Feet are (T, 2, 2, 3) metres: frame, side (left, right), joint (heel, toe), world position with Z up. The heel is the
foot (ankle) joint; a skeleton without a toe joint repeats it. Contacts are (T, 2) bool, labelled on the source clip and
carried along, so that moving a foot cannot change what is counted (`../shared/peers.md` §3a, trap iv).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from ...base.time_series import runs
from ...motion import quaternion
from ...motion.humanoid import identify
from ...motion.skeleton import Skeleton

NOTICED_SLIDE = 0.021
GMD_HEIGHT, GMD_SPEED, GMD_SECONDS = 0.05, 0.5, 0.25
# directions that a stance's travel is measured along: the widest of 24 is at least 0.998 of the true one
_DIRECTIONS = np.linspace(0.0, np.pi, 24, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])


def foot_joints(skeleton: Skeleton) -> np.ndarray:
    """Joint indices (2, 2): side (left, right) x (heel, toe)."""
    body = identify(skeleton)
    return np.array([[limb.foot, limb.toe_or_foot] for limb in (body.left, body.right)])


def contact_speeds(feet: np.ndarray, contacts: np.ndarray, fps: float) -> np.ndarray:
    """Horizontal speed of each foot while it is labelled contact: (T-1, 2) m/s, NaN elsewhere.

    Mean of heel and toe from one frame to the next, counted where both frames are contact (Kimodo's skate on contacts).
    """
    step = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1).mean(axis=-1) * fps
    return np.where(contacts[:-1] & contacts[1:], step, np.nan)


def stances(contacts: np.ndarray) -> np.ndarray:
    """Runs of at least two contact frames: (S, 3) int rows of first frame, frame after the last, side."""
    rows = []
    for side in range(contacts.shape[1]):
        rows += [(start, stop, side) for start, stop in runs(contacts[:, side]) if stop - start >= 2]
    return np.array(rows, dtype=int).reshape(-1, 3)


def stance_travel(toes: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Largest horizontal distance between two places of the planted toe within each stance: (S,) m.

    toes (T, 2, 3) m; spans (S, 3) of `stances`.
    """
    travel = np.zeros(len(spans))
    along = np.concatenate([toes[..., :2] @ _DIRECTIONS, np.zeros((1, 2, _DIRECTIONS.shape[1]))])
    for side in (0, 1):
        mine = spans[:, 2] == side
        if mine.any():
            bounds = spans[mine, :2].ravel()
            widest = np.maximum.reduceat(along[:, side], bounds)[::2] - np.minimum.reduceat(along[:, side], bounds)[::2]
            travel[mine] = widest.max(axis=1)
    return travel


def skating_steps(toes: np.ndarray, floor: float, fps: float) -> np.ndarray:
    """GMD's skating frames: (T-1,) bool, either foot.

    toes (T, 2, 3) m. Toe lower than 5 cm above the floor at t and t+1, faster than 0.5 m/s, and its 0.25 s mean speed
    too (Karunratanakul et al. 2023, Guided Motion Diffusion, `calculate_skating_ratio`; their code works at 20 fps).
    """
    speed = np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1) * fps
    width = 2 * int(GMD_SECONDS * fps / 2) + 1
    mean = uniform_filter1d(speed, width, axis=0, mode="constant") if len(speed) else speed
    low = toes[..., 2] - floor < GMD_HEIGHT
    return ((low[:-1] & low[1:]) & (speed > GMD_SPEED) & (mean > GMD_SPEED)).any(axis=1)


def support_height(feet: np.ndarray, contacts: np.ndarray, heel_rest: float) -> np.ndarray:
    """Height above the ground of each planted foot's lower part: (T, 2) m, NaN where there is no contact.

    feet (T, 2, 2, 3) m; `heel_rest`: height of the heel joint while the sole is flat, m. A foot on its heel counts by
    the heel, a foot on its toes by the toe, so neither rolling raises the figure.
    """
    lower = np.minimum(feet[..., 1, 2], feet[..., 0, 2] - heel_rest)
    return np.where(contacts, lower, np.nan)


def tip_height(skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Height (T,) m of the lower foot's tip, the end site of its toe (of the foot where it has no toe); NaN without
    one.

    positions (T, J, 3) m and rotations (T, J, 4) of the joints, world. Where a skeleton has no toe joints the floor is
    told by ankles, and only the tips show a boot that is in the ground.
    """
    body, lowest = identify(skeleton), np.full(len(positions), np.nan)
    for parent, offset in zip(skeleton.end_parents, skeleton.end_offsets):
        if parent in (body.left.toe_or_foot, body.right.toe_or_foot) and np.any(offset):
            tip = positions[:, parent] + quaternion.rotate(rotations[:, parent], offset)
            lowest = np.fmin(lowest, tip[:, 2])
    return lowest


def heel_rest_height(feet: np.ndarray, contacts: np.ndarray) -> float:
    """Height of the heel joint on a flat foot, m: 2nd percentile over feet (T, 2, 2, 3) while both are in contact (T,
    2).

    Over all frames where they never are, as in a run; NaN for no frames.
    """
    both = contacts.all(axis=1)
    heights = feet[both if both.any() else slice(None), :, 0, 2]
    return float(np.percentile(heights, 2)) if heights.size else np.nan


def planted_shift(feet: np.ndarray, wanted: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """How far planted feet stand from where the laid-out clip had them: feet, wanted (T, 2, 2, 3) m -> (N,) m.

    Heel and toe joints' mean distance, one value per planted foot and frame.
    """
    return np.linalg.norm(feet - wanted, axis=-1).mean(axis=-1)[contacts]
