"""BVH in and out (Faustino §4.2.1, App. B): the border where a file's units, axes and Euler angles end.

Inside stands a `Motion`: metres, Z up, the hips as root, quaternions. What a file had beyond that (channel orders, a
root above the hips) is kept in a `BvhForm`, so that a motion can be written back in the form it came in. Frames are
rigid: BVH's (X, Y, Z) with Y up is our (X, -Z, Y), rotations are conjugated by that quarter turn, so rest poses stay
unrotated. Which way is up and how long the unit is, the format does not say; the body in it does (`guess_scale`).

    clip = bvh.read("walk.bvh")
    bvh.write("mirrored.bvh", mirror(clip.motion), clip.form)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...base.vectors import unit_vectors
from ...motion import quaternion
from ...motion.humanoid import Humanoid, heading, identify, leg_length
from ...motion.motion import Motion, pose_kinematics
from ...motion.retargeting.structure import below
from ...motion.skeleton import Skeleton
from ..whole import beside
from . import bvh_text
from .bvh_text import POSITIONS, ROTATIONS, BvhText
from .bvh_write import BvhForm, RootAbove, document

_STILL_METRES = 1e-3  # what moves less is written as still
_STILL_ROTATION = np.cos(np.radians(0.1) / 2)  # w of a turn by a tenth of a degree
_LARGEST_METRES = 1e6  # larger numbers are a wrong unit or a broken file
_NTSC = [rate * 1000 / 1001 for rate in (24, 30, 48, 60, 120, 240)]  # frames per second
# a file axis -> our axis and the sign of a turn about it; a file with Y up is laid back by a quarter turn about X
TURNS = {"Y": {"X": (0, 1.0), "Y": (2, 1.0), "Z": (1, -1.0)}, "Z": {"X": (0, 1.0), "Y": (1, 1.0), "Z": (2, 1.0)}}
_HIP_HEIGHT = (0.75, 1.15)  # metres, adults standing
_LEG_LENGTH = 0.88  # m, an adult's of 1.80 m
# centimetres, metres, inches, CMU's (1 inch / 0.45 in hundredths of it), millimetres, feet, decimetres
_USUAL_UNITS = (0.01, 1.0, 0.0254, 0.05644, 0.001, 0.3048, 0.1)
_UPRIGHT = np.cos(np.radians(35.0))  # height of a unit vector from the feet to the head of a body that stands
_SAMPLES = 64  # frames that are looked at


@dataclass(frozen=True)
class BvhClip:
    """A file's motion, the form it had, and what the reader decided or changed, one line each."""

    motion: Motion
    form: BvhForm
    notes: tuple[str, ...]


def read(path, unit: float | None = None) -> BvhClip:
    """The clip in the BVH file at `path`.

    unit: metres per file unit; None guesses it from the hip height and tells it in the notes. Position channels of any
    joint replace its OFFSET, as Bandai-Namco's and LAFAN1's files mean them; below the hips their mean is the bone, and
    the notes say where they moved by more than 1 mm. Joints above the hips are folded into the hips. Rates within 0.1 %
    of a whole number or an NTSC rate are taken to be that. Raises InputError for anything that is no sound BVH file."""
    if unit is not None and not (np.isfinite(unit) and unit > 0):
        raise InputError("unit", str(unit), "metres per file unit, above 0", "0.01 for centimetres")
    text = bvh_text.parse(path)
    scale = guess_scale(text, unit)
    channels = _Channels(text, scale)
    hips = _top_of_body(text, scale.body)
    kept = below(text.parents, hips)
    root, root_rotations, above = _folded(channels, hips)
    skeleton, drift = _skeleton(channels, kept)
    rotations = np.stack([root_rotations.T] + [channels.rotation(joint) for joint in kept[1:]])
    _check_size(text, root, skeleton)
    motion = Motion(skeleton, root, rotations.transpose(2, 0, 1), _rate(text.frame_time))
    orders = {text.names[joint]: text.channels[joint] for joint in kept}
    form = BvhForm(orders, _headings(channels, above, motion), scale.unit, scale.up)
    return BvhClip(motion, form, (*scale.notes, *_notes(text, kept, above, drift)))


def write(path, motion: Motion, form: BvhForm | None = None) -> tuple[str, ...]:
    """Write `motion` to `path` in centimetres with Y up; returns notes on what did not fit `form`.

    `form` keeps channel orders and the joints above the hips; without it the root has six channels (XYZ positions, ZXY
    rotations) and other joints three. A joint whose motion needs a channel that its form lacks gets all of that kind. A
    root above the hips that stood still is put back as it was; one that moved is put on the ground below the hips
    (where the hips cannot move in it: where they are) and turned with the body's facing. The file is written beside and
    then renamed, so a half-written one is never seen. Raises InputError where the folder cannot be written."""
    target = Path(path)
    if not target.name:
        raise InputError(path, "no file name", "a BVH file to write")
    pieces, notes = document(motion, form or BvhForm())
    with beside(target) as part, open(part, "w", encoding="utf-8", newline="\n") as file:
        file.writelines(pieces)
    return notes


