"""Which frames of a motion a model is made from: upright ones, and ones as unlike as can be."""

from __future__ import annotations

import numpy as np

from ..motion.arctangent import arctan2
from .frames import rigid_fit
from .trial import MarkerTrial

_CANDIDATES = 400


def neutral_frames(trial: MarkerTrial, landmarks: dict[str, tuple[int, ...]], count: int) -> list[int]:
    """Up to `count` frames in which the body stands most like one in a static trial, best first.

    landmarks: name -> indices of its markers. Straight knees, an upright trunk and low feet count; frames lie a fifth
    of a second apart, and frames in which a landmark is hidden come only where there are no others.
    """
    at = {name: trial.positions[:, list(group)].mean(axis=1) for name, group in landmarks.items()}
    cost = np.zeros(len(trial))
    for place in at.values():
        cost += np.where(np.isfinite(place).all(axis=-1), 0.0, 3.0)
    for side in ("left", "right"):
        names = [f"{side}_asis", f"{side}_knee_lateral", f"{side}_ankle_lateral"]
        if all(name in at for name in names):
            hip, knee, ankle = (at[name] for name in names)
            cost += np.nan_to_num(1.0 - _cosine(hip - knee, knee - ankle), nan=1.0) * 2.0
            cost += np.nan_to_num(np.maximum(_tilt(knee - ankle) - 0.1, 0.0), nan=0.5)
    if "c7" in at and "left_asis" in at and "right_asis" in at:
        cost += np.nan_to_num(_tilt(at["c7"] - 0.5 * (at["left_asis"] + at["right_asis"])), nan=0.5)
    chosen: list[int] = []
    apart = max(1, int(round(0.2 * trial.fps)))
    for frame in np.argsort(cost, kind="stable"):
        if len(chosen) == count or (chosen and cost[frame] > cost[chosen[0]] + 1.0):
            break
        if all(abs(int(frame) - other) >= apart for other in chosen):
            chosen.append(int(frame))
    return chosen


def _cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    return np.sum(a * b, axis=-1) / np.maximum(length, 1e-9)


def _tilt(v: np.ndarray) -> np.ndarray:
    """Angle in radians between vectors (T, 3) and the vertical."""
    return arctan2(np.linalg.norm(v[:, :2], axis=-1), v[:, 2])


def unlike_frames(trial: MarkerTrial, root: np.ndarray, count: int) -> np.ndarray:
    """`count` frames whose poses differ most, ascending: each next one is farthest from those chosen.

    root: indices of the pelvis' markers, in whose frame poses are compared. Frames that show less than two thirds of
    what others show are passed over.
    """
    frames = np.unique(np.linspace(0, len(trial) - 1, min(len(trial), _CANDIDATES)).astype(int))
    shown = trial.seen[frames].sum(axis=1)
    frames = frames[shown >= 0.67 * shown.max()]
    if len(frames) <= count:
        return frames
    positions = trial.positions[frames]
    own = positions[:, root] if len(root) else positions
    reference = own[int(np.argmax(np.isfinite(own).all(axis=-1).sum(axis=1)))]
    fit = rigid_fit(reference, own)
    pose = np.einsum("fba,fmb->fma", fit.rotation, positions - fit.shift[:, None])
    known = np.isfinite(pose)
    middle = np.where(known, pose, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    pose = np.where(known, pose, middle).reshape(len(frames), -1)
    if not pose.any():  # the pelvis is never seen: nothing tells poses apart
        return frames[np.unique(np.linspace(0, len(frames) - 1, count).astype(int))]
    chosen = [int(np.argmin(np.linalg.norm(pose - pose.mean(axis=0), axis=1)))]
    nearest = np.full(len(frames), np.inf)
    while len(chosen) < count:
        nearest = np.minimum(nearest, np.linalg.norm(pose - pose[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(nearest)))
    return np.sort(frames[chosen])
