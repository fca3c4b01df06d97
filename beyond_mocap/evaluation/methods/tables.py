"""The tables of a comparison of methods, and the lines that say how methods differ: all read off the figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import format_count
from ...synthesis.search.blocks import SEARCH_MORE
from .comparison import NO_CATCH_UP, MethodComparison, MethodResult
from .scenarios import Scenario
from .thesis import ThesisFigures

Read = Callable[[MethodResult], float | None]
THESIS_ROW = "Faustino's thesis"


@dataclass(frozen=True, kw_only=True)
class ComparisonTable:
    """A table with a row for each method and a column for each scenario.

    Attributes:
        title: its title.
        note: what its cells are.
        head: titles of the columns.
        rows: texts of the cells.
    """

    title: str
    note: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, kw_only=True)
class Column:
    """A figure of a cell.

    Attributes:
        read: reads it off a result.
        digits: decimals.
        before: text before it, such as " / ".
        after: text after it.
    """

    read: Read
    digits: int = 2
    before: str = ""
    after: str = ""


def _read_group(group: str, name: str) -> Read:
    """Build a function that reads a figure of a group, None where it is unknown."""
    return lambda result: result.figures[group][name]


OFF_TRACK, OFF_AT_KEYS = _read_group("pelvis_error_m", "mean"), _read_group("pelvis_error_m", "keys")
EQ18, EQ18_AT_KEYS = (_read_group("annotation_similarity", name) for name in ("eq18_all", "eq18_keys"))
REQUESTED, REQUESTED_AT_KEYS = (_read_group("annotation_similarity", name) for name in ("asked", "asked_keys"))
SKATE, STANCE = _read_group("skate", "contact_cm_s"), _read_group("skate", "stance_mm_median")
SLOWEST, FASTEST = _read_group("warp_rate", "min"), _read_group("warp_rate", "max")


def _read_seconds(result: MethodResult) -> float:
    return result.seconds


def _read_level(share: float) -> Read:
    """Build a function that reads a percentile of the smoothness curve, cm."""
    return lambda result: 100.0 * float(np.percentile(result.smoothness, share)) if len(result.smoothness) else None


SMOOTH_P95, SMOOTH_MAX = _read_level(95.0), _read_level(100.0)


def build_tables(comparison: MethodComparison) -> list[ComparisonTable]:
    """Build the tables of a comparison.

    Args:
        comparison: the methods' results.
    """
    at_keys = "whole animation / at the key moments"
    return [
        _build_table(
            comparison, "Distance from the track, m (Table 1)",
            f"Mean, {at_keys}; pelvis and track without any window.",
            [Column(read=OFF_TRACK), Column(read=OFF_AT_KEYS, before=" / ")],
            lambda thesis: "{:.2f} / {:.2f}".format(*thesis.distance)),
        _build_table(
            comparison, "Annotation similarity (Table 2)",
            f"Equation 18 as printed, {at_keys}; in brackets over the labels of the scenario that recordings "
            "carry, without automatic locomotion and what is shown beside them. -1: all are met.",
            [Column(read=EQ18), Column(read=EQ18_AT_KEYS, before=" / "), Column(read=REQUESTED, before=" ("),
             Column(read=REQUESTED_AT_KEYS, before=" / ", after=")")],
            lambda thesis: "{:.2f} / {:.2f}".format(*thesis.similarity)),
        _build_table(
            comparison, "Seconds to synthesize (Table 4)",
            "Processor seconds, the library loaded. The thesis: with foot-skate / with it minimized, to be set beside "
            "`fs` and `distance`.",
            [Column(read=_read_seconds)], lambda thesis: "{:.0f} / {:.0f}".format(*thesis.seconds)),
        _build_table(
            comparison, "Smoothness, cm (Appendix D)",
            "Distance of the features of consecutive frames: 95 % of frames are below / the highest peak.",
            [Column(read=SMOOTH_P95, digits=1), Column(read=SMOOTH_MAX, digits=1, before=" / ")]),
        _build_table(
            comparison, "Feet and playback",
            "Speed of feet in contact, cm/s / median slide of a stance, mm; in brackets the slowest and fastest "
            "playback.",
            [Column(read=SKATE, digits=0), Column(read=STANCE, digits=0, before=" / "),
             Column(read=SLOWEST, before=" ("), Column(read=FASTEST, before=" to ", after=")")]),
    ]  # fmt: skip


def _build_table(comparison: MethodComparison, title: str, note: str, columns: Sequence[Column],
                 format_thesis: Callable[[ThesisFigures], str] | None = None) -> ComparisonTable:
    """Build a table: the thesis' row where a scenario is one of its own, then the methods, each with its mean."""
    scenarios = comparison.scenarios
    rows = [[method, *_format_cells(comparison, method, columns)] for method in comparison.methods]
    if format_thesis is not None and any(scenario.thesis for scenario in scenarios):
        cells = [format_thesis(scenario.thesis) if scenario.thesis else "" for scenario in scenarios]
        rows.insert(0, [THESIS_ROW, *cells, ""])
    return ComparisonTable(title=title, note=note, head=["", *(scenario.name for scenario in scenarios), "mean"],
                           rows=rows)


