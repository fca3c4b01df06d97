"""Read and write BVH (Faustino §4.2.1, App. B), and convert units, axes and Euler angles.

The core uses a `Motion`: metres, Z up, the hips as root, quaternions. What a file has beyond that (channel orders, a
root above the hips) is stored in a `BvhForm`, so that a motion can be written in the form of its source. Frames are
rigid: BVH's (X, Y, Z) with Y up is (X, -Z, Y) here, and rotations are conjugated by that quarter turn, so rest poses
stay unrotated. The format does not define the up axis and the unit; they are estimated from the body
(`estimate_scale`).

    clip = read_bvh("walk.bvh")
    write_bvh("mirrored.bvh", mirror(clip.motion), clip.form)
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError, format_count
from ...base.vectors import unit_vectors
from ...motion import quaternion
from ...motion.humanoid import Humanoid, compute_heading, identify_joints, measure_leg_length
from ...motion.motion import Motion, compute_pose
from ...motion.retargeting.structure import list_descendants
from ...motion.skeleton import Skeleton
from ..atomic import atomic_path
from . import bvh_text
from .bvh_ball import find_ball_joints, list_body_joints, read_ball_joint
from .bvh_channels import BvhChannels, compute_rotations, from_file_axes
from .bvh_text import POSITIONS, BvhText
from .bvh_write import STILL_METRES, BvhForm, JointAboveHips, format_bvh, iter_parts_text, measure_spread, moves

_LARGEST_METRES = 1e6  # larger positions are in a wrong unit or damaged
_NTSC = [rate * 1000 / 1001 for rate in (24, 30, 48, 60, 120, 240)]  # frames per second
_HIP_HEIGHT = (0.75, 1.15)  # metres, adults standing
_LEG_LENGTH = 0.88  # m, of an adult of 1.80 m
# centimetres, metres, inches, CMU's (1 inch / 0.45 in hundredths of it), millimetres, feet, decimetres
_USUAL_UNITS = (0.01, 1.0, 0.0254, 0.05644, 0.001, 0.3048, 0.1)
_UPRIGHT = np.cos(np.radians(35.0))  # smallest height of the unit vector from feet to head of an upright body
_SAMPLES = 64  # frames used for the estimate


@dataclass(frozen=True)
class BvhClip:
    """A file's motion, its form, and what the reader assumed or changed.

    Attributes:
        motion: the motion.
        form: what writing it back needs.
        notes: one line each.
        ball: (T, 3) m of a joint that is named as a ball, in the motion's world; None without one.
    """

    motion: Motion
    form: BvhForm
    notes: tuple[str, ...]
    ball: np.ndarray | None = None


def read_bvh(path, unit: float | None = None) -> BvhClip:
    """Read the clip of a BVH file.

    Position channels of any joint replace its OFFSET, as Bandai-Namco's and LAFAN1's files mean them; below the hips
    their mean becomes the bone, and the notes list joints that move by more than 1 mm. Joints above the hips are folded
    into the hips. A joint named as a ball is no part of the body (`bvh_ball`). Frame rates within 0.1 % of a whole
    number or an NTSC rate are rounded to it.

    Args:
        path: the file.
        unit: metres per file unit; None estimates it from the hip height and says so in the notes.
    Returns:
        The clip.
    Raises:
        InputError: if it is not a valid BVH file.
    """
    if unit is not None and not (np.isfinite(unit) and unit > 0):
        raise InputError("unit", str(unit), "metres per file unit, above 0", "0.01 for centimetres")
    text = bvh_text.read_bvh_text(path)
    scale = estimate_scale(text, unit)
    channels = BvhChannels(text, scale.unit, scale.up)
    hips = _find_root(text, scale.body)
    body_joints = list_body_joints(text, hips, scale.body)
    root, root_rotations, above = _fold_root(channels, hips)
    skeleton, drift = _build_skeleton(channels, body_joints)
    rotations = np.stack([root_rotations.T] + [channels.compute_rotation(joint) for joint in body_joints[1:]])
    _check_size(text, root, skeleton)
    motion = Motion(skeleton, root, rotations.transpose(2, 0, 1), _round_rate(text.frame_time))
    orders = {text.names[joint]: text.channels[joint] for joint in body_joints}
    form = BvhForm(orders, _measure_headings(channels, above, motion), scale.unit, scale.up)
    ball, ball_notes = read_ball_joint(channels, root, scale.body)
    notes = (*scale.notes, *_list_notes(text, scale.body, body_joints, above, drift), *ball_notes)
    return BvhClip(motion, form, notes, ball)


def write_bvh(path, motion: Motion, form: BvhForm | None = None) -> tuple[str, ...]:
    """Write a motion as BVH in centimetres with Y up.

    A joint that needs a channel missing in its form gets all channels of that kind. A root above the hips that did not
    move keeps its place; one that moved is placed on the ground below the hips (or at them, if they have no positions
    of their own) with the body's heading. The file is written to a temporary place and renamed.

    Args:
        path: the file.
        motion: the motion.
        form: channel orders and joints above the hips; None gives the root six channels (XYZ positions, ZXY rotations)
            and other joints three.
    Returns:
        Notes on what did not fit `form`.
    Raises:
        InputError: if the folder is not writable.
    """
    target = Path(path)
    if not target.name:
        raise InputError(path, "has no file name", "a BVH file to write")
    pieces, notes = format_bvh(motion, form or BvhForm())
    with atomic_path(target) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        file.writelines(pieces)
    return notes


def write_bvh_parts(path, parts: Iterable[Motion], count: int, form: BvhForm | None = None) -> None:
    """Write a motion that comes in parts as BVH, as `write_bvh` writes the whole.

    Args:
        path: the file.
        parts: of one skeleton and rate, in order.
        count: frames of all parts.
        form: as for `write_bvh`.
    Raises:
        InputError: if the folder is not writable.
    """
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        file.writelines(iter_parts_text(parts, count, form or BvhForm()))


class BvhRows:
    """Convert single rows of numbers of one hierarchy to poses, for rows that arrive one by one.

    Attributes:
        text: the hierarchy with a first row, from which unit and axes are estimated.
        scale: unit and up axis.
        hips: index of the root joint in the file.
        body_joints: indices of the joints from the hips down.
        skeleton: the body's skeleton, from the first row.
    """

    def __init__(self, text: BvhText, unit: float | None = None):
        self.text = text
        self.scale = estimate_scale(text, unit)
        channels = BvhChannels(text, self.scale.unit, self.scale.up)
        self.hips = _find_root(text, self.scale.body)
        self.body_joints = list_body_joints(text, self.hips, self.scale.body)
        self.skeleton = _build_skeleton(channels, self.body_joints)[0]

    def compute_poses(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Convert rows to poses.

        Args:
            values: (T, C) numbers in the file's order.
        Returns:
            Root positions (T, 3) m and local rotations (T, J, 4).
        """
        rows = replace(self.text, values=np.asarray(values, dtype=float))
        channels = BvhChannels(rows, self.scale.unit, self.scale.up)
        root, rotation, _ = _fold_root(channels, self.hips)
        rotations = np.stack([rotation.T] + [channels.compute_rotation(joint) for joint in self.body_joints[1:]])
        return root, rotations.transpose(2, 0, 1)


