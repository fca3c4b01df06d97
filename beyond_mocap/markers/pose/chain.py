"""The chain of joints that carries the markers, and how its markers move with it (Fredriksson §3.5.2, §5.3.1).

A pose is the place of the root and one rotation a joint (eq. 3.18). The paper writes rotations as Euler angles
(eq. 3.19), which have poles: whatever the order, two of the directions that a thrower's upper arm passes lie on one
line with the pole, and there the angles run away though the arm does not. So a joint that is free to turn all ways is
kept as a quaternion and moved by small rotation vectors, which have no pole; its angles are read only where limits ask
for them (`limits`). A joint with one or two free angles (a hinge) has no pole and is kept as these angles.

A small step of a pose is, for each joint, a turn about three axes through the joint (the parent's axes for a free
joint, those of its angles for a hinge; an axis that is not free counts nothing), and for the root also a shift. All
points below a joint follow as a rigid body, so that the derivative of a marker at x by a turn about axis a through p
is a x (x - p): no other formula is needed, and the equations of a step are solved from the tips to the root
(`elimination`).

Arrays run over F frames in their last axis: numpy then works on long runs, whatever library lies behind it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.skeleton import Skeleton

AXES = {"X": 0, "Y": 1, "Z": 2}
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])[:, None]  # times a quaternion (..., 4, F): its inverse


@dataclass(frozen=True, eq=False, kw_only=True)
class Chain:
    """J joints, M markers on them, and what each joint may do.

    joint: (M,) which joint carries the marker. places: (M, 3) m in its frame. order: J orders of intrinsic angles,
    permutations of XYZ. free: (J, 3) bool by place in the order; an angle that is not free stays 0. low, high: (J, 3)
    rad, -inf and inf where there is no limit, 0 where not free. stiffness: (J, 3) m per radian, how strongly a
    joint is drawn to its rest pose: a radian away counts as much as a marker so many metres off."""

    skeleton: Skeleton
    joint: np.ndarray
    places: np.ndarray
    order: tuple[str, ...]
    free: np.ndarray
    low: np.ndarray
    high: np.ndarray
    stiffness: np.ndarray

    @cached_property
    def turning(self) -> tuple[bool, ...]:
        """Per joint, whether it turns all ways (kept as a quaternion)."""
        return tuple(bool(all(row)) for row in self.free)

    @cached_property
    def hinges(self) -> tuple[int, ...]:
        """The joints with fewer free angles (kept as angles)."""
        return tuple(joint for joint, all_ways in enumerate(self.turning) if not all_ways)

    @cached_property
    def clusters(self) -> tuple[tuple[int, np.ndarray], ...]:
        """Each joint that carries markers, and which."""
        return tuple((int(joint), np.flatnonzero(self.joint == joint)) for joint in np.unique(self.joint))

    @cached_property
    def runs(self) -> tuple[tuple[int, ...], ...]:
        """Runs of joints down to one that carries markers, those before it without any: markers tell only what they do
        together, as of a lumbar spine between pelvis and thorax."""
        marked, found = set(self.joint.tolist()), []
        for joint in sorted(marked):
            run = [joint]
            while (above := self.skeleton.parents[run[0]]) > 0 and above not in marked:
                run.insert(0, above)
            if len(run) > 1 and all(self.turning[one] for one in run):
                found.append(tuple(run))
        used = [joint for run in found for joint in run]
        return tuple(run for run in found if all(used.count(joint) == 1 for joint in run))

    def without_limits(self) -> "Chain":
        """The same chain with joints that turn as far as they like."""
        return replace(self, low=np.where(self.free, -np.inf, 0.0), high=np.where(self.free, np.inf, 0.0))


def chain(skeleton: Skeleton, joint, places, order=None, free=None, low=None, high=None, stiffness=None) -> Chain:
    """A chain of these arrays (see `Chain`), whatever is None free of limits and of stiffness. InputError where shapes
    do not fit."""
    count = len(skeleton)
    joint, places = np.asarray(joint, dtype=int), np.asarray(places, dtype=float)
    if places.shape != (*joint.shape, 3) or joint.ndim != 1 or np.any((joint < 0) | (joint >= count)):
        found = f"joints {joint.shape}, places {places.shape}"
        raise InputError("marker model", found, "(M,) joint indices and (M, 3)")
    order = ("XYZ",) * count if order is None else tuple(order)
    if len(order) != count or any(sorted(one) != ["X", "Y", "Z"] for one in order):
        raise InputError("marker model", f"axis orders {order}", f"{count} permutations of XYZ")
    free = np.broadcast_to(True if free is None else np.asarray(free, dtype=bool), (count, 3))
    stiff = np.zeros(count) if stiffness is None else np.asarray(stiffness, dtype=float)
    return Chain(skeleton=skeleton, joint=joint, places=places, order=order, free=free,
                 low=np.where(free, -np.inf if low is None else low, 0.0),
                 high=np.where(free, np.inf if high is None else high, 0.0),
                 stiffness=np.broadcast_to(stiff[:, None] if stiff.ndim == 1 else stiff, (count, 3)))


@dataclass(frozen=True, eq=False)
class Poses:
    """F poses of a chain. root: (3, F) m, world. local: (J, 4, F) unit quaternions relative to the parent (the root's
    to the world). angles: (J, 3, F) rad, of hinges; 0 for the other joints."""

    root: np.ndarray
    local: np.ndarray
    angles: np.ndarray

    def frames(self, chosen) -> "Poses":
        """These frames (indices, a mask or a slice) only."""
        return Poses(self.root[:, chosen], self.local[..., chosen], self.angles[..., chosen])

    def put(self, chosen, other: "Poses") -> None:
        """Write another's frames over these ones, in place."""
        self.root[:, chosen], self.local[..., chosen], self.angles[..., chosen] = other.root, other.local, other.angles

    def copy(self) -> "Poses":
        """Poses of their own arrays."""
        return Poses(self.root.copy(), self.local.copy(), self.angles.copy())