def _format_cells(comparison: MethodComparison, method: str, columns: Sequence[Column]) -> list[str]:
    """Format the cells of a method's row: one for each scenario, and their mean."""
    values = [comparison.collect(method, column.read) for column in columns]
    values = [np.append(of, np.nanmean(of) if np.isfinite(of).any() else np.nan) for of in values]
    return ["".join(column.before + _format_number(of[place], column.digits) + column.after
                    for column, of in zip(columns, values)) for place in range(len(values[0]))]


def _format_number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "–"


def describe_differences(comparison: MethodComparison) -> list[str]:
    """Describe how the methods differ, by the means of their figures, one line for each figure.

    Args:
        comparison: the methods' results.
    """
    if len(comparison.methods) < 2:
        return []
    rows = (("Distance from the track", OFF_TRACK, "{:.2f} m"), ("Labels of the scenarios", REQUESTED, "{:.2f}"),
            ("Labels at key moments", REQUESTED_AT_KEYS, "{:.2f}"), ("Feet in contact", SKATE, "{:.0f} cm/s"),
            ("Smoothness, 95 % of frames", SMOOTH_P95, "{:.1f} cm"), ("Seconds", _read_seconds, "{:.2f} s"))
    return [line for title, read, form in rows if (line := _describe_order(comparison, title, read, form))]


def _describe_order(comparison: MethodComparison, title: str, read: Read, form: str) -> str:
    """Describe the order of the methods by the mean of a figure, the least first; "" where it is unknown."""
    values = {method: comparison.collect(method, read) for method in comparison.methods}
    means = {method: float(np.nanmean(of)) for method, of in values.items() if np.isfinite(of).any()}
    order = sorted(means, key=lambda method: (means[method], method))
    return f"{title}, least first: {', '.join(f'{one} {form.format(means[one])}' for one in order)}." if order else ""


HANDICAPS = {
    "path": "`path` alone may add synthetic clips where recordings lack a speed or an action, plants the feet and "
            "brings the body to the ball; it plays clips a little faster or slower. Its distance is small by "
            "construction, and labels whose recordings are too slow for the track are not shown. Its automatic "
            "locomotion changes gait where the labels of its clips do, that of the others a quarter of the way between "
            "the gaits' speeds, as in the thesis; equation 18 measures each against its own.",
    "distance": "`distance` keeps the track's length, not its time: it is off where actions lose or gain distance, "
                "plays clips as much faster or slower as it needs to catch up, and its feet are not planted.",
    NO_CATCH_UP: f"`{NO_CATCH_UP}` is `distance` as the thesis measured it: lost distance is never regained.",
    "blocks": "`blocks` goes where its clips lead, so its distance from the track says nothing of its motion.",
    "fs": "`fs` has the clips of `blocks` on the track: it is near the track by construction, and its feet slide.",
    "baseline": "`baseline` shows no actions, so key moments are never met but for their gait; it needs no search.",
}  # fmt: skip
"""Method -> what its figures owe to how it works."""


