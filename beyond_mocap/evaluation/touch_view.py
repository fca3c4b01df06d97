"""The touches of a take, measured once for the report's figures and messages."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from ..annotation.ball_contact import CARRYING, SENDING, TAKING, find_striking_part, may_use_foot
from ..annotation.body_solid import BodySolid
from ..annotation.body_surfaces import BodySurface, build_body_surfaces
from ..annotation.striking import build_part_surfaces, measure_smallest_gap
from ..annotation.vocabulary import SIDES
from ..synthesis.quality.moments import KeyMomentResult
from . import touches
from .view import View

SECOND_STRIKE_SECONDS = 2.5  # s after a reception in which a strike counts as a second one
_ASKED_SECONDS = 0.5  # s about a requested action of a foot in which a strike belongs to it
_OWN_STRIKE_SECONDS = 0.25  # s about a reception in which a strike is that of its own foot
_AFTER_SECONDS = (1.0 / 30.0, 0.1)  # s after a kick between which the ball's speed is measured
_NEAR_BALL = 1.6  # m from pelvis to ball within which a body may reach it


class TouchView:
    """The touches of a take, measured once for figures and messages.

    Attributes:
        view: the take beside its library.
        played: the take as played.
        moments: key moments, without those that miss the ball by design.
        receptions: key moments that ask for a ball which a foot receives.
        body_receptions: those which ask for one that thigh, chest or head take.
        kicks: those which ask for one that a foot sends.
    """

    def __init__(self, view: View):
        self.view, self.played = view, view.played
        self.moments = [one for one in view.moments if not one.requested.misses_ball]
        self.receptions = [one for one in self.moments if touches.is_foot_reception(one.requested.words)]
        self.body_receptions = [one for one in self.moments if touches.is_body_reception(one.requested.words)]
        self.kicks = [one for one in self.moments if touches.is_kick(one.requested.words)]

    @cached_property
    def legs(self) -> touches.LegCourse:
        """Where pelvis and feet are."""
        played = self.played
        return touches.measure_legs(played.motion.skeleton, played.positions, self.view.fps, played.contacts,
                                    self.view.course)

    @cached_property
    def ball(self) -> np.ndarray:
        """(T, 3) m, the ball as written at the frames of the take; NaN without one."""
        path, times = self.played.ball, self.played.times
        if path is None or not len(path.times):
            return np.full((self.view.count, 3), np.nan)
        rows = np.clip(np.searchsorted(path.times, times), 1, max(len(path.times) - 1, 1)) - 1
        rows += times - path.times[rows] > path.times[np.minimum(rows + 1, len(path.times) - 1)] - times
        rows = np.minimum(rows, len(path.times) - 1)
        is_near = np.abs(path.times[rows] - times) <= 1.0 / self.view.fps
        return np.where(is_near[:, None], path.positions[rows], np.nan)

    @cached_property
    def depths(self) -> tuple[np.ndarray, np.ndarray, tuple[BodySurface, ...]]:
        """Frames (F,) at which the ball is near, how deep (F, S) m it lies in each surface, and the surfaces."""
        played, surfaces = self.played, build_body_surfaces(self.played.motion.skeleton)
        away = np.linalg.norm(self.ball - played.positions[:, played.body.hips], axis=1)
        near = np.flatnonzero(away < _NEAR_BALL * self.view.scale)
        solid = BodySolid.from_pose(surfaces, played.positions[near], played.rotations[near])
        return near, solid.measure_depths(self.ball[near]), surfaces

    @cached_property
    def strikes(self) -> list[tuple[float, int]]:
        """Strikes that nothing asks for: seconds from the first frame, and side."""
        asked = self._list_asked_seconds()
        return [(second, side) for second, side in touches.find_strikes(self.legs)
                if not any(first <= second <= last for first, last in asked)]

    @property
    def second_strikes(self) -> list[tuple[float, int]]:
        """Those within 2.5 s after a reception."""
        after = [self.find_second(one) for one in (*self.receptions, *self.body_receptions)]
        return [strike for strike in self.strikes if any(0.0 < strike[0] - second <= SECOND_STRIKE_SECONDS
                                                        for second in after)]

    def _list_asked_seconds(self) -> list[tuple[float, float]]:
        """List spans (s from the first frame) in which labels ask for a foot's action, or a reception's foot moves."""
        spans = []
        for moment in self.view.moments:
            second, words = self.find_second(moment), frozenset(moment.requested.words)
            if moment in self.receptions or moment in self.body_receptions:
                spans.append((second - _OWN_STRIKE_SECONDS, second + _OWN_STRIKE_SECONDS))
            elif may_use_foot(words):
                spans.append((second - _ASKED_SECONDS, second + _ASKED_SECONDS))
        if self.view.timeline is not None:
            start, timeline = self.played.start_time, self.view.timeline
            spans += [(span.start - start, span.end - start) for span in timeline.spans
                      if may_use_foot(frozenset(span.words)) and not _carries_only(span.words)]
        return spans

    def find_second(self, moment: KeyMomentResult) -> float:
        """Find the second, from the first frame, of a key moment."""
        return moment.requested.resolved_time - self.played.start_time

    def find_foot(self, moment: KeyMomentResult) -> int | None:
        """Find which foot touches the ball: the one that labels name, else the one nearest to the ball."""
        side = touches.find_side(moment.contact_labels)
        ball = self.ball[moment.frame]
        if side is not None or not np.isfinite(ball).all():
            return side
        pose = self.played.positions[moment.frame], self.played.rotations[moment.frame]
        skeleton = self.played.motion.skeleton
        gaps = [float(measure_smallest_gap(build_part_surfaces(skeleton, "foot", (name,)), *pose, ball))
                for name in SIDES]
        return int(np.argmin(gaps))

    def measure_ball_speed(self, moment: KeyMomentResult) -> float:
        """Measure the ball's speed (m/s) just after a key moment, NaN where it is not known."""
        first, last = (moment.frame + max(int(round(after * self.view.fps)), 1) for after in _AFTER_SECONDS)
        last = max(last, first + 1)
        if last >= self.view.count:
            return math.nan
        return float(np.linalg.norm(self.ball[last] - self.ball[first])) * self.view.fps / (last - first)

    def measure_receptions(self) -> list[float]:
        """Measure the speed (m/s) of the foot at every reception."""
        return [touches.measure_reception(self.legs, self.find_second(one), self.find_foot(one))
                for one in self.receptions]

    def measure_body_receptions(self) -> list[float]:
        """Measure the speed (m/s) of the requested part at every reception with thigh, chest or head."""
        skeleton, positions = self.played.motion.skeleton, self.played.positions
        return [touches.measure_body_reception(skeleton, positions, self.view.fps,
                                               find_striking_part(one.requested.words) or "", self.find_second(one))
                for one in self.body_receptions]

    def measure_kicks(self) -> list[touches.Kick]:
        """Measure every kick."""
        found = [(self.find_second(one), self.find_foot(one), self.measure_ball_speed(one)) for one in self.kicks]
        return [touches.measure_kick(self.legs, *one) for one in found]


def _carries_only(words) -> bool:
    """Return whether labels only say that the ball is carried, as in a dribble."""
    return not (TAKING | SENDING).intersection(words) and bool(CARRYING.intersection(words))
