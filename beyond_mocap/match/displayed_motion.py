"""Construct a player of a match as displayed: the motion from their edit list, with collision avoidance, gaze at the
ball, and ball contact restored.

Heads that follow one ball do not all turn together. Each player looks at it slightly late, not always fully, and ahead
while sprinting unless the ball is close. The variation is a slow function of the match's clock and of the player's
seed, so that any span of a match gives the same heads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..base.easing import smoothstep
from ..base.errors import InputError
from ..library.library import Library
from ..motion.motion import Motion
from ..motion.track import smooth_zero_phase_hann
from ..motion.track.ball_path import BallPath
from ..synthesis.construct.gaze import follow_with_gaze
from ..synthesis.synthesize import estimate_look
from ..synthesis.take import Take
from .crowd.correction import Correction, apply_correction
from .match_ball import restore_ball_contact
from .player_edit import PlayerEdit
from .player_motion import construct_player, cut_take

MARGIN_SECONDS = 3.0
"""s around the requested span that are constructed too; head rotations are smoothed over less."""

MIN_ATTENTION, MAX_ATTENTION = 0.45, 1.0
"""Shares of the full rotation to the ball at the least and the most attentive moments."""

DELAY_RANGE = (0.08, 0.35)
"""s by which heads lag behind the ball."""

SPRINT_SPEEDS = (4.5, 7.0)
"""m/s: from the first a runner starts to look ahead, from the second they look ahead fully."""

SPRINT_LOSS = 0.65
"""Share of the rotation to the ball that a sprint removes."""

NEAR_DISTANCES = (4.0, 12.0)
"""m: a ball closer than the first is always looked at; beyond the second attention varies fully."""

_WAVE_PERIODS = (5.3, 8.9, 13.7)  # s, periods of the waves of attention: no common multiple within a match


def construct_displayed_player(
    library: Library, edit: PlayerEdit, ball: BallPath | None, start: float, end: float,
    progress: Callable[[float, str], None] | None = None,
) -> tuple[Take, ...]:  # fmt: skip
    """Construct what a player does in a span, as displayed; a frame is the same whatever span is requested.

    Args:
        library: the clips.
        edit: the player's edit list.
        ball: the match's ball, which every take gets as its own; None: heads and ball contact are not changed.
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
    finished = (_finish_take(library, take, edit.correction, ball) for take in takes)
    inside = (_cut_take(take, start, end) for take in finished)
    return tuple(take for take in inside if take is not None)


def add_gaze(
    motion: Motion, ball: np.ndarray, known: np.ndarray, look: np.ndarray, seed: int = 0, start: float = 0.0
) -> Motion:
    """Add gaze at the ball: only chest, neck and head rotate.

    Args:
        motion: T frames.
        ball: (T, 3) m, world frame.
        known: (T,) bool, where the ball is known.
        look: (3,) direction in which the head joint looks, in its own frame (`synthesize.estimate_look`).
        seed: of the player's habits.
        start: s of the motion's first frame on the match's clock.
    Returns:
        The motion with gaze.
    """
    random = np.random.default_rng([seed, 9])
    delay = random.uniform(*DELAY_RANGE)
    phases, weights = random.uniform(0.0, 2.0 * np.pi, len(_WAVE_PERIODS)), random.uniform(0.5, 1.0, len(_WAVE_PERIODS))
    places = np.where(np.reshape(known, (-1, 1)), ball, np.nan)
    delayed = places[np.maximum(np.arange(len(places)) - round(delay * motion.fps), 0)]
    times = start + np.arange(len(motion)) / motion.fps
    # Attention: a sum of slow waves between MIN_ATTENTION and MAX_ATTENTION, full for a close ball, less in a sprint.
    waves = np.sin(2.0 * np.pi * times[:, None] / np.array(_WAVE_PERIODS) + phases) @ weights / weights.sum()
    wander = MIN_ATTENTION + (MAX_ATTENTION - MIN_ATTENTION) * (0.5 + 0.5 * np.clip(1.6 * waves + 0.4, -1.0, 1.0))
    distance = np.linalg.norm(np.nan_to_num(delayed - motion.root_positions, nan=1e3)[:, :2], axis=1)
    far = smoothstep(distance, *NEAR_DISTANCES)
    share = MAX_ATTENTION + far * (wander - MAX_ATTENTION)
    share = share * (1.0 - SPRINT_LOSS * far * smoothstep(_measure_speed(motion), *SPRINT_SPEEDS))
    return follow_with_gaze(motion, delayed, look, smooth_zero_phase_hann(share[:, None], motion.fps, 0.6)[:, 0])


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


def _finish_take(library: Library, take: Take, correction: Correction | None, ball: BallPath | None) -> Take:
    """Apply collision avoidance, gaze and ball contact to a take."""
    first = round(take.start_time * take.motion.fps)
    if correction is not None and len(correction.knots):
        take = replace(take, motion=apply_correction(take.motion, correction, first))
    if ball is None:
        return take
    take_ball = _cut_ball(ball, first, len(take.motion), take.motion.fps)
    known = np.isfinite(take_ball.positions).all(axis=1)
    motion = add_gaze(take.motion, take_ball.positions, known, look=estimate_look(library), seed=take.plan.seed,
                      start=take.start_time)
    return restore_ball_contact(replace(take, motion=motion, ball=take_ball), take_ball.positions)


def _cut_ball(ball: BallPath, first: int, count: int, fps: float) -> BallPath:
    """Cut the match's ball to frames first .. first + count of the match's clock, unknown outside its time."""
    at = np.arange(count) + first - round(float(ball.times[0]) * fps)
    is_known = (at >= 0) & (at < len(ball.times))
    times, places, measured = (first + np.arange(count)) / fps, np.full((count, 3), np.nan), np.zeros(count, bool)
    for values, known in ((times, ball.times), (places, ball.positions), (measured, ball.measured)):
        values[is_known] = known[at[is_known]]
    return BallPath(times, places, measured)


def _measure_speed(motion: Motion) -> np.ndarray:
    """Measure the horizontal speed (T,) m/s, without the sway of steps."""
    ground = smooth_zero_phase_hann(motion.root_positions[:, :2], motion.fps, 0.6)
    return np.linalg.norm(np.gradient(ground, axis=0), axis=1) * motion.fps if len(motion) > 1 else np.zeros(1)
