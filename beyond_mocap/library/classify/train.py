"""Training: from a few annotated clips to a classifier of their acts.

Every clip counts twice, as it is and mirrored. A clip is assumed to be annotated throughout: where no row names an act,
there is none. The confidence of a score comes from clips that were left out of its training, a fifth at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...annotation import swap_sides
from ...annotation.labels import find_label
from ...base.errors import InputError, format_count
from ...base.optional_packages import import_optional
from ..folder.label_sources import Proposal
from .classifier import (
    Act,
    Classifier,
    average_score,
    collect_rule_confidences,
    convert_to_seconds,
    find_candidates,
    find_rule_proposal,
    project_signals,
    select_strike,
)
from .details import Details, fit_details
from .examples import Example, find_act
from .kernel import Kernel, compute_confidence, estimate_silence_weight, fit_confidence, fit_kernel
from .signals import Space, build_windows

# components of a window; folds of the clips; most windows of each class for one act
_COMPONENTS, _FOLDS, _MAX_WINDOWS_PER_ACT = 80, 5, 4000
# seconds around a key that show the act; around a key, and around a stretch's ends, that count as neither
_KEY_SECONDS, _GUARD_SECONDS, _EDGE_SECONDS = 0.07, 0.2, 0.1
_MARGIN = 0.1  # F1 by which a stretch's detection has to be better than the rules'
_SAMPLE_STEP = 5  # step between the samples of a stretch that are used for its confidence and labels
_MAX_WINDOWS = 60000  # windows from which the space is built, at most: half a gigabyte


@dataclass(frozen=True, eq=False, kw_only=True)
class _Side:
    """A clip or its mirrored twin.

    Attributes:
        example: the clip.
        rows: (N, K) its windows.
        seconds: (N,) of the samples.
        labels: its rows' labels in the order of `example.rows`.
        rule_proposals: what the rules propose, in seconds.
        is_mirrored: whether it is mirrored.
    """

    example: Example
    rows: np.ndarray
    seconds: np.ndarray
    labels: tuple[tuple[str, ...], ...]
    rule_proposals: tuple[Proposal, ...]
    is_mirrored: bool


def train_classifier(examples: Sequence[Example], progress=None, cancelled=None) -> Classifier:
    """Train a classifier of all acts with at least two moments or one second of stretches.

    The same examples give the same bits.

    Args:
        examples: annotated clips.
        progress: called with a fraction and a text.
        cancelled: called often; True stops the work.
    Returns:
        The classifier.
    Raises:
        InputError: if no act has enough examples, or scikit-learn cannot be imported.
        UserCancelledError: if `cancelled` returns True.
    """
    from threadpoolctl import threadpool_limits

    from ...base.errors import UserCancelledError

    import_optional("sklearn", "learning labels")
    acts_to_learn = _count_acts(examples)
    if not acts_to_learn:
        found = f"{format_count(len(examples), 'clip')} with too few key moments"
        raise InputError("examples", found, "at least two moments of an act", "annotate more clips, for example kicks")
    with threadpool_limits(limits=1):  # with more threads, sums of products have another order and other bits
        space = _build_space(examples)
        sides = [side for one in examples for side in _build_sides(one, space)]
        acts = []
        for number, (word, moment) in enumerate(acts_to_learn):
            if cancelled is not None and cancelled():
                raise UserCancelledError("learning: cancelled")
            if progress is not None:
                progress(number / len(acts_to_learn), f"Learning {find_label(word).title}")
            acts.append(_train_act(word, moment, sides))
    learned = tuple(act for act in acts if act is not None)
    if not learned:
        words = ", ".join(word for word, _ in acts_to_learn)
        found = f"only {words}: the rules detect them equally well, or their key moments are outside the clips"
        raise InputError("examples", found, "other acts too, such as kicks", "annotate more clips")
    return Classifier(space, learned, len(examples))


def _build_space(examples: Sequence[Example]) -> Space:
    """Build the space from the windows of all clips, evenly thinned where they are too many."""
    sides = [side for one in examples for side in (one.signals, one.signals.mirror_signals)]
    step = max(1, -(-sum(map(len, sides)) // _MAX_WINDOWS))
    return Space.from_windows(np.concatenate([build_windows(side)[::step] for side in sides]), _COMPONENTS)


def _count_acts(examples: Sequence[Example]) -> dict[tuple[str, bool], float]:
    """Count the acts with enough examples: (label, whether it has moments) -> number of moments or seconds of
    stretches.
    """
    found: dict[tuple[str, bool], float] = {}
    for one in examples:
        for row in one.rows:
            kind, moment = (find_act(row), row.key is not None), row.key is not None
            length = 1.0 if moment else (row.end - row.start) / one.signals.fps
            found[kind] = found.get(kind, 0.0) + length
    return {kind: shown for kind, shown in sorted(found.items()) if kind[0] and shown >= (2.0 if kind[1] else 1.0)}


def _build_sides(example: Example, space: Space) -> list[_Side]:
    """Build the clip and its mirrored twin."""
    words = tuple(row.words for row in example.rows)
    ruled, fps = convert_to_seconds(example.rule_proposals, example.signals.fps), example.list_sample_times()
    other = convert_to_seconds(example.rule_proposals, example.signals.fps, mirrored=True)
    return [
        _Side(example=example, rows=project_signals(example.signals, space), seconds=fps, labels=words,
              rule_proposals=ruled, is_mirrored=False),
        _Side(example=example, rows=project_signals(example.signals.mirror_signals, space), seconds=fps,
              labels=tuple(map(swap_sides, words)), rule_proposals=other, is_mirrored=True),
    ]


def _train_act(word: str, moment: bool, sides: list[_Side]) -> Act | None:
    """Train one act from all sides of all clips; None for stretches that the rules detect better on their own."""
    kernel = _fit_kernel(word, moment, sides)
    silence = _estimate_silence(word, moment, sides)
    score, rule, shown = _score_unseen(word, moment, sides, silence)
    ruled = any(word in one.annotation.words for side in sides for one in side.rule_proposals)
    weights = fit_confidence(score, rule, shown, ruled)
    if kernel is None or (ruled and not moment and not _is_better(weights, score, rule, shown)):
        return None
    details = _collect_details(word, moment, sides)
    strike, lead, before, after = -1, 0.0, 0.0, 0.0
    if moment:
        keys = [(side.example, row) for side in sides if not side.is_mirrored for row in side.example.select_rows(word,
                True)]
        strike, lead = select_strike([(one.signals, row.key / one.signals.fps) for one, row in keys])
        before = float(np.median([(row.key - row.start) / one.signals.fps for one, row in keys]))
        after = float(np.median([(row.end - row.key) / one.signals.fps for one, row in keys]))
    times = _count_acts([side.example for side in sides if not side.is_mirrored])[word, moment]
    return Act(word=word, moment=moment, kernel=kernel, weights=weights, silence=silence, example_amount=times,
               strike=strike, lead=lead, before=before, after=after, details=details)


def _mark_samples(side: _Side, word: str, moment: bool) -> np.ndarray:
    """Mark samples (N,): 1 where a side shows the act, 0 where it does not, -1 where that is unknown."""
    out, fps = np.zeros(len(side.seconds), int), side.example.signals.fps
    for row in side.example.rows:
        if moment and row.key is not None and word in row.words:
            distance = np.abs(side.seconds - row.key / fps)
            out[(distance <= _GUARD_SECONDS) & (out == 0)] = -1
            if find_act(row) == word:
                out[distance <= _KEY_SECONDS] = 1
        elif not moment and word in row.words:
            start, end = row.start / fps, row.end / fps
            out[(side.seconds >= start - _EDGE_SECONDS) & (side.seconds <= end + _EDGE_SECONDS) & (out == 0)] = -1
            if find_act(row) == word and row.key is None:
                out[(side.seconds >= start + _EDGE_SECONDS) & (side.seconds <= end - _EDGE_SECONDS)] = 1
    return out


def _fit_kernel(word: str, moment: bool, sides: list[_Side]) -> Kernel | None:
    """Fit the kernel of an act; None where these sides show none."""
    if not sides:
        return None
    labels = np.concatenate([_mark_samples(side, word, moment) for side in sides])
    rows = np.concatenate([side.rows for side in sides])
    selected = np.concatenate([_thin_samples(np.flatnonzero(labels == 1)), _thin_samples(np.flatnonzero(labels == 0))])
    if len(set(labels[selected])) < 2:
        return None
    return fit_kernel(rows[selected], labels[selected] == 1)


def _thin_samples(which: np.ndarray) -> np.ndarray:
    """Thin samples: every other one, or fewer so that _MOST remain."""
    step = max(2, -(-len(which) // _MAX_WINDOWS_PER_ACT)) if len(which) > 400 else 1
    return which[::step]


def _is_better(weights: np.ndarray, score: np.ndarray, rule: np.ndarray, shown: np.ndarray) -> bool:
    """Whether score and rules together detect an act better, by F1, than the rules alone."""
    combined, rules = compute_confidence(weights, score, rule) >= 0.5, rule > 0.0
    f1 = [2.0 * np.sum(said & shown) / max(np.sum(said) + np.sum(shown), 1) for said in (combined, rules)]
    return bool(f1[0] > f1[1] + _MARGIN)


def _estimate_silence(word: str, moment: bool, sides: list[_Side]) -> float:
    """Estimate the value of the rules' silence: the more examples they have found, the lower."""
    found = []
    for side in sides:
        for row in side.example.select_rows(word, moment):
            middle = row.key if row.key is not None else 0.5 * (row.start + row.end)
            found.append(find_rule_proposal(side.rule_proposals, word, moment,
                                            middle / side.example.signals.fps) is not None)
    return -estimate_silence_weight(sum(found) // 2, len(found) // 2)


def _score_unseen(word: str, moment: bool, sides: list[_Side], silent: float) -> tuple[np.ndarray, ...]:
    """Score all candidates with kernels that never saw their clips: scores, the rules' confidences and the truth (C,).
    """
    names = list(dict.fromkeys(side.example.name for side in sides))
    parts: list[tuple[np.ndarray, ...]] = [(np.zeros(0), np.zeros(0), np.zeros(0, bool))]
    for fold in range(min(_FOLDS, len(names))):
        held_out = set(names[fold::_FOLDS])
        kernel = _fit_kernel(word, moment, [side for side in sides if side.example.name not in held_out])
        for side in sides if kernel is not None else ():
            if side.example.name in held_out and not side.is_mirrored:
                parts.append(_score_clip(kernel, side, word, moment, silent))
    return tuple(np.concatenate(column) for column in zip(*parts))


def _score_clip(kernel: Kernel, side: _Side, word: str, moment: bool, silent: float) -> tuple[np.ndarray, ...]:
    """Score one clip's candidates: scores, the rules' confidences and the truth (C,)."""
    if moment:
        at, score = find_candidates(kernel, side.rows, side.seconds, side.rule_proposals, word)
        fps = side.example.signals.fps
        keys = np.array([row.key / fps for row in side.example.select_rows(word, True)])
        shown = np.zeros(len(at), bool)
        for key in keys:
            near = np.flatnonzero(np.abs(side.seconds[at] - key) <= 0.1)
            if len(near):
                shown[near[np.argmax(score[near])]] = True
    else:
        labels = _mark_samples(side, word, False)
        at = np.flatnonzero(labels >= 0)[::_SAMPLE_STEP]
        score, shown = average_score(kernel.compute_scores(side.rows))[at], labels[at] == 1
    return score, collect_rule_confidences(side.rule_proposals, word, moment, side.seconds[at], silent), shown


def _collect_details(word: str, moment: bool, sides: list[_Side]) -> Details:
    """Collect examples of the labels beside the act and fit them."""
    rows, words, ruled, clips = [], [], [], []
    names = {name: number for number, name in enumerate(dict.fromkeys(side.example.name for side in sides))}
    for side in sides:
        fps = side.example.signals.fps
        for row, labels in zip(side.example.rows, side.labels):
            if find_act(row) != word or (row.key is not None) != moment:
                continue
            if moment:
                middle = int(np.argmin(np.abs(side.seconds - row.key / fps)))
                at = np.clip([middle - 1, middle, middle + 1], 0, len(side.seconds) - 1)
            else:
                at = np.flatnonzero((side.seconds >= row.start / fps) & (side.seconds <= row.end / fps))[::_SAMPLE_STEP]
            rows.append(side.rows[at])
            words += [tuple(other for other in labels if other != word)] * len(at)
            ruled += [find_rule_proposal(side.rule_proposals, word, moment, float(time)) for time in side.seconds[at]]
            clips += [names[side.example.name]] * len(at)
    return fit_details(np.concatenate(rows), words, ruled, np.array(clips))
