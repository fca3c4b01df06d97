"""What is wrong with the files of a match: refused where they do not belong together, told where they end too early,
put right where feeds do what is no part of it: balls at sentinels, players parked beside the pitch, turned halves."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...base.time_series import runs
from ...motion.track import FASTEST, at_sentinel
from .feed import Feed

_BESIDE = 12.0  # m beyond the lines, where nobody plays
_BALL_BESIDE = 25.0  # m beyond the lines, where feeds park a ball that is not there
_HIGHEST = 60.0  # m
_FROZEN = 30.0  # s at one place to the last digit: a sample kept for somebody who is not there
_APART = 5.0  # m between the teams' mean places along the pitch that tell their ends
_SAMPLED = 25  # every how manieth sample is enough for means over a half
_LEAST = 60.0  # s of frames that a half must have for its means to tell anything
_LIKE = 0.5  # correlation of the players' places across the pitch from which halves are told apart
_SIDES = ("left", "right")
_WRONG_SIDE = 5.0  # m by which the left have to stand to the right of the right
_FEWEST = 6  # players in both halves that tell of it

MOST_PLAYERS = 60
"""Two squads of 26 and the referees have fewer; more is two matches in one file."""

_STRANGERS = 0.3  # share of the players whom the metadata does not know, from which it is another match's
_COMPARED = 200  # rows of two teams' files that must tell of one ball
_LATE = 5.0  # seconds by which a half may begin late or end early untold
_ONE_MATCH = "take the files of one match"


def check_same_match(feed: Feed) -> None:
    """InputError where the files name two matches: by its number, or by two teams' files with two balls."""
    if feed.by_teams:
        balls = [_balls(path) for path in feed.tracking]
        differing = sum(one != other for one, other in zip(*balls))
        if differing > 0.1 * min(map(len, balls)):
            found = f"another ball in {differing} of {min(map(len, balls))} rows than in {feed.tracking[1].name}"
            raise InputError(feed.path, found, "two teams of one match", _ONE_MATCH)
    elif feed.provider.number_in_tracking and feed.provider.number_in_metadata:
        _check_same_number(feed)


def _check_same_number(feed: Feed) -> None:
    with open(feed.path, "rb") as file:
        tracked = feed.provider.number_in_tracking(file.read(65536))
    number = feed.provider.number_in_metadata(feed.meta[0].read_bytes()[:262144])
    if tracked and number and tracked != number:
        found = f"match {tracked}, but {feed.meta[0].name} is of match {number}"
        raise InputError(feed.path, found, "tracking and metadata of one match", _ONE_MATCH)


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
        raise InputError(feed.path, found, "tracking and metadata of one match", _ONE_MATCH)
    return [f"{len(strangers)} of {len(players)} players are not in the metadata: {names}"]


def check_periods(records, dataset, feed: Feed) -> list[str]:
    """Lines on halves that are missing or cut. InputError where the metadata's halves have none of the frames."""
    if len(records) < 2:
        found = f"{len(records)} frames with anybody in them"
        if feed.meta:
            found += f" within the halves that {feed.meta[0].name} names"
            raise InputError(feed.path, found, "a match", _ONE_MATCH)
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


def mended_ball(ball: np.ndarray, length: float, width: float) -> tuple[np.ndarray, list[str]]:
    """The ball (N, 3) m with NaN where it stands at a sentinel or no ball can be, and lines that tell."""
    with np.errstate(invalid="ignore"):
        wrong = at_sentinel(ball)
        wrong |= (np.abs(ball[:, :2]) > np.array([length, width]) / 2.0 + _BALL_BESIDE).any(axis=1)
        high = ~wrong & (ball[:, 2] > _HIGHEST)
    out = np.where(wrong[:, None], np.nan, ball)
    out[high, 2] = np.nan
    known = np.isfinite(out[:, :2]).all(axis=1)
    counts = np.count_nonzero(wrong), np.count_nonzero(high)
    lines = [f"{counts[0]} samples with the ball at no place of a ball taken as unknown"] * bool(counts[0])
    lines += [f"{counts[1]} heights of the ball above {_HIGHEST:g} m taken as unknown"] * bool(counts[1])
    heights = np.isfinite(out[known, 2]).mean() if known.any() else 0.0
    told = f"the ball is known in {known.mean():.0%} of the samples, its height in {heights:.0%} of these"
    return out, [*lines, told]


def mended_players(times, positions, length: float, width: float, ids) -> tuple[np.ndarray, list[str]]:
    """Positions (P, N, 2) m with NaN where a player is parked: far beside the pitch, or unmoved to the last digit for
    half a minute; and lines that tell. times: (N,) s; ids: P names."""
    out = np.array(positions)
    lines, jumps = [], 0
    with np.errstate(invalid="ignore"):
        beside = (np.abs(out) > np.array([length, width]) / 2.0 + _BESIDE).any(axis=2)
    for index, name in enumerate(ids):
        frozen = _frozen(times, out[index]) & ~beside[index]
        for what, flags in (("beside the pitch", beside[index]), ("at one place to the last digit", frozen)):
            if flags.any():
                out[index, flags] = np.nan
                seconds = np.count_nonzero(flags) * float(np.median(np.diff(times)))
                lines.append(f"{name}: {seconds:.0f} s {what}, taken as away")
        with np.errstate(invalid="ignore"):
            speed = np.linalg.norm(np.diff(out[index], axis=0), axis=1) / np.maximum(np.diff(times), 1e-6)
            jumps += np.count_nonzero(speed > FASTEST)
    if jumps:
        lines.append(f"{jumps} steps of players faster than {FASTEST:g} m/s, mended where their tracks are cleaned")
    return out, lines


