"""Construct a player of a match as displayed: the motion from their edit list, with collision avoidance and ball
contact restored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from ..base.errors import InputError
from ..library.library import Library
from ..motion.track.ball_path import BallPath
from ..synthesis.take import Take
from .crowd.correction import Correction, apply_correction
from .match_ball import restore_ball_contact
from .player_edit import PlayerEdit
from .player_motion import construct_player, cut_take

MARGIN_SECONDS = 1.0
"""s around the requested span that are constructed too: a touch beside it moves the body inside."""


def construct_displayed_player(
    library: Library, edit: PlayerEdit, ball: BallPath | None, start: float, end: float,
    progress: Callable[[float, str], None] | None = None,
) -> tuple[Take, ...]:  # fmt: skip
    """Construct what a player does in a span, as displayed; a frame is the same whatever span is requested.

    Args:
        library: the clips.
        edit: the player's edit list.
        ball: the match's ball, which every take gets as its own; None: ball contact is not changed.
        start: s on the match's clock.
        end: s on the match's clock.
        progress: receives the share done and a text.
    Returns:
        One take per stretch in the span.
    Raises:
        InputError: as for `construct_player`.
    """
    if not end > start:
        raise InputError("times", f"{start:g} to {end:g} s", "an end after the start")
    takes = construct_player(library, edit, start - MARGIN_SECONDS, end + MARGIN_SECONDS, progress)
    return display_takes(takes, edit.correction, ball, start, end)


def display_takes(takes: Iterable[Take], correction: Correction | None, ball: BallPath | None, start: float,
                  end: float) -> tuple[Take, ...]:
    """Display takes (`display_take`) that reach MARGIN_SECONDS beyond `start` and `end` s, cut to that span."""
    inside = (_cut_take(display_take(take, correction, ball), start, end) for take in takes)
    return tuple(take for take in inside if take is not None)


def _cut_take(take: Take, start: float, end: float) -> Take | None:
    """Cut a take to the frames from `start` to `end` s; None if there are none."""
    fps = take.motion.fps
    first = max(int(np.ceil((start - take.start_time) * fps - 1e-6)), 0)
    last = min(int(np.floor((end - take.start_time) * fps + 1e-6)), len(take.motion) - 1)
    if last < first:
        return None
    if (first, last) == (0, len(take.motion) - 1):
        return take
    return replace(cut_take(take, first, last + 1), plan=take.plan)


def display_take(take: Take, correction: Correction | None, ball: BallPath | None) -> Take:
    """Apply collision avoidance and ball contact to a take.

    Args:
        take: from `construct_player`.
        correction: of the player, None if not known.
        ball: as for `construct_displayed_player`.
    Returns:
        The take as displayed.
    """
    first = round(take.start_time * take.motion.fps)
    if correction is not None and len(correction.knots):
        take = replace(take, motion=apply_correction(take.motion, correction, first))
    if ball is None:
        return take
    take_ball = _cut_ball(ball, first, len(take.motion), take.motion.fps)
    return restore_ball_contact(replace(take, ball=take_ball), take_ball.positions)


def _cut_ball(ball: BallPath, first: int, count: int, fps: float) -> BallPath:
    """Cut the match's ball to frames first .. first + count of the match's clock, unknown outside its time."""
    at = np.arange(count) + first - round(float(ball.times[0]) * fps)
    is_known = (at >= 0) & (at < len(ball.times))
    times, places, measured = (first + np.arange(count)) / fps, np.full((count, 3), np.nan), np.zeros(count, bool)
    for values, known in ((times, ball.times), (places, ball.positions), (measured, ball.measured)):
        values[is_known] = known[at[is_known]]
    return BallPath(times, places, measured)
