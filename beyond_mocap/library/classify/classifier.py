"""A classifier of acts: what it proposes for a recording, beside what the rules do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation import LOCOMOTION, ClipAnnotation, swap_sides
from ...base.time_series import runs
from ...motion.motion import Motion
from ..proposal import LEARNED, Proposal
from . import confidence
from .act import Act, candidates, in_space, rule_at, rule_sure, steady, struck
from .signals import RATE, Signals, signals
from .windows import Space

LEAST = 0.2
"""Moments that are less sure than this are not proposed at all."""

_APART = 0.35  # seconds between two moments, whatever they are: of two nearer ones the surer counts
_SHORTEST = 0.3  # seconds of a stretch


@dataclass(frozen=True, eq=False)
class Classifier:
    """space: what windows are reduced to; acts: all that it knows; clips: number of clips that it has learned from."""

    space: Space
    acts: tuple[Act, ...]
    clips: int

    def told(self) -> tuple[str, ...]:
        """What it has learned, a line each, for a person."""
        first = f"learned from {self.clips} {'clip' if self.clips == 1 else 'clips'}"
        return (first, *(act.told() for act in self.acts))

    def propose(self, motion: Motion, ruled: Sequence[Proposal]) -> tuple[Proposal, ...]:
        """What a recording may show, by its first frame. ruled: what the rules say of it; of acts that the classifier
        knows it decides, the rest of the rules stays. InputError where the skeleton has no legs."""
        seen = signals(motion)
        rows, seconds = in_space(seen, self.space), seen.frames / seen.fps
        told = in_seconds(ruled, seen.fps)
        moments = [one for act in self.acts if act.moment for one in _moments(act, seen, rows, seconds, told)]
        stretches = [one for act in self.acts if not act.moment for one in _stretches(act, seen, rows, seconds, told)]
        own = {(act.word, act.moment) for act in self.acts}
        rest = [one for one in ruled if not any(
            (word, one.annotation.key is not None) in own for word in one.annotation.words)]
        found = [*_surest(moments, seen.fps), *stretches, *rest]
        return tuple(sorted(found, key=lambda one: (one.annotation.start, one.annotation.end)))


def in_seconds(ruled: Sequence[Proposal], fps: float, mirrored: bool = False) -> tuple[Proposal, ...]:
    """Proposals whose rows count seconds instead of frames; of the mirrored body where asked."""
    out = []
    for one in ruled:
        row = one.annotation
        key = None if row.key is None else row.key / fps
        words = swap_sides(row.words) if mirrored else row.words
        out.append(replace(one, annotation=ClipAnnotation(row.start / fps, row.end / fps, key, words)))
    return tuple(out)


def _moments(act: Act, seen: Signals, rows, seconds, told) -> list[Proposal]:
    """The key moments of one act."""
    at, score = candidates(act.kernel, rows, seconds, told, act.word)
    sure = confidence.sure(act.weights, score, rule_sure(told, act.word, True, seconds[at], act.silent))
    likely = [(sample, float(how)) for sample, how in zip(at, sure) if how >= LEAST]
    return [_moment(act, seen, rows, seconds=seconds, told=told, sample=sample, sure=how) for sample, how in likely]


def _moment(act: Act, seen: Signals, rows, seconds, told, sample: int, sure: float) -> Proposal:
    """One moment: its frame from the strike near the candidate, its words from the windows there."""
    rule = rule_at(told, act.word, True, float(seconds[sample]))
    key = struck(seen, act.strike, float(seconds[sample])) + act.lead
    there = np.clip(np.round(key * RATE).astype(int) + np.arange(-1, 2), 0, len(rows) - 1)
    words = (act.word, *act.details.said(rows[there], rule))
    row = _row(seen, key - act.before, key + act.after, key, words)
    return Proposal(row, sure, f"looks like it; {rule.why}" if rule else "looks like it", LEARNED)


def _stretches(act: Act, seen: Signals, rows, seconds, told) -> list[Proposal]:
    """The stretches of one act."""
    score = steady(act.kernel.scores(rows))
    rule = rule_sure(told, act.word, False, seconds, act.silent)
    sure = confidence.sure(act.weights, score, rule)
    out = []
    for start, stop in runs(sure >= 0.5):
        if stop - start >= _SHORTEST * RATE:
            heard = rule_at(told, act.word, False, float(seconds[(start + stop) // 2]))
            said = act.details.said(rows[start:stop], heard)
            words = (act.word, *(word for word in said if word not in LOCOMOTION))
            row = _row(seen, seconds[start], seconds[stop - 1], None, words)
            out.append(Proposal(row, float(sure[start:stop].mean()), "looks like it", LEARNED))
    return out


def _row(seen: Signals, start: float, end: float, key: float | None, words) -> ClipAnnotation:
    """A row in frames of the recording from seconds, cut to it."""
    last = seen.count - 1
    first, final = (int(np.clip(round(time * seen.fps), 0, last)) for time in (start, end))
    frame = None if key is None else int(np.clip(round(key * seen.fps), first, final))
    return ClipAnnotation(first, final, frame, tuple(words))


def _surest(found: list[Proposal], fps: float) -> list[Proposal]:
    """Of moments that are too near to each other the surest."""
    kept: list[Proposal] = []
    for one in sorted(found, key=lambda one: -one.confidence):
        if all(abs(one.annotation.key - other.annotation.key) > _APART * fps for other in kept):
            kept.append(one)
    return kept
