"""The report over a folder of trials as one page for a browser; it loads nothing, and all names are escaped."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from . import pictures
from .impacts import aligned_impacts, kept
from .paired import LEAST, Paired, paired
from .results import TrialResult, read_results

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1120px; margin: 1.5em auto;
  padding: 0 1em }
h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin: 1.6em 0 .4em } p { margin: .3em 0 } .quiet { color: #666 }
img { max-width: 100%; height: auto; display: block } table { border-collapse: collapse; font-size: 14px }
tr { border-bottom: 1px solid #eee } th, td { padding: .18em .9em .18em 0; text-align: left; vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums } .scroll { overflow-x: auto }
.bad { color: #b3261e }
"""


def trials_report(folder: Path) -> str:
    """The page, as text: how well markers fit and how long it took, where throws land, how fast they are.

    InputError where the folder holds no reports, or matplotlib is not installed.
    """
    results = read_results(Path(folder))
    made = [result for result in results if not result.error]
    parts = [f"<h1>{escape(Path(folder).resolve().name)}: {len(results)} trials</h1>"]
    if made:
        parts.append(_section("Markers and time", _fit_text(made), pictures.residuals_and_time(results),
                              pictures.residuals_by_trial(results)))
    parts += _throws(made)
    parts.append(_section("All trials", _table(results)))
    title = escape(Path(folder).resolve().name)
    head = f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style>'
    return head + "\n".join(parts) + "</html>\n"


def _fit_text(made: Sequence[TrialResult]) -> str:
    residual, single = (_mean([getattr(r, name) for r in made]) for name in ("residual", "single"))
    rate = _mean([r.rate for r in made])
    return (f"<p>Residuals {residual:.1f} mm (segments alone {single:.1f} mm), {rate:.0f} frames a second on the "
            "whole. Bars end one standard deviation up and down.</p>")


def _throws(made: Sequence[TrialResult]) -> list[str]:
    """What there is to say of throws; nothing where none was found."""
    thrown = [result for result in made if result.throw is not None]
    if not thrown:
        return []
    parts = []
    points = aligned_impacts(thrown)
    near = kept(points)
    if near.any():
        said = f"<p>{int(near.sum())} of {len(thrown)} throws; those beyond three standard deviations are left out.</p>"
        parts.append(_section("Where throws land", said, pictures.impact_map(points[near]),
                              pictures.impact_scatter(thrown, points)))
    pairs = [(r.throw.radar, r.throw.speed) for r in thrown if r.throw.radar]
    if pairs:
        measured, estimated = np.array(pairs, float).T
        said = _paired_text(paired(estimated, measured))
        parts.append(_section("How fast they are", said, pictures.speeds(measured, estimated)))
    return parts


def _paired_text(found: Paired) -> str:
    many = "throws" if found.count != 1 else "throw"
    lines = [f"{found.count} {many} with a measured speed: estimated - measured {found.mean:+.2f} m/s"
             + (f" (standard deviation {found.sd:.2f})" if np.isfinite(found.sd) else "")
             + f", {100 * found.share:.1f} % off on average, {100 * found.within:.0f} % of them within 10 %."]
    if np.isfinite(found.normal):
        lines.append(f"Normality of the differences (Shapiro-Wilk): p = {found.normal:.3f}.")
    if np.isfinite(found.wilcoxon):
        lines.append(f"No difference (Wilcoxon, paired, two-sided): p = {found.wilcoxon:.4f}.")
    else:
        lines.append(f"Too few or too equal for the paired test, which needs {LEAST} throws.")
    return "".join(f"<p>{line}</p>" for line in lines)


def _table(results: Sequence[TrialResult]) -> str:
    head = ("<tr><th>trial<th>subject<th class=n>frames<th class=n>residual, mm<th class=n>frames/s<th>hand"
            "<th class=n>speed, m/s<th class=n>radar<th>")
    return f"<div class=scroll><table>{head}\n" + "\n".join(_row(result) for result in results) + "</table></div>"


def _row(result: TrialResult) -> str:
    throw = result.throw
    cells = [
        f"<td>{escape(result.name)}<td>{escape(result.subject)}", _cell(result.frames or np.nan, 0),
        _cell(result.residual, 1), _cell(result.rate, 0), f"<td>{escape(throw.side) if throw else ''}",
        _cell(throw.speed if throw else np.nan, 1), _cell(throw.radar if throw and throw.radar else np.nan, 1),
        f"<td class=bad>{escape(result.error)}" if result.error else "<td>",
    ]  # fmt: skip
    return "<tr>" + "".join(cells) + "</tr>"


def _cell(value: float, digits: int) -> str:
    return f"<td class=n>{value:.{digits}f}" if np.isfinite(value) else "<td class=n>–"


def _section(title: str, body: str, *images: bytes) -> str:
    drawn = [f'<img alt="{escape(title)}" src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'
             for png in images]
    return f"<h2>{escape(title)}</h2>\n{body}\n" + "\n".join(drawn)


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")
