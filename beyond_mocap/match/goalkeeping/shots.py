"""Shots at goal, from the solved ball: who shoots when, where the ball passes the goalkeeper, and how it ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...ball.tracked import kinds
from ...ball.tracked.kinds import BallEnd
from ...ball.tracked.solve import SolvedBall, SolvedTouch
from ...base.time_series import interpolate_columns
from ...motion.track.match_data import Match

SAVED, GOAL, OTHER = "saved", "goal", "other"
"""How a shot ends: at the goalkeeper, in the goal, or otherwise (wide, blocked)."""

MIN_SPEED, MAX_DISTANCE = 12.0, 35.0
"""m/s of the ball, and m to the goal line, of a shot; a header may be slower by a third."""

_MARGIN = 1.5  # m beside the posts up to which a shot makes the goalkeeper act
_SLOW_HEADER = 2.0 / 3.0
_KINDS = (kinds.KICK, kinds.HEADER, kinds.DEFLECTION)
_LONGEST = 3.0  # s of a shot
_STEP = 0.01  # s between the places of the ball
_LAUNCH_SECONDS = 0.5  # s before a ball arrives at which a diving goalkeeper begins to push off (Ibrahim et al. 2019)


@dataclass(frozen=True, kw_only=True)
class Shot:
    """A shot.

    Attributes:
        time: s.
        shooter: id.
        keeper: id of the goalkeeper.
        end: SAVED, GOAL or OTHER.
        arrival: s at which the ball is at the goalkeeper, NaN where it does not come there.
        place: (3,) m of the ball's centre then, NaN as above.
        lateral: m from the goalkeeper's place before they move for it to the ball, square to its way; to their left
            positive.
        moved: m that the goalkeeper moves from the shot until then, as `lateral`.
        save: index of the touch that saves it, -1 without one.
        confidence: 0 to 1.
    """

    time: float
    shooter: str
    keeper: str
    end: str
    arrival: float
    place: tuple[float, float, float]
    lateral: float
    moved: float
    save: int
    confidence: float


def find_shots(match: Match, solved: SolvedBall, goal_lines: Mapping[str, np.ndarray]) -> tuple[Shot, ...]:
    """Find the shots of a match.

    Args:
        match: the match, N samples.
        solved: its ball.
        goal_lines: id of each goalkeeper -> (N,) m, x of the goal line that they keep, NaN where they keep none.
    Returns:
        The shots, in order of time.
    """
    found = []
    for number, touch in enumerate(solved.touches):
        goal = _find_goal(match, goal_lines, touch) if touch.kind in _KINDS and touch.player else None
        if goal is not None and _is_shot(touch, goal[1]):
            found.append(_build_shot(match, solved, number, *goal))
    return tuple(found)


def _find_goal(match: Match, goal_lines: Mapping[str, np.ndarray], touch: SolvedTouch) -> tuple[str, float] | None:
    """Find the goalkeeper of the other team who is present, and their goal line; None without one."""
    teams = {player.id: player.team for player in match.players}
    at = int(np.clip(np.searchsorted(match.times, touch.time), 0, len(match.times) - 1))
    for row, player in enumerate(match.players):
        line = goal_lines.get(player.id)
        if line is None or player.team == teams.get(touch.player):
            continue
        if np.isfinite(line[at]) and np.isfinite(match.positions[row, at]).all():
            return player.id, float(line[at])
    return None


def _is_shot(touch: SolvedTouch, goal: float) -> bool:
    """Say whether a touch sends the ball at a goal, fast enough and near enough."""
    away, toward = abs(goal - touch.position[0]), float(np.sign(goal) * touch.after[0])
    least = MIN_SPEED * (_SLOW_HEADER if touch.part == "head" else 1.0)
    if away > MAX_DISTANCE or toward <= 0.0 or np.linalg.norm(touch.after) < least:
        return False
    return bool(abs(touch.position[1] + touch.after[1] * away / toward) < 0.5 * kinds.GOAL_WIDTH + _MARGIN)


def _build_shot(match: Match, solved: SolvedBall, number: int, keeper: str, goal: float) -> Shot:
    """Build the shot of a touch: follow the ball until a player touches it or it leaves the pitch."""
    touch, following = solved.touches[number], solved.touches[number + 1 : number + 2]
    until = min([touch.time + _LONGEST, *(other.time for other in following)])
    left = next((end for end in solved.ends if touch.time < end.time <= until), None)
    is_save = bool(following) and left is None and following[0].player == keeper and following[0].time <= until
    end = SAVED if is_save else GOAL if left is not None and left.kind == "goal" else OTHER
    arrival, place = np.nan, np.full(3, np.nan)
    if is_save:
        arrival, place = following[0].time, following[0].position
    elif end == GOAL:
        arrival, place = _find_passing(match, solved, keeper, touch.time, end=left, goal=goal)
    lateral, moved = _measure_lateral(match, keeper, touch, float(arrival), place)
    return Shot(time=touch.time, shooter=touch.player, keeper=keeper, end=end, arrival=float(arrival),
                place=(float(place[0]), float(place[1]), float(place[2])), lateral=lateral, moved=moved,
                save=number + 1 if is_save else -1,
                confidence=min([touch.confidence, *(other.confidence for other in following if is_save)]))


def _find_passing(match: Match, solved: SolvedBall, keeper: str, start: float, end: BallEnd,
                  goal: float) -> tuple[float, np.ndarray]:
    """Find when, s, and where (3,) m the ball passes the goalkeeper on its way into the goal."""
    times = np.arange(start, end.time + 0.5 * _STEP, _STEP)
    ball, side = solved.ball.at(times), np.sign(goal)
    beyond = np.flatnonzero(side * (ball[:, 0] - _find_place(match, keeper, times)[:, 0]) >= 0.0)
    passed = int(beyond[0]) if len(beyond) else len(times) - 1
    return float(times[passed]), ball[passed]


def _measure_lateral(match: Match, keeper: str, touch: SolvedTouch, arrival: float,
                     place: np.ndarray) -> tuple[float, float]:
    """Measure how far the ball passes from where the goalkeeper waits, and how far they move meanwhile, m, to their
    left positive.
    """
    if not np.isfinite(arrival):
        return np.nan, np.nan
    times = np.array([touch.time, max(touch.time, arrival - _LAUNCH_SECONDS), arrival])
    before, waits, after = _find_place(match, keeper, times)
    way = place[:2] - touch.position[:2]
    way = way / max(float(np.linalg.norm(way)), 1e-9)
    left = np.array([way[1], -way[0]])
    return float((place[:2] - waits) @ left), float((after - before) @ left)


def _find_place(match: Match, player: str, times: np.ndarray) -> np.ndarray:
    """Return a player's places (K, 2) m at `times` (K,) s, NaN while they are absent."""
    row = [one.id for one in match.players].index(player)
    return interpolate_columns(times, match.times, match.positions[row], fill_value=np.nan)


def list_shots_at(shots: Sequence[Shot], keeper: str) -> list[Shot]:
    """List the shots at one goalkeeper."""
    return [shot for shot in shots if shot.keeper == keeper]
