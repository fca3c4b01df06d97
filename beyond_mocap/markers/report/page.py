"""The report over a folder of trials as one page for a browser; it loads nothing, and all names are escaped."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...evaluation.html_page import (
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
from . import pictures
from .impacts import aligned_impacts, kept
from .paired import LEAST, Paired, paired
from .results import TrialResult, read_results


def trials_report(folder: Path) -> str:
    """The page, as text: how well markers fit and how long it took, where throws land, how fast they are.

    InputError where the folder holds no reports, or matplotlib is not installed.
    """
    results = read_results(Path(folder))
    made = [result for result in results if not result.error]
    title = Path(folder).resolve().name
    parts = [element("h1", f"{title}: {len(results)} trials")]
    if made:
        parts.append(_section("Markers and time", _fit_text(made), pictures.residuals_and_time(results),
                              pictures.residuals_by_trial(results)))
    return build_page(title, *parts, *_throws(made), build_section("All trials", _table(results)))


def _fit_text(made: Sequence[TrialResult]) -> Html:
    residual, single = (_mean([getattr(r, name) for r in made]) for name in ("residual", "single"))
    rate = _mean([r.rate for r in made])
    return element("p", f"Residuals {residual:.1f} mm (segments alone {single:.1f} mm), {rate:.0f} frames a second on "
                   "the whole. Bars end one standard deviation up and down.")  # fmt: skip


def _throws(made: Sequence[TrialResult]) -> list[Html]:
    """What there is to say of throws; nothing where none was found."""
    thrown = [result for result in made if result.throw is not None]
    if not thrown:
        return []
    parts = []
    points = aligned_impacts(thrown)
    near = kept(points)
    if near.any():
        said = f"{int(near.sum())} of {len(thrown)} throws; those beyond three standard deviations are left out."
        parts.append(_section("Where throws land", element("p", said), pictures.impact_map(points[near]),
                              pictures.impact_scatter(thrown, points)))
    pairs = [(r.throw.radar, r.throw.speed) for r in thrown if r.throw.radar]
    if pairs:
        measured, estimated = np.array(pairs, float).T
        said = _paired_text(paired(estimated, measured))
        parts.append(_section("How fast they are", said, pictures.speeds(measured, estimated)))
    return parts


def _paired_text(found: Paired) -> Html:
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
    return fragment(*(element("p", line) for line in lines))


def _table(results: Sequence[TrialResult]) -> Html:
    titles = ("trial", "subject", build_title("frames"), build_title("residual, mm"), build_title("frames/s"), "hand",
              build_title("speed, m/s"), build_title("radar"), "")  # fmt: skip
    return build_table(titles, map(_row, results))


def _row(result: TrialResult) -> Html:
    side, speed, radar = (result.throw.side, result.throw.speed, result.throw.radar) if result.throw else ("", None, 0)
    return build_row(
        result.name, result.subject, build_number_cell(result.frames or None), build_number_cell(result.residual, 1),
        build_number_cell(result.rate), side, build_number_cell(speed, 1), build_number_cell(radar or None, 1),
        element("td", result.error, class_="missed"),
    )  # fmt: skip


def _section(title: str, body: Html, *images: bytes) -> Html:
    return build_section(title, body, *(build_image(png, title) for png in images))


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")
