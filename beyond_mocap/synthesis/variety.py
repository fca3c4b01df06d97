"""Players kept out of step: each shows a clip rather at a phase of his own than at another's.

Players whose tracks are alike are given the same footage, and where they begin it at the same time they move as one. A
clip that is played goes along with the clock, so whoever shows clip time s at match time t is s - t behind it as long as
he shows it. Every player likes some of these lags, PERIOD apart, and each player others: the lag of his seed, by the
golden ratio, so that any few players with seeds in a row lie far apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..library.library import Library

PERIOD = 2.4
"""Seconds from one liked lag to the next."""

LIKED, DISLIKED = 0.15, 0.6
"""Seconds from a liked lag within which all is well, and from which on it is as bad as it gets."""

_GOLDEN = (5.0**0.5 - 1.0) / 2.0


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


def taste(library: Library, seed: int, variety: float, start: float) -> Taste | None:
    """The taste of a player with this seed: 0 to `variety` (m/s of missed speed) per slot; None where that is 0. start:
    seconds of the track's first frame on the match's clock."""
    if not variety:
        return None
    frames = library.frames
    period = round(PERIOD * library.fps)
    place = (np.arange(len(frames)) - frames.first[frames.clip]) % period
    lag = np.arange(period) / period - seed * _GOLDEN
    away = np.abs(lag - np.round(lag)) * PERIOD
    table = variety * np.clip((away - LIKED) / (DISLIKED - LIKED), 0.0, 1.0)
    return Taste(place, np.tile(table, 2).astype(np.float32), round(start * library.fps))
