"""Stretches put one behind the other without a track to follow (Faustino §3.2.6)."""

from __future__ import annotations

import numpy as np

from ...motion import quaternion

UPRIGHT = np.cos(np.radians(50.0))  # height of the trunk's unit vector below which a body lies


def chained_facing(start: float, turn: np.ndarray) -> np.ndarray:
    """(T,) facing in radians from `start` on, turning by `turn` (T,) per frame as recorded; at a seam `turn` is 0, so
    that the next stretch begins in the direction in which the last one ended."""
    return start + np.cumsum(turn) - turn[0]


def torso_corrections(up: np.ndarray, seams: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """(S,) radians by which a stretch has to be turned more at each seam because the body is not upright there.

    up: (T, 3) direction of the torso (hips to neck) in the facing frame; expected: (S, 3) the same for the frame that
    the stretch before would have gone on with. Facing says little about a body that lies or dives: where both torsos
    lean more than 50 degrees, the stretch is turned until they lie the same way (§3.2.6, the extra check on the spine).
    """
    out = np.zeros(len(seams))
    for number, (seam, before) in enumerate(zip(seams, expected)):
        after = up[seam]
        if before[2] < UPRIGHT and after[2] < UPRIGHT:
            turn = np.arctan2(before[1], before[0]) - np.arctan2(after[1], after[0])
            out[number] = quaternion.wrapped(turn)
    return out


def chained_root(
    place: np.ndarray, velocity: np.ndarray, sway: np.ndarray, facing: np.ndarray, fps: float
) -> np.ndarray:
    """(T, 2) root on the ground from `place` (2,) on: the path's velocity (T, 2, m/s, facing frame) summed up, plus
    sway (T, 2). Across a seam the last displacement is repeated (eq. 24), which is what summing velocities does."""
    flat = np.concatenate([velocity, np.zeros((len(velocity), 1))], axis=1)
    turn = quaternion.about_up(facing)
    step = quaternion.rotate(turn, flat)[:, :2] / fps
    path = place + np.concatenate([np.zeros((1, 2)), np.cumsum(step[:-1], axis=0)])
    away = quaternion.rotate(turn, np.concatenate([sway, np.zeros((len(sway), 1))], axis=1))[:, :2]
    return path + away
