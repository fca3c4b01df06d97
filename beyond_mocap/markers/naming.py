"""A trial under its marker set's own names; markers that nobody named are put on the side they are near to."""

from __future__ import annotations

import numpy as np

from .model.marker_set import UNLABELED, MarkerSet
from .trial import MarkerTrial


def named_as(trial: MarkerTrial, marker_set: MarkerSet) -> MarkerTrial:
    """The trial under the set's names.

    A set may say which unlabeled marker is which (`also LHAND: x52`), but recording software numbers these anew in
    every trial: where both of a left and a right one have come so, each goes to the side whose markers it is near to.
    """
    names = marker_set.renaming(trial.labels)
    chance = {new: old for old, new in names.items() if UNLABELED.match(old)}
    for new, old in chance.items():
        twin = _twin(new, marker_set, chance)
        if twin and _side(marker_set, new) == "Left":
            kept = [_apart(trial, one, marker_set, "Left") + _apart(trial, other, marker_set, "Right")
                    for one, other in ((old, chance[twin]), (chance[twin], old))]
            if kept[1] < kept[0]:
                names[old], names[chance[twin]] = twin, new
    return trial.renamed(names)


def _side(marker_set: MarkerSet, label: str) -> str:
    segment = marker_set.segment_of(label) or ""
    return next((side for side in ("Left", "Right") if segment.startswith(side)), "")


def _twin(label: str, marker_set: MarkerSet, among) -> str | None:
    """The label on the other side's segment that is called alike."""
    segment = marker_set.segment_of(label) or ""
    other = segment.replace("Left", "Right") if "Left" in segment else segment.replace("Right", "Left")
    there = [x for x in marker_set.segments.get(other, ()) if x in among and x[1:] == label[1:]]
    return there[0] if there and other != segment else None


def _apart(trial: MarkerTrial, label: str, marker_set: MarkerSet, side: str) -> float:
    """Metres on average from a marker to the nearest of the side's own."""
    own = trial.positions[:, trial.index(label)]
    best = np.inf
    for segment, labels in marker_set.segments.items():
        for other in labels:
            if segment.startswith(side) and other in trial.labels and other != label:
                apart = np.linalg.norm(trial.positions[:, trial.index(other)] - own, axis=-1)
                apart = apart[np.isfinite(apart)]
                if len(apart):
                    best = min(best, float(apart.mean()))
    return best
