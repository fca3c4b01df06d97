"""Made people who throw: each has a body, a reach of speeds and a way of throwing of their own.

A subject throws alike from one throw to the next, but not the same: harder throws are wound up further (longer stride,
more turn of pelvis and chest, arm turned out further), and a little chance is in all of it. So what a network learns on
one subject, and what it is asked for another, are planted truths.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from .adult import STATURE, adult_skeleton
from .skeleton import Skeleton
from .throws import STYLES, Throw, ThrowStyle, throw

_SCATTER = {"slot": 2.0, "stride": 0.04, "lift": 0.08, "wind_up": 0.04, "lean": 0.06, "off_arm": 0.06, "follow": 0.05}
"""Standard deviation of the chance from throw to throw."""
_LEAST = 9.0  # m/s, the slowest throw that is wound up at all


@dataclass(frozen=True)
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


@dataclass(frozen=True, eq=False)
class Subject:
    """A made person: skeleton, the hand that throws ("left" or "right"; made people use the right one), the fastest throw in m/s, the manner."""

    name: str
    stature: float
    skeleton: Skeleton
    hand: str
    fastest: float
    manner: Manner


def subject(seed: int) -> Subject:
    """Somebody of 1.6 to 2.0 m; the same seed gives the same person. Seed 0 is the project's own adult, in the manner of
    the tables."""
    if seed == 0:
        return Subject("adult", STATURE, adult_skeleton(), "right", 34.0, Manner())
    chance = np.random.default_rng([seed, 1907])
    stature = float(chance.uniform(1.60, 2.00))
    manner = Manner(
        slot=float(chance.uniform(-7.0, 7.0)),
        stride=float(chance.uniform(0.85, 1.10)),
        lift=float(chance.uniform(0.45, 1.15)),
        wind_up=float(chance.uniform(0.80, 1.15)),
        lean=float(chance.uniform(0.75, 1.15)),
        off_arm=float(chance.uniform(0.80, 1.10)),
        follow=float(chance.uniform(0.90, 1.15)),
    )
    fastest = float(chance.uniform(24.0, 34.0))
    return Subject(f"subject{seed:02d}", stature, body_of(stature, chance), "right", fastest, manner)


def body_of(stature: float, chance: np.random.Generator) -> Skeleton:
    """An adult of `stature` metres whose limbs and trunk are some percent longer or shorter than usual, both sides
    alike."""
    usual = adult_skeleton(stature)
    legs, arms, wide = chance.uniform([0.965, 0.95, 0.94], [1.035, 1.05, 1.06])
    trunk = 1.0 - 0.9 * (legs - 1.0)  # long legs make a short trunk
    offsets = np.array(usual.offsets)
    for joint, name in enumerate(usual.names):
        part = name.removeprefix("Left").removeprefix("Right")
        if part in ("Leg", "Foot"):
            offsets[joint] *= legs
        elif part in ("ForeArm", "Hand"):
            offsets[joint] *= arms
        elif part in ("Shoulder", "Arm", "UpLeg"):
            offsets[joint, 1] *= wide
        elif part.startswith("Spine") or part == "Neck":
            offsets[joint] *= trunk
    return replace(usual, offsets=offsets)


def subject_throws(
    thrower: Subject, target: tuple[float, float, float], speed: float, chance: np.random.Generator, fps: float = 120.0
) -> Throw:
    """A throw of this subject at `target` (3,) m with `speed` m/s; `chance` makes it differ from the one before.

    InputError as for `throws.throw`.
    """
    manner = scattered(thrower.manner, _SCATTER, chance)
    effort = float(np.clip((speed - _LEAST) / (thrower.fastest - _LEAST), 0.0, 1.0))
    style = styled(STYLES["overarm"], manner, effort)
    return throw(target, speed, thrower.hand, style, thrower.skeleton, fps)


def scattered(manner, scatter: dict[str, float], chance: np.random.Generator):
    """The same manner a little otherwise, by normal chance of the standard deviations `scatter` up to twice as far."""
    off = np.clip(chance.standard_normal(len(scatter)), -2.0, 2.0)
    return replace(manner, **{name: getattr(manner, name) + float(by) * scatter[name] for name, by in zip(scatter, off)})


def styled(base: ThrowStyle, manner: Manner, effort: float = 1.0) -> ThrowStyle:
    """`base` thrown in somebody's manner with `effort` 0..1 of a hard throw's winding up."""
    turn, out = 0.62 + 0.38 * effort, 0.78 + 0.22 * effort
    way = manner.stride * (0.62 + 0.38 * effort)
    raised = manner.lift * (0.25 + 0.75 * effort)
    lean = manner.lean * (0.55 + 0.45 * effort)
    spine = [(t, side - manner.slot * _near_release(t), lean * tilt, turn * about) for t, side, tilt, about in base.spine]
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


def by_factors(rows: tuple, *factors: float) -> tuple:
    """Rows (time, values...) with every value times its factor."""
    return tuple((row[0], *(value * factor for value, factor in zip(row[1:], factors))) for row in rows)


def _paced(rows: tuple, manner: Manner) -> tuple:
    """The wind-up (before 0.35 s to release) and the follow-through (after 0.2 s) slower or faster."""
    return tuple((_later(_earlier(row[0], manner.wind_up), manner.follow), *row[1:]) for row in rows)


def _earlier(time: float, pace: float) -> float:
    return time if time > -0.35 else -0.35 + pace * (time + 0.35)


def _later(time: float, pace: float) -> float:
    return time if time < 0.2 else 0.2 + pace * (time - 0.2)
