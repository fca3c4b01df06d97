"""A subject's model from recordings: built on the static trial or on upright frames of the motion, then refined by the
motion (Fredriksson §5.2.2).

Landmarks predict all joint centres (`centres`). The motion then refines them by adjusting the model and its poses in
many frames together (`adjustment`). This takes the place of sphere fits joint by joint (the [14] and [19] of
Fredriksson §3.2.4): it too finds the point that stands still in both segments, but for all joints at once, with the
bones between them as long in every frame, and it says how sure each centre is. So hips, knees, ankles, shoulders,
elbows and marked wrists are functional as far as the motion turns them, and stay predicted where it does not; spine,
neck and toes are predicted, with little play. Axes of knees and elbows come out of it as well: they are where these
joints bend like hinges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..errors import Cancelled, InputError
from ..motion.motion import Motion
from .adjustment import Adjustment, Body, Prior, Pull
from .assemble import model_from_frame
from .calibration_frames import neutral_frames, unlike_frames
from .chain import chain
from .late_markers import with_late_markers
from .marker_set import MarkerSet
from .model import MarkerModel
from .pose import PoseSettings, Solved, solve
from .residuals import seen_markers
from .static import static_frame
from .trial import MarkerTrial
from .weights import cluster_deviation, edge_deviation

FRAMES = 60
_STATIC_FRAMES = 4
_NEUTRAL_FRAMES = 5
_WORTH = 10.0  # independent frames that the chosen ones are worth: skin errs alike in poses alike
_PLACE_SIGMA = 0.008
_USUAL_SIGMA = 0.006
_UNTOLD = 0.001  # m: what no motion can tell stays as predicted
_FAR, _FAR_BESIDE = 2.0, 0.005  # a frame is passed over that fits so many times, and m, worse than the middle one
_LIMBS = {"ForeArm": 1, "Hand": 1, "Leg": 2, "Foot": 2}
"""Bones that lie exactly along an axis: joint at their end -> axis."""


def calibrate(
    marker_set: MarkerSet,
    trial: MarkerTrial,
    static: MarkerTrial | None = None,
    progress: Callable[[float, str], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> MarkerModel:
    """The model of the body in `trial`.

    trial: cleaned, labelled as the set labels its markers. static: a static trial of the same body with the same
    markers, or None: the model then begins with upright frames of the motion. InputError where too few landmarks are
    seen, Cancelled when the user stops.
    """
    tell = progress or (lambda part, text: None)
    stopped = cancelled or (lambda: False)
    tell(0.0, "joint centres")
    model = from_static(marker_set, static) if static is not None else from_motion(marker_set, trial)
    model = replace(model, subject=trial.subject, sessions=(trial.name,))
    if stopped():
        raise Cancelled("calibration cancelled")
    tell(0.2, "refining the model")
    model = with_late_markers(model, marker_set, trial, stopped)
    model = replace(model, notes=(*model.notes, *_left_out(model, marker_set, trial)))
    return refined(model, trial, static, stopped)


def _left_out(model: MarkerModel, marker_set: MarkerSet, trial: MarkerTrial) -> list[str]:
    """Lines on the set's markers that are not on the model, and why."""
    absent = sorted(set(marker_set.labels) - set(model.markers) - marker_set.optional - marker_set.static)
    shown = {label for label, seen in zip(trial.labels, trial.seen.any(axis=0)) if seen}
    nowhere = [label for label in absent if label not in shown]
    loose = [label for label in absent if label in shown]
    lines = [f"seen nowhere, so not on the model: {', '.join(nowhere)}"] if nowhere else []
    if loose:
        lines.append(f"not on the model, since too little tells how their segments lie: {', '.join(loose)}")
    return lines


def from_static(marker_set: MarkerSet, static: MarkerTrial) -> MarkerModel:
    """The model that a static trial gives where it is stillest, averaged over its segments."""
    frame = static_frame(static, marker_set.clusters(static.labels))
    return model_from_frame(frame, marker_set, standing=True, subject=static.subject)


def from_motion(marker_set: MarkerSet, trial: MarkerTrial) -> MarkerModel:
    """The mean of the models that some upright frames of a motion give."""
    index = {label: i for i, label in enumerate(trial.labels)}
    landmarks = {
        name: tuple(index[label] for label in labels)
        for name, labels in marker_set.landmarks.items() if all(label in index for label in labels)
    }
    found, reason = [], None
    for frame in neutral_frames(trial, landmarks, _NEUTRAL_FRAMES):
        places = dict(zip(trial.labels, trial.positions[frame]))
        try:
            found.append(model_from_frame(places, marker_set, standing=False, subject=trial.subject))
        except InputError as error:
            reason = error
    if not found:
        raise reason or InputError(trial.name, "no frames")
    most = max(found, key=lambda model: (len(model.skeleton), len(model.markers)))
    alike = [m for m in found if m.skeleton.names == most.skeleton.names and m.markers == most.markers]
    skeleton = replace(
        most.skeleton, offsets=np.mean([m.skeleton.offsets for m in alike], axis=0),
        end_offsets=np.mean([m.skeleton.end_offsets for m in alike], axis=0),
    )
    note = f"no static trial: begun with {len(alike)} upright frame{'s' if len(alike) > 1 else ''} of the motion"
    places = np.mean([m.places for m in alike], axis=0)
    return replace(most, skeleton=skeleton, places=places, notes=(*most.notes, note))


