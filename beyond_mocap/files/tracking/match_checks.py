"""Files that do not belong together, files that end too early, and halves that are missing."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

from ...base.errors import InputError
from .feed import Feed

MOST_PLAYERS = 60
"""Two squads of 26 and the referees have fewer; more is two matches in one file."""

_STRANGERS = 0.3  # share of the players whom the metadata does not know, from which it is another match's
_COMPARED = 200  # rows of two teams' files that must tell of one ball
_LATE = 5.0  # seconds by which a half may begin late or end early untold
_OTHER = "take the files of one match"


def check_same_match(feed: Feed) -> None:
    """InputError where the files name two matches: by its number, or by two teams' files with two balls."""
    if feed.by_teams:
        balls = [_balls(path) for path in feed.tracking]
        differing = sum(one != other for one, other in zip(*balls))
        if differing > 0.1 * min(map(len, balls)):
            found = f"another ball in {differing} of {min(map(len, balls))} rows than in {feed.tracking[1].name}"
            raise InputError(feed.path, found, "two teams of one match", _OTHER)
    elif feed.provider.number_in_tracking and feed.provider.number_in_metadata:
        _check_same_number(feed)


def _check_same_number(feed: Feed) -> None:
    with open(feed.path, "rb") as file:
        tracked = feed.provider.number_in_tracking(file.read(65536))
    number = feed.provider.number_in_metadata(feed.meta[0].read_bytes()[:262144])
    if tracked and number and tracked != number:
        found = f"match {tracked}, but {feed.meta[0].name} is of match {number}"
        raise InputError(feed.path, found, "tracking and metadata of one match", _OTHER)


def _balls(path: Path) -> list[tuple[str, ...]]:
    """Frame number and ball of the first rows of a team's CSV."""
    with open(path, encoding="utf-8", errors="replace") as file:
        rows = [line.strip().split(",") for line in islice(file, 3, 3 + _COMPARED)]
    return [(*row[:2], *(cell for cell in row[-2:])) for row in rows]


def check_rows(feed: Feed) -> list[str]:
    """A line where two teams' files have not as many rows: frames are those that both have."""
    if not feed.by_teams:
        return []
    rows = [sum(bool(line.strip()) for line in path.read_bytes().splitlines()) for path in feed.tracking]
    if rows[0] == rows[1]:
        return []
    told = " and ".join(f"{path.name} {count}" for path, count in zip(feed.tracking, rows))
    return [f"the teams' files have not as many rows ({told}): only what both have is read"]


def check_players(players, dataset, feed: Feed) -> list[str]:
    """Lines on players whom the metadata does not know. players: kloppy's, those who are tracked. InputError for more
    than MOST_PLAYERS of them, and where so many are unknown that the metadata is another match's."""
    if len(players) > MOST_PLAYERS:
        found = f"{len(players)} players"
        raise InputError(feed.path, found, f"at most {MOST_PLAYERS}, as one match has", "cut the file to one match")
    roster = [player for team in dataset.metadata.teams for player in team.players if player.name]
    strangers = [player for player in players if not player.name] if roster else []
    tracked = {player.player_id for player in players}
    away = [player for player in roster if player.player_id not in tracked]
    if not strangers:
        return []
    names = ", ".join(f"{player.team.ground} {player.jersey_no}" for player in strangers[:6])
    known = feed.meta and not feed.provider.has_own_roster
    if known and len(strangers) > _STRANGERS * len(players) and len(away) >= len(strangers) // 2:
        found = f"{len(strangers)} of {len(players)} tracked players ({names}) are not in {feed.meta[0].name}"
        raise InputError(feed.path, found, "tracking and metadata of one match", _OTHER)
    return [f"{len(strangers)} of {len(players)} players are not in the metadata: {names}"]


def check_periods(records, dataset, feed: Feed) -> list[str]:
    """Lines on halves that are missing or cut. InputError where the metadata's halves have none of the frames."""
    if len(records) < 2:
        found = f"{len(records)} frames with anybody in them"
        if feed.meta:
            raise InputError(feed.path, f"{found} within the halves that {feed.meta[0].name} names", "a match", _OTHER)
        raise InputError(feed.path, found, "a match", "export it again")
    lines = []
    for period in dataset.metadata.periods:
        clock = [frame.timestamp.total_seconds() for frame in records if frame.period.id == period.id]
        try:
            lasts = (period.end_timestamp - period.start_timestamp).total_seconds()
        except TypeError:  # a half that has not ended
            continue
        if not clock:
            lines.append(f"period {period.id} is in the metadata but has no frames")
        elif lasts - (max(clock) - min(clock)) > _LATE:
            lines.append(f"period {period.id} has {max(clock) - min(clock):.0f} s of frames of its {lasts:.0f} s")
    return lines


@contextlib.contextmanager
def whole_lines(feed: Feed) -> Iterator[Feed]:
    """The feed with copies of its tracking files that end with their last whole line, all after as many lines."""
    with tempfile.TemporaryDirectory() as folder:
        texts = [path.read_bytes() for path in feed.tracking]
        lines = [text[: text.rfind(b"\n") + 1].splitlines(keepends=True) for text in texts]
        count = min(map(len, lines)) if len(lines) > 1 else None
        copies = []
        for path, rows in zip(feed.tracking, lines):
            copies.append(Path(folder) / path.name)
            copies[-1].write_bytes(b"".join(rows[:count]))
        yield replace(feed, tracking=tuple(copies))
