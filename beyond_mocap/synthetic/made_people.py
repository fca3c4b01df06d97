"""Made people: each has a body and a manner of their own, and does the same thing alike but not the same twice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..motion.retargeting.adult import STATURE, adult_skeleton
from ..motion.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Person:
    """stature: metres. side: "left" or "right", the hand that throws or the foot that kicks; made people use the right
    one. fastest: m/s that the ball gets at most. manner: how this person does it."""

    name: str
    stature: float
    skeleton: Skeleton
    side: str
    fastest: float
    manner: object


def adult(fastest: float, manner) -> Person:
    """The project's own adult, in the manner of the tables."""
    return Person("adult", STATURE, adult_skeleton(), side="right", fastest=fastest, manner=manner)


def person(
    name: str, manner: type, ranges: Mapping[str, tuple[float, float]], fastest: tuple[float, float],
    chance: np.random.Generator,
) -> Person:
    """Somebody of 1.6 to 2.0 m by chance. ranges: lowest and highest of each field of the manner. fastest: the same of
    the ball, m/s."""
    stature = float(chance.uniform(1.60, 2.00))
    own = manner(**{field: float(chance.uniform(low, high)) for field, (low, high) in ranges.items()})
    hardest = float(chance.uniform(*fastest))
    return Person(name, stature, body_of(stature, chance), side="right", fastest=hardest, manner=own)


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


def scattered(manner, scatter: dict[str, float], chance: np.random.Generator):
    """The same manner a little otherwise, by normal chance of the standard deviations `scatter` up to twice as far."""
    off = np.clip(chance.standard_normal(len(scatter)), -2.0, 2.0)
    return replace(
        manner, **{name: getattr(manner, name) + float(by) * scatter[name] for name, by in zip(scatter, off)}
    )


def by_factors(rows: tuple, *factors: float) -> tuple:
    """Rows (time, values...) with every value times its factor."""
    return tuple((row[0], *(value * factor for value, factor in zip(row[1:], factors))) for row in rows)
