"""A take's figures: as lines that a player's settings keep and the panel draws, columns with a tab between, and as
animated custom properties of its armature, to be seen in the Graph Editor.

These lie on the armature's data with an action of their own, so that the body's motion stays what it is and they are
shown whenever the armature is selected. They belong to the take that is shown.

- quality: name and value ("Feet slide: 1.2 cm/s"), target, status ("met", "missed" or ""; as `evaluation.report`
  has it)
- moments: text, seconds, status
- warnings: text, seconds at which its stretches begin, with blanks between ("" where it is about no time)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import bpy
import numpy as np

from ..core import channels, session
from ..core.measure import frames_per_second, whole_frames
from ..core.settings import BeyondMocapPlayer
from . import bake

FIGURES = (  # name, path in the report, factor (a negative one counts from 1), form, unit
    ("Off track", "root_error_m.mean", 100, "{:.2f}", " cm"),
    ("Off track, 95 %", "root_error_m.p95", 100, "{:.2f}", " cm"),
    ("Feet slide", "skate.contact_cm_s", 1, "{:.1f}", " cm/s"),
    ("Slide a step", "skate.stance_mm_median", 1, "{:.1f}", " mm"),
    ("Steps over 21 mm", "skate.stances_over_21mm", 100, "{:.1f}", " %"),
    ("Feet moved", "foot_correction_m.p95", 100, "{:.1f}", " cm"),
    ("Legs short", "ik_miss_share", 100, "{:.1f}", " %"),
    ("Hard cuts", "seam_jerk_ratio.share_above_real", 100, "{:.0f}", " %"),
    ("Hardest cut", "seam_jerk_ratio.max", 1, "{:.2f}", " x"),
    ("Hardest between", "seam_jerk_ratio.rest_max", 1, "{:.2f}", " x"),
    ("Words met", "annotation_similarity.all", -50, "{:.1f}", " %"),  # -1 is all, +1 none
    ("Slowest clip", "warp_rate.min", 1, "{:.2f}", " x"),
    ("Fastest clip", "warp_rate.max", 1, "{:.2f}", " x"),
    ("Odd poses", "pose_realism", 100, "{:.1f}", " %"),
    ("Replayed", "loop_share", 100, "{:.1f}", " %"),
    ("Lowest point", "ground_mm.min", 1, "{:.1f}", " mm"),
    ("Time to make", "seconds.total", 1, "{:.1f}", " s"),
)
ERROR_GROUP, ERROR_MARK = "Beyond Mocap", "beyond_mocap_error_curves"
CURVES = (  # name, what it says
    ("Root Error (cm)", "Distance of root and track, both behind 1.5 s; the target is 1.5 cm for 95 %"),
    ("Slide Left (cm/s)", "Speed over the ground of the left foot while it stands"),
    ("Slide Right (cm/s)", "Speed over the ground of the right foot while it stands"),
    ("Correction Left (cm)", "How far polish moved the left foot from where the clips had it"),
    ("Correction Right (cm)", "How far polish moved the right foot from where the clips had it"),
    ("Jerk (of real)", "Hardest jerk around, over the 95th percentile of recordings at that speed"),
    ("Speed Gap (m/s)", "By how much the body is faster than the track asks"),
    ("Piece (0 or 1)", "Changes between 0 and 1 at every cut between two clips"),
)


def quality_lines(report: Mapping) -> str:
    """A line for each of FIGURES that the report has, with its target and whether that is met."""
    from ...beyond_mocap.evaluation.report import flat
    from ...beyond_mocap.synthesis.quality.targets import target_of

    table, fps = flat(report), float(report.get("fps") or 30.0)
    lines = []
    for name, path, factor, form, unit in FIGURES:
        value = table.get(path)
        if value is None:
            continue
        target = target_of(path, fps)
        met = target.met(value, table) if target else None
        least, most = target.bounds(table) if target else (None, None)
        shown = [form.format(_shown(limit, factor)) for limit in (least, most) if limit is not None]
        aim = (("≥ " if (least is not None) == (factor > 0) else "≤ ") + shown[0]
               if len(shown) == 1
               else " .. ".join(shown))
        status = "" if met is None else ("met" if met else "missed")
        lines.append("\t".join((f"{name}: {form.format(_shown(value, factor))}{unit}", aim, status)))
    return "\n".join(lines)


def moment_lines(report: Mapping) -> str:
    """A line for each key moment: its time, what was asked for, what is shown where that is something else, the clip,
    and the gap to the ball."""
    from ...beyond_mocap.synthesis.quality.targets import KEY_TARGETS, target_of

    lines = []
    for number, key in enumerate(report.get("keys", ()), 1):
        text = f"{key['time_s']:.1f} s  {' '.join(key['labels'])}"
        if key.get("solved_time_s") is not None:
            text += f", touched at {key['solved_time_s']:.2f} s"
        if key.get("used_instead"):
            text += f", shown as {' '.join(key['used_instead'])}"
        if key.get("clip"):
            text += f"; {key['clip'].rpartition('/')[2].removesuffix('.bvh')}"
        late, gap = key.get("time_error_s"), key.get("met_gap_m")
        half = target_of(f"keys {number}.time_error_s", float(report.get("fps") or 30.0))
        missed = late is not None and not half.met(late, {})
        if missed:
            text += f", {late:+.2f} s"
        if gap is not None:
            text += f", gap {1000 * gap:.0f} mm"
            missed |= gap > KEY_TARGETS["contact_gap_m"].most
        lines.append("\t".join((text, f"{key['time_s']:.3f}", "missed" if missed else "met")))
    return "\n".join(lines)


def warning_lines(report: Mapping, more: Iterable[str] = (), known: Iterable[str] = ()) -> str:
    """A line for each warning of a report, and before them `more` (of the track), but for those that are `known`."""
    from ...beyond_mocap.base.errors import spans_of

    seconds = dict(zip(report.get("warnings", ()), report.get("warning_seconds", ())))
    lines = []
    for text in dict.fromkeys((*more, *seconds)):
        spans = seconds.get(text) or spans_of(text)
        if text not in known:
            lines.append(f"{text}\t{' '.join(f'{first:.3f}' for first, _ in spans)}")
    return "\n".join(lines)


def has_error_curves(body: bpy.types.Object | None) -> bool:
    """Whether an armature has them."""
    return body is not None and body.data is not None and any(name in body.data for name, _ in CURVES)


def write_error_curves(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> bpy.types.Action | None:
    """Put the figures of the player's take onto its armature; None where there is no body or take."""
    made, body = session.made(player.take), player.body
    if made is None or body is None:
        return None
    values = _error_values(scene, made)
    remove_error_curves(body)
    take, fps = made.take, frames_per_second(scene)
    start = bake.frame_at(scene, take.start_time)
    frames = whole_frames(start, (len(take.motion) - 1) / take.motion.fps, fps)
    at = np.clip(np.rint((frames - start) * (take.motion.fps / fps)), 0, len(take.motion) - 1).astype(int)
    for (name, told), row in zip(CURVES, values):
        body.data[name] = float(row[at[0]])
        body.data.id_properties_ui(name).update(description=told)
    curves = {_path(name): (ERROR_GROUP, row[at][:, None]) for (name, _), row in zip(CURVES, values)}
    action = channels.animate(body.data, f"{player.name} errors", frames, curves)
    action[ERROR_MARK] = True
    for curve in channels.curves(action, body.data.animation_data.action_slot).values():
        curve.keyframe_points.foreach_set("select_control_point", np.zeros(len(frames), bool))
    return action


