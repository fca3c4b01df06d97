"""Made people who throw: each has a body, a reach of speeds and a way of throwing of their own.

A subject throws alike from one throw to the next, but not the same: harder throws are wound up further (longer stride,
more turn of pelvis and chest, arm turned out further), and a little chance is in all of it. So what a network learns on
one subject, and what it is asked for another, are planted truths.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from .made_people import Person, adult, by_factors, person, scattered
from .throws import STYLES, Throw, ThrowStyle, throw

_SCATTER = {"slot": 2.0, "stride": 0.04, "lift": 0.08, "wind_up": 0.04, "lean": 0.06, "off_arm": 0.06, "follow": 0.05}
"""Standard deviation of the chance from throw to throw."""
_LEAST = 9.0  # m/s, the slowest throw that is wound up at all


@dataclass(frozen=True, kw_only=True)
class Manner:
    """How somebody throws: slot, degrees that the trunk leans away from the arm at release, more than usual; factors on
    stride, lift (of the leading leg), wind_up (seconds before the foot is down), lean (forward, after release), off_arm
    (how far the other arm is held out) and follow (seconds after release)."""

    slot: float = 0.0
    stride: float = 1.0
    lift: float = 1.0
    wind_up: float = 1.0
    lean: float = 1.0
    off_arm: float = 1.0
    follow: float = 1.0


_RANGES = {
    "slot": (-7.0, 7.0), "stride": (0.85, 1.10), "lift": (0.45, 1.15), "wind_up": (0.80, 1.15), "lean": (0.75, 1.15),
    "off_arm": (0.80, 1.10), "follow": (0.90, 1.15),
}  # fmt: skip
"""Between which people differ."""


def subject(seed: int) -> Person:
    """Somebody who throws; the same seed gives the same person. Seed 0 is the project's own adult."""
    if seed == 0:
        return adult(34.0, Manner())
    return person(f"subject{seed:02d}", Manner, _RANGES, (24.0, 34.0), np.random.default_rng([seed, 1907]))


def subject_throws(
    thrower: Person, target: tuple[float, float, float], speed: float, chance: np.random.Generator, fps: float = 120.0
) -> Throw:
    """A throw of this subject at `target` (3,) m with `speed` m/s; `chance` makes it differ from the one before.

    InputError as for `throws.throw`.
    """
    manner = scattered(thrower.manner, _SCATTER, chance)
    effort = float(np.clip((speed - _LEAST) / (thrower.fastest - _LEAST), 0.0, 1.0))
    style = styled(STYLES["overarm"], manner, effort)
    return throw(target, speed, thrower.side, style=style, skeleton=thrower.skeleton, fps=fps)


def styled(base: ThrowStyle, manner: Manner, effort: float = 1.0) -> ThrowStyle:
    """`base` thrown in somebody's manner with `effort` 0..1 of a hard throw's winding up."""
    turn, out = 0.62 + 0.38 * effort, 0.78 + 0.22 * effort
    way = manner.stride * (0.62 + 0.38 * effort)
    raised = manner.lift * (0.25 + 0.75 * effort)
    lean = manner.lean * (0.55 + 0.45 * effort)
    spine = [
        (t, side - manner.slot * _near_release(t), lean * tilt, turn * about) for t, side, tilt, about in base.spine
    ]
    style = ThrowStyle(
        pelvis=by_factors(base.pelvis, 1.0, lean, turn),
        spine=tuple(spine),
        right_arm=tuple((t, a, b, c if c > -60.0 else -60.0 + out * (c + 60.0), e) for t, a, b, c, e in base.right_arm),
        left_arm=by_factors(base.left_arm, manner.off_arm, manner.off_arm, 1.0, 1.0),
        forearm=base.forearm,
        hips=by_factors(base.hips, way, 0.4 + 0.6 * way),
        left_foot=by_factors(base.left_foot, way, 1.0, raised, raised, turn),
        right_foot=by_factors(base.right_foot, way, 1.0, 1.0, 1.0, turn),
    )
    brisk = replace(manner, wind_up=manner.wind_up * (0.6 + 0.4 * effort), follow=manner.follow * (0.7 + 0.3 * effort))
    return ThrowStyle(*(_paced(getattr(style, field.name), brisk) for field in fields(style)))


def _near_release(time: float) -> float:
    return float(np.exp(-0.5 * (time / 0.25) ** 2))


def _paced(rows: tuple, manner: Manner) -> tuple:
    """The wind-up (before 0.35 s to release) and the follow-through (after 0.2 s) slower or faster."""
    return tuple((_later(_earlier(row[0], manner.wind_up), manner.follow), *row[1:]) for row in rows)


def _earlier(time: float, pace: float) -> float:
    return time if time > -0.35 else -0.35 + pace * (time + 0.35)


def _later(time: float, pace: float) -> float:
    return time if time < 0.2 else 0.2 + pace * (time - 0.2)
