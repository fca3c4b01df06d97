"""A low-poly football player that fits any humanoid skeleton: kit, boots, head and hands, with skin weights.

Each part is a closed tube of rings around a bone. It is built in the neutral stance (`neutral`), where limbs hang and
the body faces +X, and then moved to the skeleton's rest pose. Knees, elbows, spine and neck bend smoothly (two joints
share a ring); hips, shoulders and ankles are rounded ends that overlap, which stays closed at any angle and in any rest
pose. Girths are those of a slim adult of 1.80 m, scaled with the skeleton.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import Humanoid, Limb, identify_joints
from ..motion.motion import Motion
from ..motion.retargeting.adult import ADULT_LEG
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance, is_rest_upright
from ..motion.skeleton import Skeleton, freeze_array

MATERIALS = ("skin", "shirt", "shorts", "socks", "boots", "hair")
SKIN, SHIRT, SHORTS, SOCKS, BOOTS, HAIR = range(6)


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """A closed mesh with skin weights, in the skeleton's rest pose (no joint rotated, root at the origin).

    Attributes:
        vertices: (V, 3) m, Z up.
        faces: tuples of 3 or 4 vertex indices, counterclockwise from outside.
        joints: (V, 2) int, the two joints that a vertex follows.
        weights: (V, 2) their weights, which sum to 1; the second may be 0.
        material: (F,) int, index into MATERIALS per face.
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    joints: np.ndarray
    weights: np.ndarray
    material: np.ndarray


def build_body(skeleton: Skeleton, height: float | None = None, example: Motion | None = None) -> BodyMesh:
    """Build a player's body for a skeleton.

    The face looks ahead as in the rest pose if that stands upright.

    Args:
        skeleton: a humanoid skeleton, J joints.
        height: stature in metres for the girths; None derives it from the legs' length.
        example: any recording on the skeleton; it shows how bones are twisted if the rest pose does not stand. Without
            it, feet and hands of such skeletons may be rotated (see `neutral.build_neutral_stance`).
    Returns:
        The mesh.
    Raises:
        InputError: if the skeleton has no hips or legs.
    """
    builder = _begin_body(skeleton, height, example)
    builder.add_torso()
    builder.add_head()
    for side, limb in ((1.0, builder.body.left), (-1.0, builder.body.right)):
        builder.add_leg(limb)
        builder.add_boot(limb, side)
        if None not in (limb.upper_arm, limb.lower_arm, limb.hand):
            builder.add_arm(limb)
            builder.add_hand(limb, side)
    return builder.build_mesh()


def build_boots(skeleton: Skeleton, height: float | None = None, example: Motion | None = None) -> BodyMesh:
    """Build the boots of a player's body alone.

    Args:
        skeleton, height, example: as in `build_body`.
    Returns:
        The mesh.
    Raises:
        InputError: if the skeleton has no hips or legs.
    """
    builder = _begin_body(skeleton, height, example)
    builder.add_boot(builder.body.left, 1.0)
    builder.add_boot(builder.body.right, -1.0)
    return builder.build_mesh()


def _begin_body(skeleton: Skeleton, height: float | None, example: Motion | None) -> "_BodyBuilder":
    """Begin a body without any part, in the neutral stance."""
    neutral = build_neutral_stance(skeleton, example)
    if example is not None and is_rest_upright(skeleton):
        neutral = _level_head(neutral, build_neutral_stance(skeleton))
    scale = neutral.leg / ADULT_LEG if height is None else height / 1.80
    return _BodyBuilder(neutral, identify_joints(skeleton), scale)


def _level_head(neutral: NeutralStance, rest: NeutralStance) -> NeutralStance:
    """Give the stance the head of the rest pose, unless the example's people would then look up.

    A player who kicks or walks looks down at the ground ahead, but some suits have a bowed head in the rest pose.
    """
    carrier = identify_joints(neutral.skeleton).head_or_neck
    ahead = quaternion.multiply(neutral.rotations[carrier], quaternion.inverse(rest.rotations[carrier]))
    if quaternion.rotate(ahead, np.array([1.0, 0.0, 0.0]))[2] > 0.0:
        return neutral
    rotations = np.array(neutral.rotations)
    rotations[carrier] = rest.rotations[carrier]
    return replace(neutral, rotations=rotations)


