"""The report's groups of figures, each a dict, NaN or None where a value is unknown."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..annotation import Timeline
from ..motion.contacts import measure_floor_height
from ..motion.track import smooth_zero_phase_hann
from ..synthesis.quality import movement
from ..synthesis.quality.moments import (
    KeyMomentResult,
    measure_ball_gap,
    measure_ball_shift,
    measure_contact,
    measure_miss,
)
from ..synthesis.quality.playback import find_replayed, list_warp_rates
from ..synthesis.quality.unmet_constraints import report_unmet_constraints
from . import realism
from .contact_figures import find_reachable
from .view import View, measure_source_heights

SPEED_NAMES = ("0-1", "1-2", "2-3", "3-4.5", "4.5+")
"""Names of the classes of `movement.classify_speed`, m/s."""


def measure_path_errors(view: View) -> dict:
    """Measure root and pelvis error, surge and speed coverage.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    fps = view.fps
    source_sway = _finite_mean(view.source_values("sway"))
    out: dict = {"root_error_m": dict.fromkeys(("mean", "p95", "max")),
           "slow_root_error_m": dict.fromkeys(("mean", "p95", "max")),
           "pelvis_error_m": {"mean": None, "own": source_sway, "keys": None, "own_frames": len(view.used_rows)},
           "speed_coverage": {"above": None, "below": None}}  # fmt: skip
    if view.target is not None:
        error, unsmoothed = view.root_error, view.pelvis_error
        # a slow body may rest where its track creeps
        is_slow = movement.measure_travel_speed(view.target, fps) < movement.SPEED_EDGES[0]
        out["root_error_m"] = _compute_measures(error[~is_slow], ("mean", "p95", "max"))
        out["slow_root_error_m"] = _compute_measures(error[is_slow], ("mean", "p95", "max"))
        at_keys = [float(np.interp(m.requested.resolved_time, view.played.times, unsmoothed)) for m in view.moments]
        out["pelvis_error_m"].update(mean=_finite_mean(unsmoothed), keys=_finite_mean(np.array(at_keys)))
    if view.target is not None and view.reference is not None:
        requested_speed = movement.measure_travel_speed(view.target, fps)
        out["speed_coverage"] = movement.measure_speed_coverage(requested_speed, view.reference.fastest,
                                                                view.reference.slowest)
    return {**out, **_measure_surge(view)}


def _measure_surge(view: View) -> dict:
    """Measure surge against the rms of the used recordings at the same speed.

    Only frames of speeds at which recordings are used count: the surge of a walk says nothing about that of a sprint.
    The key `track` is the surge of the track itself, smoothed with the window within which the root must follow it.
    """
    surge_values = movement.measure_surge(view.played.pelvis, view.fps)
    source, classes = view.source_values("surge"), movement.classify_speed(view.source_values("speed"))
    own = movement.compute_class_rms(source, classes)[movement.classify_speed(view.speed)]
    known = np.isfinite(own)
    source_rms = _finite_rms(own)
    smooth = None if view.target is None else smooth_zero_phase_hann(view.target, view.fps, movement.ROOT_WINDOW)
    track_rms = None if smooth is None else _finite_rms(movement.measure_surge(smooth, view.fps))
    surge = {"mean": _finite_rms(surge_values), "own": source_rms, "track": track_rms,
             "compared_frames": int(known.sum()), "own_frames": len(source)}  # fmt: skip
    ratio = _finite_rms(surge_values[known]) / source_rms if source_rms else math.nan
    return {"pelvis_surge_ratio": ratio, "pelvis_surge_m_s": surge}


def measure_key_moments(view: View) -> list[dict]:
    """Measure each key moment.

    Args:
        view: the take beside its library and track.
    Returns:
        One group for each key moment.
    """
    return [_measure_key_moment(view, moment) for moment in view.moments]


def _measure_key_moment(view: View, moment: KeyMomentResult) -> dict:
    """Measure one key moment: times, errors of position, contact gap, and the clip used."""
    played, time = view.played, moment.requested.resolved_time
    errors: dict[str, float | None] = {"position_error_m": None, "pelvis_error_m": None, "ball_shift_m": None}
    contact_time, contact_gap = measure_contact(played, moment)
    if view.target is not None:
        frame = int(round((contact_time - played.start_time) * view.fps)) if np.isfinite(contact_time) else moment.frame
        errors["position_error_m"] = float(np.interp(time, played.times, view.root_error))
        errors["pelvis_error_m"] = float(np.interp(time, played.times, view.pelvis_error))
        errors["ball_shift_m"] = measure_ball_shift(played, frame, view.track)
    return {
        "time_s": moment.requested.time, "solved_time_s": moment.requested.solved,
        "labels": list(moment.requested.words), "clip": moment.clip, "clip_frame": moment.clip_frame,
        "time_error_s": moment.played_at - time, **errors, "contact_gap_m": measure_ball_gap(played, moment),
        "met_s": contact_time, "met_gap_m": contact_gap, "missed_by_m": measure_miss(played, moment),
        "reachable": find_reachable(view, moment),
        "used_instead": None if moment.used_instead is None else list(moment.used_instead),
    }


