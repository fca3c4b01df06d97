"""What each player of a match faces beside the ball: while it is not known, the nearest opponent or the goal they play
at; and who keeps goal.
"""

from __future__ import annotations

import numpy as np

from ..ball.tracked.solve import find_goal_lines
from ..base.vectors import arctan2, measure_lengths
from ..motion.track.match_data import REFEREE, Match
from ..synthesis.heading_request import HeadingKey, Play

NEAR_OPPONENT = 15.0
"""Metres within which a player faces the nearest opponent rather than the goal."""

_KEY_SECONDS = 0.25  # from one measured heading to the next that the plan follows
_RATE = 5.0  # samples per second
_KEEPER = "goalkeeper"  # `MatchPlayer.position`


def build_plays(match: Match) -> dict[str, Play]:
    """Build what each player faces beside the ball.

    A team's goalkeepers are those whom the feed names, else the player farthest from the team's middle.

    Args:
        match: the match.
    Returns:
        By player id; referees have the players nearest to them.
    """
    step = max(1, round(match.fps / _RATE))
    times, positions = match.times[::step], match.positions[:, ::step]
    keepers, goals = _find_ends(match, positions, times)
    out = {}
    for number, player in enumerate(match.players):
        others = np.array([other.team not in (player.team, REFEREE) for other in match.players])
        goal = goals.get(player.team, np.full(len(times), np.nan))
        places = _find_faced_places(positions[number], positions[others], goal)
        out[player.id] = Play(times, places, number in keepers, _build_heading_keys(match, number))
    return out


def _build_heading_keys(match: Match, number: int) -> tuple[HeadingKey, ...]:
    """Build a key for each _KEY_SECONDS in most of which the feed has measured where a player's body faces."""
    if match.headings is None:
        return ()
    step = max(1, round(_KEY_SECONDS * match.fps))
    shape = len(match.times) // step, step
    times, headings = (values[: shape[0] * step].reshape(shape) for values in (match.times, match.headings[number]))
    is_known = np.isfinite(headings)
    along, across = (np.where(is_known, turn, 0.0).sum(axis=1) for turn in (np.cos(headings), np.sin(headings)))
    used = (is_known.mean(axis=1) > 0.5) & (np.ptp(times, axis=1) < 2.0 * _KEY_SECONDS)  # no break within
    return tuple(HeadingKey(time, heading) for time, heading in zip(
        times.mean(axis=1)[used].tolist(), arctan2(across, along)[used].tolist()))


def find_kept_lines(match: Match) -> dict[str, np.ndarray]:
    """Find who keeps which goal.

    Args:
        match: the match, N samples.
    Returns:
        Id of each goalkeeper -> (N,) m, x of the goal line that they keep, NaN outside the periods and where it is not
        clear.
    """
    keepers, goals = _find_ends(match, match.positions, match.times)
    return {match.players[number].id: -goals[match.players[number].team] for number in sorted(keepers)}


def _find_ends(match: Match, positions: np.ndarray, times: np.ndarray) -> tuple[set[int], dict[str, np.ndarray]]:
    """Find the indices of the goalkeepers, and for each team the x (M,) m of the goal that it plays at.

    That is NaN where it is not clear and outside the periods.
    """
    named = {number for number, player in enumerate(match.players) if player.position.lower() == _KEEPER}
    rows = [number for number, player in enumerate(match.players) if player.team != REFEREE]
    teams = [match.players[number].team for number in rows]
    keepers, goals = set(), {team: np.full(len(times), np.nan) for team in teams}
    for start, end in match.periods:
        inside = (times >= start) & (times <= end)
        lines = {rows[row]: line for row, line in find_goal_lines(positions[rows][:, inside], teams,
                                                                  match.length).items()}
        keepers |= set(lines)
        for keeper, line in lines.items():
            for team in goals:
                goals[team][inside] = -line if team == match.players[keeper].team else line
    settled = {match.players[number].team for number in named}
    return named | {number for number in keepers if match.players[number].team not in settled}, goals


def _find_faced_places(own: np.ndarray, others: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Find the places (M, 2) m that a player faces: the nearest opponent, or the middle of the goal if none is near.

    Args:
        own: (M, 2) m of the player, NaN where absent.
        others: (K, M, 2) m of the opponents, NaN where absent.
        goal: (M,) m, x of the goal; where it is NaN, the nearest opponent counts however far.
    Returns:
        The places, NaN where there is neither.
    """
    middle = np.column_stack([goal, 0.0 * goal])
    if not len(others):
        return middle
    distance = measure_lengths(others - own)
    distance = np.where(np.isfinite(distance), distance, np.inf)
    nearest = distance.argmin(axis=0)
    least = distance[nearest, np.arange(len(own))]
    is_near = (least <= NEAR_OPPONENT) | np.isnan(goal) & np.isfinite(least)
    return np.where(is_near[:, None], others[nearest, np.arange(len(own))], middle)
