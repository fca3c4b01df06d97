"""How well the words were met: Faustino's annotation similarity (§3.2.2 eq. 18), as printed and over the asked words
only.

Words are sets per frame; sides are those after mirroring. A frame whose asked words are None (transition, or nothing
known to be asked) is left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np


def eq18(asked: Iterable[str], played: Iterable[str]) -> float:
    """Faustino eq. 18 for one frame as printed: -1 all words alike .. 1 none, NaN where neither has a word.

    With 1 for a present and -1 for an absent word, the products over words that either frame has, negated, over their
    number r: one word in common counts -1, one that only one of them has counts +1.
    """
    asked, played = set(asked), set(played)
    either = asked | played
    return (len(asked ^ played) - len(asked & played)) / len(either) if either else np.nan


def asked_similarity(asked: Iterable[str], played: Iterable[str]) -> float:
    """Eq. 18 over the asked words only: -1 all are played .. 1 none is; words beyond those count neither way."""
    asked = set(asked)
    return 1.0 - 2.0 * len(asked & set(played)) / len(asked) if asked else np.nan


def similarity(
    asked: Sequence[Iterable[str] | None], played: Sequence[Iterable[str]], measure=asked_similarity
) -> np.ndarray:
    """`measure` at every frame: (T,), NaN where nothing was asked. Takes repeat words, so each pair is scored once."""
    known: dict[tuple, float] = {}
    out = np.full(len(played), np.nan)
    for frame, (want, have) in enumerate(zip(asked, played)):
        if want is None:
            continue
        pair = (tuple(want), tuple(have))
        if pair not in known:
            known[pair] = measure(*pair)
        out[frame] = known[pair]
    return out


def mean_similarity(values: np.ndarray) -> float:
    """Mean of the frames that count, NaN where none does (Faustino Table 2 averages so)."""
    counted = values[np.isfinite(values)]
    return float(counted.mean()) if len(counted) else np.nan
