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


def sidak(level: float = 0.05, tests: int = 2) -> float:
    """The level of each of several tests that together err as rarely as one at `level` (his footnote 2: 0.0253 for
    two metrics, which he rounds to 0.025)."""
    return 1.0 - (1.0 - level) ** (1.0 / tests)


LEVEL = round(sidak(), 3)
"""Of each test."""


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

    @property
    def rejected(self) -> bool:
        """Whether "no better" is rejected at 0.025."""
        return bool(self.p < LEVEL)


def compared(new: np.ndarray, old: np.ndarray) -> Comparison:
    """The comparison of two ways' figures (N,), those of the same subject at the same place; pairs with NaN are left
    out."""
    off = np.asarray(new, float) - np.asarray(old, float)
    return judged(off[np.isfinite(off)])


def judged(differences: np.ndarray) -> Comparison:
    """The tests of differences (N,), new - old."""
    from scipy.stats import shapiro, ttest_1samp, wilcoxon

    off = np.asarray(differences, float)
    if not len(off):
        return Comparison(off, *[np.nan] * 3, "t", *[np.nan] * 4)
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


def detectable(subjects: int, spread: float = 1.0, level: float = LEVEL, power: float = 0.9) -> tuple[float, float]:
    """The smallest mean difference that a one-sided test of so many pairs sees with this power, in the unit of
    `spread`, their standard deviation: by the normal distribution, and by Student's, which the test uses.

    §4.5 has 1.62 cm for four subjects and 1 cm: the first. The second is what it is for a t-test.
    """
    from scipy.optimize import brentq
    from scipy.stats import nct, norm, t

    root = np.sqrt(subjects)
    normal = (norm.ppf(1.0 - level) + norm.ppf(power)) / root
    edge = t.ppf(1.0 - level, subjects - 1)
    student = brentq(lambda size: nct.sf(edge, subjects - 1, size * root) - power, 1e-6, 50.0)
    return float(normal * spread), float(student * spread)
