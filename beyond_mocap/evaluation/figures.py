"""The report's groups of figures, each a dict, NaN or None where a value is unknown.

How well the motion matches the requested labels is Faustino's annotation similarity (§3.2.2 eq. 18), as printed and
over the requested labels only. Labels are sets per frame; sides are those after mirroring. Frames without requested
labels (a transition, or unknown) are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from ..annotation import Timeline, automatic_gaits, fill, words_per_frame
from ..base.errors import InputError
from ..library.automatic import automatic_words
from ..library.keys import serving
from ..motion.contacts import floor_height
from ..motion.track import sample, zero_phase_hann
from ..synthesis.quality import movement
from ..synthesis.quality.give_way import give_way, jolts
from ..synthesis.quality.moments import Moment, ball_gap, ball_shift, met, with_made
from ..synthesis.quality.played import find_replayed, warp_rates
from . import realism
from .reference import View, source_poses


def place(view: View) -> dict:
    """Measure root and pelvis error, surge and speed coverage.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    pelvis, fps = view.played.pelvis, view.fps
    own = _mean(view.own("sway"))
    out = {"root_error_m": dict.fromkeys(("mean", "p95", "max")),
           "pelvis_error_m": {"mean": None, "own": own, "keys": None},
           "speed_coverage": {"above": None, "below": None}}  # fmt: skip
    if view.wanted is not None:
        error, unsmoothed = movement.root_error(pelvis, view.wanted, fps), movement.pelvis_error(pelvis, view.wanted)
        out["root_error_m"] = _spread(error, ("mean", "p95", "max"))
        at_keys = [float(np.interp(m.asked.in_force, view.played.times, unsmoothed)) for m in view.moments]
        out["pelvis_error_m"] = {"mean": _mean(unsmoothed), "own": own, "keys": _mean(np.array(at_keys))}
    if view.wanted is not None and view.reference is not None:
        asked = movement.travel_speed(view.wanted, fps)
        out["speed_coverage"] = movement.speed_coverage(asked, view.reference.fastest, view.reference.slowest)
    return {**out, **_surge(view)}


def _surge(view: View) -> dict:
    """Measure surge against the rms of the used recordings at the same speed.

    The key `track` is the surge of the track itself, smoothed with the window within which the root must follow it.
    """
    ours = movement.surge(view.played.pelvis, view.fps)
    own = movement.class_rms(view.own("surge"), movement.speed_class(view.own("speed")))
    rms, real = _rms(ours), _rms(own[movement.speed_class(view.speed)])
    smooth = None if view.wanted is None else zero_phase_hann(view.wanted, view.fps, movement.ROOT_WINDOW)
    asked = None if smooth is None else _rms(movement.surge(smooth, view.fps))
    surge = {"mean": rms, "own": real, "track": asked}
    return {"pelvis_surge_ratio": rms / real if real else math.nan, "pelvis_surge_m_s": surge}


def keys(view: View) -> list[dict]:
    """Measure each key moment.

    Args:
        view: the take beside its library and track.
    Returns:
        One group for each key moment.
    """
    return [_key(view, moment) for moment in view.moments]


def _key(view: View, moment: Moment) -> dict:
    """Measure one key moment: times, errors of position, contact gap, and the clip used."""
    played, time = view.played, moment.asked.in_force
    place: dict[str, float | None] = {"position_error_m": None, "pelvis_error_m": None, "ball_shift_m": None}
    met_at, met_gap = met(played, moment)
    if view.wanted is not None:
        error = movement.root_error(played.pelvis, view.wanted, view.fps)
        frame = int(round((met_at - played.start_time) * view.fps)) if np.isfinite(met_at) else moment.frame
        place["position_error_m"] = float(np.interp(time, played.times, error))
        unsmoothed = movement.pelvis_error(played.pelvis, view.wanted)
        place["pelvis_error_m"] = float(np.interp(time, played.times, unsmoothed))
        place["ball_shift_m"] = ball_shift(played, frame, view.track)
    return {
        "time_s": moment.asked.time, "solved_time_s": moment.asked.solved, "labels": list(moment.asked.words),
        "clip": moment.clip, "clip_frame": moment.clip_frame, "time_error_s": moment.played_at - time, **place,
        "contact_gap_m": ball_gap(played, moment), "met_s": met_at, "met_gap_m": met_gap,
        "used_instead": None if moment.used_instead is None else list(moment.used_instead),
    }


