"""The project's own body: an adult of 1.80 m in 22 joints, named as in Mixamo and LAFAN1, arms hanging at rest.

Segment lengths are shares of the stature H after Drillis and Contini 1966 as printed in Winter 2009 ("Biomechanics and
motor control of human movement", fig. 4.1): thigh .245 H, shank .246 H, ankle .039 H, upper arm .186 H, forearm .146 H,
shoulder (acromion) height .818 H; hip joint centres half as far apart as .191 H. Joint centres of shoulder and hip are
set inwards from these surface landmarks by 2 to 4 cm.
"""

from __future__ import annotations

import numpy as np

from ..skeleton import Skeleton

# joint, parent, offset in thousandths of the stature (forward, left, up); limbs are given for the left side
_CENTRE = (
    ("Hips", None, (0, 0, 0)), ("Spine", "Hips", (-3, 0, 48)), ("Spine1", "Spine", (4, 0, 72)),
    ("Spine2", "Spine1", (-5, 0, 75)), ("Neck", "Spine2", (-6, 0, 118)), ("Head", "Neck", (11, 0, 52)),
)
_ARM = (
    ("Shoulder", "Spine2", (2, 14, 84)), ("Arm", "Shoulder", (-12, 91, -10)), ("ForeArm", "Arm", (0, 0, -170)),
    ("Hand", "ForeArm", (0, 0, -146)),
)
_LEG = (
    ("UpLeg", "Hips", (0, 50, -22)), ("Leg", "UpLeg", (0, 0, -242)), ("Foot", "Leg", (0, 0, -243)),
    ("ToeBase", "Foot", (74, 0, -30)),
)
_CENTRE_TIPS = (("Head", (10, 0, 125)),)
_LIMB_TIPS = (("Hand", (0, 0, -100)), ("ToeBase", (38, 0, -3)))
STATURE = 1.80
LEG = 0.873
"""Metres, thigh plus shank of the adult to whom published figures of gait apply."""


def adult_skeleton(stature: float = STATURE) -> Skeleton:
    """Build the adult's skeleton.

    Args:
        stature: metres.
    Returns:
        22 joints; the rest pose stands facing +X, arms hanging.
    """
    rows = list(_CENTRE)
    tips = list(_CENTRE_TIPS)
    for side, sign in (("Left", 1), ("Right", -1)):
        for chain in (_ARM, _LEG):
            for part, parent, (x, y, z) in chain:
                above = parent if parent in ("Hips", "Spine2") else side + parent
                rows.append((side + part, above, (x, sign * y, z)))
        tips += [(side + part, (x, sign * y, z)) for part, (x, y, z) in _LIMB_TIPS]
    names = [row[0] for row in rows]
    return Skeleton(
        names=tuple(names),
        parents=tuple(-1 if row[1] is None else names.index(row[1]) for row in rows),
        offsets=np.array([row[2] for row in rows]) * stature / 1000.0,
        end_parents=tuple(names.index(joint) for joint, _ in tips),
        end_offsets=np.array([offset for _, offset in tips]) * stature / 1000.0,
    )
