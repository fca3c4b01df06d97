"""The joint limits of a model's limb on other bones: of any rig that its motions are brought to, and of the mirror
image.

Limits are boxes in the axes of the model's joints (`limits`). Retargeting and mirroring carry whole segments over, so
that a joint of the other body has, up to a fixed turn (with a reflection, where mirrored) of its axes, the world
rotation of the model's: W' = M W B. The turns B are read off a motion that stands on both bodies, as the nearest
orthogonal matrices to the mean of W^T M W'; then a joint with parent p is judged as the model's would be that has the
local rotation B_p L' B^T. What inverse kinematics of legs and a collar bone that is missing change is left over: the
mean takes no part of it, so it counts as bent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from .kinematics import transposed
from .limits import JointLimits

_MIRROR = np.diag([1.0, -1.0, 1.0])
_FRAMES = 24  # of a motion that tell how axes lie


@dataclass(frozen=True, eq=False)
class LimbLimits:
    """Limits of one limb on a body. limits: of the model's limb alone. joints: the body's, as many. above, axes:
    (C, 3, 3), from the axes of the joints' parents and of the joints to those of the model's."""

    limits: JointLimits
    joints: tuple[int, ...]
    above: np.ndarray
    axes: np.ndarray

    @classmethod
    def of(
        cls, limits: JointLimits, own: Motion, own_joints: tuple[int, ...], shown: Motion, joints: tuple[int, ...],
        mirrored: bool = False,
    ) -> LimbLimits:
        """The limits of a model's limb `own_joints` for the limb `joints` of `shown`, which shows `own`, a motion of
        the model's skeleton, frame by frame, at the same place. mirrored: it shows its mirror image at y = 0."""
        frames = np.unique(np.linspace(0, len(own) - 1, _FRAMES).astype(int))
        turns = [quaternion.to_matrix(forward_kinematics(_at(motion, frames))[1]) for motion in (own, shown)]
        image = _MIRROR if mirrored else np.eye(3)

        def between(theirs: list[int], mine: list[int]) -> np.ndarray:
            both = transposed(turns[0][:, theirs]) @ image @ turns[1][:, mine]
            left, _, right = np.linalg.svd(both.mean(axis=0))
            return left @ right

        parents = [
            [motion.skeleton.parents[joint] for joint in limb] for motion, limb in ((own, own_joints), (shown, joints))
        ]
        return cls(
            limits.of_joints(own_joints), tuple(joints), between(*parents), between(list(own_joints), list(joints))
        )

    def held(self, rotations: np.ndarray, given: np.ndarray) -> np.ndarray:
        """Local rotations (W, C, 4) of the limb's joints brought within their limits; where `given` (W, C, 4) lies
        beyond them, no further than that."""
        local, over = self.limits.within(self._carried(rotations), self._carried(given))
        if not over.any():
            return rotations
        back = quaternion.from_matrix(transposed(self.above) @ local @ self.axes)
        return np.where(over[..., None] > 0.0, quaternion.signed_like(back, rotations), rotations)

    def beyond(self, motion: Motion) -> np.ndarray:
        """(T, C) rad by which the limb's joints are beyond their limits."""
        return self.limits.beyond(self._carried(motion.rotations[:, list(self.joints)]))

    def _carried(self, rotations: np.ndarray) -> np.ndarray:
        """(..., C, 3, 3): as the model's joints would be turned."""
        return self.above @ quaternion.to_matrix(rotations) @ transposed(self.axes)


def _at(motion: Motion, frames: np.ndarray) -> Motion:
    return Motion(motion.skeleton, motion.root_positions[frames], motion.rotations[frames], motion.fps)
