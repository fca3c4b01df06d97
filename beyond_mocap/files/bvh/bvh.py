"""BVH in and out (Faustino §4.2.1, App. B): the border where a file's units, axes and Euler angles end.

Inside stands a `Motion`: metres, Z up, the hips as root, quaternions. What a file had beyond that (channel orders, a
root above the hips) is kept in a `BvhForm`, so that a motion can be written back in the form it came in. Frames are
rigid: BVH's (X, Y, Z) with Y up is our (X, -Z, Y), rotations are conjugated by that quarter turn, so rest poses stay
unrotated.

    clip = bvh.read("walk.bvh")
    bvh.write("mirrored.bvh", mirror(clip.motion), clip.form)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.humanoid import Humanoid, heading
from ...motion.motion import Motion
from ...motion.retargeting.structure import below
from ...motion.skeleton import Skeleton
from ..whole import beside
from . import bvh_scale, bvh_text
from .bvh_form import BvhForm, RootAbove
from .bvh_text import POSITIONS, ROTATIONS, BvhText
from .bvh_write import document

_STILL_METRES = 1e-3  # what moves less is written as still
_STILL_ROTATION = np.cos(np.radians(0.1) / 2)  # w of a turn by a tenth of a degree
_LARGEST_METRES = 1e6  # larger numbers are a wrong unit or a broken file
_NTSC = [rate * 1000 / 1001 for rate in (24, 30, 48, 60, 120, 240)]  # frames per second


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
    of a whole number or an NTSC rate are taken to be that. Raises InputError for anything that is no sound BVH file.
    """
    if unit is not None and not (np.isfinite(unit) and unit > 0):
        raise InputError("unit", str(unit), "metres per file unit, above 0", "0.01 for centimetres")
    text = bvh_text.parse(path)
    scale = bvh_scale.guess(text, unit)
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
    then renamed, so a half-written one is never seen. Raises InputError where the folder cannot be written.
    """
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
    known). skeleton: the body's, as of the first row. InputError as `read`.
    """

    def __init__(self, text: BvhText, unit: float | None = None):
        self.text = text
        self.scale = bvh_scale.guess(text, unit)
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

    def __init__(self, text: BvhText, scale: bvh_scale.Scale):
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
        return bvh_scale.to_ours(here, self.scale.up) * self.scale.unit

    def rotation(self, joint: int) -> np.ndarray:
        """The joint's rotation relative to its parent, components first: (4, T)."""
        return bvh_scale.rotation_of(self.text.values, self.columns(joint, ROTATIONS), self.scale.up)


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
        above.insert(0, RootAbove(name, its, bool(moves), place[0], turn[0], carries=carries))
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
    end_offsets = bvh_scale.to_ours(np.array([offset for _, offset in ends]).reshape(-1, 3), channels.scale.up)
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
