"""A player of a made match as everybody is to see him: his motion out of his edit list, kept out of others' bodies, and
his head after the ball."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..library.library import Library
from ..polish.crowd.attention import looking
from ..polish.crowd.correction import Correction, applied
from ..synthesize import look_of
from ..take import BallPath, Take
from .expand import expanded
from .player_edit import PlayerEdit


def shown(
    library: Library,
    edit: PlayerEdit,
    ball: BallPath | None,
    start: float,
    end: float,
    progress: Callable[[float, str], None] | None = None,
) -> tuple[Take, ...]:
    """What a player does from `start` to `end` seconds, a take for each of his stretches there.

    ball: the match's, which every take has as its own. InputError as of
    `expanded`.
    """
    takes = expanded(library, edit, start, end, progress)
    return tuple(_finished(library, take, edit.correction, ball) for take in takes)


def _finished(library: Library, take: Take, correction: Correction | None, ball: BallPath | None) -> Take:
    first = round(take.start_time * take.motion.fps)
    if correction is not None and len(correction.knots):
        take = replace(take, motion=applied(take.motion, correction, first))
    if ball is None:
        return take
    own = _cut(ball, first, len(take.motion), take.motion.fps)
    known = np.isfinite(own.positions).all(axis=1)
    motion = looking(take.motion, own.positions, known, look_of(library), take.plan.seed, take.start_time)
    return replace(take, motion=motion, ball=own)


def _cut(ball: BallPath, first: int, count: int, fps: float) -> BallPath:
    """Frames first .. first + count of the match's clock of the match's ball, as far as it goes."""
    low = max(first - round(float(ball.times[0]) * fps), 0)
    part = slice(low, low + count)
    return BallPath(ball.times[part], ball.positions[part], ball.measured[part])
