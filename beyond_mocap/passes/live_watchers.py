"""Players of a live rally who have no part in a pass: they watch the ball, and turn to it by steps.

They are planned when the pass has begun, while its passer runs up: `live_passes` plans the passer and the receiver
alone, since it plans many passes of which one is played.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..library.library import Library
from ..motion.motion import Motion
from .live_passes import LivePass, Rally, build_standing_motion, continue_motion


def build_watchers(library: Library, rally: Rally, live_pass: LivePass,
                   progress: Callable[[float, str], None] | None = None,
                   cancelled: Callable[[], bool] | None = None) -> dict[str, Motion]:
    """Build how all players but passer and receiver watch a pass, and stand after it.

    Args:
        library: the library.
        rally: the rally, before the pass is added.
        live_pass: the pass.
        progress: receives the share of the work done and a short text.
        cancelled: whether to stop.
    Returns:
        Name -> motion on the pass's clock, at the rally's rate.
    Raises:
        UserCancelledError: if `cancelled` returns True.
    """
    names = [name for name in rally.players if name not in live_pass.motions]
    motions = {}
    for number, name in enumerate(names):
        if progress:
            progress(number / len(names), f"{name} watching")
        motions[name] = build_standing_motion(library, rally, name, (), live_pass.ball, cancelled=cancelled)
    return motions


def add_watchers(rally: Rally, motions: dict[str, Motion], live_pass: LivePass, begin: float, at: float) -> Rally:
    """Build the rally in which players watch a pass.

    Args:
        rally: the rally, the pass added.
        motions: as of `build_watchers`.
        live_pass: the pass.
        begin: s on the scene's clock at which the pass begins.
        at: s from which on they can change. Where that is after the strike, they watch later by that much: what they
            have missed would be a snap.
    Returns:
        The rally; everything before `at` stays.
    """
    at = rally.find_frame(at)
    missed = round(min(at - begin, live_pass.strike) * rally.rate)
    players = {name: continue_motion(rally.players[name], motion.frames(missed, len(motion)), at)
               for name, motion in motions.items()}
    return replace(rally, players={**rally.players, **players})
