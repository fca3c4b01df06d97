"""Evaluate a path edit: distance from the path, speed, feet and smoothness, beside the figures of the recording itself.

`source` and `edited` are a `PathEditSource` and an `EditedMotion`; only their arrays are used. Definitions are those of
docs/explanation/quality.md: the root is the pelvis behind a zero-phase Hann window of 1.5 s.
"""

from __future__ import annotations

import numpy as np

from ..base.time_series import time_derivative
from ..motion import contacts as foot_contacts
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion, forward_kinematics
from ..motion.track import smooth_zero_phase_hann
from ..synthesis.quality import movement

MISS_LIMIT = 0.005  # m from its target beyond which a limb counts as not reaching it
_DENSE = 0.01  # metres between the places of the path that a pelvis is compared with
_MOVING = 0.3  # m/s below which a body counts as standing still, and its speed is not compared


def measure_path_edit(source, edited, path, ground=None) -> dict:
    """Measure all figures of a path edit.

    Of a motion that restarts with its path only the first lap is evaluated: the others are equal, with a cut between.

    Args:
        source: the motion relative to its own path.
        edited: the motion on the new path.
        path: the new path.
        ground: the mesh that the feet followed; None for the path's own height.
    Returns:
        Figures by name, None where unknown, such as feet of a skeleton without legs. `before`: before planting.
    """
    edited = edited.remove_repeats
    pelvis, own = (_compute_pelvis(motion, source.has_legs) for motion in (edited.motion, source.motion))
    frames = np.clip(np.rint(edited.frames).astype(int), 0, len(source.motion) - 1)
    fps = edited.motion.fps
    out = {"length_m": float(np.ptp(edited.arc)) if len(edited.arc) else 0.0,
           "root_error_m": _compute_spread(movement.measure_root_error(pelvis[:, :2], edited.origin[:, :2], fps)),
           "root_error_own_m": _compute_spread(_measure_own_error(source, own)),
           "nearest_m": _compute_spread(measure_path_distance(pelvis[:, :2], edited.origin[:, :2], path, fps)),
           "kept_speed": measure_kept_speed(source, edited, own, pelvis, frames),
           "seam_jerk": _measure_transitions(source, edited, own, pelvis), "ground_mm": None, "skate": None,
           "knee_jerk_ratio": None, "foot_correction_m": None, "ik_miss_share": None}
    if not source.has_legs:
        return out
    return {**out, **_measure_feet(source, edited, frames, ground), "knee_jerk_ratio": measure_knee_jerk(source, edited,
            frames)}


def _compute_pelvis(motion: Motion, humanoid: bool) -> np.ndarray:
    """Compute the places (T, 3) m of the hips, or of the root without any."""
    hips = identify_joints(motion.skeleton).hips if humanoid else 0
    return motion.root_positions if hips == 0 else forward_kinematics(motion)[0][:, hips]


def _measure_own_error(source, own: np.ndarray) -> np.ndarray:
    """Measure the distance (T,) m of the recording's root from its own path."""
    times = np.arange(len(own)) / source.motion.fps
    return movement.measure_root_error(own[:, :2], source.path.at(times)[:, :2], source.motion.fps)


def measure_path_distance(pelvis: np.ndarray, origin: np.ndarray, path, fps: float) -> np.ndarray:
    """Measure the distance of the root from the nearest point of the path, behind the same window.

    Args:
        pelvis: (T, 2) metres, before the window.
        origin: (T, 2) metres, places on the path that the edited motion passed; the rest of the path is not smoothed.
        path: the new path.
        fps: frames per second.
    Returns:
        (T,) metres.
    """
    from scipy.spatial import cKDTree

    low, high = path.domain
    line = path.at(np.linspace(low, high, 4001))[:, :2]
    both_lines = np.concatenate([smooth_zero_phase_hann(origin, fps, movement.ROOT_WINDOW), line])
    known = _densify_line(both_lines[: len(origin)])
    return cKDTree(known).query(smooth_zero_phase_hann(pelvis, fps, movement.ROOT_WINDOW))[0]


