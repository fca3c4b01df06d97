"""A synthetic action: the labels that it answers to, and the function that builds it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ...motion.motion import Motion
from ...motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ...motion.skeleton import Skeleton
from .. import gait_tables as tables
from ..gestures import Gesture

STANDS, MOVES = (0.0, 1.1), (1.1, math.inf)
"""Lowest and highest m/s of players who stand, and who move."""

_PACES = frozenset({"standing", "running"})
_SUITS = {frozenset({"standing"}): STANDS, frozenset({"running"}): MOVES}


@dataclass(frozen=True, kw_only=True)
class ActionSetting:
    """For whom and in which situation an action is built.

    Attributes:
        skeleton: any humanoid skeleton.
        example: a recording on it, for its neutral stance; None: the skeleton's rest pose tells it.
        fps: frames per second.
        speed: m/s of the player at the key moment; 0 for actions that do not depend on it.
        height: m of the ball's centre above the ground at the key moment; None where it is unknown.
        exit_speed: m/s with which the ball leaves; None where it is unknown, or the action does not depend on it.
        direction: degrees from the player's travel in which a right foot sends the ball, left positive.
        seconds: s that an action lasts; None where its own time serves.
        neutral: the neutral stance of the body; measured on the example where it is not given.
    """

    skeleton: Skeleton
    example: Motion | None = None
    fps: float = 60.0
    speed: float = 0.0
    height: float | None = None
    exit_speed: float | None = None
    direction: float = 0.0
    seconds: float | None = None
    neutral: NeutralStance = None  # type: ignore[assignment]

    def __post_init__(self):
        if self.neutral is None:
            object.__setattr__(self, "neutral", build_neutral_stance(self.skeleton, self.example))

    @property
    def scale(self) -> float:
        """Length of the leg, as a share of an adult's."""
        return self.neutral.leg / tables.LEG


@dataclass(frozen=True, kw_only=True)
class Action:
    """A synthetic action.

    Attributes:
        name: as reports call it, such as "diving header".
        labels: every label that its key moment carries, without a side. A request for any of them is served, as long as
            it asks for no other.
        build: builds it, facing and travelling along +X, on a ground of height 0; an action with a side on the right.
        needs: labels that a request has to name: an overhead kick is none that a plain kick gets.
        has_side: whether it is done with or to one side; its mirrored twin shows the other one.
        speeds: m/s at which it is built, the nearest one to the player's; empty: it does not depend on speed.
        heights: lowest and highest m of the ball for which it is built; empty: it does not depend on the ball.
        exit_speeds: m/s of the leaving ball for which it is built, the nearest one to the player's; empty: it does not
            depend on that.
        directions: degrees in each of which it is built, for a choice; empty: straight ahead.
        suits: lowest and highest m/s of players whom it suits; of several actions one that suits is taken. Default: by
            its labels, as standing and running actions do.
        meets: lowest and highest m of a ball that it can meet, where it is not built for the ball's height.
        is_span: whether it lasts (a celebration) instead of having a key moment; its clip carries the labels from the
            gesture's start to its end, where it fades.
        can_last: whether it is built for as long as it is requested.
        varies: name of the action beside which it is offered, where the player is as fast as it needs, and the ball no
            faster than it can be done with; empty: it is offered alone.
        most_ball_speed: m/s of the ball before the key moment up to which it is offered so.
        least_lead: m/s by which the ball has to leave faster than the player, along their way; of several actions one
            that asks for more is taken.
    """

    name: str
    labels: frozenset[str]
    build: Callable[[ActionSetting], Gesture]
    needs: frozenset[str] = frozenset()
    has_side: bool = False
    speeds: tuple[float, ...] = ()
    heights: tuple[float, ...] = ()
    exit_speeds: tuple[float, ...] = ()
    directions: tuple[float, ...] = ()
    suits: tuple[float, float] | None = None
    meets: tuple[float, float] = (-math.inf, math.inf)
    is_span: bool = False
    can_last: bool = False
    varies: str = ""
    most_ball_speed: float = math.inf
    least_lead: float = -math.inf

    @property
    def distinct_labels(self) -> frozenset[str]:
        """The labels that it shows whatever the player does: one for a stand and a run alike has neither pace."""
        return self.labels - _PACES if _PACES <= self.labels else self.labels

    @property
    def suited_speeds(self) -> tuple[float, float]:
        """Lowest and highest m/s of players whom it suits."""
        return self.suits or _SUITS.get(self.labels & _PACES, (0.0, math.inf))

    def suits_speed(self, speed: float) -> bool:
        """Return whether the action suits a player at `speed` m/s."""
        return self.suited_speeds[0] <= speed <= self.suited_speeds[1]
