"""Compare one method with another, subject by subject, by paired one-sided tests (Fredriksson §4.5).

Fredriksson divides standard deviations by n but t statistics by n - 1; both are kept separate here. Shapiro and Wilk's
test comes first; if it rejects normality, Wilcoxon's signed ranks replace Student's t. With four subjects the smallest
p from ranks is 1/16, so they cannot reject anything at 0.025; `least_p` reports this.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

OUTLIER_SIGMAS = 3.0
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

def compare_differences(differences: np.ndarray) -> Comparison:
    """Compare two methods by the differences of their figures.

    Args:
        differences: (N,) new - old, smaller is better.
    Returns:
        The comparison.
    """
    from scipy.stats import shapiro, ttest_1samp, wilcoxon

    values = np.asarray(differences, float)
    if not len(values):
        nan = float("nan")
        return Comparison(differences=values, mean=nan, spread=nan, normal=nan, test="t", p=nan, t_p=nan,
                          wilcoxon_p=nan, least_p=nan)
    varies = len(values) > 1 and np.ptp(values) > 1e-12
    normal = float(shapiro(values).pvalue) if len(values) > 2 and varies else np.nan
    t_p = float(ttest_1samp(values, 0.0, alternative="less").pvalue) if varies else np.nan
    ranks = float(wilcoxon(values, alternative="less").pvalue) if np.any(values != 0.0) else np.nan
    test = "Wilcoxon" if normal < NORMALITY else "t"
    return Comparison(differences=values, mean=float(values.mean()), spread=float(values.std()), normal=normal,
                      test=test, p=ranks if test == "Wilcoxon" else t_p, t_p=t_p, wilcoxon_p=ranks, least_p=2.0 **
                      -len(values) if test == "Wilcoxon" else 0.0)


def find_inliers(values: np.ndarray) -> np.ndarray:
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
    return known & (np.abs(np.where(known, values, mean) - mean) <= OUTLIER_SIGMAS * spread + 1e-12)
