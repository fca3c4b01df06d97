"""The actions of field players: headers, tackles, throw-ins, falls."""

from __future__ import annotations

import numpy as np

from ..gestures import Gesture
from ..moves import build_get_up, build_throw_in
from .action import Action, ActionSetting
from .ball_poses import BALL_POSES
from .floor import (
    build_bicycle_kick,
    build_diving_header,
    build_fall,
    build_lying,
    build_quick_get_up,
    build_sitting,
    build_slide_tackle,
)
from .headers import build_jumping_header, build_running_header, build_running_jump, build_standing_header
from .pose_table import build_pose_actions


def _build_get_up(setting: ActionSetting) -> Gesture:
    return build_get_up(setting.skeleton, setting.fps, example=setting.example)


def _build_throw_in(setting: ActionSetting) -> Gesture:
    return build_throw_in(setting.skeleton, setting.fps, example=setting.example)


# m/s at which actions in a run are built, and of players who stand and who move
_RUNS, _STANDS, _MOVES = (2.2, 3.2, 4.4, 5.6, 6.8), (0.0, 1.1), (1.1, np.inf)

FIELD_ACTIONS = (
    Action(name="standing header", labels=frozenset({"header", "head", "standing"}), build=build_standing_header,
           heights=(1.5, 1.9), suits=_STANDS),
    Action(name="jumping header", labels=frozenset({"header", "head", "standing", "jump"}), build=build_jumping_header,
           heights=(1.9, 2.6), suits=_STANDS),
    Action(name="running header", labels=frozenset({"header", "head", "running", "jump"}), build=build_running_header,
           speeds=_RUNS, heights=(1.6, 2.6), suits=_MOVES),
    Action(name="diving header", labels=frozenset({"header", "head", "dive"}), build=build_diving_header, speeds=_RUNS,
           heights=(0.4, 1.4), suits=_MOVES),
    Action(name="slide tackle", labels=frozenset({"tackle", "slide"}), build=build_slide_tackle, has_side=True,
           speeds=_RUNS),
    Action(name="overhead kick", labels=frozenset({"kick", "bicycle", "foot", "top", "back"}), build=build_bicycle_kick,
           has_side=True, heights=(1.4, 2.0)),
    Action(name="half overhead kick", labels=frozenset({"kick", "bicycle", "half", "foot", "top", "back"}),
           build=build_bicycle_kick, has_side=True, heights=(1.4, 2.0)),
    Action(name="fall", labels=frozenset({"fall", "standing"}), build=build_fall, suits=_STANDS),
    Action(name="fall in a run", labels=frozenset({"fall", "slide", "running"}), build=build_fall, speeds=_RUNS,
           suits=_MOVES),
    Action(name="flight after a tackle", labels=frozenset({"fly", "slide"}), build=build_diving_header, speeds=_RUNS),
    Action(name="getting up from the front", labels=frozenset({"getting_up", "short_duration"}),
           build=build_quick_get_up),
    Action(name="getting up from the back", labels=frozenset({"getting_up", "long_duration", "back"}),
           build=_build_get_up),
    Action(name="jump", labels=frozenset({"jump", "standing"}), build=build_jumping_header, suits=_STANDS),
    Action(name="jump in a run", labels=frozenset({"jump", "slide", "running"}), build=build_running_jump, speeds=_RUNS,
           suits=_MOVES),
    Action(name="sliding block", labels=frozenset({"block", "slide"}), build=build_slide_tackle, has_side=True,
           speeds=_RUNS),
    Action(name="sliding interception", labels=frozenset({"intercept", "slide"}), build=build_slide_tackle,
           has_side=True, speeds=_RUNS),
    Action(name="sitting", labels=frozenset({"sitting"}), build=build_sitting, is_span=True),
    Action(name="lying", labels=frozenset({"ground"}), build=build_lying, is_span=True),
    *build_pose_actions(BALL_POSES),
    Action(name="throw-in", labels=frozenset({"throwb", "throw", "high"}), build=_build_throw_in),
)
