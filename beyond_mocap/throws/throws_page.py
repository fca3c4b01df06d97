"""Report on generated throws or kicks as one HTML page, with a dot plot of its motions.

The page loads no other files, and all names are escaped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath

import numpy as np

from ..evaluation.html_page import (
    Html,
    build_element,
    build_number_cell,
    build_page,
    build_row,
    build_section,
    build_table,
    build_title,
    join_html,
)
from .evaluate_throws import MAX_VALID_DEVIATION

TARGET_DEVIATION = 0.03
"""Metres: target for the deviation of the networks alone (Fredriksson: 1.6 to 8 cm)."""
EFFECTOR_NAMES = ("left arm", "right arm", "left leg", "right leg")
"""Names of the effectors in Fredriksson's tables; they are wrists and toes."""
_PRINTED = np.array([
    [0.0525, 0.0505, 0.0178, 0.0219], [0.0391, 0.0410, 0.0175, 0.0157],
    [0.0714, 0.0818, 0.0380, 0.0227], [0.0583, 0.0451, 0.0291, 0.0217],
])  # fmt: skip
"""m: the deviations of Fredriksson's table 8.6, a row for each subject."""
_FIGURES = (
    ("impact_m", 1.0, 2, "m", "impact error on a wall 4 m away"),
    ("far_impact", 1.0, 2, "m", "impact error at the distance of the target"),
    ("own_impact", 1.0, 2, "m", "from the impact of the requested ball to its target (effect of scaling by height on "
     "the flight)"),
    ("impacts_culled", 1.0, 0, "", "impacts excluded from these means, beyond three standard deviations"),
    ("facing", 1.0, 1, "°", "between the body's heading and the recorded one"),
    ("head", 1.0, 1, "°", "between the head's rotation and the recorded one"),
    ("head_mean", 1.0, 1, "°", "the same for the mean head of the examples on the generated body"),
    ("head_share", 1.0, 2, "×", "rotation of the head relative to the chest, divided by the recording's"),
    ("jerk", 1.0, 2, "×", "jerk (99th percentile), divided by the recording's"),
    ("bones", 100.0, 2, "cm", "largest change of a bone's length"),
    ("beyond", 100.0, 2, "%", "of the joint rotations outside the range of the examples"),
    ("seconds", 1.0, 2, "s", "to generate one motion"),
    ("duration", 1.0, 2, "s", "duration of a motion"),
)
"""Key of the report, factor, digits, unit, description."""
_OF_BALL = ("impact_m", "far_impact", "own_impact", "impacts_culled")
_COLUMNS = (
    ("impact", 1.0, 2, "impact", "m"), ("head", 1.0, 1, "head", "°"), ("head_share", 1.0, 2, "head rotation", "×"),
    ("jerk", 1.0, 2, "jerk", "×"), ("beyond", 100.0, 1, "beyond", "%"), ("seconds", 1.0, 2, "takes", "s"),
)
_LABEL, _WIDTH, _RIGHT, _LINE, _TOP = 210.0, 680.0, 30.0, 20.0, 8.0  # px
_STEPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
_MOST_MARKS = 9
_COLOURS = {"network": "#c2571a", "deviation": "#1f6fb2"}


def build_throws_page(report: Mapping) -> str:
    """Build the page, as text, from a report that `throw evaluate` writes."""
    model = str(report.get("model", ""))
    title = PurePath(model or "Throws").name
    left_out = [build_element("p", str(line)) for line in report["left_out"]]
    return build_page(
        title, build_element("h1", title), build_element("p", f"{model}: {report.get('trained_on', '')}",
                                                         class_="quiet"), *_describe_report(report),
        build_section("Distance of hands and feet from their targets, cm", _build_deviation_table(report),
                      _build_plot(report)), build_section("All figures", _build_figures_table(report)),
        build_section("All motions", _build_motions_table(report)), build_section("Left out", *left_out) if left_out
        else "",
    )  # fmt: skip


def _describe_report(report: Mapping) -> list[Html]:
    """Describe what was measured, and how."""
    lost, people = report["lost"], ", ".join(map(str, report["subjects"]))
    of = f" of {report['examples']}" if report.get("examples") else ""
    motions_text = f"{report['motions']} motions{of}, by {people}." if people else "No motions."
    method_text = "with inverse kinematics, limits and pose iterations" if _is_corrected(
        report) else "by the networks alone"
    failures_text = (
        f"{lost} failed (a hand or foot {MAX_VALID_DEVIATION:g} m off on average) and are excluded from all means"
        if lost else "none failed"
    )
    return [build_element("p", motions_text), build_element("p", f"Generated {method_text}; {failures_text}.")]


def _is_corrected(report: Mapping) -> bool:
    """Return whether the motions were corrected by inverse kinematics."""
    return bool(report.get("options", {}).get("ik", True))


def _list_rows(report: Mapping) -> list[tuple[str, str]]:
    """List titles of the compared motions and their keys; only one if nothing was corrected."""
    alone = ("the networks alone", "network")
    return [alone, ("final motion", "deviation")] if _is_corrected(report) else [alone]


