"""The pose that a movement begins with: of all frames of the examples the one whose hands and feet lie and move most as
they are to at the beginning (Fredriksson §7.7.1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.motion import forward_kinematics
from .chains import chains_of
from .kinematics import Pose, matrices, places_and_turns
from .model import ThrowModel

_SECONDS = 0.12  # a difference in velocity counts as the distance it makes in this time
_TURN = 0.25  # m that a turn by one radian costs: a body that faces elsewhere throws otherwise
_LATE = 0.5  # m that a frame at the end of its example costs at the beginning of a movement


@dataclass(frozen=True, eq=False)
class Stock:
    """Every frame of the examples. places (N, 4, 3) m and velocities (N, 4, 3) m/s of the effectors in the normalised
    frame; limb (N,); example, frame (N,) indices; late (N,) 0 at the beginning of its example, 1 at its end."""

    places: np.ndarray
    velocities: np.ndarray
    limb: np.ndarray
    example: np.ndarray
    frame: np.ndarray
    late: np.ndarray


@lru_cache(maxsize=8)
def stock(model: ThrowModel) -> Stock:
    """All frames of a model's examples; kept, as models are asked again and again. InputError where it has none."""
    if not model.examples:
        raise InputError("model: examples", "none", "one at least, to begin with", "train the model again")
    effectors = list(chains_of(model.skeleton).effectors)
    rows = []
    for index, example in enumerate(model.examples):
        places = forward_kinematics(example.motion)[0][:, effectors]
        count = len(places)
        velocity = np.gradient(places, 1.0 / example.motion.fps, axis=0) if count > 1 else np.zeros_like(places)
        many = np.full(count, 1)
        rows.append((places, velocity, many * example.limb, many * index, np.arange(count), np.linspace(0, 1, count)))
    return Stock(*(np.concatenate(column) for column in zip(*rows)))


def nearest(model: ThrowModel, places: np.ndarray, velocities: np.ndarray, limb: int) -> tuple[int, int, float]:
    """Example, frame and turn (radians about the upright) that fit effectors at places (4, 3) m, moving at velocities
    (4, 3) m/s, best; frames of the same limb before all others.

    A candidate may be moved over the ground and turned; heights have to fit."""
    among = stock(model)
    mine = places[:, :2] - places[:, :2].mean(axis=0)
    theirs = among.places[..., :2] - among.places[..., :2].mean(axis=1, keepdims=True)
    turn = np.arctan2(
        (theirs[..., 0] * mine[:, 1] - theirs[..., 1] * mine[:, 0]).sum(-1), (theirs * mine).sum((-1, -2))
    )
    turned = quaternion.turned_level(theirs, turn[:, None])
    swift = quaternion.turned_level(among.velocities[..., :2], turn[:, None])
    cost = ((turned - mine) ** 2).sum((-1, -2)) + ((among.places[..., 2] - places[:, 2]) ** 2).sum(-1)
    change = ((swift - velocities[:, :2]) ** 2).sum((-1, -2))
    change = change + ((among.velocities[..., 2] - velocities[:, 2]) ** 2).sum(-1)
    cost = cost + _SECONDS**2 * change + (_TURN * turn) ** 2 + (_LATE * among.late) ** 2
    cost = cost + 1e3 * (among.limb != limb)
    best = int(np.argmin(cost))
    return int(among.example[best]), int(among.frame[best]), float(turn[best])


def placed(model: ThrowModel, example: int, frame: int, turn: float, places: np.ndarray) -> Pose:
    """The pose of an example's frame, turned by `turn` radians and moved over the ground so that its effectors lie
    about places (4, 3) m; its joints move as they do there."""
    motion = model.examples[example].motion
    both = slice(max(frame - 1, 0), frame + 1)
    local = matrices(motion.frames(both.start, both.stop))
    root = motion.root_positions[both]
    spin = quaternion.to_matrix(quaternion.about_up(np.array(turn)))
    local = np.concatenate([(spin @ local[:, 0])[:, None], local[:, 1:]], axis=1)
    root = root @ spin.T
    positions, turns = places_and_turns(model.skeleton.offsets, model.skeleton.parents, root, local, np)
    effectors = list(chains_of(model.skeleton).effectors)
    shift = np.append((places - positions[-1, effectors])[:, :2].mean(axis=0), 0.0)
    return Pose(root[-1] + shift, local[-1], positions[-1] + shift, turns[-1], positions[-1] - positions[0])


def start_pose(model: ThrowModel, places: np.ndarray, velocities: np.ndarray, limb: int) -> Pose:
    """The examples' pose that begins a movement best, placed; arguments as of `nearest`."""
    return placed(model, *nearest(model, places, velocities, limb), places)
