"""The table of experiments: what each row reached, how it does on other people, and what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_ABOUT = (
    "Distances of hands and feet from their targets are in centimetres: left hand, right hand, left foot, right foot.",
    "*Alone*: the networks' own prediction is fed back and nothing corrects it. *Lost*: a hand or foot is more than",
    "0.5 m off on average, or no body comes out; lost bodies are in no other figure. *Beyond limits*: share of",
    "rotations beyond the joint limits of the training, networks alone. *Heads*: angle between true and generated",
    "heads, networks alone. *Hours* are clock time of training.",
)


@dataclass(frozen=True)
class RowResult:
    """What was reached of a row.

    Attributes:
        title: what it is.
        planned: epochs of the whole row.
        reached: epochs of its checkpoint; None before the first one.
        report: its report with the figures, or None before the first test.
    """

    title: str
    planned: int
    reached: int | None
    report: dict | None

    @property
    def is_complete(self) -> bool:
        """Whether all epochs are trained and tested."""
        return self.report is not None and self.report["epochs"] == self.planned

    def describe_missing(self) -> str:
        """Describe what is missing, one line; empty if nothing is."""
        if self.is_complete:
            return ""
        if self.reached is None:
            return f"{self.title}: not begun"
        tested = "not tested yet" if self.report is None else f"tested after {self.report['epochs']}"
        return f"{self.title}: reached {self.reached} of {self.planned} epochs, {tested}"


def build_table(results: Sequence[RowResult], tests: Sequence[str]) -> str:
    """Build the page in Markdown.

    Args:
        results: results of all rows.
        tests: names of the tests.
    """
    tested = [one for one in results if one.report is not None]
    lines = ["# Experiments with networks", "", *_ABOUT, ""]
    lines += _build_rows("Training", ("row", "epochs", "hours", "loss"), [_describe_training(one) for one in tested])
    for test in tests:
        head = ("row", "epochs", "alone, cm", "lost", "corrected, cm", "lost", "beyond limits", "heads")
        lines += ["", *_build_rows(f"Tested on {test}", head, [_describe_test(one, test) for one in tested])]
    missing = [line for one in results if (line := one.describe_missing())]
    return "\n".join([*lines, "", "## What is missing", "", *[f"- {line}" for line in missing or ["nothing"]], ""])


def _build_rows(heading: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Build a heading and a table; a line where there is no row yet."""
    if not rows:
        return [f"## {heading}", "", "No row is tested yet."]
    return [f"## {heading}", "", *[f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]]


def _describe_training(one: RowResult) -> list[str]:
    """Describe how far a row came."""
    losses, hours = one.report["losses"], one.report["seconds"] / 3600.0
    return [one.title, _format_epochs(one), f"{hours:.2f}", f"{losses[-1]:.2f}" if losses else "-"]


def _describe_test(one: RowResult, test: str) -> list[str]:
    """Describe how a row does on other people."""
    alone, corrected = (one.report["tests"][test][name] for name in ("alone", "corrected"))
    return [one.title, _format_epochs(one), _format_distances(alone["network_deviation_m"]), _format_lost(alone),
            _format_distances(corrected["deviation_m"]), _format_lost(corrected),
            _format_number(alone["beyond"], 100.0, " %"), _format_number(alone["head"], 1.0, "°")]


def _format_epochs(one: RowResult) -> str:
    return f"{one.report['epochs']} of {one.planned}"


def _format_lost(report: dict) -> str:
    """Format how many bodies are lost."""
    valid = report["motions"] - report["lost"]
    return f"{report['requested'] - valid} of {report['requested']}"


def _format_distances(distances: dict) -> str:
    """Format distances in centimetres; "-" if there is none."""
    return " ".join(_format_number(one, 100.0, "") for one in distances.values())


def _format_number(value: float | None, factor: float, unit: str) -> str:
    return "-" if value is None else f"{factor * value:.1f}{unit}"
