"""The kicks of players whose library shows none: on the run, in a walk and out of a stand.

A kick on the way is a synthetic swing on running legs (`synthetic.running_kicks`), as the swings of a library's own
kicker are laid on them. It is as hard as the ball is fast, and its foot is as high as the ball.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..gestures import Gesture
from ..kick_styles import KICK_STYLES
from ..kicks import AFTER, BEFORE, build_kick
from ..recorded_kicks import PLAYBACK_RATES
from ..running_kicks import Swing, build_running_kick, build_swing, measure_foot_speed
from ..volleys import build_volley
from .action import Action, ActionSetting

_RUNS, _WALKS = (2.2, 3.2, 4.4, 5.6, 6.8), (1.2,)
_WALKING, _RUNNING = 0.7, 2.0  # m/s from which a kick is one in a walk, and on the run as in `match.labels`
_BALLS = (6.0, 9.0, 13.0, 18.0)
"""m/s of leaving balls for which kicks are built; the hardest swing is that of the last one."""
_BALL_OVER_FOOT = 1.18  # of speeds: the middle of 1.06 to 1.3 (Kellis and Katis 2007, J Sports Sci Med 6, 154-165)
_DIRECTIONS, _HIGH_DIRECTIONS = (-15.0, 30.0), (10.0,)  # degrees from the run, left positive, of a right foot
_BALL_RADIUS = 0.11  # m
_MOST_LIFT = 0.4  # m of an adult by which a swing at a resting ball can be guided higher
_TOE_LIFT = 0.1  # m of an adult that the foot of a kick out of a stand is higher: its toes would be below the ground
_LOW, _HIGH, _VOLLEY = (0.1, 0.4), (0.4, 2.0), (0.2, 0.6)  # m of the ball


@dataclass(frozen=True, kw_only=True)
class _Kind:
    """A kind of kick.

    Attributes:
        name: of its actions.
        labels: without the pace.
        style: one of `KICK_STYLES`.
        volley: one of `volleys.VOLLEYS`, out of a stand; empty: three steps to the ball.
        heights: m of the ball.
        directions: degrees in which it is built.
        varies: name of the kind beside which it is offered.
    """

    name: str
    labels: str
    style: str
    heights: tuple[float, float]
    volley: str = ""
    directions: tuple[float, ...] = _DIRECTIONS
    varies: str = ""


_KINDS = (
    _Kind(name="inside kick", labels="low inside pass", style="inside", heights=_LOW),
    _Kind(name="instep kick", labels="low top", style="instep", heights=_LOW, varies="inside kick"),
    _Kind(name="outside kick", labels="low outside", style="outside", heights=_LOW),
    _Kind(name="toe poke", labels="low toe", style="toe poke", heights=_LOW),
    _Kind(name="back heel", labels="low heel back", style="back heel", heights=_LOW, directions=(180.0,)),
    _Kind(name="chip", labels="low top chip", style="chip", heights=_LOW),
    _Kind(name="cross", labels="low top cross", style="cross", heights=_LOW),
    _Kind(name="half volley", labels="low half_volley", style="half volley", heights=_LOW),
    _Kind(name="volley", labels="low volley top", style="instep", volley="pass", heights=_VOLLEY,
          directions=_HIGH_DIRECTIONS),
    _Kind(name="high instep kick", labels="high top volley", style="instep", volley="attack",
          heights=_HIGH, directions=_HIGH_DIRECTIONS),
    _Kind(name="high inside kick", labels="high inside", style="inside", heights=_HIGH,
          directions=_HIGH_DIRECTIONS, varies="high instep kick"),
)


def _compute_lift(setting: ActionSetting) -> float:
    """Compute by how much, m of an adult, the ball lies higher than on the ground."""
    height = _BALL_RADIUS if setting.height is None else setting.height
    return float(np.clip((height - _BALL_RADIUS) / setting.scale, 0.0, _MOST_LIFT))


def _compute_rate(swing: Swing, setting: ActionSetting) -> float:
    """Compute the playback rate at which a swing is as fast as its ball needs; as it is where that is unknown."""
    if setting.exit_speed is None:
        return 1.0
    return float(np.clip(setting.exit_speed / _BALL_OVER_FOOT / measure_foot_speed(swing), *PLAYBACK_RATES))


def _build_on_the_way(kind: _Kind, setting: ActionSetting) -> Gesture:
    swing = build_swing(kind.style, setting.neutral, lift=_compute_lift(setting))
    return build_running_kick(swing, setting.speed, setting.neutral, direction=np.radians(setting.direction),
                              rate=_compute_rate(swing, setting), fps=setting.fps)


def _build_from_a_stand(kind: _Kind, setting: ActionSetting) -> Gesture:
    if kind.volley:
        return _build_standing_volley(kind.volley, setting)
    rate = _compute_rate(build_swing(kind.style, setting.neutral), setting)
    lift = max(_TOE_LIFT, _compute_lift(setting))
    motion = build_kick(KICK_STYLES[kind.style], setting.neutral, fps=setting.fps, lift=lift, rate=rate)
    return Gesture(motion, BEFORE / rate, 0.1, (BEFORE + AFTER) / rate - 0.3)


def _build_standing_volley(kind: str, setting: ActionSetting) -> Gesture:
    build = partial(build_volley, kind, setting.skeleton, setting.fps, example=setting.example)
    usual = build()
    return build(speed=_compute_rate(Swing(motion=usual.motion, contact=usual.key * setting.fps), setting))


def _build_rows(kind: _Kind) -> tuple[Action, ...]:
    """Build the rows of a kind: on the run, in a walk, out of a stand."""
    rows = (("on the run", "running", _RUNS, (_RUNNING, np.inf)), ("in a walk", "standing", _WALKS,
            (_WALKING, _RUNNING)), ("from a stand", "standing", (), (0.0, _WALKING)))
    return tuple(
        Action(name=f"{kind.name} {manner}", labels=frozenset({"kick", "foot", pace, *kind.labels.split()}),
               build=partial(_build_on_the_way if speeds else _build_from_a_stand, kind), has_side=True,
               speeds=speeds, heights=kind.heights, exit_speeds=_BALLS, suits=suits,
               directions=kind.directions if speeds else (), varies=kind.varies and f"{kind.varies} {manner}")
        for manner, pace, speeds, suits in rows
    )  # fmt: skip


KICK_ACTIONS = (
    *(row for kind in _KINDS for row in _build_rows(kind)),
    Action(name="goal kick", labels=frozenset({"goal_kick", "kick", "foot", "low", "top", "with_setup", "standing"}),
           build=partial(_build_from_a_stand, _KINDS[1]), has_side=True, meets=(-np.inf, _LOW[1])),
)
"""The rows of `actions.table`."""
