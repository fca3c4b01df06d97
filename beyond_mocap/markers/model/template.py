"""The skeleton that markers are fitted to, the anatomical landmarks, and the place of both on a typical body.

Every marker set translates its labels into these landmarks. Joints are named as Mixamo and LAFAN1 do. In the rest pose
the body is in a T-pose facing +X, thumbs forward, and all joints' frames are the world's: X forward, Y left, Z up. An
arm's long axis is therefore Y (left: outwards), a leg's -Z; knees and ankles bend about Y, elbows about Z.

The typical body is an adult of 1.80 m: lengths after Drillis and Contini 1966 (in Winter 2009, fig. 4.1), hips behind
and below the iliac spines after Harrington et al. 2007, the lumbar joint after Reed et al. 1999. It is used where a
marker set has no markers (a head without markers), to find the rotation of a pelvis or a thorax from any of its
landmarks, and as a reference for joint centres.
"""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

STATURE = 1.80  # metres

# joint, parent, place in the T-pose in metres (forward, left, up) from the middle between the hips; left side
_TRUNK = (("Hips", None, (0.0, 0.0, 0.0)), ("Spine", "Hips", (0.005, 0.0, 0.114)),
          ("Spine1", "Spine", (-0.015, 0.0, 0.250)), ("Chest", "Spine1", (-0.050, 0.0, 0.370)),
          ("Neck", "Chest", (-0.030, 0.0, 0.560)), ("Neck1", "Neck", (-0.015, 0.0, 0.615)),
          ("Head", "Neck1", (0.000, 0.0, 0.670)))
_ARM = (("Shoulder", "Chest", (0.035, 0.025, 0.500)), ("Scapula", "Shoulder", (-0.015, 0.165, 0.545)),
        ("Arm", "Scapula", (-0.020, 0.175, 0.505)), ("ForeArm", "Arm", (-0.020, 0.475, 0.505)),
        ("Hand", "ForeArm", (-0.020, 0.735, 0.505)))
_LEG = (("UpLeg", "Hips", (0.000, 0.086, 0.000)), ("Leg", "UpLeg", (0.000, 0.086, -0.430)),
        ("Foot", "Leg", (0.000, 0.086, -0.865)), ("ToeBase", "Foot", (0.135, 0.086, -0.908)))
_TIPS = {"Head": (0.010, 0.0, 0.865), "LeftHand": (-0.020, 0.925, 0.505), "LeftToeBase": (0.210, 0.086, -0.920)}
SCAPULAE = ("LeftScapula", "RightScapula")

