"""A description for a target that nobody threw at: the examples most like it, blended in step (Fredriksson §7.7 takes
descriptions from recordings alone).

What a throw looks like depends on how the ball has to leave: how fast, how steeply, and how far and high the target is.
The few examples nearest in that are gone through in step, by the phase of the limb (eq. 7.2) with the release pinned,
and their bodies' hands and feet are averaged there; so are their paces, and the whole is played a little faster or
slower where the speed asks for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.motion import cubic_at, pose_kinematics
from .chains import chains_of
from .description import Description
from .example import Example
from .kinematics import from_six, six
from .phases import AT_RELEASE, motion_phase

BLENDED = 4
"""Examples that are blended at most."""
PACE = (0.85, 1.15)
"""Within which a blend is played slower or faster."""
_STEEP, _FAST, _FAR, _HIGH = np.radians(3.0), 1.5, 0.35, 0.6  # rad, m/s, share and m that count as equally unlike
_SHARP = 2.0  # how much more the nearest examples count
_TIME = 0.25  # share of plain time in the phase, which keeps still limbs going
_GRID = 200
_VARIED = 0.7  # spread of the weights' logarithms with a seed


@dataclass(frozen=True, kw_only=True)
class Wish:
    """How a ball is to leave and where it is to go: speed m/s, elevation rad, distance m over the ground from where the
    hips begin, height m of the target, limb: index into `EFFECTORS`."""

    speed: float
    elevation: float
    distance: float
    height: float
    limb: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Planned:
    """A description, and what it was made of: names and weights (N,) of the examples; root (T, 3) m, their roots' mean
    way, for where the body will stand; pace: by which they were sped up."""

    description: Description
    root: np.ndarray
    names: tuple[str, ...]
    weights: np.ndarray
    pace: float


def planned(examples: Sequence[Example], launches: np.ndarray, wish: Wish, seed: int = 0) -> Planned:
    """The description of a motion that lets a ball go as wished.

    launches (E, 3) m/s: how the ball left each example. seed: other weights, for another motion with the same aim; 0:
    none. InputError where no example uses that limb."""
    chosen, weights = alike(examples, launches, wish, seed)
    taken = [examples[index] for index in chosen]
    speed = float(weights @ np.linalg.norm(launches[chosen], axis=1))
    pace = float(np.clip(wish.speed / max(speed, 1e-9), *PACE))
    return _blended(taken, weights, pace, wish)


def alike(
    examples: Sequence[Example], launches: np.ndarray, wish: Wish, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Indices (N,) of the examples that are blended, nearest first, and their weights (N,), which sum to one."""
    usable = np.array([n for n, example in enumerate(examples) if example.limb == wish.limb], int)
    if not len(usable):
        raise InputError("throw", "no example that uses this limb", "a model trained on examples of it")
    away = unlike(launches[usable], np.array([examples[n].impact for n in usable]), wish)
    order = np.argsort(away, kind="stable")[:BLENDED]
    scale = max(float(away[order[-1]]), 1e-9)
    weights = np.exp(-_SHARP * away[order] / scale) - np.exp(-_SHARP) * (len(order) > 1) + 1e-6
    if seed:
        weights = weights * np.exp(_VARIED * np.random.default_rng(seed).normal(size=len(weights)))
    return usable[order], weights / weights.sum()


def unlike(launches: np.ndarray, impacts: np.ndarray, wish: Wish) -> np.ndarray:
    """(E,) how unlike examples are to what is wished, squared: by speed and steepness of the launches (E, 3) m/s most,
    by distance and height of the impacts (E, 3) m a little."""
    speed, level = np.linalg.norm(launches, axis=1), np.hypot(launches[:, 0], launches[:, 1])
    steep = (arctan2(launches[:, 2], level) - wish.elevation) / _STEEP
    fast = (speed - wish.speed) / np.maximum(_FAST, 0.08 * speed)
    far = np.log(np.maximum(np.hypot(impacts[:, 0], impacts[:, 1]), 0.1) / max(wish.distance, 0.1)) / _FAR
    return steep**2 + fast**2 + 0.1 * far**2 + 0.1 * ((impacts[:, 2] - wish.height) / _HIGH) ** 2


def _blended(examples: list[Example], weights: np.ndarray, pace: float, wish: Wish) -> Planned:
    """Hands, feet and roots of the examples averaged in step."""
    fps = examples[0].motion.fps
    steps = np.unique(np.append(np.linspace(0.0, 1.0, _GRID + 1), AT_RELEASE))
    frames = np.array([np.interp(steps, _in_step(example), np.arange(len(example.motion))) for example in examples])
    times = weights @ frames / pace
    release = float(weights @ [example.release for example in examples]) / pace
    count = int(np.floor(times[-1] + 1e-9)) + 1
    now = np.interp(np.arange(count), times, steps)
    shown = [_shown(example, np.interp(now, steps, own)) for example, own in zip(examples, frames)]
    effectors, hands, root = (sum(w * part for w, part in zip(weights, parts)) for parts in zip(*shown))
    before, after = _beyond(examples[0], effectors)
    impact = np.array([wish.distance, 0.0, wish.height])
    description = Description(effectors=effectors, hands=from_six(hands), limb=wish.limb, release=release,
                              impact=impact, fps=fps, before=before, after=after)
    return Planned(description=description, root=root, names=tuple(example.name for example in examples),
                   weights=weights, pace=pace)


def _in_step(example: Example) -> np.ndarray:
    """(T,) rising from 0 to 1: the phase of the limb, never quite still."""
    joint = chains_of(example.motion.skeleton).effectors[example.limb]
    places, _ = pose_kinematics(example.motion.skeleton, example.motion.root_positions, example.motion.rotations)
    last = len(example.motion) - 1
    phase = motion_phase(places[:, joint], example.release, example.motion.fps)
    even = np.interp(np.arange(last + 1), [0.0, example.release, last], [0.0, AT_RELEASE, 1.0])
    return (1.0 - _TIME) * phase + _TIME * even


def _shown(example: Example, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hands' and feet's places (N, 4, 3) m, hands' turns (N, 2, 6) and the root (N, 3) m at fractional frames (N,)."""
    skeleton = example.motion.skeleton
    root, local = cubic_at(example.motion, frames)
    places, turns = pose_kinematics(skeleton, root, local)
    joints = list(chains_of(skeleton).effectors)
    return places[:, joints], six(quaternion.to_matrix(turns[:, joints[:2]])), root


def _beyond(example: Example, effectors: np.ndarray) -> tuple[np.ndarray | None, np.ndarray | None]:
    """What is known before and after the example, moved to where the blend begins and ends."""
    if example.before is None and example.after is None:
        return None, None
    first, last = _shown(example, np.array([0.0, len(example.motion) - 1.0]))[0]
    before = None if example.before is None else example.before + (effectors[0] - first)
    after = None if example.after is None else example.after + (effectors[-1] - last)
    return before, after