def describe_handicaps(comparison: MethodComparison) -> list[str]:
    """Describe what handicaps whom: how each method works, where a search was limited, and how the thesis differed.

    Args:
        comparison: the methods' results.
    """
    return [*(HANDICAPS[method] for method in comparison.methods), *_describe_strange(comparison.methods),
            *_describe_limits(comparison), *_describe_thesis(comparison)]


def _describe_strange(methods: Sequence[str]) -> Iterable[str]:
    """Describe which methods play what a library leaves out of locomotion."""
    indifferent = [f"`{method}`" for method in methods if method not in ("path", "baseline")]
    if indifferent:
        yield (f"{', '.join(indifferent)}: motion that the library leaves out of locomotion is played like any other; "
               "`path` avoids it, and `baseline` plays it only in gaits that have nothing else.")


def _describe_limits(comparison: MethodComparison) -> Iterable[str]:
    """Describe for each method in how many takes not all blocks were compared."""
    for method in comparison.methods:
        takes = [comparison.results[scenario.name, method].take for scenario in comparison.scenarios]
        limited = sum(any(SEARCH_MORE in line for line in take.warnings) for take in takes)
        if limited:
            yield (f"`{method}` compared no more than {takes[0].plan.max_blocks} blocks at once in {limited} of "
                   f"{format_count(len(takes), 'take')}: the library has more.")


def _describe_thesis(comparison: MethodComparison) -> Iterable[str]:
    """Describe how the thesis' scenarios and recordings differ from these."""
    known = [scenario for scenario in comparison.scenarios if scenario.thesis]
    if not known:
        return
    lengths = ", ".join(f"{scenario.thesis.duration:g} s there and {_measure_length(scenario):.1f} s here"
                        for scenario in known)
    yield (f"{THESIS_ROW}: other recordings (150 of some 120 frames; here {comparison.clips} of "
           f"{comparison.minutes:.0f} minutes together), another track of a match moment of the same kind ({lengths}), "
           "its own annotations, its own distance without catch-up, and a laptop of 2015 (Intel Core i7-5600U).")


def _measure_length(scenario: Scenario) -> float:
    return float(scenario.track.times[-1] - scenario.track.times[0])


def list_sections(comparison: MethodComparison) -> list[tuple[str, list[str]]]:
    """List the titles and lines that follow the tables; what has no line is left out."""
    found = [("How they differ", describe_differences(comparison)),
             ("What handicaps whom", describe_handicaps(comparison)), ("Scenarios", list(comparison.notes)),
             ("Warnings", _describe_warnings(comparison))]
    return [(title, lines) for title, lines in found if lines]


def list_warnings(result: MethodResult) -> list[str]:
    """List the warnings of a take, without advice on settings that a comparison does not have.

    Args:
        result: what a method made of a scenario.
    """
    return [line.removesuffix(f"; {SEARCH_MORE}") for line in result.take.warnings]


def _describe_warnings(comparison: MethodComparison) -> list[str]:
    """Describe each warning of the takes once, with the takes that have it."""
    takes: dict[str, list[str]] = {}
    for (scenario, method), result in comparison.results.items():
        for line in list_warnings(result):
            takes.setdefault(line, []).append(f"`{method}` in {scenario}")
    return [f"{'all takes' if len(found) == len(comparison.results) else ', '.join(found)}: {line}"
            for line, found in takes.items()]


def format_markdown(comparison: MethodComparison, level: int = 2) -> list[str]:
    """Format a comparison as lines of Markdown, without the curves.

    Args:
        comparison: the methods' results.
        level: of its headings.
    """
    lines = [f"{comparison.clips} clips, {comparison.minutes:.1f} minutes.", ""]
    for table in build_tables(comparison):
        lines += [f"{'#' * level} {table.title}", "", table.note, "", f"| {' | '.join(table.head)} |",
                  "|" + "---|" * len(table.head), *(f"| {' | '.join(row)} |" for row in table.rows), ""]
    for title, found in list_sections(comparison):
        lines += [f"{'#' * level} {title}", "", *(f"- {line}" for line in found), ""]
    return lines
