"""The actions of field players: headers, tackles, throw-ins, kicks out of a stand, falls."""

from __future__ import annotations

import numpy as np

from ..moves import build_throw_in
from ..gestures import Gesture
from .action import Action, ActionSetting
from .floor import build_diving_header, build_slide_tackle
from .headers import build_jumping_header, build_running_header, build_standing_header


def _build_throw_in(setting: ActionSetting) -> Gesture:
    return build_throw_in(setting.skeleton, setting.fps, example=setting.example)


# m/s at which actions in a run are built, and of players who stand and who move
_RUNS, _STANDS, _MOVES = (2.4, 3.4, 4.4, 5.6, 6.8), (0.0, 1.6), (1.6, np.inf)

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
    Action(name="throw-in", labels=frozenset({"throwb", "throw", "high"}), build=_build_throw_in),
)