def _frozen(times: np.ndarray, path: np.ndarray) -> np.ndarray:
    """(N,) bool: within a run of _FROZEN seconds and more at exactly one place; path (N, 2)."""
    still = (np.diff(path, axis=0) == 0.0).all(axis=1)
    out = np.zeros(len(path), bool)
    for first, end in runs(still):
        if times[end] - times[first] >= _FROZEN:
            out[first : end + 1] = True
    return out


def mended_sides(times, positions, ball, periods, teams) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Positions (P, N, 2) and ball (N, 3) m with every second half turned and mirrored to fit the first one, and lines.

    Teams change ends at half time: where they do not, the feed has turned one half for attack to go one way, and the
    second one is turned back. A player keeps to his side of the team: where left backs become right backs, the half is
    mirrored and its y changes sign. teams: P of "home", "away", "referee"; periods: (start, end) s, in order; the third
    and fourth, of extra time, are a pair too."""
    positions, ball, lines = np.array(positions), np.array(ball), []
    teams = np.array(teams)
    for first in range(0, len(periods) - 1, 2):
        pair = periods[first : first + 2]
        parts = [slice(*np.searchsorted(times, [start - 1e-6, end + 1e-6])) for start, end in pair]
        ends = [home_end(positions[:, part], teams) for part in parts]
        interval = float(np.median(np.diff(times)))
        if 0.0 in ends or min(part.stop - part.start for part in parts) * interval < _LEAST:
            continue
        signs = np.ones(2)
        if ends[0] == ends[1]:
            signs[0] = -1.0
            ends[1] = -ends[1]
        places = [_across(positions[:, part]) * end for part, end in zip(parts, ends)]
        alike = _correlation(*places)
        if alike < -_LIKE:
            signs[1] = -1.0
        if (signs < 0.0).any():
            positions[:, parts[1]] *= signs
            ball[parts[1], :2] *= signs
            lines.append(_TOLD[tuple((signs < 0.0).tolist())].format(period=first + 2))
    return positions, ball, lines


_TOLD = {
    (True, True): "period {period}: the teams had not changed ends, so the half is turned round",
    (True, False): "period {period}: the half was mirrored end to end, and is turned back",
    (False, True): "period {period}: the half was mirrored side to side, and is turned back",
}


def home_end(positions: np.ndarray, teams: np.ndarray) -> float:
    """Which end the home team keeps: -1 where x is negative, 1 the other, 0 where it cannot be told."""
    middles = []
    for ground in ("home", "away"):
        own = positions[teams == ground, ::_SAMPLED, 0]
        own = own[np.isfinite(own)]
        if not len(own):
            return 0.0
        middles.append(own.mean())
    apart = middles[0] - middles[1]
    return float(np.sign(apart)) if abs(apart) > _APART else 0.0


def _across(positions: np.ndarray) -> np.ndarray:
    """(P,) each player's mean y, NaN where he is not there."""
    seen = positions[:, ::_SAMPLED, 1]
    count = np.isfinite(seen).sum(axis=1)
    return np.where(count > 0, np.nansum(seen, axis=1) / np.maximum(count, 1), np.nan)


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Of the players who are in both; 0 where they are too few, or all in the middle."""
    both = np.isfinite(one) & np.isfinite(other)
    a, b = one[both], other[both]
    size = np.sqrt((a**2).sum() * (b**2).sum())
    return float((a * b).sum() / size) if np.count_nonzero(both) >= _FEWEST and size > 1.0 else 0.0


def side_lines(times, positions, periods, teams, called) -> list[str]:
    """A line where players whom the lineup calls left stand to the right of those it calls right, over the first half,
    looking where their team attacks. positions (P, N, 2) m put right; called: P position words."""
    part = slice(*np.searchsorted(times, [periods[0][0] - 1e-6, periods[0][1] + 1e-6]))
    end = home_end(positions[:, part], np.array(teams))
    if not end or (part.stop - part.start) * float(np.median(np.diff(times))) < _LEAST:
        return []
    attack = np.where(np.array(teams) == "home", -end, end)
    across = _across(positions[:, part]) * attack
    sides = {side: [y for y, said in zip(across, called) if side in said.split() and np.isfinite(y)] for side in _SIDES}
    if min(map(len, sides.values())) < 2 or np.mean(sides["left"]) - np.mean(sides["right"]) > -_WRONG_SIDE:
        return []
    return ["players called left stand on the right: the file may be mirrored side to side, or the lineup"]
