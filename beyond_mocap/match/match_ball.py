"""The one ball of a match: as it was solved, led in all players' hands and to their feet where they meet it, and
players brought to it.

Both keeping out of others' bodies and turning a head move striking parts off the ball by centimetres: `at_ball` brings
them back.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..annotation.ball_contact import surfaces
from ..annotation.striking import ball_gap
from ..ball.tracked.solve import SolvedBall
from ..base.time_series import interpolate
from ..motion.motion import Motion, pose_kinematics
from ..motion.track import BALL_RADIUS, Track, clean
from ..motion.track.ball_path import BallPath
from ..motion.track.match_data import Match
from ..synthesis.construct.strike_at import Meeting, met_at
from ..synthesis.known_touches import course_of
from ..synthesis.plan import Plan
from ..synthesis.take import KeyResult, Take

_STEP = 1e-4  # m, to which places are rounded, as files have them

CLOSED = 0.15
"""Metres of gap that are closed, as much as `synthesis.construct.strike` closes; who misses the ball by more
plays as he does."""

OPEN = 1e-3
"""Metres of gap that are left."""

EASE = 0.3
"""Seconds before and after a touch in which the part comes to the ball and goes back, less where another touch lies
within them."""


def ball_plan(match: Match, solved: SolvedBall | None, start: float, end: float, fps: float) -> Plan | None:
    """An order that has the ball from `start` to `end` s and nobody, for `course`; None where it is nowhere known."""
    inside = (match.times >= start - 1.0 / match.fps) & (match.times <= end + 1.0 / match.fps)
    times, ball = match.times[inside], match.ball[inside]
    if not np.isfinite(ball[:, :2]).all(axis=1).any():
        return None
    track, _ = clean(Track(times, np.zeros((len(times), 2)), ball, name="ball"))
    plan = Plan(track=track, fps=fps, solve_touches=solved is not None)
    return plan if solved is None else Plan(**{**vars(plan), "solved": course_of(solved, "", plan)})


def course(plan: Plan, times: np.ndarray) -> BallPath:
    """The ball of a plan at `times` (T,) s as nobody has met it yet: solved where that is known, else as sampled."""
    sampled = plan.sampled(plan.fps)
    place = interpolate(times, sampled.times, sampled.ball, outside=np.nan)
    near = np.clip(np.searchsorted(sampled.times, times - 0.5 / plan.fps), 0, len(sampled) - 1)
    measured = sampled.ball_measured[near]
    if plan.solved is None:
        return BallPath(times, place, measured)
    solved, _ = plan.solved.at(times)
    return BallPath(times, np.where(np.isfinite(solved), solved, place), measured)


def led_by(take: Take) -> tuple[np.ndarray, np.ndarray]:
    """Frames (K,) of the match's clock at which a player leads the ball elsewhere than it was, and by how much: (K, 3)
    m."""
    if take.ball is None:
        return np.zeros(0, int), np.zeros((0, 3))
    off = take.ball.positions - course(take.plan, take.ball.times).positions
    off = np.where(np.isfinite(off), off, 0.0)
    some = np.flatnonzero(np.abs(off).max(axis=1) > 0.5 * _STEP)
    return some + round(take.start_time * take.motion.fps), off[some]


def met(ball: BallPath, first: int, led: Iterable[tuple[np.ndarray, np.ndarray]]) -> BallPath:
    """The ball (T frames from frame `first` of the match's clock on) where everybody's `led_by` has it.

    One who touches the ball leads it between the touches before and after his own only, so that what several do adds
    up without hurting anybody's touch."""
    places = np.array(ball.positions)
    for frames, off in led:
        inside = (frames >= first) & (frames < first + len(places))
        np.add.at(places, frames[inside] - first, off[inside])
    return BallPath(ball.times, np.round(places / _STEP) * _STEP, ball.measured)


def at_ball(take: Take, ball: np.ndarray) -> Take:
    """The take with its striking parts on the ball (T, 3) m, NaN where it is not known, at each key moment at which
    they were meant to be. Frames further than EASE from such a moment keep their bits."""
    touches = [key for key in take.keys if surfaces(take.motion.skeleton, key.touching)]
    found = (_meeting(take.motion, key, ball, _alone(key, touches)) for key in touches)
    meetings = [meeting for meeting in found if meeting is not None]
    if not meetings:
        return take
    return replace(take, motion=met_at(take.motion, take.contacts, meetings, grounded=True).motion)


def _alone(key: KeyResult, touches: Sequence[KeyResult]) -> tuple[float, float]:
    """Frames before and after a touch in which the body is its own."""
    apart = [round(other.frame) - round(key.frame) for other in touches]
    before, after = [-step for step in apart if step < 0], [step for step in apart if step > 0]
    return min(before, default=np.inf), min(after, default=np.inf)


def _meeting(motion: Motion, key: KeyResult, ball: np.ndarray, alone: tuple[float, float]) -> Meeting | None:
    """What brings a part to the ball at one key moment; None where it is there, or too far."""
    frame = int(np.clip(np.rint(key.frame), 0, len(motion) - 1))
    parts = surfaces(motion.skeleton, key.touching)
    if not np.isfinite(ball[frame]).all():
        return None
    places, world = pose_kinematics(motion.skeleton, motion.root_positions[frame], motion.rotations[frame])
    gaps = [abs(float(ball_gap(part.line(places, world), part.radius, ball[frame]))) for part in parts]
    nearest = int(np.argmin(gaps))
    if not OPEN < gaps[nearest] < CLOSED:
        return None
    entry, leave = (min(EASE * motion.fps, frames) for frames in alone)
    return Meeting(float(frame), parts[nearest], ball[frame], radius=BALL_RADIUS, entry=entry, leave=leave)
