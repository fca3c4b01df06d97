"""Tables as Markdown text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def head(names: Sequence[str]) -> list[str]:
    """The two lines that begin a table."""
    return [row(names), "|" + "---|" * len(names)]


def row(cells: Iterable[str]) -> str:
    """One line of a table."""
    return f"| {' | '.join(cells)} |"
