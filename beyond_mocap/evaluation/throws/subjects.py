"""The figures of one way of making throws, subject by subject."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .compare import Comparison, compared, kept

EFFECTOR_NAMES = ("left arm", "right arm", "left leg", "right leg")
"""As his tables call the effectors, which are wrists and toes."""


@dataclass(frozen=True, eq=False)
class Subjects:
    """name: of the way. subjects (S,): on whom each model was trained. deviation (S, 4) m: eq. 4.1 by effector, over
    the others' motions. impact (S,) m: mean distance to the intended impact without the culled, NaN without a ball.
    culled, motions (S,): how many impacts were left out, and how many motions there were."""

    name: str
    subjects: tuple[str, ...]
    deviation: np.ndarray
    impact: np.ndarray
    culled: np.ndarray
    motions: np.ndarray

    @property
    def figures(self) -> np.ndarray:
        """(S, 5) m: deviations, impact."""
        return np.column_stack([self.deviation, self.impact])


def gathered(name: str, rows: Sequence[tuple[str, np.ndarray, np.ndarray]]) -> Subjects:
    """The figures of all motions: rows (trained on, deviations (N, 4) m, distances of impacts (N,) m)."""
    inside = [kept(impacts) for _, _, impacts in rows]
    return Subjects(
        name, tuple(row[0] for row in rows), np.array([np.mean(row[1], axis=0) for row in rows]),
        np.array([float(np.mean(np.asarray(row[2])[mask])) if mask.any() else np.nan
                  for row, mask in zip(rows, inside, strict=True)]),
        np.array([len(mask) - int(mask.sum()) for mask in inside]), np.array([len(mask) for mask in inside]),
    )  # fmt: skip


def comparisons(new: Subjects, old: Subjects) -> tuple[Comparison, ...]:
    """Five: left arm, right arm, left leg, right leg, impact; subjects that both have, by name."""
    both = [name for name in new.subjects if name in old.subjects]
    pick = [[list(of.subjects).index(name) for name in both] for of in (new, old)]
    return tuple(compared(new.figures[pick[0], k], old.figures[pick[1], k]) for k in range(5))
