"""The analysis of a study as JSON and as one page for a browser, which loads nothing; all names are escaped."""

from __future__ import annotations

import math
from collections import Counter

from ..evaluation import plots
from ..evaluation.html_page import (
    Html,
    build_image,
    build_number_cell,
    build_page,
    build_row,
    build_section,
    build_table,
    build_title,
    element,
    fragment,
)
from ..evaluation.report import rounded
from . import bars
from .analysis import ALPHA, Analysis, Finding, Shares
from .questions import BACKGROUND, SCALE

_COLUMNS = (
    ("mean", "difference", 2), ("low", "from", 2), ("high", "to", 2), ("t", "t", 2), ("p", "p", 4),
    ("holm_p", "p, Holm", 4), ("wilcoxon_p", "p, Wilcoxon", 4), ("pooled_p", "p, pooled", 4), ("d", "d", 2),
    ("delta", "delta", 2),
)  # fmt: skip


def study_report(found: Analysis) -> dict:
    """The analysis as a dict for JSON; None where something cannot be had."""
    said = found.answers.background.values()
    background = {key: dict(Counter(one[key] for one in said if key in one)) for key in (q.key for q in BACKGROUND)}
    return rounded({
        "version": 1, "study": found.study.id, "pairs": found.study.pairs, "raters": list(found.answers.raters),
        "missing": found.answers.missing, "background": background,
        "systems": [_shares(row) for row in found.by_system],
        "scenarios": [{"scenario": title, "systems": list(map(_shares, rows))} for title, rows in found.by_scenario],
        "findings": [
            {**{key: value for key, value in vars(one).items() if key != "differences"}, "raters": len(one.differences),
             "differences": one.differences.tolist(), "better": one.better} for one in found.findings
        ],
        "notes": list(found.notes),
    })  # fmt: skip


def study_page(found: Analysis) -> str:
    """The page as text. InputError where matplotlib is not installed."""
    plots.require_matplotlib()
    unit = "choices: 1 always the first, -1 always the second" if found.study.pairs else "points of the scale"
    drawn = bars.differences(found.findings, f"each rater's mean difference, {unit}")
    return build_page(
        f"Study {found.study.id}", element("h1", f"How natural it looks: study {found.study.id}"),
        *(element("p", note) for note in found.notes),
        build_section("Is it better?", *(_sentence(one, found.study.pairs) for one in found.findings),
                      _findings(found), build_image(drawn, "raters' differences")),
        *(_systems(found) if found.by_system else ()), build_section("Who answered", *_background(found)),
    )  # fmt: skip


def _systems(found: Analysis) -> tuple[Html, Html]:
    all_of_them, apart = bars.diverging([("", found.by_system)]), bars.diverging(found.by_scenario)
    table = _table(found.by_system)
    return (build_section("By system", build_image(all_of_them, "ratings by system"), table),
            build_section("By scenario", build_image(apart, "ratings by scenario")))  # fmt: skip


def p_text(p: float) -> str:
    """A p as it is told: "p = 0.0391", "p < 0.0001", "p cannot be had"."""
    if not math.isfinite(p):
        return "p cannot be had"
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"


def _sentence(one: Finding, pairs: bool) -> Html:
    said = f"{one.new} looks more natural than {one.old}"
    if not math.isfinite(one.p):
        return element("p", f"Whether {said} cannot be tested: too few raters, or all alike.")
    unit = "" if pairs else " points"
    told = (f"{one.mean:+.2f}{unit} (95 %: {one.low:+.2f} to {one.high:+.2f}), t({one.degrees}) = {one.t:.2f}, "
            f"one-sided {p_text(one.holm_p)}")  # fmt: skip
    if one.better:
        return element("p", element("b", said, class_="met"), f": {told}.")
    return element("p", f"That {said} is not shown: {told}.")


def _findings(found: Analysis) -> Html:
    rows = [
        build_row(f"{one.new} over {one.old}", build_number_cell(len(one.differences)),
                  *(_cell(getattr(one, key), digits) for key, _, digits in _COLUMNS)) for one in found.findings
    ]  # fmt: skip
    told = (f"Difference: mean over raters, with its 95 % interval. p: one-sided paired t-test by rater; Holm: for all "
            f"hypotheses together, at {ALPHA:g}. Wilcoxon: the same by ranks. Pooled: all answers as if each had "
            "a rater of its own (Faustino §5.1.2). d: Cohen's, of raters' differences. delta: Cliff's.")  # fmt: skip
    head = ("hypothesis", build_title("raters"), *(build_title(title) for _, title, _ in _COLUMNS))
    return fragment(build_table(head, rows), element("p", told, class_="quiet"))


def _table(rows: tuple[Shares, ...]) -> Html:
    head = ("system", *map(build_title, (*SCALE, "mean", "sd")))
    return build_table(head, [
        build_row(row.name, *map(build_number_cell, row.counts), *(build_number_cell(x, 2) for x in (row.mean, row.sd)))
        for row in rows
    ])  # fmt: skip


def _background(found: Analysis) -> list[Html]:
    parts = []
    for question in BACKGROUND:
        said = Counter(answers.get(question.key, "") for answers in found.answers.background.values())
        rows = [(text, said[key]) for key, text in question.choices] + [("no answer", said[""])]
        cells = [build_row(text, build_number_cell(count)) for text, count in rows if count]
        parts += [element("p", question.text), build_table((), cells)]
    return parts


def _shares(row: Shares) -> dict:
    return {"name": row.name, "counts": row.counts.tolist(), "mean": row.mean, "sd": row.sd}


def _cell(value: float, digits: int) -> Html:
    """A number; of four digits, which are those of a p, not below what they can show."""
    return element("td", "< 0.0001", class_="n") if digits == 4 and value < 1e-4 else build_number_cell(value, digits)
