"""How a ball can leave the examples of a model, from which throws and kicks are planned."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..ball.physics import Ball
from ..base.errors import InputError
from .ball_release import AtFoot, InHand, find_rest_positions, sample_points_and_velocities
from .networks.chains import EFFECTORS
from .networks.example import Example
from .networks.model import ThrowModel
from .throw_request import build_release_part

CONTACT_DELAYS = np.linspace(-0.03, 0.03, 7)
"""s: moments about an example's contact at which its foot may strike the ball instead."""
_MAX_GAP = 0.01  # m between foot and ball up to which the foot strikes it


@dataclass(frozen=True, eq=False)
class Launches:
    """How a ball can leave a model's examples with one limb, N ways.

    Attributes:
        examples: (N) the examples; with a foot each of them several times, with contact at different moments.
        positions: (N, 3) m of the ball.
        velocities: (N, 3) m/s.
        spins: (N, 3) rad/s.
    """

    examples: tuple[Example, ...]
    positions: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray


@lru_cache(maxsize=8)
def compute_launches(model: ThrowModel, limb: int, ball: Ball) -> Launches:
    """Compute how a ball can leave each of a model's examples of a limb.

    A hand releases it when it did in the recording. When a foot touched the ball was hardly ever recorded, so several
    moments count, those in which the foot touches a ball on the ground.
    Raises:
        InputError: if no example is of that limb.
    """
    part = build_release_part(model.skeleton, limb, ball)
    own = [example for example in model.examples if example.limb == limb]
    if not own:
        raise InputError("model", f"no example with the {EFFECTORS[limb].replace('_', ' ')}", "examples with this limb")
    found = [_compute_example_launches(example, part, ball) for example in own]
    examples = [replace(example, release=frame) for example, one in zip(own, found) for frame in one[0]]
    positions, velocities, spins, gaps = (np.concatenate(values) for values in list(zip(*found))[1:])
    touches = gaps <= max(_MAX_GAP, float(gaps.min()))
    return Launches(tuple(each for each, good in zip(examples, touches) if good), positions[touches],
                    velocities[touches], spins[touches])


def _compute_example_launches(example: Example, part: InHand | AtFoot, ball: Ball):
    """Compute frames (N,), positions, velocities and spins (N, 3) of launches from an example, and gaps (N,) m."""
    delays = CONTACT_DELAYS if isinstance(part, AtFoot) else np.zeros(1)
    frames = example.release + delays * example.motion.fps
    frames = frames[(frames >= 0.0) & (frames <= len(example.motion) - 1)]
    points, velocities = sample_points_and_velocities(part, example.motion, frames)
    rest = np.zeros((len(frames), 3))
    if isinstance(part, AtFoot):
        rest = find_rest_positions(points, velocities, example.impact, ball)
    position, velocity, spin, gap = part.compute_launch(points, velocities, rest, ball)
    return frames, position, velocity, spin, np.abs(gap).max(axis=1, initial=0.0)
