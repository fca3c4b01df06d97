"""The terms of the path search's costs, and what one unit of each misfit costs.

Costs are per slot, about 1 per metre per second of missed speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..plan import Plan

Term = tuple[str, np.ndarray]
"""Name and values of a cost term."""

_CONTINUITY = ("switch", "other", "young", "pose", "rate_change")

TERMS = {
    "speed": "speed differs from the track",
    "lift": "lifts a foot where the player stands",
    "turn": "turning differs from the track",
    "facing": "faces another direction",
    "drag": "feet on the ground are dragged",
    "lean": "leans otherwise than the track is accelerated",
    "known": "moves unlike the body that cameras have seen",
    "words": "requested labels that the clip lacks",
    "unasked": "an action not requested, or no labels at all",
    "strange": "not how people stand, walk or run in this library",
    "made": "synthetic clip, not recorded",
    "rate": "playback rate",
    "strike": "does not fit the ball at the strike",
    "pose": "change of pose at the cut",
    "feet": "planted feet that jump at the cut",
    "left": "abrupt motion before the cut",
    "cut": "the cut itself, and abrupt motion after it",
    "soon": "cut soon after another",
    "replay": "shown a moment ago",
    "rate_change": "change of playback rate",
    "avoided": "an avoided label",
    "style": "not a clip of the style",
    "manner": "moves unlike this player",
    "variety": "does not match this player's own lag",
    "reused": "shown by an earlier solution",
}
"""Name of a cost term -> its description in "Why This Clip?"."""


@dataclass(frozen=True)
class Weights:
    """Cost of one unit of each misfit.

    Attributes:
        speed: per m/s of missed speed.
        drag: per m/s, and per second of contact of both feet beyond that of a walk.
        turn: per radian and slot.
        lift: for a slot without both feet on the ground where the track rests.
        facing: per m/s of missed velocity in the body's frame beyond the missed speed.
        slide: per (m/s)^2 of missed velocity, by which a foot on the ground is dragged.
        lean: per unit of slope by which the body leans otherwise than its track is accelerated.
        known: per metre of joint distance from a body that cameras have seen, near its ends.
        words: for lacking all labels that the user asks for.
        automatic_words: for lacking all labels of automatic locomotion.
        unasked: for frames of an action that is not requested, or that carry no label.
        strange: per radius outside of the library's normal locomotion.
        synthetic: for a synthetic clip; it is used only where recordings miss the speed by more.
        synthetic_key: the same at key moments, where a recording is worth more.
        rate: per unit of time warp.
        stretch: per unit of time warp beyond `ACCEPTED_RATES`.
        strike: for a key moment's clip that does not fit its ball (`key_fit`).
        switch: for any cut.
        other: for a cut to another recording.
        young: for a cut just after another one, less in the last two of YOUNG_SLOTS.
        pose: per metre of joint distance.
        feet: per metre that a foot in contact before and after a cut would jump.
        wild: for cutting where the clips jerk by as much again as is usual.
        rate_change: per unit of change of the playback rate.
        replay: for a stretch shown less than 4 s ago.
        held: per frame beyond a clip's end.
    """

    speed: float = 1.0
    drag: float = 1.0
    turn: float = 3.0
    lift: float = 2.0
    facing: float = 1.0
    slide: float = 2.0
    lean: float = 3.0
    known: float = 12.0
    words: float = 3.0
    automatic_words: float = 1.0
    unasked: float = 2.0
    strange: float = 4.0
    synthetic: float = 0.2
    synthetic_key: float = 0.8
    rate: float = 0.24
    stretch: float = 4.0
    strike: float = 6.0
    switch: float = 0.8
    other: float = 0.6
    young: float = 1.4
    pose: float = 4.5
    feet: float = 1.5
    wild: float = 0.3
    rate_change: float = 0.16
    replay: float = 1.5
    held: float = 0.1


def balance_weights(alpha: float) -> Weights:
    """Balance labels against continuity by alpha.

    Labels are scaled by alpha / 0.2, continuity (cut, change of pose and of playback rate) by (1 - alpha) / 0.8, so
    that alpha = 0.2, the default and the thesis' value, changes nothing. Speed, turning and facing keep their weights,
    since they hold the body on its track; so do actions that are not requested, and replayed stretches.
    """
    words, continuity = alpha / Plan.alpha, (1.0 - alpha) / (1.0 - Plan.alpha)
    factors = {"words": words, "automatic_words": words, **dict.fromkeys(_CONTINUITY, continuity)}
    return Weights(**{name: getattr(Weights, name) * factor for name, factor in factors.items()})
