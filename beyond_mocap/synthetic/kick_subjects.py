"""Made people who kick: each has a body, a fastest kick and a way of kicking of their own (see `throw_subjects`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .kicks import KickStyle
from .made_people import Person, adult, by_factors, person, scattered

_SCATTER = {"approach": 2.0, "stride": 0.04, "back": 0.04, "follow": 0.05, "lean": 1.5, "off_arm": 0.06}
"""Standard deviation of the chance from kick to kick."""
_WHIP = 0.05  # s around the contact in which the leg goes through the ball
_LEAST = 8.0  # m/s of the ball, the slowest kick that is swung at all


@dataclass(frozen=True, kw_only=True)
class KickManner:
    """How somebody kicks: approach, degrees that the way up is turned more than usual; factors on stride, back (how far
    leg and pelvis are swung back) and follow (how high the leg goes after the ball); lean, degrees that the trunk is
    inclined more to the standing leg; off_arm, a factor on how far the arms are held out."""

    approach: float = 0.0
    stride: float = 1.0
    back: float = 1.0
    follow: float = 1.0
    lean: float = 0.0
    off_arm: float = 1.0


_RANGES = {
    "approach": (-9.0, 8.0), "stride": (0.86, 1.08), "back": (0.86, 1.04), "follow": (0.75, 1.15), "lean": (-5.0, 5.0),
    "off_arm": (0.75, 1.08),
}  # fmt: skip
"""Between which people differ."""


def kicker(seed: int) -> Person:
    """Somebody who kicks; the same seed gives the same person. Seed 0 is the project's own adult."""
    if seed == 0:
        return adult(28.0, KickManner())
    return person(f"kicker{seed:02d}", KickManner, _RANGES, (22.0, 28.0), np.random.default_rng([seed, 1863]))


def kick_style(who: Person, base: KickStyle, speed: float, chance: np.random.Generator) -> KickStyle:
    """How this person kicks a ball of `speed` m/s in the style `base`; `chance` makes it differ from the one before."""
    effort = float(np.clip((speed - _LEAST) / (who.fastest - _LEAST), 0.0, 1.0))
    return styled(base, scattered(who.manner, _SCATTER, chance), effort)


def styled(base: KickStyle, manner: KickManner, effort: float = 1.0) -> KickStyle:
    """`base` kicked in somebody's manner with `effort` 0..1 of a hard kick's swing."""
    back, follow = manner.back * (0.78 + 0.22 * effort), manner.follow * (0.66 + 0.34 * effort)
    out, turn = manner.off_arm * (0.7 + 0.3 * effort), 0.75 + 0.25 * effort * manner.back
    approach = base.approach + manner.approach
    arms = [by_factors(rows, out, out, 1.0, 1.0) for rows in (base.left_arm, base.right_arm)]
    return replace(
        base,
        approach=approach,
        strides=tuple(manner.stride * (0.8 + 0.2 * effort) * stride for stride in base.strides),
        leg=_swung(base.leg, back, 0.72 + 0.28 * effort, follow),
        pelvis=tuple((t, side, tilt, _turned(t, about, turn, manner.approach)) for t, side, tilt, about in base.pelvis),
        spine=tuple((t, side - manner.lean * _near_contact(t), tilt, turn * about)
                    for t, side, tilt, about in base.spine),
        left_arm=arms[0],
        right_arm=arms[1],
    )


def _swung(rows: tuple, back: float, whip: float, follow: float) -> tuple:
    """Rows (time, thigh, knee) of the leg: so much of the swing back, of the whip through the ball, of the way up."""
    at = next(row for row in rows if row[0] == 0.0)
    out = []
    for time, thigh, knee in rows:
        if time < -_WHIP:
            out.append((time, back * thigh, back * knee))
        elif time > _WHIP:
            out.append((time, follow * thigh, knee))
        else:
            out.append((time, at[1] + whip * (thigh - at[1]), at[2] + whip * (knee - at[2])))
    return tuple(out)


def _turned(time: float, about: float, turn: float, approach: float) -> float:
    """The pelvis's turn: on the way up the approach's, from then on so much of the style's."""
    way_up = float(np.clip((-0.2 - time) / 0.2, 0.0, 1.0))
    return about * (way_up + (1.0 - way_up) * turn) - way_up * approach


def _near_contact(time: float) -> float:
    return float(np.exp(-0.5 * (time / 0.25) ** 2))
