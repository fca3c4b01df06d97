"""Costs of blocks: other labels (Faustino 2016, §3.2.2, eq. 18), and distance of poses (§3.2.1, eq. 16, 17)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...library.features import Frames
from ..plan import Plan

Labels = frozenset[str] | None

FITTED_ALPHA = 0.6
"""Weight of labels against continuity in units of the typical distance, fitted by `python -m benchmarks alpha`."""


class AnnotationCost:
    """Evaluate eq. 18 for every block of the library at once.

    Per frame, with a the requested and m the clip's labels: the labels both have count +1, those only one has -1, and
    the sum is divided by the number of labels in either; over a block, sums and counts are added before dividing. D is
    that with the sign inverted: -1 where all agree, 1 where none does. Frames without requested labels (transitions)
    have no effect.

    Attributes:
        frames: the library's N frames.
    """

    def __init__(self, frames: Frames):
        """Prepare running sums over the frames.

        Args:
            frames: the library's, N frames.
        """
        self.frames = frames
        self._column = {word: i for i, word in enumerate(frames.vocabulary)}
        self._sums: dict[frozenset[str], np.ndarray] = {}
        self._present = _running_sum(frames.words.sum(axis=1))

    def compute_block_costs(self, start: np.ndarray, requested: Sequence[Labels]) -> np.ndarray:
        """Compute D of blocks.

        Args:
            start: (M,) first library frame of each block; a block that reaches beyond the library's frames counts as
                its last frame there.
            requested: requested labels of each of the block's frames, None where any will do.
        Returns:
            (M,) D, -1 to 1.
        """
        common = np.zeros(len(start))
        either = np.zeros(len(start))
        for low, high, words in _label_runs(requested):
            if words is None:
                continue
            a, b = self._limit_frame(start + low), self._limit_frame(start + high)
            # differences of running sums: count over the library frames a .. b of each block
            shared = self._shared_count(words)
            inside = shared[b] - shared[a]
            common += inside
            either += (self._present[b] - self._present[a]) + len(words) * (high - low) - inside
        # both - only one = both - (either - both)
        return np.where(either > 0, -(2.0 * common - either) / np.maximum(either, 1.0), 0.0)

    def count_labels(self, frame: np.ndarray, requested: frozenset[str]) -> tuple[np.ndarray, np.ndarray]:
        """Count the labels that library frames have in common with the requested ones, and those that either has.

        Args:
            frame: library frames, of any shape.
            requested: requested labels.
        """
        shared = np.diff(self._shared_count(requested))[frame]
        return shared, np.diff(self._present)[frame] + len(requested) - shared

    def find_frames_with(self, words: frozenset[str]) -> np.ndarray:
        """Return (N,) bool: frames that carry any of the labels."""
        return np.diff(self._shared_count(words)) > 0

    def compute_missing_share(self, words: frozenset[str]) -> np.ndarray:
        """Compute the share (N,) of the requested labels that each frame lacks."""
        shared = np.diff(self._shared_count(words))
        return 1.0 - shared / max(len(words), 1)

    def _limit_frame(self, frame: np.ndarray) -> np.ndarray:
        return np.clip(frame, 0, len(self.frames))

    def _shared_count(self, words: frozenset[str]) -> np.ndarray:
        """Return the running count (N + 1,) of requested labels that frames carry, cached per set of labels."""
        if words not in self._sums:
            columns = [self._column[word] for word in sorted(words) if word in self._column]
            self._sums[words] = _running_sum(self.frames.words[:, columns].sum(axis=1))
        return self._sums[words]


def _running_sum(values: np.ndarray) -> np.ndarray:
    """Return the running sum (N + 1,) of values (N,), from 0."""
    return np.concatenate([[0], np.cumsum(values, dtype=np.int64)])


def _label_runs(requested: Sequence[Labels]) -> list[tuple[int, int, Labels]]:
    """List (first, end, labels) of the stretches with the same requested labels."""
    edges = [0] + [i for i in range(1, len(requested)) if requested[i] != requested[i - 1]] + [len(requested)]
    return [(low, high, requested[low]) for low, high in zip(edges, edges[1:])]


def collect_windows(frames: Frames, clip: np.ndarray, centre: np.ndarray, size: int) -> np.ndarray:
    """Collect augmented features of windows around frames.

    A window that would leave its clip is moved inwards (fig. 7b); a clip shorter than the window repeats its last
    frame. Eq. 17 compares the window around a block's last frame with the one around the next block's first, which are
    one frame apart even in an uncut clip; callers centre the first one frame later, as eq. 16 does, so that continuing
    costs nothing.

    Args:
        frames: the library's.
        clip: (M,) clips.
        centre: (M,) library frames.
        size: frames in a window.
    Returns:
        (M, size * D) features.
    Source: Faustino 2016, §3.2.1, eq. 16, 17, fig. 7b.
    """
    first, last = frames.first[clip], frames.first[clip] + frames.count[clip] - 1
    start = np.clip(centre - size // 2, first, np.maximum(last - size + 1, first))
    index = np.minimum(start[:, None] + np.arange(size), last[:, None])
    return frames.features[index].reshape(len(index), -1)


def compute_distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute the Euclidean distances (A, B) between rows (A, K) and (B, K)."""
    # |a - b|^2 = |a|^2 + |b|^2 - 2 a b, as one matrix product
    square = (a * a).sum(1)[:, None] + (b * b).sum(1)[None, :] - 2.0 * (a @ b.T)
    return np.sqrt(np.maximum(square, 0.0))


def measure_typical_distance(frames: Frames) -> float:
    """Compute the root mean square distance of two frames drawn at random.

    This length makes continuity costs about one for unrelated poses, in any library. Eq. 13 weighs continuity against
    annotation, which lies within +-1; without a common scale alpha would mean something else in every library.
    """
    return float(np.sqrt(2.0 * frames.features.var(axis=0, dtype=float).sum())) or 1.0


def rescale_alpha(alpha: float, fitted: float = FITTED_ALPHA) -> float:
    """Convert the setting alpha to the weight of labels against continuity in units of the typical distance.

    The thesis found 0.2 for its own C, whose unit is that of its features. Divided by the typical distance, C is
    smaller, and the weight that plays the part of 0.2 is `fitted`. The ratio of both weights keeps its meaning: 0 and 1
    stay what they are, and twice the ratio is twice the ratio.

    Args:
        alpha: the setting, 0 to 1; its default is the thesis' 0.2.
        fitted: what the default becomes.
    Source: Faustino 2016, eq. 13.
    """
    default = Plan.alpha
    ratio = fitted / (1.0 - fitted) * (1.0 - default) / default
    return ratio * alpha / (ratio * alpha + 1.0 - alpha)
