"""One way of making throws against another, subject by subject, by paired one-sided tests (Fredriksson §4.5).

His standard deviations are divided by n, his t by n - 1: both are kept apart here. Shapiro and Wilk's test comes first;
where it rejects normality, Wilcoxon's signed ranks stand in for Student's t. With four subjects the smallest p that
ranks can give is 1/16: they cannot reject anything at 0.025, which `least_p` tells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CULLED = 3.0
"""Standard deviations from the mean beyond which a throw is left out (Fredriksson §8.3)."""
NORMALITY = 0.05
"""Level of the test for normality; he names none."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """differences (N,): new - old by subject; negative ones are for the new way. mean; spread: standard deviation
    divided by n, as he prints it. normal: p of Shapiro and Wilk, NaN where there are too few or all alike. test:
    "t" or "Wilcoxon", whichever counts. p: its one-sided p that the new way is no better; t_p, wilcoxon_p: both, NaN
    where they cannot be had. least_p: the smallest that `test` could have given."""

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
    """The tests of differences (N,), new - old."""
    from scipy.stats import shapiro, ttest_1samp, wilcoxon

    off = np.asarray(differences, float)
    if not len(off):
        none = float("nan")
        return Comparison(off, none, none, none, "t", none, none, none, none)
    varies = len(off) > 1 and np.ptp(off) > 1e-12
    normal = float(shapiro(off).pvalue) if len(off) > 2 and varies else np.nan
    t_p = float(ttest_1samp(off, 0.0, alternative="less").pvalue) if varies else np.nan
    ranks = float(wilcoxon(off, alternative="less").pvalue) if np.any(off != 0.0) else np.nan
    test = "Wilcoxon" if normal < NORMALITY else "t"
    return Comparison(off, float(off.mean()), float(off.std()), normal, test, ranks if test == "Wilcoxon" else t_p, t_p,
                      ranks, 2.0 ** -len(off) if test == "Wilcoxon" else 0.0)


def kept(values: np.ndarray) -> np.ndarray:
    """(N,) bool: finite and within three standard deviations of the mean of the finite ones. Fewer than eleven can
    have none beyond, whatever they are."""
    values = np.asarray(values, float)
    known = np.isfinite(values)
    if not known.any():
        return known
    mean, spread = values[known].mean(), values[known].std()
    return known & (np.abs(np.where(known, values, mean) - mean) <= CULLED * spread + 1e-12)
