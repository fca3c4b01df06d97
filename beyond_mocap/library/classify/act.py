"""One act that a classifier knows: how it looks, how sure that makes, where its moment lies, which words go with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

from ..proposal import Proposal
from .details import Details
from .kernel import Kernel
from .signals import RATE, STRIKES, Signals
from .windows import Space

NEAR = 0.15  # seconds within which a rule's moment and a candidate are the same
_APART = 10  # samples between two candidates
_STEADY = 9  # samples over which a stretch's score is averaged
_NOTHING = 0.01  # seconds: leads that are shorter are how somebody sets keys
_AROUND = 0.12  # seconds around a candidate in which its strike is looked for


@dataclass(frozen=True, eq=False, kw_only=True)
class Act:
    """word: what is done; moment: whether it has key moments, else it is a stretch. kernel: its looks; weights (3,): of
    its confidence (`confidence.sure`). silent: what counts as the rules' confidence where they say nothing. shown: by
    how many moments or seconds it was learned. strike: index of STRIKES whose peak tells the key frame, -1 for the
    score's own; lead: seconds by which the key comes after that peak. before, after: seconds of a row around its
    key."""

    word: str
    moment: bool
    kernel: Kernel
    weights: np.ndarray
    silent: float
    shown: float
    strike: int
    lead: float
    before: float
    after: float
    details: Details

    def told(self) -> str:
        """What it is and what it was learned from, for a person."""
        return f"{self.word}: {self.shown:.0f} moments" if self.moment else f"{self.word}: {self.shown:.1f} s"


def candidates(kernel: Kernel, rows: np.ndarray, seconds: np.ndarray, ruled: Sequence[Proposal], word: str):
    """Samples (C,) at which an act may have its moment, and their scores (C,): peaks of the score, and where the rules
    see one that has no peak near. rows (N, K): windows in their space; seconds (N,) of the samples."""
    score = smoothed(kernel.scores(rows))
    at = find_peaks(np.pad(score, 1, constant_values=-9.0), distance=_APART)[0] - 1
    for time in rule_moments(ruled, word):
        if not np.any(np.abs(seconds[at] - time) <= NEAR):
            at = np.append(at, np.argmin(np.abs(seconds - time)))
    return np.sort(at), score[np.sort(at)]


def smoothed(score: np.ndarray) -> np.ndarray:
    """(N,) the score without what lasts a single sample."""
    padded = np.pad(score, 1, mode="edge")
    return 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]


def steady(score: np.ndarray) -> np.ndarray:
    """(N,) a stretch's score over a third of a second."""
    return uniform_filter1d(score, _STEADY, mode="nearest") if len(score) else score


def rule_moments(ruled: Sequence[Proposal], word: str) -> list[float]:
    """Seconds of the key moments that the rules see of an act; `ruled` has seconds for frames (`in_seconds`)."""
    return [one.annotation.key for one in ruled if one.annotation.key is not None and word in one.annotation.words]


def rule_at(ruled: Sequence[Proposal], word: str, moment: bool, time: float) -> Proposal | None:
    """What the rules say of an act at a time in seconds: the surest; None where they say nothing."""
    there = [one for one in ruled if word in one.annotation.words and (one.annotation.key is not None) == moment]
    if moment:
        there = [one for one in there if abs(one.annotation.key - time) <= NEAR]
    else:
        there = [one for one in there if one.annotation.start <= time <= one.annotation.end]
    return max(there, key=lambda one: one.confidence, default=None)


def rule_sure(ruled: Sequence[Proposal], word: str, moment: bool, seconds: np.ndarray, silent: float) -> np.ndarray:
    """(N,) confidence of the rules at each of the times, `silent` where they say nothing."""
    found = (rule_at(ruled, word, moment, time) for time in seconds)
    return np.array([silent if one is None else one.confidence for one in found])


def struck(signals: Signals, strike: int, time: float) -> float:
    """Seconds of the strike's peak within a few frames of a time; the time itself where there is none."""
    fps = signals.fps
    first = max(0, int(np.ceil((time - _AROUND) * fps)))
    part = signals.strikes[first : int((time + _AROUND) * fps) + 1, strike]
    if strike < 0 or len(part) < 3:
        return time
    return (first + int(np.argmax(part))) / fps


def strike_of(signals: Sequence[tuple[Signals, float]]) -> tuple[int, float]:
    """Which strike peaks most steadily near the key moments of an act (its signals, its second), and the seconds by
    which the key comes after it; -1 where none is steady to two samples."""
    best = (2.0 / RATE, -1, 0.0)
    for strike in range(len(STRIKES)):
        late = np.array([time - struck(one, strike, time) for one, time in signals])
        lead = float(np.median(late))
        lead = lead if abs(lead) > _NOTHING else 0.0
        off = float(np.mean(np.abs(late - lead)))
        best = min(best, (off, strike, lead))
    return best[1], best[2]


def in_space(signals: Signals, space: Space) -> np.ndarray:
    """(N, K) the windows of signals."""
    from .windows import windows

    return space.within(windows(signals))
