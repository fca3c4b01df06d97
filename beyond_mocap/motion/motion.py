"""A motion: one skeleton moving; with forward kinematics, sampling and placing.

`Motion` is frozen and its arrays are read-only; every function returns a new one.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..base.errors import InputError
from ..base.vectors import dot_products
from . import quaternion
from .skeleton import Skeleton, freeze_array

RATE_TOLERANCE = 0.15
"""Share by which a motion may be played faster or slower than recorded and still look as recorded."""
ACCEPTED_RATES = (1.0 - RATE_TOLERANCE, 1.0 + RATE_TOLERANCE)
"""Lowest and highest playback rate (played over recorded speed) that looks as recorded."""
_PLUS, _MINUS = np.add, np.subtract
_FEW_FRAMES, _SOME_JOINTS = 100, 8
"""Frames up to which, and joints from which on a pose is computed by depth: there the calls take longer than what they
compute."""
_PRODUCT_ORDER = [[1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]]
_PRODUCT_SIGNS = np.array([[-1.0, 1.0, -1.0, 1.0], [-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])[..., None]
"""Of the right quaternion's components, those that the left one's x, y and z are multiplied with, and their signs."""
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]
_AHEAD, _BEHIND = [2, 3, 1], [3, 1, 2]
"""The cyclic orders of a vector's axes in a cross product, and the same of a quaternion's."""
_SLERP_FRAMES = 128
_CUBIC_REACH = 8
"""Frames to either side on which a value between two frames depends; a spline's memory fades by 0.27 a frame."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A skeleton's movement (Faustino §2.3.1 eq. 4).

    Attributes:
        skeleton: J joints.
        root_positions: (T, 3) metres, world, Z up.
        rotations: (T, J, 4) unit quaternions, each relative to its parent (the root's to the world), sign-continuous
            over time.
        fps: frames per second.
    """

    skeleton: Skeleton
    root_positions: np.ndarray
    rotations: np.ndarray
    fps: float

    def __post_init__(self):
        root = freeze_array(self.root_positions)
        rotations = quaternion.unify_signs(_normalize_rotations(self.rotations))
        rotations.setflags(write=False)
        if root.ndim != 2 or root.shape[1] != 3 or rotations.shape != (len(root), len(self.skeleton), 4):
            raise InputError(
                "motion", f"root {root.shape}, rotations {rotations.shape}", f"(T, 3) and (T, {len(self.skeleton)}, 4)"
            )
        if not self.fps > 0:
            raise InputError("motion", f"{self.fps} frames per second", "a positive rate")
        object.__setattr__(self, "root_positions", root)
        object.__setattr__(self, "rotations", rotations)
        object.__setattr__(self, "fps", float(self.fps))

    @classmethod
    def from_stored(cls, skeleton: Skeleton, root_positions: np.ndarray, rotations: np.ndarray, fps: float) -> "Motion":
        """Build a motion of the arrays that a motion had before, without looking at them or copying them.

        So a motion can lie in a file that is mapped into memory, and only the frames that are used are read.

        Args:
            skeleton: J joints.
            root_positions: (T, 3), read-only.
            rotations: (T, J, 4), read-only.
            fps: frames per second.
        """
        motion = object.__new__(cls)
        fields = {"skeleton": skeleton, "root_positions": root_positions, "rotations": rotations, "fps": float(fps)}
        vars(motion).update(fields)
        return motion

    def __len__(self) -> int:
        return len(self.root_positions)

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last."""
        return (len(self) - 1) / self.fps

    def frames(self, start: int, stop: int) -> "Motion":
        """Return frames start .. stop-1 as a motion."""
        root, rotations = (freeze_array(values[start:stop]) for values in (self.root_positions, self.rotations))
        return Motion.from_stored(self.skeleton, root, rotations, self.fps)  # a part of what is in order is in order


def _normalize_rotations(q: np.ndarray) -> np.ndarray:
    """Normalize quaternions, but leave each unit one as it is: dividing again would change its last bits at every copy.
    """
    q = np.asarray(q, dtype=float)
    is_other = ~(np.abs(dot_products(q, q) - 1.0) < 1e-12)
    if not is_other.any():
        return q
    out = q.copy()
    out[is_other] = quaternion.normalize(q[is_other])
    return out


def forward_kinematics(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Compute world positions (T, J, 3) in metres and world rotations (T, J, 4) of all joints."""
    return compute_pose(motion.skeleton, motion.root_positions, motion.rotations)


def compute_pose(
    skeleton: Skeleton, root: np.ndarray, local: np.ndarray, joints: Collection[int] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Compute world positions and rotations of poses.

    Args:
        skeleton: J joints.
        root: (..., 3) root positions, metres, world.
        local: (..., J, 4) local rotations.
        joints: that are computed, with each all that are above it; None: all.
    Returns:
        Positions (..., J, 3) in metres and rotations (..., J, 4), world; NaN for joints that are not computed.
    """
    lead = local.shape[:-2]
    flat = np.ascontiguousarray(local.reshape(-1, len(skeleton), 4).transpose(1, 2, 0))
    world, places = np.empty_like(flat), np.empty((len(skeleton), 3, flat.shape[2]))
    if joints is not None:
        world[:], places[:] = np.nan, np.nan
    world[0], places[0] = flat[0], root.reshape(-1, 3).T
    chosen = tuple(range(1, len(skeleton)) if joints is None else sorted({*joints} - {0}))
    is_short = flat.shape[2] <= _FEW_FRAMES and len(chosen) >= _SOME_JOINTS
    pose = _pose_by_depth if is_short else _pose_by_joint
    pose(skeleton, flat, world, places, joints=chosen)
    return (
        places.transpose(2, 0, 1).reshape(*lead, len(skeleton), 3),
        world.transpose(2, 0, 1).reshape(*lead, len(skeleton), 4),
    )


def _pose_by_joint(skeleton: Skeleton, flat: np.ndarray, world: np.ndarray, places: np.ndarray, *,
                   joints: Sequence[int]) -> None:
    """Fill in rotations (J, 4, T) and positions (J, 3, T) m joint by joint: what it works on stays in the cache.

    Args:
        skeleton: J joints.
        flat: (J, 4, T) local rotations.
        world, places: those of the root are there, those of `joints` are written.
        joints: ascending, without the root.
    """
    spare, turned = np.empty(flat.shape[2]), np.empty((3, flat.shape[2]))
    for joint in joints:
        parent, offset = skeleton.parents[joint], skeleton.offsets[joint]
        aw, ax, ay, az = world[parent]
        bw, bx, by, bz = flat[joint]
        # the quaternion product parent x local, written out by component
        w, x, y, z = np.multiply(aw, flat[joint], world[joint])
        _add_products(w, spare, (_MINUS, ax, bx), (_MINUS, ay, by), (_MINUS, az, bz))
        _add_products(x, spare, (_PLUS, ax, bw), (_PLUS, ay, bz), (_MINUS, az, by))
        _add_products(y, spare, (_MINUS, ax, bz), (_PLUS, ay, bw), (_PLUS, az, bx))
        _add_products(z, spare, (_PLUS, ax, by), (_MINUS, ay, bx), (_PLUS, az, bw))
        # and the offset v, rotated by the parent: v + w t + (x, y, z) x t, where t is twice (x, y, z) x v
        vx, vy, vz = offset.tolist()
        for t, first, second in zip(turned, ((ay, vz), (az, vx), (ax, vy)), ((az, vy), (ax, vz), (ay, vx))):
            np.multiply(*first, t)
            _add_products(t, spare, (_MINUS, *second))
        turned *= 2
        tx, ty, tz = turned
        places[joint] = offset[:, None]
        _add_products(places[joint, 0], spare, (_PLUS, aw, tx), (_PLUS, ay, tz), (_MINUS, az, ty))
        _add_products(places[joint, 1], spare, (_PLUS, aw, ty), (_PLUS, az, tx), (_MINUS, ax, tz))
        _add_products(places[joint, 2], spare, (_PLUS, aw, tz), (_PLUS, ax, ty), (_MINUS, ay, tx))
        np.add(places[joint], places[parent], places[joint])  # += would also copy the sum onto itself


def _pose_by_depth(skeleton: Skeleton, flat: np.ndarray, world: np.ndarray, places: np.ndarray, *,
                   joints: tuple[int, ...]) -> None:
    """Do the same, to the bit, for all joints of one depth at once: of few frames, the calls are what takes time."""
    levels = _group_by_depth(skeleton.parents, joints)
    signed = flat[:, _PRODUCT_ORDER] * _PRODUCT_SIGNS
    for level, above in levels:
        parent = world[above][:, :, None]
        product = parent[:, 0] * flat[level]
        for axis in range(3):
            product += parent[:, 1 + axis] * signed[level, axis]
        world[level] = product
    rows = list(joints)
    parent, offset = world[[skeleton.parents[joint] for joint in rows]], skeleton.offsets[rows][:, :, None]
    ahead, behind = parent[:, _AHEAD], parent[:, _BEHIND]
    turned = (ahead * offset[:, _LAST] - behind * offset[:, _NEXT]) * 2
    moved = parent[:, :1] * turned
    moved += offset
    moved += ahead * turned[:, _LAST]
    moved -= behind * turned[:, _NEXT]
    places[rows] = moved
    for level, above in levels:
        places[level] += places[above]


@lru_cache(maxsize=256)
def _group_by_depth(parents: tuple[int, ...], joints: tuple[int, ...]) -> list[tuple[list[int], list[int]]]:
    """Group joints by their depth below the root: (joints, their parents) of each, from the top down."""
    depth, groups = {0: 0}, {}
    for joint in joints:
        depth[joint] = depth[parents[joint]] + 1
        groups.setdefault(depth[joint], []).append(joint)
    return [(level, [parents[joint] for joint in level]) for _, level in sorted(groups.items())]


def _add_products(out: np.ndarray, spare: np.ndarray, *terms: tuple) -> None:
    """Add products to `out` (T,), one after the other.

    Args:
        out, spare: (T,), both overwritten.
        terms: _PLUS or _MINUS, and what is multiplied.
    """
    for combine, a, b in terms:
        combine(out, np.multiply(a, b, spare), out)


def compute_local_rotations(skeleton: Skeleton, world: np.ndarray) -> np.ndarray:
    """Compute each joint's rotation relative to its parent's.

    Args:
        skeleton: J joints, the root first.
        world: (..., J, 4) world rotations.
    Returns:
        (..., J, 4) local rotations.
    """
    local, parents = world.copy(), list(skeleton.parents[1:])
    local[..., 1:, :] = quaternion.multiply(quaternion.inverse(world[..., parents, :]), world[..., 1:, :])
    return local


def compute_world_rotation(skeleton: Skeleton, local: np.ndarray, joint: int) -> np.ndarray:
    """Compute the world rotation (T, 4) of one joint from local rotations (T, J, 4)."""
    world = local[:, joint]
    while (joint := skeleton.parents[joint]) >= 0:
        world = quaternion.multiply(local[:, joint], world)
    return world


def compute_end_positions(motion: Motion) -> np.ndarray:
    """Compute the world positions (T, E, 3) in metres of the skeleton's tips (BVH End Sites)."""
    positions, rotations = forward_kinematics(motion)
    parents = list(motion.skeleton.end_parents)
    return positions[:, parents] + quaternion.rotate(rotations[:, parents], motion.skeleton.end_offsets)


def sample_frames(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sample a motion at fractional frames: positions linear, rotations slerped.

    Args:
        motion: T frames.
        frames: (N,) fractional frames, clamped to the motion.
    Returns:
        Root positions (N, 3) in metres and local rotations (N, J, 4).
    Source: Faustino 2016, section 3.3.2.
    """
    frames = np.clip(np.asarray(frames, dtype=float), 0.0, len(motion) - 1)
    low = np.minimum(np.floor(frames).astype(int), max(len(motion) - 2, 0))
    high = np.minimum(low + 1, len(motion) - 1)
    weight = frames - low
    root = motion.root_positions[low] * (1.0 - weight[:, None]) + motion.root_positions[high] * weight[:, None]
    if not np.any(weight):
        return root, motion.rotations[low].copy()
    return root, quaternion.slerp(motion.rotations[low], motion.rotations[high], weight[:, None])


def sample_motions(motions: Sequence[Motion], groups: Sequence[np.ndarray], frames: np.ndarray,
                   skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Sample several motions of one skeleton together, to the bit as `sample_frames` does each, but faster where each
    shows a few frames.

    Args:
        motions: M motions.
        groups: the rows of `frames` that each of them shows, every row in one group.
        frames: (N,) fractional frames of the row's motion, clamped to it.
        skeleton: J joints, that of all motions.
    Returns:
        Root positions (N, 3) in metres and local rotations (N, J, 4).
    """
    count, last = len(frames), np.empty(len(frames), int)
    for motion, rows in zip(motions, groups, strict=True):
        last[rows] = len(motion) - 1
    frames = np.clip(np.asarray(frames, dtype=float), 0.0, last)
    low = np.minimum(np.floor(frames).astype(int), np.maximum(last - 1, 0))
    high, weight = np.minimum(low + 1, last), (frames - low)[:, None]
    roots, turns = np.empty((2, count, 3)), np.empty((2, count, len(skeleton), 4))
    is_between = np.zeros(count, bool)
    for motion, rows in zip(motions, groups):
        for root, turn, at in zip(roots, turns, (low[rows], high[rows])):
            root[rows], turn[rows] = motion.root_positions[at], motion.rotations[at]
        is_between[rows] = weight[rows].any()
    rotations = turns[0]
    for first in range(0, count, _SLERP_FRAMES):  # a few at a time stay in the processor's cache
        rows = np.arange(first, min(first + _SLERP_FRAMES, count))
        rows = rows[is_between[rows]]
        rotations[rows] = quaternion.slerp(rotations[rows], turns[1, rows], weight[rows])
    return roots[0] * (1.0 - weight) + roots[1] * weight, rotations


def sample_frames_cubic(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sample a motion at fractional frames on cubic splines through its frames.

    Linear steps (`sample_frames`) have a corner at every frame. Joints that rotate fast are followed much better by
    splines of their rotations than by splines of their positions: a hand that throws at 20 m/s, sampled 30 times a
    second, has its velocity within 1 %; by positions it would lose 10 %.

    Args:
        motion: T frames.
        frames: (N,) fractional frames, clamped to the motion.
    Returns:
        Root positions (N, 3) in metres and local rotations (N, J, 4).
    """
    from scipy.interpolate import CubicSpline

    frames = np.clip(np.asarray(frames, dtype=float), 0.0, len(motion) - 1)
    # a spline through the frames near the samples only: frames further away have no influence
    low = max(int(np.floor(frames.min())) - _CUBIC_REACH, 0)
    high = min(int(np.ceil(frames.max())) + _CUBIC_REACH, len(motion) - 1)
    if high == low:
        return motion.root_positions[[low] * len(frames)].copy(), motion.rotations[[low] * len(frames)].copy()
    near = slice(low, high + 1)
    rows = np.concatenate([motion.root_positions[near], motion.rotations[near].reshape(high + 1 - low, -1)], axis=1)
    found = CubicSpline(np.arange(low, high + 1), rows)(frames)
    return found[:, :3], quaternion.normalize(found[:, 3:].reshape(len(frames), -1, 4))


def resample(motion: Motion, fps: float) -> Motion:
    """Resample a motion to another rate: frame 0 stays, the last frame is the last one within the old duration.

    Args:
        motion: T frames.
        fps: frames per second of the result.
    Returns:
        The motion at that rate.
    """
    if abs(fps - motion.fps) < 1e-9:
        return motion
    count = int(np.floor(motion.duration * fps + 1e-6)) + 1
    root, rotations = sample_frames(motion, np.arange(count) * (motion.fps / fps))
    return Motion(motion.skeleton, root, rotations, fps)


def place_motion(motion: Motion, angle: float | np.ndarray = 0.0, offset=(0.0, 0.0, 0.0)) -> Motion:
    """Rotate a motion about the world's Z axis and move it.

    Args:
        motion: T frames.
        angle: radians, one or (T,).
        offset: (3,) or (T, 3) metres, added after the rotation.
    Returns:
        The placed motion.
    """
    rotation = quaternion.from_up_angle(np.broadcast_to(angle, (len(motion),)))
    rotations = motion.rotations.copy()
    rotations[:, 0] = quaternion.multiply(rotation, rotations[:, 0])
    return replace(motion, root_positions=quaternion.rotate(rotation, motion.root_positions) + offset,
                   rotations=rotations)


def concatenate_motions(motions: list[Motion]) -> Motion:
    """Concatenate motions of one skeleton and rate, of a frame or more each; nothing is aligned or blended."""
    first, start = motions[0], 0
    rotations = np.concatenate([motion.rotations for motion in motions])
    is_flipped = np.zeros(len(first.skeleton), bool)
    for before, motion in zip(motions, motions[1:]):  # each by itself is continuous
        start += len(before)
        is_flipped ^= dot_products(motion.rotations[0], before.rotations[-1]) < 0.0
        if is_flipped.any():
            rotations[start : start + len(motion), is_flipped] *= -1.0
    root = np.concatenate([motion.root_positions for motion in motions])
    for values in (root, rotations):
        values.setflags(write=False)
    return Motion.from_stored(first.skeleton, root, rotations, first.fps)
