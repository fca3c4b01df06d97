"""A tracked match as arrays: who is present and when, the ball, the pitch, and the problems found and corrected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, format_count
from ...base.time_series import find_runs
from . import Track

MAX_GAP = 3.0
"""Seconds; a player who is missing for longer has left the pitch."""

REFEREE = "referee"


@dataclass(frozen=True)
class Team:
    """A team of a match.

    Attributes:
        ground: "home", "away" or "referee".
        name: as the feed spells it, "" where it has none.
        colour: of the shirts, "#RRGGBB", "" where the feed has none.
    """

    ground: str
    name: str = ""
    colour: str = ""


@dataclass(frozen=True)
class MatchPlayer:
    """A player of a match.

    Attributes:
        id: as the feed spells it.
        team: "home", "away" or "referee".
        name: the player's name.
        number: shirt number, -1 where the feed has none.
        position: in words ("goalkeeper", "left back"), "" where unknown.
    """

    id: str
    team: str
    name: str
    number: int
    position: str = ""


@dataclass(frozen=True)
class Half:
    """A period on its provider's clock.

    Attributes:
        number: 1 for the first half, 3 and 4 in extra time.
        clock_zero: second of the match at which this clock is at 0, before `start` where the file begins later.
        start, end: its frames, seconds.
    """

    number: int
    clock_zero: float
    start: float
    end: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Match:
    """The samples of all players, N times and P players, as the feed has them (not cleaned). Arrays are read-only.

    Attributes:
        times: (N,) seconds from the first frame of the first period; each later period starts ten seconds after the one
            before.
        players: P of them.
        positions: (P, N, 2) metres, pitch frame, NaN where a player is not present.
        ball: (N, 3) metres, NaN where unknown.
        length, width: of the pitch, metres.
        fps: the feed's rate.
        provider: whose file form it was.
        periods: (start, end) seconds.
        notes: assumptions, for people.
        teams: home, away, and referees where there are any.
        report: the data report, a line each: assumptions, corrections, and how long each player is present.
        elapsed: for each period its number and the seconds on its clock at its first frame; () where the numbers are
            1, 2, ... and the clocks start at 0.
        headings: (P, N) rad from +x to the left in which bodies face, NaN where not known; None for a feed without.
    """

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
    elapsed: tuple[tuple[int, float], ...] = ()
    headings: np.ndarray | None = None

    @property
    def halves(self) -> tuple[Half, ...]:
        """The periods with their numbers and clocks."""
        passed = self.elapsed or tuple((number, 0.0) for number in range(1, len(self.periods) + 1))
        return tuple(
            Half(number, start - before, start, end) for (number, before), (start, end) in zip(passed, self.periods)
        )

    def track(self, player_id: str, start: float | None = None, end: float | None = None) -> Track:
        """Return one player and the ball between two times, from the player's first sample on.

        Args:
            player_id: as the feed spells it.
            start, end: seconds; None for the whole match.
        Returns:
            The track, not cleaned.
        Raises:
            InputError: for an unknown player, or one with fewer than two samples in that time.
        """
        path = self.positions[self._find_player_index(player_id)]
        low = -np.inf if start is None else start - 1e-9
        high = np.inf if end is None else end + 1e-9
        there = np.flatnonzero(np.isfinite(path).all(axis=1) & (self.times >= low) & (self.times <= high))
        if len(there) < 2:
            found = f"{player_id!r} has {format_count(len(there), 'sample')} from {start} to {end} s"
            raise InputError("player", found, "at least two")
        part = slice(there[0], there[-1] + 1)
        return Track(self.times[part], path[part], self.ball[part], name=player_id)

    def list_stretches(self, player_id: str, gap: float = MAX_GAP) -> tuple[tuple[float, float], ...]:
        """List the stretches in which a player is present, in order, all of more than one sample.

        Args:
            player_id: as the feed spells it.
            gap: seconds; shorter gaps do not end a stretch (`clean_track` fills them), the end of a period does.
        Returns:
            (start, end) seconds of each.
        Raises:
            InputError: for an unknown player.
        """
        there = np.isfinite(self.positions[self._find_player_index(player_id)]).all(axis=1)
        found = []
        for begins, ends in self.periods:
            inside = np.flatnonzero(there & (self.times >= begins - 1e-9) & (self.times <= ends + 1e-9))
            breaks = np.flatnonzero(np.diff(self.times[inside]) > gap + 1e-9)
            for piece in np.split(inside, breaks + 1):
                if len(piece) > 1:
                    found.append((float(self.times[piece[0]]), float(self.times[piece[-1]])))
        return tuple(found)

    def _find_player_index(self, player_id: str) -> int:
        ids = [player.id for player in self.players]
        if player_id not in ids:
            raise InputError("player", f"{player_id!r}", f"one of {', '.join(ids)}")
        return ids.index(player_id)


def describe_presence(match: Match) -> list[str]:
    """Describe, one line each, for how long every player who is not always present is there, and where they are
    missing.
    """
    lines = []
    for player, path in zip(match.players, match.positions):
        missing = find_runs(~np.isfinite(path).all(axis=1))
        short = [(a, b) for a, b in missing if match.times[b - 1] - match.times[a] <= MAX_GAP]
        spans = match.list_stretches(player.id)
        seconds = sum(end - start for start, end in spans)
        whole = [tuple(np.round(period, 6)) for period in match.periods]
        if not short and [tuple(np.round(span, 6)) for span in spans] == whole:
            continue
        where = ", ".join(f"{start:.1f}-{end:.1f}" for start, end in spans[:4]) + ", ..." * (len(spans) > 4)
        gaps = f", {format_count(len(short), 'short gap')}" if short else ""
        lines.append(f"{player.id}: present for {seconds:.0f} s ({where or 'never'} s){gaps}")
    return lines
