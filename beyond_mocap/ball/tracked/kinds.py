"""Classify touches: the body part that met the ball and what it did; find where the ball leaves the pitch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...motion.track import BALL_RADIUS

GOAL_HEIGHT = 2.44  # m
_MIN_INSIDE_SECONDS = 0.5  # s on the pitch before it can go out again


@dataclass(frozen=True)
class TouchKind:
    """A kind of touch.

    Attributes:
        name: identifier.
        ball: "sends", "takes", "carries" or "": what the touch does to the ball.
        labels: what a player does at it; () if there is no such label.
        event: kind of the corresponding event.
        details: details of that event.
    """

    name: str
    ball: str
    labels: tuple[str, ...]
    event: str
    details: tuple[str, ...] = ()


KICK, RECEIVE, DRIBBLE, HEADER, CHEST_CONTROL = "kick", "receive", "dribble", "header", "chest"
HEAD_CONTROL = "head"
THROW_IN, HAND, SAVE, DEFLECTION = "throw-in", "hand", "save", "deflection"

TOUCH_KINDS = (TouchKind(KICK, "sends", ("kick",), "pass"), TouchKind(RECEIVE, "takes", ("receive", "foot"), "receive"),
               TouchKind(DRIBBLE, "carries", ("dribble",), "dribble"), TouchKind(HEADER, "sends", ("header",), "pass"),
               TouchKind(CHEST_CONTROL, "takes", ("receive", "body"), "receive"),
               TouchKind(HEAD_CONTROL, "takes", ("receive", "head"), "receive"),
               TouchKind(THROW_IN, "sends", ("throwb",), "pass", ("throw-in",)),
               TouchKind(HAND, "takes", ("catchb",), "catch"), TouchKind(SAVE, "takes", ("catchb",), "save"),
               TouchKind(DEFLECTION, "", (), "deflection"))
KINDS = tuple(kind.name for kind in TOUCH_KINDS)
CHEST_HEIGHT, HEAD_HEIGHT = 0.95, 1.45  # m of the ball's centre, from which the chest, the head plays it
_MAX_DRIBBLE_SPEED = 7.0  # m/s relative to the player, faster than a dribble's touch
_MIN_PASS_SPEED = 4.0  # m/s, slower than a pass
_DEFLECTION_COSINE = np.cos(np.radians(50.0))  # a deflection changes direction by less than this angle
_THROW_IN_DISTANCE = 1.2  # m from the touch line, within which a throw-in is taken
_ON_LINE_DISTANCE = 0.35  # m inside the line, where a ball that was out is placed
_THROW_IN_PAUSE = 0.5  # s between the previous touch and a throw-in
_CORNER_DISTANCE = 1.5  # m from both lines within which a ball on the ground is kicked: the corner's arc, and noise
_FASTEST_THROW = 25.0  # m/s: the longest throw-ins, of some 50 m, leave with 21 to 23 m/s
_FASTEST_THROWER = 4.0  # m/s: of a half's 23 throw-ins 21 are at 0.2 to 2.8, two at 5.3 and 5.7 are balls kept in
AREA_DEPTH, AREA_WIDTH, GOAL_WIDTH = 16.5, 40.32, 7.32  # m
_MIN_SHOT_SPEED, _GOAL_MARGIN = 10.0, 1.5  # m/s towards the goal line; m beside the goal
_FOOT_HEIGHT, _HAND_HEIGHT = 0.35, 0.6  # m of the ball's centre: below, the foot; above, a keeper's hands


def choose_part(height: float | None) -> str:
    """Choose the body part that plays a ball at `height` m; None or NaN (unknown) gives the foot."""
    if height is None or not np.isfinite(height) or height < CHEST_HEIGHT:
        return "foot"
    return "chest" if height < HEAD_HEIGHT else "head"


def choose_touch_kind(part: str, before: np.ndarray, after: np.ndarray, same_next: bool, same_before: bool) -> str:
    """Choose the kind of a touch by foot, chest or head.

    Args:
        part: "foot", "chest" or "head".
        before: (3,) m/s of the ball before the touch, relative to the player.
        after: (3,) m/s after it.
        same_next: the same player has the next touch.
        same_before: the same player had the previous touch.
    Returns:
        One of KINDS.
    """
    fast_in, fast_out = np.linalg.norm(before[:2]), np.linalg.norm(after[:2])
    if part == "head":
        return HEAD_CONTROL if same_next and fast_out < _MIN_PASS_SPEED else HEADER
    if _is_deflection(before, after, fast_in, fast_out, same_next):
        return DEFLECTION
    if part == "chest" and fast_out < _MAX_DRIBBLE_SPEED:
        return CHEST_CONTROL
    if same_next and fast_out < _MAX_DRIBBLE_SPEED:
        return DRIBBLE if same_before and fast_in < _MIN_PASS_SPEED else RECEIVE
    return KICK


def _is_deflection(before, after, fast_in, fast_out, same_next) -> bool:
    if same_next or fast_in < 8.0 or fast_out < 0.35 * fast_in or fast_out > 1.1 * fast_in:
        return False
    return float(before[:2] @ after[:2]) > _DEFLECTION_COSINE * fast_in * fast_out


def is_throw_in(place: np.ndarray, before: np.ndarray, after: np.ndarray, since: float, speed: float,
                pitch: tuple[float, float]) -> bool:
    """Say whether a touch is a throw-in: a slow ball on the line or held, untouched for a while, that enters the pitch.

    Args:
        place: (3,) m of the ball.
        before: (3,) m/s before the touch.
        after: (3,) m/s after it.
        since: s since the previous touch.
        speed: m/s of the player.
        pitch: length and width m.
    Returns:
        True for a throw-in.
    """
    on_line = abs(place[1]) > pitch[1] / 2.0 - _ON_LINE_DISTANCE
    held = place[2] > CHEST_HEIGHT
    slow = np.linalg.norm(before[:2]) < _MIN_PASS_SPEED
    return bool(since > _THROW_IN_PAUSE and slow and (on_line or held)
                and is_from_touch_line(place, after, speed, pitch))


def is_from_touch_line(place: np.ndarray, after: np.ndarray, speed: float, pitch: tuple[float, float]) -> bool:
    """Say whether a ball is thrown into the pitch from its touch line; one on the ground at a corner is kicked, and so
    is one that a running player keeps in.

    Args:
        place: (3,) m of the ball.
        after: (3,) m/s after the touch.
        speed: m/s of the player.
        pitch: length and width m.
    """
    from_end, from_side = (half / 2.0 - abs(at) for half, at in zip(pitch, place))
    inward = -np.sign(place[1]) * after[1] > 0.0
    is_corner = max(from_end, from_side) < _CORNER_DISTANCE and not place[2] > CHEST_HEIGHT
    return bool(from_side < _THROW_IN_DISTANCE and inward and not is_corner and speed < _FASTEST_THROWER
                and 3.0 < np.linalg.norm(after[:2]) < _FASTEST_THROW)


def choose_keeper_kind(place: np.ndarray, before: np.ndarray, goal: float, known_height: bool) -> tuple[str,
        str] | None:
    """Choose part and kind of a goalkeeper's touch in their penalty area: a save, or a ball taken with the hands.

    Args:
        place: (3,) m of the ball.
        before: (3,) m/s before the touch.
        goal: m, x of the keeper's goal line.
        known_height: whether the feed has heights.
    Returns:
        (part, kind), or None if it is an ordinary touch.
    """
    away = abs(goal - place[0])
    if away > AREA_DEPTH or abs(place[1]) > AREA_WIDTH / 2.0:
        return None
    toward = float(np.sign(goal) * before[0])
    if toward > _MIN_SHOT_SPEED:
        across = place[1] + before[1] * away / toward
        if abs(across) < GOAL_WIDTH / 2.0 + _GOAL_MARGIN:
            return ("foot" if known_height and place[2] < _FOOT_HEIGHT else "hand"), SAVE
    return ("hand", HAND) if known_height and place[2] > _HAND_HEIGHT else None


def find_keepers(positions: np.ndarray, teams: list[str]) -> dict[str, int]:
    """Find each team's goalkeeper: the player farthest from the team's middle on average.

    Args:
        positions: (P, N, 2) m of the players, NaN where absent.
        teams: (P,) names.
    Returns:
        Player index by team; teams of fewer than four players have none.
    """
    found = {}
    middle = np.array([_find_median_x(path) for path in positions])
    for team in dict.fromkeys(teams):
        own = [index for index, name in enumerate(teams) if name == team and np.isfinite(middle[index])]
        if len(own) > 3:
            found[team] = max(own, key=lambda index: abs(middle[index] - np.median(middle[own])))
    return found


def _find_median_x(path: np.ndarray) -> float:
    there = path[np.isfinite(path[:, 0]), 0]
    return float(np.median(there)) if len(there) else np.nan


def limit_to_ground(height: float) -> float:
    """Limit a height of the ball's centre to its radius: some feeds give 0 for a ball on the ground."""
    return max(float(height), BALL_RADIUS) if np.isfinite(height) else BALL_RADIUS


