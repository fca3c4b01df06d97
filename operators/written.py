"""Results written into the scene: the take is kept and shown, and what goes with it is renewed."""

from __future__ import annotations

import json

from ..scene import preview, session, strips, variants
from .build_library import summary

FIGURES = (  # what the panel's table shows: name, path in the report, factor (a negative one counts from 1), form
    ("Off the track, mean", "root_error_m.mean", 100, "{:.1f} cm"),
    ("Off the track, 95 %", "root_error_m.p95", 100, "{:.1f} cm"),
    ("Feet slide", "skate.contact_cm_s", 1, "{:.1f} cm/s"),
    ("... in the recordings", "skate.source_contact_cm_s", 1, "{:.1f} cm/s"),
    ("Jerk at seams", "seam_jerk_ratio.median", 1, "{:.2f} of real"),
    ("Words met", "annotation_similarity.all", -50, "{:.0f} %"),  # -1 is all, +1 none
    ("Clips played at most", "warp_rate.max", 1, "{:.2f} x"),
    ("Time to make", "seconds.total", 1, "{:.1f} s"),
)


def written(context, player, order, result) -> None:
    """Keep the takes of a result in the session, show the first of them, and renew what goes with it."""
    session.keep_library(result.library, order.unit)
    context.scene.beyond_mocap.library_holds = summary(result.library)
    shown = []
    for one in result.takes:
        told = dict.fromkeys((*order.warnings, *one.report.get("warnings", ())))
        lines = {
            "quality": quality(one.report),
            "moments": moments(one.report),
            "warnings": "\n".join(line for line in told if line not in result.library.notes),
            "recipe": json.dumps(one.recipe),
            "made_of": json.dumps(result.made_of),
        }
        shown.append((session.keep_take(one.plan, one.take, one.report), lines))
    preview.show(context, player, *shown[0])
    variants.keep(player, [(name, lines, one.report) for (name, lines), one in zip(shown, result.takes)])
    strips.set_automatic(context, player, result.takes[0].take.timeline)


def quality(report: dict) -> str:
    """Lines "name: value" of those figures that the report has."""
    lines = []
    for name, path, factor, form in FIGURES:
        value = report
        for key in path.split("."):
            value = value.get(key) if isinstance(value, dict) else None
        if value is not None:
            lines.append(f"{name}: {form.format(factor * (value if factor > 0 else value - 1.0))}")
    return "\n".join(lines)


def moments(report: dict) -> str:
    """A line for each key moment: its time, what was asked for, and what is shown where that is something else."""
    lines = []
    for key in report.get("keys", ()):
        instead = f", shown as {' '.join(key['used_instead'])}" if key.get("used_instead") else ""
        lines.append(f"{key['time_s']:.1f} s  {' '.join(key['labels'])}{instead}")
    return "\n".join(lines)
