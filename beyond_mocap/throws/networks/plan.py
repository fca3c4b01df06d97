"""Plan a motion for a new target: a description blended from the most similar examples.

How a throw looks depends on how the ball has to leave (speed and elevation) and on the distance and height of the
target. The few most similar examples are aligned by the phase of the limb (eq. 7.2) with the release pinned, and
their hands, feet and paces are averaged; the result is played a little faster or slower where the speed requires it.
Fredriksson section 7.7 takes descriptions from recordings alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.motion import ACCEPTED_RATES, compute_pose, sample_frames_cubic
from .chains import find_chains
from .description import Description
from .example import Example
from .kinematics import from_six, to_six
from .phases import AT_RELEASE, compute_motion_phase

MAX_BLENDED = 4
"""Maximum number of examples that are blended."""
_STEEP, _FAST, _FAR, _HIGH = np.radians(3.0), 1.5, 0.35, 0.6  # rad, m/s, log ratio and m of equal dissimilarity
_SHARPNESS = 2.0  # exponent by which the weights decrease with dissimilarity
_TIME_SHARE = 0.25  # share of plain time in the phase, so that it also increases where the limb does not move
_GRID = 200  # intervals of the common phase axis
_WEIGHT_SPREAD = 0.7  # standard deviation of the logarithm of the weights with a seed


@dataclass(frozen=True, kw_only=True)
class LaunchRequest:
    """How a ball has to leave, and its target.

    Attributes:
        speed: m/s.
        elevation: rad above the horizontal.
        distance: m over the ground from the first position of the hips to the target.
        height: m of the target above the ground.
        limb: index into `EFFECTORS`.
    """

    speed: float
    elevation: float
    distance: float
    height: float
    limb: int


@dataclass(frozen=True, eq=False, kw_only=True)
class PlannedMotion:
    """A planned description and its sources.

    Attributes:
        description: the description.
        root: (T, 3) m, mean root path of the examples, to estimate where the body will be.
        names: names of the blended examples.
        weights: (N,) their weights.
        pace: playback rate that was applied.
    """

    description: Description
    root: np.ndarray
    names: tuple[str, ...]
    weights: np.ndarray
    pace: float


def plan_motion(examples: Sequence[Example], launches: np.ndarray, request: LaunchRequest,
                seed: int = 0) -> PlannedMotion:
    """Plan the description of a motion that releases the ball as requested.

    Args:
        examples: examples of the model.
        launches: (E, 3) m/s, velocity of the ball at the release of each example.
        request: how the ball has to leave.
        seed: other weights, for another motion with the same target; 0 for none.
    Raises:
        InputError: if no example uses that limb.
    """
    chosen, weights = choose_examples(examples, launches, request, seed)
    taken = [examples[index] for index in chosen]
    speed = float(weights @ np.linalg.norm(launches[chosen], axis=1))
    pace = float(np.clip(request.speed / max(speed, 1e-9), *ACCEPTED_RATES))
    return _blend_examples(taken, weights, pace, request)


def choose_examples(
    examples: Sequence[Example], launches: np.ndarray, request: LaunchRequest, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Choose the examples to blend.

    Args: see `plan_motion`.
    Returns:
        Indices (N,) of the examples, most similar first, and their weights (N,), which sum to one.
    Raises:
        InputError: if no example uses that limb.
    """
    usable = np.array([n for n, example in enumerate(examples) if example.limb == request.limb], int)
    if not len(usable):
        raise InputError("throw", "no example that uses this limb", "a model trained on examples of it")
    dissimilarity = compute_dissimilarity(launches[usable], np.array([examples[n].impact for n in usable]), request)
    order = _select_blended([examples[n] for n in usable], np.argsort(dissimilarity, kind="stable"))
    scale = max(float(dissimilarity[order[-1]]), 1e-9)
    weights = np.exp(-_SHARPNESS * dissimilarity[order] / scale) - np.exp(-_SHARPNESS) * (len(order) > 1) + 1e-6
    if seed:
        weights = weights * np.exp(_WEIGHT_SPREAD * np.random.default_rng(seed).normal(size=len(weights)))
    return usable[order], weights / weights.sum()


