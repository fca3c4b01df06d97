"""One line about a take's quality, from the lines of figures, key moments and warnings that the player keeps.

The rule, which docs/reference/panel-guide.md tells in full:

- Poor: a key moment is missed, or one of ESSENTIAL is as far from its target as stands there (events a minute by two
  events or more), or more than half of all targets are missed
- Good: all of ESSENTIAL meet their targets, and so do at least nine of ten figures
- Fair: everything between
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

FAR = 1.5  # times its target, from where on a missed figure is poor
ESSENTIAL = {  # figures that one sees at once -> value from which a take is poor; None: FAR times the target
    "Distance to track": None, "Distance, 95 %": None, "Foot slide": None, "Slide per step": None,
    "Lowest point": None, "Feet out of reach": 5.0, "Rough transitions": 50.0, "Worst transition": 4.0,
    "Unusual poses": 50.0, "Second strikes": 2.0, "Ball inside the body": 10.0,
    "Spins not asked for": 3.0, "Snap turns": 10.0, "Pelvis drops": 10.0, "Jolts": 15.0,  # one in 20 s is 3 a minute
}  # fmt: skip
# Events from which on a rate makes a take poor. One in 4 s is 15 a minute, but at a rate of 3 a minute one in five
# takes of 4 s has one (Poisson): it is no measure of a rate.
LEAST_EVENTS = 2
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
        figures: lines "name: value", target, status, and the number of events where the value counts them a minute.
        moments: lines text, seconds, status.
        warnings: lines text, seconds.
    Returns:
        The verdict.
    """
    rows = [_split_columns(line, 4) for line in figures.splitlines()]
    judged = [row for row in rows if row[2]]
    missed = [row for row in judged if row[2] == "missed"]
    essential = [row for row in missed if row[0].partition(": ")[0] in ESSENTIAL]
    late = [row for row in (_split_columns(line, 3) for line in moments.splitlines()) if row[2] == "missed"]
    timed = [row for row in (_split_columns(line, 3) for line in warnings.splitlines()) if row[1]]
    share = len(missed) / max(len(judged), 1)
    if late or share > POOR_SHARE or any(_is_far(*row) for row in essential):
        word = "Poor"
    else:
        word = "Fair" if essential or share > GOOD_SHARE else "Good"
    places = (*((text, seconds, True) for text, seconds, _ in late),
              *((text, seconds, False) for text, seconds, _ in timed))
    return Verdict(word if judged else "", places, len(judged) - len(missed), len(judged))


def _split_columns(line: str, count: int) -> tuple[str, ...]:
    """Split a line into its first columns, "" for those that it lacks."""
    return (*line.split("\t"), *count * [""])[:count]


def _is_far(name: str, target: str, _status: str, events: str) -> bool:
    """Return whether a figure of ESSENTIAL that misses its target is so far from it that the take is poor."""
    title, _, text = name.partition(": ")
    value, limit = (re.search(r"-?\d+(?:\.\d+)?", part) for part in (text, target))
    if value is None or limit is None:
        return False
    if events and int(events) < LEAST_EVENTS:
        return False
    poor_from, most = ESSENTIAL[title], float(limit[0])
    if poor_from is not None:
        return float(value[0]) >= poor_from
    return most != 0.0 and float(value[0]) / most >= FAR  # zero is no measure
