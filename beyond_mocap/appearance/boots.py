"""The soles that feet are measured by: boots as plain tubes of rings, flat below, at the same place on any skeleton.

The drawn body's boots (`sculpt.limbs`) have the same outline and the same soles. Measures of takes and recordings use
these plain ones, so that figures do not change with the look of the body.
"""

from __future__ import annotations

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import Limb, identify_joints
from ..motion.motion import Motion
from ..motion.retargeting.adult import ADULT_LEG
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.skeleton import Skeleton, freeze_array
from .mesh import BOOTS, BodyMesh

_SIDES = 10  # vertices per ring
_LEFT, _UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def build_boots(skeleton: Skeleton, height: float | None = None, example: Motion | None = None) -> BodyMesh:
    """Build the boots of a player's body alone.

    Args:
        skeleton, height, example: as in `body.build_body`.
    Returns:
        The mesh; each vertex follows two joints.
    Raises:
        InputError: if the skeleton has no hips or legs.
    """
    neutral = build_neutral_stance(skeleton, example)
    builder = _BootBuilder(neutral, neutral.leg / ADULT_LEG if height is None else height / 1.80)
    body = identify_joints(skeleton)
    builder.add_boot(body.left, 1.0)
    builder.add_boot(body.right, -1.0)
    return builder.build_mesh()


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


class _BootBuilder:
    """Collects both boots.

    Its table is in metres for a stature of 1.80 m; `scale` adapts it to the skeleton.

    Attributes:
        neutral: the neutral stance.
        scale: the skeleton's stature relative to 1.80 m.
        vertices, joints, weights: arrays of each boot, see `BodyMesh`.
        faces: of both.
    """

    def __init__(self, neutral: NeutralStance, scale: float):
        self.neutral, self.scale = neutral, scale
        self.vertices: list[np.ndarray] = []
        self.joints: list[np.ndarray] = []
        self.weights: list[np.ndarray] = []
        self.faces: list[tuple[int, ...]] = []

    def build_mesh(self) -> BodyMesh:
        """Build the mesh of both boots, in the skeleton's rest pose."""
        vertices, joints, weights = (np.concatenate(rows) for rows in (self.vertices, self.joints, self.weights))
        rest = _to_rest(self.neutral, vertices, joints, weights)
        arrays = (freeze_array(rest), tuple(self.faces), freeze_array(joints, int), freeze_array(weights))
        return BodyMesh(*arrays, freeze_array(np.full(len(self.faces), BOOTS), int))

    def add_boot(self, limb: Limb, side: float) -> None:
        """Add the boot."""
        ankle, k = self.neutral.positions[limb.foot], self.scale
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
        self._add_tube(rings, follows)

    def _add_tube(self, rings, follows) -> None:
        """Add a closed tube along x.

        Args:
            rings: rows (centre (3,), radius across, radius up).
            follows: for each ring (joint, joint, share of the second).
        """
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        circle = np.cos(angle)[:, None, None] * _LEFT, np.sin(angle)[:, None, None] * _UP
        start = sum(len(v) for v in self.vertices)
        centres = np.array([ring[0] for ring in rings])
        radii = np.array([ring[1:3] for ring in rings]) * self.scale
        points = (centres[None] + circle[0] * radii[None, :, :1] + circle[1] * radii[None, :, 1:]).transpose(1, 0, 2)
        # Vertices ring by ring, then the middle of both caps.
        self.vertices.append(np.concatenate([points.reshape(-1, 3), centres[[0, -1]]]))
        pairs = np.array([f[:2] for f in follows])
        shares = np.array([(1.0 - f[2], f[2]) for f in follows])
        self.joints.append(np.concatenate([np.repeat(pairs, _SIDES, axis=0), pairs[[0, -1]]]))
        self.weights.append(np.concatenate([np.repeat(shares, _SIDES, axis=0), shares[[0, -1]]]))
        self._add_faces(start + np.arange(len(rings) * _SIDES).reshape(len(rings), _SIDES))

    def _add_faces(self, index: np.ndarray) -> None:
        """Add the faces of a tube whose vertices are `index` (rings, sides): quads, and triangles at both caps."""
        low, high = index[-1, -1] + 1, index[-1, -1] + 2
        for i in range(_SIDES):
            j = (i + 1) % _SIDES
            rows = range(len(index) - 1)
            faces: list[tuple[int, ...]] = [(index[r, i], index[r, j], index[r + 1, j], index[r + 1, i]) for r in rows]
            faces += [(index[0, j], index[0, i], low), (index[-1, i], index[-1, j], high)]
            self.faces.extend(tuple(int(v) for v in face) for face in faces)
