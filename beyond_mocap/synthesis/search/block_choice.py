"""Which blocks are candidates where a library has more than a search compares.

A search compares every candidate with every other one, so their number is limited (`Plan.max_blocks`). What is left out
decides what can be shown: candidates are chosen by what a section asks for, labels and speed, and from many clips.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

STRETCH = 32
"""Frames of a clip that are chosen together, so that a block's own continuation is a candidate too."""
REPEAT_COST = 0.05
"""Cost of each further candidate of one clip, in units of eq. 18, so that equally good ones come from many clips."""
SPEED_COST, SPEED_CLASS = 1.0, 0.5
"""Cost in units of eq. 18 per m/s that a stretch is too slow or too fast; width in m/s of a class of track speeds."""

Demand = tuple[frozenset[str], float]
"""What frames of a section ask for: labels, and speed in m/s."""


def rank_varied(cost: np.ndarray, clip: np.ndarray) -> np.ndarray:
    """Rank candidates by cost, where each further one of the same clip costs REPEAT_COST more.

    Args:
        cost: (M,) cost of each.
        clip: (M,) its clip.
    Returns:
        (M,) indices, the best first; ties go to the first.
    """
    order = np.lexsort((np.arange(len(cost)), cost, clip))
    first = np.flatnonzero(np.diff(clip[order], prepend=-1))
    place = np.empty(len(cost), int)
    place[order] = np.arange(len(cost)) - np.repeat(first, np.diff([*first, len(cost)]))
    return np.argsort(cost + REPEAT_COST * place, kind="stable")


def count_demands(labels: list[frozenset[str]], speed: np.ndarray) -> Counter[Demand]:
    """Count what the frames of a section ask for.

    Args:
        labels: F sets of requested labels.
        speed: (F,) m/s of the track.
    """
    classes = SPEED_CLASS * np.round(speed / SPEED_CLASS)
    return Counter(zip(labels, classes.tolist()))


def choose_stretches(
    demands: Mapping[Demand, int], label_cost: Mapping[frozenset[str], np.ndarray], speed: np.ndarray,
    clip: np.ndarray, stretch: np.ndarray, limit: int,
) -> np.ndarray:
    """Choose blocks by what a section asks for: each demand has a share of the limit as large as its share of frames.

    Args:
        demands: demand -> number of frames.
        label_cost: requested labels -> (M,) eq. 18 of each block.
        speed: (M,) m/s of each block.
        clip: (M,) its clip.
        stretch: (M,) number of the stretch of its clip that it belongs to, ascending.
        limit: blocks to choose.
    Returns:
        (M,) bool, at most `limit` of them, in whole stretches.
    """
    first = np.flatnonzero(np.diff(stretch, prepend=-1))
    size = np.diff([*first, len(stretch)])
    pace, owner = np.add.reduceat(speed, first) / size, clip[first]
    chosen, frames = np.zeros(len(first), bool), sum(demands.values())
    for (labels, wanted), count in sorted(demands.items(), key=lambda pair: (-pair[1], pair[0][1], sorted(pair[0][0]))):
        cost = np.add.reduceat(label_cost[labels], first) / size + SPEED_COST * np.abs(pace - wanted)
        room, share = limit - int(size[chosen].sum()), int(np.ceil(limit * count / frames))
        for one in rank_varied(cost, owner):
            if share <= 0 or size[one] > room:
                break
            if not chosen[one]:
                chosen[one], room = True, room - size[one]
            share -= size[one]
    return np.repeat(chosen, size)
