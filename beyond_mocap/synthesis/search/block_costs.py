"""What blocks cost: words other than asked (Faustino §3.2.2 eq. 18), and poses that are apart (§3.2.1 eq. 16, 17)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...library.features import Frames

Words = frozenset[str] | None


class AnnotationCost:
    """Eq. 18 for every block of the library at once.

    Per frame, with a the asked and m the clip's words: the words both have count +1, those only one has -1, and the sum
    is divided by the number of words in either; over a block sums and counts are added before dividing. D is that with
    the sign turned: -1 where all agree, 1 where none does. Frames without asked words (transitions) count neither way.
    """

    def __init__(self, frames: Frames):
        """`frames`: the library's, N frames."""
        self.frames = frames
        self._column = {word: i for i, word in enumerate(frames.vocabulary)}
        self._sums: dict[frozenset[str], np.ndarray] = {}
        self._present = _running_sum(frames.words.sum(axis=1))

    def of_blocks(self, start: np.ndarray, asked: Sequence[Words]) -> np.ndarray:
        """(M,) D of blocks that start at frames `start` (M,) for the asked words of each of their frames. A block that
        reaches beyond the library's frames counts as its last frame there."""
        common = np.zeros(len(start))
        either = np.zeros(len(start))
        for low, high, words in _runs(asked):
            if words is None:
                continue
            a, b = self._clamped(start + low), self._clamped(start + high)
            shared = self._shared(words)
            inside = shared[b] - shared[a]
            common += inside
            either += (self._present[b] - self._present[a]) + len(words) * (high - low) - inside
        # both - only one = both - (either - both)
        return np.where(either > 0, -(2.0 * common - either) / np.maximum(either, 1.0), 0.0)

    def showing(self, words: frozenset[str]) -> np.ndarray:
        """(N,) bool: frames that carry any of the words."""
        return np.diff(self._shared(words)) > 0

    def missing_share(self, words: frozenset[str]) -> np.ndarray:
        """(N,) share of the asked words that each frame lacks."""
        shared = np.diff(self._shared(words))
        return 1.0 - shared / max(len(words), 1)

    def _clamped(self, frame: np.ndarray) -> np.ndarray:
        return np.clip(frame, 0, len(self.frames))

    def _shared(self, words: frozenset[str]) -> np.ndarray:
        """(N + 1,) running count of asked words that frames carry."""
        if words not in self._sums:
            columns = [self._column[word] for word in sorted(words) if word in self._column]
            self._sums[words] = _running_sum(self.frames.words[:, columns].sum(axis=1))
        return self._sums[words]


def _running_sum(values: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(values, dtype=np.int64)])


def _runs(asked: Sequence[Words]) -> list[tuple[int, int, Words]]:
    """(first, end, words) of stretches with the same words."""
    edges = [0] + [i for i in range(1, len(asked)) if asked[i] != asked[i - 1]] + [len(asked)]
    return [(low, high, asked[low]) for low, high in zip(edges, edges[1:])]


def windows(frames: Frames, clip: np.ndarray, centre: np.ndarray, size: int) -> np.ndarray:
    """Augmented features (M, size * D) of windows of `size` frames of clips `clip` (M,), centred on frames `centre`
    (M,).

    A window that would leave its clip is moved inwards (Faustino fig. 7b); a clip shorter than the window repeats its
    last frame. Eq. 17 compares the window around a block's last frame with the one around the next block's first, which
    are one frame apart even in an uncut clip; callers centre the first one frame later, as eq. 16 does, so that going
    on costs nothing."""
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