def _find_root(text: BvhText, body: Humanoid | None) -> int:
    """Find the joint that becomes the root: the hips if both legs are below them, else the file's root."""
    if body is None:
        return 0
    hanging = set(list_descendants(text.parents, body.hips))
    return body.hips if {body.left.upper_leg, body.right.upper_leg} <= hanging else 0


def _fold_root(channels: BvhChannels, hips: int) -> tuple[np.ndarray, np.ndarray, tuple[JointAboveHips, ...]]:
    """Compute the hips in the world frame, (T, 3) m and (T, 4), and list the joints above them."""
    frames, parents = len(channels.text.values), channels.text.parents
    position = np.broadcast_to(channels.compute_position(hips), (frames, 3))
    rotation = channels.compute_rotation(hips).T
    fixed = None if channels.find_columns(hips, POSITIONS) else position[0]
    above, joint = [], parents[hips]
    # Walk up to the file's root and accumulate the transforms.
    while joint >= 0:
        place, local_rotation = channels.compute_position(joint), channels.compute_rotation(joint).T
        position, rotation = quaternion.rotate(local_rotation, position) + place, quaternion.multiply(local_rotation,
                rotation)
        carries = fixed if joint == parents[hips] else None
        name, channel_names = channels.text.names[joint], channels.text.channels[joint]
        is_moving = moves(place, local_rotation)
        above.insert(0, JointAboveHips(name=name, channels=channel_names, is_moving=is_moving, position=place[0],
                                       rotation=local_rotation[0], hip_offset=carries))
        joint = parents[joint]
    return position, rotation, tuple(above)


