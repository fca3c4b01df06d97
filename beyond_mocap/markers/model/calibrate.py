"""Calibrate a subject's model: build it from the static trial or upright frames, then refine it with the motion.

Landmarks predict all joint centres (`centres`). The motion then refines them by adjusting the model and its poses in
many frames together (`adjustment`). This replaces sphere fits joint by joint (references [14] and [19] of Fredriksson
section 3.2.4): it also finds the point that is fixed in both segments, but for all joints at once, with bones of
constant length, and it estimates the uncertainty of each centre. Hips, knees, ankles, shoulders, elbows and marked
wrists are therefore functional where the motion rotates them enough, and stay predicted where it does not; spine, neck
and toes are predicted, with little tolerance. The axes of knees and elbows follow from it too: they lie where these
joints bend like hinges. Source: Fredriksson section 5.2.2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...base.errors import InputError, UserCancelledError
from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from ..pose.chain import build_chain
from ..pose.pose import PoseSettings, PoseSolution, solve_poses
from ..pose.residuals import collect_markers, compute_cluster_deviation, measure_edge_deviation
from ..rigid_fit import fit_rigid
from ..trial import MarkerTrial
from .adjustment import Adjustment, Body, Prior, Pull
from .assemble import SIGMA, average_static_frame, build_model_from_frame
from .marker_set import MarkerSet
from .model import MarkerModel, build_freedom

MOTION_FRAMES = 60  # frames of the motion to which a model is adjusted
_STATIC_FRAMES = 4  # frames of the static trial that are added
_NEUTRAL_FRAMES = 5  # upright frames from which a model without a static starts
_EFFECTIVE_FRAMES = 10.0  # effective number of independent frames: similar poses have similar skin errors
_PLACE_SIGMA = 0.008  # metres, prior uncertainty of a marker's place
_USUAL_SIGMA = 0.006  # metres by which skin markers usually deviate
_FIXED_SIGMA = 0.001  # metres, prior uncertainty that keeps offsets of fixed joints as predicted
# A frame is skipped if its residual exceeds so many times the median, plus so many metres.
_OUTLIER_FACTOR, _OUTLIER_MARGIN = 2.0, 0.005
_LIMBS = {"ForeArm": 1, "Hand": 1, "Leg": 2, "Foot": 2}
"""Bones that lie exactly along an axis: joint at their end -> axis."""
_CANDIDATES = 400  # frames of a motion among which the most different ones are selected
# Frames from which a late marker is placed, and frames in which it must be visible.
_LATE_MARKER_FRAMES, _MIN_LATE_FRAMES = 40, 3


def add_late_markers(model: MarkerModel, marker_set: MarkerSet, trial: MarkerTrial,
                     cancelled: Callable[[], bool] | None = None) -> MarkerModel:
    """Add the markers of the set that the model lacks and the trial shows, and free the joints that they determine.

    Each marker is placed at the median of its positions in its segment's frame, over some frames solved without it.

    Args:
        model: the model so far.
        marker_set: its marker set.
        trial: the recorded markers.
        cancelled: returns True when the user stops the job.
    Returns:
        The extended model, or the model itself.
    """
    seen = dict(zip(trial.labels, trial.visibility.sum(axis=0)))
    late = [label for label in marker_set.labels
            if label not in model.markers and seen.get(label, 0) >= _MIN_LATE_FRAMES
            and marker_set.find_segment(label) in model.skeleton.names]
    if not late:
        return model
    visible_counts = trial.visibility[:, [trial.index_of(label) for label in late]].sum(axis=1)
    frames = np.sort(np.argsort(-visible_counts, kind="stable")[: 4 * _LATE_MARKER_FRAMES])
    frames = frames[np.unique(np.linspace(0, len(frames) - 1, _LATE_MARKER_FRAMES).astype(int))]
    part = MarkerTrial(labels=trial.labels, positions=trial.positions[frames], fps=1.0, name=trial.name)
    motion = solve_poses(model, part, PoseSettings(weights=False, limits=False), cancelled=cancelled).motion
    joints, rotations = forward_kinematics(motion)
    places, carriers, found = [], [], []
    for label in late:
        joint = model.skeleton.index(marker_set.find_segment(label))
        away = part.positions[:, part.index_of(label)] - joints[:, joint]
        local = quaternion.rotate(quaternion.inverse(rotations[:, joint]), away)
        local = local[np.isfinite(local).all(axis=-1)]
        if len(local):
            found.append(label)
            carriers.append(joint)
            places.append(np.median(local, axis=0))
    return _add_markers(model, found, carriers, places) if found else model


def _add_markers(model: MarkerModel, labels: list[str], joints: list[int], places: list[np.ndarray]) -> MarkerModel:
    """Return the model with more markers: labels, joint indices and places (3,) metres."""
    joint = np.concatenate([model.joint, joints])
    counts = {name: int(np.sum(joint == index)) for index, name in enumerate(model.skeleton.names)}
    freedom, stiffness = build_freedom(model.skeleton.names, model.skeleton.parents, counts)
    return replace(model, markers=(*model.markers, *labels), joint=joint, places=np.concatenate([model.places, places]),
                   sigma=np.concatenate([model.sigma, np.full(len(labels), SIGMA)]),
                   edge_sigma=np.concatenate([model.edge_sigma, np.full(len(labels), np.nan)]), freedom=freedom,
                   stiffness=stiffness, notes=(*model.notes, f"placed from the motion alone: {', '.join(labels)}"))


def find_neutral_frames(trial: MarkerTrial, landmarks: dict[str, tuple[int, ...]], count: int) -> list[int]:
    """Find frames in which the body stands most like in a static trial.

    Straight knees, an upright trunk and vertical shanks lower the cost; frames in which a landmark is hidden are used
    only where there are no others. Frames are at least a fifth of a second apart.

    Args:
        trial: the recorded markers.
        landmarks: name -> indices of its markers.
        count: maximum number of frames.
    Returns:
        Frame indices, best first.
    """
    at = {name: trial.positions[:, list(group)].mean(axis=1) for name, group in landmarks.items()}
    cost = np.zeros(len(trial))
    for place in at.values():
        cost += np.where(np.isfinite(place).all(axis=-1), 0.0, 3.0)
    for side in ("left", "right"):
        names = [f"{side}_asis", f"{side}_knee_lateral", f"{side}_ankle_lateral"]
        if all(name in at for name in names):
            hip, knee, ankle = (at[name] for name in names)
            length = np.linalg.norm(hip - knee, axis=-1) * np.linalg.norm(knee - ankle, axis=-1)
            cosine = np.sum((hip - knee) * (knee - ankle), axis=-1) / np.maximum(length, 1e-9)
            cost += np.nan_to_num(1.0 - cosine, nan=1.0) * 2.0
            cost += np.nan_to_num(np.maximum(_compute_tilt(knee - ankle) - 0.1, 0.0), nan=0.5)
    if "c7" in at and "left_asis" in at and "right_asis" in at:
        cost += np.nan_to_num(_compute_tilt(at["c7"] - 0.5 * (at["left_asis"] + at["right_asis"])), nan=0.5)
    chosen: list[int] = []
    min_gap = max(1, int(round(0.2 * trial.fps)))
    for frame in np.argsort(cost, kind="stable"):
        if len(chosen) == count or (chosen and cost[frame] > cost[chosen[0]] + 1.0):
            break
        if all(abs(int(frame) - other) >= min_gap for other in chosen):
            chosen.append(int(frame))
    return chosen


def _compute_tilt(v: np.ndarray) -> np.ndarray:
    """Compute the angle in radians between vectors (T, 3) and the vertical."""
    return arctan2(np.linalg.norm(v[:, :2], axis=-1), v[:, 2])


def select_diverse_frames(trial: MarkerTrial, root: np.ndarray, count: int) -> np.ndarray:
    """Select the frames whose poses differ most: each next one is farthest from those chosen.

    Frames that show less than two thirds of the markers that others show are skipped.

    Args:
        trial: the recorded markers.
        root: indices of the pelvis markers, in whose frame poses are compared.
        count: number of frames.
    Returns:
        Frame indices, ascending.
    """
    frames = np.unique(np.linspace(0, len(trial) - 1, min(len(trial), _CANDIDATES)).astype(int))
    visible_counts = trial.visibility[frames].sum(axis=1)
    frames = frames[visible_counts >= 0.67 * visible_counts.max()]
    if len(frames) <= count:
        return frames
    positions = trial.positions[frames]
    own = positions[:, root] if len(root) else positions
    reference = own[int(np.argmax(np.isfinite(own).all(axis=-1).sum(axis=1)))]
    fit = fit_rigid(reference, own)
    pose = np.einsum("fba,fmb->fma", fit.rotation, positions - fit.shift[:, None])
    known = np.isfinite(pose)
    middle = np.where(known, pose, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    pose = np.where(known, pose, middle).reshape(len(frames), -1)
    if not pose.any():  # without a visible pelvis poses cannot be compared
        return frames[np.unique(np.linspace(0, len(frames) - 1, count).astype(int))]
    chosen = [int(np.argmin(np.linalg.norm(pose - pose.mean(axis=0), axis=1)))]
    # farthest-point sampling: `nearest` is the distance of each frame to the chosen set
    nearest = np.full(len(frames), np.inf)
    while len(chosen) < count:
        nearest = np.minimum(nearest, np.linalg.norm(pose - pose[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(nearest)))
    return np.sort(frames[chosen])


def calibrate(marker_set: MarkerSet, trial: MarkerTrial, static: MarkerTrial | None = None,
              progress: Callable[[float, str], None] | None = None,
              cancelled: Callable[[], bool] | None = None) -> MarkerModel:
    """Calibrate the model of the body in a trial.

    Args:
        marker_set: the marker set of the trial's labels.
        trial: cleaned.
        static: a static trial of the same body with the same markers, or None; the model then starts from upright
            frames.
        progress: called with the share that is done and a text.
        cancelled: returns True when the user stops the job.
    Returns:
        The model, with the name of the trial as its session.
    Raises:
        InputError: if too few landmarks are visible.
        UserCancelledError: if the user stops the job.
    Source: Fredriksson section 5.2.2.
    """
    report = progress or (lambda part, text: None)
    is_cancelled = cancelled or (lambda: False)
    report(0.0, "joint centres")
    model = build_from_static(marker_set, static) if static is not None else build_from_motion(marker_set, trial)
    model = replace(model, subject=trial.subject, sessions=(trial.name,))
    if is_cancelled():
        raise UserCancelledError("calibration cancelled")
    report(0.2, "refining the model")
    model = add_late_markers(model, marker_set, trial, is_cancelled)
    model = replace(model, notes=(*model.notes, *_describe_left_out(model, marker_set, trial)))
    return refine_model(model, trial, static, is_cancelled)


def _describe_left_out(model: MarkerModel, marker_set: MarkerSet, trial: MarkerTrial) -> list[str]:
    """Describe which markers of the set are not on the model, and why."""
    absent = sorted(set(marker_set.labels) - set(model.markers) - marker_set.optional - marker_set.static)
    visible = {label for label, seen in zip(trial.labels, trial.visibility.any(axis=0)) if seen}
    nowhere = [label for label in absent if label not in visible]
    loose = [label for label in absent if label in visible]
    lines = [f"never visible, so not on the model: {', '.join(nowhere)}"] if nowhere else []
    if loose:
        lines.append(f"not on the model, since too few markers determine their segments: {', '.join(loose)}")
    return lines


def build_from_static(marker_set: MarkerSet, static: MarkerTrial) -> MarkerModel:
    """Build a model from the stillest part of a static trial.

    Args:
        marker_set: the marker set.
        static: the static trial.
    Returns:
        The model before refinement.
    Raises:
        InputError: if the body moves, or landmarks are missing.
    """
    frame = average_static_frame(static, marker_set.select_clusters(static.labels))
    return build_model_from_frame(frame, marker_set, is_static=True, subject=static.subject)


def build_from_motion(marker_set: MarkerSet, trial: MarkerTrial) -> MarkerModel:
    """Build a model as the mean of the models of some upright frames.

    Args:
        marker_set: the marker set.
        trial: the recorded motion.
    Returns:
        The model before refinement.
    Raises:
        InputError: if no frame shows enough landmarks.
    """
    index = {label: i for i, label in enumerate(trial.labels)}
    landmarks = {name: tuple(index[label] for label in labels) for name,
                 labels in marker_set.landmarks.items() if all(label in index for label in labels)}
    found, reason = [], None
    for frame in find_neutral_frames(trial, landmarks, _NEUTRAL_FRAMES):
        places = dict(zip(trial.labels, trial.positions[frame]))
        try:
            found.append(build_model_from_frame(places, marker_set, is_static=False, subject=trial.subject))
        except InputError as error:
            reason = error
    if not found:
        raise reason or InputError(trial.name, "no upright frame", "a frame that shows the landmarks",
                                   "record a static trial")
    most = max(found, key=lambda model: (len(model.skeleton), len(model.markers)))
    matching = [m for m in found if m.skeleton.names == most.skeleton.names and m.markers == most.markers]
    skeleton = replace(most.skeleton, offsets=np.mean([m.skeleton.offsets for m in matching], axis=0),
                       end_offsets=np.mean([m.skeleton.end_offsets for m in matching], axis=0))
    note = (f"no static trial: started from {len(matching)} upright frame{'s' if len(matching) > 1 else ''} "
            "of the motion")
    places = np.mean([m.places for m in matching], axis=0)
    return replace(most, skeleton=skeleton, places=places, notes=(*most.notes, note))


def refine_model(model: MarkerModel, trial: MarkerTrial, static: MarkerTrial | None,
                 cancelled: Callable[[], bool]) -> MarkerModel:
    """Adjust a model to the motion: joint centres, bone lengths and markers' places, each weighted by its uncertainty.

    Args:
        model: the model so far.
        trial: the recorded motion.
        static: the static trial, or None.
        cancelled: returns True when the user stops the job.
    Returns:
        The adjusted model with the uncertainties of its centres and markers.
    Raises:
        UserCancelledError: if the user stops the job.
    """
    part = _select_frames(model, trial, static)
    solved = solve_poses(model, part, PoseSettings(weights=False, limits=False), cancelled=cancelled)
    motion, part = _remove_poor_frames(solved, part)
    body = _build_body(model)
    task = Adjustment(body, _build_prior(model), _build_pull(model), seen=collect_markers(model, part),
                      sigma=np.maximum(model.sigma, 0.004), effective_frames=_EFFECTIVE_FRAMES)
    task.start_from(motion)
    for _ in range(2):
        if cancelled():
            raise UserCancelledError("calibration cancelled")
        task.run_steps()
        task.sigma = _estimate_scatter(task.compute_residuals())
    skeleton = replace(model.skeleton, offsets=body.offsets)
    deviation = measure_edge_deviation(model.joint, body.places, collect_markers(model, part))
    return replace(model, skeleton=skeleton, places=body.places, sigma=task.sigma,
                   centre_sigma=task.compute_uncertainty(), edge_sigma=compute_cluster_deviation(model.joint,
            deviation))


def _select_frames(model: MarkerModel, trial: MarkerTrial, static: MarkerTrial | None) -> MarkerTrial:
    """Select the frames to adjust to, with the model's markers alone: diverse frames of the motion and some of the
    static.

    The frames are not neighbours in time; a rate of one frame per second keeps the solver from treating them as such.
    """
    root = [i for i, label in enumerate(trial.labels) if label in model.markers
            and model.joint[model.markers.index(label)] == 0]
    positions = collect_markers(model, trial)[select_diverse_frames(trial, np.array(root, dtype=int), MOTION_FRAMES)]
    if static is not None:
        still = collect_markers(model, static)[np.unique(np.linspace(0, len(static) - 1, _STATIC_FRAMES).astype(int))]
        positions = np.concatenate([still, positions])
    return MarkerTrial(labels=model.markers, positions=positions, fps=1.0, name=trial.name)


def _remove_poor_frames(solved: PoseSolution, part: MarkerTrial) -> tuple[Motion, MarkerTrial]:
    """Remove frames that fit far worse than most: swapped markers, or a pose that was not found."""
    known = np.isfinite(solved.residual)
    square = np.where(known, solved.residual, 0.0) ** 2
    away = np.sqrt(square.sum(axis=1) / np.maximum(known.sum(axis=1), 1))
    away[~known.any(axis=1)] = np.inf
    used = np.flatnonzero(away <= _OUTLIER_FACTOR * np.median(away[np.isfinite(away)]) + _OUTLIER_MARGIN)
    motion = solved.motion
    selected = Motion(motion.skeleton, motion.root_positions[used], motion.rotations[used], motion.fps)
    return selected, part.with_positions(part.positions[used])


def _build_body(model: MarkerModel) -> Body:
    """Build the unknowns of the adjustment from a model."""
    names = model.skeleton.names
    limb = np.array([_LIMBS.get(name.removeprefix("Left").removeprefix("Right"), -1) for name in names])
    held = ~model.freedom.free.any(axis=1)
    return Body(names=names, parents=model.skeleton.parents, offsets=model.skeleton.offsets.copy(), joint=model.joint,
                places=model.places.copy(), is_fixed=held, limb=limb)


def _build_prior(model: MarkerModel) -> Prior:
    """Build the prior of the adjustment from the uncertainties of a model."""
    sigma = np.maximum(model.centre_sigma, 0.003)
    above = sigma[np.maximum(model.skeleton.parents, 0)]
    places = np.full(len(model.joint), _PLACE_SIGMA)
    held = ~model.freedom.free.any(axis=1)
    offsets = np.where(held, _FIXED_SIGMA, np.sqrt(sigma**2 + above**2))
    return Prior(offsets=model.skeleton.offsets.copy(), offset_sigma=offsets, places=model.places.copy(),
                 place_sigma=places)


def _build_pull(model: MarkerModel) -> Pull:
    """Build the pull to the rest pose: of stiff joints, and of angles that are not free."""
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
    runs = build_chain(model.skeleton, model.joint, model.places, freedom.order, freedom.free).runs
    return Pull(play, runs)


def _estimate_scatter(residuals: np.ndarray) -> np.ndarray:
    """Estimate how far markers deviate, (M,) metres, from residuals (F, M, 3): half measured, half the usual value
    of skin.
    """
    known = np.isfinite(residuals).all(axis=-1)
    square = np.where(known, np.sum(np.nan_to_num(residuals) ** 2, axis=-1), 0.0).sum(axis=0)
    mean = square / np.maximum(known.sum(axis=0), 1) / 3.0
    return np.sqrt(0.5 * _USUAL_SIGMA**2 + 0.5 * np.where(known.any(axis=0), mean, _USUAL_SIGMA**2))
