"""How far the markers of a moving model are from those that were seen."""

from __future__ import annotations

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from ..model.model import MarkerModel
from ..trial import MarkerTrial


def model_markers(model: MarkerModel, motion: Motion) -> np.ndarray:
    """Places (T, M, 3) m, world, of the model's markers on its moving skeleton."""
    places, world = forward_kinematics(motion)
    return places[:, model.joint] + quaternion.rotate(world[:, model.joint], model.places)


def seen_markers(model: MarkerModel, trial: MarkerTrial) -> np.ndarray:
    """Places (T, M, 3) m of the model's markers in a trial, NaN where one is not seen or the trial has none."""
    out = np.full((len(trial), len(model.markers), 3), np.nan)
    there = [i for i, label in enumerate(model.markers) if label in trial.labels]
    out[:, there] = trial.positions[:, [trial.index(model.markers[i]) for i in there]]
    return out


def residuals(model: MarkerModel, motion: Motion, trial: MarkerTrial) -> np.ndarray:
    """Metres (T, M) between the markers of the model and those of a trial, NaN where unseen. Motion and trial have the
    same frames."""
    return np.linalg.norm(model_markers(model, motion) - seen_markers(model, trial), axis=-1)