def measure_feet(view: View) -> dict:
    """Measure foot slide in all its forms, and the feet's height above the ground.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    played, fps = view.played, view.fps
    planted = played.feet
    travel = movement.measure_stance_travel(planted[:, :, 1], movement.list_stances(played.contacts))
    source_travel = np.zeros(0) if view.reference is None else view.reference.select_used_travel(view.used)
    skating = movement.find_skating_steps(planted[:, :, 1], measure_floor_height(played.motion, played.positions), fps)
    known = view.reference is not None
    heel_rest = view.reference.heel_rest if known else movement.measure_heel_rest(planted, played.contacts)
    support = movement.measure_support_height(planted, played.contacts, heel_rest)
    return {
        "skate": {"contact_cm_s": 100.0 * _finite_mean(movement.measure_contact_speeds(planted, played.contacts, fps)),
                  "source_contact_cm_s": 100.0 * _finite_mean(view.source_values("contact_speed")),
                  "stance_mm_median": 1000.0 * _finite_median(travel),
                  "stances_over_21mm": _finite_mean(travel > movement.NOTICED_SLIDE),
                  "gmd_ratio": _finite_mean(skating), "source_gmd_ratio": _finite_mean(view.source_values("skating")),
                  "source_stance_mm_median": 1000.0 * _finite_median(source_travel),
                  "source_stances_over_21mm": _finite_mean(source_travel > movement.NOTICED_SLIDE),
                  "source_frames": len(view.used_rows), "source_stances": len(source_travel),},
        "ground_mm": {"min": 1000.0 * float(played.positions[..., 2].min()), "support_max": 1000.0
                      * _finite_max(support), "source_support_max": 1000.0 * _finite_max(view.source_values("support")),
                      "tip_min": -1000.0 * _finite_max(-movement.measure_tip_height(played.motion.skeleton,
                                                                                    played.positions,
                                                                                    played.rotations)),
                      "source_tip_min": -1000.0 * _finite_max(-view.source_values("tip")),
                      "source_frames": len(view.used_rows),},
    }


def measure_corrections(view: View, ik_miss: np.ndarray | None) -> dict:
    """Measure what foot correction changed: foot correction, missed targets, pelvis drop, bone lengths.

    Args:
        view: the take beside its library and track.
        ik_miss: (T,) or (T, 2) m by which inverse kinematics missed its targets, or None.
    Returns:
        The report's groups.
    """
    played = view.played
    shift = None if played.correction is None else np.asarray(played.correction)[played.contacts]
    missed = None if ik_miss is None else np.asarray(ik_miss).reshape(view.count, -1).max(axis=1) > 0.005
    bones = None if view.library is None else _measure_bone_change(view)
    return {
        "foot_correction_m": {"p95": None} if shift is None else _compute_measures(shift, ("p95",)),
        "ik_miss_share": None if missed is None else _finite_mean(missed),
        "pelvis_drop_m": _measure_pelvis_drop(view), "bone_change_m": bones,
    }


def _measure_pelvis_drop(view: View) -> float:
    """Measure the largest drop of the pelvis below the source poses, m, away from transitions, which are blended."""
    if view.library is None or not len(view.used_rows):
        return math.nan
    played = view.played
    own = played.positions[:, played.body.hips, 2].astype(np.float32)
    source = measure_source_heights(view.library, played.clips, played.clip, played.mirrored, played.clip_frame)
    is_unblended = np.isfinite(source)
    for seam in view.transitions:
        is_unblended[max(seam - movement.JERK_REACH, 0) : seam + movement.JERK_REACH] = False
    drop = (source - own)[is_unblended]
    return float(max(drop.max(), 0.0)) if len(drop) else math.nan


def _measure_bone_change(view: View) -> float:
    """Measure the largest difference of a bone's length in any frame from the library's skeleton, m."""
    skeleton, positions = view.library.skeleton, view.played.positions
    bones = np.linalg.norm(positions[:, 1:] - positions[:, list(skeleton.parents[1:])], axis=-1)
    return float(np.max(np.abs(bones - view.scale * np.linalg.norm(skeleton.offsets[1:], axis=-1)), initial=0.0))


def measure_transitions(view: View) -> dict:
    """Measure transitions, the other frames, playback rate and loops.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    out: dict = {"seam_jerk_ratio": dict.fromkeys(("median", "p95", "max", "share_above_real"))}
    if view.reference is not None:
        own, real = view.source_values("jerk_ratio"), view.reference.jerk_p95
        own = own[np.isfinite(own)]
        at_seams = movement.compute_transition_ratios(view.jerk, view.transitions, view.speed, real)
        rest = movement.compute_rest_ratios(view.jerk, view.transitions, view.speed, real)
        everywhere = movement.compute_jerk_ratios(view.jerk, view.speed, real)
        beside = {"source_share_above_real": _finite_mean(own > 1.0), "source_frames": len(own)}
        out["seam_jerk_ratio"] = {
            **_compute_measures(at_seams, ("median", "p95", "max")), "share_above_real": _finite_mean(at_seams > 1.0),
            "rest_max": _finite_max(rest), "rest_share_above_real": _finite_mean(rest > 1.0), **beside,
        }
        out["jerk_ratio"] = {**_compute_measures(everywhere, ("median", "p95", "max")),
                             "share_above_real": _finite_mean(everywhere > 1.0), "frames": len(everywhere),
                             "other_speed_frames": _count_other_speeds(view, len(everywhere)), **beside}
    known = view.are_clips_known
    rates = list_warp_rates(*view.source)
    return {
        **out, "seams": len(view.transitions) if known else None,
        "warp_rate": {"min": -_finite_max(-rates), "max": _finite_max(rates)},
        "loop_share": _finite_mean(find_replayed(*view.source, view.fps)) if known else None,
    }