@dataclass(frozen=True, kw_only=True)
class BallEnd:
    """The moment the whole ball crosses a line of the pitch.

    Attributes:
        time: s.
        kind: "goal", "goal line" or "touch line".
        x: m.
        y: m.
        player: id of the player who touched it last, "" if unknown.
    """

    time: float
    kind: str
    x: float
    y: float
    player: str = ""


def find_ball_ends(times: np.ndarray, ball: np.ndarray, length: float, width: float) -> list[BallEnd]:
    """Find the moments the ball leaves the pitch, interpolated between samples.

    Args:
        times: (N,) s.
        ball: (N, 3) m of the centre.
        length: m of the pitch.
        width: m of the pitch.
    Returns:
        The moments, in order.
    """
    over_end = np.abs(ball[:, 0]) - length / 2.0 - BALL_RADIUS
    over_side = np.abs(ball[:, 1]) - width / 2.0 - BALL_RADIUS
    beyond = np.maximum(over_end, over_side)
    leaves = np.flatnonzero((beyond[:-1] <= 0.0) & (beyond[1:] > 0.0)) + 1
    found: list[BallEnd] = []
    for index in leaves:
        share = -beyond[index - 1] / (beyond[index] - beyond[index - 1])
        time = float(times[index - 1] + share * (times[index] - times[index - 1]))
        since = (times > time - _MIN_INSIDE_SECONDS) & (times < time)
        if found and not (beyond[since] <= 0.0).all():
            continue
        place = ball[index - 1] + share * (ball[index] - ball[index - 1])
        kind = "touch line" if over_side[index] >= over_end[index] else _choose_end_kind(place)
        found.append(BallEnd(time=time, kind=kind, x=float(place[0]), y=float(place[1])))
    return found


def _choose_end_kind(place: np.ndarray) -> str:
    within = abs(place[1]) < GOAL_WIDTH / 2.0 - BALL_RADIUS
    under = not np.isfinite(place[2]) or place[2] < GOAL_HEIGHT - BALL_RADIUS
    return "goal" if within and under else "goal line"
