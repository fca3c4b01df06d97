"""Markers that the static trial, or the frames that a model began with, did not show: placed where the motion has
them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..motion import quaternion
from ..motion.motion import forward_kinematics
from .assemble import SIGMA
from .joint_freedom import freedom_of
from .marker_set import MarkerSet
from .model import MarkerModel
from .pose import PoseSettings, solve
from .trial import MarkerTrial

_FRAMES = 40
_FEWEST = 3  # frames in which a marker has to be seen


def with_late_markers(
    model: MarkerModel, marker_set: MarkerSet, trial: MarkerTrial, cancelled: Callable[[], bool] | None = None
) -> MarkerModel:
    """The model with the set's markers that it lacks and the trial shows, and joints freed that they now tell.

    Each lies at the median of where it is seen in its segment's frame, over some frames solved without it.
    """
    seen = dict(zip(trial.labels, trial.seen.sum(axis=0)))
    late = [label for label in marker_set.labels
            if label not in model.markers and seen.get(label, 0) >= _FEWEST
            and marker_set.segment_of(label) in model.skeleton.names]
    if not late:
        return model
    shown = trial.seen[:, [trial.index(label) for label in late]].sum(axis=1)
    frames = np.sort(np.argsort(-shown, kind="stable")[: 4 * _FRAMES])
    frames = frames[np.unique(np.linspace(0, len(frames) - 1, _FRAMES).astype(int))]
    part = MarkerTrial(trial.labels, trial.positions[frames], 1.0, name=trial.name)
    motion = solve(model, part, PoseSettings(weights=False, limits=False), cancelled=cancelled).motion
    joints, turns = forward_kinematics(motion)
    places, carriers, found = [], [], []
    for label in late:
        joint = model.skeleton.index(marker_set.segment_of(label))
        away = part.positions[:, part.index(label)] - joints[:, joint]
        local = quaternion.rotate(quaternion.inverse(turns[:, joint]), away)
        local = local[np.isfinite(local).all(axis=-1)]
        if len(local):
            found.append(label)
            carriers.append(joint)
            places.append(np.median(local, axis=0))
    return _added(model, found, carriers, places) if found else model


def _added(model: MarkerModel, labels: list[str], joints: list[int], places: list[np.ndarray]) -> MarkerModel:
    joint = np.concatenate([model.joint, joints])
    counts = {name: int(np.sum(joint == index)) for index, name in enumerate(model.skeleton.names)}
    freedom, stiffness = freedom_of(model.skeleton.names, model.skeleton.parents, counts)
    return replace(
        model, markers=(*model.markers, *labels), joint=joint, places=np.concatenate([model.places, places]),
        sigma=np.concatenate([model.sigma, np.full(len(labels), SIGMA)]),
        edge_sigma=np.concatenate([model.edge_sigma, np.full(len(labels), np.nan)]),
        freedom=freedom, stiffness=stiffness,
        notes=(*model.notes, f"placed by the motion alone: {', '.join(labels)}"),
    )
