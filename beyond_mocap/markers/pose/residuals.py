"""How the markers of a model agree with those that were seen: how far apart they are, how much each counts (less where
its cluster is bent out of shape, Fredriksson §5.3.2), and on which floor the feet stand."""

from __future__ import annotations

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from ..model.model import MarkerModel
from ..trial import MarkerTrial

OVER_SOLE = 0.03
"""Metres from the sole up to the lowest marker of a foot that stands: some 3 cm on bare feet and on shoes."""
AT_ZERO = (0.01, 0.09)
"""Metres over height 0 of the lowest foot marker with which the floor is at 0: below, a marker would be in it; above
are thicker soles than boots and skates have."""
_FEET = ("Foot", "ToeBase")

_SHORTEST = 5e-3  # metres: edges of markers that lie closer say nothing about the shape


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


def floor_under(model: MarkerModel, trial: MarkerTrial) -> float:
    """Height in metres of the floor that the feet of a trial stand on, the lowest where it is uneven; 0 where that is
    as near to 0 as can be told, or no marker is on a foot."""
    names = model.skeleton.names
    feet = [i for i, joint in enumerate(model.joint) if names[joint].endswith(_FEET)]
    heights = seen_markers(model, trial)[:, feet, 2]
    heights = heights[np.isfinite(heights).any(axis=1)]
    if not heights.size:
        return 0.0
    lowest = float(np.percentile(np.nanmin(heights, axis=1), 2))
    return 0.0 if AT_ZERO[0] <= lowest <= AT_ZERO[1] else lowest - OVER_SOLE


def edge_deviation(joint: np.ndarray, places: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """sigma_i of eq. 5.3, (T, M): by how much the edges between a marker and the others of its cluster are longer or
    shorter than in the model, as a part of their length.

    joint: (M,) the cluster of each marker. places: (M, 3) m in the model. seen: (T, M, 3) m, NaN where not seen. NaN
    where a marker is not seen or has fewer than two edges: the deviation of one edge cannot be laid to either end."""
    out = np.full(seen.shape[:2], np.nan)
    for cluster in np.unique(joint):
        own = np.flatnonzero(joint == cluster)
        if len(own) > 2:
            out[:, own] = _of_cluster(places[own], seen[:, own])
    return out


def _of_cluster(places: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """`edge_deviation` of one cluster of N markers."""
    length = np.linalg.norm(places[:, None] - places, axis=-1)
    between = np.sqrt(np.sum((seen[:, :, None] - seen[:, None]) ** 2, axis=-1))
    with np.errstate(invalid="ignore", divide="ignore"):
        square = (between / length - 1.0) ** 2
    known = np.isfinite(square) & (length > _SHORTEST)
    edges = known.sum(axis=-1)
    # n - 1 of eq. 5.3 is the number of a marker's edges; here of those that are seen
    mean = np.where(known, square, 0.0).sum(axis=-1) / np.maximum(edges, 1)
    return np.where(edges >= 2, np.sqrt(mean), np.nan)


def cluster_deviation(joint: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """sigma_s of eq. 5.4, (M,): for every marker the deviation of its whole cluster over all frames.

    deviation: (T, M) of `edge_deviation`. The sum runs over the cluster's markers and is divided by the frames, as
    printed: with n markers a cluster, a marker begins to count less when it deviates sqrt(n) times as much as the
    cluster's markers do in the mean. NaN where nothing is known."""
    square = deviation**2
    known = np.isfinite(square)
    mean = np.where(known, square, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    out = np.full(deviation.shape[1], np.nan)
    for cluster in np.unique(joint):
        own = (joint == cluster) & known.any(axis=0)
        out[own] = np.sqrt(mean[own].sum())
    return out


def marker_weights(joint: np.ndarray, places: np.ndarray, seen: np.ndarray,
                   usual: np.ndarray | None = None) -> np.ndarray:
    """w_i of eq. 5.1 for every frame and marker, (T, M): 0 where it is not seen, else min(1, sigma_s / sigma_i).

    Eq. 5.2 is printed the other way round (sigma_i / sigma_s), which would count a marker the more the further it is
    off. A marker whose sigma is unknown counts 1. usual: (M,) sigma_s of each marker's cluster where it is known from
    elsewhere (NaN where not); None: from these frames."""
    deviation = edge_deviation(joint, places, seen)
    own = cluster_deviation(joint, deviation)
    if usual is not None:
        own = np.where(np.isfinite(usual), usual, own)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = own / deviation
    counted = np.where(np.isfinite(ratio), np.minimum(ratio, 1.0), 1.0)
    return np.where(np.isfinite(seen).all(axis=-1), counted, 0.0)
