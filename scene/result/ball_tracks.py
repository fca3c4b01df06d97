"""Whether the takes that are shown agree on where the ball is: the scene has one ball, which follows the first of
them.
"""

from __future__ import annotations

from functools import lru_cache

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError, format_some
from ...beyond_mocap.base.time_series import interpolate_columns
from ..core import notices, session

TOPIC = "ball tracks"
DIFFERENT = 1.0  # metres between two balls that are not the same one
SHARE = 0.1  # of a track's samples that have to be as far away; a gap of one file alone is no other ball


def post_difference(scene: bpy.types.Scene) -> None:
    """Post a notice where the shown takes have different balls; clear it where they have not."""
    notices.clear_notices(scene, TOPIC)
    if (difference := describe_difference(scene)) is not None:
        notices.post_notice(scene, notices.Subject(topic=TOPIC, room="synthesis", title="Ball"), difference)


def describe_difference(scene: bpy.types.Scene) -> InputError | None:
    """Describe which shown players have another ball than the one that the scene's ball follows; None for none."""
    settings = scene.beyond_mocap
    shown = [(player.name, player.take) for player in settings.players if player.result.state != "NONE"
             and (stored := session.find_take(player.take)) is not None and stored.take.ball is not None]
    if len(shown) < 2 or not settings.make_ball:
        return None
    (first, leading), *others = shown
    distances = {name: _measure_distance(leading, take) for name, take in others}
    found = {name: distance for name, distance in distances.items() if distance}
    if not found:
        return None
    most = max(found.values())
    return InputError(f"ball of {format_some([*found])}",
                      f"up to {most:.0f} m from the ball of {first}, which the scene's ball follows",
                      "the same ball in all tracks",
                      "their touches meet their own ball only: show them alone, or give all tracks one ball")


@lru_cache(maxsize=session.MAX_TAKES)
def _measure_distance(leading: str, take: str) -> float:
    """Measure the largest distance, m, of the ball in a take's track from that in the leading take's; 0 where it is the
    same ball. Takes never change under their name, and each take that is shown asks about all others.
    """
    (leading_times, leading_places), (times, places) = (
        session.find_take(name).plan.track.known_ball for name in (leading, take))
    if not len(times) or not len(leading_times):
        return 0.0
    distances = np.linalg.norm(interpolate_columns(times, leading_times, leading_places) - places, axis=1)
    return float(distances.max()) if np.mean(distances > DIFFERENT) > SHARE else 0.0