class BvhRows:
    """How single rows of numbers of one hierarchy become poses, for rows that come one by one.

    text: the hierarchy with a first row, by which unit and axes are guessed (`unit`: metres per unit, where it is
    known). skeleton: the body's, as of the first row. InputError as `read`."""

    def __init__(self, text: BvhText, unit: float | None = None):
        self.text = text
        self.scale = guess_scale(text, unit)
        channels = _Channels(text, self.scale)
        self.hips = _top_of_body(text, self.scale.body)
        self.kept = below(text.parents, self.hips)
        self.skeleton = _skeleton(channels, self.kept)[0]

    def poses(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Root positions (T, 3) m and local rotations (T, J, 4) of rows (T, C) of numbers in the file's order."""
        channels = _Channels(replace(self.text, values=np.asarray(values, dtype=float)), self.scale)
        root, rotation, _ = _folded(channels, self.hips)
        rotations = np.stack([rotation.T] + [channels.rotation(joint) for joint in self.kept[1:]])
        return root, rotations.transpose(2, 0, 1)


class _Channels:
    """A file's numbers joint by joint, in our axes and metres."""

    def __init__(self, text: BvhText, scale: Scale):
        self.text, self.scale = text, scale
        self.first = np.concatenate([[0], np.cumsum([len(c) for c in text.channels])])

    def columns(self, joint: int, kind: tuple[str, ...]) -> list[tuple[str, int]]:
        """Axis letters and columns of the joint's channels of one kind, in their order."""
        return [(c[0], self.first[joint] + i) for i, c in enumerate(self.text.channels[joint]) if c in kind]

    def position(self, joint: int) -> np.ndarray:
        """The joint relative to its parent: (T, 3) where it has position channels, else (1, 3)."""
        here = self.text.offsets[joint][None]
        columns = self.columns(joint, POSITIONS)
        if columns:
            here = np.repeat(here, len(self.text.values), axis=0)
            for letter, column in columns:
                here[:, "XYZ".index(letter)] = self.text.values[:, column]
        return to_ours(here, self.scale.up) * self.scale.unit

    def rotation(self, joint: int) -> np.ndarray:
        """The joint's rotation relative to its parent, components first: (4, T)."""
        return rotation_of(self.text.values, self.columns(joint, ROTATIONS), self.scale.up)


def _top_of_body(text: BvhText, body: Humanoid | None) -> int:
    """The joint that becomes the root: the hips where both legs hang on them, else the file's root."""
    if body is None:
        return 0
    hanging = set(below(text.parents, body.hips))
    return body.hips if {body.left.upper_leg, body.right.upper_leg} <= hanging else 0


def _folded(channels: _Channels, hips: int) -> tuple[np.ndarray, np.ndarray, tuple[RootAbove, ...]]:
    """The hips in the world, (T, 3) metres and (T, 4), and what stood above them."""
    frames, parents = len(channels.text.values), channels.text.parents
    position = np.broadcast_to(channels.position(hips), (frames, 3))
    rotation = channels.rotation(hips).T
    fixed = None if channels.columns(hips, POSITIONS) else position[0]
    above, joint = [], parents[hips]
    while joint >= 0:
        place, turn = channels.position(joint), channels.rotation(joint).T
        position, rotation = quaternion.rotate(turn, position) + place, quaternion.multiply(turn, rotation)
        moves = _strays(place) > _STILL_METRES or np.abs(turn @ turn[0]).min() < _STILL_ROTATION
        carries = fixed if joint == parents[hips] else None
        name, its = channels.text.names[joint], channels.text.channels[joint]
        above.insert(0, RootAbove(name=name, channels=its, moves=bool(moves), position=place[0], rotation=turn[0],
                                  carries=carries))
        joint = parents[joint]
    return position, rotation, tuple(above)


def _strays(positions: np.ndarray) -> float:
    """The largest distance in metres of (T, 3) positions from their mean."""
    return float(np.linalg.norm(positions - positions.mean(axis=0), axis=1).max())


def _skeleton(channels: _Channels, kept: list[int]) -> tuple[Skeleton, dict[str, float]]:
    """The kept joints with their mean offsets, and how far (metres) joints strayed from them where over 1 mm."""
    text, offsets, drift = channels.text, [np.zeros(3)], {}
    for joint in kept[1:]:
        places = channels.position(joint)
        offsets.append(places.mean(axis=0))
        if _strays(places) > _STILL_METRES:
            drift[text.names[joint]] = _strays(places)
    new = {old: i for i, old in enumerate(kept)}
    parents = [-1] + [new[text.parents[joint]] for joint in kept[1:]]
    ends = [(new[p], offset) for p, offset in zip(text.end_parents, text.end_offsets) if p in new]
    end_offsets = to_ours(np.array([offset for _, offset in ends]).reshape(-1, 3), channels.scale.up)
    names = tuple(text.names[joint] for joint in kept)
    end_parents = tuple(parent for parent, _ in ends)
    return Skeleton(names, tuple(parents), np.array(offsets), end_parents, end_offsets * channels.scale.unit), drift


def _check_size(text: BvhText, root: np.ndarray, skeleton: Skeleton) -> None:
    """InputError where the body or its way is larger than the Earth's surface allows."""
    too_far = np.flatnonzero(~(np.abs(root).max(axis=1) < _LARGEST_METRES))
    where = f"{text.path}:{text.first_row + too_far[0]}" if len(too_far) else text.path
    if len(too_far) or not np.abs(skeleton.offsets).max() < _LARGEST_METRES:
        raise InputError(where, "a position beyond 1000 km", "a person's motion", "give the unit, or export again")


def _headings(channels: _Channels, above: tuple[RootAbove, ...], motion: Motion) -> tuple[RootAbove, ...]:
    """`above` with the mean angle from the body's facing to each joint that moves."""
    if not any(joint.moves for joint in above):
        return above
    frames = np.unique(np.linspace(0, len(motion) - 1, 256).astype(int))
    some = Motion(motion.skeleton, motion.root_positions[frames], motion.rotations[frames], motion.fps)
    facing, turn, out = heading(some), quaternion.identity(len(frames)), []
    for joint in above:
        local = channels.rotation(channels.text.names.index(joint.name))[:, frames].T
        turn = quaternion.multiply(turn, local)
        mean = np.angle(np.mean(np.exp(1j * (quaternion.yaw(turn) - facing))))
        out.append(replace(joint, heading=float(mean)))
    return tuple(out)


def _rate(frame_time: float) -> float:
    """Frames per second, snapped to a whole number or an NTSC rate within 0.1 %."""
    rate = 1.0 / frame_time
    nearest = min([max(round(rate), 1), *_NTSC], key=lambda r: abs(r - rate))
    return float(nearest) if abs(nearest - rate) <= 1e-3 * nearest else rate


def _notes(text: BvhText, kept: list[int], above: tuple[RootAbove, ...], drift: dict[str, float]) -> list[str]:
    """What was changed on the way in, one line per kind."""
    notes = [f"joint {old!r} stands twice, the second is called {new!r}" for old, new in text.renamed]
    for joint in above:
        how = "moving" if joint.moves else "standing still"
        notes.append(f"{joint.name} ({how}) folded into {text.names[kept[0]]}")
    left_out = sorted(set(text.names) - {text.names[j] for j in kept} - {joint.name for joint in above})
    if left_out:
        notes.append(f"left out, not part of the body: {', '.join(left_out)}")
    if drift:
        worst = sorted(drift, key=drift.get, reverse=True)
        moved = ", ".join(f"{name} {drift[name] * 1000:.0f} mm" for name in worst[:5])
        notes.append(f"{len(drift)} joints changed their distance, taken as its mean: {moved}")
    return notes


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
    """A joint's rotations in our axes, components first (4, T), from `columns`: letters and columns of `values` (T, C).

    Intrinsic, in the channels' order, degrees (Faustino §4.2.1 eq. 30-31). The turns are multiplied in closed form:
    each has two components only."""
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


def guess_scale(text: BvhText, unit: float | None) -> Scale:
    """The file's up axis, and its unit where `unit` is None.

    Up is the axis, Y or Z, along which feet to head point (within 35 degrees) in more of 64 frames spread over the
    clip; the rest pose has a say where most of the clip is lain down. The unit is the usual one that puts the hips 0.75
    to 1.15 m above the feet, else the one that makes legs 0.88 m long. Without legs: centimetres, Y up."""
    rest = Skeleton(text.names, text.parents, to_ours(text.offsets, "Y"))
    try:
        body = identify(rest)
    except InputError:
        told = "given" if unit else "no legs found, centimetres assumed"
        return Scale(unit or 0.01, "Y", None, (f"unit {unit or 0.01:g} m ({told}), Y up assumed",))
    skeleton, positions = _sampled(text, rest)
    up = _up(body, positions, pose_kinematics(rest, np.zeros(3), quaternion.identity(len(rest)))[0])
    height = _hip_height(skeleton, body, positions[..., 2] if up == "Y" else -positions[..., 1])
    found = unit or _unit(height, leg_length(skeleton))
    told = "given" if unit else "guessed"
    return Scale(found, up, body, (f"unit {found:.6g} m ({told}): hips {height * found:.2f} m high; {up} up",))


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
        rise = unit_vectors(positions[..., top, :] - positions[..., feet, :].mean(axis=-2))
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
