"""Synthetic performers who throw or kick: each has a body, a fastest throw or kick and a manner of their own.

They perform the same action alike, but never twice the same: harder throws have a larger wind-up (longer stride, leg
lifted higher, deeper hips, more turn of pelvis and chest, arm turned out further), and everything has some random
variation. So what a network learns from one performer, and what it has to predict for another, is ground truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from ..motion.retargeting.adult import STATURE, build_adult_skeleton
from ..motion.skeleton import Skeleton
from .kicks import KickStyle
from .throws import STYLES, Throw, ThrowStyle, build_throw

_KICK_SCATTER = {"approach": 2.0, "stride": 0.04, "back": 0.04, "follow": 0.05, "lean": 1.5, "off_arm": 0.06}
"""Standard deviation of the variation from kick to kick."""
_WHIP_SECONDS = 0.05  # s around the contact in which the leg swings through the ball
_LEAST_KICK = 8.0  # m/s of the ball in a kick with no effort

_THROW_SCATTER = {
    "slot": 2.0, "stride": 0.04, "lift": 0.08, "wind_up": 0.04, "lean": 0.06, "off_arm": 0.06, "follow": 0.05,
}  # fmt: skip
"""Standard deviation of the variation from throw to throw."""
_LEAST_THROW = 9.0  # m/s of the ball in a throw with no effort


@dataclass(frozen=True, eq=False)
class Performer:
    """A synthetic performer.

    Attributes:
        name: name.
        stature: body height, m.
        skeleton: skeleton.
        side: "left" or "right", the throwing hand or kicking foot; synthetic performers use the right one.
        fastest: highest speed of the ball, m/s.
        manner: how this performer throws or kicks.
    """

    name: str
    stature: float
    skeleton: Skeleton
    side: str
    fastest: float
    manner: object


def build_adult(fastest: float, manner) -> Performer:
    """Build the performer with the project's own adult skeleton, in the manner of the tables."""
    return Performer("adult", STATURE, build_adult_skeleton(), side="right", fastest=fastest, manner=manner)


def build_performer(
    name: str, manner: type, ranges: Mapping[str, tuple[float, float]], fastest: tuple[float, float],
    chance: np.random.Generator,
) -> Performer:
    """Build a random performer of 1.6 to 2.0 m.

    Args:
        name: name.
        manner: class of the manner.
        ranges: lowest and highest value of each field of the manner.
        fastest: lowest and highest value of the performer's highest ball speed, m/s.
        chance: random generator.
    Returns:
        The performer.
    """
    stature = float(chance.uniform(1.60, 2.00))
    manner_chosen = manner(**{field: float(chance.uniform(low, high)) for field, (low, high) in ranges.items()})
    hardest = float(chance.uniform(*fastest))
    return Performer(name, stature, build_body(stature, chance), side="right", fastest=hardest, manner=manner_chosen)


def build_body(stature: float, chance: np.random.Generator) -> Skeleton:
    """Build an adult whose limbs and trunk are some percent longer or shorter than average, the same on both sides.

    Args:
        stature: m.
        chance: random generator.
    Returns:
        The skeleton.
    """
    average = build_adult_skeleton(stature)
    legs, arms, width = chance.uniform([0.965, 0.95, 0.94], [1.035, 1.05, 1.06])
    trunk = 1.0 - 0.9 * (legs - 1.0)  # long legs go with a short trunk
    offsets = np.array(average.offsets)
    for joint, name in enumerate(average.names):
        part = name.removeprefix("Left").removeprefix("Right")
        if part in ("Leg", "Foot"):
            offsets[joint] *= legs
        elif part in ("ForeArm", "Hand"):
            offsets[joint] *= arms
        elif part in ("Shoulder", "Arm", "UpLeg"):
            offsets[joint, 1] *= width
        elif part.startswith("Spine") or part == "Neck":
            offsets[joint] *= trunk
    return replace(average, offsets=offsets)


def vary_manner(manner, scatter: dict[str, float], chance: np.random.Generator):
    """Vary a manner randomly.

    Args:
        manner: the manner.
        scatter: standard deviation of each field; limited to twice as much.
        chance: random generator.
    Returns:
        The varied manner.
    """
    deviations = np.clip(chance.standard_normal(len(scatter)), -2.0, 2.0)
    return replace(
        manner, **{name: getattr(manner, name) + float(by) * scatter[name] for name, by in zip(scatter, deviations)}
    )


def scale_rows(rows: tuple, *factors: float) -> tuple:
    """Scale rows (time, values...): every value times its factor."""
    return tuple((row[0], *(value * factor for value, factor in zip(row[1:], factors))) for row in rows)


