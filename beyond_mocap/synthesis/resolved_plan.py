"""A plan as search, construction, edits and explanations need it: made once of what is asked (`resolve_plan`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..annotation import Timeline
from ..motion.track import SampledTrack, Track
from .plan import Plan, SolvedCourse, sample_with_course


@dataclass(frozen=True, eq=False, kw_only=True)
class ResolvedPlan:
    """A plan with its touches solved, in the size of the library's skeleton.

    asked: the plan as it was asked; its settings hold as they are, its pins are in the player's size.
    timeline: the asked annotations, not yet filled, with key moments at the touches that they mean.
    track: the player's samples, m in the library's size.
    course: the solved course of the ball, m in the player's size; None where it is not solved.
    size: how many times as tall as the library's skeleton the player is.
    """

    asked: Plan
    timeline: Timeline
    track: Track
    course: SolvedCourse | None
    size: float

    @property
    def method(self) -> str:
        """The method of the search, one of `plan.METHODS`."""
        return self.asked.method

    @property
    def fps(self) -> float:
        """Output frames per second."""
        return self.asked.fps

    def sampled(self, fps: float) -> SampledTrack:
        """The track at `fps` frames per second, with the solved ball, in the library's size."""
        course = self.course
        if course is not None and self.size != 1.0:
            course = replace(course, ball=course.ball / self.size)
        return sample_with_course(self.track, course, fps, self.asked.track_window)
