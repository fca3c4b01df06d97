"""A model from one frame of markers: the static trial's mean, or a chosen frame of the motion itself."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import Skeleton
from .centres import Centres, predict
from .joint_freedom import freedom_of
from .marker_set import MarkerSet
from .model import MarkerModel
from .template import JOINTS, PARENTS, SCAPULAE

SIGMA = 0.008
"""How far skin markers stray, metres, until a motion tells; how far edges stray is left open (NaN)."""


def landmark_places(frame: Mapping[str, np.ndarray], marker_set: MarkerSet) -> dict[str, np.ndarray]:
    """Landmark -> (3,) m, from places of markers {label: (3,) m}; those of which no marker is seen are left out."""
    found = {}
    for landmark, labels in marker_set.landmarks.items():
        seen = [frame[x] for x in labels if x in frame and np.isfinite(frame[x]).all()]
        if len(seen) == len(labels):
            found[landmark] = np.mean(seen, axis=0)
    return found


def model_from_frame(
    frame: Mapping[str, np.ndarray], marker_set: MarkerSet, standing: bool = True, subject: str = "", session: str = ""
) -> MarkerModel:
    """The model that one frame gives, with predicted joint centres.

    frame: label -> (3,) m, Z up, NaN where not seen. standing: whether it is a static trial's frame. InputError where
    too few landmarks are marked.
    """
    centres = predict(landmark_places(frame, marker_set), standing)
    carried = {label: marker_set.segment_of(label) for label in frame if np.isfinite(frame[label]).all()}
    return model_from_centres(centres, frame, carried, marker_set=marker_set, subject=subject, session=session)


def model_from_centres(
    centres: Centres, frame: Mapping[str, np.ndarray], carried: Mapping[str, str | None], marker_set: MarkerSet,
    subject: str = "", session: str = "",
) -> MarkerModel:
    """The model with these joint centres and axes, on which each marker of the frame lies where it was seen."""
    names = _joint_names(centres, set(carried.values()))
    skeleton, axes, places = _skeleton(centres, names)
    labels, joints, on = [], [], []
    for label in marker_set.labels:
        joint = carried.get(label)
        if joint is None or joint not in names:
            continue
        index = names.index(joint)
        labels.append(label)
        joints.append(index)
        on.append(axes[index].T @ (np.asarray(frame[label], dtype=float) - places[index]))
    if not labels:
        raise InputError("model", "no marker on any joint", "markers of the set", "check labels and marker set")
    counts = {name: joints.count(index) for index, name in enumerate(names)}
    freedom, stiffness = freedom_of(names, skeleton.parents, counts)
    return MarkerModel(
        skeleton=skeleton, markers=tuple(labels), joint=np.array(joints), places=np.array(on),
        sigma=np.full(len(labels), SIGMA), edge_sigma=np.full(len(labels), np.nan), freedom=freedom,
        stiffness=stiffness, centre_sigma=np.array([centres.sigma[name] for name in names]), subject=subject,
        sessions=(session,) if session else (), set_name=marker_set.name, notes=tuple(centres.notes),
    )


def _joint_names(centres: Centres, carriers: set) -> list[str]:
    """Joints that the frame tells, parents first; shoulder blades only where they are marked, arms down to a gap."""
    names: list[str] = []
    for name in JOINTS:
        if name not in centres.axes or (name in SCAPULAE and name not in carriers):
            continue
        if name.endswith("Shoulder") and name.replace("Shoulder", "Arm") not in centres.axes:
            continue
        names.append(name)
    return names


def _parent(name: str, names: list[str]) -> int:
    above = PARENTS[name]
    while above is not None and above not in names:
        above = PARENTS[above]
    return -1 if above is None else names.index(above)


def _skeleton(centres: Centres, names: list[str]):
    """Skeleton, world axes (J, 3, 3) and places (J, 3) m of its joints in the frame."""
    parents = [_parent(name, names) for name in names]
    axes = np.array([centres.axes[name] for name in names])
    places = np.array([centres.places[name] for name in names])
    offsets = np.array([
        axes[parent].T @ (places[index] - places[parent]) if parent >= 0 else np.zeros(3)
        for index, parent in enumerate(parents)
    ])
    tips = [(names.index(joint), place) for joint, place in centres.tips.items() if joint in names]
    ends = [axes[joint].T @ (place - places[joint]) for joint, place in tips]
    skeleton = Skeleton(tuple(names), tuple(parents), offsets, tuple(joint for joint, _ in tips), np.array(ends))
    return skeleton, axes, places