@dataclass(frozen=True, kw_only=True)
class KickManner:
    """How a performer kicks.

    Attributes:
        approach: degrees added to the run-up's turn.
        stride: factor.
        back: factor on how far leg and pelvis swing back.
        follow: factor on how high the leg swings after the ball.
        lean: degrees that the trunk is inclined more to the support leg.
        off_arm: factor on how far the arms are held out.
    """

    approach: float = 0.0
    stride: float = 1.0
    back: float = 1.0
    follow: float = 1.0
    lean: float = 0.0
    off_arm: float = 1.0


_KICK_RANGES = {
    "approach": (-9.0, 8.0), "stride": (0.86, 1.08), "back": (0.86, 1.04), "follow": (0.75, 1.15), "lean": (-5.0, 5.0),
    "off_arm": (0.75, 1.08),
}  # fmt: skip
"""Lowest and highest value of each field."""


def build_kicker(seed: int) -> Performer:
    """Build a performer who kicks; the same seed gives the same one. Seed 0 has the project's own adult skeleton."""
    if seed == 0:
        return build_adult(28.0, KickManner())
    return build_performer(f"kicker{seed:02d}", KickManner, _KICK_RANGES, (22.0, 28.0),
                           np.random.default_rng([seed, 1863]))


def vary_kick(performer: Performer, base: KickStyle, speed: float, chance: np.random.Generator) -> KickStyle:
    """Vary how a performer kicks.

    Args:
        performer: the performer.
        base: style of the kick.
        speed: of the ball, m/s.
        chance: random generator, for the difference from kick to kick.
    Returns:
        The performer's style for this kick.
    """
    effort = float(np.clip((speed - _LEAST_KICK) / (performer.fastest - _LEAST_KICK), 0.0, 1.0))
    return style_kick(base, vary_manner(performer.manner, _KICK_SCATTER, chance), effort)


def style_kick(base: KickStyle, manner: KickManner, effort: float = 1.0) -> KickStyle:
    """Adapt a kick's style to a manner.

    Args:
        base: style of the kick.
        manner: the manner.
        effort: 0 to 1 of a hard kick's swing.
    Returns:
        The style.
    """
    back, follow = manner.back * (0.78 + 0.22 * effort), manner.follow * (0.66 + 0.34 * effort)
    out, turn = manner.off_arm * (0.7 + 0.3 * effort), 0.75 + 0.25 * effort * manner.back
    approach = base.approach + manner.approach
    arms = [scale_rows(rows, out, out, 1.0, 1.0) for rows in (base.left_arm, base.right_arm)]
    return replace(
        base, approach=approach, strides=tuple(manner.stride * (0.8 + 0.2 * effort) * stride
                                               for stride in base.strides),
        leg=_scale_leg(base.leg, back, 0.72 + 0.28 * effort, follow),
        pelvis=tuple((t, side, tilt, _blend_turn(t, about, turn, manner.approach)) for t, side, tilt,
                     about in base.pelvis),
        spine=tuple((t, side - manner.lean * _weight_near_zero(t), tilt, turn * about) for t, side, tilt,
                    about in base.spine), left_arm=arms[0], right_arm=arms[1],
    )


def _scale_leg(rows: tuple, back: float, whip: float, follow: float) -> tuple:
    """Scale rows (time, thigh, knee) of the leg: backswing, whip through the ball, and follow-through."""
    at = next(row for row in rows if row[0] == 0.0)
    out = []
    for time, thigh, knee in rows:
        if time < -_WHIP_SECONDS:
            out.append((time, back * thigh, back * knee))
        elif time > _WHIP_SECONDS:
            out.append((time, follow * thigh, knee))
        else:
            out.append((time, at[1] + whip * (thigh - at[1]), at[2] + whip * (knee - at[2])))
    return tuple(out)


def _blend_turn(time: float, about: float, turn: float, approach: float) -> float:
    """Compute the pelvis' turn: the approach's on the run-up, then the style's."""
    approach_share = float(np.clip((-0.2 - time) / 0.2, 0.0, 1.0))
    return about * (approach_share + (1.0 - approach_share) * turn) - approach_share * approach


def _weight_near_zero(time: float) -> float:
    """Weight of a time (s) near the contact or release."""
    return float(np.exp(-0.5 * (time / 0.25) ** 2))


