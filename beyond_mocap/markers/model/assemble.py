"""Build models from one frame of markers, and merge the models of a subject's sessions (Fredriksson section 5.2).

A standing body breathes and sways. Averaging places would shrink what rotates, so each cluster of a static trial is
averaged in its own technical frame, and each frame relative to that of the segment it hangs on, from the root outwards.

A body's bones are the same every day; only the markers lie elsewhere, and so the estimated bones differ. Segment by
segment, from the root down, the sessions' frames are rotated onto each other where the centres of the joints below show
a difference. These centres are then averaged in the rotated frames, weighted by their certainty, and the markers of
each session follow their segment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import Skeleton
from ..cleaning.cluster_shape import compute_mean_shape, compute_medians, compute_quantile
from ..rigid_fit import RigidFit, compute_mean_rotation, fit_rigid, place_points, to_model_frame
from ..trial import MarkerTrial
from .centres import predict_centres
from .joint_centres import JointCentres
from .marker_set import MarkerSet
from .model import MarkerModel, build_freedom
from .template import JOINTS, PARENTS, SCAPULAE

# Deviation of skin markers in metres, until a motion gives a better estimate; that of edges stays unknown (NaN).
SIGMA = 0.008

_MAX_STILL_SPEED = 0.1  # m/s, median of the markers over a second; a body that stands still is not faster

_ROUNDS = 4  # alternations of rotating the sessions' frames and averaging the centres
_MIN_SIGMA = 1e-4  # metres, lower bound of the uncertainty of a centre


def find_landmarks(frame: Mapping[str, np.ndarray], marker_set: MarkerSet) -> dict[str, np.ndarray]:
    """Find the places of landmarks.

    Args:
        frame: label -> (3,) metres, NaN where not visible.
        marker_set: says which markers a landmark lies on.
    Returns:
        Landmark -> (3,) metres; landmarks with a marker that is not visible are left out.
    """
    found = {}
    for landmark, labels in marker_set.landmarks.items():
        seen = [frame[x] for x in labels if x in frame and np.isfinite(frame[x]).all()]
        if len(seen) == len(labels):
            found[landmark] = np.mean(seen, axis=0)
    return found


def build_model_from_frame(frame: Mapping[str, np.ndarray], marker_set: MarkerSet, is_static: bool = True,
                           subject: str = "", session: str = "") -> MarkerModel:
    """Build the model of one frame: predicted joint centres, with each marker where it was recorded.

    Args:
        frame: label -> (3,) metres, Z up, NaN where not visible.
        marker_set: the marker set.
        is_static: whether it is a frame of a static trial.
        subject: whose markers these are.
        session: name of the recording.
    Returns:
        The model.
    Raises:
        InputError: if too few landmarks are visible.
    """
    centres = predict_centres(find_landmarks(frame, marker_set), is_static)
    carried = {label: marker_set.find_segment(label) for label in frame if np.isfinite(frame[label]).all()}
    names = _select_joints(centres, set(carried.values()))
    skeleton, axes, places = _build_skeleton(centres, names)
    labels, joints, local_places = [], [], []
    for label in marker_set.labels:
        joint = carried.get(label)
        if joint in names:
            index = names.index(joint)
            labels.append(label)
            joints.append(index)
            local_places.append(axes[index].T @ (np.asarray(frame[label], dtype=float) - places[index]))
    if not labels:
        raise InputError("model", "no marker on any joint", "markers of the set", "check the labels and the marker set")
    counts = {name: joints.count(index) for index, name in enumerate(names)}
    freedom, stiffness = build_freedom(names, skeleton.parents, counts)
    return MarkerModel(skeleton=skeleton, markers=tuple(labels), joint=np.array(joints), places=np.array(local_places),
                       sigma=np.full(len(labels), SIGMA), edge_sigma=np.full(len(labels), np.nan), freedom=freedom,
                       stiffness=stiffness, centre_sigma=np.array([centres.sigma[name] for name in names]),
                       subject=subject, sessions=(session,) if session else (), set_name=marker_set.name,
                       notes=tuple(centres.notes))


def _select_joints(centres: JointCentres, carriers: set) -> list[str]:
    """Select the joints with known axes, parents first; shoulder blades only with markers, arms only down to a gap."""
    names: list[str] = []
    for name in JOINTS:
        if name not in centres.axes or (name in SCAPULAE and name not in carriers):
            continue
        if name.endswith("Shoulder") and name.replace("Shoulder", "Arm") not in centres.axes:
            continue
        names.append(name)
    return names


def _find_parent(name: str, names: list[str]) -> int:
    above = PARENTS[name]
    while above is not None and above not in names:
        above = PARENTS[above]
    return -1 if above is None else names.index(above)


def _build_skeleton(centres: JointCentres, names: list[str]):
    """Build the skeleton; return it with world axes (J, 3, 3) and places (J, 3) metres of its joints in the frame."""
    parents = [_find_parent(name, names) for name in names]
    axes = np.array([centres.axes[name] for name in names])
    places = np.array([centres.places[name] for name in names])
    offsets = np.array([axes[parent].T @ (places[index] - places[parent]) if parent >= 0 else np.zeros(3) for index,
                        parent in enumerate(parents)])
    tips = [(names.index(joint), place) for joint, place in centres.tips.items() if joint in names]
    ends = [axes[joint].T @ (place - places[joint]) for joint, place in tips]
    skeleton = Skeleton(tuple(names), tuple(parents), offsets, tuple(joint for joint, _ in tips), np.array(ends))
    return skeleton, axes, places


def average_static_frame(trial: MarkerTrial, clusters: Mapping[str, Sequence[str]],
                         seconds: float = 2.0) -> dict[str, np.ndarray]:
    """Average the stillest part of a static trial into one frame.

    Markers of segments with too few markers for a frame of their own are averaged in the frame of the segment they hang
    on; markers of no segment by their places.

    Args:
        trial: the static trial.
        clusters: segment (of `template.JOINTS`, others hang on the root) -> labels.
        seconds: duration of the part.
    Returns:
        Label -> (3,) metres, NaN for markers that are never visible in that part.
    Raises:
        InputError: if the body moves throughout the trial.
    """
    first, end = find_stillest_frames(trial, seconds)
    part = trial.positions[first:end]
    index = {label: i for i, label in enumerate(trial.labels)}
    groups = {name: [index[label] for label in labels if label in index] for name, labels in clusters.items()}
    out = compute_medians(part) + np.where(np.isfinite(part).any(axis=0), 0.0, np.nan)
    frames, means = _fit_technical_frames(part, groups), {}
    order = [name for name in PARENTS if name in groups] + [name for name in groups if name not in PARENTS]
    for name in order:
        above = _find_segment_above(name, means)
        if name in frames:
            own = _compute_mean_frame(frames[name], frames.get(above), means.get(above))
            means[name], above = own, name
        if above is None:
            continue
        local = to_model_frame(frames[above], part[:, groups[name]])
        places = compute_medians(local) + np.where(np.isfinite(local).any(axis=0), 0.0, np.nan)
        world_places = place_points(means[above], places)
        out[groups[name]] = np.where(np.isfinite(world_places), world_places, out[groups[name]])
    return {label: out[i] for label, i in index.items()}


def find_stillest_frames(trial: MarkerTrial, seconds: float = 2.0) -> tuple[int, int]:
    """Find the stillest part of a trial, of those in which the most markers are visible.

    Args:
        trial: the static trial.
        seconds: duration of the part.
    Returns:
        Index of the first frame, and the index after the last.
    Raises:
        InputError: if the body moves even there.
    """
    length = max(1, min(len(trial), int(round(seconds * trial.fps))))
    positions = trial.positions
    step = max(1, int(round(0.1 * trial.fps)))
    moved = np.full(len(trial), np.nan)
    if len(trial) > step:
        speed = np.linalg.norm(positions[step:] - positions[:-step], axis=-1) * trial.fps / step
        moved[: len(speed)] = compute_quantile(speed, 0.5, axis=1)
    seen = trial.visibility.sum(axis=1)
    starts = np.unique(np.linspace(0, len(trial) - length, 24).astype(int))
    scores = [(-round(float(seen[a : a + length].mean())), float(compute_medians(moved[a : a + length])))
              for a in starts]
    best = min(range(len(starts)), key=lambda i: scores[i])
    if scores[best][1] > _MAX_STILL_SPEED:
        raise InputError(trial.name, f"even the stillest {length / trial.fps:.1f} s move at {scores[best][1]:.2f} m/s",
                         "a static trial, in which the person stands", "choose another static trial, or use none")
    return int(starts[best]), int(starts[best]) + length


def _fit_technical_frames(part, groups):
    """Fit {segment: its frames in the world} for the clusters that determine one in more than half of the frames."""
    frames = {}
    for name, group in groups.items():
        if len(group) < 3:
            continue
        shape = compute_mean_shape(part[:, group])
        fit = fit_rigid(shape.places, part[:, group], 1.0 / (shape.sigma**2 + 0.001**2))
        if fit.is_determined.mean() > 0.5:
            frames[name] = RigidFit(*(np.where(_expand_axes(fit.is_determined, each), each, np.nan)
                                      for each in fit[:3]), fit.is_determined)
    return frames


def _expand_axes(flags, like):
    """Return flags (T,) with as many axes as `like` (T, ...)."""
    return flags.reshape(-1, *[1] * (like.ndim - 1))


def _find_segment_above(name, means):
    """Return the nearest segment above that has a mean frame already; the first of all where there is none."""
    parent = PARENTS.get(name)
    while parent is not None and parent not in means:
        parent = PARENTS.get(parent)
    return parent if parent is not None else next(iter(means), None)


def _compute_mean_frame(own, above, mean_above):
    """Compute the mean of the frames `own` relative to the segment `above` and its mean, or in the world without
    one.
    """
    if above is None:
        return RigidFit(compute_mean_rotation(own.rotation), compute_medians(own.shift), np.zeros(()),
                        np.ones((), dtype=bool))
    turn = np.einsum("tji,tjk->tik", above.rotation, own.rotation)
    shift = to_model_frame(above, own.shift[:, None])[:, 0]
    rotation = mean_above.rotation @ compute_mean_rotation(turn)
    return RigidFit(rotation, place_points(mean_above, compute_medians(shift)[None])[0], np.zeros(()),
                    np.ones((), dtype=bool))


def merge_session_models(models: Sequence[MarkerModel]) -> tuple[MarkerModel, ...]:
    """Merge the models of one subject's sessions.

    Args:
        models: one model for each session.
    Returns:
        The models in their order, all with the same skeleton.
    Raises:
        InputError: if there are none, or their joints differ (another marker set, or another body).
    Source: Fredriksson section 5.2.3.
    """
    if not models:
        raise InputError("models", "no models", "at least one")
    _check_same_joints(models)
    first = models[0].skeleton
    weights = np.array([1.0 / np.maximum(model.centre_sigma, _MIN_SIGMA) ** 2 for model in models])
    offsets = np.array([model.skeleton.offsets for model in models])
    mean = np.average(offsets, axis=0, weights=np.broadcast_to(weights[:, :, None], offsets.shape))
    rotations = np.tile(np.eye(3), (len(models), len(first), 1, 1))
    for joint in range(len(first)):
        below = list(first.children(joint))
        if not below:
            continue
        # one joint below only fixes a direction, which all frames share: no rotation, one average
        for _ in range(_ROUNDS if len(below) > 1 else 1):
            for number in range(len(models)):
                rotations[number, joint] = _fit_rotation(offsets[number, below], mean[below], weights[number, below])
            rotated = np.einsum("sij,snj->sni", rotations[:, joint], offsets[:, below])
            mean[below] = np.average(rotated, axis=0, weights=np.broadcast_to(weights[:, below, None], rotated.shape))
    ends = np.mean([model.skeleton.end_offsets for model in models], axis=0)
    skeleton = Skeleton(first.names, first.parents, mean, first.end_parents, ends)
    sessions = tuple(dict.fromkeys(name for model in models for name in model.sessions))
    sigma = _compute_centre_sigma(weights, offsets, mean)
    return tuple(_move_to_skeleton(model, skeleton, turn, sessions, sigma) for model, turn in zip(models, rotations))


def _check_same_joints(models: Sequence[MarkerModel]) -> None:
    """Raise InputError if the models have different joints."""
    for model in models[1:]:
        one, other = models[0].skeleton, model.skeleton
        if (one.names, one.parents, one.end_parents) != (other.names, other.parents, other.end_parents):
            odd = sorted(set(one.names) ^ set(other.names))
            raise InputError("models", f"joints that differ between sessions: {', '.join(odd) or 'their order'}",
                             "sessions of one subject with the same joints")  # fmt: skip


def _fit_rotation(own: np.ndarray, mean: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Fit the rotation (3, 3) about the joint that brings the centres below it (N, 3) nearest to their means.

    A single centre gives no rotation: all frames share its direction, as rest poses have it.
    """
    if len(own) < 2:
        return np.eye(3)
    joint, fit_weights = [[0.0, 0.0, 0.0]], np.r_[weights.max() * 100.0,
                                                  weights]  # a large weight keeps the joint itself in place
    fit = fit_rigid(np.vstack([joint, own]), np.vstack([joint, mean]), fit_weights)
    return fit.rotation if fit.is_determined else np.eye(3)


