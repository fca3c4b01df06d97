"""Speeds estimated against speeds measured, throw by throw: the paired test of Fredriksson §8.2.2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LEAST = 6
"""Pairs below which Wilcoxon's test cannot reject anything at 0.05 (two-sided: 2 / 2^n)."""


@dataclass(frozen=True, kw_only=True)
class Paired:
    """count: of pairs. mean, sd: m/s of estimated - measured. share: of the measured, mean of the absolute differences.
    within: share of pairs that differ by at most 10 %. wilcoxon: two-sided p that the differences are about zero, and
    normal: p of Shapiro and Wilk that they are normal; NaN where there are too few.
    """

    count: int
    mean: float
    sd: float
    share: float
    within: float
    wilcoxon: float
    normal: float


def paired(estimated: np.ndarray, measured: np.ndarray) -> Paired:
    """The comparison of speeds (N,) m/s that belong together; pairs with NaN are left out."""
    from scipy.stats import shapiro, wilcoxon

    estimated, measured = np.asarray(estimated, float), np.asarray(measured, float)
    known = np.isfinite(estimated) & np.isfinite(measured)
    off, base = (estimated - measured)[known], measured[known]
    if not len(off):
        none = float("nan")
        return Paired(count=0, mean=none, sd=none, share=none, within=none, wilcoxon=none, normal=none)
    varies = len(off) > 1 and np.ptp(off) > 1e-12
    share = np.abs(off) / base
    return Paired(count=len(off), mean=float(off.mean()), sd=float(off.std(ddof=1)) if len(off) > 1 else np.nan,
                  share=float(share.mean()), within=float(np.mean(share <= 0.1)),
                  wilcoxon=float(wilcoxon(off).pvalue) if len(off) >= LEAST and np.any(off != 0.0) else np.nan,
                  normal=float(shapiro(off).pvalue) if len(off) >= 3 and varies else np.nan)  # fmt: skip
