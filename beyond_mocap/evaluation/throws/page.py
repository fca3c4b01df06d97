"""The report over generated throws or kicks as one page for a browser; it loads nothing, and all names are escaped."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

from .fredriksson import HIERARCHY
from .subjects import EFFECTOR_NAMES

AIMS = {"raw": 0.03, "impact": 0.10}
"""Metres: what the networks' own deviation is to be, and the impact after a correction (his: 1.6 to 8 cm, 0.70 to 0.87
m)."""
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1120px; margin: 1.5em auto;
  padding: 0 1em }
h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin: 1.6em 0 .4em } p { margin: .3em 0 } .quiet { color: #666 }
table { border-collapse: collapse; font-size: 14px } tr { border-bottom: 1px solid #eee }
th, td { padding: .18em .9em .18em 0; text-align: left } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums }
.scroll { overflow-x: auto } .met { color: #23703a } .missed { color: #b3261e; font-weight: 600 }
"""
_COLUMNS = (
    ("impact", "impact, m", 3), ("head", "head, °", 1), ("head_share", "head turns", 2), ("jerk", "jerk", 2),
    ("beyond", "beyond limits", 3), ("seconds", "seconds", 2),
)


def throws_page(report: Mapping) -> str:
    """The page, as text, of a report that `throw evaluate` writes."""
    title = escape(str(report.get("model", "Throws")))
    parts = [
        f"<h1>{title}</h1>", f"<p class=quiet>{escape(str(report.get('trained_on', '')))}</p>",
        f"<p>{report['motions']} motions of {escape(', '.join(map(str, report['subjects'])))}; {report['lost']} lost their "
        "body and are in no mean.</p>",
        "<h2>Distance from where hands and feet were wanted</h2>", _deviations(report),
        "<h2>All figures</h2>", _figures(report), "<h2>All motions</h2>", _motions(report),
    ]  # fmt: skip
    if report["left_out"]:
        parts.append("<h2>Left out</h2>" + "".join(f"<p>{escape(line)}</p>" for line in report["left_out"]))
    head = f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style>'
    return head + "\n".join(parts) + "</html>\n"


def _deviations(report: Mapping) -> str:
    """As table 8.6, one row; his mean below."""
    rows = ["<tr><th>m" + "".join(f"<th class=n>{name}" for name in EFFECTOR_NAMES)]
    for title, key in (("the motion", "deviation_m"), ("the networks alone", "network_deviation_m")):
        judged = AIMS["raw"] if key == "network_deviation_m" else None
        rows.append(f"<tr><td>{title}" + "".join(_cell(value, 4, judged) for value in report[key].values()))
    rows.append("<tr class=quiet><td>Fredriksson, table 8.6, mean"
                + "".join(_cell(value, 4) for value in HIERARCHY.deviation.mean(axis=0)))
    return f"<table>{''.join(rows)}</table>"


def _figures(report: Mapping) -> str:
    lines = [
        ("impact on a wall at 4 m from where it was to be, m", "impact_m", 3),
        ("impacts beyond three standard deviations, left out", "impacts_culled", 0),
        ("the same at the target, m", "far_impact", 3), ("impact of the wanted motion from its target, m", "own_impact", 3), ("head off by, degrees", "head", 1),
        ("head turns against the chest, over the recording's", "head_share", 2),
        ("jerk, 99th percentile, over the recording's", "jerk", 2), ("bones change by, m", "bones", 4),
        ("rotations beyond the joints' limits, share", "beyond", 4), ("seconds for one", "seconds", 3),
        ("that lasts, s", "duration", 2),
    ]  # fmt: skip
    return "<table>" + "".join(f"<tr><td>{title}{_cell(report.get(key), digits)}" for title, key, digits in lines) + \
        "</table>"


def _motions(report: Mapping) -> str:
    head = "<tr><th>motion<th>subject" + "".join(f"<th class=n>{name}, m" for name in EFFECTOR_NAMES)
    rows = [head + "".join(f"<th class=n>{title}" for _, title, _ in _COLUMNS)]
    for one in report["each"]:
        rows.append(
            f"<tr><td>{escape(str(one['name']))}<td>{escape(str(one['subject']))}"
            + "".join(_cell(value, 4) for value in one["deviation"])
            + "".join(_cell(one[key], digits) for key, _, digits in _COLUMNS)
        )
    return f"<div class=scroll><table>{chr(10).join(rows)}</table></div>"


def _cell(value: float | None, digits: int, aim: float | None = None) -> str:
    if value is None or value != value:
        return "<td class=n>–"
    status = "" if aim is None else " met" if value <= aim else " missed"
    return f'<td class="n{status}">{value:.{digits}f}'
