"""On which side two capsules pass each other that go through each other.

The shortest way apart turns round at the moment at which their lines cross: pushed by it, both would be pushed the one
way before and the other way after, and stay where they are. So they part on the side on which they miss each other on
the whole, over some tenths of a second.
"""

from __future__ import annotations

import numpy as np

from .capsules import Touching

SECONDS = 0.2
"""Seconds before and behind a moment within which a contact counts for the side at that moment, less the farther."""


def sides(found: Touching, fps: float) -> np.ndarray:
    """(K, 3) unit vectors from the other to the one: the way between both lines (`Touching.away` as long as they are
    apart), weighed over SECONDS around among contacts of the same two capsules."""
    reach = max(1, round(SECONDS * fps))
    order = np.lexsort((found.frame, found.other, found.one))
    frame, one, other = found.frame[order], found.one[order], found.other[order]
    off = (found.away * (found.radii - found.depth)[:, None])[order]
    total = np.array(off)
    for step in range(1, min(reach, len(off))):
        apart = frame[step:] - frame[:-step]
        same = (one[step:] == one[:-step]) & (other[step:] == other[:-step])
        weight = np.where(same, np.maximum(1.0 - apart / reach, 0.0), 0.0)[:, None]
        total[step:] += weight * off[:-step]
        total[:-step] += weight * off[step:]
    out = np.empty_like(total)
    out[order] = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-9)
    return out
