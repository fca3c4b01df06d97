"""Similarity of a window to those of an act, and its confidence: a support vector machine with a Gaussian kernel, whose
score is combined with the rules into a probability (Platt 1999, with a prior).

The machine is fitted by scikit-learn; its result is stored as plain arrays, so that proposing labels needs neither the
package nor its version. Far from all training data a Gaussian kernel vanishes and only the shift would remain; there
the score falls to -1 instead, so that unknown motions are not classified as an act.

A few clips show few kicks, and those of one player only; a logistic curve fitted to them alone would be overconfident.
So it starts from a curve that was valid for other players (`PRIOR`), and the examples change it as far as their number
allows: the maximum of the posterior under a normal prior. Each sample's target is Platt's, never quite 0 or 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_WIDTH, _PENALTY = 0.3, 3.0  # gamma times the windows' total variance; C
_BLOCK = 2048
_KNOWN_SIMILARITY = 0.25  # kernel value of the nearest support from which on a window counts as known
MAX_SCORE = 1.5
"""Scores are clipped at this value: beyond it they carry no information."""

PRIOR = {True: (5.0, 2.5, 1.3), False: (5.0, 0.0, 1.0)}
"""Weights of score, rule (its confidence; minus `estimate_silence_weight` where it proposes nothing) and 1; for acts
that the rules know, and for others."""

_PRIOR_SPREAD = np.array([0.7, 0.7, 0.3])


@dataclass(frozen=True, eq=False)
class Kernel:
    """A support vector machine with a Gaussian kernel.

    f(z) = sum_i weights_i k_i + shift with k_i = exp(-gamma |z - supports_i|^2); with m = min(1, max_i k_i / 0.25) the
    score is m f(z) + m - 1.

    Attributes:
        supports: (S, K) float32.
        weights: (S,).
        shift, gamma: see above.
    """

    supports: np.ndarray
    weights: np.ndarray
    shift: float
    gamma: float

    def compute_scores(self, rows: np.ndarray) -> np.ndarray:
        """Compute the scores (N,) of windows in their space (N, K), about 1 for the act and -1 for anything else."""
        supports = self.supports.astype(float)
        squares = np.sum(supports**2, axis=1)
        out = []
        for first in range(0, len(rows), _BLOCK):
            part = rows[first : first + _BLOCK]
            squared_distances = np.sum(part**2, axis=1)[:, None] + squares - 2.0 * part @ supports.T
            similarity = np.exp(-self.gamma * np.maximum(squared_distances, 0.0))
            known = np.minimum(similarity.max(axis=1) / _KNOWN_SIMILARITY, 1.0)
            out.append(known * (similarity @ self.weights + self.shift) + known - 1.0)
        return np.clip(np.concatenate(out), -MAX_SCORE, MAX_SCORE) if out else np.zeros(0)


def fit_kernel(rows: np.ndarray, is_act: np.ndarray) -> Kernel:
    """Fit a kernel to windows in their space (N, K) and whether each is the act (N,), both classes weighted equally."""
    from sklearn.svm import SVC

    gamma = _WIDTH / max(float(rows.var(axis=0).sum()), 1e-9)
    machine = SVC(C=_PENALTY, gamma=gamma, class_weight="balanced").fit(rows, is_act)
    return Kernel(machine.support_vectors_.astype(np.float32), machine.dual_coef_[0],
                  float(machine.intercept_[0]), gamma)


def compute_confidence(weights: np.ndarray, score: np.ndarray, rule: np.ndarray) -> np.ndarray:
    """Compute probabilities (N,) from scores (N,) and the rules' confidences (N,)."""
    logit = weights[0] * score + weights[1] * rule + weights[2]
    return 1.0 / (1.0 + np.exp(-np.clip(logit, -40.0, 40.0)))


def estimate_silence_weight(found: int, total: int) -> float:
    """Estimate how much it counts against an act that the rules propose none.

    Half of -log of the rules' share of misses, by Laplace's estimate: 1 where they have found all examples, near 0
    where they have found none.

    Args:
        found: examples that the rules have found.
        total: number of examples.
    Returns:
        The weight, at most 1.
    """
    return float(min(1.0, -0.5 * np.log((total - found + 1.0) / (total + 2.0))))


def fit_confidence(score: np.ndarray, rule: np.ndarray, is_act: np.ndarray, has_rules: bool) -> np.ndarray:
    """Fit the weights of the confidence to candidates that the scores had not seen.

    Args:
        score: (N,).
        rule: (N,) confidence of the rules.
        is_act: (N,) bool.
        has_rules: whether the rules know the act.
    Returns:
        (3,) weights of score, rule and 1.
    Source: Platt 1999.
    """
    from scipy.optimize import minimize

    start = np.array(PRIOR[has_rules])
    rows = np.stack([score, rule if has_rules else np.zeros_like(rule), np.ones_like(score)], axis=1)
    yes = int(np.sum(is_act))
    target = np.where(is_act, (yes + 1.0) / (yes + 2.0), 1.0 / (len(is_act) - yes + 2.0))

    def compute_loss(weights):
        logit = rows @ weights
        deviation = (weights - start) / _PRIOR_SPREAD
        slope = rows.T @ (1.0 / (1.0 + np.exp(-logit)) - target) + deviation / _PRIOR_SPREAD
        return float(np.sum(np.logaddexp(0.0, logit) - target * logit) + 0.5 * deviation @ deviation), slope

    return minimize(compute_loss, start, jac=True).x
