"""The analysis of a study as JSON and as one page for a browser, which loads nothing; all names are escaped."""

from __future__ import annotations

import base64
import math
from collections import Counter
from html import escape

from ..evaluation import plots
from ..evaluation.report import rounded
from . import bars
from .analysis import ALPHA, Analysis, Finding, Shares
from .questions import BACKGROUND, SCALE

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1120px; margin: 1.5em auto;
  padding: 0 1em }
h1 { font-size: 1.5em; margin-bottom: 0 } h2 { font-size: 1.15em; margin: 1.6em 0 .4em } p { margin: .3em 0 }
.quiet { color: #666; font-weight: normal } img { max-width: 100%; height: auto; display: block }
table { border-collapse: collapse; font-size: 14px } tr { border-bottom: 1px solid #eee } .scroll { overflow-x: auto }
th, td { padding: .18em .9em .18em 0; text-align: left; vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums } .met { color: #23703a; font-weight: 600 }
"""
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
    parts = [f"<h1>How natural it looks: study {escape(found.study.id)}</h1>",
             "".join(f"<p>{escape(note)}</p>" for note in found.notes), "<h2>Is it better?</h2>",
             "".join(_sentence(one, found.study.pairs) for one in found.findings), _findings(found),
             _image(bars.differences(found.findings, f"each rater's mean difference, {unit}"), "raters' differences")]
    if found.by_system:
        parts += ["<h2>By system</h2>", _image(bars.diverging([("", found.by_system)]), "ratings by system"),
                  _table(found.by_system), "<h2>By scenario</h2>",
                  _image(bars.diverging(found.by_scenario), "ratings by scenario")]  # fmt: skip
    parts += ["<h2>Who answered</h2>", _background(found)]
    title = f"Study {escape(found.study.id)}"
    head = (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
            f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n<body>\n')  # fmt: skip
    return head + "\n".join(parts) + "\n</body></html>\n"


def p_text(p: float) -> str:
    """A p as it is told: "p = 0.0391", "p < 0.0001", "p cannot be had"."""
    if not math.isfinite(p):
        return "p cannot be had"
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"


def _sentence(one: Finding, pairs: bool) -> str:
    new, old = escape(one.new), escape(one.old)
    if not math.isfinite(one.p):
        return f"<p>Whether {new} looks more natural than {old} cannot be tested: too few raters, or all alike.</p>"
    unit = "" if pairs else " points"
    told = (f"{one.mean:+.2f}{unit} (95 %: {one.low:+.2f} to {one.high:+.2f}), t({one.degrees}) = {one.t:.2f}, "
            f"one-sided {p_text(one.holm_p)}")  # fmt: skip
    if one.better:
        return f"<p><span class=met>{new} looks more natural than {old}</span>: {told}.</p>"
    return f"<p>That {new} looks more natural than {old} is not shown: {told}.</p>"


def _findings(found: Analysis) -> str:
    head = "".join(f"<th class=n>{title}" for _, title, _ in _COLUMNS)
    rows = [
        f"<tr><td>{escape(one.new)} over {escape(one.old)}<td class=n>{len(one.differences)}"
        + "".join(_cell(getattr(one, key), digits) for key, _, digits in _COLUMNS)
        for one in found.findings
    ]
    told = (f"Difference: mean over raters, with its 95 % interval. p: one-sided paired t-test by rater; Holm: for all "
            f"hypotheses together, at {ALPHA:g}. Wilcoxon: the same by ranks. Pooled: all answers as if each had "
            "a rater of its own (Faustino §5.1.2). d: Cohen's, of raters' differences. delta: Cliff's.")  # fmt: skip
    table = f"<table><tr><th>hypothesis<th class=n>raters{head}{''.join(rows)}</table>"
    return f"<div class=scroll>{table}</div><p class=quiet>{told}</p>"


def _table(rows: tuple[Shares, ...]) -> str:
    head = "".join(f"<th class=n>{escape(text)}" for text in SCALE)
    lines = [f"<tr><td>{escape(row.name)}" + "".join(f"<td class=n>{int(count)}" for count in row.counts)
             + _cell(row.mean, 2) + _cell(row.sd, 2) for row in rows]  # fmt: skip
    return f"<div class=scroll><table><tr><th>system{head}<th class=n>mean<th class=n>sd{''.join(lines)}</table></div>"


def _background(found: Analysis) -> str:
    parts = []
    for question in BACKGROUND:
        said = Counter(answers.get(question.key, "") for answers in found.answers.background.values())
        rows = [(text, said[key]) for key, text in question.choices] + [("no answer", said[""])]
        cells = "".join(f"<tr><td>{escape(text)}<td class=n>{count}" for text, count in rows if count)
        parts.append(f"<p>{escape(question.text)}</p><table>{cells}</table>")
    return "".join(parts)


def _shares(row: Shares) -> dict:
    return {"name": row.name, "counts": row.counts.tolist(), "mean": row.mean, "sd": row.sd}


def _cell(value: float, digits: int) -> str:
    if not math.isfinite(value):
        return "<td class=n>–"
    return "<td class=n>&lt; 0.0001" if digits == 4 and value < 1e-4 else f"<td class=n>{value:.{digits}f}"


def _image(png: bytes, text: str) -> str:
    return f'<img alt="{escape(text)}" src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'
