"""The report's group `naturalness`: what the eye sees of a take beside the same of the recordings that it uses, and the
events as lines with their seconds."""

from __future__ import annotations

import math

import numpy as np

from ..annotation import LOCOMOTION_LABELS, Timeline, labels_per_frame
from ..annotation.ball_contact import SENDING
from ..annotation.vocabulary import DIRECTIONS, SIDES
from ..appearance.arm_clearance import measure_arm_depth
from ..appearance.trunk import build_trunk
from ..base.errors import TimedMessage
from ..base.time_series import find_runs, interpolate_columns
from ..base.vectors import arctan2
from ..library.posture import NormalPostures
from ..motion import quaternion
from ..motion.retargeting.neutral import build_neutral_stance, scale_stance
from ..motion.track import sample_track
from ..synthesis.construct.gaze import estimate_look
from ..synthesis.heading_plan import plan_track
from ..synthesis.quality import movement
from ..synthesis.quality.targets import TARGETS
from ..synthesis.quality.unmet_constraints import report_jolts
from .naturalness import (
    FPS,
    find_stands,
    list_event_messages,
    measure_course_figures,
    measure_facing_off_travel,
    measure_head_off_ball,
    measure_piece_figures,
    measure_standing,
    select_unasked_spins,
)
from .titles import Title
from .view import View

JOLT_RATIO = TARGETS["seam_jerk_ratio.max"].most
STRIKE_SECONDS = 0.4  # s to either side of a strike in which it may jolt: its swing, and half a window of the jerk

ASIDE = np.radians(30.0)
"""Angle between the ball's bearing and the travel from which on the ball lies aside."""

_PLAIN_LABELS = frozenset((*LOCOMOTION_LABELS, *DIRECTIONS, *SIDES))

FRAMES_KEYS = {
    "off_travel_deg_median": "fast_frames", "off_travel_deg_p90": "fast_frames",
    "unusual_posture_share": "slow_frames", "dwell_s_median": "slow_pieces", "short_dwell_share": "slow_pieces",
    "off_travel_aside_deg_p90": "aside_frames", "off_plan_deg_median": "plan_frames",
    "off_plan_deg_p90": "plan_frames", "head_off_ball_deg_median": "ball_frames", "sd_ms": "strides",
    "foot_lifts_per_min": "seconds", "both_down": "seconds",
}  # fmt: skip
"""What a figure rests on where that is not the group's `frames`: a key beside it."""


TITLES = {
    "snap_turns_per_min": Title("Snap turns"),
    "spins_per_min": Title("Spins"),
    "unasked_spins_per_min": Title("Spins not asked for"),
    "pelvis_drops_per_min": Title("Pelvis drops"),
    "pelvis_drops_in_locomotion_per_min": Title("Pelvis drops in locomotion"),
    "jolts_per_min": Title("Jolts"),
    "cuts_per_min": Title("Cuts"),
    "dwell_s_median": Title("Time between slow cuts", "s"),
    "short_dwell_share": Title("Slow cuts within 0.5 s", "%", 100.0),
    "unusual_posture_share": Title("Unusual body language", "%", 100.0),
    "off_plan_deg_median": Title("Heading off plan", "°"),
    "off_plan_deg_p90": Title("Heading off plan, 90 %", "°"),
    "off_travel_deg_median": Title("Heading off travel", "°"),
    "off_travel_deg_p90": Title("Heading off travel, 90 %", "°"),
    "off_travel_aside_deg_p90": Title("The same, ball aside", "°"),
    "head_off_ball_deg_median": Title("Head off the ball", "°"),
    "standing.foot_lifts_per_min": Title("Foot lifts standing", "/min", digits=0),
    "standing.both_down": Title("Both feet down standing", "%", 100.0, 0),
    "tempo.sd_ms": Title("Uneven tempo", "ms"),
    "arms.inside_share": Title("Arms inside the trunk", "%", 100.0),
    "arms.depth_m_max": Title("Deepest arm in the trunk", "cm", 100.0),
}
"""Figure of the group -> how pages show it."""


def find_planned_headings(view: View) -> np.ndarray | None:
    """Find the planned heading (T,) rad at the frames of the view's course.

    It is the plan that the take was made with, where that is known, else that of the track alone; NaN beyond its ends,
    None without either.

    Args:
        view: the take beside its library and track.
    """
    times = view.played.start_time + view.course.times
    heading = view.interpolate_planned_heading(times)
    if heading is not None or view.track is None:
        return heading
    track = plan_track(sample_track(view.track, FPS))
    return np.interp(times, track.times, track.heading, left=np.nan, right=np.nan)


