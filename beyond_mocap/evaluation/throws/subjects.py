"""The figures of one way of making throws, subject by subject."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .compare import Comparison, compared, kept

LOST = 0.5
"""m: a motion with a hand or foot farther off than that, on average, has lost its body; no mean says anything of it."""
EFFECTOR_NAMES = ("left arm", "right arm", "left leg", "right leg")
"""As his tables call the effectors, which are wrists and toes."""


@dataclass(frozen=True, eq=False)
class Subjects:
    """name: of the way. subjects (S,): on whom each model was trained. deviation (S, 4) m: eq. 4.1 by effector, over
    the others' motions that were not lost. impact (S,) m: mean distance to the intended impact without the culled, NaN
    without a ball. culled, lost, motions (S,): how many impacts were left out, how many motions lost their body, and
    how many there were."""

    name: str
    subjects: tuple[str, ...]
    deviation: np.ndarray
    impact: np.ndarray
    culled: np.ndarray
    lost: np.ndarray
    motions: np.ndarray

    @property
    def figures(self) -> np.ndarray:
        """(S, 5) m: deviations, impact."""
        return np.column_stack([self.deviation, self.impact])


def gathered(name: str, rows: Sequence[tuple[str, np.ndarray, np.ndarray]]) -> Subjects:
    """The figures of all motions: rows (trained on, deviations (N, 4) m, distances of impacts (N,) m)."""
    subjects, deviation, impact, culled, lost, motions = [], [], [], [], [], []
    for subject, deviations, impacts in rows:
        whole = ~lost_ones(deviations)
        impacts = np.asarray(impacts, float)[whole]
        inside = kept(impacts)
        subjects.append(subject)
        deviation.append(np.asarray(deviations)[whole].mean(axis=0) if whole.any() else np.full(4, np.nan))
        impact.append(float(impacts[inside].mean()) if inside.any() else np.nan)
        culled.append(len(inside) - int(inside.sum()))
        lost.append(len(whole) - int(whole.sum()))
        motions.append(len(whole))
    return Subjects(name, tuple(subjects), *(np.array(each) for each in (deviation, impact, culled, lost, motions)))


def lost_ones(deviations: np.ndarray) -> np.ndarray:
    """(N,) bool: which motions of deviations (N, 4) m lost their body."""
    deviations = np.asarray(deviations, float).reshape(-1, 4)
    return ~np.all(deviations < LOST, axis=-1)


def comparisons(new: Subjects, old: Subjects) -> tuple[Comparison, ...]:
    """Five: left arm, right arm, left leg, right leg, impact; subjects that both have, by name."""
    both = [name for name in new.subjects if name in old.subjects]
    pick = [[list(of.subjects).index(name) for name in both] for of in (new, old)]
    return tuple(compared(new.figures[pick[0], k], old.figures[pick[1], k]) for k in range(5))
