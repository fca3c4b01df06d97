"""Compare one method with another, subject by subject, by paired one-sided tests (Fredriksson §4.5).

Fredriksson divides standard deviations by n but t statistics by n - 1; both are kept separate here. Shapiro and Wilk's
test comes first; if it rejects normality, Wilcoxon's signed ranks replace Student's t. With four subjects the smallest
p from ranks is 1/16, so they cannot reject anything at 0.025; `least_p` reports this.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CULLED = 3.0
"""Standard deviations from the mean beyond which a throw is an outlier (Fredriksson §8.3)."""
NORMALITY = 0.05
"""Significance level of the normality test; Fredriksson does not name one."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Comparison:
    """The result of a comparison. NaN where there is too little data.

    Attributes:
        differences: (N,) new - old by subject; negative values favour the new method.
        mean: their mean.
        spread: their standard deviation divided by n, as Fredriksson prints it.
        normal: p of Shapiro and Wilk's test.
        test: the test that counts, "t" or "Wilcoxon".
        p: its one-sided p that the new method is no better.
        t_p, wilcoxon_p: p of both tests.
        least_p: the smallest p that `test` could have given.
    """

    differences: np.ndarray
    mean: float
    spread: float
    normal: float
    test: str
    p: float
    t_p: float
    wilcoxon_p: float
    least_p: float

def judged(differences: np.ndarray) -> Comparison:
    """Compare two methods by the differences of their figures.

    Args:
        differences: (N,) new - old, smaller is better.
    Returns:
        The comparison.
    """
    from scipy.stats import shapiro, ttest_1samp, wilcoxon

    off = np.asarray(differences, float)
    if not len(off):
        none = float("nan")
        return Comparison(differences=off, mean=none, spread=none, normal=none, test="t", p=none, t_p=none,
                          wilcoxon_p=none, least_p=none)
    varies = len(off) > 1 and np.ptp(off) > 1e-12
    normal = float(shapiro(off).pvalue) if len(off) > 2 and varies else np.nan
    t_p = float(ttest_1samp(off, 0.0, alternative="less").pvalue) if varies else np.nan
    ranks = float(wilcoxon(off, alternative="less").pvalue) if np.any(off != 0.0) else np.nan
    test = "Wilcoxon" if normal < NORMALITY else "t"
    return Comparison(differences=off, mean=float(off.mean()), spread=float(off.std()), normal=normal, test=test,
                      p=ranks if test == "Wilcoxon" else t_p, t_p=t_p, wilcoxon_p=ranks,
                      least_p=2.0 ** -len(off) if test == "Wilcoxon" else 0.0)


def kept(values: np.ndarray) -> np.ndarray:
    """Find the values within three standard deviations of the mean of the finite ones.

    Up to ten values can never contain an outlier by this rule.

    Args:
        values: (N,), NaN or infinite if unknown.
    Returns:
        (N,) bool, True for finite values that are no outliers.
    """
    values = np.asarray(values, float)
    known = np.isfinite(values)
    if not known.any():
        return known
    mean, spread = values[known].mean(), values[known].std()
    return known & (np.abs(np.where(known, values, mean) - mean) <= CULLED * spread + 1e-12)
