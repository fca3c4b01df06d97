"""What a touch was: the part that met the ball, and a word for what it did; where play ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...motion.track import BALL_RADIUS

GOAL_HEIGHT = 2.44  # m
_BACK = 0.5  # s in the field before it can go out again


@dataclass(frozen=True)
class TouchKind:
    """What a touch was. ball: "sends", "takes", "carries" or "". labels: of what a player does at it, () where it is no
    wish. event, details: kind and details of an event like it."""

    name: str
    ball: str
    labels: tuple[str, ...]
    event: str
    details: tuple[str, ...] = ()


KICK, RECEIVE, DRIBBLE, HEADER, CHESTED = "kick", "receive", "dribble", "header", "chest"
THROW_IN, HAND, SAVE, DEFLECTION = "throw-in", "hand", "save", "deflection"

TOUCH_KINDS = (TouchKind(KICK, "sends", ("kick",), "pass"), TouchKind(RECEIVE, "takes", ("receive", "foot"), "receive"),
               TouchKind(DRIBBLE, "carries", ("dribble",), "dribble"), TouchKind(HEADER, "sends", ("header",), "pass"),
               TouchKind(CHESTED, "takes", ("receive", "body"), "receive"),
               TouchKind(THROW_IN, "sends", ("throwb",), "pass", ("throw-in",)),
               TouchKind(HAND, "takes", ("catchb",), "catch"), TouchKind(SAVE, "takes", ("catchb",), "save"),
               TouchKind(DEFLECTION, "", (), "deflection"))
KINDS = tuple(kind.name for kind in TOUCH_KINDS)
CHEST, HEAD = 0.95, 1.45  # m of the ball's centre from which the chest, the head meets it
_FAST = 7.0  # m/s relative to the player, more than a dribble's touch
_STOPPED = 4.0  # m/s, less than a pass
_TURN = np.cos(np.radians(50.0))  # a deflection keeps to its way within this
_LINE = 1.2  # m, beyond or before the touch line, where a throw-in is taken
_ON_LINE = 0.35  # m before it, where a ball lies that was out
_STILL = 0.5  # s between the touch before and a throw-in
AREA_DEPTH, AREA_WIDTH, GOAL_WIDTH = 16.5, 40.32, 7.32  # m
_SHOT, _BESIDE = 10.0, 1.5  # m/s toward the goal line; m beside the goal
_LOW, _HELD = 0.35, 0.6  # m of the ball's centre: below, a foot's; above, a keeper's hands


def part_of(height: float | None) -> str:
    """The part of a body that meets a ball at `height` m, None where unknown."""
    if height is None or not np.isfinite(height) or height < CHEST:
        return "foot"
    return "chest" if height < HEAD else "head"


def kind_of(part: str, before: np.ndarray, after: np.ndarray, same_next: bool, same_before: bool) -> str:
    """The word for a touch by foot, chest or head: before, after (3,) m/s relative to the player.

    same_next, same_before: whether the same player has the next touch, had the one before."""
    fast_in, fast_out = np.linalg.norm(before[:2]), np.linalg.norm(after[:2])
    if part == "head":
        return HEADER
    if _is_deflection(before, after, fast_in, fast_out, same_next):
        return DEFLECTION
    if part == "chest" and fast_out < _FAST:
        return CHESTED
    if same_next and fast_out < _FAST:
        return DRIBBLE if same_before and fast_in < _STOPPED else RECEIVE
    return KICK


def _is_deflection(before, after, fast_in, fast_out, same_next) -> bool:
    if same_next or fast_in < 8.0 or fast_out < 0.35 * fast_in or fast_out > 1.1 * fast_in:
        return False
    return float(before[:2] @ after[:2]) > _TURN * fast_in * fast_out


def is_throw_in(place: np.ndarray, before: np.ndarray, after: np.ndarray, since: float, width: float) -> bool:
    """Whether a ball that nobody has touched for `since` s, slow, on its line or held there, leaves it by a throw-in.

    place (3,) m; before, after (3,) m/s."""
    on_line = abs(place[1]) > width / 2.0 - _ON_LINE
    held = place[2] > CHEST
    slow = np.linalg.norm(before[:2]) < _STOPPED
    return bool(since > _STILL and slow and (on_line or held) and leaves_line(place, after, width))


def leaves_line(place: np.ndarray, after: np.ndarray, width: float) -> bool:
    """Whether a ball comes into the field from its touch line."""
    inward = -np.sign(place[1]) * after[1] > 0.0
    return bool(abs(place[1]) > width / 2.0 - _LINE and inward and np.linalg.norm(after[:2]) > 3.0)


def keeper_kind(place: np.ndarray, before: np.ndarray, goal: float, known_height: bool) -> tuple[str, str] | None:
    """Part and word of a touch by a goalkeeper in his area: a save of a shot, or a ball taken with the hands.

    place (3,) m, before (3,) m/s; goal: x of his goal line. None where it is a touch like any other's."""
    away = abs(goal - place[0])
    if away > AREA_DEPTH or abs(place[1]) > AREA_WIDTH / 2.0:
        return None
    toward = float(np.sign(goal) * before[0])
    if toward > _SHOT:
        across = place[1] + before[1] * away / toward
        if abs(across) < GOAL_WIDTH / 2.0 + _BESIDE:
            return ("foot" if known_height and place[2] < _LOW else "hand"), SAVE
    return ("hand", HAND) if known_height and place[2] > _HELD else None