def _build_skeleton(channels: BvhChannels, body_joints: list[int]) -> tuple[Skeleton, dict[str, float]]:
    """Build the skeleton with mean offsets; also return the distance (m) by which joints leave them, above 1 mm."""
    text, offsets, drift = channels.text, [np.zeros(3)], {}
    for joint in body_joints[1:]:
        places = channels.compute_position(joint)
        offsets.append(places.mean(axis=0))
        if measure_spread(places) > STILL_METRES:
            drift[text.names[joint]] = measure_spread(places)
    new_index = {old: i for i, old in enumerate(body_joints)}
    parents = [-1] + [new_index[text.parents[joint]] for joint in body_joints[1:]]
    ends = [(new_index[p], offset) for p, offset in zip(text.end_parents, text.end_offsets) if p in new_index]
    end_offsets = from_file_axes(np.array([offset for _, offset in ends]).reshape(-1, 3), channels.up)
    names = tuple(text.names[joint] for joint in body_joints)
    end_parents = tuple(parent for parent, _ in ends)
    return Skeleton(names, tuple(parents), np.array(offsets), end_parents, end_offsets * channels.unit), drift


def _check_size(text: BvhText, root: np.ndarray, skeleton: Skeleton) -> None:
    """Raise InputError if a position is beyond 1000 km."""
    too_far = np.flatnonzero(~(np.abs(root).max(axis=1) < _LARGEST_METRES))
    where = f"{text.path}:{text.first_row + too_far[0]}" if len(too_far) else text.path
    if len(too_far) or not np.abs(skeleton.offsets).max() < _LARGEST_METRES:
        raise InputError(where, "a position beyond 1000 km", "a person's motion", "set the unit, or export again")


def _measure_headings(channels: BvhChannels, above: tuple[JointAboveHips, ...], motion: Motion) -> tuple[JointAboveHips,
        ...]:
    """Add the mean angle from the body's heading to each moving joint above the hips."""
    if not any(joint.is_moving for joint in above):
        return above
    frames = np.unique(np.linspace(0, len(motion) - 1, 256).astype(int))
    sampled = Motion(motion.skeleton, motion.root_positions[frames], motion.rotations[frames], motion.fps)
    body_heading, rotation, out = compute_heading(sampled), quaternion.identity(len(frames)), []
    for joint in above:
        local = channels.compute_rotation(channels.text.names.index(joint.name))[:, frames].T
        rotation = quaternion.multiply(rotation, local)
        mean = np.angle(np.mean(np.exp(1j * (quaternion.to_yaw(rotation) - body_heading))))
        out.append(replace(joint, heading=float(mean)))
    return tuple(out)


def _round_rate(frame_time: float) -> float:
    """Compute frames per second, rounded to a whole number or an NTSC rate within 0.1 %."""
    rate = 1.0 / frame_time
    nearest = min([max(round(rate), 1), *_NTSC], key=lambda r: abs(r - rate))
    return float(nearest) if abs(nearest - rate) <= 1e-3 * nearest else rate


def _list_notes(text: BvhText, body: Humanoid | None, body_joints: list[int], above: tuple[JointAboveHips, ...],
                drift: dict[str, float]) -> list[str]:
    """List what reading changed, one line per kind."""
    notes = [f"joint {old!r} is repeated, the second is renamed {new!r}" for old, new in text.renamed]
    for joint in above:
        state = "moving" if joint.is_moving else "static"
        notes.append(f"{joint.name} ({state}) folded into {text.names[body_joints[0]]}")
    balls = {text.names[joint] for joint in find_ball_joints(text, body)}
    left_out = sorted(set(text.names) - {text.names[j] for j in body_joints} - {joint.name for joint in above} - balls)
    if left_out:
        notes.append(f"ignored, not part of the body: {', '.join(left_out)}")
    if drift:
        worst = sorted(drift, key=drift.get, reverse=True)
        moved = ", ".join(f"{name} {drift[name] * 1000:.0f} mm" for name in worst[:5])
        notes.append(f"{format_count(len(drift), 'joint')} with a changing distance, replaced by its mean: {moved}")
    return notes


