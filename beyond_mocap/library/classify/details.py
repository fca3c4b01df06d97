"""The labels beside an act: its side, height, surface, pace and direction, and any other label that annotators used
with
it.

Of labels that exclude each other one is chosen, or none: the rules' where they have one, unless a linear classifier on
the moment's window is clearly better on clips that it has not seen. A few examples show few of the ways of kicking, and
the rules know what those labels mean. A group of labels that no example uses is never proposed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...annotation.labels import GROUPS, list_labels
from ..word_sources import Proposal

EXCLUSIVE = tuple(list_labels(group=group) for group in GROUPS)
"""Groups of labels of which an act has one at most; any other label is present or not."""

_SPREAD, _PENALTY = 9.0, 0.05  # scale of a window's components; C of the logistic regression
_FOLDS, _BETTER = 5, 0.1  # folds of the clips; share of the examples by which the classifier has to beat the rules


@dataclass(frozen=True, eq=False)
class Details:
    """The learned labels beside an act.

    Attributes:
        choices: for each group its labels, "" for none of them.
        planes: for each group (C, K + 1), scores of its C choices from a window's K components and 1.
        rules_first: for each group, whether the rules have priority.
    """

    choices: tuple[tuple[str, ...], ...]
    planes: tuple[np.ndarray, ...]
    by_rule: tuple[bool, ...]

    def said(self, rows: np.ndarray, rule: Proposal | None) -> tuple[str, ...]:
        """Choose the labels for one act.

        Args:
            rows: (N, K) its windows in their space.
            rule: what the rules propose; None for nothing.
        Returns:
            The labels.
        """
        mean = _told(rows).mean(axis=0)
        found = []
        for group, plane, asked in zip(self.choices, self.planes, self.by_rule):
            ruled = value_of(rule.annotation.words, _whole(group)) if rule is not None and asked else ""
            found.append(ruled or group[int(np.argmax(plane @ mean))])
        return tuple(word for word in found if word)


def fit_details(
    rows: np.ndarray, words: Sequence[tuple[str, ...]], ruled: Sequence[Proposal | None], clip: np.ndarray
) -> Details:
    """Fit the labels beside an act.

    Args:
        rows: (N, K) windows in their space.
        words: for each window the labels beside the act.
        ruled: for each window what the rules propose.
        clip: (N,) number of each window's clip.
    Returns:
        The details.
    """
    told = _told(rows)
    choices, planes, by_rule = [], [], []
    for group in [*EXCLUSIVE, *((word,) for word in _others(words))]:
        named = np.array([value_of(one, group) for one in words])
        kinds = tuple(sorted(set(named.tolist())))
        if kinds != ("",):
            heard = np.array([value_of(one.annotation.words, group) if one is not None else "" for one in ruled])
            choices.append(kinds)
            planes.append(_plane(told, named, kinds))
            by_rule.append(bool(np.any(heard != "")) and not _beaten(told, named, heard, clip))
    return Details(tuple(choices), tuple(planes), tuple(by_rule))


def value_of(words: Iterable[str], group: Sequence[str]) -> str:
    """Find the first of `words` in a group, "" if there is none: in "kick right low left" the foot is the right one."""
    return next((word for word in words if word in group), "")


def _whole(kinds: tuple[str, ...]) -> tuple[str, ...]:
    """Find all labels that exclude those of a group, also those that no example has."""
    return next((group for group in EXCLUSIVE if set(group) & set(kinds)), kinds)


def _others(words: Sequence[tuple[str, ...]]) -> list[str]:
    """List the labels outside all groups."""
    known = {word for group in EXCLUSIVE for word in group}
    return sorted({word for one in words for word in one} - known)


def _told(rows: np.ndarray) -> np.ndarray:
    """Scale windows and append 1: (N, K + 1)."""
    return np.append(rows * _SPREAD, np.ones((len(rows), 1)), axis=1)


def _plane(told: np.ndarray, named: np.ndarray, kinds: tuple[str, ...]) -> np.ndarray:
    """Fit the scores of each kind: (C, K + 1)."""
    from sklearn.linear_model import LogisticRegression

    if len(kinds) == 1:
        return np.zeros((1, told.shape[1]))
    line = LogisticRegression(C=_PENALTY, class_weight="balanced", max_iter=300).fit(told[:, :-1], named)
    plane = np.concatenate([line.coef_, line.intercept_[:, None]], axis=1)
    return plane if len(kinds) > 2 else np.concatenate([-0.5 * plane, 0.5 * plane])


def _beaten(told: np.ndarray, named: np.ndarray, heard: np.ndarray, clip: np.ndarray) -> bool:
    """Whether a plane labels examples of unseen clips better than the rules do."""
    right = []
    for fold in range(_FOLDS):
        out = clip % _FOLDS == fold
        kinds = tuple(sorted(set(named[~out].tolist())))
        if np.any(out) and kinds:
            plane = _plane(told[~out], named[~out], kinds)
            right.append(np.array(kinds)[np.argmax(told[out] @ plane.T, axis=1)] == named[out])
    ours = float(np.mean(np.concatenate(right))) if right else 0.0
    return ours > float(np.mean(heard == named)) + _BETTER
