"""Tables 8.1 to 8.8 of Fredriksson §8.3 with our figures beside his, as lines of Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from . import fredriksson
from .compare import NORMALITY, Comparison, detectable
from .subjects import EFFECTOR_NAMES, Subjects, comparisons

_COLUMNS = [f"{name} (m)" for name in (*EFFECTOR_NAMES, "impact")]


def figure_table(ours: Subjects, his: Subjects | None = None) -> list[str]:
    """As tables 8.1, 8.2, 8.5, 8.6: a row for each subject a model was trained on, then means; his rows below ours."""
    lines = _head(["trained on", *_COLUMNS, "impacts left out", "bodies lost"])
    for row, subject in enumerate(ours.subjects):
        gone = f"{ours.culled[row]} of {ours.motions[row]}" if np.isfinite(ours.impact[row]) else ""
        lines.append(_row([subject, *_numbers(ours.figures[row]), gone, f"{ours.lost[row]} of {ours.motions[row]}"]))
    lines.append(_row(["**mean**", *_numbers(np.array([_mean(column) for column in ours.figures.T])), "", ""]))
    if his is not None:
        for row, subject in enumerate(his.subjects):
            lines.append(_row([f"his {subject}", *_numbers(his.figures[row]), "", ""]))
        lines.append(_row(["**his mean**", *_numbers(his.figures.mean(axis=0)), "", ""]))
    return lines


def test_table(new: Subjects, old: Subjects, his: fredriksson.Printed | None = None) -> list[str]:
    """As tables 8.3 and 8.4, 8.7 and 8.8: differences new - old, subject by subject, and the tests below them."""
    found = comparisons(new, old)
    both = [name for name in new.subjects if name in old.subjects]
    lines = _head(["trained on", *_COLUMNS])
    for subject in both:
        lines.append(_row([subject, *map(_signed, _row_of(new, subject) - _row_of(old, subject))]))
    lines += [
        _row(["avg.", *[_signed(one.mean) for one in found]]),
        _row(["stdev.", *_numbers([one.spread for one in found])]),
        _row(["Shapiro-Wilk p", *[_p(one.normal) for one in found]]), _row(["p", *[_told(one) for one in found]]),
        _row(["would be seen", *_numbers([_seen(one) for one in found])]),
    ]  # fmt: skip
    if his is not None:
        lines += [_row(["his avg.", *[_signed(v) for v in his.mean]]), _row(["his stdev.", *_numbers(his.spread)]),
                  _row(["his p", *[_p(v) for v in his.p]])]
    return lines


def verdicts(new: Subjects, old: Subjects) -> list[str]:
    """In words: for which of the five the new way is better by the test, and which test counted."""
    names = (*EFFECTOR_NAMES, "impact")
    found = [(name, one) for name, one in zip(names, comparisons(new, old), strict=True) if len(one.differences)]
    better = [f"{name} (p {_p(one.p)})" for name, one in found if one.rejected]
    ranks = [name for name, one in found if one.normal < NORMALITY]
    lines = [f"{new.name} against {old.name}: better at 0.025 in {', '.join(better) or 'none'}"]
    if ranks:
        lines.append(f"normality is rejected for {', '.join(ranks)}: signed ranks, whose p is at least "
                     f"{max(one.least_p for _, one in found):.4f} with so few subjects")
    return lines


def _row_of(way: Subjects, subject: str) -> np.ndarray:
    """(5,) m."""
    return way.figures[way.subjects.index(subject)]


def _told(one: Comparison) -> str:
    said = _p(one.p)
    said = f"**{said}**" if one.rejected else said
    return f"{said} (ranks)" if one.test == "Wilcoxon" and len(one.differences) else said


def _seen(one: Comparison) -> float:
    """The mean difference that nine of ten such tests would see, by Student's; NaN of fewer than three pairs."""
    count = len(one.differences)
    return detectable(count, one.spread * (count / (count - 1)) ** 0.5)[1] if count > 2 else np.nan


def _mean(values: Sequence[float]) -> float:
    known = np.asarray(values)[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


def _numbers(values: Sequence[float]) -> list[str]:
    return ["-" if not np.isfinite(value) else f"{value:.4f}" if value < 1.0 else f"{value:.3f}" for value in values]


def _signed(value: float) -> str:
    return f"{value:+.4f}" if np.isfinite(value) else "-"


def _p(value: float) -> str:
    return "-" if not np.isfinite(value) else f"{value:.4f}" if value >= 0.00005 else "< 0.0001"


def _head(names: Sequence[str]) -> list[str]:
    return [_row(names), "|" + "---|" * len(names)]


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