def skate_and_ground(view: View) -> dict:
    """Measure foot slide in all its forms, and the feet's height above the ground.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    played, fps = view.played, view.fps
    planted = played.feet
    travel = movement.stance_travel(planted[:, :, 1], movement.stances(played.contacts))
    own = np.zeros(0) if view.reference is None else view.reference.used_stances(view.used)
    skating = movement.skating_steps(planted[:, :, 1], floor_height(played.motion), fps)
    known = view.reference is not None
    heel_rest = view.reference.heel_rest if known else movement.heel_rest_height(planted, played.contacts)
    support = movement.support_height(planted, played.contacts, heel_rest)
    return {
        "skate": {
            "contact_cm_s": 100.0 * _mean(movement.contact_speeds(planted, played.contacts, fps)),
            "source_contact_cm_s": 100.0 * _mean(view.own("contact_speed")),
            "stance_mm_median": 1000.0 * _median(travel), "stances_over_21mm": _mean(travel > movement.NOTICED_SLIDE),
            "gmd_ratio": _mean(skating), "source_gmd_ratio": _mean(view.own("skating")),
            "source_stance_mm_median": 1000.0 * _median(own),
            "source_stances_over_21mm": _mean(own > movement.NOTICED_SLIDE),
        },
        "ground_mm": {
            "min": 1000.0 * float(played.positions[..., 2].min()), "support_max": 1000.0 * _max(support),
            "source_support_max": 1000.0 * _max(view.own("support")),
            "tip_min": -1000.0 * _max(-movement.tip_height(played.motion.skeleton, played.positions, played.rotations)),
            "source_tip_min": -1000.0 * _max(-view.own("tip")),
        },
    }


def polish(view: View, ik_miss: np.ndarray | None) -> dict:
    """Measure what polishing changed: foot correction, missed targets, pelvis drop, bone lengths.

    Args:
        view: the take beside its library and track.
        ik_miss: (T,) or (T, 2) m by which inverse kinematics missed its targets, or None.
    Returns:
        The report's groups.
    """
    played = view.played
    shift, drop = _against_source(view)
    if played.correction is not None:
        shift = np.asarray(played.correction)[played.contacts]
    missed = None if ik_miss is None else np.asarray(ik_miss).reshape(view.count, -1).max(axis=1) > 0.005
    bones = None if view.library is None else _bone_change(view)
    return {
        "foot_correction_m": _spread(shift, ("p95",)), "ik_miss_share": None if missed is None else _mean(missed),
        "pelvis_drop_m": drop, "bone_change_m": bones,
    }


def _against_source(view: View) -> tuple[np.ndarray, float]:
    """Compare planted feet and pelvis with the source poses, away from transitions, where two clips are blended.

    Returns the distance (N,) m of planted feet from the source pose placed at the output's pelvis and heading, and the
    largest drop of the pelvis below the source's, m.
    """
    if view.library is None or not len(view.used):
        return np.zeros(0), math.nan
    played, hips = view.played, view.played.body.hips
    joints = movement.foot_joints(played.motion.skeleton)
    local = realism.local_positions(played.motion.skeleton, played.positions, hips)
    source = source_poses(view.library, played.clips, played.clip, played.mirrored, played.clip_frame)
    pure = np.isfinite(source[:, 0, 0])
    for seam in view.seams:
        pure[max(seam - movement.JERK_REACH, 0) : seam + movement.JERK_REACH] = False
    shift = movement.planted_shift(local[:, joints], source[:, joints], played.contacts & pure[:, None])
    drop = (source[:, hips, 2] - local[:, hips, 2])[pure]
    return shift, float(max(drop.max(), 0.0)) if len(drop) else math.nan


def _bone_change(view: View) -> float:
    """Measure the largest difference of a bone's length in any frame from the library's skeleton, m."""
    skeleton, positions = view.library.skeleton, view.played.positions
    bones = np.linalg.norm(positions[:, 1:] - positions[:, list(skeleton.parents[1:])], axis=-1)
    return float(np.max(np.abs(bones - view.size * np.linalg.norm(skeleton.offsets[1:], axis=-1)), initial=0.0))


def seams_and_loops(view: View) -> dict:
    """Measure transitions, the other frames, playback rate and loops.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    out = {"seam_jerk_ratio": dict.fromkeys(("median", "p95", "max", "share_above_real"))}
    if view.reference is not None:
        values = movement.jerk(view.played.positions, view.fps)
        at_seams = movement.seam_ratios(values, view.seams, view.speed, view.reference.jerk_p95)
        rest = movement.rest_ratios(values, view.seams, view.speed, view.reference.jerk_p95)
        out["seam_jerk_ratio"] = {
            **_spread(at_seams, ("median", "p95", "max")), "share_above_real": _mean(at_seams > 1.0),
            "source_share_above_real": _mean(view.own("jerk_above_real")), "rest_max": _max(rest),
            "rest_share_above_real": _mean(rest > 1.0),
        }
    known = bool(np.any(view.played.clip >= 0))
    rates = warp_rates(*view.source)
    return {
        **out, "seams": len(view.seams) if known else None, "warp_rate": {"min": -_max(-rates), "max": _max(rates)},
        "loop_share": _mean(find_replayed(*view.source, view.fps)) if known else None,
    }


