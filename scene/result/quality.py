"""A take's figures: as lines that the player stores and the panel draws, and as animated custom properties.

These properties are on the armature's data with an action of their own, so that the body's motion is unchanged and they
show in the Graph Editor whenever the armature is selected. They belong to the displayed take. Columns of the lines are
separated by tabs:

- quality: name and value ("Foot slide: 1.2 cm/s"), target, status ("met", "missed" or ""; as in `evaluation.report`),
  and of figures that count events a minute how many there are in the take
- moments: text, seconds, status
- warnings: text, seconds at which its spans start, separated by blanks ("" without a time)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import bpy
import numpy as np

from ..core import channels, session
from ..core.measure import frames_per_second, whole_frames
from ..core.settings import BeyondMocapPlayer
from . import bake

FIGURES = (  # name, key path in the report, factor (a negative one counts from 1), format, unit
    ("Distance to track", "root_error_m.mean", 100, "{:.2f}", " cm"),
    ("Distance, 95 %", "root_error_m.p95", 100, "{:.2f}", " cm"),
    ("Foot slide", "skate.contact_cm_s", 1, "{:.1f}", " cm/s"),
    ("Slide per step", "skate.stance_mm_median", 1, "{:.1f}", " mm"),
    ("Steps > 21 mm", "skate.stances_over_21mm", 100, "{:.1f}", " %"),
    ("Foot correction", "foot_correction_m.p95", 100, "{:.1f}", " cm"),
    ("Feet out of reach", "ik_miss_share", 100, "{:.1f}", " %"),
    ("Rough transitions", "seam_jerk_ratio.share_above_real", 100, "{:.0f}", " %"),
    ("Worst transition", "seam_jerk_ratio.max", 1, "{:.2f}", " x"),
    ("Worst elsewhere", "seam_jerk_ratio.rest_max", 1, "{:.2f}", " x"),
    ("Labels matched", "annotation_similarity.all", -50, "{:.1f}", " %"),  # -1 is all, +1 none
    ("Slowest playback", "warp_rate.min", 1, "{:.2f}", " x"),
    ("Fastest playback", "warp_rate.max", 1, "{:.2f}", " x"),
    ("Unusual poses", "pose_realism", 100, "{:.1f}", " %"),
    ("Repeated frames", "loop_share", 100, "{:.1f}", " %"),
    ("Lowest point", "ground_mm.min", 1, "{:.1f}", " mm"),
    ("Snap turns", "naturalness.snap_turns_per_min", 1, "{:.1f}", " /min"),
    ("Spins", "naturalness.spins_per_min", 1, "{:.1f}", " /min"),
    ("Spins not asked for", "naturalness.unasked_spins_per_min", 1, "{:.1f}", " /min"),
    ("Pelvis drops", "naturalness.pelvis_drops_per_min", 1, "{:.1f}", " /min"),
    ("Jolts", "naturalness.jolts_per_min", 1, "{:.1f}", " /min"),
    ("Cuts", "naturalness.cuts_per_min", 1, "{:.0f}", " /min"),
    ("Time between slow cuts", "naturalness.dwell_s_median", 1, "{:.1f}", " s"),
    ("Unusual body language", "naturalness.unusual_posture_share", 100, "{:.1f}", " %"),
    ("Heading off plan, 90 %", "naturalness.off_plan_deg_p90", 1, "{:.0f}", "°"),
    ("Foot lifts standing", "naturalness.standing.foot_lifts_per_min", 1, "{:.0f}", " /min"),
    ("Both feet down standing", "naturalness.standing.both_down", 100, "{:.0f}", " %"),
    ("Fall in flight, 4 to 6 m/s", "physics.flight.4-6.vertical_m_s2_median", 1, "{:.1f}", " m/s²"),
    ("Push in flight, 4 to 6 m/s", "physics.flight.4-6.level_m_s2_median", 1, "{:.1f}", " m/s²"),
    ("Lean in bends off", "physics.lean.side.lean_error_deg_median", 1, "{:.1f}", "°"),
    ("Lean at starts and stops off", "physics.lean.fore.lean_error_deg_median", 1, "{:.1f}", "°"),
    ("Knee flexion in sprints", "physics.sprint_form.knee_flexion_deg_median", 1, "{:.0f}", "°"),
    ("Boots below the ground", "physics.boots.below_share", 100, "{:.0f}", " %"),
    ("Foot speed at receptions", "touches.reception.speed_m_s_median", 1, "{:.1f}", " m/s"),
    ("Second strikes", "touches.second_strike_count", 1, "{:.0f}", ""),
    ("Kicking foot's speed", "touches.kick.ankle_speed_m_s_median", 1, "{:.1f}", " m/s"),
    ("Ball over foot speed", "touches.ball_speed.ratio_median", 1, "{:.2f}", " x"),
    ("Touches that fit the ball", "touches.fit.fit_share", 100, "{:.0f}", " %"),
    ("Reachable balls met", "touches.contact.reachable_met_share", 100, "{:.0f}", " %"),
    ("Ball inside the body", "touches.ball_inside.inside_frames", 1, "{:.0f}", " frames"),
    ("Other labels shown", "touches.substituted_count", 1, "{:.0f}", ""),
    ("Computing time", "seconds.total", 1, "{:.1f}", " s"),
)
EVENT_RATES = {f"naturalness.{name}_per_min"  # events a minute of the whole take
               for name in ("snap_turns", "spins", "unasked_spins", "pelvis_drops", "jolts", "cuts")}
ERROR_GROUP, ERROR_MARK = "Beyond Mocap", "beyond_mocap_error_curves"
CURVES = (  # name, tooltip
    ("Root Error (cm)", "Distance of root and track, both smoothed over 1.5 s; the target is 1.5 cm for 95 %"),
    ("Slide Left (cm/s)", "Speed over the ground of the left foot while it is in contact"),
    ("Slide Right (cm/s)", "Speed over the ground of the right foot while it is in contact"),
    ("Correction Left (cm)", "Distance by which foot correction moved the left foot from its place in the clip"),
    ("Correction Right (cm)", "Distance by which foot correction moved the right foot from its place in the clip"),
    ("Jerk (of real)", "Highest jerk nearby, over the 95th percentile of recordings at that speed"),
    ("Speed Gap (m/s)", "Speed of the body above that of the track"),
    ("Piece (0 or 1)", "Changes between 0 and 1 at every cut between two clips"),
)


def describe_quality(report: Mapping) -> str:
    """Describe each of FIGURES that the report has, with its target and whether that is met."""
    from ...beyond_mocap.evaluation.report import flatten_report
    from ...beyond_mocap.synthesis.quality.targets import find_target

    table, fps = flatten_report(report), float(report.get("fps") or 30.0)
    lines = []
    for name, path, factor, form, unit in FIGURES:
        value = table.get(path)
        if value is None:
            continue
        target = find_target(path, fps)
        is_met = target.is_met(value, table) if target else None
        least, most = target.bounds(table) if target else (None, None)
        limits_text = [form.format(_scale_value(limit, factor)) for limit in (least, most) if limit is not None]
        target_text = (("≥ " if (least is not None) == (factor > 0) else "≤ ") + limits_text[0]
                       if len(limits_text) == 1
                       else " .. ".join(limits_text))
        status = "" if is_met is None else ("met" if is_met else "missed")
        columns = [f"{name}: {form.format(_scale_value(value, factor))}{unit}", target_text, status]
        if path in EVENT_RATES and report.get("duration_s"):
            columns.append(f"{value * float(report['duration_s']) / 60.0:.0f}")
        lines.append("\t".join(columns))
    return "\n".join(lines)


def describe_moments(report: Mapping) -> str:
    """Describe each key moment: time, labels, what is shown instead, clip, and gap to the ball."""
    from ...beyond_mocap.synthesis.quality.targets import KEY_TARGETS, find_target

    lines = []
    for number, key in enumerate(report.get("keys", ()), 1):
        text = f"{key['time_s']:.1f} s  {' '.join(key['labels'])}"
        if key.get("solved_time_s") is not None:
            text += f", touch at {key['solved_time_s']:.2f} s"
        if key.get("used_instead"):
            text += f", replaced by {' '.join(key['used_instead'])}"
        if key.get("clip"):
            text += f"; {key['clip'].rpartition('/')[2].removesuffix('.bvh')}"
        time_error, gap = key.get("time_error_s"), key.get("met_gap_m")
        half = find_target(f"keys {number}.time_error_s", float(report.get("fps") or 30.0))
        is_missed = time_error is not None and not half.is_met(time_error, {})
        if is_missed:
            text += f", {time_error:+.2f} s"
        if gap is not None:
            text += f", gap {1000 * gap:.0f} mm"
            is_missed |= gap > KEY_TARGETS["contact_gap_m"].most
        lines.append("\t".join((text, f"{key['time_s']:.3f}", "missed" if is_missed else "met")))
    return "\n".join(lines)


def describe_warnings(report: Mapping, more: Iterable[str] = (), known: Iterable[str] = ()) -> str:
    """Describe the warnings of a report, after `more` (of the track), without those that are `known`."""
    from ...beyond_mocap.base.errors import line_spans

    seconds = dict(zip(report.get("warnings", ()), report.get("warning_seconds", ())))
    lines = []
    for text in dict.fromkeys((*more, *seconds)):
        spans = seconds.get(text) or line_spans(text)
        if text not in known:
            lines.append(f"{text}\t{' '.join(f'{first:.3f}' for first, _ in spans)}")
    return "\n".join(lines)


def has_error_curves(body: bpy.types.Object | None) -> bool:
    """Return whether an armature has error curves."""
    return body is not None and body.data is not None and any(name in body.data for name, _ in CURVES)


def write_error_curves(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> bpy.types.Action | None:
    """Write the figures of the player's take to its armature; returns None without body or take."""
    result, body = session.find_take(player.take), player.body
    if result is None or body is None:
        return None
    values = _compute_errors(scene, result)
    remove_error_curves(body)
    take, fps = result.take, frames_per_second(scene)
    start = bake.compute_frame(scene, take.start_time)
    frames = whole_frames(start, (len(take.motion) - 1) / take.motion.fps, fps)
    at = np.clip(np.rint((frames - start) * (take.motion.fps / fps)), 0, len(take.motion) - 1).astype(int)
    for (name, tooltip), row in zip(CURVES, values):
        body.data[name] = float(row[at[0]])
        body.data.id_properties_ui(name).update(description=tooltip)
    curves = {_build_data_path(name): (ERROR_GROUP, row[at][:, None]) for (name, _), row in zip(CURVES, values)}
    action = channels.create_action(body.data, f"{player.name} errors", frames, curves)
    action[ERROR_MARK] = True
    for curve in channels.collect_curves(action, body.data.animation_data.action_slot).values():
        curve.keyframe_points.foreach_set("select_control_point", np.zeros(len(frames), bool))
    return action


