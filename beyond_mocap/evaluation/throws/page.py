"""The report over generated throws or kicks as one page for a browser; it loads nothing, and all names are escaped."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import PurePath

import numpy as np

from .deviation import LOST
from .strip import strip

AIM = 0.03
"""Metres: what the deviation of the networks alone is to stay below (his: 1.6 to 8 cm)."""
EFFECTOR_NAMES = ("left arm", "right arm", "left leg", "right leg")
"""As Fredriksson's tables call the effectors, which are wrists and toes."""
_PRINTED = np.array([
    [0.0525, 0.0505, 0.0178, 0.0219], [0.0391, 0.0410, 0.0175, 0.0157],
    [0.0714, 0.0818, 0.0380, 0.0227], [0.0583, 0.0451, 0.0291, 0.0217],
])  # fmt: skip
"""m: the deviations of his table 8.6, a row for each subject."""
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1120px; margin: 1.5em auto;
  padding: 0 1em }
h1 { font-size: 1.5em; margin-bottom: 0; overflow-wrap: anywhere } h2 { font-size: 1.15em; margin: 1.6em 0 .4em }
p { margin: .3em 0; overflow-wrap: anywhere } .quiet { color: #666; font-weight: normal }
table { border-collapse: collapse; font-size: 14px } tr { border-bottom: 1px solid #eee }
th, td { padding: .18em 0 .18em .9em; text-align: left; vertical-align: top }
th:first-child, td:first-child { padding-left: 0 }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
td.name { overflow-wrap: anywhere; min-width: 9em; max-width: 22em }
.scroll { overflow-x: auto } .met { color: #23703a } .missed { color: #b3261e; font-weight: 600 }
svg { max-width: 100%; height: auto; display: block; font: 12px system-ui, sans-serif }
"""
_FIGURES = (
    ("impact_m", 1.0, 2, "m", "from the ball's impact on a wall 4 m away to where it was to be"),
    ("far_impact", 1.0, 2, "m", "the same where the target is"),
    ("own_impact", 1.0, 2, "m", "from the wanted ball's own impact to its target (what scaling by height does to a "
                                "flight)"),
    ("impacts_culled", 1.0, 0, "", "impacts left out of these, beyond three standard deviations"),
    ("head", 1.0, 1, "°", "between the head and the recorded one"),
    ("head_share", 1.0, 2, "×", "what the head turns against the chest, over the recording"),
    ("jerk", 1.0, 2, "×", "jerk (99th percentile), over the recording"),
    ("bones", 100.0, 2, "cm", "by which bones change their length"),
    ("beyond", 100.0, 2, "%", "of the joints' rotations beyond the range of the examples"),
    ("seconds", 1.0, 2, "s", "to generate one motion"),
    ("duration", 1.0, 2, "s", "that it lasts"),
)
"""Key of the report, what it is multiplied by, digits, unit, what it is."""
_OF_BALL = ("impact_m", "far_impact", "own_impact", "impacts_culled")
_COLUMNS = (
    ("impact", 1.0, 2, "impact", "m"), ("head", 1.0, 1, "head", "°"), ("head_share", 1.0, 2, "head turns", "×"),
    ("jerk", 1.0, 2, "jerk", "×"), ("beyond", 100.0, 1, "beyond", "%"), ("seconds", 1.0, 2, "takes", "s"),
)


def throws_page(report: Mapping) -> str:
    """The page, as text, of a report that `throw evaluate` writes."""
    title = escape(PurePath(str(report.get("model", "Throws"))).name)
    parts = [
        f"<h1>{title}</h1>", f"<p class=quiet>{escape(str(report.get('model', '')))}: "
        f"{escape(str(report.get('trained_on', '')))}</p>", *_said(report),
        "<h2>How far hands and feet are from where they were wanted, cm</h2>", _deviations(report), _picture(report),
        "<h2>All figures</h2>", _figures(report), "<h2>All motions</h2>", _motions(report),
    ]  # fmt: skip
    if report["left_out"]:
        parts.append("<h2>Left out</h2>" + "".join(f"<p>{escape(line)}</p>" for line in report["left_out"]))
    head = (f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
            f"<title>{title}</title><style>{_STYLE}</style>")  # fmt: skip
    return head + "\n".join(parts) + "</html>\n"


def _said(report: Mapping) -> list[str]:
    """What was measured, and how."""
    lost, people = report["lost"], ", ".join(map(str, report["subjects"]))
    of = f" of {escape(str(report['examples']))}" if report.get("examples") else ""
    who = f"<p>{report['motions']} motions{of}, by {escape(people)}.</p>" if people else "<p>No motions.</p>"
    how = "with inverse kinematics, limits and pose iterations" if _corrected(report) else "by the networks alone"
    gone = f"{lost} lost their body (a hand or foot {LOST:g} m off on average) and are in no mean" if lost else \
        "none lost its body"
    return [who, f"<p>Generated anew {how}; {gone}.</p>"]


def _corrected(report: Mapping) -> bool:
    return bool(report.get("options", {}).get("ik", True))


def _rows(report: Mapping) -> list[tuple[str, str]]:
    """Titles of what is shown, and its key in each motion; one where nothing was corrected, for then they are alike."""
    alone = ("the networks alone", "network")
    return [alone, ("as it comes out", "deviation")] if _corrected(report) else [alone]


def _deviations(report: Mapping) -> str:
    """As table 8.6, one row; his mean below."""
    rows = ["<tr><th>mean" + "".join(f"<th class=n>{name}" for name in EFFECTOR_NAMES)]
    for title, key in _rows(report):
        aim = 100.0 * AIM if key == "network" else None
        values = report[{"network": "network_deviation_m", "deviation": "deviation_m"}[key]].values()
        rows.append(f"<tr><td>{title}" + "".join(_cell(value, 100.0, 2, aim) for value in values))
    rows.append("<tr class=quiet><td>Fredriksson, table 8.6, as it comes out"
                + "".join(_cell(value, 100.0, 2) for value in _PRINTED.mean(axis=0)))
    told = f"<p class=quiet>Green: within the aim of {100 * AIM:g} cm for the networks alone; red: beyond it.</p>"
    return f"<div class=scroll><table>{''.join(rows)}</table></div>{told}"


def _picture(report: Mapping) -> str:
    """Every motion as a dot, a line for each hand and foot."""
    rows = []
    for order, effector in enumerate(EFFECTOR_NAMES):
        for title, key in _rows(report):
            dots = [
                (100.0 * one[key][order], str(one["name"])) for one in report["each"] if one[key][order] is not None
            ]
            rows.append((f"{effector}, {title}", key, dots))
    if not any(dots for _, _, dots in rows):
        return ""
    return strip(rows, 100.0 * AIM, "cm; each dot is a motion, the line is the aim for the networks alone")


def _figures(report: Mapping) -> str:
    """The means; without those of the ball where no ball was measured."""
    ball = report.get("impact_m") is not None or report.get("far_impact") is not None
    lines = [line for line in _FIGURES if ball or line[0] not in _OF_BALL]
    return "<div class=scroll><table>" + "".join(
        f"<tr>{_cell(report.get(key), scale, digits)}<td>{unit}<td>{title}" for key, scale, digits, unit, title in lines
    ) + "</table></div>"


def _motions(report: Mapping) -> str:
    """A row a motion; columns of which no motion has a value are left out."""
    columns = [one for one in _COLUMNS if any(_known(each[one[0]]) for each in report["each"])]
    titles = [(name, "cm") for name in EFFECTOR_NAMES] + [tuple(one[3:]) for one in columns]
    rows = ["<tr><th>subject<th>motion" + "".join(f"<th class=n>{title}<br>{unit}" for title, unit in titles)]
    for one in report["each"]:
        subject = str(one["subject"])
        rows.append(
            f"<tr><td class=name>{escape(subject)}<td class=name>{escape(str(one['name']).removeprefix(subject + '/'))}"
            + "".join(_cell(value, 100.0, 2) for value in one["deviation"])
            + "".join(_cell(one[key], scale, digits) for key, scale, digits, *_ in columns)
        )
    return f"<div class=scroll><table>{chr(10).join(rows)}</table></div>"


def _known(value: float | None) -> bool:
    return value is not None and value == value


def _cell(value: float | None, scale: float, digits: int, aim: float | None = None) -> str:
    if not _known(value):
        return "<td class=n>–"
    status = "" if aim is None else " met" if scale * value <= aim else " missed"
    return f'<td class="n{status}">{scale * value:.{digits}f}'