@dataclass(frozen=True)
class FileScale:
    """Unit and axes of a file.

    Attributes:
        unit: metres per file unit.
        up: "Y" or "Z".
        body: the humanoid joints, None for other skeletons.
        notes: what was estimated, one line each.
    """

    unit: float
    up: str
    body: Humanoid | None
    notes: tuple[str, ...]


def estimate_scale(text: BvhText, unit: float | None) -> FileScale:
    """Estimate a file's up axis, and its unit if it is not set.

    Up is the axis, Y or Z, along which feet to head point (within 35 degrees) in more of 64 frames spread over the
    clip; the rest pose counts too, for clips mostly lying down. The unit is the usual one that puts the hips 0.75 to
    1.15 m above the feet, else the one with 0.88 m long legs. Without legs: centimetres, Y up.

    Args:
        text: the file's content.
        unit: metres per file unit, or None.
    Returns:
        Unit and axes.
    """
    rest = Skeleton(text.names, text.parents, from_file_axes(text.offsets, "Y"))
    try:
        body = identify_joints(rest)
    except InputError:
        origin = "set" if unit else "no legs found, centimetres assumed"
        return FileScale(unit or 0.01, "Y", None, (f"unit {unit or 0.01:g} m ({origin}), Y up assumed",))
    skeleton, positions = _sample_poses(text, rest)
    up = _detect_up_axis(body, positions, compute_pose(rest, np.zeros(3), quaternion.identity(len(rest)))[0])
    height = _measure_hip_height(skeleton, body, positions[..., 2] if up == "Y" else -positions[..., 1])
    estimated = unit or _estimate_unit(height, measure_leg_length(skeleton))
    origin = "set" if unit else "estimated"
    return FileScale(estimated, up, body,
                     (f"unit {estimated:.6g} m ({origin}): hips {height * estimated:.2f} m high; {up} up",))


def _sample_poses(text: BvhText, rest: Skeleton) -> tuple[Skeleton, np.ndarray]:
    """Sample poses: the skeleton with its posed offsets, and positions (N, J, 3) as if Y were up; file units."""
    rows = text.values[np.unique(np.linspace(0, len(text.values) - 1, _SAMPLES).astype(int))]
    offsets, rotations, first = np.array(text.offsets), np.empty((len(rest), 4, len(rows))), 0
    for joint, channels in enumerate(text.channels):
        columns = [(name, first + i) for i, name in enumerate(channels)]
        for name, column in columns:
            if name in POSITIONS:
                offsets[joint, POSITIONS.index(name)] = rows[:, column].mean()
        rotations[joint] = compute_rotations(rows, [(n[0], c) for n, c in columns if n not in POSITIONS], "Y")
        first += len(channels)
    skeleton = Skeleton(text.names, text.parents, from_file_axes(offsets, "Y"))
    positions, _ = compute_pose(skeleton, np.zeros((len(rows), 3)), rotations.transpose(2, 0, 1))
    return skeleton, positions


def _detect_up_axis(body: Humanoid, posed: np.ndarray, rest: np.ndarray) -> str:
    """Detect the up axis, "Y" or "Z", from posed (N, J, 3) and rest (J, 3) positions converted as if Y were up."""
    top = body.head_or_neck
    feet = [body.left.foot, body.right.foot]
    votes = {"Y": 0.0, "Z": 0.0}
    for positions, weight in ((posed, 1.0), (rest, 0.5)):
        rise = unit_vectors(positions[..., top, :] - positions[..., feet, :].mean(axis=-2))
        votes["Y"] += weight * np.mean(rise[..., 2] > _UPRIGHT)
        votes["Z"] += weight * np.mean(-rise[..., 1] > _UPRIGHT)
    return "Z" if votes["Z"] > votes["Y"] else "Y"


def _measure_hip_height(skeleton: Skeleton, body: Humanoid, heights: np.ndarray) -> float:
    """Measure the hips' height above the lower foot from heights (N, J), file units; at least the leg's length."""
    feet = [body.left.foot, body.right.foot, body.left.toe_or_foot, body.right.toe_or_foot]
    posed = np.percentile(heights[:, body.hips] - heights[:, feet].min(axis=1), 95)
    return float(max(posed, measure_leg_length(skeleton)))


def _estimate_unit(hip_height: float, leg: float) -> float:
    low, high = _HIP_HEIGHT
    for unit in _USUAL_UNITS:
        if low <= hip_height * unit <= high:
            return unit
    return _LEG_LENGTH / leg if leg > 1e-9 else 0.01
