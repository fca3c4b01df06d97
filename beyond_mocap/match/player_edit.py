"""Everything stored about a player of a match: what was requested, and which clip is used when. The motion is
constructed from it when needed (`player_motion`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..motion.track import Track
from ..synthesis.plan import Plan, SolvedTrajectory
from ..synthesis.resolved_touches import resolve_touches
from .crowd.correction import Correction
from .pieces.named_edit import NamedEdit

BALL_STEP = 0.02
"""s between the stored points of the ball's trajectory; gravity bends it by half a millimetre in between, and a bounce
is cut off by some centimetres."""

WINDOW_SECONDS = 60.0
"""s of the windows in which a player is constructed, each with some seconds around it."""

_MAX_STEPS = 10_000_000


@dataclass(frozen=True, eq=False)
class Stretch:
    """A player's time on the pitch without interruption.

    Attributes:
        plan: as stored in files (`to_stored_plan`).
        edit: at the library's rate, from the track's first time.
        warnings: requested labels that the library lacks.
        short: (start, end) s in which the search was shortened.
    """

    plan: Plan
    edit: NamedEdit
    warnings: tuple[str, ...] = ()
    short: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class PlayerEdit:
    """A player of a match.

    Attributes:
        player: id.
        window: s of the windows in which the motion is constructed.
        stretches: in order of time.
        correction: collision avoidance, None if not known yet.
    """

    player: str
    window: float
    stretches: tuple[Stretch, ...]
    correction: Correction | None = None


def to_stored_plan(plan: Plan) -> Plan:
    """Convert a plan to what files store, so that results do not depend on whether it has been in a file.

    Touches are solved; the track's times are whole microseconds and its positions whole millimetres; so is the ball's
    trajectory, with a point every BALL_STEP and at each touch.

    Args:
        plan: the plan.
    Returns:
        The rounded plan.
    """
    plan = resolve_touches(plan)
    track = plan.track
    track = Track(
        np.round(track.times * 1e6) / 1e6, _round_to_millimetres(track.positions), _round_to_millimetres(track.ball),
        ball_height_known=track.ball_height_known, filled=track.filled, outlier=track.outlier, name=track.name,
    )  # fmt: skip
    return replace(plan, track=track, solved=None if plan.solved is None else _to_stored_trajectory(plan.solved, track))


def build_ball_times(first: float, last: float, touches) -> np.ndarray:
    """Build the times (M,) s of the stored points of the ball's trajectory, from `first` to `last` s."""
    steps = min(max(int(np.ceil((last - first) / BALL_STEP)), 1), _MAX_STEPS)
    inside = [touch.time for touch in touches if first <= touch.time <= last]
    return np.union1d(first + (last - first) / steps * np.arange(steps + 1), inside)


def _to_stored_trajectory(course: SolvedTrajectory, track: Track) -> SolvedTrajectory:
    times = build_ball_times(float(track.times[0]), float(track.times[-1]), course.touches)
    ball, filled = course.interpolate(times)
    return SolvedTrajectory(times, _round_to_millimetres(ball), filled, course.touches)


def _round_to_millimetres(places: np.ndarray) -> np.ndarray:
    return np.round(places * 1000.0) / 1000.0
