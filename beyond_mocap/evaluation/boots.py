"""How deep the skin of a body's boots goes below the ground: `boots` of docs/reference/report-figures.md.

The boots have the soles of the drawn character (`appearance.boots`), so what is measured is what is seen. A take stands
on the ground at height 0, a recording as it is used.
"""

from __future__ import annotations

import numpy as np

from ..appearance.mesh import BodyMesh
from ..motion import quaternion
from ..motion.motion import Motion
from .naturalness import FPS

_ROWS_AT_ONCE = 1024  # frames at once, to limit memory
DEEP = 0.02  # m below the ground from which a boot counts: grass and soles hide less


def measure_boot_heights(boots: BodyMesh, motion: Motion, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Measure the height of the lowest point of both boots, at 30 frames per second: the nearest frames count.

    Args:
        boots: of a body with the motion's skeleton (`appearance.boots.build_boots`).
        motion: N frames on a skeleton of J joints.
        positions: (N, J, 3) m, its joints, world.
        rotations: (N, J, 4), the same.
    Returns:
        (T,) m, negative below the ground.
    """
    count = int((len(motion) - 1) / motion.fps * FPS + 1e-6) + 1
    rows = np.minimum(np.rint(np.arange(count) * motion.fps / FPS).astype(int), len(motion) - 1)
    parts = (rows[first : first + _ROWS_AT_ONCE] for first in range(0, count, _ROWS_AT_ONCE))
    return np.concatenate([measure_lowest_point(boots, motion.skeleton.rest_positions, positions[part], rotations[part])
                           for part in parts])


def measure_lowest_point(skin: BodyMesh, rest: np.ndarray, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Measure the height of the lowest vertex of a skin, deformed as in `appearance.mesh.deform_body`.

    Only heights are computed, joint by joint, with the third row of its rotation matrix.

    Args:
        skin: the mesh, V vertices.
        rest: (J, 3) m, the joints in the skeleton's rest pose.
        positions: (T, J, 3) m, the joints, world.
        rotations: (T, J, 4), the same.
    Returns:
        (T,) m.
    """
    heights = np.zeros((len(positions), len(skin.vertices)))
    for joint in np.unique(skin.joints[skin.weights > 0.0]):
        share = np.sum(np.where(skin.joints == joint, skin.weights, 0.0), axis=1)
        chosen = np.flatnonzero(share)
        up = quaternion.to_matrix(rotations[:, joint])[:, 2]
        height = up @ (skin.vertices[chosen] - rest[joint]).T + positions[:, joint, 2:]
        heights[:, chosen] += share[chosen] * height
    return heights.min(axis=1)
