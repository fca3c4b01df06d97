"""How far apart two moments of the library are (Faustino §3.2.1 eq. 16, 17)."""

from __future__ import annotations

import numpy as np

from ...library.features import Frames


def windows(frames: Frames, clip: np.ndarray, centre: np.ndarray, size: int) -> np.ndarray:
    """Augmented features (M, size * D) of windows of `size` frames of clips `clip` (M,), centred on frames `centre`
    (M,).

    A window that would leave its clip is moved inwards (Faustino fig. 7b); a clip shorter than the window repeats its
    last frame. Eq. 17 compares the window around a block's last frame with the one around the next block's first, which
    are one frame apart even in an uncut clip; callers centre the first one frame later, as eq. 16 does, so that going
    on costs nothing.
    """
    first, last = frames.first[clip], frames.first[clip] + frames.count[clip] - 1
    start = np.clip(centre - size // 2, first, np.maximum(last - size + 1, first))
    index = np.minimum(start[:, None] + np.arange(size), last[:, None])
    return frames.features[index].reshape(len(index), -1)


def distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(A, B) Euclidean distances between rows (A, K) and (B, K)."""
    square = (a * a).sum(1)[:, None] + (b * b).sum(1)[None, :] - 2.0 * (a @ b.T)
    return np.sqrt(np.maximum(square, 0.0))


def typical_distance(frames: Frames) -> float:
    """Root mean square distance of two frames taken at random: the length that makes continuity costs about one for
    poses that have nothing to do with each other, in any library. Eq. 13 weighs continuity against annotation, which
    lies within +-1; without a common scale alpha = 0.2 would mean something else in every library."""
    return float(np.sqrt(2.0 * frames.features.var(axis=0, dtype=float).sum())) or 1.0