def _densify_line(line: np.ndarray) -> np.ndarray:
    """Interpolate places (M, 2) at most 1 cm apart along a line (T, 2); jumps of more than half a metre stay open."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    counts = np.where(steps < 0.5, np.maximum(steps / _DENSE, 1.0), 1.0).astype(int)
    shares = [np.arange(count) / count for count in counts]
    parts = [a + share[:, None] * (b - a) for a, b, share in zip(line[:-1], line[1:], shares)]
    return np.concatenate([*parts, line[-1:]])


def measure_kept_speed(source, edited, own: np.ndarray, pelvis: np.ndarray, frames: np.ndarray) -> dict:
    """Measure how well the edited motion keeps the recorded speed.

    Arc length per frame against that of the recording at the displayed frame: relative errors, where the recording
    moves and no transition is near. Played twice as fast, the error is 1.

    Args:
        source: the motion relative to its own path.
        edited: the motion on the new path.
        own: (S, 3) metres, the recording's pelvis.
        pelvis: (T, 3) metres, the edited motion's pelvis.
        frames: (T,) nearest source frames.
    Returns:
        `path`: of the path; `body`: of the pelvis behind the window, which shortens bends.
    """
    fps, there = edited.motion.fps, np.arange(len(frames) - 1)
    middle = 0.5 * (edited.frames[1:] + edited.frames[:-1])
    ends = np.clip((middle + [[-0.5], [0.5]]) / source.motion.fps, *source.path.domain)
    step, source_step = np.diff(edited.arc), source.arc.distance_at(ends[1]) - source.arc.distance_at(ends[0])
    free = (source_step * fps > _MOVING) & (np.diff(edited.frames) > 0) & (step > 0)
    for seam in np.asarray(edited.transitions, int):
        free &= np.abs(there - seam) > 0.75 * fps
    path = np.abs(step[free] / source_step[free] - 1.0)
    speeds = [
        np.linalg.norm(time_derivative(smooth_zero_phase_hann(p[:, :2], rate, movement.ROOT_WINDOW), rate), axis=1)
        for p, rate in ((pelvis, fps), (own, source.motion.fps))
    ]
    edited_speed, source_speed = speeds[0][:-1][free], speeds[1][frames][:-1][free]
    body = np.abs(edited_speed / np.maximum(source_speed, 1e-9) - 1.0)
    total = float(edited_speed.sum() / source_speed.sum()
                  - 1.0) if len(edited_speed) and source_speed.sum() > 0 else np.nan
    return {"path": _compute_spread(path), "body": {**_compute_spread(body), "total": total}}


def _measure_transitions(source, edited, own: np.ndarray, pelvis: np.ndarray) -> dict:
    """Measure the jerk at the transitions of a cycled motion, against that of the recording at the same speed."""
    transitions = np.asarray(edited.transitions, int)
    edited_jerk, source_jerk = (movement.compute_jerk(forward_kinematics(m)[0], m.fps)
                                for m in (edited.motion, source.motion))
    speed = movement.measure_travel_speed(own[:, :2], source.motion.fps)
    windows, at = movement.collect_uncut_windows(source_jerk, speed)
    if not len(windows) or not len(transitions):
        return {"seams": len(transitions), "max": None, "median": None}
    real = movement.compute_real_p95(windows, at)
    ratios = movement.compute_transition_ratios(edited_jerk, transitions,
                                                movement.measure_travel_speed(pelvis[:, :2], edited.motion.fps), real)
    return {"seams": len(transitions), "max": float(ratios.max()), "median": float(np.median(ratios))}


def _measure_feet(source, edited, frames: np.ndarray, ground) -> dict:
    """Measure foot slide, ground and corrections: in the recording, before planting and after, with the carried
    contacts.
    """
    points, own_points = carry_contacts(edited), source.standing
    own, edited_places = _compute_foot_places(source.motion), _compute_foot_places(edited.motion)
    used = np.unique(frames)
    skate = {**_measure_slide("", edited_places, points, edited.motion.fps),
             **_measure_slide("source_", own, own_points, source.motion.fps, used),
             **_measure_slide("before_", _compute_foot_places(edited.rigid), points, edited.motion.fps)}
    own_path = source.path.at(np.arange(len(own)) / source.motion.fps)
    flat, own_flat = points.all(axis=2), own_points.all(axis=2)
    correction = edited.correction[points.any(axis=2)]
    return {
        "skate": skate, "ground_mm": {**_measure_ground("", edited_places, flat, origin=edited.origin,
                                                        recording=source.motion, ground=ground),
                                      **_measure_ground("source_", own, own_flat, origin=own_path,
                                                        recording=source.motion, ground=None)},
        "foot_correction_m": _compute_spread(correction) if len(correction) else None,
        "ik_miss_share": float(np.mean(edited.miss.max(axis=1) > MISS_LIMIT)),
    }


def carry_contacts(edited) -> np.ndarray:
    """Compute the contacts of the edited motion, without the frames in which it restarts at the start of the path.

    Args:
        edited: the motion on the new path.
    Returns:
        (T, 2, 2) bool.
    """
    points = edited.standing.copy()
    points[1:][np.diff(edited.arc) < 0.0] = False
    return points


def _compute_foot_places(motion: Motion) -> np.ndarray:
    """Compute the places of the feet (T, 2, 2, 3) m: side, heel and toe."""
    return forward_kinematics(motion)[0][:, movement.list_foot_joints(motion.skeleton)]


def _measure_slide(name: str, places: np.ndarray, points: np.ndarray, fps: float, used: np.ndarray
                   | None = None) -> dict:
    """Measure foot slide: speeds of flat feet and of points in contact, cm/s, and the travel of toes in a stance, mm.

    Flat: heel and toe are in contact. used: frames that count, None for all.
    """
    flat = points.all(axis=2)
    speeds = movement.measure_contact_speeds(places, flat, fps)
    point = np.linalg.norm(np.diff(places[..., :2], axis=0), axis=-1) * fps
    point = np.where(points[:-1] & points[1:], point, np.nan)
    if used is not None:
        kept = used[used < len(speeds)]
        speeds, point = speeds[kept], point[kept]
    travel = movement.measure_stance_travel(places[:, :, 1], movement.list_stances(flat))
    return {f"{name}contact_cm_s": 100.0 * _compute_mean(speeds), f"{name}point_cm_s": 100.0 * _compute_mean(point),
            f"{name}stance_mm_median": 1000.0 * float(np.median(travel)) if len(travel) else np.nan,
            f"{name}stances_over_21mm": _compute_mean((travel > movement.NOTICED_SLIDE).astype(float))}


def _measure_ground(name: str, places: np.ndarray, flat: np.ndarray, origin: np.ndarray, recording: Motion,
                    ground) -> dict:
    """Measure the heights of soles above the surface, mm: the deepest of any foot, the highest and usual of feet in
    contact.

    The surface is that of `ground` under each foot; without it the path's own height where the path, origin (T, 3) m,
    is nearest. A sole's height is that of its joints less their height in the recording while the foot is flat on the
    ground.
    """
    surface = _compute_surface(places, origin, ground)
    above = places - surface[..., None] * [0.0, 0.0, 1.0]
    own_floor, toe_rest = foot_contacts.measure_floor_height(recording), foot_contacts.estimate_recorded_floor(
        recording)[1]
    ankle = foot_contacts.measure_sole_height(recording.skeleton)  # of a flat foot without toes
    rest = movement.measure_heel_rest(_compute_foot_places(recording),
                                      foot_contacts.detect_contacts(recording)) - own_floor
    heel_rest = max(rest, ankle) + toe_rest - ankle
    lower = np.minimum(above[..., 1, 2] - toe_rest, above[..., 0, 2] - heel_rest)
    standing = lower[flat & np.isfinite(lower)]
    return {f"{name}deepest": 1000.0 * float(np.nanmin(lower)) if np.isfinite(lower).any() else None,
            f"{name}standing_p95": 1000.0 * float(np.percentile(np.abs(standing), 95)) if len(standing) else None,
            f"{name}standing_max": 1000.0 * float(np.abs(standing).max()) if len(standing) else None}


def _compute_surface(places: np.ndarray, origin: np.ndarray, ground) -> np.ndarray:
    """Compute the height (T, 2, 2) m of the surface under places (T, 2, 2, 3)."""
    flat = places.reshape(-1, 3)
    if ground is not None:
        return np.asarray(ground.find_heights(flat[:, :2], flat[:, 2] + 0.5)[0]).reshape(places.shape[:-1])
    if np.ptp(origin[:, 2]) < 1e-6:
        return np.full(places.shape[:-1], origin[0, 2])
    return origin[_find_nearest_in_time(places, origin), 2]


def _find_nearest_in_time(places: np.ndarray, origin: np.ndarray, reach: int = 90) -> np.ndarray:
    """Find the index (T, 2, 2) of the nearest place of the path (T, 3) over the ground.

    Within `reach` frames only, since a path can cross itself at another height.
    """
    count = len(origin)
    best, index = np.full(places.shape[:-1], np.inf), np.zeros(places.shape[:-1], int)
    for shift in range(-reach, reach + 1):
        at = np.clip(np.arange(count) + shift, 0, count - 1)
        far = np.linalg.norm(places[..., :2] - origin[at, None, None, :2], axis=-1)
        nearer = far < best
        best, index = np.where(nearer, far, best), np.where(nearer, at[:, None, None], index)
    return index


def measure_knee_jerk(source, edited, frames: np.ndarray) -> dict:
    """Measure the third difference of the knees against that of the recording in the frames used.

    Args:
        source: the motion relative to its own path.
        edited: the motion on the new path.
        frames: (T,) nearest source frames.
    Returns:
        Ratios of the 99th percentiles and of the largest values; None where the recording's is 0.
    """
    body = identify_joints(source.motion.skeleton)
    knees = [body.left.lower_leg, body.right.lower_leg]
    edited_jerk, source_jerk = (movement.compute_jerk(forward_kinematics(m)[0][:, knees], m.fps)
                                for m in (edited.motion, source.motion))
    used = np.unique(frames)
    source_jerk = source_jerk[used[used < len(source_jerk)]]
    if not len(edited_jerk) or not len(source_jerk):
        return {"p99": None, "max": None}
    edited_pair, source_pair = (np.percentile(jerk, (99, 100)) for jerk in (edited_jerk, source_jerk))
    return {name: float(one / other) if other else None
            for name, one, other in zip(("p99", "max"), edited_pair, source_pair)}


def _compute_mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


def _compute_spread(values: np.ndarray) -> dict[str, float | None]:
    if not len(values):
        return dict.fromkeys(("mean", "p95", "max"))
    return {"mean": float(np.mean(values)), "p95": float(np.percentile(values, 95)), "max": float(np.max(values))}
