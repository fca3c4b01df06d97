"""Players kept out of step: each shows a clip rather at a phase of his own than at another's.

Players whose tracks are alike are given the same footage, and where they begin it at the same time they move as one. A
clip that is played goes along with the clock: whoever shows its second s at time t of the match is s - t ahead of it
for as long as he shows it, and this is his lag. Every player likes lags that are PERIOD apart, and players who come
near each other are given other ones (`match.crowd.variety.lags`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...library.library import Library

PERIOD = 3.6
"""Seconds from one liked lag to the next."""

SPREAD = 0.6180339887
"""Of a period by which a clip's places in it are ahead of those of the clip before: a clip that is shorter than a
period has room for some lags only, and others have room for the rest. Multiples of the golden section lie evenly."""

LIKED, DISLIKED = 0.05, 0.45
"""Seconds from a liked lag within which all is well, and from which on it is as bad as it gets."""


@dataclass(frozen=True, eq=False)
class Taste:
    """place (N,) int: where each library frame lies in the period; table (2 P,) float32: what a lag costs per slot, two
    periods of P frames; start: frames of the track's first frame on the match's clock."""

    place: np.ndarray
    table: np.ndarray
    start: int

    def cost(self, first: int, frame: np.ndarray) -> np.ndarray:
        """(K,) what it costs to show library frames (K,) from the track's frame `first` on."""
        return self.table[self.place[frame] + (-first - self.start) % (len(self.table) // 2)]


def taste(library: Library, lag: float, variety: float, start: float) -> Taste | None:
    """The taste of a player who likes this lag, s: 0 to `variety` (m/s of missed speed) per slot; None where that is 0.
    start: seconds of the track's first frame on the match's clock."""
    if not variety:
        return None
    frames = library.frames
    period = round(PERIOD * library.fps)
    offset = np.arange(len(frames.first)) * SPREAD % 1.0 * period
    place = (np.arange(len(frames)) - frames.first[frames.clip] + offset.astype(int)[frames.clip]) % period
    off = np.arange(period) / period - lag / PERIOD
    away = np.abs(off - np.round(off)) * PERIOD
    table = variety * np.clip((away - LIKED) / (DISLIKED - LIKED), 0.0, 1.0)
    return Taste(place, np.tile(table, 2).astype(np.float32), round(start * library.fps))
