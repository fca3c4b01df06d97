"""How much a window looks like those of an act: a support vector machine with a Gaussian kernel.

It is fitted by scikit-learn; what it found is kept as plain arrays, so that whoever only proposes words needs neither
the package nor its version. Far from everything it has seen a Gaussian kernel says nothing and only the shift would be
left; there the score sinks to -1 instead, so that motions that nobody has shown it are not taken for an act.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_WIDTH, _PENALTY = 0.3, 3.0  # gamma times the windows' whole variance; C
_AT_ONCE = 2048
_KNOWN = 0.25  # kernel of the nearest support from which on a window is like what was seen
LIMIT = 1.5
"""Scores are cut off here: beyond it there is only more of the same."""


@dataclass(frozen=True, eq=False)
class Kernel:
    """f(z) = sum_i weights_i k_i + shift with k_i = exp(-gamma |z - supports_i|^2); with m = min(1, max_i k_i / 0.25)
    the score is m f(z) + m - 1. supports (S, K) float32; weights (S,)."""

    supports: np.ndarray
    weights: np.ndarray
    shift: float
    gamma: float

    def scores(self, rows: np.ndarray) -> np.ndarray:
        """(N,) for windows in their space (N, K), about 1 of the act and -1 of anything else."""
        supports = self.supports.astype(float)
        squares = np.sum(supports**2, axis=1)
        out = []
        for first in range(0, len(rows), _AT_ONCE):
            part = rows[first : first + _AT_ONCE]
            apart = np.sum(part**2, axis=1)[:, None] + squares - 2.0 * part @ supports.T
            alike = np.exp(-self.gamma * np.maximum(apart, 0.0))
            known = np.minimum(alike.max(axis=1) / _KNOWN, 1.0)
            out.append(known * (alike @ self.weights + self.shift) + known - 1.0)
        return np.clip(np.concatenate(out), -LIMIT, LIMIT) if out else np.zeros(0)


def fitted(rows: np.ndarray, is_act: np.ndarray) -> Kernel:
    """From windows in their space (N, K) and whether each is the act (N,), both kinds weighed alike."""
    from sklearn.svm import SVC

    gamma = _WIDTH / max(float(rows.var(axis=0).sum()), 1e-9)
    machine = SVC(C=_PENALTY, gamma=gamma, class_weight="balanced").fit(rows, is_act)
    return Kernel(machine.support_vectors_.astype(np.float32), machine.dual_coef_[0],
                  float(machine.intercept_[0]), gamma)
