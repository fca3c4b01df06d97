"""Diverging stacked bars: good answers to the right of zero, bad ones to the left, undecided ones half on each side
(Robbins and Heiberger 2011; Faustino figs. 15 and 16)."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..evaluation.plots import plain
from .analysis import Finding, Shares
from .questions import SCALE

COLOURS = ("#b5482a", "#e3a587", "#d9d9d9", "#8fb8de", "#2563a8")
_WIDTH, _DPI = 11.0, 100
_NAME: dict[str, Any] = {"fontsize": 9, "parse_math": False}  # a name may have dollars in it


def rows_of(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left edges and widths (5,) in percent of a bar of counts (5,): the middle of the undecided lies at zero."""
    share = 100.0 * np.asarray(counts, float) / max(float(np.sum(counts)), 1.0)
    left = np.concatenate([[0.0], np.cumsum(share)[:-1]])
    return left - (share[:2].sum() + share[2] / 2.0), share


def diverging(groups: Sequence[tuple[str, Sequence[Shares]]]) -> bytes:
    """The picture as a PNG: for each group its title and a bar for each of its rows."""
    from matplotlib.figure import Figure

    lines = sum(len(rows) for _, rows in groups) + 0.6 * len(groups)
    figure = Figure(figsize=(_WIDTH, 1.1 + 0.36 * lines), dpi=_DPI, layout="constrained")
    ax = figure.subplots()
    plain([ax])
    y, ticks, names = 0.0, [], []
    for title, rows in groups:
        if title:
            ax.text(0.0, y, title, transform=ax.get_yaxis_transform(), weight="bold", va="center", **_NAME)
            y += 0.8
        for row in rows:
            _bar(ax, y, row.counts)
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
    ax.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, fontsize=8, frameon=False)
    return _png(figure)


def differences(findings: Sequence[Finding], unit: str) -> bytes:
    """Each rater's difference as a dot, and the mean with its 95 % interval; a row for each finding."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH, 0.9 + 0.55 * len(findings)), dpi=_DPI, layout="constrained")
    ax = figure.subplots()
    plain([ax])
    for row, finding in enumerate(findings):
        spread = row + 0.16 * np.sin(2.4 * np.arange(len(finding.differences)))
        ax.plot(finding.differences, spread, "o", color="#8fb8de", ms=5, alpha=0.8)
        ax.plot([finding.low, finding.high], [row, row], color="#222222", lw=2)
        ax.plot([finding.mean], [row], "D", color="#222222", ms=6)
    ax.axvline(0.0, color="#b5482a", lw=1, ls="--")
    ax.set_yticks(range(len(findings)), [f"{finding.new} - {finding.old}" for finding in findings], **_NAME)
    ax.set_ylim(len(findings) - 0.4, -0.6)
    ax.set_xlabel(unit, fontsize=8)
    return _png(figure)


def _bar(ax, y: float, counts: np.ndarray) -> None:
    for left, share, colour, count in zip(*rows_of(counts), COLOURS, counts):
        ax.barh([y], [share], left=left, color=colour, height=0.72)
        if share >= 4.0:
            dark = colour in (COLOURS[0], COLOURS[-1])
            ax.text(left + share / 2.0, y, str(int(count)), ha="center", va="center", fontsize=8,
                    color="white" if dark else "#222222")  # fmt: skip


def _png(figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()
