"""Where a goalkeeper stands while it is not measured: between the ball and the middle of the goal.

A ball within 25 m is faced from the line to it, some four metres out; the farther it is, the farther out the keeper
comes and the nearer to the middle of the pitch. A measured keeper is never moved.

    track = build_keeper_track(times, ball, goal=-52.5, name="keeper")      # a plan without a match
    match, notes = fill_keepers(match, find_kept_lines(match))              # a keeper whom the feed lacks for a while
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...base.easing import smoothstep
from ...base.errors import InputError, format_seconds
from ...base.time_series import find_runs, interpolate_columns
from ...motion.track import Track, smooth_zero_phase_hann
from ...motion.track.match_data import MAX_GAP, Match

# m of the ball from the middle of the goal; m of the keeper from there, and the share of the ball's angle that the
# keeper's own angle has: medians and slopes over both goalkeepers of a half of top football, 25 samples a second
_BALL_DISTANCES = np.array([0.0, 25.0, 30.0, 36.0, 45.0, 55.0, 67.0, 82.0, 100.0])
_KEEPER_DISTANCES = np.array([4.0, 4.0, 4.3, 5.6, 10.0, 12.2, 15.7, 18.8, 21.8])
_ANGLE_SHARES = np.array([0.95, 0.95, 0.75, 0.7, 0.65, 0.45, 0.4, 0.32, 0.3])
_NEAR_SHARE = 0.6  # of the way to a ball that is nearer than the keeper would stand
_SMOOTH_SECONDS = 4.0  # s over which the place is smoothed: keepers do not follow every bounce
_FORGET_SECONDS = 20.0  # s over which a keeper goes from the last measured place to the one for the ball


def find_keeper_places(ball: np.ndarray, goal: float) -> np.ndarray:
    """Find where a goalkeeper stands for a ball.

    Args:
        ball: (..., 2) m on the pitch.
        goal: m, x of the goal line.
    Returns:
        (..., 2) m.
    """
    offset = np.asarray(ball, float) - [goal, 0.0]
    away = np.linalg.norm(offset, axis=-1)
    out = np.minimum(np.interp(away, _BALL_DISTANCES, _KEEPER_DISTANCES), _NEAR_SHARE * away)
    across = out * np.interp(away, _BALL_DISTANCES, _ANGLE_SHARES) * offset[..., 1] / np.maximum(away, 1e-9)
    inward = -np.sign(goal) * np.sqrt(np.maximum(out**2 - across**2, 0.0))
    return np.stack([goal + inward, across], axis=-1)


def build_keeper_track(times: np.ndarray, ball: np.ndarray, goal: float, name: str = "keeper") -> Track:
    """Build the track of a goalkeeper from the ball alone.

    Args:
        times: (N,) s, evenly spaced.
        ball: (N, 3) m, NaN where it is unknown.
        goal: m, x of the goal line.
        name: of the track.
    Returns:
        The track, with the ball.
    Raises:
        InputError: if the ball is never known.
    """
    return Track(np.asarray(times, float), _find_smooth_places(times, ball, goal), ball, name=name)


def fill_keepers(match: Match, goal_lines: Mapping[str, np.ndarray]) -> tuple[Match, tuple[str, ...]]:
    """Fill in the goalkeepers where the feed has none of their team for longer than MAX_GAP.

    Args:
        match: the match, N samples.
        goal_lines: id of each goalkeeper -> (N,) m, x of the goal line that they keep, NaN where they keep none.
    Returns:
        The match, itself if nothing is filled, and a message for each stretch.
    """
    positions, notes = np.array(match.positions), []
    teams = {player.id: player.team for player in match.players}
    for team in sorted({teams[keeper] for keeper in goal_lines}):
        rows = [row for row, player in enumerate(match.players) if player.team == team and player.id in goal_lines]
        there = np.isfinite(match.positions[rows]).all(axis=2)
        line = goal_lines[match.players[rows[0]].id]
        for first, end in find_runs(~there.any(axis=0) & np.isfinite(line) & _list_played(match)):
            if match.times[end - 1] - match.times[first] > MAX_GAP and there.any():
                row = rows[_find_nearest_present(there, first, end)]
                positions[row, first:end] = _fill_stretch(match, row, first, end, float(line[first]))
                notes.append(f"{match.players[row].id}: {format_seconds(match.times[first])} to "
                             f"{format_seconds(match.times[end - 1])} s are not in the feed: the goalkeeper is placed "
                             "between ball and goal")
    return (replace(match, positions=positions), tuple(notes)) if notes else (match, ())


def _list_played(match: Match) -> np.ndarray:
    """Return (N,) bool: samples within the periods."""
    return np.any([(match.times >= start) & (match.times <= end) for start, end in match.periods], axis=0)


def _find_nearest_present(there: np.ndarray, first: int, end: int) -> int:
    """Find which of K keepers, `there` (K, N), was present last before a stretch, else first after it."""
    before, after = there[:, :first][:, ::-1], there[:, end:]
    rows = before if before.any() else after
    return int(np.argmin(np.where(rows.any(axis=1), rows.argmax(axis=1), rows.shape[1])))


def _fill_stretch(match: Match, row: int, first: int, end: int, goal: float) -> np.ndarray:
    """Fill one stretch: the place for the ball, eased into the measured places at its ends."""
    span = slice(first, end)
    times = match.times[span]
    if not np.isfinite(match.ball[span, :2]).all(axis=1).any():
        places = np.tile(find_keeper_places(np.zeros(2), goal), (len(times), 1))
    else:
        places = _find_smooth_places(times, match.ball[span], goal)
    edges = [(edge, place) for edge, place in ((first - 1, 0), (end, -1))
             if 0 <= edge < len(match.times) and np.isfinite(match.positions[row, edge]).all()]
    own = np.array([match.positions[row, edge] - places[place] for edge, place in edges])
    if len(edges) == 2:  # keepers have habits: what they stood off at both ends stays in between
        return places + interpolate_columns(times, times[[0, -1]], own)
    for (edge, place), offset in zip(edges, own):
        share = 1.0 - smoothstep(np.clip(np.abs(times - times[place]) / _FORGET_SECONDS, 0.0, 1.0))
        places = places + share[:, None] * offset
    return places


def _find_smooth_places(times: np.ndarray, ball: np.ndarray, goal: float) -> np.ndarray:
    """Find the smooth places (N, 2) m for a ball (N, 3) m at `times` (N,) s."""
    times, known = np.asarray(times, float), np.isfinite(np.asarray(ball)[:, :2]).all(axis=1)
    if not known.any():
        raise InputError("ball", "no known place", "a track with a ball", "choose a time in which the ball is tracked")
    path = interpolate_columns(times, times[known], np.asarray(ball, float)[known, :2])
    places = find_keeper_places(path, goal)
    if len(times) < 3:
        return places
    return smooth_zero_phase_hann(places, 1.0 / float(np.median(np.diff(times))), _SMOOTH_SECONDS)
