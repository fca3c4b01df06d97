"""A synthetic action: the labels that it answers to, and the function that builds it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from ...motion.motion import Motion
from ...motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ...motion.skeleton import Skeleton
from .. import gait_tables as tables
from ..gestures import Gesture


@dataclass(frozen=True, kw_only=True)
class ActionSetting:
    """For whom and in which situation an action is built.

    Attributes:
        skeleton: any humanoid skeleton.
        example: a recording on it, for its neutral stance; None: the skeleton's rest pose tells it.
        fps: frames per second.
        speed: m/s of the player at the key moment; 0 for actions that do not depend on it.
        height: m of the ball's centre above the ground at the key moment; None where it is unknown.
    """

    skeleton: Skeleton
    example: Motion | None = None
    fps: float = 60.0
    speed: float = 0.0
    height: float | None = None

    @cached_property
    def neutral(self) -> NeutralStance:
        """The neutral stance of the body."""
        return build_neutral_stance(self.skeleton, self.example)

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
        has_side: whether it is done with or to one side; its mirrored twin shows the other one.
        speeds: m/s at which it is built, the nearest one to the player's; empty: it does not depend on speed.
        heights: lowest and highest m of the ball for which it is built; empty: it does not depend on the ball.
        is_span: whether it lasts (a celebration) instead of having a key moment; its clip carries the labels from the
            gesture's start to its end.
    """

    name: str
    labels: frozenset[str]
    build: Callable[[ActionSetting], Gesture]
    has_side: bool = False
    speeds: tuple[float, ...] = ()
    heights: tuple[float, ...] = ()
    is_span: bool = False
