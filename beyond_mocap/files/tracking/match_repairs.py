"""Check and repair the files of a match.

Files that do not belong together raise InputErrors, truncated files give warnings. Repairs remove what feeds add: balls
at sentinel positions, players parked beside the pitch, rotated or mirrored halves.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from ...base.errors import InputError, format_count
from ...base.time_series import find_runs
from ...motion.track import MAX_SPEED, is_ball_sentinel
from .feed import MAX_PLAYERS, Feed
from .match_arrays import MAX_OUTSIDE

_MAX_BALL_OUTSIDE = 25.0  # m beyond the lines, where feeds park an absent ball
_MAX_HEIGHT = 60.0  # m, height of a ball at most
_FROZEN_SECONDS = 30.0  # s at exactly one position: a repeated sample of an absent player
_MIN_SEPARATION = 5.0  # m between the teams' mean positions along the pitch that identify their ends
_SAMPLE_STEP = 25  # use every 25th sample for means over a half
_MIN_SECONDS = 60.0  # s of frames that a half needs for its means to be used
_MIN_CORRELATION = 0.5  # correlation of the players' positions across the pitch that identifies a mirrored half
_SIDES = ("left", "right")
_WRONG_SIDE = 5.0  # m by which left players must be to the right of right players
_MIN_PLAYERS = 6  # players in both halves at least


_MAX_UNKNOWN_SHARE = 0.3  # share of players missing in the metadata above which it is of another match
_COMPARED_ROWS = 200  # rows of two teams' files whose balls are compared
_MAX_MISSING = 5.0  # seconds by which a half may start late or end early without a warning
_ONE_MATCH = "choose the files of one match"


def check_same_match(feed: Feed) -> None:
    """Check that the files belong to one match, by its number, or by the ball in two teams' files.

    Args:
        feed: the files.
    Raises:
        InputError: if they do not.
    """
    if feed.has_team_files:
        balls = [_read_ball_cells(path) for path in feed.tracking]
        differing = sum(one != other for one, other in zip(*balls))
        if differing > 0.1 * min(map(len, balls)):
            found = f"the ball differs in {differing} of {min(map(len, balls))} rows from {feed.tracking[1].name}"
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


def _read_ball_cells(path: Path) -> list[tuple[str, ...]]:
    """Read frame number and ball of the first rows of a team's CSV."""
    with open(path, encoding="utf-8", errors="replace") as file:
        rows = [line.strip().split(",") for line in islice(file, 3, 3 + _COMPARED_ROWS)]
    return [(*row[:2], *(cell for cell in row[-2:])) for row in rows]


def check_rows(feed: Feed) -> list[str]:
    """Compare the number of rows of two teams' files; only frames in both are used.

    Args:
        feed: the files.
    Returns:
        A warning if they differ.
    """
    if not feed.has_team_files:
        return []
    rows = [sum(bool(line.strip()) for line in path.read_bytes().splitlines()) for path in feed.tracking]
    if rows[0] == rows[1]:
        return []
    counts = " and ".join(f"{path.name} {count}" for path, count in zip(feed.tracking, rows))
    return [f"the teams' files differ in their number of rows ({counts}): only common rows are read"]


def check_players(players, dataset, feed: Feed) -> list[str]:
    """Check the tracked players against the metadata.

    Args:
        players: kloppy's tracked players.
        dataset: kloppy's dataset.
        feed: the files.
    Returns:
        A line on players missing in the metadata.
    Raises:
        InputError: for more than MOST_PLAYERS players, or so many missing ones that the metadata is of another match.
    """
    if len(players) > MAX_PLAYERS:
        found = f"{len(players)} players"
        raise InputError(feed.path, found, f"at most {MAX_PLAYERS} in one match", "reduce the file to one match")
    roster = [player for team in dataset.metadata.teams for player in team.players if player.name]
    unknown = [player for player in players if not player.name] if roster else []
    tracked = {player.player_id for player in players}
    absent = [player for player in roster if player.player_id not in tracked]
    if not unknown:
        return []
    names = ", ".join(f"{player.team.ground} {player.jersey_no}" for player in unknown[:6])
    known = feed.meta and not feed.provider.has_own_roster
    if known and len(unknown) > _MAX_UNKNOWN_SHARE * len(players) and len(absent) >= len(unknown) // 2:
        found = f"{len(unknown)} of {len(players)} tracked players ({names}) are not in {feed.meta[0].name}"
        raise InputError(feed.path, found, "tracking and metadata of one match", _ONE_MATCH)
    return [f"not in the metadata: {len(unknown)} of {len(players)} players ({names})"]


