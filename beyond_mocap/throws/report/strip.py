"""Values as dots over one axis, a line for each kind: a small picture (SVG) that shows all of them, however many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...evaluation.html_page import Html, element, fragment

_LABEL, _WIDTH, _RIGHT, _LINE, _TOP = 210.0, 680.0, 30.0, 20.0, 8.0  # px
_STEPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
_MOST_MARKS = 9
_COLOURS = {"network": "#c2571a", "deviation": "#1f6fb2"}


def strip(rows: Sequence[tuple[str, str, Sequence[tuple[float, str]]]], aim: float, unit: str) -> Html:
    """The picture. rows: title, kind (of _COLOURS), and (value, what it is of) of each dot; aim: value of an upright
    line; unit: the axis's text."""
    values = [value for _, _, dots in rows for value, _ in dots]
    step, end = _axis(max([1.2 * aim, *values]))
    bottom = _TOP + _LINE * len(rows)

    def at(value: float) -> float:
        return _LABEL + _WIDTH * min(value, end) / end

    parts = [_mark(at(value), bottom, f"{value:g}") for value in np.arange(0.0, end + 0.5 * step, step).round(6)]
    parts.append(element("line", x1=f"{at(aim):.1f}", x2=f"{at(aim):.1f}", y1=_TOP, y2=bottom, stroke="#23703a",
                         stroke_dasharray="4 3"))  # fmt: skip
    for order, (title, kind, dots) in enumerate(rows):
        y = _TOP + _LINE * (order + 0.5)
        parts.append(element("text", title, x=_LABEL - 10, y=y + 4, text_anchor="end", fill="#444"))
        parts += [element("circle", element("title", f"{what}: {value:.2f}"), cx=f"{at(value):.1f}", cy=y, r=4.5,
                          fill=_COLOURS[kind], fill_opacity=".45") for value, what in dots]  # fmt: skip
    parts.append(element("text", unit, x=_LABEL, y=bottom + 34, fill="#666"))
    width, height = _LABEL + _WIDTH + _RIGHT, bottom + 42
    return element("svg", *parts, viewBox=f"0 0 {width} {height}", width=width, height=height, role="img")


def _axis(most: float) -> tuple[float, float]:
    """The distance of marks, and the last one, of an axis on which `most` has a place."""
    step = next((one for one in _STEPS if most / one <= _MOST_MARKS), _STEPS[-1])
    return step, step * min(np.ceil(most / step), _MOST_MARKS)


def _mark(x: float, bottom: float, text: str) -> Html:
    line = element("line", x1=f"{x:.1f}", x2=f"{x:.1f}", y1=_TOP, y2=bottom, stroke="#e6e6e6")
    return fragment(line, element("text", text, x=f"{x:.1f}", y=bottom + 16, text_anchor="middle", fill="#666"))