def _move_to_skeleton(model: MarkerModel, skeleton: Skeleton, turn: np.ndarray, sessions, sigma) -> MarkerModel:
    """Move a session's model to the subject's skeleton.

    Markers rotate with their segment, and those along a bone that became longer or shorter keep their share of it.
    """
    places = np.einsum("mij,mj->mi", turn[model.joint], model.places)
    for joint in range(len(skeleton)):
        below = skeleton.children(joint)
        if len(below) != 1:
            continue
        old, new = model.skeleton.offsets[below[0]], skeleton.offsets[below[0]]
        own = np.flatnonzero(model.joint == joint)
        share = np.clip(places[own] @ old / max(old @ old, 1e-9), 0.0, 1.0)
        places[own] += share[:, None] * (new - old)
    return replace(model, skeleton=skeleton, places=places, sessions=sessions, centre_sigma=sigma)


def _compute_centre_sigma(weights: np.ndarray, offsets: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Compute the uncertainty (J,) metres of averaged centres: from that of each session, or from their spread if
    larger.
    """
    expected = 1.0 / np.sqrt(weights.sum(axis=0))
    spread = np.linalg.norm(np.sqrt(np.mean((offsets - mean) ** 2, axis=0)), axis=-1) / np.sqrt(len(offsets))
    return np.maximum(expected, spread)
