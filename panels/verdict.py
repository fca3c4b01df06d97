"""One line about a take's quality, from the lines of figures, key moments and warnings that the player keeps.

The rule, which docs/reference/panel-guide.md tells in full:

- Poor: a key moment is missed, or one of ESSENTIAL is beyond its target by half or more, or more than half of all
  targets are missed
- Good: all of ESSENTIAL meet their targets, and so do at least nine of ten figures
- Fair: everything between
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

ESSENTIAL = ("Distance to track", "Distance, 95 %", "Foot slide", "Slide per step", "Feet out of reach",
             "Lowest point", "Spins not asked for", "Second strikes", "Ball inside the body")  # seen at once
FAR = 1.5  # times its target, from where on a missed figure is poor
GOOD_SHARE, POOR_SHARE = 0.1, 0.5  # of the targets are missed: at most, more than


class Verdict(NamedTuple):
    """A verdict on a take.

    Attributes:
        word: "Good", "Fair" or "Poor"; "" without figures that have a target.
        places: (text, seconds, whether a key moment) of what to look at; seconds as `jump_to` reads them.
        met: number of figures that meet their target.
        judged: number of figures that have a target.
    """

    word: str
    places: tuple[tuple[str, str, bool], ...]
    met: int
    judged: int

    @property
    def line(self) -> str:
        """The verdict as one line; "" without figures."""
        count = len(self.places)
        more = f". {count} {'place' if count == 1 else 'places'} to look at" if count else ""
        return f"{self.word}{more}" if self.word else ""


@lru_cache(maxsize=64)
def judge_take(figures: str, moments: str, warnings: str) -> Verdict:
    """Judge a take; cached, since panels ask at every redraw.

    Args:
        figures: lines "name: value", target, status.
        moments: lines text, seconds, status.
        warnings: lines text, seconds.
    Returns:
        The verdict.
    """
    rows = [_split_columns(line) for line in figures.splitlines()]
    judged = [row for row in rows if row[2]]
    missed = [row for row in judged if row[2] == "missed"]
    essential = [row for row in missed if row[0].partition(": ")[0] in ESSENTIAL]
    late = [row for row in map(_split_columns, moments.splitlines()) if row[2] == "missed"]
    timed = [row for row in map(_split_columns, warnings.splitlines()) if row[1]]
    share = len(missed) / max(len(judged), 1)
    if late or share > POOR_SHARE or any(_is_far(name, target) for name, target, _ in essential):
        word = "Poor"
    else:
        word = "Fair" if essential or share > GOOD_SHARE else "Good"
    places = (*((text, seconds, True) for text, seconds, _ in late),
              *((text, seconds, False) for text, seconds, _ in timed))
    return Verdict(word if judged else "", places, len(judged) - len(missed), len(judged))


def _split_columns(line: str) -> tuple[str, str, str]:
    first, second, third = (*line.split("\t"), "", "")[:3]
    return first, second, third


def _is_far(name: str, target: str) -> bool:
    """Return whether a figure is beyond its one limit by half of it or more; a limit of zero is no measure."""
    value, limit = (re.search(r"-?\d+(?:\.\d+)?", text) for text in (name.partition(": ")[2], target))
    if value is None or limit is None or not float(limit[0]):
        return False
    return float(value[0]) / float(limit[0]) >= FAR