@dataclass(frozen=True, kw_only=True)
class ThrowManner:
    """How a performer throws.

    Attributes:
        slot: degrees added to the trunk's lean away from the arm at release.
        stride: factor.
        lift: factor, of the leading leg.
        wind_up: factor on the seconds before the foot is down.
        lean: factor, forward, after release.
        off_arm: factor on how far the other arm is held out.
        follow: factor on the seconds after release.
    """

    slot: float = 0.0
    stride: float = 1.0
    lift: float = 1.0
    wind_up: float = 1.0
    lean: float = 1.0
    off_arm: float = 1.0
    follow: float = 1.0


_THROW_RANGES = {
    "slot": (-7.0, 7.0), "stride": (0.85, 1.10), "lift": (0.45, 1.15), "wind_up": (0.80, 1.15), "lean": (0.75, 1.15),
    "off_arm": (0.80, 1.10), "follow": (0.90, 1.15),
}  # fmt: skip
"""Lowest and highest value of each field."""


def build_thrower(seed: int) -> Performer:
    """Build a performer who throws; the same seed gives the same one. Seed 0 has the project's own adult skeleton."""
    if seed == 0:
        return build_adult(34.0, ThrowManner())
    chance = np.random.default_rng([seed, 1907])
    return build_performer(f"subject{seed:02d}", ThrowManner, _THROW_RANGES, (24.0, 34.0), chance)


def build_performer_throw(
    thrower: Performer, target: tuple[float, float, float], speed: float, chance: np.random.Generator,
    fps: float = 120.0
) -> Throw:
    """Build a throw of a performer.

    Args:
        thrower: the performer.
        target: (3,) m.
        speed: of the ball, m/s.
        chance: random generator, for the difference from throw to throw.
        fps: frames per second.
    Returns:
        The throw.
    Raises:
        InputError: as for `throws.build_throw`.
    """
    manner = vary_manner(thrower.manner, _THROW_SCATTER, chance)
    style = style_throw(STYLES["overarm"], manner, compute_effort(thrower, speed))
    return build_throw(target, speed, thrower.side, style=style, skeleton=thrower.skeleton, fps=fps)


def compute_effort(thrower: Performer, speed: float) -> float:
    """Compute the effort (0 to 1) of a performer's throw of a ball at `speed` m/s."""
    return float(np.clip((speed - _LEAST_THROW) / (thrower.fastest - _LEAST_THROW), 0.0, 1.0))


def style_throw(base: ThrowStyle, manner: ThrowManner, effort: float = 1.0) -> ThrowStyle:
    """Adapt a throw's style to a manner.

    Args:
        base: style of the throw.
        manner: the manner.
        effort: 0 to 1 of a hard throw's wind-up.
    Returns:
        The style.
    """
    turn, out = 0.62 + 0.38 * effort, 0.78 + 0.22 * effort
    stride, aside = manner.stride * (0.62 + 0.38 * effort), 0.5 + 0.5 * effort
    raised = manner.lift * (0.4 + 0.6 * effort)
    lean = manner.lean * (0.75 + 0.25 * effort)
    spine = [(t, lean * side - manner.slot * _weight_near_zero(t), lean * tilt, turn * about) for t, side, tilt,
             about in base.spine]
    style = ThrowStyle(
        pelvis=scale_rows(base.pelvis, lean, lean, turn), spine=tuple(spine),
        right_arm=tuple((t, a, b, c if c > -60.0 else -60.0 + out * (c + 60.0), e) for t, a, b, c, e in base.right_arm),
        left_arm=scale_rows(base.left_arm, manner.off_arm, manner.off_arm, 1.0, 1.0), forearm=base.forearm,
        hips=scale_rows(base.hips, stride, aside, stride * (0.35 + 0.65 * effort)),
        left_foot=scale_rows(base.left_foot, stride, aside, raised, raised, turn),
        right_foot=scale_rows(base.right_foot, stride, aside, aside, 1.0, turn),
    )
    brisk = replace(manner, wind_up=manner.wind_up * (0.6 + 0.4 * effort), follow=manner.follow * (0.7 + 0.3 * effort))
    return ThrowStyle(*(_scale_times(getattr(style, field.name), brisk) for field in fields(style)))


def _scale_times(rows: tuple, manner: ThrowManner) -> tuple:
    """Scale the duration of the wind-up (before 0.35 s to release) and of the follow-through (after 0.2 s)."""

    def scale_time(time: float) -> float:
        time = time if time > -0.35 else -0.35 + manner.wind_up * (time + 0.35)
        return time if time < 0.2 else 0.2 + manner.follow * (time - 0.2)

    return tuple((scale_time(row[0]), *row[1:]) for row in rows)
