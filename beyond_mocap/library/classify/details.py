"""The labels beside an act: its side, height, surface, pace and direction, and any other label that annotators used
with it.

Of labels that exclude each other one is chosen, or none: the rules' where they have one, unless a linear classifier on
the moment's window is clearly better on clips that it has not seen. A few examples show few of the ways of kicking, and
the rules know what those labels mean. A group of labels that no example uses is never proposed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...annotation.labels import GROUPS, list_labels
from ..folder.label_sources import Proposal

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
    rules_first: tuple[bool, ...]

    def choose_labels(self, rows: np.ndarray, rule: Proposal | None) -> tuple[str, ...]:
        """Choose the labels for one act.

        Args:
            rows: (N, K) its windows in their space.
            rule: what the rules propose; None for nothing.
        Returns:
            The labels.
        """
        mean = _append_constant(rows).mean(axis=0)
        labels = []
        for group, plane, rules_first in zip(self.choices, self.planes, self.rules_first):
            ruled = find_in_group(rule.annotation.words, _find_group(group)) if rule is not None and rules_first else ""
            labels.append(ruled or group[int(np.argmax(plane @ mean))])
        return tuple(word for word in labels if word)


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
    features = _append_constant(rows)
    choices, planes, by_rule = [], [], []
    for group in [*EXCLUSIVE, *((word,) for word in _list_other_labels(words))]:
        examples = np.array([find_in_group(one, group) for one in words])
        kinds = tuple(sorted(set(examples.tolist())))
        if kinds != ("",):
            from_rules = np.array([find_in_group(one.annotation.words, group) if one is not None else ""
                                   for one in ruled])
            choices.append(kinds)
            planes.append(_fit_plane(features, examples, kinds))
            by_rule.append(bool(np.any(from_rules != "")) and not _beats_rules(features, examples, from_rules, clip))
    return Details(tuple(choices), tuple(planes), tuple(by_rule))


def find_in_group(words: Iterable[str], group: Sequence[str]) -> str:
    """Find the first of `words` in a group, "" if there is none: in "kick right low left" the foot is the right one."""
    return next((word for word in words if word in group), "")


def _find_group(kinds: tuple[str, ...]) -> tuple[str, ...]:
    """Find all labels that exclude those of a group, also those that no example has."""
    return next((group for group in EXCLUSIVE if set(group) & set(kinds)), kinds)


def _list_other_labels(words: Sequence[tuple[str, ...]]) -> list[str]:
    """List the labels outside all groups."""
    known = {word for group in EXCLUSIVE for word in group}
    return sorted({word for one in words for word in one} - known)


def _append_constant(rows: np.ndarray) -> np.ndarray:
    """Scale windows and append 1: (N, K + 1)."""
    return np.append(rows * _SPREAD, np.ones((len(rows), 1)), axis=1)


def _fit_plane(features: np.ndarray, examples: np.ndarray, kinds: tuple[str, ...]) -> np.ndarray:
    """Fit the scores of each kind: (C, K + 1)."""
    from sklearn.linear_model import LogisticRegression

    if len(kinds) == 1:
        return np.zeros((1, features.shape[1]))
    line = LogisticRegression(C=_PENALTY, class_weight="balanced", max_iter=300).fit(features[:, :-1], examples)
    plane = np.concatenate([line.coef_, line.intercept_[:, None]], axis=1)
    return plane if len(kinds) > 2 else np.concatenate([-0.5 * plane, 0.5 * plane])


def _beats_rules(features: np.ndarray, examples: np.ndarray, from_rules: np.ndarray, clip: np.ndarray) -> bool:
    """Whether a plane labels examples of unseen clips better than the rules do."""
    is_correct = []
    for fold in range(_FOLDS):
        out = clip % _FOLDS == fold
        kinds = tuple(sorted(set(examples[~out].tolist())))
        if np.any(out) and kinds:
            plane = _fit_plane(features[~out], examples[~out], kinds)
            is_correct.append(np.array(kinds)[np.argmax(features[out] @ plane.T, axis=1)] == examples[out])
    ours = float(np.mean(np.concatenate(is_correct))) if is_correct else 0.0
    return ours > float(np.mean(from_rules == examples)) + _BETTER
