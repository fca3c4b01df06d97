"""The analysis of a study as JSON, and as one HTML page that loads nothing; all names are escaped.

Ratings are drawn as diverging stacked bars: good answers to the right of zero, bad ones to the left, neutral ones half
on each side (Robbins and Heiberger 2011; Faustino figs. 15 and 16).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..base.optional_packages import import_optional
from ..evaluation.html_page import (
    Html,
    build_element,
    build_image,
    build_number_cell,
    build_page,
    build_row,
    build_section,
    build_table,
    build_title,
    join_html,
)
from ..evaluation.plots import create_canvas, render_png
from ..evaluation.report import round_values
from .analysis import ALPHA, Analysis, Finding, Shares
from .form import BACKGROUND, SCALE

_COLUMNS = (
    ("mean", "difference", 2), ("low", "from", 2), ("high", "to", 2), ("t", "t", 2), ("p", "p", 4),
    ("holm_p", "p, Holm", 4), ("wilcoxon_p", "p, Wilcoxon", 4), ("pooled_p", "p, pooled", 4), ("d", "d", 2),
    ("delta", "delta", 2),
)  # fmt: skip
COLOURS = ("#b5482a", "#e3a587", "#d9d9d9", "#8fb8de", "#2563a8")
_NAME: dict[str, Any] = {"fontsize": 9, "parse_math": False}  # names may contain dollar signs


def build_study_report(analysis: Analysis) -> dict:
    """Build the analysis as plain values for JSON.

    Args:
        analysis: the analysis.
    Returns:
        The report; None where a value is unknown.
    """
    answers = analysis.answers.background.values()
    background = {key: dict(Counter(one[key] for one in answers if key in one)) for key in (q.key for q in BACKGROUND)}
    return round_values({
        "version": 1, "study": analysis.study.id, "pairs": analysis.study.pairs,
        "raters": list(analysis.answers.raters), "missing": analysis.answers.missing, "background": background,
        "systems": [_shares_to_dict(row) for row in analysis.by_system],
        "scenarios": [{"scenario": title, "systems": list(map(_shares_to_dict, rows))} for title,
                      rows in analysis.by_scenario],
        "findings": [{**{key: value for key, value in vars(one).items() if key != "differences"},
                      "raters": len(one.differences), "differences": one.differences.tolist(), "better": one.better}
                     for one in analysis.findings], "notes": list(analysis.notes),
    })  # fmt: skip


def build_study_page(analysis: Analysis) -> str:
    """Build the analysis as an HTML page.

    Args:
        analysis: the analysis.
    Returns:
        The page as text.
    Raises:
        InputError: if matplotlib is not installed.
    """
    import_optional("matplotlib", "HTML report")
    unit = "choices: 1 is always the first, -1 always the second" if analysis.study.pairs else "points of the scale"
    picture = draw_differences(analysis.findings, f"each rater's mean difference, {unit}")
    return build_page(
        f"Study {analysis.study.id}", build_element("h1", f"How natural it looks: study {analysis.study.id}"),
        *(build_element("p", note) for note in analysis.notes),
        build_section("Is it better?", *(_describe_finding(one, analysis.study.pairs) for one in analysis.findings),
                      _build_findings(analysis), build_image(picture, "raters' differences")),
        *(_build_systems(analysis) if analysis.by_system else ()),
        build_section("Who answered", *_build_background(analysis)),
    )  # fmt: skip


def place_bar(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the segments of a diverging bar: the middle of the neutral answers lies at zero.

    Args:
        counts: (5,) number of each rating.
    Returns:
        Left edges and widths, (5,) percent each.
    """
    share = 100.0 * np.asarray(counts, float) / max(float(np.sum(counts)), 1.0)
    left = np.concatenate([[0.0], np.cumsum(share)[:-1]])
    return left - (share[:2].sum() + share[2] / 2.0), share


def _build_systems(analysis: Analysis) -> tuple[Html, Html]:
    pictures = (build_image(draw_ratings([("", analysis.by_system)]), "ratings by system"),
                build_image(draw_ratings(analysis.by_scenario), "ratings by scenario"))  # fmt: skip
    head = ("system", *map(build_title, (*SCALE, "mean", "sd")))
    rows = [
        build_row(row.name, *map(build_number_cell, row.counts), *(build_number_cell(x, 2) for x in (row.mean, row.sd)))
        for row in analysis.by_system
    ]
    return build_section("By system", pictures[0], build_table(head, rows)), build_section("By scenario", pictures[1])


def format_p(p: float) -> str:
    """Format a p value: "p = 0.0391", "p < 0.0001", "p is unknown".

    Args:
        p: the value, NaN if unknown.
    Returns:
        The text.
    """
    if not math.isfinite(p):
        return "p is unknown"
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"