@dataclass(frozen=True, eq=False)
class Placed:
    """Where a pose puts things. world: (J, 3, 3, F) rotations. joints: (J, 3, F), markers: (M, 3, F) m, relative to
    `origin` (3, F) m, which is the root: far from the capture space's origin no digits are lost."""

    origin: np.ndarray
    world: np.ndarray
    joints: np.ndarray
    markers: np.ndarray


def poses(chain: Chain, root: np.ndarray, local: np.ndarray) -> Poses:
    """Poses from root places (F, 3) m and local rotations (F, J, 4); hinges keep their free angles only, within their
    limits."""
    rotations = np.ascontiguousarray(np.moveaxis(quaternion.normalized(local), 0, -1))
    angles = np.zeros((len(chain.skeleton), 3, len(root)))
    for joint in chain.hinges:
        angles[joint] = within(chain, joint, angles_of(chain, joint, rotations[joint]))
        rotations[joint] = quaternion.from_euler(angles[joint].T, chain.order[joint]).T
    return Poses(np.ascontiguousarray(np.asarray(root, dtype=float).T), rotations, angles)


def within(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """A joint's angles (3, F) rad brought within its limits."""
    return np.clip(angles, chain.low[joint][:, None], chain.high[joint][:, None])


def angles_of(chain: Chain, joint: int, local: np.ndarray) -> np.ndarray:
    """Angles (3, F) rad of a joint's rotations (4, F): of both triples the one within the limits, or nearer to them."""
    one = quaternion.to_euler(local.T, chain.order[joint]).T
    other = np.stack([one[0] + np.pi, np.pi - one[1], one[2] + np.pi])
    one, other = (_near_the_middle(chain, joint, angles) for angles in (one, other))
    better = _offence(chain, joint, other) < _offence(chain, joint, one) - 1e-9
    return np.where(better, other, one)


def _near_the_middle(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """Angles without the full turns that separate them from the middle of their limits."""
    low, high = chain.low[joint], chain.high[joint]
    bound = np.isfinite(low) & np.isfinite(high)
    middle = np.where(bound, 0.5 * (np.where(bound, low, 0.0) + np.where(bound, high, 0.0)), 0.0)[:, None]
    return middle + quaternion.wrapped(angles - middle)


def _offence(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """By how many radians (F,) angles (3, F) leave the limits, all together."""
    return np.abs(angles - within(chain, joint, angles)).sum(axis=0)


def matrices(q: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3, F) of unit quaternions (..., 4, F)."""
    w, x, y, z = (q[..., component, :] for component in range(4))
    out = np.empty((*q.shape[:-2], 3, 3, q.shape[-1]))
    out[..., 0, 0, :], out[..., 1, 1, :] = 1 - 2 * (y * y + z * z), 1 - 2 * (x * x + z * z)
    out[..., 2, 2, :] = 1 - 2 * (x * x + y * y)
    out[..., 0, 1, :], out[..., 1, 0, :] = 2 * (x * y - w * z), 2 * (x * y + w * z)
    out[..., 0, 2, :], out[..., 2, 0, :] = 2 * (x * z + w * y), 2 * (x * z - w * y)
    out[..., 1, 2, :], out[..., 2, 1, :] = 2 * (y * z - w * x), 2 * (y * z + w * x)
    return out


def place(chain: Chain, at: Poses) -> Placed:
    """Forward kinematics (eq. 3.18): where joints and markers stand."""
    turns = matrices(at.local)
    world, joints = np.empty_like(turns), np.zeros((len(turns), 3, turns.shape[-1]))
    for joint, parent in enumerate(chain.skeleton.parents):
        if parent < 0:
            world[joint] = turns[joint]
            continue
        np.einsum("abf,bcf->acf", world[parent], turns[joint], out=world[joint])
        joints[joint] = joints[parent] + np.einsum("abf,b->af", world[parent], chain.skeleton.offsets[joint])
    markers = np.empty((len(chain.joint), 3, turns.shape[-1]))
    for joint, own in chain.clusters:
        markers[own] = np.einsum("abf,nb->naf", world[joint], chain.places[own]) + joints[joint]
    return Placed(at.root, world, joints, markers)


def axes(chain: Chain, at: Poses, placed: Placed) -> np.ndarray:
    """The world axes (J, 3, 3, F) about which a step turns each joint: [joint, component, axis]; 0 where not free."""
    out = np.empty_like(placed.world)
    for joint, parent in enumerate(chain.skeleton.parents):
        above = np.eye(3)[:, :, None] if parent < 0 else placed.world[parent]
        if chain.turning[joint]:
            out[joint] = above
        else:
            own = own_axes(chain, joint, at.angles[joint])
            np.einsum("abf,bcf->acf", np.broadcast_to(above, own.shape), own, out=out[joint])
    return out


def own_axes(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """The axes of a hinge's angles (3, F) in its parent's frame: (3 components, 3 angles, F); zero where not free."""
    out = np.zeros((3, 3, angles.shape[-1]))
    turned = np.broadcast_to(np.eye(3)[:, :, None], out.shape)
    for angle, letter in enumerate(chain.order[joint]):
        if chain.free[joint, angle]:
            out[:, angle] = turned[:, AXES[letter]]
        one = np.zeros((4, angles.shape[-1]))
        one[0], one[1 + AXES[letter]] = np.cos(0.5 * angles[angle]), np.sin(0.5 * angles[angle])
        turned = np.einsum("abf,bcf->acf", turned, matrices(one))
    return out


def moved(chain: Chain, at: Poses, shift: np.ndarray, turns: np.ndarray) -> Poses:
    """Poses a step further: the root shifted by (3, F) m, joints turned by (J, 3, F) rad about their `axes`."""
    local = multiply(exponential(turns), at.local)
    angles = at.angles.copy()
    for joint in chain.hinges:
        angles[joint] = within(chain, joint, at.angles[joint] + turns[joint])
        local[joint] = quaternion.from_euler(angles[joint].T, chain.order[joint]).T
    return Poses(at.root + shift, local, angles)


def exponential(v: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4, F) of rotation vectors (..., 3, F) rad."""
    square = np.einsum("...af,...af->...f", v, v)
    angle = np.sqrt(square)
    out = np.empty((*v.shape[:-2], 4, v.shape[-1]))
    out[..., 0, :] = np.cos(0.5 * angle)
    scale = np.where(angle > 1e-6, np.sin(0.5 * angle) / np.maximum(angle, 1e-6), 0.5 - square / 48.0)
    out[..., 1:, :] = scale[..., None, :] * v
    return out


def logarithm(q: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3, F) rad, on the short way, of unit quaternions (..., 4, F)."""
    return np.moveaxis(quaternion.to_rotation_vector(np.moveaxis(q, -2, -1)), -1, -2)


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotations b followed by a, made unit again: (..., 4, F) each."""
    aw, ax, ay, az = (a[..., component, :] for component in range(4))
    bw, bx, by, bz = (b[..., component, :] for component in range(4))
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0, :] = aw * bw - ax * bx - ay * by - az * bz
    out[..., 1, :] = aw * bx + ax * bw + ay * bz - az * by
    out[..., 2, :] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 3, :] = aw * bz + ax * by - ay * bx + az * bw
    return out / np.sqrt(np.einsum("...af,...af->...f", out, out))[..., None, :]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products along the first axis: (3, ...) each."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[y] * b[z], a[z] * b[y], out=out[x])
    return out


def marker_derivative(chain: Chain, at: Poses) -> np.ndarray:
    """How all markers move with the pose: (F, M, 3, 3 + 3 J), by the root's shift and each joint's three turns.

    The whole matrix, for those who want to look at it; the solver never builds it."""
    placed = place(chain, at)
    about = axes(chain, at, placed)
    count, frames = len(chain.skeleton), at.root.shape[-1]
    out = np.zeros((len(chain.joint), 3, 3 + 3 * count, frames))
    out[:, :, :3] = np.eye(3)[:, :, None]
    for marker, joint in enumerate(chain.joint):
        while joint >= 0:
            arm = placed.markers[marker] - placed.joints[joint]
            out[marker, :, 3 + 3 * joint : 6 + 3 * joint] = cross(about[joint], arm[:, None])
            joint = chain.skeleton.parents[joint]
    return np.moveaxis(out, -1, 0)
