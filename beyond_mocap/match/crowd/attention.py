"""How many heads follow one ball without all of them turning as one.

Everybody looks at the ball in a way of his own: somewhat late, not at every moment as far round as it lies, and ahead
on his way while he sprints, unless the ball is near. What varies is a slow function of the match's clock and of the
player's seed, so that any stretch of a match gives the same heads.
"""

from __future__ import annotations

import numpy as np

from ...base.easing import smoothstep
from ...motion.motion import Motion
from ...motion.track import zero_phase_hann
from ...synthesis.construct.gaze import following

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


def looking(
    motion: Motion, ball: np.ndarray, known: np.ndarray, look: np.ndarray, seed: int = 0, start: float = 0.0
) -> Motion:
    """The motion with its head following the ball as one of many would.

    ball (T, 3) m and whether it is known (T,) bool, at the motion's frames; look (3,): which way the head joint looks,
    in its own frame (`synthesize.look_of`). seed: of the player's habits; start: seconds of the motion's first frame on
    the match's clock. Only chest, neck and head are turned.
    """
    random = np.random.default_rng([seed, 9])
    delay = random.uniform(*DELAY)
    phases, weights = random.uniform(0.0, 2.0 * np.pi, len(_PERIODS)), random.uniform(0.5, 1.0, len(_PERIODS))
    places = np.where(np.reshape(known, (-1, 1)), ball, np.nan)
    late = _behind(places, round(delay * motion.fps))
    times = start + np.arange(len(motion)) / motion.fps
    waves = np.sin(2.0 * np.pi * times[:, None] / np.array(_PERIODS) + phases) @ weights / weights.sum()
    wander = LEAST + (MOST - LEAST) * (0.5 + 0.5 * np.clip(1.6 * waves + 0.4, -1.0, 1.0))
    away = np.linalg.norm(np.nan_to_num(late - motion.root_positions, nan=1e3)[:, :2], axis=1)
    far = smoothstep(away, *NEAR)
    share = MOST + far * (wander - MOST)
    share = share * (1.0 - AHEAD * far * smoothstep(_speed(motion), *SPRINT))
    return following(motion, late, look, zero_phase_hann(share[:, None], motion.fps, 0.6)[:, 0])


def _behind(places: np.ndarray, frames: int) -> np.ndarray:
    """(T, 3) as they were so many frames before; the first ones from the first frame on."""
    return places[np.maximum(np.arange(len(places)) - frames, 0)]


def _speed(motion: Motion) -> np.ndarray:
    """(T,) m/s over the ground, without the sway of steps."""
    ground = zero_phase_hann(motion.root_positions[:, :2], motion.fps, 0.6)
    return np.linalg.norm(np.gradient(ground, axis=0), axis=1) * motion.fps if len(motion) > 1 else np.zeros(1)
