"""Every figure of a report as text: its value, what the recordings score, its target, and whether that is met."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from ..synthesis.quality.targets import target_of
from .report import flat


class Row(NamedTuple):
    """One figure as text: `own` is the recordings' score, status "met", "missed" or ""."""

    name: str
    value: str
    own: str
    target: str
    status: str


def judged(report: Mapping) -> Iterator[Row]:
    """Every figure of a report (`evaluate`) that is known or has a target."""
    table = flat(report)
    fps = float(report.get("fps") or 30.0)
    for name, value in table.items():
        group, _, leaf = name.rpartition(".")
        target = target_of(name, fps)
        if leaf.startswith("source_") or leaf == "own" or (value is None and target is None):
            continue
        own = table.get(f"{group}.source_{leaf}", table.get(f"{group}.own") if leaf == "mean" else None)
        known = isinstance(value, (int, float))
        met = target.met(value, table) if target and known else None
        status = "" if met is None else ("met" if met else "missed")
        aim = target.text(table) if target else ""
        yield Row(name, _shown(value), "" if own is None else _shown(own), aim, status)


def _shown(value) -> str:
    if value is None:
        return "–"
    if isinstance(value, list):
        return " ".join(map(str, value)) or "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
