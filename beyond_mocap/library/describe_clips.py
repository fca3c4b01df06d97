"""Frames of clips with the words that they carry, described by features."""

from __future__ import annotations

import numpy as np

from .clip import Clip
from .features import FPS, Frames, describe


def described(clips, like: Frames | None = None) -> Frames:
    """Frames of `clips` with all words they carry, their features comparable with those of `like`."""
    from threadpoolctl import threadpool_limits

    vocabulary = tuple(sorted({word for clip in clips for row in clip.annotations for word in row.words}))
    words_of = lambda clip, source: words_matrix(clip, source, vocabulary)  # noqa: E731
    with threadpool_limits(limits=1):  # with more, sums of products come out in another order
        return describe(clips[0].motion.skeleton, clips, words_of, vocabulary, FPS, like)


def words_matrix(clip: Clip, source: np.ndarray, vocabulary: tuple[str, ...]) -> np.ndarray:
    """(T, V) bool: which words of `vocabulary` a clip carries at fractional frames `source` (T,) of its own rate."""
    column = {word: i for i, word in enumerate(vocabulary)}
    out = np.zeros((len(source), len(vocabulary)), bool)
    for row in clip.annotations:
        inside = (source >= row.start) & (source <= row.end)
        for word in row.words:
            out[inside, column[word]] = True
    return out
