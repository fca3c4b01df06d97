"""Faustino's printed tables and ours beside them. His scenarios are his own; the comparison is for orientation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from . import markdown

PRINTED = {  # scenarios 1 to 5, "whole animation" and "at frame constraints"
    "distance": ((4.52, 3.42, 3.24, 1.21, 1.86), (1.20, 2.14, 3.50, 3.19, 1.20)),
    "similarity": ((-0.05, -0.54, -0.09, -0.34, -0.25), (-1.0, -0.24, -0.75, -0.44, -0.8)),
    "seconds": ((65, 95, 34, 199, 94), (148, 215, 353, 477, 614)),
}
"""Tables 1 (metres), 2 (eq. 18) and 4 (seconds without and with foot-skate minimized)."""

DURATIONS = (20.0, 22.5, 22.5, 21.0, 19.5)

Reports = Mapping[tuple[str, str], Mapping[int, Mapping]]
"""(library, method) -> scenario -> report."""


def tables(reports: Reports, scenarios: Sequence[int]) -> list[str]:
    """His Tables 1, 2 and 4 with our rows below his."""
    return [
        "### Table 1: distance from the track, metres", "",
        "Mean over the whole animation / at the key moments, pelvis and track without any window. His is without "
        "catch-up.",
        "",
        *_table(scenarios, _pair("distance", "{:.2f}"), reports, _place),
        "### Table 2: annotation similarity", "",
        "Eq. 18 as printed, whole animation / key moments; in brackets over the asked words alone (-1 is all).",
        "",
        *_table(scenarios, _pair("similarity", "{:.2f}"), reports, _similarity),
        "### Table 4: seconds to synthesize", "",
        "His: without / with foot-skate minimized, i7-5600U. `blocks` answers to the first, `distance` to the second.",
        "",
        *_table(scenarios, _pair("seconds", "{:.0f}"), reports, _seconds),
        f"Seconds of motion, his: {', '.join(f'{d:g}' for d in DURATIONS)}; ours: {_durations(reports, scenarios)}.",
        "",
    ]


def _table(scenarios: Sequence[int], his, reports: Reports, ours) -> list[str]:
    lines = markdown.head(["", *(f"scenario {n}" for n in scenarios)])
    lines.append(markdown.row(["**Faustino**", *(his(n) for n in scenarios)]))
    for (library, method), of in reports.items():
        lines.append(markdown.row([f"{library}, {method}", *(ours(of[n]) for n in scenarios)]))
    return [*lines, ""]


def _pair(name: str, form: str):
    first, second = PRINTED[name]

    def of(scenario: int) -> str:
        known = 1 <= scenario <= len(first)
        return f"{form.format(first[scenario - 1])} / {form.format(second[scenario - 1])}" if known else "-"

    return of


def _place(report: Mapping) -> str:
    return f"{_number(report['pelvis_error_m']['mean'])} / {_number(report['pelvis_error_m']['keys'])}"


def _similarity(report: Mapping) -> str:
    told = report["annotation_similarity"]
    printed = f"{_number(told['eq18_all'])} / {_number(told['eq18_keys'])}"
    return f"{printed} ({_number(told['all'])} / {_number(told['keys'])})"


def _seconds(report: Mapping) -> str:
    return _number(report["seconds"]["total"])


def _durations(reports: Reports, scenarios: Sequence[int]) -> str:
    first = next(iter(reports.values()))
    return ", ".join(f"{first[n]['duration_s']:.1f}" for n in scenarios)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
