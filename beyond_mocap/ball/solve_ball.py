"""The recipe for the ball of a tracked match, or of one player's track."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..base.errors import InputError
from ..motion.track import Track
from ..motion.track.match_data import REFEREE, Match
from .tracked.solve import PITCH, SolvedBall, solve


def solve_ball(
    source: Match | Track,
    progress: Callable[[float, str], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
    start: float | None = None,
    end: float | None = None,
) -> SolvedBall:
    """Touches and the path of the ball in `source`, or from `start` to `end` seconds of it.

    A track has one player: touches of others have the player "". Referees touch no ball. InputError where the source
    has no ball then.
    """
    low, high = -np.inf if start is None else start, np.inf if end is None else end
    part = (source.times >= low) & (source.times <= high)
    if not part.any():
        span = f"{source.times[0]:g} to {source.times[-1]:g} s"
        raise InputError("times", f"no sample from {low:g} to {high:g} s", span)
    if isinstance(source, Track):
        unknown = ~source.ball_height_known[:, None] & [False, False, True]
        ball = np.where(unknown, np.nan, source.ball)
        return solve(
            source.times[part], ball[part], source.positions[None, part], [source.name], where=source.name,
            pitch=PITCH, progress=progress, cancelled=cancelled,
        )  # fmt: skip
    playing = [index for index, player in enumerate(source.players) if player.team != REFEREE]
    players = [source.players[index] for index in playing]
    return solve(
        source.times[part], source.ball[part], source.positions[playing][:, part], [player.id for player in players],
        [player.team for player in players], (source.length, source.width), source.provider, progress, cancelled,
    )  # fmt: skip
