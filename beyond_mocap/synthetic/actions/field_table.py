"""The actions of field players: headers, tackles, throw-ins, kicks out of a stand, falls."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

from ..gestures import STRIKES, Gesture, adapt_to_run, build_strike, build_touch
from ..kicks import AFTER, BEFORE, KICKS, build_kick
from ..moves import build_get_up, build_throw_in
from ..volleys import build_volley
from .action import MOVES, Action, ActionSetting
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

_OUTSIDE_YAW = 34.0  # degrees that the toes are turned in where the outside of the foot meets the ball
_BALL_LIFT = 0.1  # m that the foot is guided higher in a goal kick: its toes would be below the ground


def _build_get_up(setting: ActionSetting) -> Gesture:
    return build_get_up(setting.skeleton, setting.fps, example=setting.example)


def _build_standing_kick(style: str, setting: ActionSetting) -> Gesture:
    motion = build_kick(KICKS[style], setting.neutral, fps=setting.fps, lift=_BALL_LIFT)
    return Gesture(motion, BEFORE, 0.1, BEFORE + AFTER - 0.3)


def _build_volley(kind: str, setting: ActionSetting) -> Gesture:
    return build_volley(kind, setting.skeleton, setting.fps, example=setting.example)


def _build_kick(kind: str, setting: ActionSetting) -> Gesture:
    return build_strike(kind, setting.skeleton, setting.fps, at_speed=setting.speed, example=setting.example)


def _build_outside_kick(setting: ActionSetting) -> Gesture:
    recipe = STRIKES["kick low top"]
    foot = tuple((*row[:5], row[5] + _OUTSIDE_YAW, row[6]) for row in recipe.foot)
    return build_touch(adapt_to_run(replace(recipe, foot=foot), setting.speed), setting.skeleton, setting.fps,
                       example=setting.example)


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
_KICKS = (
    *(Action(name=f"kick with the {part}", labels=frozenset({"kick", "low", label, "running", "foot", *more}),
             has_side=True, build=partial(_build_kick, kind), speeds=_RUNS)
      for part, label, kind, more in (("inside", "inside", "kick low inside", {"pass"}),
                                      ("instep", "top", "kick low top", ()))),
    Action(name="side-foot kick from a stand", build=partial(_build_standing_kick, "inside"), has_side=True,
           labels=frozenset({"kick", "low", "inside", "standing", "foot", "pass"})),
    Action(name="instep kick from a stand", labels=frozenset({"kick", "low", "top", "standing", "foot"}),
           build=partial(_build_standing_kick, "instep"), has_side=True),
    Action(name="lofted kick", labels=frozenset({"kick", "high", "top", "running", "foot"}), has_side=True,
           build=partial(_build_kick, "kick low top"), speeds=_RUNS, heights=(0.1, 0.4)),
    Action(name="lofted kick from a stand", labels=frozenset({"kick", "high", "top", "standing", "foot"}),
           has_side=True, build=partial(_build_standing_kick, "instep"), heights=(0.1, 0.4)),
    Action(name="lofted side-foot kick", labels=frozenset({"kick", "high", "inside", "running", "foot"}), has_side=True,
           build=partial(_build_kick, "kick low inside"), speeds=_RUNS),
    Action(name="lofted side-foot kick from a stand", has_side=True,
           labels=frozenset({"kick", "high", "inside", "standing", "foot"}),
           build=partial(_build_standing_kick, "inside")),
    Action(name="kick with the outside", labels=frozenset({"kick", "low", "outside", "running", "foot"}), has_side=True,
           build=_build_outside_kick, speeds=_RUNS),
    Action(name="kick with the outside from a stand", labels=frozenset({"kick", "low", "outside", "standing", "foot"}),
           has_side=True, build=lambda setting: _build_outside_kick(replace(setting, speed=_RUNS[0]))),
    Action(name="volley", labels=frozenset({"kick", "low", "volley", "standing", "foot", "pass"}), has_side=True,
           build=partial(_build_volley, "pass"), heights=(0.2, 0.6)),
    Action(name="high volley", labels=frozenset({"kick", "high", "top", "volley", "standing", "foot"}), has_side=True,
           build=partial(_build_volley, "attack"), heights=(0.5, 1.0)),
    Action(name="volley in a run", labels=frozenset({"kick", "low", "volley", "running", "foot"}), has_side=True,
           build=partial(_build_kick, "kick low top"), speeds=_RUNS, heights=(0.1, 0.6)),
    Action(name="goal kick", labels=frozenset({"goal_kick", "kick", "foot", "low", "top", "with_setup", "standing"}),
           build=partial(_build_standing_kick, "instep"), has_side=True),
    Action(name="overhead kick", labels=frozenset({"kick", "bicycle", "foot", "top", "back"}), build=build_bicycle_kick,
           has_side=True, heights=(1.4, 2.0)),
    Action(name="half overhead kick", labels=frozenset({"kick", "bicycle", "half", "foot", "top", "back"}),
           build=build_bicycle_kick, has_side=True, heights=(1.4, 2.0)),
)  # fmt: skip
_MOVES = (
    Action(name="jump", labels=frozenset({"jump", "standing"}), build=build_jumping_header),
    Action(name="jump in a run", labels=frozenset({"jump", "slide", "running"}), build=build_running_jump,
           speeds=_RUNS),
    Action(name="fall", labels=frozenset({"fall", "standing"}), build=build_fall),
    Action(name="fall in a run", labels=frozenset({"fall", "slide", "running"}), build=build_fall, speeds=_RUNS),
    Action(name="flight after a tackle", labels=frozenset({"fly", "slide"}), build=build_diving_header, speeds=_RUNS),
    Action(name="getting up from the front", labels=frozenset({"getting_up", "short_duration"}),
           build=build_quick_get_up),
    Action(name="getting up from the back", labels=frozenset({"getting_up", "long_duration", "back"}),
           build=_build_get_up),
    Action(name="sitting", labels=frozenset({"sitting"}), build=build_sitting, is_span=True),
    Action(name="lying", labels=frozenset({"ground"}), build=build_lying, is_span=True),
)
_REACHES = (
    Action(name="throw-in", labels=frozenset({"throwb", "throw", "high"}), build=_build_throw_in),
    *build_pose_actions(BALL_POSES),
    *(Action(name=name, labels=frozenset({label, "slide"}), build=build_slide_tackle, has_side=True, speeds=_RUNS,
             suits=_SLIDES)
      for name, label in (("slide tackle", "tackle"), ("sliding block", "block"),
                          ("sliding interception", "intercept"))),
)  # fmt: skip
FIELD_ACTIONS = (*_MOVES, *_HEADERS, *_KICKS, *_REACHES)
"""Rows for `table.ACTIONS`: of several that serve a request, the usual one first."""
