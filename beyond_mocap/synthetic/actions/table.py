"""Every synthetic action, one row each: to add one, add a row.

Of several rows that answer to the requested labels the one with the fewest other labels is taken, then the first.
"""

from __future__ import annotations

from ..gestures import Gesture
from ..moves import build_header, build_throw_in
from .action import Action, ActionSetting
from .pose_table import POSE_ACTIONS


def _build_header(setting: ActionSetting) -> Gesture:
    return build_header(setting.skeleton, setting.fps, example=setting.example)


def _build_throw_in(setting: ActionSetting) -> Gesture:
    return build_throw_in(setting.skeleton, setting.fps, example=setting.example)


ACTIONS = (
    Action(name="jumping header", labels=frozenset({"header", "head", "standing", "jump"}), build=_build_header),
    Action(name="throw-in", labels=frozenset({"throwb", "throw", "high"}), build=_build_throw_in),
    *POSE_ACTIONS,
)
