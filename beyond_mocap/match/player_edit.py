"""All that is kept of a player of a match: what he was asked to do, and which clip is shown when; his motion is made of
it whenever it is wanted (`expand`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..motion.track import Track
from ..synthesis.known_touches import solve_touches
from ..synthesis.plan import Plan, SolvedCourse
from .crowd.correction import Correction
from .pieces.named_edit import NamedEdit

COURSE_STEP = 0.02
"""Seconds between the points of the ball's course that are kept; gravity bends it by half a millimetre in between, a
bounce cuts its corner by some centimetres."""

LAYOUT = 30.0
"""Seconds of the windows in which a player is laid out."""

_MOST_STEPS = 10_000_000


@dataclass(frozen=True, eq=False)
class Stretch:
    """A player's time on the pitch without a break. plan: his order, as `kept`. edit: at the library's rate, from the
    track's first time on. warnings: what the library lacks of what is asked; short: (start, end) s that were searched
    in a hurry."""

    plan: Plan
    edit: NamedEdit
    warnings: tuple[str, ...] = ()
    short: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class PlayerEdit:
    """A player of a match. player: his id. window: s of the windows in which he is laid out. stretches: in the order of
    time. correction: what keeps him out of others' bodies when he is shown, None where that is not known yet."""

    player: str
    window: float
    stretches: tuple[Stretch, ...]
    correction: Correction | None = None


def kept(plan: Plan) -> Plan:
    """The plan as files keep it, so that what is made of it does not depend on whether it has been in one.

    Its touches are solved; the track's times are in whole microseconds, its places in whole
    millimetres, and so is the ball's course, which has a point every COURSE_STEP and at each touch.
    """
    plan = solve_touches(plan)
    track = plan.track
    track = Track(
        np.round(track.times * 1e6) / 1e6, _to_millimetres(track.positions), _to_millimetres(track.ball),
        track.ball_height_known, track.filled, track.outlier, track.name,
    )  # fmt: skip
    return replace(plan, track=track, solved=None if plan.solved is None else _kept_course(plan.solved, track))


def course_times(first: float, last: float, touches) -> np.ndarray:
    """(M,) s of the points of a course that is kept, from `first` to `last` s."""
    steps = min(max(int(np.ceil((last - first) / COURSE_STEP)), 1), _MOST_STEPS)
    inside = [touch.time for touch in touches if first <= touch.time <= last]
    return np.union1d(first + (last - first) / steps * np.arange(steps + 1), inside)


def _kept_course(course: SolvedCourse, track: Track) -> SolvedCourse:
    times = course_times(float(track.times[0]), float(track.times[-1]), course.touches)
    ball, filled = course.at(times)
    return SolvedCourse(times, _to_millimetres(ball), filled, course.touches)


def _to_millimetres(places: np.ndarray) -> np.ndarray:
    return np.round(places * 1000.0) / 1000.0