def check_periods(records, dataset, feed: Feed) -> list[str]:
    """Check the periods against the metadata.

    Args:
        records: kloppy's frames.
        dataset: kloppy's dataset.
        feed: the files.
    Returns:
        A line for each period that is missing or truncated.
    Raises:
        InputError: if the metadata's periods contain none of the frames.
    """
    if len(records) < 2:
        found = f"{format_count(len(records), 'frame')} with players"
        if feed.meta:
            found += f" within the periods in {feed.meta[0].name}"
            raise InputError(feed.path, found, "a match", _ONE_MATCH)
        raise InputError(feed.path, found, "a match", "export it again")
    lines = []
    for period in dataset.metadata.periods:
        clock = [frame.timestamp.total_seconds() for frame in records if frame.period.id == period.id]
        try:
            duration = (period.end_timestamp - period.start_timestamp).total_seconds()
        except TypeError:  # a period that has not ended
            continue
        if not clock:
            lines.append(f"period {period.id} is in the metadata but has no frames")
        elif duration - (max(clock) - min(clock)) > _MAX_MISSING:
            lines.append(f"period {period.id} has {max(clock) - min(clock):.0f} s of frames of its {duration:.0f} s")
    return lines


@contextlib.contextmanager
def cut_to_whole_lines(feed: Feed) -> Iterator[Feed]:
    """Context manager: the feed with copies of its tracking files cut to whole lines, and to the same number of lines.

    Args:
        feed: the files.
    """
    with tempfile.TemporaryDirectory() as folder:
        texts = [path.read_bytes() for path in feed.tracking]
        lines = [text[: text.rfind(b"\n") + 1].splitlines(keepends=True) for text in texts]
        count = min(map(len, lines)) if len(lines) > 1 else None
        copies = []
        for path, rows in zip(feed.tracking, lines):
            copies.append(Path(folder) / path.name)
            copies[-1].write_bytes(b"".join(rows[:count]))
        yield replace(feed, tracking=tuple(copies))


def repair_ball(ball: np.ndarray, length: float, width: float) -> tuple[np.ndarray, list[str]]:
    """Repair the ball's samples.

    Args:
        ball: (N, 3) m.
        length, width: m, of the pitch.
    Returns:
        (N, 3) m, NaN at sentinel positions and where no ball can be, and messages.
    """
    with np.errstate(invalid="ignore"):
        is_impossible = is_ball_sentinel(ball)
        is_impossible |= (np.abs(ball[:, :2]) > np.array([length, width]) / 2.0 + _MAX_BALL_OUTSIDE).any(axis=1)
        is_too_high = ~is_impossible & (ball[:, 2] > _MAX_HEIGHT)
    out = np.where(is_impossible[:, None], np.nan, ball)
    out[is_too_high, 2] = np.nan
    known = np.isfinite(out[:, :2]).all(axis=1)
    impossible, too_high = np.count_nonzero(is_impossible), np.count_nonzero(is_too_high)
    lines = []
    if impossible:
        lines.append(f"{format_count(impossible, 'sample')} with an impossible position of the ball, set to unknown")
    if too_high:
        lines.append(f"{format_count(too_high, 'height')} of the ball above {_MAX_HEIGHT:g} m, set to unknown")
    heights = np.isfinite(out[known, 2]).mean() if known.any() else 0.0
    coverage = (f"the ball is known in {known.mean():.0%} of the samples, its height in {heights:.0%} of these"
                if known.any() else "no ball in the tracking data")
    return out, [*lines, coverage]


def repair_players(times, positions, length: float, width: float, ids) -> tuple[np.ndarray, list[str]]:
    """Repair the players' samples.

    Args:
        times: (N,) s.
        positions: (P, N, 2) m.
        length, width: m, of the pitch.
        ids: P names.
    Returns:
        (P, N, 2) m, NaN where a player is parked: far beside the pitch, or at exactly one position for half a minute;
        and messages.
    """
    out = np.array(positions)
    lines, jumps = [], 0
    with np.errstate(invalid="ignore"):
        is_outside = (np.abs(out) > np.array([length, width]) / 2.0 + MAX_OUTSIDE).any(axis=2)
    for index, name in enumerate(ids):
        frozen = _find_frozen(times, out[index]) & ~is_outside[index]
        for reason, flags in (("beside the pitch", is_outside[index]), ("at exactly one position", frozen)):
            if flags.any():
                out[index, flags] = np.nan
                seconds = np.count_nonzero(flags) * float(np.median(np.diff(times)))
                lines.append(f"{name}: {seconds:.0f} s {reason}, set to absent")
        with np.errstate(invalid="ignore"):
            speed = np.linalg.norm(np.diff(out[index], axis=0), axis=1) / np.maximum(np.diff(times), 1e-6)
            jumps += np.count_nonzero(speed > MAX_SPEED)
    if jumps:
        lines.append(f"{format_count(jumps, 'step')} of players faster than {MAX_SPEED:g} m/s, repaired when their "
                     "tracks are cleaned")
    return out, lines