def refined(
    model: MarkerModel, trial: MarkerTrial, static: MarkerTrial | None = None,
    cancelled: Callable[[], bool] = lambda: False, frames: int = FRAMES, worth: float = _WORTH,
    place_sigma: float = _PLACE_SIGMA,
) -> MarkerModel:
    """The model adjusted to the motion: joint centres, bone lengths and markers' places, each by its uncertainty."""
    part = _chosen(model, trial, static, frames)
    solved = solve(model, part, PoseSettings(weights=False, limits=False), cancelled=cancelled)
    motion, part = _sane(solved, part)
    body = _body(model)
    task = Adjustment(body, _prior(model, place_sigma), _pull(model), seen_markers(model, part), _sigmas(model), worth)
    task.start(motion)
    for _ in range(2):
        if cancelled():
            raise Cancelled("calibration cancelled")
        task.run()
        task.sigma = _scatter(task.residuals())
    skeleton = replace(model.skeleton, offsets=body.offsets)
    deviation = edge_deviation(model.joint, body.places, seen_markers(model, part))
    return replace(
        model, skeleton=skeleton, places=body.places, sigma=task.sigma, centre_sigma=task.uncertainty(),
        edge_sigma=cluster_deviation(model.joint, deviation),
    )


def _chosen(model: MarkerModel, trial: MarkerTrial, static: MarkerTrial | None, count: int) -> MarkerTrial:
    """The frames to adjust to, of the model's markers alone: unlike ones of the motion, and some of the static trial.

    They are no neighbours in time, which the rate of one frame a second tells whoever solves them.
    """
    root = [i for i, label in enumerate(trial.labels) if label in model.markers
            and model.joint[model.markers.index(label)] == 0]
    positions = seen_markers(model, trial)[unlike_frames(trial, np.array(root, dtype=int), count)]
    if static is not None:
        still = seen_markers(model, static)[np.unique(np.linspace(0, len(static) - 1, _STATIC_FRAMES).astype(int))]
        positions = np.concatenate([still, positions])
    return MarkerTrial(model.markers, positions, 1.0, name=trial.name)


def _sane(solved: Solved, part: MarkerTrial) -> tuple[Motion, MarkerTrial]:
    """Without the frames that fit far worse than most: swapped markers, or a pose that was not found."""
    known = np.isfinite(solved.residual)
    square = np.where(known, solved.residual, 0.0) ** 2
    away = np.sqrt(square.sum(axis=1) / np.maximum(known.sum(axis=1), 1))
    away[~known.any(axis=1)] = np.inf
    good = np.flatnonzero(away <= _FAR * np.median(away[np.isfinite(away)]) + _FAR_BESIDE)
    motion = solved.motion
    kept = Motion(motion.skeleton, motion.root_positions[good], motion.rotations[good], motion.fps)
    return kept, part.with_positions(part.positions[good])


def _part(name: str) -> str:
    return name.removeprefix("Left").removeprefix("Right")


def _body(model: MarkerModel) -> Body:
    names = model.skeleton.names
    limb = np.array([_LIMBS.get(_part(name), -1) for name in names])
    held = ~model.freedom.free.any(axis=1)
    return Body(
        names, model.skeleton.parents, model.skeleton.offsets.copy(), model.joint, model.places.copy(), held, limb
    )


def _prior(model: MarkerModel, place_sigma: float) -> Prior:
    sigma = np.maximum(model.centre_sigma, 0.003)
    above = sigma[np.maximum(model.skeleton.parents, 0)]
    places = np.full(len(model.joint), place_sigma)
    held = ~model.freedom.free.any(axis=1)
    offsets = np.where(held, _UNTOLD, np.sqrt(sigma**2 + above**2))
    return Prior(model.skeleton.offsets.copy(), offsets, model.places.copy(), places)


def _pull(model: MarkerModel) -> Pull:
    """Play about the rest pose: of joints that are drawn to it, and of angles that are not free."""
    play = {}
    for joint in range(1, len(model.skeleton)):
        free = model.freedom.free[joint]
        if not free.any():
            continue
        row = np.full(3, _USUAL_SIGMA / model.stiffness[joint] if model.stiffness[joint] > 0.0 else np.inf)
        for angle, letter in enumerate(model.freedom.order[joint]):
            if not free[angle]:
                row["XYZ".index(letter)] = np.radians(1.0)
        if np.isfinite(row).any():
            play[joint] = row
    freedom = model.freedom
    runs = chain(model.skeleton, model.joint, model.places, freedom.order, freedom.free).runs
    return Pull(play, runs)


def _sigmas(model: MarkerModel) -> np.ndarray:
    return np.maximum(model.sigma, 0.004)


def _scatter(residuals: np.ndarray) -> np.ndarray:
    """How far markers stray (M,) m, from residuals (F, M, 3), half by what skin usually does."""
    known = np.isfinite(residuals).all(axis=-1)
    square = np.where(known, np.sum(np.nan_to_num(residuals) ** 2, axis=-1), 0.0).sum(axis=0)
    mean = square / np.maximum(known.sum(axis=0), 1) / 3.0
    return np.sqrt(0.5 * _USUAL_SIGMA**2 + 0.5 * np.where(known.any(axis=0), mean, _USUAL_SIGMA**2))
