"""Format a motion as the text of a BVH file in the form of its source (`BvhForm`).

Hierarchy in file order, Euler angles, centimetres, Y up.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from ...motion import quaternion
from ...motion.humanoid import compute_heading
from ...motion.motion import Motion
from ...motion.skeleton import Skeleton
from .bvh_text import POSITIONS, ROTATIONS

_CENTIMETRES = 100.0
STILL_METRES = 1e-3
"""Metres of motion below which a joint counts as still."""
STILL_ROTATION = np.cos(np.radians(0.1) / 2)
"""The same for rotations: w of a tenth of a degree."""
_ZXY = ("Zrotation", "Xrotation", "Yrotation")
_SAME_PLACE = 1e-4  # centimetres
_SAME_ANGLE = np.degrees(1e-6)


@dataclass(frozen=True, kw_only=True)
class JointAboveHips:
    """A joint above the hips, from the file's root down.

    Attributes:
        name: the joint's name.
        channels: its channel names in order.
        is_moving: whether it moves with the body (LAFAN1's SimulationBone) rather than being static (Bandai's
            joint_Root).
        position: (3,) m relative to the joint above it; that of the first frame if it moves.
        rotation: (4,) relative to the joint above it; that of the first frame if it moves.
        heading: radians from the body's heading to this joint's, if it moves.
        hip_offset: (3,) m, the hips' position in it, if it is right above hips without position channels.
    """

    name: str
    channels: tuple[str, ...]
    is_moving: bool
    position: np.ndarray
    rotation: np.ndarray
    heading: float = 0.0
    hip_offset: np.ndarray | None = None


@dataclass(frozen=True)
class BvhForm:
    """What writing a motion back needs beyond the motion.

    Attributes:
        channels: joint name -> channel names in order.
        above: joints above the hips.
        unit: metres per file unit, as read (files are always written in centimetres).
        up: "Y" or "Z", as read (files are always written with Y up).
    """

    channels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    above: tuple[JointAboveHips, ...] = ()
    unit: float = 0.01
    up: str = "Y"


def build_form(names: Sequence[str], places: np.ndarray, turns: np.ndarray, motion: Motion) -> BvhForm:
    """Build the form of a motion whose source has joints above the hips.

    Args:
        names: of A joints, from the source's root down.
        places: (T, A, 3) m, world.
        turns: (T, A, 4), world.
        motion: from the hips on, T frames.
    """
    joints, parent = [], (np.zeros((len(motion), 3)), quaternion.identity(len(motion)))
    body_heading = compute_heading(motion) if len(names) else np.zeros(0)
    for number, name in enumerate(names):
        world = places[:, number], turns[:, number]
        place, turn = _to_parent_frame(world, parent)
        mean = np.angle(np.mean(np.exp(1j * (quaternion.to_yaw(world[1]) - body_heading))))
        joints.append(JointAboveHips(name=name, channels=(*POSITIONS, *_ZXY), is_moving=moves(place, turn),
                                     position=place[0], rotation=turn[0], heading=float(mean)))
        parent = world
    return BvhForm(above=tuple(joints))


def moves(positions: np.ndarray, rotations: np.ndarray) -> bool:
    """Whether a joint at (T, 3) m and (T, 4), relative to the joint above it, moves by more than noise."""
    return bool(measure_spread(positions) > STILL_METRES or np.abs(rotations @ rotations[0]).min() < STILL_ROTATION)


def measure_spread(positions: np.ndarray) -> float:
    """Measure the largest distance in metres of (T, 3) positions from their mean."""
    return float(np.linalg.norm(positions - positions.mean(axis=0), axis=1).max())


@dataclass(frozen=True, kw_only=True)
class _Joint:
    """A joint as it is written, centimetres and degrees, Y up.

    Attributes:
        name: the joint's name.
        depth: number of joints above it.
        offset: (3,) cm.
        channels: names in order.
        columns: (T, channels).
        ends: (E, 3) cm, End Sites.
        added: channels that its form lacks.
    """

    name: str
    depth: int
    offset: np.ndarray
    channels: tuple[str, ...]
    columns: np.ndarray
    ends: np.ndarray
    added: tuple[str, ...]


def format_bvh(motion: Motion, form: BvhForm) -> tuple[Iterator[str], tuple[str, ...]]:
    """Format a motion as BVH.

    Args:
        motion: the motion.
        form: channel orders and joints above the hips.
    Returns:
        The file's text in pieces, and a note for each joint that needs more channels than `form` gives it.
    """
    joints = _build_joints(motion, form)
    notes = tuple(f"{j.name}: {', '.join(j.added)} added, because the motion needs it" for j in joints if j.added)
    return chain(_iter_head(joints, len(motion), motion.fps), _iter_rows(joints)), notes


def iter_parts_text(parts: Iterable[Motion], count: int, form: BvhForm) -> Iterator[str]:
    """Format a motion that comes in parts, of `count` frames in all, as BVH: the text in pieces."""
    for number, part in enumerate(parts):
        joints = _build_joints(part, form)
        if not number:
            yield from _iter_head(joints, count, part.fps)
        yield from _iter_rows(joints)


def _build_joints(motion: Motion, form: BvhForm) -> list[_Joint]:
    """Build the joints in the file's order."""
    joints = _build_joints_above(motion, form.above)
    root, rotation = _compute_hips(motion, form.above)
    for i, depth in _iter_depth_first(motion.skeleton):
        name = motion.skeleton.names[i]
        declared = form.channels.get(name, (POSITIONS if i == 0 else ()) + _ZXY)
        position = root if i == 0 else motion.skeleton.offsets[i][None]
        ends = motion.skeleton.end_offsets[[p == i for p in motion.skeleton.end_parents]]
        local_rotation = rotation if i == 0 else motion.rotations[:, i]
        joints.append(_build_joint(name, len(form.above) + depth, declared, place=position, turn=local_rotation,
                                   ends=ends))
    return joints


