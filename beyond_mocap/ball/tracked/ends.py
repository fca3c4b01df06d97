"""Where play ends: the ball over the goal line between the posts, or over any line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...motion.track import BALL_RADIUS
from .kinds import GOAL_WIDTH

GOAL_HEIGHT = 2.44  # m
_BACK = 0.5  # s in the field before it can go out again


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