def remove_error_curves(body: bpy.types.Object) -> None:
    """Remove the error curves from an armature, with their action."""
    channels.remove_marked_action(body.data, ERROR_MARK)
    for name, _ in CURVES:
        if name in body.data:
            del body.data[name]


def update_error_curves(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> None:
    """Update an armature's error curves to the displayed take; without a take they are removed."""
    if has_error_curves(player.body) and (not player.take or write_error_curves(scene, player) is None):
        remove_error_curves(player.body)


def _scale_value(value: float, factor: float) -> float:
    return factor * value if factor > 0 else factor * (value - 1.0)


def _compute_errors(scene: bpy.types.Scene, result: session.StoredTake) -> np.ndarray:
    """Compute (C, T) values in the order of CURVES; 0 where unknown, since a key needs a number."""
    from ...beyond_mocap.evaluation.per_frame import measure_per_frame
    from ...beyond_mocap.evaluation.view import View
    from ...beyond_mocap.synthesis.quality.playback import playback_from_take

    take, unit = result.take, scene.beyond_mocap.library_unit or None
    library = session.find_library(result.plan.library, unit) if result.plan.library else None
    figures = measure_per_frame(View(playback_from_take(take), result.plan.track, take.timeline, library))
    piece = np.zeros(len(take.motion))
    piece[np.asarray(take.seams, int)] = 1.0
    rows = (100.0 * figures.root_error, *(100.0 * figures.slide.T), *(100.0 * figures.correction.T), figures.jerk,
            figures.speed_gap, np.cumsum(piece) % 2.0)
    return np.nan_to_num(np.array(rows))


def _build_data_path(name: str) -> str:
    return f'["{bpy.utils.escape_identifier(name)}"]'