def poses(view: View) -> dict:
    """Measure pose realism and smoothness.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's groups.
    """
    played = view.played
    features = realism.pose_features(played.motion.skeleton, played.positions, view.fps, played.body.hips)
    curve = realism.smoothness(played.motion.skeleton, played.positions, view.fps)
    own = _spread(view.own("smoothness"), ("mean", "p95", "max"))
    smoothness = {**_spread(curve, ("mean", "p95", "max")), **{f"source_{name}": value for name, value in own.items()}}
    out: dict = {"pose_realism": None, "smoothness_m": smoothness}
    if view.reference is not None and np.isfinite(view.reference.pose_p95).all():
        distance = realism.nearest_distance(features / view.size, view.reference.poses)
        out["pose_realism"] = _mean(realism.unreal(distance, view.speed, view.reference.pose_p95))
    return out


def asked_words(
    timeline: Timeline, times: np.ndarray, moments: Sequence[Moment] = ()
) -> list[frozenset[str] | None]:
    """List the requested labels at each time.

    Args:
        timeline: the timeline.
        times: (T,) seconds on the track's clock.
        moments: the key moments with the first and last frame of their clips.
    Returns:
        For each time the labels, None where none count: in transitions, at the entry and exit of each key moment's clip
        (Faustino §3.2.2), and where automatic locomotion is not filled in.
    """
    out = [found or None for found in words_per_frame(timeline, times)]
    for moment in moments:
        out[moment.entry : moment.exit + 1] = [None] * (moment.exit + 1 - moment.entry)
    return out


def filled_timeline(view: View) -> Timeline:
    """Fill automatic locomotion into the timeline by the library's gaits (Faustino §3.1.1).

    Synthetic clips count as the library's if one is played.

    Args:
        view: the take beside its library and track.
    Returns:
        The filled timeline; the same one without library or track.
    """
    library = with_made(view.library, view.played)
    if library is None or view.track is None:
        return view.timeline
    try:
        gaits = library.gaits
    except InputError:
        return view.timeline
    sampled = sample(view.track, library.fps)
    thresholds = library.gait_thresholds
    chosen = automatic_gaits(sampled.speed, sampled.fps, [gait.speed for gait in gaits], thresholds)
    return fill(view.timeline, sampled.times, automatic_words(library, chosen, sampled))