def _count_other_speeds(view: View, count: int) -> int:
    """Count the frames of the jerk at speeds that no recording has; they are compared with the nearest speed."""
    pace = view.speed[movement.TRANSITION_TO_JERK :][:count]
    return int(np.sum(~view.reference.jerk_recorded[movement.classify_speed(pace)]))


def measure_poses(view: View) -> dict:
    """Measure pose realism and smoothness.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    played = view.played
    curve = realism.measure_smoothness(played.motion.skeleton, played.positions, view.fps)
    source_smoothness = _compute_measures(view.source_values("smoothness"), ("mean", "p95", "max"))
    smoothness = {**_compute_measures(curve, ("mean", "p95", "max")),
                  **{f"source_{name}": value for name, value in source_smoothness.items()}}
    smoothness["source_frames"] = len(view.used_rows)
    out = {"pose_realism": None, "smoothness_m": smoothness}
    return out if view.reference is None else {**out, **_measure_pose_realism(view)}


def _measure_pose_realism(view: View) -> dict:
    """Measure pose realism, over all frames of speeds that enough recordings have, and by speed class."""
    reference, classes = view.reference, movement.classify_speed(view.speed)
    if not np.isfinite(reference.pose_p95).any():
        unreal = np.full(view.count, np.nan)
    else:
        limit = np.nan_to_num(reference.pose_p95[classes], nan=np.inf)
        distance = realism.bound_pose_distance(view.played.motion, view.played.positions, reference.poses, limit,
                                               view.scale)
        unreal = realism.find_unreal_frames(distance, view.speed, reference.pose_p95)
    by_speed = {
        name: {"share": _finite_mean(unreal[classes == k]), "frames": int(np.sum(classes == k)),
               "recordings": int(reference.pose_recordings[k])} for k, name in enumerate(SPEED_NAMES)
    }  # fmt: skip
    return {"pose_realism": _finite_mean(unreal), "pose_realism_frames": int(np.isfinite(unreal).sum()),
            "pose_realism_by_speed": by_speed}


def list_warnings(view: View, ik_miss: np.ndarray | None, requested: Timeline | None) -> list[str]:
    """List what was relaxed in the take and when.

    Args:
        view: the take beside its library and track.
        ik_miss: (T,) or (T, 2) m by which inverse kinematics missed its targets, or None.
        requested: the user's own timeline without automatic spans, or None.
    Returns:
        One line for each warning.
    """
    return [*report_unmet_constraints(view.played, track=view.track, timeline=view.timeline, library=view.library,
                                      ik_miss=ik_miss, user_timeline=requested)]


def _select_finite(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    return values[np.isfinite(values)]


def _finite_mean(values: np.ndarray) -> float:
    known = _select_finite(values)
    return float(known.mean()) if len(known) else math.nan


def _finite_median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) else math.nan


def _finite_max(values: np.ndarray) -> float:
    known = _select_finite(values)
    return float(known.max()) if len(known) else math.nan


def _finite_rms(values: np.ndarray) -> float:
    return math.sqrt(_finite_mean(np.square(values)))


def _compute_measures(values: np.ndarray, names: Sequence[str]) -> dict[str, float]:
    """Compute the measures `names` of values (N,): mean, median, p95 or max; NaN without values."""
    known = values[np.isfinite(values)]
    measures = {"mean": np.mean, "median": np.median, "p95": lambda v: np.percentile(v, 95), "max": np.max}
    return {name: float(measures[name](known)) if len(known) else math.nan for name in names}
