"""How sure one may be: scores and what the rules say, as a probability (Platt 1999, with a prior).

A few clips show few kicks, and those of one player only; a logistic curve fitted to them alone would be sure of
everything. So it starts from a curve that held for other players (`PRIOR`), and the examples move it as far as their
number allows: the maximum of the posterior under a normal prior. Each sample's target is Platt's, never quite 0 or 1.
"""

from __future__ import annotations

import numpy as np

PRIOR = {True: (5.0, 2.5, 1.3), False: (5.0, 0.0, 1.0)}
"""Weights of score, rule (its confidence; where it is silent minus `silence`) and 1; of acts that the rules know, and
of others."""

_SPREAD = np.array([0.7, 0.7, 0.3])


def sure(weights: np.ndarray, score: np.ndarray, rule: np.ndarray) -> np.ndarray:
    """(N,) probabilities from scores (N,) and the rules' confidences (N,)."""
    told = weights[0] * score + weights[1] * rule + weights[2]
    return 1.0 / (1.0 + np.exp(-np.clip(told, -40.0, 40.0)))


def silence(found: int, shown: int) -> float:
    """How much it says against an act that the rules see none: 1 where they have found all of the `shown` examples,
    next to nothing where they have found none. Half of -log of their share of misses, Laplace's estimate."""
    return float(min(1.0, -0.5 * np.log((shown - found + 1.0) / (shown + 2.0))))


def calibrated(score: np.ndarray, rule: np.ndarray, is_act: np.ndarray, ruled: bool) -> np.ndarray:
    """(3,) weights from candidates that the scores had not seen: score (N,), rule (N,), whether each is the act
    (N,)."""
    from scipy.optimize import minimize

    start = np.array(PRIOR[ruled])
    rows = np.stack([score, rule if ruled else np.zeros_like(rule), np.ones_like(score)], axis=1)
    yes = int(np.sum(is_act))
    target = np.where(is_act, (yes + 1.0) / (yes + 2.0), 1.0 / (len(is_act) - yes + 2.0))

    def loss(weights):
        told = rows @ weights
        off = (weights - start) / _SPREAD
        slope = rows.T @ (1.0 / (1.0 + np.exp(-told)) - target) + off / _SPREAD
        return float(np.sum(np.logaddexp(0.0, told) - target * told) + 0.5 * off @ off), slope

    return minimize(loss, start, jac=True).x
