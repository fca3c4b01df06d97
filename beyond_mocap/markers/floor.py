"""The floor under a recording: at height 0, as laboratories calibrate it, unless its foot markers say otherwise."""

from __future__ import annotations

import numpy as np

from .model.model import MarkerModel
from .pose.residuals import seen_markers
from .trial import MarkerTrial

OVER_SOLE = 0.03
"""Metres from the sole up to the lowest marker of a foot that stands: some 3 cm on bare feet and on shoes."""
AT_ZERO = (0.01, 0.09)
"""Metres over height 0 of the lowest foot marker with which the floor is at 0: below, a marker would be in it; above
are thicker soles than boots and skates have."""
_FEET = ("Foot", "ToeBase")


def floor_under(model: MarkerModel, trial: MarkerTrial) -> float:
    """Height in metres of the floor that the feet of a trial stand on, the lowest where it is uneven; 0 where that is
    as near to 0 as can be told, or no marker is on a foot."""
    names = model.skeleton.names
    feet = [i for i, joint in enumerate(model.joint) if names[joint].endswith(_FEET)]
    heights = seen_markers(model, trial)[:, feet, 2]
    heights = heights[np.isfinite(heights).any(axis=1)]
    if not heights.size:
        return 0.0
    lowest = float(np.percentile(np.nanmin(heights, axis=1), 2))
    return 0.0 if AT_ZERO[0] <= lowest <= AT_ZERO[1] else lowest - OVER_SOLE
