"""On which side two capsules pass each other that go through each other, and which way out that is.

The shortest way apart turns round at the moment at which their lines cross: pushed by it, both would be pushed the one
way before and the other way after, and stay where they are. So they part on the side on which they miss each other on
the whole, over some tenths of a second.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import unit_vectors
from .capsules import Touching

SECONDS = 0.2
"""Seconds before and behind a moment within which a contact counts for the side at that moment, less the farther."""


OUTWARD = 2.0
"""How much the way between two trunks counts against the side on which two capsules pass."""


def sides(found: Touching, before: np.ndarray, fps: float) -> np.ndarray:
    """(K, 3) unit vectors from the other to the one: the way from line to line plus `before` (K, 3) m, weighed over
    SECONDS around each contact among contacts of the same two capsules."""
    reach = max(1, round(SECONDS * fps))
    order = np.lexsort((found.frame, found.other, found.one))
    frame, one, other = found.frame[order], found.one[order], found.other[order]
    off = (_off(found) + before)[order]
    total = np.array(off)
    for step in range(1, min(reach, len(off))):
        apart = frame[step:] - frame[:-step]
        same = (one[step:] == one[:-step]) & (other[step:] == other[:-step])
        weight = np.where(same, np.maximum(1.0 - apart / reach, 0.0), 0.0)[:, None]
        total[step:] += weight * off[:-step]
        total[:-step] += weight * off[step:]
    out = np.empty_like(total)
    out[order] = unit_vectors(total)
    return out


def way_out(found: Touching, side: np.ndarray, trunks: np.ndarray, allowed: float) -> tuple[np.ndarray, np.ndarray]:
    """Which way (K, 3), unit, the one leaves the other by, and how far (K,) m until they are `allowed` m in each other,
    negative where there is room. side (K, 3): on which they pass, turned towards the way over the ground from the
    other's trunk to the one's, trunks (T, 3) m, so that limbs that have caught each other come free."""
    out = trunks[found.frame] * np.array([1.0, 1.0, 0.0])
    way = unit_vectors(side + OUTWARD * unit_vectors(out))
    off = _off(found)
    along = np.einsum("kc,kc->k", way, off)
    square = along**2 + (found.radii - allowed) ** 2 - np.einsum("kc,kc->k", off, off)
    return way, np.sqrt(np.maximum(square, 0.0)) - along


def _off(found: Touching) -> np.ndarray:
    """(K, 3) m from the other's line to the one's."""
    return found.away * (found.radii - found.depth)[:, None]
