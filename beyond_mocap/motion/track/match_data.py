"""A tracked match as arrays: who is there and when, the ball, the pitch, and what was found wrong and put right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.time_series import runs
from . import Track

LONGEST_GAP = 3.0
"""Seconds; who is away for longer has left the pitch."""

REFEREE = "referee"


@dataclass(frozen=True)
class Team:
    """ground: "home", "away" or "referee". name: as the feed spells it, "" where it has none. colour: of the shirts,
    "#RRGGBB", "" where the feed has none."""

    ground: str
    name: str = ""
    colour: str = ""


@dataclass(frozen=True)
class MatchPlayer:
    """A player: id as the feed spells it, team ("home", "away", "referee"), name, shirt number (-1 where the feed has
    none), position as a word ("goalkeeper", "left back"; "" where unknown)."""

    id: str
    team: str
    name: str
    number: int
    position: str = ""


@dataclass(frozen=True)
class Half:
    """A period on its provider's clock. number: 1 for the first half, 3 and 4 in extra time. zero: the second of the
    match at which this clock stands at 0, before `start` where the file begins later. start, end: its frames, s."""

    number: int
    zero: float
    start: float
    end: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Match:
    """Everybody's samples, N times and P players, as the feed has them (not cleaned).

    times: (N,) seconds from the first frame of the first period; each later period starts ten seconds after the one
    before. players: P of them. positions: (P, N, 2) metres, NaN where a player is not there. ball: (N, 3) metres, NaN
    where unknown. length, width: of the pitch, metres. fps: the feed's rate. provider: whose form it was. periods:
    (start, end) seconds. notes: what was guessed, for people. teams: home, away, and referees where there are any.
    report: the data report, a line each: what was guessed, what was put right, who is there for how long. passed: for
    each period its number and the seconds that had passed at its first frame, () where they are 1, 2, ... from their
    begin. Arrays are read-only."""

    times: np.ndarray
    players: tuple[MatchPlayer, ...]
    positions: np.ndarray
    ball: np.ndarray
    length: float
    width: float
    fps: float
    provider: str
    periods: tuple[tuple[float, float], ...]
    notes: tuple[str, ...] = ()
    teams: tuple[Team, ...] = ()
    report: tuple[str, ...] = ()
    passed: tuple[tuple[int, float], ...] = ()

    @property
    def halves(self) -> tuple[Half, ...]:
        """The periods with their numbers and clocks."""
        passed = self.passed or tuple((number, 0.0) for number in range(1, len(self.periods) + 1))
        return tuple(
            Half(number, start - before, start, end) for (number, before), (start, end) in zip(passed, self.periods)
        )

    def track(self, player_id: str, start: float | None = None, end: float | None = None) -> Track:
        """One player and the ball between two times (seconds, whole match by default), from when he is first there.

        InputError for an unknown player, or one with fewer than two samples in that time."""
        path = self.positions[self._index(player_id)]
        low = -np.inf if start is None else start - 1e-9
        high = np.inf if end is None else end + 1e-9
        there = np.flatnonzero(np.isfinite(path).all(axis=1) & (self.times >= low) & (self.times <= high))
        if len(there) < 2:
            found = f"{player_id!r} has {len(there)} samples from {start} to {end} s"
            raise InputError("player", found, "at least two")
        part = slice(there[0], there[-1] + 1)
        return Track(self.times[part], path[part], self.ball[part], name=player_id)

    def stretches(self, player_id: str, gap: float = LONGEST_GAP) -> tuple[tuple[float, float], ...]:
        """(start, end) seconds of the stretches in which a player is there, in order, all of more than one sample.

        Gaps of up to `gap` seconds do not end a stretch (`motion.track.clean` fills them), the end of a period does.
        InputError for an unknown player."""
        there = np.isfinite(self.positions[self._index(player_id)]).all(axis=1)
        found = []
        for begins, ends in self.periods:
            inside = np.flatnonzero(there & (self.times >= begins - 1e-9) & (self.times <= ends + 1e-9))
            breaks = np.flatnonzero(np.diff(self.times[inside]) > gap + 1e-9)
            for piece in np.split(inside, breaks + 1):
                if len(piece) > 1:
                    found.append((float(self.times[piece[0]]), float(self.times[piece[-1]])))
        return tuple(found)

    def _index(self, player_id: str) -> int:
        ids = [player.id for player in self.players]
        if player_id not in ids:
            raise InputError("player", f"{player_id!r}", f"one of {', '.join(ids)}")
        return ids.index(player_id)


def presence_lines(match: Match) -> list[str]:
    """A line for everybody who is not there all the time: for how long, and where he is missing."""
    lines = []
    for player, path in zip(match.players, match.positions):
        gone = runs(~np.isfinite(path).all(axis=1))
        short = [(a, b) for a, b in gone if match.times[b - 1] - match.times[a] <= LONGEST_GAP]
        spans = match.stretches(player.id)
        seconds = sum(end - start for start, end in spans)
        whole = [tuple(np.round(period, 6)) for period in match.periods]
        if not short and [tuple(np.round(span, 6)) for span in spans] == whole:
            continue
        where = ", ".join(f"{start:.1f}-{end:.1f}" for start, end in spans[:4]) + ", ..." * (len(spans) > 4)
        gaps = f", {len(short)} short gaps" if short else ""
        lines.append(f"{player.id}: there for {seconds:.0f} s ({where or 'never'} s){gaps}")
    return lines
