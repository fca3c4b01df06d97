"""Anatomical points that markers lie on, by names of their own: what every marker set translates its labels into."""

from __future__ import annotations

_CENTRE = (
    "sacrum",  # between the posterior superior iliac spines
    "c7", "t7", "t10",  # spinous processes
    "jugular_notch", "sternum",  # upper and lower end of the breastbone
    "head_front", "head_back", "head_top",
)
_SIDES = (
    "asis", "psis", "iliac_crest",  # iliac spines; crest at the side
    "scapula",  # on the blade of the shoulder
    "acromion",
    "elbow_lateral", "elbow_medial", "wrist_radial", "wrist_ulnar", "wrist",  # `wrist`: a lone marker on its back
    "knuckle",  # head of the second or third metacarpal, from the back
    "fingertip",
    "trochanter", "thigh",  # `thigh`, `shank`: markers in the plane of hip, knee and ankle, as on Plug-in Gait's wands
    "knee_lateral", "knee_medial", "patella", "shank", "ankle_lateral", "ankle_medial",
    "heel", "toe",  # `toe`: head of the second metatarsal, from above
    "metatarsal_1", "metatarsal_5", "toe_tip",
    "temple", "occiput",
)
LANDMARKS = frozenset((*_CENTRE, *(f"{side}_{name}" for side in ("left", "right") for name in _SIDES)))
"""All landmarks; those of a limb or half begin with left_ or right_."""
