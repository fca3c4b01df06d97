"""Why synthetic locomotion is shown, by the speed at which it is shown: no recording has that speed, or one has it and
is left out of locomotion, or does not fit as well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.time_series import drop_short_runs
from ...library.coverage import WARP, Coverage, format_speeds, select_locomotion
from ...library.library import Library

OUTSIDE_SECONDS = 0.5  # shortest time outside of all gaps that has a line of its own: clips play on for a moment
_EDGE = 1.03  # ratio by which a speed may lie beside a gap, whose ends are found on a grid of such steps


def explain_shown_speeds(library: Library, there: np.ndarray, speed: np.ndarray, fps: float,
                         instead: str) -> list[tuple[np.ndarray, str]]:
    """Explain why a kind of synthetic locomotion is shown.

    Args:
        library: the recordings.
        there: (T,) bool, frames that show it.
        speed: (T,) m/s of the body.
        fps: of the frames.
        instead: what is shown, such as "synthetic running is shown".
    Returns:
        At most two reasons, each with its frames (T,) bool: what the library lacks at the shown speeds, and why
        recordings of the other speeds are not shown.
    """
    gaps = [_select_gap(speed, gap) for gap in library.coverage.speed_gaps]
    in_gap = np.any(gaps, axis=0) if gaps else np.zeros_like(there)
    outside = drop_short_runs(there & ~in_gap, OUTSIDE_SECONDS * fps)
    inside = there & ~outside
    if not np.any(inside & in_gap):
        inside, outside = np.zeros_like(there), there
    reasons = []
    if inside.any():
        shown = [speed[gap & inside] for gap in gaps if np.any(gap & inside)]
        reasons.append((inside, describe_lacking_speeds(library.coverage, shown, instead)))
    if outside.any():
        reasons.append((outside, f"{_explain_other_speeds(library, speed[outside])}; {instead}"))
    return reasons


def describe_lacking_speeds(coverage: Coverage, shown: list[np.ndarray], instead: str) -> str:
    """Describe in a line that recordings lack the speeds in m/s of which each array of `shown` is one range."""
    ranges = tuple((float(one.min()), float(one.max())) for one in shown)
    return replace(coverage, speed_gaps=ranges).describe_lack("speeds", instead)


def _select_gap(speed: np.ndarray, gap: tuple[float, float]) -> np.ndarray:
    """Select the speeds (T,) m/s that lie in a gap, from and to m/s."""
    return (speed >= gap[0] / _EDGE) & (speed <= gap[1] * _EDGE)


def _explain_other_speeds(library: Library, speed: np.ndarray) -> str:
    """Explain why no recording is shown at speeds (T,) m/s that recordings have: where half of their frames or more do
    not belong to locomotion, that is why.
    """
    low, high = float(speed.min()), float(speed.max())
    recorded = library.frames.speed
    is_near = (recorded > low / WARP[1]) & (recorded < high / WARP[0])
    is_strange = library.strangeness[is_near & select_locomotion(library.frames, library.clips)] > 1.0
    shown = format_speeds([(low, high)])
    if is_strange.any() and np.mean(is_strange) >= 0.5:
        return f"the recordings at {shown} are left out of locomotion, as the library's lines say"
    return f"no recording fits as well at {shown}"
