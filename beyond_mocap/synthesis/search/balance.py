"""What alpha means to the path search: Faustino eq. 13 weighs words by alpha and continuity by 1 - alpha."""

from __future__ import annotations

from dataclasses import replace

from ..plan import Plan
from .path_costs import Weights

_CONTINUITY = ("switch", "pose", "rate_change")


def balanced(alpha: float, weights: Weights = Weights()) -> Weights:
    """`weights` with words times alpha / 0.2 and continuity (what a cut and its change of pose and rate cost) times
    (1 - alpha) / 0.8, so that alpha = 0.2, the paper's and the default, leaves them as they are.

    Speed, turn and facing keep their weights: they hold the body on its track, which is nothing to be traded. So do
    actions that nobody asked for, and replayed stretches.
    """
    words, continuity = alpha / Plan.alpha, (1.0 - alpha) / (1.0 - Plan.alpha)
    return replace(
        weights, words=weights.words * words, **{name: getattr(weights, name) * continuity for name in _CONTINUITY}
    )
