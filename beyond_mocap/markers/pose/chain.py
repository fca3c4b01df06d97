"""The chain of joints that carries the markers, and how its markers move with it (Fredriksson sections 3.5.2 and
5.3.1).

A pose is the place of the root and one rotation for each joint (eq. 3.18). The paper writes rotations as Euler angles
(eq. 3.19), which have poles: in any order, two of the directions that a thrower's upper arm passes lie on one line with
the pole, and there the angles change fast though the arm does not. A joint that is free about all axes is therefore
stored as a quaternion and changed by small rotation vectors, which have no pole; its angles are read only where limits
need them (`limits`). A joint with one or two free angles (a hinge) has no pole and is stored as these angles.

A small step of a pose is, for each joint, a rotation about three axes through the joint (the parent's axes for a free
joint, those of its angles for a hinge; an axis that is not free has no effect), and a shift of the root. All points
below a joint follow as a rigid body, so the derivative of a marker at x by a rotation about axis a through p is a x (x
- p). No other formula is needed, and the equations of a step are solved from the tips to the root (`elimination`).

Arrays have F frames in their last axis, so that numpy works on long contiguous runs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.skeleton import Skeleton

AXES = {"X": 0, "Y": 1, "Z": 2}
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])[:, None]  # a quaternion (..., 4, F) times this is its inverse


@dataclass(frozen=True, eq=False, kw_only=True)
class Chain:
    """J joints, M markers on them, and how each joint may turn.

    Attributes:
        skeleton: the joints.
        joint: (M,) index of the joint that carries each marker.
        places: (M, 3) metres in that joint's frame.
        order: J orders of intrinsic angles, permutations of XYZ.
        free: (J, 3) bool, by position in the order; an angle that is not free stays 0.
        low: (J, 3) radians, -inf where there is no limit, 0 where not free.
        high: (J, 3) radians, inf where there is no limit, 0 where not free.
        stiffness: (J, 3) metres per radian, pull to the rest pose: a radian costs as much as a marker off by so many
            metres.
    """

    skeleton: Skeleton
    joint: np.ndarray
    places: np.ndarray
    order: tuple[str, ...]
    free: np.ndarray
    low: np.ndarray
    high: np.ndarray
    stiffness: np.ndarray

    @cached_property
    def is_fully_free(self) -> tuple[bool, ...]:
        """Whether each joint is free about all axes (stored as a quaternion)."""
        return tuple(bool(all(row)) for row in self.free)

    @cached_property
    def hinges(self) -> tuple[int, ...]:
        """The joints with fewer free angles (stored as angles)."""
        return tuple(joint for joint, all_ways in enumerate(self.is_fully_free) if not all_ways)

    @cached_property
    def clusters(self) -> tuple[tuple[int, np.ndarray], ...]:
        """Each joint that carries markers, with their indices."""
        return tuple((int(joint), np.flatnonzero(self.joint == joint)) for joint in np.unique(self.joint))

    @cached_property
    def runs(self) -> tuple[tuple[int, ...], ...]:
        """Runs of joints that end at one with markers, the others without: markers determine only their joint rotation.

        An example are the lumbar joints between pelvis and thorax.
        """
        marked, found = set(self.joint.tolist()), []
        for joint in sorted(marked):
            run = [joint]
            while (above := self.skeleton.parents[run[0]]) > 0 and above not in marked:
                run.insert(0, above)
            if len(run) > 1 and all(self.is_fully_free[member] for member in run):
                found.append(tuple(run))
        used = [joint for run in found for joint in run]
        return tuple(run for run in found if all(used.count(joint) == 1 for joint in run))

    def remove_limits(self) -> "Chain":
        """Return the same chain without joint limits."""
        return replace(self, low=np.where(self.free, -np.inf, 0.0), high=np.where(self.free, np.inf, 0.0))


def build_chain(skeleton: Skeleton, joint, places, order=None, free=None, low=None, high=None, stiffness=None) -> Chain:
    """Build a chain.

    Args:
        skeleton: J joints.
        joint, places, order, free, low, high: as the attributes of `Chain`; None for XYZ, all free and no limits.
        stiffness: (J,) or (J, 3) metres per radian; None for none.
    Returns:
        The chain.
    Raises:
        InputError: if shapes do not match.
    """
    count = len(skeleton)
    joint, places = np.asarray(joint, dtype=int), np.asarray(places, dtype=float)
    if places.shape != (*joint.shape, 3) or joint.ndim != 1 or np.any((joint < 0) | (joint >= count)):
        found = f"joints {joint.shape}, places {places.shape}"
        raise InputError("marker model", found, "(M,) joint indices and (M, 3)")
    order = ("XYZ",) * count if order is None else tuple(order)
    if len(order) != count or any(sorted(letters) != ["X", "Y", "Z"] for letters in order):
        raise InputError("marker model", f"axis orders {order}", f"{count} permutations of XYZ")
    free = np.broadcast_to(True if free is None else np.asarray(free, dtype=bool), (count, 3))
    stiff = np.zeros(count) if stiffness is None else np.asarray(stiffness, dtype=float)
    return Chain(skeleton=skeleton, joint=joint, places=places, order=order, free=free,
                 low=np.where(free, -np.inf if low is None else low, 0.0),
                 high=np.where(free, np.inf if high is None else high, 0.0),
                 stiffness=np.broadcast_to(stiff[:, None] if stiff.ndim == 1 else stiff, (count, 3)))


@dataclass(frozen=True, eq=False)
class Poses:
    """F poses of a chain.

    Attributes:
        root: (3, F) metres, world.
        local: (J, 4, F) unit quaternions relative to the parent (the root's to the world).
        angles: (J, 3, F) radians, of hinges; 0 for the other joints.
    """

    root: np.ndarray
    local: np.ndarray
    angles: np.ndarray

    def select_frames(self, chosen) -> "Poses":
        """Return the poses of these frames (indices, a mask or a slice)."""
        return Poses(self.root[:, chosen], self.local[..., chosen], self.angles[..., chosen])

    def overwrite_frames(self, chosen, other: "Poses") -> None:
        """Overwrite the frames `chosen` with other poses, in place."""
        self.root[:, chosen], self.local[..., chosen], self.angles[..., chosen] = other.root, other.local, other.angles

    def copy_arrays(self) -> "Poses":
        """Return poses with copied arrays."""
        return Poses(self.root.copy(), self.local.copy(), self.angles.copy())


@dataclass(frozen=True, eq=False)
class WorldPoses:
    """Joints and markers in the world.

    Places are relative to the root, so no digits are lost far from the origin of the capture space.

    Attributes:
        origin: (3, F) metres, the root.
        world: (J, 3, 3, F) rotation matrices.
        joints: (J, 3, F) metres, relative to `origin`.
        markers: (M, 3, F) metres, relative to `origin`.
    """

    origin: np.ndarray
    world: np.ndarray
    joints: np.ndarray
    markers: np.ndarray


def build_poses(chain: Chain, root: np.ndarray, local: np.ndarray) -> Poses:
    """Build poses from joint rotations; hinges keep their free angles only, within their limits.

    Args:
        chain: the chain.
        root: (F, 3) metres, world.
        local: (F, J, 4) rotations relative to the parent.
    Returns:
        The poses.
    """
    rotations = np.ascontiguousarray(np.moveaxis(quaternion.normalize(local), 0, -1))
    angles = np.zeros((len(chain.skeleton), 3, len(root)))
    for joint in chain.hinges:
        angles[joint] = limit_angles(chain, joint, read_angles(chain, joint, rotations[joint]))
        rotations[joint] = quaternion.from_euler(angles[joint].T, chain.order[joint]).T
    return Poses(np.ascontiguousarray(np.asarray(root, dtype=float).T), rotations, angles)


def limit_angles(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """Limit a joint's angles (3, F) radians to its range."""
    return np.clip(angles, chain.low[joint][:, None], chain.high[joint][:, None])


def read_angles(chain: Chain, joint: int, local: np.ndarray) -> np.ndarray:
    """Read the angles (3, F) radians of a joint's rotations (4, F).

    Two triples of angles describe each rotation; the one within the limits, or nearer to them, is returned.
    """
    one = quaternion.to_euler(local.T, chain.order[joint]).T
    # the second triple of angles of the same rotation
    other = np.stack([one[0] + np.pi, np.pi - one[1], one[2] + np.pi])
    one, other = (_unwrap_to_limits(chain, joint, angles) for angles in (one, other))
    better = _measure_excess(chain, joint, other) < _measure_excess(chain, joint, one) - 1e-9
    return np.where(better, other, one)


def _unwrap_to_limits(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """Remove full turns, so that the angles lie nearest to the middle of their limits."""
    low, high = chain.low[joint], chain.high[joint]
    is_limited = np.isfinite(low) & np.isfinite(high)
    middle = np.where(is_limited, 0.5 * (np.where(is_limited, low, 0.0) + np.where(is_limited, high, 0.0)), 0.0)[:,
            None]
    return middle + quaternion.wrap_angle(angles - middle)


def _measure_excess(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """Measure by how many radians (F,) angles (3, F) exceed the limits, in total."""
    return np.abs(angles - limit_angles(chain, joint, angles)).sum(axis=0)


def to_matrices(q: np.ndarray) -> np.ndarray:
    """Convert unit quaternions (..., 4, F) to rotation matrices (..., 3, 3, F)."""
    w, x, y, z = (q[..., component, :] for component in range(4))
    out = np.empty((*q.shape[:-2], 3, 3, q.shape[-1]))
    out[..., 0, 0, :], out[..., 1, 1, :] = 1 - 2 * (y * y + z * z), 1 - 2 * (x * x + z * z)
    out[..., 2, 2, :] = 1 - 2 * (x * x + y * y)
    out[..., 0, 1, :], out[..., 1, 0, :] = 2 * (x * y - w * z), 2 * (x * y + w * z)
    out[..., 0, 2, :], out[..., 2, 0, :] = 2 * (x * z + w * y), 2 * (x * z - w * y)
    out[..., 1, 2, :], out[..., 2, 1, :] = 2 * (y * z - w * x), 2 * (y * z + w * x)
    return out


def compute_world_poses(chain: Chain, poses: Poses) -> WorldPoses:
    """Compute joints and markers in the world: forward kinematics (eq. 3.18).

    Args:
        chain: the chain.
        poses: F poses.
    Returns:
        Joints and markers, relative to the root.
    """
    rotations = to_matrices(poses.local)
    world, joints = np.empty_like(rotations), np.zeros((len(rotations), 3, rotations.shape[-1]))
    for joint, parent in enumerate(chain.skeleton.parents):
        if parent < 0:
            world[joint] = rotations[joint]
            continue
        np.einsum("abf,bcf->acf", world[parent], rotations[joint], out=world[joint])
        joints[joint] = joints[parent] + np.einsum("abf,b->af", world[parent], chain.skeleton.offsets[joint])
    markers = np.empty((len(chain.joint), 3, rotations.shape[-1]))
    for joint, own in chain.clusters:
        markers[own] = np.einsum("abf,nb->naf", world[joint], chain.places[own]) + joints[joint]
    return WorldPoses(poses.root, world, joints, markers)


def compute_step_axes(chain: Chain, poses: Poses, placed: WorldPoses) -> np.ndarray:
    """Compute the world axes about which a step rotates each joint.

    Returns:
        (J, 3, 3, F), indexed [joint, component, axis]; 0 where an angle is not free.
    """
    out = np.empty_like(placed.world)
    for joint, parent in enumerate(chain.skeleton.parents):
        above = np.eye(3)[:, :, None] if parent < 0 else placed.world[parent]
        if chain.is_fully_free[joint]:
            out[joint] = above
        else:
            own = compute_hinge_axes(chain, joint, poses.angles[joint])
            np.einsum("abf,bcf->acf", np.broadcast_to(above, own.shape), own, out=out[joint])
    return out


def compute_hinge_axes(chain: Chain, joint: int, angles: np.ndarray) -> np.ndarray:
    """Compute the axes of a hinge's angles in its parent's frame.

    Args:
        chain: the chain.
        joint: index of the joint.
        angles: (3, F) radians.
    Returns:
        (3 components, 3 angles, F); zero where an angle is not free.
    """
    out = np.zeros((3, 3, angles.shape[-1]))
    rotation = np.broadcast_to(np.eye(3)[:, :, None], out.shape)
    for angle, letter in enumerate(chain.order[joint]):
        if chain.free[joint, angle]:
            out[:, angle] = rotation[:, AXES[letter]]
        quaternion_of_angle = np.zeros((4, angles.shape[-1]))
        quaternion_of_angle[0], quaternion_of_angle[1 + AXES[letter]] = np.cos(0.5 * angles[angle]), np.sin(0.5
                * angles[angle])
        # the axes of later angles are rotated by the earlier angles
        rotation = np.einsum("abf,bcf->acf", rotation, to_matrices(quaternion_of_angle))
    return out


def apply_step(chain: Chain, poses: Poses, shift: np.ndarray, rotations: np.ndarray) -> Poses:
    """Apply a step to poses.

    Args:
        chain: the chain.
        poses: F poses.
        shift: (3, F) metres, of the root.
        rotations: (J, 3, F) radians about the axes of `compute_step_axes`.
    Returns:
        The new poses; hinges stay within their limits.
    """
    local = multiply(to_quaternions(rotations), poses.local)
    angles = poses.angles.copy()
    for joint in chain.hinges:
        angles[joint] = limit_angles(chain, joint, poses.angles[joint] + rotations[joint])
        local[joint] = quaternion.from_euler(angles[joint].T, chain.order[joint]).T
    return Poses(poses.root + shift, local, angles)


def to_quaternions(v: np.ndarray) -> np.ndarray:
    """Convert rotation vectors (..., 3, F) radians to unit quaternions (..., 4, F)."""
    square = np.einsum("...af,...af->...f", v, v)
    angle = np.sqrt(square)
    out = np.empty((*v.shape[:-2], 4, v.shape[-1]))
    out[..., 0, :] = np.cos(0.5 * angle)
    # sin(angle / 2) / angle, by its series near 0
    scale = np.where(angle > 1e-6, np.sin(0.5 * angle) / np.maximum(angle, 1e-6), 0.5 - square / 48.0)
    out[..., 1:, :] = scale[..., None, :] * v
    return out


def to_rotation_vectors(q: np.ndarray) -> np.ndarray:
    """Convert unit quaternions (..., 4, F) to rotation vectors (..., 3, F) radians, the shorter ones."""
    return np.moveaxis(quaternion.to_rotation_vector(np.moveaxis(q, -2, -1)), -1, -2)


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Multiply quaternions: the rotations b followed by a, normalized, (..., 4, F) each."""
    aw, ax, ay, az = (a[..., component, :] for component in range(4))
    bw, bx, by, bz = (b[..., component, :] for component in range(4))
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0, :] = aw * bw - ax * bx - ay * by - az * bz
    out[..., 1, :] = aw * bx + ax * bw + ay * bz - az * by
    out[..., 2, :] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 3, :] = aw * bz + ax * by - ay * bx + az * bw
    return out / np.sqrt(np.einsum("...af,...af->...f", out, out))[..., None, :]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute cross products along the first axis, (3, ...) each."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[y] * b[z], a[z] * b[y], out=out[x])
    return out


def compute_marker_derivative(chain: Chain, poses: Poses) -> np.ndarray:
    """Compute the derivative of all markers by the pose, as a whole matrix.

    Only `smooth` and tests need it; the frame-wise solver never builds it.

    Args:
        chain: the chain.
        poses: F poses.
    Returns:
        (F, M, 3, 3 + 3 J): by the root's shift and each joint's three rotations.
    """
    placed = compute_world_poses(chain, poses)
    step_axes = compute_step_axes(chain, poses, placed)
    count, frames = len(chain.skeleton), poses.root.shape[-1]
    out = np.zeros((len(chain.joint), 3, 3 + 3 * count, frames))
    out[:, :, :3] = np.eye(3)[:, :, None]
    for marker, joint in enumerate(chain.joint):
        while joint >= 0:
            arm = placed.markers[marker] - placed.joints[joint]
            out[marker, :, 3 + 3 * joint : 6 + 3 * joint] = cross(step_axes[joint], arm[:, None])
            joint = chain.skeleton.parents[joint]
    return np.moveaxis(out, -1, 0)