def measure_naturalness(view: View, planned: np.ndarray | None, asked: np.ndarray) -> dict:
    """Measure what the eye sees of a take, beside the same of the recordings that it uses.

    Args:
        view: the take beside its library and track.
        planned: (T,) rad, its planned heading, or None.
        asked: (T,) bool of `find_asked_frames`.
    Returns:
        The report's group.
    """
    course, count = view.course, len(view.course.heading)
    postures = NormalPostures({}) if view.library is None else view.library.normal_postures
    out = measure_course_figures([course], [np.ones(count, dtype=bool)], [_sample_course(view, asked)], postures)
    if view.are_clips_known:
        out.update(measure_piece_figures(course, view.transitions / view.fps))
    if planned is not None:
        out.update(_measure_plan_figures(view, planned))
    out.update(_measure_head_off_ball(view))
    if view.track is not None:
        out.update(_measure_off_travel_aside(view))
        out["standing"] = measure_standing(find_stands(view.target, view.fps), view.played.contacts, view.fps)
    if view.reference is not None:
        jolts = len(find_runs(find_jolts(view)))
        out["jolts_per_min"] = 60.0 * jolts * view.fps / view.count
        _add_source_figures(out, view, asked, postures)
    out["arms"] = _measure_arms(view)
    return {"naturalness": out}


def _measure_plan_figures(view: View, planned: np.ndarray) -> dict:
    """Measure the heading against its plan (T,) rad."""
    known = np.isfinite(planned)
    off = np.degrees(np.abs(quaternion.wrap_angle(view.course.heading[known] - planned[known])))
    if not len(off):
        return {"plan_frames": 0}
    unasked = select_unasked_spins(view.course, fill_plan(planned))
    return {"plan_frames": len(off), "off_plan_deg_median": float(np.percentile(off, 50)),
            "off_plan_deg_p90": float(np.percentile(off, 90)),
            "unasked_spins_per_min": 60.0 * FPS * len(unasked) / len(planned)}


def _measure_off_travel_aside(view: View) -> dict:
    """Measure the 90th percentile of the angle between heading and travel where the ball lies aside of the travel."""
    course, track = view.course, view.track
    ball_times, ball = track.known_ball
    if not len(ball_times):
        return {"aside_frames": 0, "off_travel_aside_deg_p90": None}
    times = view.played.start_time + course.times
    body = interpolate_columns(times, view.played.times, view.played.pelvis)
    to_ball = interpolate_columns(times, ball_times, ball) - body
    bearing = arctan2(to_ball[:, 1], to_ball[:, 0])
    off = np.degrees(measure_facing_off_travel(course)[np.abs(quaternion.wrap_angle(bearing - course.travel)) > ASIDE])
    off = off[np.isfinite(off)]
    return {"aside_frames": len(off), "off_travel_aside_deg_p90": float(np.percentile(off, 90)) if len(off) else None}


def _measure_head_off_ball(view: View) -> dict:
    """Measure the angle between head and ball; nothing without a ball, or on another skeleton than the library's."""
    played, library = view.played, view.library
    if library is None or played.ball is None or played.motion.skeleton.names != library.skeleton.names:
        return {}
    off = measure_head_off_ball(played.motion.skeleton, played.positions, played.rotations, played.ball.positions,
                                estimate_look(library))
    return {"ball_frames": len(off), "head_off_ball_deg_median": float(np.degrees(np.median(off))) if len(off)
            else None}


def fill_plan(planned: np.ndarray) -> np.ndarray:
    """Hold a plan (T,) rad, NaN beyond its ends, at its first and last heading."""
    known = np.flatnonzero(np.isfinite(planned))
    return np.interp(np.arange(len(planned)), known, planned[known])


