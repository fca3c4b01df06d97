"""What the figures of a ride say, as lines for the panel: columns "name: value", what is aimed for, "met" or
"missed"."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import lru_cache

FIGURES = (  # name, path in the figures, factor, form, unit; what is aimed for: a number, a path of the recording's
    # own, or that where it is more than a number
    ("Way", "metres", 1.0, "{:.1f}", " m", None),
    ("Time", "seconds", 1.0, "{:.1f}", " s", None),
    ("Off the path", "root_error_m.mean", 100.0, "{:.2f}", " cm", ("root_error_own_m.mean", 0.005)),
    ("Speed off", "kept_speed.path.p95", 100.0, "{:.2f}", " %", 0.01),
    ("Feet slide", "skate.contact_cm_s", 1.0, "{:.1f}", " cm/s", "skate.source_contact_cm_s"),
    ("Not planted", "skate.before_contact_cm_s", 1.0, "{:.1f}", " cm/s", None),
    ("Slide a step", "skate.stance_mm_median", 1.0, "{:.1f}", " mm", 5.0),
    ("Feet moved", "foot_correction_m.p95", 100.0, "{:.1f}", " cm", 0.10),
    ("Legs short", "ik_miss_share", 100.0, "{:.1f}", " %", 0.0),
    ("Hardest seam", "seam_jerk.max", 1.0, "{:.2f}", " x", 1.3),
)
SLACK = 1.02  # of an aim: what the table's last digit does not show


@lru_cache(maxsize=64)
def lines(figures: str) -> str:
    """The lines of figures as JSON text; "" where there are none. Kept, since panels ask at every redraw."""
    try:
        table = json.loads(figures) if figures else {}
    except ValueError:
        table = {}
    found = []
    for name, path, factor, form, unit, aim in FIGURES:
        value = _number(table, path)
        if value is None:
            continue
        most = _most(table, aim)
        status = "" if most is None else ("met" if value * factor <= most * factor * SLACK + 0.05 else "missed")
        told = "" if most is None else f"≤ {form.format(factor * most)}"
        found.append(f"{name}: {form.format(factor * value)}{unit}\t{told}\t{status}")
    return "\n".join(found)


def _most(table: Mapping, aim) -> float | None:
    """What is aimed for, see FIGURES."""
    if isinstance(aim, tuple):
        own = _number(table, aim[0])
        return max(own, aim[1]) if own is not None else aim[1]
    return _number(table, aim) if isinstance(aim, str) else aim


def _number(table: Mapping, path: str) -> float | None:
    for part in path.split("."):
        table = table.get(part) if isinstance(table, Mapping) else None
    return float(table) if isinstance(table, (int, float)) and math.isfinite(table) else None