def annotation_similarity(view: View) -> dict:
    """Measure how well the played labels match the requested ones.

    Args:
        view: the take beside its library and track.
    Returns:
        Means over all frames, over the key moments, and over those that the library has, for requested labels only; the
        first two also as Faustino's eq. 18 is printed.
    """
    played = view.played
    if view.timeline is None or played.words is None:
        return dict.fromkeys(("all", "keys", "had_keys", "eq18_all", "eq18_keys"))
    asked = asked_words(filled_timeline(view), played.times, view.moments)
    want, have = [m.asked.words for m in view.moments], [m.words for m in view.moments]
    offered = [] if view.library is None else view.library.keys
    had = [m for m in view.moments if serving(offered, m.asked.words)]
    return {  # means over the frames that count, as in Faustino Table 2
        "all": _mean(similarity(asked, played.words)), "keys": _mean(similarity(want, have)),
        "had_keys": _mean(similarity([m.asked.words for m in had], [m.words for m in had])),
        "eq18_all": _mean(similarity(asked, played.words, eq18)), "eq18_keys": _mean(similarity(want, have, eq18)),
    }


def warnings(view: View, ik_miss: np.ndarray | None, asked: Timeline | None) -> list[str]:
    """List what was relaxed in the take and when, and visible jolts.

    Args:
        view: the take beside its library and track.
        ik_miss: (T,) or (T, 2) m by which inverse kinematics missed its targets, or None.
        requested: the user's own timeline without automatic spans, or None.
    Returns:
        One line for each warning.
    """
    lines: list[str] = [*give_way(view.played, track=view.track, timeline=view.timeline, library=view.library,
                                  ik_miss=ik_miss, asked=asked)]
    if view.reference is None:
        return lines
    hard = movement.jerk(view.played.positions, view.fps)
    ratios = movement.seam_ratios(hard, view.seams, view.speed, view.reference.jerk_p95)
    told = jolts(view.played.times, view.seams, ratios)
    return [*lines, told] if told else lines


def eq18(asked: Iterable[str], played: Iterable[str]) -> float:
    """Compute Faustino's eq. 18 for one frame as printed.

    With 1 for a present and -1 for an absent label, it is the negated sum of products over the labels that either frame
    has, divided by their number: a common label counts -1, a label that only one has counts +1.

    Args:
        requested: the requested labels.
        played: the labels of the played clip.
    Returns:
        -1 if all labels agree to 1 if none does; NaN if neither has a label.
    Source: Faustino 2024, section 3.2.2, equation (18).
    """
    asked, played = set(asked), set(played)
    either = asked | played
    return (len(asked ^ played) - len(asked & played)) / len(either) if either else np.nan


def asked_similarity(asked: Iterable[str], played: Iterable[str]) -> float:
    """Compute eq. 18 over the requested labels only; further labels do not count.

    Args:
        requested: the requested labels.
        played: the labels of the played clip.
    Returns:
        -1 if all are played to 1 if none is; NaN without requested labels.
    """
    asked = set(asked)
    return 1.0 - 2.0 * len(asked & set(played)) / len(asked) if asked else np.nan


def similarity(
    asked: Sequence[Iterable[str] | None], played: Sequence[Iterable[str]], measure=asked_similarity
) -> np.ndarray:
    """Measure the similarity at every frame.

    Takes repeat labels, so each pair is measured once.

    Args:
        requested: T sets of labels, None where none count.
        played: T sets of labels.
        measure: the similarity of one pair.
    Returns:
        (T,), NaN where no labels are requested.
    """
    known: dict[tuple, float] = {}
    out = np.full(len(played), np.nan)
    for frame, (want, have) in enumerate(zip(asked, played)):
        if want is None:
            continue
        pair = (tuple(want), tuple(have))
        if pair not in known:
            known[pair] = measure(*pair)
        out[frame] = known[pair]
    return out


def _known(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    return values[np.isfinite(values)]


def _mean(values: np.ndarray) -> float:
    known = _known(values)
    return float(known.mean()) if len(known) else math.nan


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) else math.nan


def _max(values: np.ndarray) -> float:
    known = _known(values)
    return float(known.max()) if len(known) else math.nan


def _rms(values: np.ndarray) -> float:
    return math.sqrt(_mean(np.square(values)))


def _spread(values: np.ndarray, names: Sequence[str]) -> dict[str, float]:
    """Compute the measures `names` of values (N,): mean, median, p95 or max; NaN without values."""
    known = values[np.isfinite(values)]
    measures = {"mean": np.mean, "median": np.median, "p95": lambda v: np.percentile(v, 95), "max": np.max}
    return {name: float(measures[name](known)) if len(known) else math.nan for name in names}