def compute_euler_degrees(rotations: np.ndarray, letters: str) -> np.ndarray:
    """Compute Euler angles in the order of `letters`, completed to a permutation of XYZ.

    With three letters, the middle angle is within +-90 degrees. With fewer, two triples give the rotation, (a, b, c)
    and (a + 180, 180 - b, c + 180); the one whose angles beyond `letters` are nearer to zero is used, so that they can
    be left out.

    Args:
        rotations: (T, 4).
        letters: axes in order, such as "ZXY" or "Z".
    Returns:
        (T, 3) degrees.
    """
    order = letters + "".join(axis for axis in "ZXY" if axis not in letters)
    angles = np.degrees(quaternion.to_euler(rotations, order))
    if len(letters) == 3:
        return angles
    other = angles * (1.0, -1.0, 1.0) + 180.0
    other = (other + 180.0) % 360.0 - 180.0
    spare, other_spare = (np.abs(a[:, len(letters) :]).sum(axis=1) for a in (angles, other))
    return np.where((other_spare < spare - _SAME_ANGLE)[:, None], other, angles)


def _to_file_axes(vectors: np.ndarray) -> np.ndarray:
    """Convert core vectors (..., 3), metres, Z up, to the file's centimetres, Y up."""
    return vectors[..., (0, 2, 1)] * (_CENTIMETRES, _CENTIMETRES, -_CENTIMETRES)


def _build_joint(name: str, depth: int, declared: tuple[str, ...], place: np.ndarray, turn: np.ndarray, ends) -> _Joint:
    """Build one joint from place (T or 1, 3) metres and turn (T, 4), relative to its parent, in core axes."""
    places = _to_file_axes(place)
    missing = [c for c, spread in zip(POSITIONS, np.ptp(places, axis=0)) if c not in declared and spread > _SAME_PLACE]
    letters = "".join(c[0] for c in declared if c in ROTATIONS)
    # core axes -> the file's: the same quarter turn as for vectors, on the quaternion's vector part
    angles = compute_euler_degrees(turn[:, (0, 1, 3, 2)] * (1.0, 1.0, 1.0, -1.0), letters)
    if np.abs(angles[:, len(letters) :]).max(initial=0.0) > _SAME_ANGLE:
        missing += [axis + "rotation" for axis in "ZXY" if axis not in letters]
    channels = declared + tuple(missing)
    order = [c[0] for c in channels if c in ROTATIONS]
    frames = len(turn)
    columns = [
        np.broadcast_to(places[:, "XYZ".index(c[0])], frames) if c in POSITIONS else angles[:, order.index(c[0])]
        for c in channels
    ]
    offset = places[0] if len(places) == 1 else np.where([c in channels for c in POSITIONS], 0.0, places[0])
    columns = np.stack(columns, axis=1) if columns else np.zeros((frames, 0))
    return _Joint(name=name, depth=depth, offset=offset, channels=channels, columns=columns, ends=_to_file_axes(ends),
                  added=tuple(missing))