def _find_frozen(times: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Find runs of _FROZEN seconds and more at exactly one position of a path (N, 2): (N,) bool."""
    still = (np.diff(path, axis=0) == 0.0).all(axis=1)
    out = np.zeros(len(path), bool)
    for first, end in find_runs(still):
        if times[end] - times[first] >= _FROZEN_SECONDS:
            out[first : end + 1] = True
    return out


def repair_sides(times, positions, ball, periods, teams) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Repair rotated and mirrored second halves.

    Teams change ends at half time. If they do not, the feed rotated one half so that attacks go one way, and the second
    half is rotated back. Players keep their side of the team: if left backs become right backs, the half is mirrored
    and its y changes sign. The third and fourth periods, of extra time, are a pair too.

    Args:
        times: (N,) s.
        positions: (P, N, 2) m.
        ball: (N, 3) m.
        periods: (start, end) s, in order.
        teams: P of "home", "away", "referee".
    Returns:
        Positions and ball, consistent with the first half, and messages.
    """
    positions, ball, lines = np.array(positions), np.array(ball), []
    teams = np.array(teams)
    for first in range(0, len(periods) - 1, 2):
        pair = periods[first : first + 2]
        parts = [slice(*np.searchsorted(times, [start - 1e-6, end + 1e-6])) for start, end in pair]
        ends = [find_home_end(positions[:, part], teams) for part in parts]
        interval = float(np.median(np.diff(times)))
        if 0.0 in ends or min(part.stop - part.start for part in parts) * interval < _MIN_SECONDS:
            continue
        signs = np.ones(2)
        # The home team at the same end twice: change the sign of x in the second half.
        if ends[0] == ends[1]:
            signs[0] = -1.0
            ends[1] = -ends[1]
        across = [_compute_mean_across(positions[:, part]) * end for part, end in zip(parts, ends)]
        # Players on opposite sides of their team: change the sign of y too.
        correlation = _compute_correlation(*across)
        if correlation < -_MIN_CORRELATION:
            signs[1] = -1.0
        if (signs < 0.0).any():
            positions[:, parts[1]] *= signs
            ball[parts[1], :2] *= signs
            lines.append(_SIDE_MESSAGES[tuple((signs < 0.0).tolist())].format(period=first + 2))
    return positions, ball, lines


_SIDE_MESSAGES = {
    (True, True): "period {period}: the teams do not change ends, so the half is rotated by 180 degrees",
    (True, False): "period {period}: the half is mirrored end to end, so it is mirrored back",
    (False, True): "period {period}: the half is mirrored side to side, so it is mirrored back",
}


def find_home_end(positions: np.ndarray, teams: np.ndarray) -> float:
    """Find the end that the home team defends.

    Args:
        positions: (P, N, 2) m.
        teams: P of "home", "away", "referee".
    Returns:
        -1 for negative x, 1 for positive, 0 if it is unclear.
    """
    middles = []
    for ground in ("home", "away"):
        own = positions[teams == ground, ::_SAMPLE_STEP, 0]
        own = own[np.isfinite(own)]
        if not len(own):
            return 0.0
        middles.append(own.mean())
    separation = middles[0] - middles[1]
    return float(np.sign(separation)) if abs(separation) > _MIN_SEPARATION else 0.0


def _compute_mean_across(positions: np.ndarray) -> np.ndarray:
    """Compute each player's mean y, (P,), NaN for absent players."""
    samples = positions[:, ::_SAMPLE_STEP, 1]
    count = np.isfinite(samples).sum(axis=1)
    return np.where(count > 0, np.nansum(samples, axis=1) / np.maximum(count, 1), np.nan)


def _compute_correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Compute the correlation over the players in both; 0 if they are too few or all near the middle."""
    both = np.isfinite(one) & np.isfinite(other)
    a, b = one[both], other[both]
    size = np.sqrt((a**2).sum() * (b**2).sum())
    return float((a * b).sum() / size) if np.count_nonzero(both) >= _MIN_PLAYERS and size > 1.0 else 0.0


def check_side_names(times, positions, periods, teams, position_names) -> list[str]:
    """Check that players that the lineup calls left are to the left of those it calls right, in the first half.

    Left and right are relative to their team's attack.

    Args:
        times: (N,) s.
        positions: (P, N, 2) m, repaired.
        periods: (start, end) s, in order.
        teams: P of "home", "away", "referee".
        position_names: P positions in words.
    Returns:
        A warning if they are exchanged.
    """
    part = slice(*np.searchsorted(times, [periods[0][0] - 1e-6, periods[0][1] + 1e-6]))
    end = find_home_end(positions[:, part], np.array(teams))
    if not end or (part.stop - part.start) * float(np.median(np.diff(times))) < _MIN_SECONDS:
        return []
    attack = np.where(np.array(teams) == "home", -end, end)
    across = _compute_mean_across(positions[:, part]) * attack
    sides = {side: [y for y, name in zip(across, position_names) if side in name.split() and np.isfinite(y)]
             for side in _SIDES}
    if min(map(len, sides.values())) < 2 or np.mean(sides["left"]) - np.mean(sides["right"]) > -_WRONG_SIDE:
        return []
    return ["left players are on the right: the file or the lineup may be mirrored side to side"]