def deform_body(body: BodyMesh, skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Deform the body by linear blend skinning, like Blender's armature modifier without volume preservation.

    Args:
        body: the mesh, V vertices.
        skeleton: its skeleton, J joints.
        positions: (..., J, 3) m, the joints' positions, world frame.
        rotations: (..., J, 4) quaternions, the joints' rotations, world frame.
    Returns:
        (..., V, 3) m, world frame.
    """
    origin = skeleton.rest_positions
    out = np.zeros((*positions.shape[:-2], len(body.vertices), 3))
    for column in range(2):
        joint = body.joints[:, column]
        moved = quaternion.rotate(rotations[..., joint, :], body.vertices - origin[joint]) + positions[..., joint, :]
        out += body.weights[:, column, None] * moved
    return out


def _to_rest(neutral: NeutralStance, vertices: np.ndarray, joints: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Compute the rest positions (V, 3) of vertices (V, 3) given in the neutral stance: inverse blend skinning."""
    origin = neutral.skeleton.rest_positions
    rotations = quaternion.to_matrix(neutral.rotations)
    shift = neutral.positions - np.einsum("jab,jb->ja", rotations, origin)
    matrix = np.einsum("vc,vcab->vab", weights, rotations[joints])
    is_degenerate = np.abs(np.linalg.det(matrix)) < 0.2  # joints rotated in opposite directions: use the first alone
    matrix[is_degenerate] = rotations[joints[is_degenerate, 0]]
    offset = np.einsum("vc,vca->va", weights, shift[joints])
    offset[is_degenerate] = shift[joints[is_degenerate, 0]]
    return np.linalg.solve(matrix, (vertices - offset)[..., None])[..., 0]


class _BodyBuilder:
    """Collects the parts of the body.

    Its tables are in metres for a stature of 1.80 m; `scale` adapts them to the skeleton.

    Attributes:
        neutral: the neutral stance.
        body: the skeleton's humanoid joints.
        scale: the skeleton's stature relative to 1.80 m.
        vertices, joints, weights: arrays of each part, see `BodyMesh`.
        faces, material: faces and their materials.
    """

    def __init__(self, neutral: NeutralStance, body: Humanoid, scale: float):
        self.neutral, self.body, self.scale = neutral, body, scale
        self.vertices, self.joints, self.weights = [], [], []
        self.faces: list[tuple[int, ...]] = []
        self.material: list[int] = []

    def build_mesh(self) -> BodyMesh:
        """Build the mesh of all parts, in the skeleton's rest pose."""
        vertices, joints, weights = (np.concatenate(rows) for rows in (self.vertices, self.joints, self.weights))
        rest = _to_rest(self.neutral, vertices, joints, weights)
        arrays = (freeze_array(rest), tuple(self.faces), freeze_array(joints, int), freeze_array(weights))
        return BodyMesh(*arrays, freeze_array(self.material, int))

    def joint_position(self, joint: int) -> np.ndarray:
        """Return a joint's position (3,) m in the neutral stance."""
        return self.neutral.positions[joint]

    def add_tube(self, rings, follows, materials, sides: int = 12, across=((1.0, 0, 0), (0, 1.0, 0))) -> None:
        """Add a closed tube.

        Args:
            rings: rows (centre (3,), radius along the first axis, radius along the second).
            follows: for each ring (joint, joint, share of the second).
            materials: one for each gap between rings; the first and last also for the caps.
            sides: vertices per ring.
            across: the two axes of the rings.
        """
        first, second = (np.array(axis, dtype=float) for axis in across)
        angle = 2.0 * np.pi * np.arange(sides) / sides
        circle = np.cos(angle)[:, None, None] * first, np.sin(angle)[:, None, None] * second
        start = sum(len(v) for v in self.vertices)
        centres = np.array([ring[0] for ring in rings])
        radii = np.array([ring[1:3] for ring in rings]) * self.scale
        points = (centres[None] + circle[0] * radii[None, :, :1] + circle[1] * radii[None, :, 1:]).transpose(1, 0, 2)
        # Vertices ring by ring, then the middle of both caps.
        bottom, top = centres[0], centres[-1]
        self.vertices.append(np.concatenate([points.reshape(-1, 3), [bottom, top]]))
        pairs = np.array([f[:2] for f in follows])
        shares = np.array([(1.0 - f[2], f[2]) for f in follows])
        self.joints.append(np.concatenate([np.repeat(pairs, sides, axis=0), pairs[[0, -1]]]))
        self.weights.append(np.concatenate([np.repeat(shares, sides, axis=0), shares[[0, -1]]]))
        self._add_faces(start, len(rings), sides, materials, np.dot(np.cross(first, second), top - bottom) > 0)

    def _add_faces(self, start: int, count: int, sides: int, materials, outward: bool) -> None:
        """Add the faces of a tube: quads between rings, triangles at both caps."""
        index = start + np.arange(count * sides).reshape(count, sides)
        low, high = start + count * sides, start + count * sides + 1
        for i in range(sides):
            j = (i + 1) % sides
            quads = [
                ((index[r, i], index[r, j], index[r + 1, j], index[r + 1, i]), materials[r]) for r in range(count - 1)
            ]
            caps = [
                ((index[0, j], index[0, i], low), materials[0]),
                ((index[-1, i], index[-1, j], high), materials[-1]),
            ]
            for face, material in quads + caps:
                self.faces.append(tuple(int(v) for v in (face if outward else face[::-1])))
                self.material.append(material)

    def add_ellipsoid(self, centre, radii, joint: int, material: int, other: int | None = None,
                      sides: int = 10) -> None:
        """Add a closed ellipsoid.

        Args:
            centre: (3,) m.
            radii: (3,) half axes in metres for a stature of 1.80 m.
            joint: the joint that it follows.
            material: index into MATERIALS.
            other: a second joint that it follows half, or None.
            sides: vertices per ring.
        """
        rings = [
            (centre + self.scale * np.array([0, 0, -radii[2] * np.cos(a)]), radii[0] * np.sin(a), radii[1] * np.sin(a))
            for a in np.radians([25, 55, 90, 125, 155])
        ]
        follow = (joint, joint, 0.0) if other is None else (joint, other, 0.5)
        self.add_tube(rings, [follow] * 5, [material] * 4, sides)

    # -- trunk and head
    # -------------------------------------------------------------------------------------------------

    def find_spine_joints(self, height: float) -> tuple[int, int, float]:
        """Find which two joints of the spine a ring follows: half and half at a joint, one joint between.

        Args:
            height: m above the ground in the neutral stance.
        Returns:
            Lower joint, upper joint, share of the upper one.
        """
        chain = [self.body.hips]
        for joint in self.body.spine:
            if self.joint_position(joint)[2] > self.joint_position(chain[-1])[2] + 0.02:
                chain.append(joint)
        levels = np.array([self.joint_position(j)[2] for j in chain[1:]])
        position = np.interp(height, *_compute_midpoints(levels)) if len(levels) else 0.0
        low = int(np.clip(np.floor(position), 0, max(len(chain) - 2, 0)))
        high = min(low + 1, len(chain) - 1)
        return chain[low], chain[high], float(np.clip(position - low, 0.0, 1.0))

    def add_torso(self) -> None:
        """Add shirt and shorts of the trunk."""
        body, k = self.body, self.scale
        hip = 0.5 * (self.joint_position(body.left.upper_leg) + self.joint_position(body.right.upper_leg))
        top, half = self._find_shoulders(hip)
        # share of the distance from hip joints to shoulder joints, forward shift, half depth, half width
        shirt = (
            (0.13, 0.000, 0.112, 0.158), (0.22, 0.002, 0.112, 0.156), (0.36, 0.006, 0.107, 0.146),
            (0.52, 0.006, 0.112, 0.152), (0.68, 0.004, 0.122, 0.168), (0.82, -0.002, 0.124, 0.178),
            (0.92, -0.006, 0.114, 0.182), (1.00, -0.010, 0.094, 0.180), (1.055, -0.014, 0.080, 0.150),
            (1.10, -0.016, 0.070, 0.104), (1.145, -0.016, 0.060, 0.068),
        )
        self._add_trunk_tube(hip, top, shirt, SHIRT, half / (0.164 * k))
        shorts = (
            (-0.17, 0.0, 0.05, 0.06), (-0.14, 0.0, 0.092, 0.118), (-0.06, -0.004, 0.116, 0.158),
            (0.03, -0.006, 0.122, 0.168), (0.12, -0.002, 0.116, 0.162), (0.205, 0.0, 0.108, 0.152),
        )
        self._add_trunk_tube(hip, top, shorts, SHORTS, 1.0)

    def _find_shoulders(self, hip: np.ndarray) -> tuple[np.ndarray, float]:
        """Find the middle of the shoulder joints and half their distance; estimated from the hips without arms."""
        arms = [limb.upper_arm for limb in (self.body.left, self.body.right)]
        if None in arms:
            return hip + np.array([0.0, 0.0, 0.56 * self.scale]), 0.164 * self.scale
        left, right = self.joint_position(arms[0]), self.joint_position(arms[1])
        middle = 0.5 * (left + right)
        return middle, 0.5 * abs(left[1] - right[1])

    def _add_trunk_tube(self, hip, top, table, material: int, widen: float) -> None:
        """Add a tube around the trunk; `widen` scales the upper rings to the shoulders' width."""
        rings, follows = [], []
        for share, ahead, depth, width in table:
            upper = max(share - 0.5, 0.0) / 0.5
            centre = hip + share * (top - hip) + np.array([ahead * self.scale, 0.0, 0.0])
            rings.append((centre, depth, width * (1.0 + upper * (widen - 1.0) * (share < 1.05))))
            follows.append(self.find_spine_joints(centre[2]))
        self.add_tube(rings, follows, [material] * (len(rings) - 1), 16)

    def add_head(self) -> None:
        """Add neck, head and face."""
        body, k = self.body, self.scale
        hip = 0.5 * (self.joint_position(body.left.upper_leg) + self.joint_position(body.right.upper_leg))
        shoulder, _ = self._find_shoulders(hip)
        carrier = body.head_or_neck
        neck = body.neck_or_chest
        base = self.joint_position(carrier) if body.head is not None else shoulder + k * np.array([0.03, 0.0, 0.15])
        low = shoulder + k * np.array([-0.012, 0.0, 0.03])
        rings = [(low, 0.066, 0.072)]
        rings += [(low + share * (base - low), *girth) for share, *girth in ((0.45, 0.056, 0.058), (0.8, 0.054, 0.054))]
        rings += [(base + k * np.array([0.0, 0.0, 0.03]), 0.052, 0.052)]
        self.add_tube(
            rings, [(body.chest, neck, 0.2), (neck, neck, 0), (neck, carrier, 0.5), (carrier, carrier, 0)], [SKIN] * 3,
            12,
        )
        self._add_face_parts(base, carrier)

    def _add_face_parts(self, base: np.ndarray, joint: int) -> None:
        """Add skull, hair, nose, ears, eyes and brows."""
        k = self.scale
        # above the base of the skull, forward, half depth, half width
        skull = (
            (-0.072, 0.060, 0.022, 0.022), (-0.062, 0.052, 0.042, 0.038), (-0.038, 0.036, 0.064, 0.054),
            (-0.005, 0.022, 0.082, 0.066), (0.035, 0.014, 0.094, 0.073), (0.075, 0.010, 0.097, 0.075),
            (0.110, 0.006, 0.088, 0.068), (0.137, 0.002, 0.062, 0.049), (0.151, 0.000, 0.030, 0.024),
        )
        hair = (
            (-0.020, -0.046, 0.040, 0.058), (0.010, -0.030, 0.066, 0.072), (0.050, -0.020, 0.080, 0.079),
            (0.085, -0.010, 0.090, 0.080), (0.106, 0.002, 0.098, 0.076), (0.128, 0.003, 0.082, 0.064),
            (0.150, 0.001, 0.054, 0.043), (0.161, -0.002, 0.022, 0.018),
        )
        for table, material in ((skull, SKIN), (hair, HAIR)):
            rings = [(base + k * np.array([ahead, 0.0, up]), depth, width) for up, ahead, depth, width in table]
            self.add_tube(rings, [(joint, joint, 0.0)] * len(rings), [material] * (len(rings) - 1), 14)
        self.add_ellipsoid(base + k * np.array([0.112, 0.0, 0.016]), (0.017, 0.011, 0.020), joint, SKIN, sides=6)
        for side in (1.0, -1.0):
            self.add_ellipsoid(base + k * np.array([0.010, side * 0.073, 0.022]), (0.016, 0.009, 0.026), joint, SKIN,
                               sides=6)
            self.add_ellipsoid(base + k * np.array([0.0975, side * 0.028, 0.042]), (0.008, 0.011, 0.006), joint, HAIR,
                               sides=6)
            self.add_ellipsoid(base + k * np.array([0.0985, side * 0.029, 0.061]), (0.007, 0.017, 0.0045), joint, HAIR,
                               sides=6)

    # -- limbs
    # ----------------------------------------------------------------------------------------------------------

    def add_limb_tube(self, upper: int, lower: int, end: int, table, sides: int) -> None:
        """Add a tube along two bones.

        Args:
            upper, lower, end: the joints at both ends of the two bones.
            table: rows (position, metres forward, metres left, two radii, material). Positions 0 to 1 run down the
                upper bone, 1 to 2 down the lower one. Rings near the middle joint follow both bones, the last ones the
                lower bone.
            sides: vertices per ring.
        """
        a, b, c = self.joint_position(upper), self.joint_position(lower), self.joint_position(end)
        rings, follows = [], []
        for place, ahead, left, first, second, _ in table:
            centre = a + (b - a) * min(place, 1.0) + (c - b) * max(place - 1.0, 0.0)
            rings.append((centre + self.scale * np.array([ahead, left, 0.0]), first, second))
            follows.append((upper, lower, float(np.clip(0.5 + (place - 1.0) / 0.34, 0.0, 1.0))))
        self.add_tube(rings, follows, [row[-1] for row in table[:-1]], sides)

    def add_leg(self, limb: Limb) -> None:
        """Add leg, knee, ankle and the leg of the shorts."""
        inner = -np.sign(self.joint_position(limb.upper_leg)[1])
        bones = limb.upper_leg, limb.lower_leg, limb.foot
        table = (
            (0.16, 0.004, 0.0, 0.082, 0.076, SKIN), (0.40, 0.006, 0.0, 0.079, 0.073, SKIN),
            (0.62, 0.005, 0.0, 0.070, 0.065, SKIN), (0.80, 0.002, 0.0, 0.060, 0.058, SKIN),
            (0.90, 0.004, 0.0, 0.057, 0.055, SKIN), (0.97, 0.006, 0.0, 0.057, 0.053, SKIN),
            (1.04, 0.004, 0.0, 0.055, 0.051, SKIN), (1.12, -0.002, 0.0, 0.053, 0.050, SKIN),
            (1.155, -0.004, 0.0, 0.053, 0.051, SKIN), (1.16, -0.006, 0.0, 0.058, 0.056, SOCKS),
            (1.30, -0.012, 0.004 * inner, 0.061, 0.058, SOCKS), (1.45, -0.010, 0.003 * inner, 0.055, 0.052, SOCKS),
            (1.65, -0.004, 0.0, 0.044, 0.041, SOCKS), (1.84, 0.0, 0.0, 0.037, 0.034, SOCKS),
            (1.96, 0.002, 0.0, 0.038, 0.034, SOCKS), (2.03, 0.002, 0.0, 0.030, 0.026, SOCKS),
        )
        self.add_limb_tube(*bones, table, 12)
        self.add_ellipsoid(
            self.joint_position(limb.lower_leg) + self.scale * np.array([0.006, 0, 0]), (0.054, 0.050, 0.056), bones[0],
            SKIN, bones[1],
        )
        self.add_ellipsoid(self.joint_position(limb.foot), (0.039, 0.036, 0.042), limb.foot, SOCKS)
        shorts = (
            (-0.17, 0.0, 0.0, 0.030, 0.030, SHORTS), (-0.13, 0.0, 0.0, 0.075, 0.068, SHORTS),
            (-0.04, 0.0, 0.0, 0.100, 0.086, SHORTS), (0.10, 0.004, 0.0, 0.104, 0.088, SHORTS),
            (0.36, 0.006, 0.0, 0.103, 0.093, SHORTS), (0.52, 0.006, 0.0, 0.105, 0.098, SHORTS),
            (0.525, 0.006, 0.0, 0.088, 0.083, SHORTS), (0.44, 0.006, 0.0, 0.050, 0.050, SHORTS),
        )
        self.add_limb_tube(*bones, shorts, 12)

    def add_boot(self, limb: Limb, side: float) -> None:
        """Add the boot."""
        ankle, k = self.joint_position(limb.foot), self.scale
        ball = self.neutral.ball[0 if side > 0 else 1]
        floor = ankle[2] - self.neutral.ankle_height
        toe = limb.toe if limb.toe is not None else limb.foot
        # metres from the ankle (from the ball of the foot on: from the toe joint), height of the middle, half height,
        # half width, share of the toe joint
        table = (
            (-0.068, 0.040, 0.024, 0.018, 0), (-0.060, 0.042, 0.040, 0.030, 0), (-0.030, 0.046, 0.046, 0.036, 0),
            (0.010, 0.049, 0.049, 0.037, 0), (0.050, 0.040, 0.040, 0.039, 0), (0.090, 0.032, 0.032, 0.043, 0),
            (0.000, 0.027, 0.027, 0.047, 0.5), (0.028, 0.024, 0.023, 0.045, 1), (0.055, 0.021, 0.018, 0.036, 1),
            (0.072, 0.018, 0.011, 0.022, 1),
        )
        rings, follows = [], []
        for row, (ahead, up, high, wide, share) in enumerate(table):
            x = ankle[0] + (k * ahead if row < 6 else ball[0] + k * ahead)
            if row == 5:
                x = min(x, ankle[0] + 0.72 * ball[0])
            rings.append((np.array([x, ankle[1] + side * 0.004 * k, floor + k * up]), wide, high))
            follows.append((limb.foot, toe, float(share)))
        self.add_tube(rings, follows, [BOOTS] * (len(rings) - 1), 10, ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))

    def add_arm(self, limb: Limb) -> None:
        """Add arm, elbow and sleeve."""
        inner = -np.sign(self.joint_position(limb.upper_arm)[1])
        bones = limb.upper_arm, limb.lower_arm, limb.hand
        table = (
            (0.30, 0.0, 0.0, 0.046, 0.044, SKIN), (0.55, 0.003, 0.0, 0.046, 0.043, SKIN),
            (0.78, 0.002, 0.0, 0.041, 0.039, SKIN), (0.90, 0.0, 0.0, 0.039, 0.038, SKIN),
            (0.97, -0.002, 0.0, 0.039, 0.038, SKIN), (1.04, -0.001, 0.0, 0.039, 0.038, SKIN),
            (1.14, 0.003, 0.0, 0.041, 0.039, SKIN), (1.35, 0.003, 0.0, 0.039, 0.036, SKIN),
            (1.65, 0.001, 0.0, 0.032, 0.028, SKIN), (1.90, 0.0, 0.0, 0.028, 0.022, SKIN),
            (2.04, 0.0, 0.0, 0.026, 0.020, SKIN),
        )
        self.add_limb_tube(*bones, table, 10)
        self.add_ellipsoid(
            self.joint_position(limb.lower_arm) - self.scale * np.array([0.003, 0, 0]), (0.038, 0.036, 0.04), bones[0],
            SKIN, bones[1],
        )
        sleeve = (
            (-0.165, 0.0, 0.020 * inner, 0.024, 0.024, SHIRT), (-0.14, 0.0, 0.016 * inner, 0.044, 0.042, SHIRT),
            (-0.07, 0.0, 0.008 * inner, 0.060, 0.056, SHIRT), (0.06, 0.0, 0.0, 0.067, 0.060, SHIRT),
            (0.30, 0.0, 0.0, 0.065, 0.059, SHIRT), (0.56, 0.0, 0.0, 0.066, 0.062, SHIRT),
            (0.565, 0.0, 0.0, 0.054, 0.052, SHIRT), (0.48, 0.0, 0.0, 0.030, 0.030, SHIRT),
        )
        self.add_limb_tube(*bones, sleeve, 12)

    def add_hand(self, limb: Limb, side: float) -> None:
        """Add hand and thumb."""
        wrist, k, joint = self.joint_position(limb.hand), self.scale, limb.hand
        # below the wrist, towards the palm, forward, half width of the palm, half thickness
        table = (
            (-0.022, 0.0, 0.0, 0.024, 0.019), (0.010, 0.0, 0.0, 0.031, 0.018), (0.050, 0.002, 0.002, 0.042, 0.019),
            (0.092, 0.008, 0.002, 0.043, 0.018), (0.124, 0.020, 0.000, 0.038, 0.017),
            (0.148, 0.038, -0.002, 0.033, 0.015), (0.156, 0.058, -0.002, 0.027, 0.012),
        )
        rings = [
            (wrist + k * np.array([ahead, -side * palm, -down]), wide, thick)
            for down, palm, ahead, wide, thick in table
        ]
        self.add_tube(rings, [(joint, joint, 0.0)] * len(rings), [SKIN] * (len(rings) - 1), 10)
        thumb = (
            (0.030, 0.004, 0.026, 0.016, 0.014), (0.058, 0.012, 0.046, 0.014, 0.013),
            (0.084, 0.022, 0.054, 0.011, 0.011), (0.096, 0.026, 0.055, 0.006, 0.006),
        )
        rings = [
            (wrist + k * np.array([ahead, -side * palm, -down]), wide, thick)
            for down, palm, ahead, wide, thick in thumb
        ]
        self.add_tube(rings, [(joint, joint, 0.0)] * len(rings), [SKIN] * (len(rings) - 1), 8)


def _compute_midpoints(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute heights and positions in a chain such that a joint's height is half way between it and the one below it.
    """
    middles = 0.5 * (levels[1:] + levels[:-1])
    heights = np.concatenate([[levels[0] - 0.08], middles, [levels[-1] + 0.08]])
    return heights, np.arange(len(heights), dtype=float)
