"""Classifiers learn which windows are synthesized, and answer for windows that they have not seen.

For each answer all windows of the same recording are left out on both sides, because a take shows recordings that could
have been learned, and all windows of the same take.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ...base.errors import InputError, format_count
from .windows import Sides, Windows, list_subsets

FEWEST = 40  # windows of each side with which a figure says anything
FOLDS = 4  # parts into which recordings, and takes, are divided for the cross-validation


def _build_logistic_regression():
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), LogisticRegression(C=0.1, max_iter=2000))


def _build_gradient_boosting():
    from sklearn.ensemble import GradientBoostingClassifier

    return GradientBoostingClassifier(max_features="sqrt", random_state=0)


CLASSIFIERS = {"logistic_regression": _build_logistic_regression, "gradient_boosting": _build_gradient_boosting}
"""Name -> function that builds an untrained one."""


def cross_validate(synthesized: Windows, recorded: Windows, with_losses: bool = True) -> tuple[dict, dict]:
    """Train both classifiers on parts of the windows, and measure how well they distinguish the others.

    Areas are measured within each fold, so that classifiers of several folds need not agree on a scale, and averaged
    with the number of pairs as weights.

    Args:
        synthesized, recorded: windows with F features.
        with_losses: also shuffle each feature among the windows of a fold.
    Returns:
        Area under the curve by subset and classifier, NaN for a subset with fewer than FEWEST windows of a side; and by
        the same keys the areas (F,) that are lost when each feature is shuffled.
    Raises:
        InputError: see `list_folds`.
    """
    subsets = list_subsets(synthesized, recorded)
    found: dict[tuple[str, str], list] = {key: [] for key in product(subsets, CLASSIFIERS)}
    for number, (train, test) in enumerate(list_folds(synthesized, recorded)):
        learned = [windows.select(flags) for windows, flags in zip((synthesized, recorded), train)]
        asked = [windows.select(flags) for windows, flags in zip((synthesized, recorded), test)]
        for kind, build_classifier in CLASSIFIERS.items():
            model = build_classifier().fit(*_build_examples(*learned))
            generator = np.random.default_rng(number) if with_losses else None
            scores = np.split(_score_windows(model, _build_examples(*asked)[0], generator), [len(asked[0])])
            for name, sides in subsets.items():
                parts = [own[flags[rows]] for own, flags, rows in zip(scores, sides, test)]
                if all(len(part) for part in parts):
                    found[name, kind].append((len(parts[0]) * len(parts[1]), measure_areas(*parts)))
    areas: dict[str, dict[str, float]] = {name: {} for name in subsets}
    losses: dict[str, dict[str, np.ndarray]] = {name: {} for name in subsets}
    for (name, kind), rows in found.items():
        is_enough = rows and min(flags.sum() for flags in subsets[name]) >= FEWEST
        mean = np.average([area for _, area in rows], axis=0, weights=[weight for weight, _ in rows]) if is_enough \
            else np.full(1 + synthesized.values.shape[1], np.nan)
        areas[name][kind], losses[name][kind] = float(mean[0]), mean[0] - mean[1:]
    return areas, losses


def list_folds(synthesized: Windows, recorded: Windows) -> list[tuple[Sides, Sides]]:
    """List the folds: the windows of both sides from which classifiers learn, and those that they are asked about.

    Neither a recording, on either side, nor a take is among both. A single take is divided into stretches.

    Raises:
        InputError: where no recording can be left out on both sides.
    """
    recordings = assign_folds(np.concatenate([synthesized.recording, recorded.recording]))
    shown, own = recordings[: len(synthesized)], recordings[len(synthesized) :]
    takes = assign_folds(synthesized.source)
    if not takes.any():
        takes = np.arange(len(takes)) * FOLDS // len(takes)
    folds = []
    for part, take in product(range(recordings.max() + 1), range(takes.max() + 1)):
        train = (shown != part) & (takes != take), own != part
        test = (shown == part) & (takes == take), own == part
        if all(flags.any() for flags in (*train, *test)):
            folds.append((train, test))
    if not folds:
        found = f"show {format_count(len(set(synthesized.recording)), 'clip')}, such as {synthesized.recording[0]}"
        raise InputError("takes", found, "several clips, of which each can be left out in turn",
                         "add takes that show others")
    return folds


def assign_folds(groups: np.ndarray) -> np.ndarray:
    """Assign a fold (W,) to each window by its group (W,); all 0 where there is one group."""
    from sklearn.model_selection import GroupKFold

    folds, count = np.zeros(len(groups), int), min(FOLDS, len(np.unique(groups)))
    if count > 1:
        for number, (_, rows) in enumerate(GroupKFold(count).split(groups, groups=groups)):
            folds[rows] = number
    return folds


def _build_examples(synthesized: Windows, recorded: Windows) -> tuple[np.ndarray, np.ndarray]:
    """Build features (N, F), and whether each row is synthesized (N,)."""
    is_synthesized = np.repeat([True, False], [len(synthesized), len(recorded)])
    return np.concatenate([synthesized.values, recorded.values]), is_synthesized


def _score_windows(model, values: np.ndarray, generator: np.random.Generator | None) -> np.ndarray:
    """Score windows (W, F): (W, 1 + F), as they are and with each feature shuffled; (W, 1) without a generator."""
    copies = [values]
    for column in range(values.shape[1]) if generator is not None else ():
        shuffled = values.copy()
        shuffled[:, column] = generator.permutation(values[:, column])
        copies.append(shuffled)
    return model.decision_function(np.concatenate(copies)).reshape(len(copies), len(values)).T


def measure_areas(synthesized: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """Measure the area under the receiver operating characteristic of each column.

    It is the share of pairs in which the synthesized one is greater; ties count one half.

    Args:
        synthesized, recorded: (A, K), (B, K).
    Returns:
        (K,).
    """
    from scipy.stats import rankdata

    count = len(synthesized)
    ranks = rankdata(np.concatenate([synthesized, recorded]), axis=0)[:count].sum(axis=0)
    return (ranks / count - 0.5 * (count + 1)) / len(recorded)
