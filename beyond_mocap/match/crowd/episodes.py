"""Which bodies come near which and when, put together into groups that have to be looked at together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.time_series import runs

Span = tuple[int, int, tuple[int, int]]
"""First frame, end, and the numbers of two bodies."""


@dataclass(frozen=True)
class Episode:
    """Bodies that come near each other, one through the other. bodies: their numbers, ascending; first, end: frames;
    pairs: (one, other) of those that do."""

    bodies: tuple[int, ...]
    first: int
    end: int
    pairs: tuple[tuple[int, int], ...]


def episodes(positions: np.ndarray, distance: float, reach: int) -> list[Episode]:
    """All times at which two of the positions (P, N, 2) m, NaN where somebody is not there, are nearer than `distance`
    metres, `reach` frames before and behind included; what overlaps in time and shares a body is one episode."""
    found = []
    for one in range(len(positions) - 1):
        off = positions[one + 1 :] - positions[one]
        near = np.einsum("pnk,pnk->pn", off, off) < distance**2
        for other in np.flatnonzero(near.any(axis=1)):
            pair = (one, one + 1 + int(other))
            found += [(max(low - reach, 0), min(high + reach, len(near[0])), pair) for low, high in runs(near[other])]
    return joined_spans(found)


def joined_spans(spans: list[Span]) -> list[Episode]:
    """Spans (first frame, end, pair of bodies) as episodes: those that overlap in time and share a body are one."""
    groups: list[tuple[int, int, set, set]] = []
    for first, end, pair in sorted(spans):
        bodies, pairs = set(pair), {pair}
        while met := [g for g in groups if g[0] < end and first < g[1] and g[2] & bodies]:  # what is joined meets more
            groups = [g for g in groups if not any(g is other for other in met)]
            for low, high, others, theirs in met:
                first, end, bodies, pairs = min(first, low), max(end, high), bodies | others, pairs | theirs
        groups.append((first, end, bodies, pairs))
    whole = [Episode(tuple(sorted(bodies)), first, end, tuple(sorted(pairs))) for first, end, bodies, pairs in groups]
    return sorted(whole, key=lambda episode: (episode.first, episode.bodies))


def meetings(spans: list[Span], met: list[Span]) -> list[Episode]:
    """These spans as episodes, together with all who meet their bodies at the same time by the spans `met`, and in turn
    those: nobody is pushed into somebody who is not looked at."""
    spans = list(spans)
    while True:
        found = joined_spans(spans)
        more = [
            (max(first, one.first), min(end, one.end), pair)
            for one in found
            for first, end, pair in met
            if first < one.end and one.first < end and set(pair) & set(one.bodies) and pair not in one.pairs
        ]
        if not more:
            return found
        spans += more
