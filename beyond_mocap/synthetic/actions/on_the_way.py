"""What a foot does at the ball in a walk or a run beside taking and kicking it: scissors, a block tackle, an
interception.

Each is guided as a reception's foot is (`receptions`). Out of a stand they are tables of key poses (`ball_poses`); for
players who move these would be dragged along. Angles and times are by judgement, after those tables.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ..gestures import Gesture, build_touch
from .action import Action, ActionSetting
from .receptions import SPEEDS, Reception, travel_with_ball

_MOVES_FROM = 0.9  # m/s of players from which on these are played

_ON_THE_WAY = {
    "scissors": Reception(
        name="scissors feint on the way", labels=("scissors",), speeds=(1.2, 4.9), heights=(), slows=0.5,
        foot=(
            (-0.16, 0.30, -0.04, 0.170, 8, 10, 0),
            (0.0, 0.44, -0.06, 0.290, 4, 4, 0), (0.08, 0.42, -0.20, 0.250, 2, -8, 0),
            (0.17, 0.30, -0.30, 0.160, 2, -10, 0), (0.28, 0.16, -0.26, 0.100, 0, -8, 0),
        ),
        pelvis=((-0.20, 2, 5, 10), (0.0, 0, 5, 0), (0.20, -4, 5, -14)),
        spine=((-0.20, 4, 12, 4), (0.05, -2, 14, -4), (0.22, -8, 14, -4)), nod=18.0,
    ),
    "block": Reception(
        name="block tackle on the way", labels=("tackle", "block", "foot", "inside", "low"), speeds=(1.2, 4.9),
        heights=(), low=0.10,
        foot=(
            (-0.16, 0.18, -0.14, 0.160, 0, -50, -2),
            (0.0, 0.38, -0.10, 0.125, -2, -74, -4), (0.08, 0.42, -0.09, 0.125, -2, -74, -4),
            (0.17, 0.34, -0.11, 0.140, 0, -56, -2), (0.28, 0.20, -0.12, 0.110, 0, -20, 0),
        ),
        pelvis=((-0.20, 0, 8, -12), (0.0, -2, 8, -4), (0.20, -2, 8, 4)),
        spine=((-0.20, 0, 16, 8), (0.0, 2, 20, 2), (0.20, 2, 18, -2)), nod=20.0,
    ),
    "intercept": Reception(
        name="interception on the way", labels=("intercept", "foot", "inside", "short_duration"),
        speeds=(1.2, 6.9), heights=(), low=0.06, slows=0.3,
        foot=(
            (-0.16, 0.36, -0.14, 0.150, 0, -40, -2),
            (0.0, 0.50, -0.15, 0.125, -4, -60, -4), (0.08, 0.44, -0.15, 0.125, -3, -60, -4),
            (0.17, 0.32, -0.14, 0.125, -2, -46, -2), (0.28, 0.18, -0.12, 0.110, 0, -16, 0),
        ),
        pelvis=((-0.20, 2, 6, 8), (0.0, 2, 8, 12), (0.20, 2, 4, 0)), nod=20.0,
    ),
}  # fmt: skip


def _build_moving(one: Reception, setting: ActionSetting) -> Gesture:
    return build_touch(travel_with_ball(one, setting.speed), setting.skeleton, setting.fps, example=setting.example)


def _build_row(one: Reception) -> Action:
    """Build the row of one of them: players who move have it instead of the one out of a stand."""
    return Action(
        name=one.name, labels=frozenset({*one.labels, "running", "front"}), has_side=True, suits=(_MOVES_FROM, np.inf),
        build=partial(_build_moving, one),
        speeds=tuple(speed for speed in SPEEDS if one.speeds[0] <= speed <= one.speeds[1]),
    )  # fmt: skip


ON_THE_WAY_ACTIONS = tuple(map(_build_row, _ON_THE_WAY.values()))
"""Rows for `table.ACTIONS`."""
