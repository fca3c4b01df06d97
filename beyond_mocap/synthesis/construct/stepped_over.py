"""Feet where one motion goes over into another: they step from where the one has them to where the other has.

Faded into each other, feet that stand in both would slide across. Instead each stands where it is until it is due, is
lifted (`steps`) and set down where the other motion has it (`foot_plant`). Outside the stretch nothing changes.
"""

from __future__ import annotations

import numpy as np

from ...motion.foot_plant import plant
from ...motion.skeleton import Skeleton
from .hand_over import Pose, handed_over, old_share
from .steps import steps

_AROUND = 0.5  # s on either side of the stretch that are looked at
_JOINS = 0.12  # s at either end of it in which what is planted goes over into what stays


def stepped_over(skeleton: Skeleton, pose: Pose, standing: np.ndarray, stretch: tuple[int, int], fps: float) -> Pose:
    """Root (T, 3) m and local rotations (T, J, 4) with feet that stand and step within the frames first .. end of
    `stretch`, and are as they were elsewhere, bit for bit. standing (T, 2, 2) bool: heels and toes, left and right,
    that stand in whichever motion is shown most."""
    first, end = stretch
    around, joins = int(_AROUND * fps), max(int(round(_JOINS * fps)), 1)
    if end - first < 2 * joins + 3:
        return pose
    low, high = max(first - around, 0), min(end + around, len(pose[0]))
    root, rotations = pose[0][low:high], pose[1][low:high]
    at = np.arange(low, high)
    inside = (at >= first) & (at < end)
    taken = steps(skeleton, root, rotations, standing[low:high], fps, free=inside)
    swayed = root + np.column_stack([taken.sway, np.zeros(len(root))])
    found = plant(skeleton, swayed, taken.rotations, taken.standing, fps, moves=taken.moves, levels=False)
    share = old_share(high - low, (first + joins - low, end - joins - low), joins)
    share[~inside] = 1.0
    new = handed_over(skeleton, (found.root, found.rotations), (root, rotations), share, taken.standing, fps)
    changed = pose[0].copy(), pose[1].copy()
    for whole, part in zip(changed, new):
        whole[first:end] = part[first - low : end - low]
    return changed
