"""Where throws land: aligned to their direction, from the thrower's hips, without the few that went elsewhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.vectors import unit_vector, unit_vectors
from .results import TrialResult

CULLED = 3.0
"""Standard deviations from the mean, beyond which a throw is left out (Fredriksson §8.2)."""


def dominant_sides(results: Sequence[TrialResult]) -> dict[str, str]:
    """Subject -> the hand that threw more often; ties go to the right."""
    sides: dict[str, list[str]] = {}
    for result in results:
        if result.throw is not None:
            sides.setdefault(result.subject, []).append(result.throw.side)
    return {subject: "left" if thrown.count("left") > thrown.count("right") else "right"
            for subject, thrown in sides.items()}


def aligned_impacts(results: Sequence[TrialResult]) -> np.ndarray:
    """(N, 2) m of the N results: where each throw meets the ground, NaN where it does not.

    Axes as in fig. 8.2: origin at the hips in the trial's first frame, y along the direction of a subject's throws (the
    mean of their level directions, for nobody knows the target), x to the right of it.
    """
    out = np.full((len(results), 2), np.nan)
    for subject in {result.subject for result in results}:
        rows = [i for i, result in enumerate(results)
                if result.subject == subject and result.throw is not None and result.throw.impact is not None]
        if not rows:
            continue
        ways = np.array([results[i].throw.velocity[:2] for i in rows])
        mean = np.sum(unit_vectors(ways), axis=0)
        along = unit_vector(mean)
        across = np.array([along[1], -along[0]])
        for i in rows:
            way = results[i].throw.impact - results[i].throw.hips
            out[i] = way @ across, way @ along
    return out


def kept(points: np.ndarray) -> np.ndarray:
    """(N,) bool: the points (N, 2) within three standard deviations of their mean on both axes; NaN are not kept."""
    known = np.isfinite(points).all(axis=-1)
    if np.count_nonzero(known) < 3:
        return known
    mean, spread = points[known].mean(axis=0), points[known].std(axis=0)
    return known & (np.abs(points - mean) <= CULLED * np.maximum(spread, 1e-9) + 1e-9).all(axis=-1)
