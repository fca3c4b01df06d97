"""A player of a made match as everybody is to see him: his motion out of his edit list, kept out of others' bodies, his
head after the ball, and what strikes it on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..base.errors import InputError
from ..library.library import Library
from ..motion.track.ball_path import BallPath
from ..synthesis.synthesize import look_of
from ..synthesis.take import Take
from .crowd.attention import looking
from .crowd.correction import Correction, applied
from .crowd.restore_ball_contact import at_ball
from .expand import expanded
from .joined_takes import own_part
from .player_edit import PlayerEdit

AROUND = 3.0
"""Seconds around what is asked for that are laid out too: what heads do is smoothed over less."""


def shown(
    library: Library,
    edit: PlayerEdit,
    ball: BallPath | None,
    start: float,
    end: float,
    progress: Callable[[float, str], None] | None = None,
) -> tuple[Take, ...]:
    """What a player does from `start` to `end` seconds, a take for each of his stretches there; a frame looks the same
    whatever span is asked for.

    ball: the match's, which every take has as its own; unknown in frames that it does not tell of. InputError as of
    `expanded`.
    """
    if not end > start:
        raise InputError("times", f"{start:g} to {end:g} s", "an end behind the start")
    takes = expanded(library, edit, start - AROUND, end + AROUND, progress)
    finished = (_finished(library, take, edit.correction, ball) for take in takes)
    inside = (_between(take, start, end) for take in finished)
    return tuple(take for take in inside if take is not None)


def _between(take: Take, start: float, end: float) -> Take | None:
    """The frames of a take from `start` to `end` seconds, None where there are none."""
    fps = take.motion.fps
    first = max(int(np.ceil((start - take.start_time) * fps - 1e-6)), 0)
    last = min(int(np.floor((end - take.start_time) * fps + 1e-6)), len(take.motion) - 1)
    if last < first:
        return None
    if (first, last) == (0, len(take.motion) - 1):
        return take
    return replace(own_part(take, first, last + 1), plan=take.plan)


def _finished(library: Library, take: Take, correction: Correction | None, ball: BallPath | None) -> Take:
    first = round(take.start_time * take.motion.fps)
    if correction is not None and len(correction.knots):
        take = replace(take, motion=applied(take.motion, correction, first))
    if ball is None:
        return take
    own = _cut(ball, first, len(take.motion), take.motion.fps)
    known = np.isfinite(own.positions).all(axis=1)
    motion = looking(take.motion, own.positions, known, look_of(library), take.plan.seed, take.start_time)
    return at_ball(replace(take, motion=motion, ball=own), own.positions)


def _cut(ball: BallPath, first: int, count: int, fps: float) -> BallPath:
    """The match's ball at frames first .. first + count of the match's clock, unknown where it is not told of."""
    at = np.arange(count) + first - round(float(ball.times[0]) * fps)
    told = (at >= 0) & (at < len(ball.times))
    times, places, measured = (first + np.arange(count)) / fps, np.full((count, 3), np.nan), np.zeros(count, bool)
    for own, known in ((times, ball.times), (places, ball.positions), (measured, ball.measured)):
        own[told] = known[at[told]]
    return BallPath(times, places, measured)
