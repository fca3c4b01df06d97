"""Compare a model's markers with recorded ones: distances, weights and floor height.

A marker has less weight where its cluster is deformed (Fredriksson section 5.3.2).
"""

from __future__ import annotations

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from ..model.model import MarkerModel
from ..trial import MarkerTrial

OVER_SOLE = 0.03
"""Metres from the sole up to the lowest marker of a foot on the ground: about 3 cm on bare feet and on shoes."""
AT_ZERO = (0.01, 0.09)
"""Heights in metres of the lowest foot marker for which the floor is taken as 0: a lower marker would be in the floor,
a higher one needs thicker soles than boots and skates have."""
_FEET = ("Foot", "ToeBase")

_MIN_EDGE = 5e-3  # metres; shorter edges between markers say nothing about the shape


def compute_model_markers(model: MarkerModel, motion: Motion) -> np.ndarray:
    """Compute the places of the model's markers on its moving skeleton.

    Args:
        model: the model with M markers.
        motion: T frames of its skeleton.
    Returns:
        (T, M, 3) metres, world.
    """
    places, world = forward_kinematics(motion)
    return places[:, model.joint] + quaternion.rotate(world[:, model.joint], model.places)


def collect_markers(model: MarkerModel, trial: MarkerTrial) -> np.ndarray:
    """Collect the model's markers from a trial.

    Args:
        model: the model with M markers.
        trial: T frames.
    Returns:
        (T, M, 3) metres, NaN where a marker is not visible or not in the trial.
    """
    out = np.full((len(trial), len(model.markers), 3), np.nan)
    known = [i for i, label in enumerate(model.markers) if label in trial.labels]
    out[:, known] = trial.positions[:, [trial.index_of(model.markers[i]) for i in known]]
    return out


def measure_residuals(model: MarkerModel, motion: Motion, trial: MarkerTrial) -> np.ndarray:
    """Measure the distances between the model's markers and those of a trial.

    Args:
        model: the model with M markers.
        motion: T frames of its skeleton.
        trial: the same T frames.
    Returns:
        (T, M) metres, NaN where not visible.
    """
    return np.linalg.norm(compute_model_markers(model, motion) - collect_markers(model, trial), axis=-1)


def measure_floor(model: MarkerModel, trial: MarkerTrial) -> float:
    """Measure the height of the floor under the feet, the lowest where it is uneven.

    Args:
        model: says which markers are on the feet.
        trial: the recorded markers.
    Returns:
        Metres; 0 where the floor cannot be distinguished from height 0, or no marker is on a foot.
    """
    names = model.skeleton.names
    feet = [i for i, joint in enumerate(model.joint) if names[joint].endswith(_FEET)]
    heights = collect_markers(model, trial)[:, feet, 2]
    heights = heights[np.isfinite(heights).any(axis=1)]
    if not heights.size:
        return 0.0
    lowest = float(np.percentile(np.nanmin(heights, axis=1), 2))
    return 0.0 if AT_ZERO[0] <= lowest <= AT_ZERO[1] else lowest - OVER_SOLE


def measure_edge_deviation(joint: np.ndarray, places: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Measure how far the edges between a marker and the others of its cluster deviate from the model (sigma_i).

    Args:
        joint: (M,) the cluster of each marker.
        places: (M, 3) metres in the model.
        seen: (T, M, 3) metres, NaN where not visible.
    Returns:
        (T, M) root mean square, as a share of the edges' length. NaN where a marker is not visible or has fewer than
        two edges: the deviation of one edge cannot be assigned to either end.
    Source: Fredriksson section 5.3.2, equation (5.3).
    """
    out = np.full(seen.shape[:2], np.nan)
    for cluster in np.unique(joint):
        own = np.flatnonzero(joint == cluster)
        if len(own) > 2:
            out[:, own] = _measure_cluster(places[own], seen[:, own])
    return out


def _measure_cluster(places: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Measure the edge deviation (T, N) of one cluster of N markers."""
    length = np.linalg.norm(places[:, None] - places, axis=-1)
    distance = np.sqrt(np.sum((seen[:, :, None] - seen[:, None]) ** 2, axis=-1))
    with np.errstate(invalid="ignore", divide="ignore"):
        square = (distance / length - 1.0) ** 2
    known = np.isfinite(square) & (length > _MIN_EDGE)
    edges = known.sum(axis=-1)
    # n - 1 of eq. 5.3 is the number of a marker's edges; here only visible ones count
    mean = np.where(known, square, 0.0).sum(axis=-1) / np.maximum(edges, 1)
    return np.where(edges >= 2, np.sqrt(mean), np.nan)


def compute_cluster_deviation(joint: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """Compute for every marker the deviation of its whole cluster over all frames (sigma_s).

    The sum runs over the cluster's markers and is divided by the frames, as printed: with n markers in a cluster, a
    marker loses weight when it deviates sqrt(n) times as much as the cluster's markers do on average.

    Args:
        joint: (M,) the cluster of each marker.
        deviation: (T, M) of `measure_edge_deviation`.
    Returns:
        (M,); NaN where nothing is known.
    Source: Fredriksson section 5.3.2, equation (5.4).
    """
    square = deviation**2
    known = np.isfinite(square)
    mean = np.where(known, square, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    out = np.full(deviation.shape[1], np.nan)
    for cluster in np.unique(joint):
        own = (joint == cluster) & known.any(axis=0)
        out[own] = np.sqrt(mean[own].sum())
    return out


def compute_marker_weights(joint: np.ndarray, places: np.ndarray, seen: np.ndarray,
                           usual: np.ndarray | None = None) -> np.ndarray:
    """Compute the weight of every marker in every frame (w_i): min(1, sigma_s / sigma_i).

    Eq. 5.2 is printed the other way round (sigma_i / sigma_s), which would give a marker more weight the further it is
    off.

    Args:
        joint: (M,) the cluster of each marker.
        places: (M, 3) metres in the model.
        seen: (T, M, 3) metres, NaN where not visible.
        usual: (M,) sigma_s of each marker's cluster where known from elsewhere (NaN where not); None uses these frames.
    Returns:
        (T, M); 0 where not visible, 1 where sigma_i is unknown.
    Source: Fredriksson section 5.3.2, equations (5.1) and (5.2).
    """
    deviation = measure_edge_deviation(joint, places, seen)
    own = compute_cluster_deviation(joint, deviation)
    if usual is not None:
        own = np.where(np.isfinite(usual), usual, own)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = own / deviation
    counted = np.where(np.isfinite(ratio), np.minimum(ratio, 1.0), 1.0)
    return np.where(np.isfinite(seen).all(axis=-1), counted, 0.0)


def measure_marker_visibility(model: MarkerModel, trial: MarkerTrial) -> np.ndarray:
    """Measure which share of each joint's own markers is visible.

    Args:
        model: the model with M markers on J joints.
        trial: the recorded markers, T frames.
    Returns:
        (T, J) shares, 0 to 1; 1 for joints that carry no marker.
    """
    seen = np.isfinite(collect_markers(model, trial)).all(axis=-1)
    shares = np.ones((len(trial), len(model.skeleton)))
    for joint, rows in model.collect_clusters().items():
        shares[:, joint] = seen[:, rows].mean(axis=1)
    return shares