def _build_deviation_table(report: Mapping) -> Html:
    """Build the table of deviations, as table 8.6 in one row; Fredriksson's mean below."""
    rows = []
    for title, key in _list_rows(report):
        aim = 100.0 * TARGET_DEVIATION if key == "network" else None
        values = report[{"network": "network_deviation_m", "deviation": "deviation_m"}[key]].values()
        rows.append(build_row(title, *(_build_cell(value, aim) for value in values)))
    printed = [build_number_cell(value, 2, 100.0) for value in _PRINTED.mean(axis=0)]
    rows.append(build_row("Fredriksson, table 8.6, final motion", *printed, class_="quiet"))
    legend = f"Green: within the target of {100 * TARGET_DEVIATION:g} cm for the networks alone; red: above it."
    table = build_table(("mean", *map(build_title, EFFECTOR_NAMES)), rows)
    return join_html(table, build_element("p", legend, class_="quiet"))


def _build_plot(report: Mapping) -> Html:
    """Build the dot plot: every motion is a dot, one line for each hand and foot."""
    rows = []
    for order, effector in enumerate(EFFECTOR_NAMES):
        for title, key in _list_rows(report):
            dots = [
                (100.0 * one[key][order], str(one["name"])) for one in report["each"] if one[key][order] is not None
            ]
            rows.append((f"{effector}, {title}", key, dots))
    if not any(dots for _, _, dots in rows):
        return Html()
    return draw_strip(rows, 100.0 * TARGET_DEVIATION,
                      "cm; each dot is a motion, the line is the target for the networks alone")


def _build_figures_table(report: Mapping) -> Html:
    """Build the table of means; without those of the ball if no ball was measured."""
    ball = report.get("impact_m") is not None or report.get("far_impact") is not None
    lines = [line for line in _FIGURES if ball or line[0] not in _OF_BALL]
    return build_table((), [
        build_row(build_number_cell(report.get(key), digits, scale), unit, title)
        for key, scale, digits, unit, title in lines
    ])  # fmt: skip


def _build_motions_table(report: Mapping) -> Html:
    """Build the table of motions; columns without any value are left out."""
    columns = [one for one in _COLUMNS if any(_is_known(each[one[0]]) for each in report["each"])]
    titles = [(name, "cm") for name in EFFECTOR_NAMES] + [one[3:] for one in columns]
    rows = []
    for one in report["each"]:
        subject = str(one["subject"])
        name = str(one["name"]).removeprefix(subject + "/")
        cells = [build_number_cell(value, 2, 100.0) for value in one["deviation"]]
        cells += [build_number_cell(one[key], digits, scale) for key, scale, digits, *_ in columns]
        rows.append(build_row(build_element("td", subject, class_="name"), build_element("td", name, class_="name"),
                              *cells))
    return build_table(("subject", "motion", *(build_title(*title) for title in titles)), rows)


def _is_known(value: float | None) -> bool:
    return value is not None and value == value


def _build_cell(value: float | None, aim: float | None) -> Html:
    """Build a cell in centimetres from a value in metres, green up to the target, which is in centimetres."""
    status = "" if aim is None or not _is_known(value) else "met" if 100.0 * value <= aim else "missed"
    return build_number_cell(value, 2, 100.0, status)


def draw_strip(rows: Sequence[tuple[str, str, Sequence[tuple[float, str]]]], aim: float, unit: str) -> Html:
    """Draw a dot plot as SVG.

    Args:
        rows: title, kind (of _COLOURS), and (value, description) of each dot.
        aim: value at which a vertical line is drawn.
        unit: label of the axis.
    """
    values = [value for _, _, dots in rows for value, _ in dots]
    step, end = _choose_axis(max([1.2 * aim, *values]))
    bottom = _TOP + _LINE * len(rows)

    def to_x(value: float) -> float:
        return _LABEL + _WIDTH * min(value, end) / end

    parts = [_draw_mark(to_x(value), bottom, f"{value:g}") for value in np.arange(0.0, end + 0.5 * step, step).round(6)]
    parts.append(build_element("line", x1=f"{to_x(aim):.1f}", x2=f"{to_x(aim):.1f}", y1=_TOP, y2=bottom,
                               stroke="#23703a", stroke_dasharray="4 3"))  # fmt: skip
    for order, (title, kind, dots) in enumerate(rows):
        y = _TOP + _LINE * (order + 0.5)
        parts.append(build_element("text", title, x=_LABEL - 10, y=y + 4, text_anchor="end", fill="#444"))
        parts += [build_element("circle", build_element("title", f"{what}: {value:.2f}"), cx=f"{to_x(value):.1f}", cy=y,
                                r=4.5, fill=_COLOURS[kind], fill_opacity=".45") for value, what in dots]  # fmt: skip
    parts.append(build_element("text", unit, x=_LABEL, y=bottom + 34, fill="#666"))
    width, height = _LABEL + _WIDTH + _RIGHT, bottom + 42
    return build_element("svg", *parts, viewBox=f"0 0 {width} {height}", width=width, height=height, role="img")


def _choose_axis(most: float) -> tuple[float, float]:
    """Choose the distance between the marks and the last mark of an axis that includes `most`."""
    step = next((one for one in _STEPS if most / one <= _MOST_MARKS), _STEPS[-1])
    return step, step * min(np.ceil(most / step), _MOST_MARKS)


def _draw_mark(x: float, bottom: float, text: str) -> Html:
    line = build_element("line", x1=f"{x:.1f}", x2=f"{x:.1f}", y1=_TOP, y2=bottom, stroke="#e6e6e6")
    return join_html(line, build_element("text", text, x=f"{x:.1f}", y=bottom + 16, text_anchor="middle", fill="#666"))
