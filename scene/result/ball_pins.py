"""Where a pin of the ball begins: the key moment nearest to a time at which a player meets the ball, and the ball's
place there in the player's newest take, or in the tracking before there is one.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.synthesis.ball_pins import list_ball_keys
from ..core import session
from ..core.settings import BeyondMocapPlayer
from .plans import build_plan


@dataclass(frozen=True, eq=False)
class BallMoment:
    """A key moment at which a player meets the ball.

    Attributes:
        time: s on the track's clock at which it is requested.
        second: s on the track's clock of the frame on which it is played.
        place: (3,) m of the ball's centre there, world; NaN where there is no ball.
    """

    time: float
    second: float
    place: np.ndarray


def find_ball_moment(scene: bpy.types.Scene, player: BeyondMocapPlayer, seconds: float) -> BallMoment:
    """Find the key moment nearest to a time at which a player meets the ball.

    Raises:
        InputError: if no key moment of the player has the ball, or the tracking has no ball.
    """
    plan, _ = build_plan(scene.beyond_mocap, player)
    sampled = plan.sample_track(plan.fps)
    if not np.isfinite(sampled.ball).any():
        raise InputError(f"player {player.name}", "tracking without a ball", "a ball that a pin can move",
                         "import tracking that has the ball")
    stored = session.find_take(player.take) if player.take else None
    moments = [_play_moment(key, stored.take if stored else None)
               or BallMoment(key.time, key.time, sampled.ball[int(np.argmin(np.abs(sampled.times - key.time)))])
               for key in list_ball_keys(plan.timeline)]
    if not moments:
        raise InputError(f"player {player.name}", "no key moment with the ball", "one, such as a kick or a header",
                         "add it in step 3")
    return min(moments, key=lambda moment: abs(moment.second - seconds))


def _play_moment(key, take) -> BallMoment | None:
    """Find when and where a take plays a key moment; None where it does not."""
    if take is None or take.ball is None:
        return None
    result = next((result for result in take.keys
                   if (result.requested.time, result.requested.words) == (key.time, key.words)), None)
    if result is None:
        return None
    frame = int(np.clip(np.rint(result.frame), 0, len(take.motion) - 1))
    return BallMoment(key.time, float(take.ball.times[frame]), take.ball.positions[frame])
