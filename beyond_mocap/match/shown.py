"""A player of a made match as they are to be seen: the motion out of their edit list, kept out of others' bodies, the
head after the ball, and what strikes it on it.

Heads that follow one ball do not all turn as one. Each player looks at it in a way of their own: somewhat late, not at
every moment as far round as it lies, and ahead while they sprint, unless the ball is near. What varies is a slow
function of the match's clock and of the player's seed, so that any stretch of a match gives the same heads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..base.easing import smoothstep
from ..base.errors import InputError
from ..library.library import Library
from ..motion.motion import Motion
from ..motion.track import zero_phase_hann
from ..motion.track.ball_path import BallPath
from ..synthesis.construct.gaze import following
from ..synthesis.synthesize import look_of
from ..synthesis.take import Take
from .crowd.correction import Correction, applied
from .expand import expanded, own_part
from .match_ball import at_ball
from .player_edit import PlayerEdit

AROUND = 3.0
"""Seconds around what is asked for that are laid out too: what heads do is smoothed over less."""

LEAST, MOST = 0.45, 1.0
"""Shares of a turn to the ball that are made at the least and the most attentive moments."""

DELAY = (0.08, 0.35)
"""Seconds by which heads are behind the ball."""

SPRINT = (4.5, 7.0)
"""Metres per second from which on, and at which, a runner looks where he runs."""

AHEAD = 0.65
"""Share of the turn that a sprint takes away."""

NEAR = (4.0, 12.0)
"""Metres within which a ball is always looked at, and beyond which attention wanders as it likes."""

_PERIODS = (5.3, 8.9, 13.7)  # s of the waves that attention is made of: no common multiple within a match


def shown(
    library: Library, edit: PlayerEdit, ball: BallPath | None, start: float, end: float,
    progress: Callable[[float, str], None] | None = None,
) -> tuple[Take, ...]:  # fmt: skip
    """What a player does from `start` to `end` seconds, a take for each of his stretches there; a frame looks the same
    whatever span is asked for.

    ball: the match's, which every take has as its own; unknown in frames that it does not tell of. InputError as of
    `expanded`."""
    if not end > start:
        raise InputError("times", f"{start:g} to {end:g} s", "an end behind the start")
    takes = expanded(library, edit, start - AROUND, end + AROUND, progress)
    finished = (_finished(library, take, edit.correction, ball) for take in takes)
    inside = (_between(take, start, end) for take in finished)
    return tuple(take for take in inside if take is not None)


def looking(
    motion: Motion, ball: np.ndarray, known: np.ndarray, look: np.ndarray, seed: int = 0, start: float = 0.0
) -> Motion:
    """The motion with its head following the ball as one of many would.

    ball (T, 3) m and whether it is known (T,) bool, at the motion's frames; look (3,): which way the head joint looks,
    in its own frame (`synthesize.look_of`). seed: of the player's habits; start: seconds of the motion's first frame on
    the match's clock. Only chest, neck and head are turned."""
    random = np.random.default_rng([seed, 9])
    delay = random.uniform(*DELAY)
    phases, weights = random.uniform(0.0, 2.0 * np.pi, len(_PERIODS)), random.uniform(0.5, 1.0, len(_PERIODS))
    places = np.where(np.reshape(known, (-1, 1)), ball, np.nan)
    late = places[np.maximum(np.arange(len(places)) - round(delay * motion.fps), 0)]
    times = start + np.arange(len(motion)) / motion.fps
    waves = np.sin(2.0 * np.pi * times[:, None] / np.array(_PERIODS) + phases) @ weights / weights.sum()
    wander = LEAST + (MOST - LEAST) * (0.5 + 0.5 * np.clip(1.6 * waves + 0.4, -1.0, 1.0))
    away = np.linalg.norm(np.nan_to_num(late - motion.root_positions, nan=1e3)[:, :2], axis=1)
    far = smoothstep(away, *NEAR)
    share = MOST + far * (wander - MOST)
    share = share * (1.0 - AHEAD * far * smoothstep(_speed(motion), *SPRINT))
    return following(motion, late, look, zero_phase_hann(share[:, None], motion.fps, 0.6)[:, 0])


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
    motion = looking(take.motion, own.positions, known, look=look_of(library), seed=take.plan.seed,
                     start=take.start_time)
    return at_ball(replace(take, motion=motion, ball=own), own.positions)


def _cut(ball: BallPath, first: int, count: int, fps: float) -> BallPath:
    """The match's ball at frames first .. first + count of the match's clock, unknown where it is not told of."""
    at = np.arange(count) + first - round(float(ball.times[0]) * fps)
    told = (at >= 0) & (at < len(ball.times))
    times, places, measured = (first + np.arange(count)) / fps, np.full((count, 3), np.nan), np.zeros(count, bool)
    for own, known in ((times, ball.times), (places, ball.positions), (measured, ball.measured)):
        own[told] = known[at[told]]
    return BallPath(times, places, measured)


def _speed(motion: Motion) -> np.ndarray:
    """(T,) m/s over the ground, without the sway of steps."""
    ground = zero_phase_hann(motion.root_positions[:, :2], motion.fps, 0.6)
    return np.linalg.norm(np.gradient(ground, axis=0), axis=1) * motion.fps if len(motion) > 1 else np.zeros(1)