def _select_blended(examples: Sequence[Example], order: np.ndarray) -> np.ndarray:
    """Select the first movements of an order: each once, all of one subject, since movements of one style blend."""
    found: list[int] = []
    for number in order:
        one = examples[number]
        if one.subject == examples[order[0]].subject and all(one.motion is not examples[n].motion for n in found):
            found.append(int(number))
    return np.array(found[:MAX_BLENDED])


def compute_dissimilarity(launches: np.ndarray, impacts: np.ndarray, request: LaunchRequest) -> np.ndarray:
    """Compute the squared dissimilarity (E,) of examples to a request.

    Speed and elevation of the launches (E, 3) m/s count most, distance and height of the impacts (E, 3) m a little.
    """
    speed, level = np.linalg.norm(launches, axis=1), np.hypot(launches[:, 0], launches[:, 1])
    steep = (arctan2(launches[:, 2], level) - request.elevation) / _STEEP
    fast = (speed - request.speed) / np.maximum(_FAST, 0.08 * speed)
    far = np.log(np.maximum(np.hypot(impacts[:, 0], impacts[:, 1]), 0.1) / max(request.distance, 0.1)) / _FAR
    return steep**2 + fast**2 + 0.1 * far**2 + 0.1 * ((impacts[:, 2] - request.height) / _HIGH) ** 2


def _blend_examples(examples: list[Example], weights: np.ndarray, pace: float, request: LaunchRequest) -> PlannedMotion:
    """Average hands, feet and roots of the aligned examples."""
    fps = examples[0].motion.fps
    steps = np.unique(np.append(np.linspace(0.0, 1.0, _GRID + 1), AT_RELEASE))
    frames = np.array([np.interp(steps, _compute_progress(example), np.arange(len(example.motion)))
                       for example in examples])
    # frames (N, S): frame of each example at each common phase; times (S,): frame of the blend at that phase
    times = weights @ frames / pace
    release = float(weights @ [example.release for example in examples]) / pace
    count = int(np.floor(times[-1] + 1e-9)) + 1
    now = np.interp(np.arange(count), times, steps)
    samples = [_sample_example(example, np.interp(now, steps, own)) for example, own in zip(examples, frames)]
    effectors, hands, root = (sum(w * part for w, part in zip(weights, parts)) for parts in zip(*samples))
    before, after = _align_context(examples[0], effectors)
    impact = np.array([request.distance, 0.0, request.height])
    description = Description(effectors=effectors, hands=from_six(hands), limb=request.limb, release=release,
                              impact=impact, fps=fps, before=before, after=after)
    return PlannedMotion(description=description, root=root, names=tuple(example.name for example in examples),
                         weights=weights, pace=pace)


def _compute_progress(example: Example) -> np.ndarray:
    """Compute the progress (T,) of an example from 0 to 1, increasing: the phase of its limb mixed with time."""
    joint = find_chains(example.motion.skeleton).effectors[example.limb]
    places, _ = compute_pose(example.motion.skeleton, example.motion.root_positions, example.motion.rotations)
    last = len(example.motion) - 1
    phase = compute_motion_phase(places[:, joint], example.release, example.motion.fps)
    even = np.interp(np.arange(last + 1), [0.0, example.release, last], [0.0, AT_RELEASE, 1.0])
    return (1.0 - _TIME_SHARE) * phase + _TIME_SHARE * even


def _sample_example(example: Example, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample an example at fractional frames (N,).

    Returns:
        Positions of hands and feet (N, 4, 3) m, hand rotations (N, 2, 6) and the root (N, 3) m.
    """
    skeleton = example.motion.skeleton
    root, local = sample_frames_cubic(example.motion, frames)
    places, turns = compute_pose(skeleton, root, local)
    joints = list(find_chains(skeleton).effectors)
    return places[:, joints], to_six(quaternion.to_matrix(turns[:, joints[:2]])), root


def _align_context(example: Example, effectors: np.ndarray) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Move the effectors known before and after an example to where the blend begins and ends."""
    if example.before is None and example.after is None:
        return None, None
    first, last = _sample_example(example, np.array([0.0, len(example.motion) - 1.0]))[0]
    before = None if example.before is None else example.before + (effectors[0] - first)
    after = None if example.after is None else example.after + (effectors[-1] - last)
    return before, after
