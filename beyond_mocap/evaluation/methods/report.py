"""A comparison of methods as a page with the curves of Appendix D, and as values for JSON."""

from __future__ import annotations

from collections.abc import Mapping

from ..html_page import (
    Html,
    build_element,
    build_image,
    build_list,
    build_page,
    build_row,
    build_section,
    build_table,
    join_html,
)
from ..plots import MIDDLE, RIGHT, create_canvas, render_png
from ..report import round_values
from .comparison import MethodComparison, MethodResult
from .scenarios import Scenario
from .tables import (
    ComparisonTable,
    build_tables,
    describe_differences,
    describe_handicaps,
    list_sections,
    list_warnings,
)

_ROW = 1.15
"""Inches of height of a method's curve."""


def build_comparison_page(comparison: MethodComparison) -> str:
    """Build the page of a comparison; it needs matplotlib.

    Args:
        comparison: the methods' results.
    Returns:
        The HTML document.
    """
    curves = (join_html(build_element("h3", scenario.name), build_image(
        draw_smoothness(comparison, scenario), f"smoothness of {scenario.name} by method")) for scenario in
        comparison.scenarios)  # fmt: skip
    return build_page(
        "Methods compared", build_element("h1", "Methods compared"),
        build_element("p", f"{comparison.library}: {comparison.clips} clips, {comparison.minutes:.1f} minutes"),
        *map(_build_section, build_tables(comparison)),
        *(build_section(title, build_list(map(_remove_ticks, lines))) for title, lines in list_sections(comparison)),
        build_section("Curves of Appendix D", build_element("p", "Distance of the features of consecutive frames, cm; "
                      "all curves of a scenario have one scale. Dotted: key moments. Only the peaks count."), *curves),
    )  # fmt: skip


def _remove_ticks(line: str) -> str:
    """Remove the marks of Markdown around names."""
    return line.replace("`", "")


def _build_section(table: ComparisonTable) -> Html:
    """Build a table with its title and note."""
    return build_section(table.title, build_element("p", _remove_ticks(table.note)),
                         build_table(table.head, [build_row(*row) for row in table.rows]))


def draw_smoothness(comparison: MethodComparison, scenario: Scenario) -> bytes:
    """Draw the smoothness of a scenario, one method below the other with one scale.

    Args:
        comparison: the methods' results.
        scenario: one of its scenarios.
    Returns:
        A PNG.
    Source: Faustino 2016, Appendix D.
    """
    methods = comparison.methods
    canvas, axes = create_canvas(_ROW * len(methods) + 0.4, len(methods), sharex=True, sharey=True)
    results = [comparison.results[scenario.name, method] for method in methods]
    top = max(float(result.smoothness.max(initial=0.01)) for result in results)
    for ax, method, result in zip(axes, methods, results):
        ax.plot(result.times, 100.0 * result.smoothness, color=MIDDLE, lw=0.9)
        for key in result.take.keys:
            ax.axvline(key.requested.resolved_time, color=RIGHT, lw=0.9, ls=":", zorder=0)
        ax.set_title(method, loc="left", fontsize=9)
        ax.set_ylim(0.0, 105.0 * top)
    axes[-1].set_xlabel("seconds on the track's clock", fontsize=8)
    return render_png(canvas)


def build_comparison_report(comparison: MethodComparison) -> Mapping:
    """Build the values of a comparison for JSON.

    Args:
        comparison: the methods' results.
    """
    takes = {scenario.name: {method: _build_result_values(comparison.results[scenario.name, method])
                             for method in comparison.methods} for scenario in comparison.scenarios}
    return round_values({
        "library": comparison.library, "clips": comparison.clips, "minutes": comparison.minutes,
        "methods": list(comparison.methods),
        "thesis": {scenario.name: vars(scenario.thesis) for scenario in comparison.scenarios if scenario.thesis},
        "differences": describe_differences(comparison), "handicaps": describe_handicaps(comparison),
        "notes": list(comparison.notes),
        "takes": takes,
    })  # fmt: skip


def _build_result_values(result: MethodResult) -> dict:
    """Build the values of one take."""
    return {**result.figures, "seconds": result.seconds, "smoothness_times_s": result.times.tolist(),
            "smoothness_m": result.smoothness.tolist(), "warnings": list_warnings(result)}