def keepers(positions: np.ndarray, teams: list[str]) -> dict[str, int]:
    """For each team the player who stands deepest on the whole (index): its goalkeeper."""
    found = {}
    middle = np.array([_middle(path) for path in positions])
    for team in dict.fromkeys(teams):
        own = [index for index, name in enumerate(teams) if name == team and np.isfinite(middle[index])]
        if len(own) > 3:
            found[team] = max(own, key=lambda index: abs(middle[index] - np.median(middle[own])))
    return found


def _middle(path: np.ndarray) -> float:
    there = path[np.isfinite(path[:, 0]), 0]
    return float(np.median(there)) if len(there) else np.nan


def ground_height(height: float) -> float:
    """The height of the ball's centre: some feeds say 0 for a ball on the ground."""
    return max(float(height), BALL_RADIUS) if np.isfinite(height) else BALL_RADIUS


@dataclass(frozen=True, kw_only=True)
class BallEnd:
    """The whole ball over a line: time s; kind "goal", "goal line" or "touch line"; x, y m; player: who touched it last
    ("" unknown)."""

    time: float
    kind: str
    x: float
    y: float
    player: str = ""


def ball_ends(times: np.ndarray, ball: np.ndarray, length: float, width: float) -> list[BallEnd]:
    """The moments in which the ball (N, 3) m leaves a pitch of `length` x `width` m, between samples."""
    over_end = np.abs(ball[:, 0]) - length / 2.0 - BALL_RADIUS
    over_side = np.abs(ball[:, 1]) - width / 2.0 - BALL_RADIUS
    beyond = np.maximum(over_end, over_side)
    leaves = np.flatnonzero((beyond[:-1] <= 0.0) & (beyond[1:] > 0.0)) + 1
    found: list[BallEnd] = []
    for index in leaves:
        share = -beyond[index - 1] / (beyond[index] - beyond[index - 1])
        time = float(times[index - 1] + share * (times[index] - times[index - 1]))
        since = (times > time - _BACK) & (times < time)
        if found and not (beyond[since] <= 0.0).all():
            continue
        place = ball[index - 1] + share * (ball[index] - ball[index - 1])
        kind = "touch line" if over_side[index] >= over_end[index] else _by_goal(place)
        found.append(BallEnd(time=time, kind=kind, x=float(place[0]), y=float(place[1])))
    return found


def _by_goal(place: np.ndarray) -> str:
    within = abs(place[1]) < GOAL_WIDTH / 2.0 - BALL_RADIUS
    under = not np.isfinite(place[2]) or place[2] < GOAL_HEIGHT - BALL_RADIUS
    return "goal" if within and under else "goal line"
