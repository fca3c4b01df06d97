"""The manner of a player: whose walk, arms and energy they show throughout a match.

Folders of motion capture hold many people. One who walks like the first now and like the second a moment later is
no one. So a player follows the manner of one recording's calm walking, and clips that look like it come first, of
whomever they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

WALKING_SPEEDS = (0.5, 2.2)  # m/s at which a manner is seen; runs and stands follow the walk of their own clip
LEAST_SECONDS = 3.0  # of calm walking in a recording whose manner players can follow
NEAR, FAR = 0.5, 1.5  # times the usual distance of two manners: the same up to the first, different from the second
_FEWEST_FRAMES = 10  # frames with which a recording's manner is known
_LEAST_SPREAD = 1e-3


@dataclass(frozen=True, eq=False)
class Manners:
    """How the people of a library move, one manner for each recording that walks.

    Attributes:
        of_clip: (C,) index of each clip's manner, -1 where it is not known; a recording and its mirror image share it.
        distance: (M, M) between manners, in the usual distance of two.
        models: the manners that players can follow, the most usual first.
    """

    of_clip: np.ndarray
    distance: np.ndarray
    models: tuple[int, ...]

    def measure_difference(self, number: int) -> np.ndarray:
        """Measure how far every clip's manner is from a player's.

        Args:
            number: of the player; the models are given out in turn.
        Returns:
            (C,) float32 from 0, the same, to 1; 0 where a manner is not known, and without any model.
        """
        if not self.models:
            return np.zeros(len(self.of_clip), np.float32)
        away = self.distance[self.models[number % len(self.models)]]
        difference = np.append(np.clip((away - NEAR) / (FAR - NEAR), 0.0, 1.0), 0.0)
        return difference[self.of_clip].astype(np.float32)

    def append_unknown(self, count: int) -> Manners:
        """Append `count` clips whose manner is not known."""
        return replace(self, of_clip=np.append(self.of_clip, np.full(count, -1)))


def measure_manners(paths: list[str], frames, is_calm: np.ndarray, fps: float) -> Manners:
    """Measure the manners of a library.

    Args:
        paths: path of each of C clips; a recording and its mirror image have the same.
        frames: the library's frames, N.
        is_calm: (N,) bool, frames of recordings that belong to locomotion.
        fps: frames per second.
    """
    from scipy.spatial.distance import cdist

    seen = is_calm & (frames.speed >= WALKING_SPEEDS[0]) & (frames.speed <= WALKING_SPEEDS[1])
    recording = np.unique(paths, return_inverse=True)[1]
    count = np.bincount(recording[frames.clip[seen]], minlength=recording.max(initial=-1) + 1)
    known = np.flatnonzero(count >= _FEWEST_FRAMES)
    total = np.zeros((len(count), frames.posture.shape[1]))
    np.add.at(total, recording[frames.clip[seen]], frames.posture[seen])
    means = total[known] / count[known, None]
    spread = means.std(axis=0) + _LEAST_SPREAD if len(known) else 1.0
    scaled = means / spread
    distance = cdist(scaled, scaled)
    others = distance[np.triu_indices(len(known), 1)]
    number = np.full(len(count), -1)
    number[known] = np.arange(len(known))
    # both the recording and its mirror image count
    walkers = np.flatnonzero(count[known] >= 2.0 * LEAST_SECONDS * fps)
    unusual = np.linalg.norm(scaled - np.median(scaled, axis=0), axis=1) if len(known) else np.zeros(0)
    models = walkers[np.argsort(unusual[walkers], kind="stable")]
    usual = float(np.median(others)) if len(others) else 1.0
    return Manners(number[recording], distance / max(usual, 1e-9), tuple(int(model) for model in models))
