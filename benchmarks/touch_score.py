"""How well touches were found: against touches that a person read, against events, against planted ones.

A found touch is right within a tolerance in time of a read one of the same player; each serves once. What the reader
could not tell counts neither way. Event files have a clock of their own: one offset for the whole file is taken out
first, the one that makes most of them right.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from beyond_mocap.base.errors import InputError

TOLERANCE = 0.1
"""Seconds; a sample of a 10 Hz feed may lie so far from the true kick."""

_COLUMNS = ("match", "row", "time_s", "until_s", "player", "part", "word", "note")


@dataclass(frozen=True)
class ReadTouch:
    """A touch as it was read: time s; players who may have made it, any where empty; until s: some moment up to then,
    or as many as there are (then it is no touch but a doubt). part, word: where they were read."""

    time: float
    players: tuple[str, ...] = ()
    until: float | None = None
    part: str = ""
    word: str = ""


@dataclass(frozen=True)
class Reading:
    """What was read: stretches ((start, end) s), the touches in them, and doubts: spans in which touches of these
    players count neither way."""

    stretches: tuple[tuple[float, float], ...]
    touches: tuple[ReadTouch, ...]
    doubts: tuple[ReadTouch, ...] = ()

    @property
    def seconds(self) -> float:
        """Of all stretches."""
        return sum(end - start for start, end in self.stretches)


@dataclass(frozen=True)
class Score:
    """right: pairs (index of the read touch, of the found one). missed: read ones without. false: found ones that are
    no touch. doubtful: found ones that nobody can judge. errors: (len(right),) s, found minus read. offset: s taken
    from the found times before."""

    right: tuple[tuple[int, int], ...]
    missed: tuple[int, ...]
    false: tuple[int, ...]
    doubtful: tuple[int, ...]
    errors: np.ndarray
    offset: float = 0.0

    @property
    def precision(self) -> float:
        """Share of the found touches that are right."""
        return len(self.right) / max(len(self.right) + len(self.false), 1)

    @property
    def recall(self) -> float:
        """Share of the read touches that were found."""
        return len(self.right) / max(len(self.right) + len(self.missed), 1)

    @property
    def f1(self) -> float:
        """Their harmonic mean."""
        both = self.precision + self.recall
        return 2.0 * self.precision * self.recall / both if both else 0.0


def scored(
    times: Sequence[float], players: Sequence[str], reading: Reading, tolerance: float = TOLERANCE, offset: float = 0.0
) -> Score:
    """Found touches (times s, players) against a reading. Those outside its stretches are left out."""
    times = np.asarray(times, float) - offset
    inside = [i for i in np.argsort(times, kind="stable") if _within(times[i], reading.stretches)]
    right = _pairs(times, players, inside, reading.touches, tolerance)
    found = {i for _, i in right}
    rest = [i for i in inside if i not in found]
    doubtful = [i for i in rest if any(_covers(doubt, times[i], players[i], tolerance) for doubt in reading.doubts)]
    read = {i for i, _ in right}
    return Score(
        tuple(right), tuple(i for i in range(len(reading.touches)) if i not in read),
        tuple(int(i) for i in rest if i not in doubtful), tuple(int(i) for i in doubtful),
        np.array([times[found] - reading.touches[read].time for read, found in right]), offset,
    )  # fmt: skip


def scored_by_events(
    times: Sequence[float], players: Sequence[str], reading: Reading, tolerance: float = TOLERANCE, most: float = 4.0
) -> Score:
    """`scored` with the one offset, up to `most` seconds either way, that gives the greatest F1."""
    coarse = np.arange(-most, most + 1e-9, tolerance / 2.0)
    best = max(coarse, key=lambda offset: _roughly(times, players, reading, tolerance, offset))
    fine = best + np.arange(-tolerance / 2.0, tolerance / 2.0 + 1e-9, 0.01)
    scores = [scored(times, players, reading, tolerance, float(offset)) for offset in fine]
    most_right = max(score.f1 for score in scores)
    best = [score for score in scores if score.f1 == most_right]
    return best[len(best) // 2]


def read_touches(path: str | os.PathLike, match: str) -> Reading:
    """The reading of one match from a CSV of match,row,time_s,until_s,player,part,word,note.

    row: "stretch", "touch" or "unsure" (a doubt). player: one id, or several with | between where one of them it was.
    InputError for other columns or rows, and a match that is not in it.
    """
    with open(path, newline="", encoding="utf-8") as file:
        rows = csv.DictReader(file)
        if tuple(rows.fieldnames or ()) != _COLUMNS:
            raise InputError(path, f"columns {rows.fieldnames}", ",".join(_COLUMNS))
        kinds: dict[str, list[ReadTouch]] = {"stretch": [], "touch": [], "unsure": []}
        for row in rows:
            if row["match"] != match:
                continue
            if row["row"] not in kinds:
                raise InputError(path, f"row {row['row']!r} at {row['time_s']}", f"one of {', '.join(kinds)}")
            kinds[row["row"]].append(_read(row))
    if not kinds["stretch"]:
        raise InputError(path, f"no stretch of {match!r}", "one that was read")
    stretches = tuple((row.time, row.until) for row in kinds["stretch"])
    return Reading(stretches, tuple(kinds["touch"]), tuple(kinds["unsure"]))


def _read(row: dict[str, str]) -> ReadTouch:
    players = tuple(name for name in row["player"].split("|") if name)
    until = float(row["until_s"]) if row["until_s"] else None
    return ReadTouch(float(row["time_s"]), players, until, row["part"], row["word"])


def _within(time: float, stretches) -> bool:
    return any(start <= time <= end for start, end in stretches)


def _covers(doubt: ReadTouch, time: float, player: str, tolerance: float) -> bool:
    end = doubt.time if doubt.until is None else doubt.until
    return doubt.time - tolerance <= time <= end + tolerance and (not doubt.players or player in doubt.players)


def _pairs(times, players, inside, touches, tolerance: float) -> list[tuple[int, int]]:
    """The greatest number of pairs (read, found) that can stand together; among those the nearest in time."""
    from scipy.optimize import linear_sum_assignment

    if not inside or not touches:
        return []
    away = np.abs(times[inside] - np.array([[touch.time] for touch in touches]))
    fits = away <= tolerance + 1e-9
    for row, column in np.argwhere(fits):
        fits[row, column] = not touches[row].players or players[inside[column]] in touches[row].players
    rows, columns = linear_sum_assignment(np.where(fits, away - 1e3, 0.0))
    return [(int(row), int(inside[column])) for row, column in zip(rows, columns) if fits[row, column]]


def _roughly(times, players, reading: Reading, tolerance: float, offset: float) -> float:
    """Right ones at this offset, without each serving once."""
    times = np.asarray(times, float) - offset
    near = [np.flatnonzero(np.abs(times - touch.time) <= tolerance) for touch in reading.touches]
    return sum(
        any(not touch.players or players[i] in touch.players for i in found)
        for touch, found in zip(reading.touches, near)
    )