def _add_source_figures(out: dict, view: View, asked: np.ndarray, postures: NormalPostures) -> None:
    """Add the figures of the recordings over the stretches that are used, as twins."""
    reference, used = view.reference, view.used
    known = np.isfinite(view.reference_rows)
    rows = reference.split_by_course(reference.flag_used(view.reference_rows[known & asked]))
    own = measure_course_figures(reference.courses, reference.split_by_course(used), rows, postures)
    frames = int(used.sum())
    hard = [(first, end) for first, end in find_runs(reference.jerk_ratio > JOLT_RATIO) if used[(first + end) // 2]]
    own["jolts_per_min"] = 60.0 * view.fps * len(hard) / frames if frames else math.nan
    stands = measure_standing(reference.stands & used, reference.contacts, view.fps)
    for name, value in own.pop("tempo").items():
        out["tempo"][f"source_{name}"] = value
    if (standing := out.get("standing")) is not None:
        standing.update({f"source_{name}": value for name, value in stands.items()})
    out.update({f"source_{name}": value for name, value in own.items()})


def _measure_arms(view: View) -> dict:
    """Measure how long and how deep the arms of a take are inside the drawn trunk, beside the recordings that it uses.
    """
    played, library = view.played, view.library
    stance = (build_neutral_stance(played.motion.skeleton, played.motion) if library is None
              else scale_stance(library.neutral_stance, view.scale))
    depth = measure_arm_depth(played.motion.skeleton, played.positions, played.rotations, build_trunk(stance))
    own = {} if view.reference is None else summarize_arms(view.source_values("arm_depth"))
    return {**summarize_arms(depth), **{f"source_{name}": value for name, value in own.items()}}


def summarize_arms(depth: np.ndarray) -> dict:
    """Summarize how deep arms are inside the trunk, (T,) m: the share of frames, and the largest depth in m.

    An arm is inside where the middle of elbow, forearm or hand is: half of it is hidden then.
    """
    if not len(depth):
        return {"inside_share": math.nan, "depth_m_max": math.nan}
    return {"inside_share": float(np.mean(depth > 0.0)), "depth_m_max": max(0.0, float(depth.max()))}


def find_asked_frames(view: View, requested: Timeline | None) -> np.ndarray:
    """Find the frames (T,) bool whose labels ask for other postures than those of locomotion.

    Args:
        view: the take, T frames.
        requested: the user's own timeline, or None.
    """
    asked = np.zeros(view.count, dtype=bool)
    if requested is not None:
        labels = labels_per_frame(requested, view.played.times)
        asked = np.array([bool((words or frozenset()) - _PLAIN_LABELS) for words in labels], dtype=bool)
    for moment in view.moments:
        asked[moment.entry : moment.exit + 1] = True
    return asked


def _sample_course(view: View, flags: np.ndarray) -> np.ndarray:
    """Sample flags of a take's frames (T,) at the frames of its course."""
    return flags[np.minimum(np.rint(view.course.times * view.fps).astype(int), view.count - 1)]


def find_jolts(view: View) -> np.ndarray:
    """Find the frames (T,) bool whose jerk is above 1.3 times that of recordings at that speed, strikes apart."""
    flags = np.zeros(view.count, dtype=bool)
    ratios = movement.compute_jerk_ratios(view.jerk, view.speed, view.reference.jerk_p95)
    flags[movement.TRANSITION_TO_JERK :][: len(ratios)] = ratios > JOLT_RATIO
    reach = int(round(STRIKE_SECONDS * view.fps))
    for moment in view.moments:
        if SENDING & {*moment.requested.words, *moment.words}:
            flags[max(moment.frame - reach, 0) : moment.frame + reach + 1] = False
    return flags


def list_naturalness_messages(
    view: View, planned: np.ndarray | None, asked: np.ndarray
) -> tuple[list[TimedMessage], list[TimedMessage]]:
    """List a line for each kind of event of the take: warnings, and notes about what ball, play and labels ask for.

    Args:
        view: the take beside its library and track.
        planned: (T,) rad, its planned heading, or None.
        asked: (T,) bool of `find_asked_frames`.
    """
    known = None if planned is None or not np.isfinite(planned).any() else fill_plan(planned)
    warnings, notes = list_event_messages(view.course, view.played.start_time, known, _sample_course(view, asked))
    if view.reference is None:
        return warnings, notes
    ratios = movement.compute_jerk_ratios(view.jerk, view.speed, view.reference.jerk_p95)
    flags = find_jolts(view)
    most = ratios.max(where=flags[movement.TRANSITION_TO_JERK :][: len(ratios)], initial=0.0)
    jolts = report_jolts(view.played.times, flags, most)
    return [*warnings, *([jolts] if jolts else [])], notes