def _iter_depth_first(skeleton: Skeleton) -> Iterator[tuple[int, int]]:
    """Iterate over joints in the order BVH nests them, with their depth; a skeleton that was read keeps its order."""
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            children[parent].append(joint)
    waiting = [(0, 0)]
    while waiting:
        joint, depth = waiting.pop()
        yield joint, depth
        waiting += [(child, depth + 1) for child in reversed(children[joint])]


def _compute_chain(motion: Motion, above: tuple[JointAboveHips, ...]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Compute positions (T, 3) and rotations (T, 4) in the world frame of the joints above the hips, after the world's
    own.

    The topmost moving joint is placed below the hips with the body's heading; the others keep their places on it.
    """
    frames = len(motion)
    worlds = [(np.zeros((frames, 3)), quaternion.identity(frames))]
    moving = next((joint for joint in above if joint.is_moving), None)
    for joint in above:
        place, turn = worlds[-1]
        if joint is moving:
            body_heading = quaternion.from_up_angle(compute_heading(motion) + joint.heading)
            ground = motion.root_positions * (1.0, 1.0, 0.0)
            if joint.hip_offset is not None:
                ground = motion.root_positions - quaternion.rotate(body_heading, joint.hip_offset)
            worlds.append((ground, body_heading))
        else:
            worlds.append((place + quaternion.rotate(turn, joint.position), quaternion.multiply(turn, joint.rotation)))
    return worlds


def _to_parent_frame(world, parent) -> tuple[np.ndarray, np.ndarray]:
    """Convert a position and rotation in the world frame, (T, 3) and (T, 4), to a parent's frame."""
    inverse = quaternion.inverse(parent[1])
    return quaternion.rotate(inverse, world[0] - parent[0]), quaternion.multiply(inverse, world[1])


def _build_joints_above(motion: Motion, above: tuple[JointAboveHips, ...]) -> list[_Joint]:
    """Build the joints above the hips."""
    worlds, out = _compute_chain(motion, above) if above else [], []
    for depth, (joint, parent, world) in enumerate(zip(above, worlds, worlds[1:])):
        place, turn = _to_parent_frame(world, parent)
        place = place if joint.is_moving else joint.position[None]
        out.append(_build_joint(joint.name, depth, joint.channels, place=place, turn=turn, ends=np.zeros((0, 3))))
    return out


def _compute_hips(motion: Motion, above: tuple[JointAboveHips, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Compute the hips' positions (T, 3) and rotations (T, 4) relative to the joints above them."""
    hips = (motion.root_positions, motion.rotations[:, 0])
    return _to_parent_frame(hips, _compute_chain(motion, above)[-1]) if above else hips


def _iter_head(joints: list[_Joint], count: int, fps: float) -> Iterator[str]:
    """Iterate over the pieces of the file before its rows."""
    yield "HIERARCHY\n"
    for joint, depth_after in zip(joints, [j.depth for j in joints[1:]] + [0]):
        yield from _iter_joint_text(joint)
        for depth in range(joint.depth, depth_after - 1, -1):
            yield "\t" * depth + "}\n"
    yield f"MOTION\nFrames: {count}\nFrame Time: {1.0 / fps:.10g}\n"


def _iter_rows(joints: list[_Joint]) -> Iterator[str]:
    """Iterate over the rows of the file."""
    values = np.concatenate([joint.columns for joint in joints], axis=1)
    row = " ".join(["%.6f"] * values.shape[1]) + "\n"
    # adding 0 turns the -0.0 that rounding leaves into 0.0
    yield from (row % tuple(frame) for frame in (np.round(values, 6) + 0.0).tolist())


def _iter_joint_text(joint: _Joint) -> Iterator[str]:
    """Iterate over a joint's lines; its bracket stays open."""
    tabs = "\t" * joint.depth
    yield f"{tabs}{'JOINT' if joint.depth else 'ROOT'} {joint.name}\n{tabs}{{\n{tabs}\t{_format_offset(joint.offset)}"
    yield f"{tabs}\tCHANNELS {' '.join([str(len(joint.channels)), *joint.channels])}\n"
    for end in joint.ends:
        yield f"{tabs}\tEnd Site\n{tabs}\t{{\n{tabs}\t\t{_format_offset(end)}{tabs}\t}}\n"


def _format_offset(vector: np.ndarray) -> str:
    return "OFFSET %.6f %.6f %.6f\n" % tuple(np.round(vector, 6) + 0.0)