# landmark -> the joint that carries it and its place as above; left side
_LANDMARKS = {
    "left_asis": ("Hips", (0.062, 0.120, 0.072)), "left_psis": ("Hips", (-0.090, 0.045, 0.103)),
    "sacrum": ("Hips", (-0.092, 0.0, 0.103)), "left_iliac_crest": ("Hips", (-0.010, 0.145, 0.125)),
    "c7": ("Chest", (-0.085, 0.0, 0.567)), "t7": ("Chest", (-0.125, 0.0, 0.420)),
    "t10": ("Chest", (-0.115, 0.0, 0.290)), "jugular_notch": ("Chest", (0.055, 0.0, 0.500)),
    "sternum": ("Chest", (0.105, 0.0, 0.330)), "left_scapula": ("Chest", (-0.130, 0.085, 0.420)),
    "left_acromion": ("LeftShoulder", (-0.020, 0.175, 0.560)), "head_front": ("Head", (0.115, 0.0, 0.770)),
    "head_back": ("Head", (-0.100, 0.0, 0.750)), "head_top": ("Head", (0.010, 0.0, 0.865)),
    "left_temple": ("Head", (0.085, 0.072, 0.785)), "left_occiput": ("Head", (-0.080, 0.065, 0.745)),
    "left_elbow_lateral": ("LeftArm", (-0.020, 0.475, 0.548)), "left_elbow_medial": ("LeftArm", (-0.020, 0.475, 0.462)),
    "left_wrist_radial": ("LeftForeArm", (0.017, 0.735, 0.510)),
    "left_wrist_ulnar": ("LeftForeArm", (-0.057, 0.735, 0.510)), "left_wrist": ("LeftForeArm", (-0.020, 0.735, 0.535)),
    "left_knuckle": ("LeftHand", (-0.010, 0.820, 0.525)), "left_fingertip": ("LeftHand", (-0.010, 0.925, 0.510)),
    "left_trochanter": ("LeftUpLeg", (-0.010, 0.170, 0.005)), "left_thigh": ("LeftUpLeg", (0.000, 0.160, -0.230)),
    "left_knee_lateral": ("LeftUpLeg", (0.000, 0.143, -0.430)),
    "left_knee_medial": ("LeftUpLeg", (0.000, 0.029, -0.430)), "left_patella": ("LeftUpLeg", (0.060, 0.086, -0.415)),
    "left_shank": ("LeftLeg", (0.000, 0.140, -0.640)), "left_ankle_lateral": ("LeftLeg", (-0.005, 0.129, -0.868)),
    "left_ankle_medial": ("LeftLeg", (0.005, 0.043, -0.858)), "left_heel": ("LeftFoot", (-0.070, 0.086, -0.893)),
    "left_toe": ("LeftFoot", (0.130, 0.090, -0.880)), "left_metatarsal_1": ("LeftFoot", (0.130, 0.056, -0.895)),
    "left_metatarsal_5": ("LeftFoot", (0.095, 0.135, -0.905)), "left_toe_tip": ("LeftToeBase", (0.200, 0.080, -0.905)),
}

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
    "elbow_lateral", "elbow_medial", "wrist_radial", "wrist_ulnar", "wrist",  # `wrist`: a single marker on its back
    "knuckle",  # head of the second or third metacarpal, from the back
    "fingertip",
    "trochanter", "thigh",  # `thigh`, `shank`: markers in the plane of hip, knee and ankle, as on Plug-in Gait's wands
    "knee_lateral", "knee_medial", "patella", "shank", "ankle_lateral", "ankle_medial",
    "heel", "toe",  # `toe`: head of the second metatarsal, from above
    "metatarsal_1", "metatarsal_5", "toe_tip",
    "temple", "occiput",
)
LANDMARKS = frozenset((*_CENTRE, *(f"{side}_{name}" for side in ("left", "right") for name in _SIDES)))
"""All landmarks; those of one side begin with left_ or right_."""


def _swap_side(name: str) -> str:
    return name.replace("Left", "Right").replace("left_", "right_")


def _mirror_place(place) -> tuple[float, float, float]:
    return (place[0], -place[1], place[2])


def _build_joints() -> tuple[dict[str, str | None], dict[str, tuple]]:
    """Build the parents and places of all joints, both sides."""
    parents, places = {}, {}
    for name, parent, place in _TRUNK:
        parents[name], places[name] = parent, place
    for side in ("Left", "Right"):
        for chain in (_ARM, _LEG):
            for name, parent, place in chain:
                parents[side + name] = parent if parent in ("Hips", "Chest") else side + parent
                places[side + name] = place if side == "Left" else _mirror_place(place)
    return parents, places


def _mirror_table(table):
    """Return a table of the left side with its mirror image added."""
    out = dict(table)
    for name, value in table.items():
        if name.lower().startswith("left"):
            row = (_swap_side(value[0]), _mirror_place(value[1])) if isinstance(value[0], str) else _mirror_place(value)
            out[_swap_side(name)] = row
    return MappingProxyType(out)


_PARENTS, _PLACES = _build_joints()
PARENTS = MappingProxyType(_PARENTS)
"""Joint -> the joint above it, None for the root; parents come first. Most skeletons have no scapulae."""
JOINTS = tuple(PARENTS)  # all joints that a segment may be carried by, parents first
PLACES = MappingProxyType({name: np.array(place) for name, place in _PLACES.items()})
"""Joint -> its place (3,) m in the T-pose of the typical body, from the middle between the hips."""
TIPS = MappingProxyType({name: np.array(place) for name, place in _mirror_table(_TIPS).items()})
"""Joint -> the place (3,) m of the tip that hangs on it, as PLACES."""
LANDMARK_PLACES = MappingProxyType({name: (row[0], np.array(row[1])) for name,
                                    row in _mirror_table(_LANDMARKS).items()})
"""Landmark -> the joint that carries it and the place (3,) m of a marker on it, as PLACES."""