def _describe_finding(finding: Finding, pairs: bool) -> Html:
    claim = f"{finding.new} looks more natural than {finding.old}"
    if not math.isfinite(finding.p):
        return build_element("p", f"Whether {claim} cannot be tested: too few raters, or no differences.")
    unit = "" if pairs else " points"
    figures = (f"{finding.mean:+.2f}{unit} (95 %: {finding.low:+.2f} to {finding.high:+.2f}), t({finding.degrees}) = "
               f"{finding.t:.2f}, one-sided {format_p(finding.holm_p)}")  # fmt: skip
    if finding.better:
        return build_element("p", build_element("b", claim, class_="met"), f": {figures}.")
    return build_element("p", f"Not significant that {claim}: {figures}.")


def _build_findings(analysis: Analysis) -> Html:
    rows = [
        build_row(f"{one.new} over {one.old}", build_number_cell(len(one.differences)),
                  *(_build_cell(getattr(one, key), digits) for key, _, digits in _COLUMNS)) for one in analysis.findings
    ]  # fmt: skip
    legend = (f"Difference: mean over raters with its 95 % interval. p: one-sided paired t-test by rater; Holm: "
              f"adjusted for all hypotheses, at {ALPHA:g}. Wilcoxon: the same by ranks. Pooled: all answers as if each "
              "had a rater of its own (Faustino §5.1.2). d: Cohen's d of raters' differences. "
              "delta: Cliff's.")  # fmt: skip
    head = ("hypothesis", build_title("raters"), *(build_title(title) for _, title, _ in _COLUMNS))
    return join_html(build_table(head, rows), build_element("p", legend, class_="quiet"))


def _build_background(analysis: Analysis) -> list[Html]:
    parts = []
    for question in BACKGROUND:
        counts = Counter(answers.get(question.key, "") for answers in analysis.answers.background.values())
        rows = [(text, counts[key]) for key, text in question.choices] + [("no answer", counts[""])]
        cells = [build_row(text, build_number_cell(count)) for text, count in rows if count]
        parts += [build_element("p", question.text), build_table((), cells)]
    return parts


def _shares_to_dict(row: Shares) -> dict:
    return {**vars(row), "counts": row.counts.tolist()}


def _build_cell(value: float, digits: int) -> Html:
    """Build a number cell; values with four digits are p values and show "< 0.0001" below that."""
    return build_element("td", "< 0.0001", class_="n") if digits == 4 and value < 1e-4 else build_number_cell(value,
            digits)


def draw_ratings(groups: Sequence[tuple[str, Sequence[Shares]]]) -> bytes:
    """Draw ratings as diverging stacked bars.

    Args:
        groups: title and rows of each group; one bar for each row.
    Returns:
        A PNG.
    """
    lines = sum(len(rows) for _, rows in groups) + 0.6 * len(groups)
    figure, (ax,) = create_canvas(1.1 + 0.36 * lines)
    y, ticks, names = 0.0, [], []
    for title, rows in groups:
        if title:
            ax.text(0.0, y, title, transform=ax.get_yaxis_transform(), weight="bold", va="center", **_NAME)
            y += 0.8
        for row in rows:
            _draw_bar(ax, y, row.counts)
            ticks.append(y)
            names.append(f"{row.name} ({int(row.counts.sum())})")
            y += 1.0
        y += 0.3
    ax.set_yticks(ticks, names, **_NAME)
    ax.set_ylim(y, -0.8)
    ax.set_xlim(-100.0, 100.0)
    ax.set_xticks(range(-100, 101, 25), [f"{abs(at)} %" for at in range(-100, 101, 25)])
    ax.axvline(0.0, color="#333333", lw=0.8)
    handles = [ax.barh([-9], [0.0], color=colour, label=text) for colour, text in zip(COLOURS, SCALE)]
    ax.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, fontsize=8,
              frameon=False)
    return render_png(figure)


def draw_differences(findings: Sequence[Finding], unit: str) -> bytes:
    """Draw each rater's difference as a dot, and the mean with its 95 % interval.

    Args:
        findings: one row for each.
        unit: label of the horizontal axis.
    Returns:
        A PNG.
    """
    figure, (ax,) = create_canvas(0.9 + 0.55 * len(findings))
    for row, finding in enumerate(findings):
        spread = row + 0.16 * np.sin(2.4 * np.arange(len(finding.differences)))
        ax.plot(finding.differences, spread, "o", color="#8fb8de", ms=5, alpha=0.8)
        ax.plot([finding.low, finding.high], [row, row], color="#222222", lw=2)
        ax.plot([finding.mean], [row], "D", color="#222222", ms=6)
    ax.axvline(0.0, color="#b5482a", lw=1, ls="--")
    ax.set_yticks(range(len(findings)), [f"{finding.new} - {finding.old}" for finding in findings], **_NAME)
    ax.set_ylim(len(findings) - 0.4, -0.6)
    ax.set_xlabel(unit, fontsize=8)
    return render_png(figure)


def _draw_bar(ax, y: float, counts: np.ndarray) -> None:
    for left, share, colour, count in zip(*place_bar(counts), COLOURS, counts):
        ax.barh([y], [share], left=left, color=colour, height=0.72)
        if share >= 4.0:
            dark = colour in (COLOURS[0], COLOURS[-1])
            ax.text(left + share / 2.0, y, str(int(count)), ha="center", va="center", fontsize=8,
                    color="white" if dark else "#222222")  # fmt: skip
