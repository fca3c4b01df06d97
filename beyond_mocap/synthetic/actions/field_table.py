"""The actions of field players: headers, tackles, throw-ins, falls."""

from __future__ import annotations

import math

from ..gestures import Gesture
from ..moves import build_throw_in
from .action import MOVES, Action, ActionSetting
from .ball_poses import BALL_POSES
from .floor import (
    build_bicycle_kick,
    build_diving_header,
    build_fall,
    build_half_bicycle_kick,
    build_lying,
    build_quick_get_up,
    build_sitting,
    build_sitting_with_ball,
    build_slide_tackle,
    build_slow_get_up,
)
from .headers import build_jumping_header, build_running_header, build_running_jump, build_standing_header
from .pose_table import build_pose_actions


def _build_throw_in(setting: ActionSetting) -> Gesture:
    return build_throw_in(setting.skeleton, setting.fps, example=setting.example)


_RUNS = (2.2, 3.2, 4.4, 5.6, 6.8)  # m/s at which actions in a run are built
_SLIDES = (3.0, math.inf)  # m/s of players who slide to a ball; slower ones reach for it

_HEADERS = (
    Action(name="standing header", labels=frozenset({"header", "head", "standing"}), build=build_standing_header,
           heights=(1.5, 1.9)),
    Action(name="jumping header", labels=frozenset({"header", "head", "standing", "jump"}), build=build_jumping_header,
           heights=(1.9, 2.6)),
    Action(name="running header", labels=frozenset({"header", "head", "running", "jump"}), build=build_running_header,
           speeds=_RUNS, heights=(1.6, 2.6)),
    Action(name="diving header", labels=frozenset({"header", "head", "dive"}), build=build_diving_header, speeds=_RUNS,
           heights=(0.4, 1.4), suits=MOVES),
)  # fmt: skip
_OVERHEAD_KICKS = tuple(
    Action(name=name, labels=frozenset({"kick", "bicycle", "foot", "top", *more}), build=build,
           needs=frozenset({"bicycle"}), has_side=True, heights=heights)
    for name, more, build, heights in (
        ("overhead kick", ("back",), build_bicycle_kick, (1.4, 2.0)),
        ("half overhead kick", ("half",), build_half_bicycle_kick, (0.9, 1.5)),
    )
)
_MOVES = (
    Action(name="jump", labels=frozenset({"jump", "standing"}), build=build_jumping_header),
    Action(name="jump in a run", labels=frozenset({"jump", "slide", "running"}), build=build_running_jump,
           needs=frozenset({"jump"}), speeds=_RUNS),
    Action(name="fall", labels=frozenset({"fall", "standing"}), build=build_fall),
    Action(name="fall in a run", labels=frozenset({"fall", "slide", "running"}), build=build_fall,
           needs=frozenset({"fall"}), speeds=_RUNS),
    Action(name="flight after a tackle", labels=frozenset({"fly", "slide"}), build=build_diving_header,
           needs=frozenset({"fly"}), speeds=_RUNS),
    Action(name="getting up from the front", labels=frozenset({"getting_up", "short_duration"}),
           build=build_quick_get_up),
    Action(name="getting up from the back", labels=frozenset({"getting_up", "long_duration", "back"}),
           build=build_slow_get_up),
    Action(name="sitting", labels=frozenset({"sitting"}), build=build_sitting, is_span=True),
    Action(name="lying", labels=frozenset({"ground"}), build=build_lying, is_span=True),
)
_REACHES = (
    Action(name="throw-in", labels=frozenset({"throwb", "throw", "high"}), build=_build_throw_in),
    *build_pose_actions(BALL_POSES),
    Action(name="sitting with the ball", labels=frozenset({"hold", "sitting"}), build=build_sitting_with_ball,
           needs=frozenset({"hold", "sitting"}), is_span=True),
    *(Action(name=name, labels=frozenset({label, "slide", "foot", "low", "running", "front"}), has_side=True,
             build=build_slide_tackle, speeds=_RUNS, suits=_SLIDES)
      for name, label in (("slide tackle", "tackle"), ("sliding block", "block"),
                          ("sliding interception", "intercept"))),
)  # fmt: skip
FIELD_ACTIONS = (*_MOVES, *_HEADERS, *_OVERHEAD_KICKS, *_REACHES)
"""Rows for `table.ACTIONS`: of several that serve a request, the usual one first."""