def remove_error_curves(body: bpy.types.Object) -> None:
    """Take them off an armature, with their action."""
    channels.discard(body.data, ERROR_MARK)
    for name, _ in CURVES:
        if name in body.data:
            del body.data[name]


def renew_error_curves(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> None:
    """Where an armature has them, let them be those of the take that the player shows now; without one they go."""
    if has_error_curves(player.body) and (not player.take or write_error_curves(scene, player) is None):
        remove_error_curves(player.body)


def _shown(value: float, factor: float) -> float:
    return factor * value if factor > 0 else factor * (value - 1.0)


def _error_values(scene: bpy.types.Scene, made: session.Made) -> np.ndarray:
    """(C, T) in the order of CURVES; where nothing is known 0, since a key needs a number."""
    from ...beyond_mocap.evaluation.per_frame import per_frame
    from ...beyond_mocap.evaluation.reference import View
    from ...beyond_mocap.synthesis.quality.played import played_from_take

    take, unit = made.take, scene.beyond_mocap.library_unit or None
    library = session.library(made.plan.library, unit) if made.plan.library else None
    figures = per_frame(View(played_from_take(take), made.plan.track, take.timeline, library))
    piece = np.zeros(len(take.motion))
    piece[np.asarray(take.seams, int)] = 1.0
    rows = (100.0 * figures.root_error, *(100.0 * figures.slide.T), *(100.0 * figures.correction.T), figures.jerk,
            figures.speed_gap, np.cumsum(piece) % 2.0)
    return np.nan_to_num(np.array(rows))


def _path(name: str) -> str:
    return f'["{bpy.utils.escape_identifier(name)}"]'
