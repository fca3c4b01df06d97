"""Which way is up in a BVH file and how long its unit is: the format says neither, the body in it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.vectors import unit_vectors
from ...motion.humanoid import Humanoid, identify, leg_length
from ...motion.motion import pose_kinematics
from ...motion.skeleton import Skeleton
from .bvh_text import POSITIONS, BvhText

# a file axis -> our axis and the sign of a turn about it; a file with Y up is laid back by a quarter turn about X
TURNS = {"Y": {"X": (0, 1.0), "Y": (2, 1.0), "Z": (1, -1.0)}, "Z": {"X": (0, 1.0), "Y": (1, 1.0), "Z": (2, 1.0)}}
_HIP_HEIGHT = (0.75, 1.15)  # metres, adults standing
_LEG_LENGTH = 0.88  # m, an adult's of 1.80 m
# centimetres, metres, inches, CMU's (1 inch / 0.45 in hundredths of it), millimetres, feet, decimetres
_USUAL_UNITS = (0.01, 1.0, 0.0254, 0.05644, 0.001, 0.3048, 0.1)
_UPRIGHT = np.cos(np.radians(35.0))  # height of a unit vector from the feet to the head of a body that stands
_SAMPLES = 64  # frames that are looked at


@dataclass(frozen=True)
class Scale:
    """What was decided, told in `notes`. unit: metres per file unit. up: "Y" or "Z". body: None for no humanoid."""

    unit: float
    up: str
    body: Humanoid | None
    notes: tuple[str, ...]


def to_ours(vectors: np.ndarray, up: str) -> np.ndarray:
    """Vectors (..., 3) of a file with `up` in our axes: (..., 3)."""
    return vectors[..., (0, 2, 1)] * (1.0, -1.0, 1.0) if up == "Y" else vectors


def rotation_of(values: np.ndarray, columns: list[tuple[str, int]], up: str) -> np.ndarray:
    """A joint's rotations in our axes, components first (4, T), from `columns`: axis letters and columns of `values`
    (T, C).

    Intrinsic, in the channels' order, degrees (Faustino §4.2.1 eq. 30-31). The turns are multiplied in closed form:
    each has two components only.
    """
    out = np.zeros((4, len(values)))
    out[0] = 1.0
    columns = [(letter, column) for letter, column in columns if values[:, column].any()]  # many never move
    if not columns:
        return out
    numbers = [column for _, column in columns]
    neighbours = values[:, min(numbers) : max(numbers) + 1].T  # a slice: picking columns one by one is much slower
    half = neighbours[np.array(numbers) - min(numbers)] * (np.pi / 360.0)
    cosines, sines = np.cos(half), np.sin(half)
    for (letter, _), c, s in zip(columns, cosines, sines):
        axis, sign = TURNS[up][letter]
        s = s * sign
        k, i, j = 1 + axis, 1 + (axis + 1) % 3, 1 + (axis + 2) % 3
        w, vk, vi, vj = out[0], out[k], out[i], out[j]
        out[[0, k, i, j]] = w * c - vk * s, vk * c + w * s, vi * c + vj * s, vj * c - vi * s
    return out


def guess(text: BvhText, unit: float | None) -> Scale:
    """The file's up axis, and its unit where `unit` is None.

    Up is the axis, Y or Z, along which feet to head point (within 35 degrees) in more of 64 frames spread over the
    clip; the rest pose has a say where most of the clip is lain down. The unit is the usual one that puts the hips 0.75
    to 1.15 m above the feet, else the one that makes legs 0.88 m long. Without legs: centimetres, Y up.
    """
    rest = Skeleton(text.names, text.parents, to_ours(text.offsets, "Y"))
    try:
        body = identify(rest)
    except InputError:
        told = "given" if unit else "no legs found, centimetres assumed"
        return Scale(unit or 0.01, "Y", None, (f"unit {unit or 0.01:g} m ({told}), Y up assumed",))
    skeleton, positions = _sampled(text, rest)
    up = _up(body, positions, pose_kinematics(rest, np.zeros(3), _unturned(len(rest)))[0])
    height = _hip_height(skeleton, body, positions[..., 2] if up == "Y" else -positions[..., 1])
    found = unit or _unit(height, leg_length(skeleton))
    told = "given" if unit else "guessed"
    return Scale(found, up, body, (f"unit {found:.6g} m ({told}): hips {height * found:.2f} m high; {up} up",))


def _unturned(joints: int) -> np.ndarray:
    return np.tile((1.0, 0.0, 0.0, 0.0), (joints, 1))


def _sampled(text: BvhText, rest: Skeleton) -> tuple[Skeleton, np.ndarray]:
    """The skeleton with its posed offsets, and places (N, J, 3) in some frames, as if Y were up; file units."""
    rows = text.values[np.unique(np.linspace(0, len(text.values) - 1, _SAMPLES).astype(int))]
    offsets, rotations, first = np.array(text.offsets), np.empty((len(rest), 4, len(rows))), 0
    for joint, channels in enumerate(text.channels):
        columns = [(name, first + i) for i, name in enumerate(channels)]
        for name, column in columns:
            if name in POSITIONS:
                offsets[joint, POSITIONS.index(name)] = rows[:, column].mean()
        rotations[joint] = rotation_of(rows, [(n[0], c) for n, c in columns if n not in POSITIONS], "Y")
        first += len(channels)
    skeleton = Skeleton(text.names, text.parents, to_ours(offsets, "Y"))
    positions, _ = pose_kinematics(skeleton, np.zeros((len(rows), 3)), rotations.transpose(2, 0, 1))
    return skeleton, positions


def _up(body: Humanoid, posed: np.ndarray, rest: np.ndarray) -> str:
    """ "Y" or "Z" from posed (N, J, 3) and rest (J, 3) positions that were turned as if Y were up."""
    top = body.head_or_neck
    feet = [body.left.foot, body.right.foot]
    votes = {"Y": 0.0, "Z": 0.0}
    for positions, weight in ((posed, 1.0), (rest, 0.5)):
        rise = positions[..., top, :] - positions[..., feet, :].mean(axis=-2)
        rise = unit_vectors(rise)
        votes["Y"] += weight * np.mean(rise[..., 2] > _UPRIGHT)
        votes["Z"] += weight * np.mean(-rise[..., 1] > _UPRIGHT)
    return "Z" if votes["Z"] > votes["Y"] else "Y"


def _hip_height(skeleton: Skeleton, body: Humanoid, heights: np.ndarray) -> float:
    """How high the hips stand over the lower foot at most, from heights (N, J), file units; at least the leg."""
    feet = [body.left.foot, body.right.foot, body.left.toe_or_foot, body.right.toe_or_foot]
    posed = np.percentile(heights[:, body.hips] - heights[:, feet].min(axis=1), 95)
    return float(max(posed, leg_length(skeleton)))


def _unit(hip_height: float, leg: float) -> float:
    low, high = _HIP_HEIGHT
    for unit in _USUAL_UNITS:
        if low <= hip_height * unit <= high:
            return unit
    return _LEG_LENGTH / leg if leg > 1e-9 else 0.01
