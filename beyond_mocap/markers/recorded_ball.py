"""The ball of a marker recording: the middle of the markers that are named as a ball."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..motion.ball_names import choose_ball, is_ball_name
from ..motion.track.ball_path import BallPath
from .reconstruct import Reconstruction

_ONE_BALL = 0.4  # m between two markers of one ball at most, the widest ball and noise


def trace_recorded_ball(result: Reconstruction, on_floor: bool) -> tuple[BallPath | None, tuple[str, ...]]:
    """Trace the ball of a reconstructed trial.

    A lone marker lies on the ball's surface; of several the middle counts, where all of them are visible.

    Args:
        result: the reconstruction.
        on_floor: whether the floor is at height 0, as in `Reconstruction.place_on_floor`; else as in its motion.
    Returns:
        The ball on the clock of the trial's first frame; None without a marker that is named as a ball. Also notes for
        the user.
    """
    trial = result.raw
    markers = [number for number, label in enumerate(trial.labels) if is_ball_name(label)]
    groups = _group_markers(trial.positions, markers)
    if not groups:
        return None, ()
    lower = [0.0, 0.0, result.floor if on_floor else result.lowered_by]
    paths = [trial.positions[:, group].mean(axis=1) - lower for group in groups]
    names = ["+".join(trial.labels[number] for number in group) for group in groups]
    chosen, notes = choose_ball(names, paths, result.motion.root_positions)
    known = np.isfinite(paths[chosen]).all(axis=1)
    return BallPath(np.arange(len(known)) / trial.fps, paths[chosen], known), notes


def _group_markers(positions: np.ndarray, markers: Sequence[int]) -> list[list[int]]:
    """Group markers of positions (T, M, 3) m that stay as near to each other as on one ball."""
    groups: list[list[int]] = []
    for number in markers:
        near = [group for group in groups if _measure_distance(positions, group[0], number) <= _ONE_BALL]
        if near:
            near[0].append(number)
        else:
            groups.append([number])
    return groups


def _measure_distance(positions: np.ndarray, one: int, other: int) -> float:
    """Measure the median distance, m, of two markers; infinite where they are never both visible."""
    apart = np.linalg.norm(positions[:, one] - positions[:, other], axis=1)
    apart = apart[np.isfinite(apart)]
    return float(np.median(apart)) if len(apart) else np.inf
