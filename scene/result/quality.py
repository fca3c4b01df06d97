"""What a report says, as lines that a player's settings keep and the panel draws: columns with a tab between.

- quality: name and value ("Feet slide: 1.2 cm/s"), target, status ("met", "missed" or ""; as `evaluation.report`
  has it)
- moments: text, seconds, status
- warnings: text, seconds at which its stretches begin, with blanks between ("" where it is about no time)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

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


def quality(report: Mapping) -> str:
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
        aim = (
            ("≥ " if (least is not None) == (factor > 0) else "≤ ") + shown[0]
            if len(shown) == 1
            else " .. ".join(shown)
        )
        status = "" if met is None else ("met" if met else "missed")
        lines.append("\t".join((f"{name}: {form.format(_shown(value, factor))}{unit}", aim, status)))
    return "\n".join(lines)


def _shown(value: float, factor: float) -> float:
    return factor * value if factor > 0 else factor * (value - 1.0)


def moments(report: Mapping) -> str:
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


def warnings(report: Mapping, more: Iterable[str] = (), known: Iterable[str] = ()) -> str:
    """A line for each warning of a report, and before them `more` (of the track), but for those that are `known`."""
    from ...beyond_mocap.base.errors import spans_of

    seconds = dict(zip(report.get("warnings", ()), report.get("warning_seconds", ())))
    lines = []
    for text in dict.fromkeys((*more, *seconds)):
        spans = seconds.get(text) or spans_of(text)
        if text not in known:
            lines.append(f"{text}\t{' '.join(f'{first:.3f}' for first, _ in spans)}")
    return "\n".join(lines)
