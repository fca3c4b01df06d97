"""Places of markers on a body, and how skin moves them: real marker sets, for bodies in the axes of marker models.

Places follow the palpation points of Plug-in Gait (Vicon), the sets of baseball pitching and sprinting laboratories,
and the widths of an adult's joints with the marker's own radius of 7 mm. The pelvis' four markers follow from its hip
joints by the inverse of Harrington et al. 2007 (J. Biomech. 40, 595-602: centres 0.24 depth + 9.9 mm behind, 0.30 width
+ 10.9 mm below and 0.33 width + 7.3 mm beside the middle of the front spines). Each place varies by some millimetres,
as with the hands that attach markers.

Soft tissue has two parts, as measured on pins in bones (Cappozzo et al. 1996, Clin. Biomech. 11, 90-100; Camomilla et
al. 2017, J. Biomech. 62, 5-13): a shift that follows the angles of the joints beside the segment, of which a share is
common to the whole cluster (no rigid fit can see it) and the rest is each marker's own; and flesh that lags behind
shocks as a damped mass does. Directions are drawn once for a body and a marker; they do not change from trial to trial.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from ...motion.skeleton import Skeleton
from .synthetic_body import compute_size

_FOOT_OFFSET = (0.133, 0.0, -0.054)  # m from an adult's ankle to the toe joint
_HEEL_DROP = 0.034  # m: least height of the ankle above a heel's marker
_DEPTH, _TILT = 0.62, np.radians(9.0)  # of a pelvis: depth in widths; rad by which its front spines are lower
_COMMON_SHARE = 0.45  # share of the shift that is common to a whole cluster
_FLESH_RATE, _DAMPING = 11.0, 0.35  # natural frequency of flesh in Hz, and its damping ratio
_LONGEST_LAG = 0.02  # m: most that flesh lags behind a shock


@dataclass(frozen=True)
class Place:
    """Place of one marker on the left side or in the middle.

    Attributes:
        on: the joint that carries it.
        to: joint toward which the place starts ("shoulders": the middle between both), or None.
        share: share of the bone from `on` to `to` at which the place starts.
        offset: mm from there (forward, left, up in a T-pose) on an adult.
        soft: mm by which the skin under it shifts when a joint beside it bends by one radian.
        wobble: how much it lags behind shocks, from 0 (bone) to 1 (a thigh's flesh).
    """

    on: str
    to: str | None
    share: float
    offset: tuple[float, float, float]
    soft: float
    wobble: float


def _place_on_head(x, y, z):
    return Place("Head", None, 0.0, offset=(x, y, z), soft=1.5, wobble=0.1)


def _place_on_trunk(x, y, z, soft=7.0):
    return Place("Chest", "shoulders", 1.0, offset=(x, y, z), soft=soft, wobble=0.35)


def _place_on_arm(share, x, z, soft=9.0):
    return Place("Arm", "ForeArm", share, offset=(x, 0.0, z), soft=soft, wobble=0.5)


def _place_on_forearm(share, x, y, z, soft=4.0):
    return Place("ForeArm", "Hand", share, offset=(x, y, z), soft=soft, wobble=0.3)


def _place_on_hand(x, y, z):
    return Place("Hand", None, 0.0, offset=(x, y, z), soft=1.0, wobble=0.1)


def _place_on_thigh(share, x, y, soft=14.0, wobble=1.0):
    return Place("UpLeg", "Leg", share, offset=(x, y, 0.0), soft=soft, wobble=wobble)


def _place_on_shank(share, x, y, soft=6.0, wobble=0.5):
    return Place("Leg", "Foot", share, offset=(x, y, 0.0), soft=soft, wobble=wobble)


def _place_on_foot(to, x, y, z):
    return Place("Foot", to, 1.0 if to else 0.0, offset=(x, y, z), soft=2.0, wobble=0.1)


MIDDLE = {
    "C7": _place_on_trunk(-78, 0, 45), "T7": _place_on_trunk(-98, 0, -120), "T10": _place_on_trunk(-95, 0, -195, 9.0),
    "CLAV": _place_on_trunk(62, 0, -15, 5.0), "MAN": _place_on_trunk(60, 0, -12, 5.0),
    "STRN": _place_on_trunk(92, 0, -150, 8.0), "RBAK": _place_on_trunk(-105, -95, -80, 9.0),
    "LBAK": _place_on_trunk(-105, 95, -80, 9.0), "SACR": Place("Hips", None, 0.0, offset=(0, 0, 0), soft=4.0,
                                                               wobble=0.4),
    "P1": Place("Hips", None, 0.0, offset=(-14, 0, -42), soft=5.0, wobble=0.5),
    "P2": Place("Hips", None, 0.0, offset=(-10, 36, -22), soft=5.0, wobble=0.5),
    "P3": Place("Hips", None, 0.0, offset=(-10, -36, -22), soft=5.0, wobble=0.5),
}  # fmt: skip
SIDED = {
    "FHD": _place_on_head(95, 62, 95), "BHD": _place_on_head(-85, 62, 80), "EAR": _place_on_head(5, 80, 50),
    "SHO": Place("Shoulder", "Arm", 1.0, offset=(0, -6, 50), soft=8.0, wobble=0.4),
    "ACR": Place("Shoulder", "Arm", 1.0, offset=(0, -6, 50), soft=8.0, wobble=0.4),
    "SH": Place("Shoulder", "Arm", 1.0, offset=(0, -6, 50), soft=8.0, wobble=0.4), "UPA": _place_on_arm(0.5, 8, 50),
    "UPB": _place_on_arm(0.35, -38, 22), "ARM": _place_on_arm(0.55, -8, 48), "ELB": _place_on_arm(1.0, 0, 43, 5.0),
    "MELB": _place_on_arm(1.0, 0, -43, 5.0), "ELBM": _place_on_arm(1.0, 0, -43, 5.0),
    "FRM": _place_on_forearm(0.45, 12, 0, 40), "FOREARM": _place_on_forearm(0.5, 8, 0, 38),
    "WRA": _place_on_forearm(1.0, 35, -4, 4, 2.5), "WRB": _place_on_forearm(1.0, -35, -4, 4, 2.5),
    "WR": _place_on_forearm(1.0, 0, -6, 28, 2.5), "FIN": _place_on_hand(6, 82, 17), "HNDI": _place_on_hand(26, 78, 15),
    "HNDO": _place_on_hand(-30, 70, 15), "THI": _place_on_thigh(0.6, 12, 80), "THLP": _place_on_thigh(0.3, -5, 92),
    "THLD": _place_on_thigh(0.65, -3, 76), "THAP": _place_on_thigh(0.35, 85, 28), "THAD": _place_on_thigh(0.65, 74, 20),
    "THIB": _place_on_thigh(0.45, 60, 62), "KNE": _place_on_thigh(1.0, 0, 57, 6.0, 0.4),
    "MKNE": _place_on_thigh(1.0, 0, -57, 6.0, 0.4), "LEPI": _place_on_thigh(1.0, 0, 57, 6.0, 0.4),
    "MEPI": _place_on_thigh(1.0, 0, -57, 6.0, 0.4), "PAT": _place_on_thigh(0.98, 58, 2, 8.0, 0.4),
    "TIB": _place_on_shank(0.5, 8, 58), "TIBB": _place_on_shank(0.35, 48, 22), "TIAP": _place_on_shank(0.2, 52, 6),
    "TIAD": _place_on_shank(0.6, 45, 4), "TILAT": _place_on_shank(0.45, 6, 58),
    "ANK": _place_on_shank(1.0, 0, 43, 1.5, 0.1), "MANK": _place_on_shank(1.0, 0, -43, 1.5, 0.1),
    "LMAL": _place_on_shank(1.0, 0, 43, 1.5, 0.1), "MMAL": _place_on_shank(1.0, 0, -43, 1.5, 0.1),
    "HEE": _place_on_foot(None, -52, 0, 12), "HEEL": _place_on_foot(None, -52, 0, 12),
    "MFS": _place_on_foot("ToeBase", -62, 6, 34), "MFL": _place_on_foot("ToeBase", -50, 46, 14),
    "TOE": _place_on_foot("ToeBase", 0, 2, 14), "P1MT": _place_on_foot("ToeBase", 4, -38, 12),
    "MT1": _place_on_foot("ToeBase", 4, -38, 12), "P5MT": _place_on_foot("ToeBase", -18, 44, 10),
    "MT5": _place_on_foot("ToeBase", -18, 44, 10), "HLX": Place("ToeBase", None, 0.0, offset=(55, -12, 14), soft=1.5,
                                                                wobble=0.1),
    "ASI": Place("Hips", None, 0.0, offset=(0, 0, 0), soft=6.0, wobble=0.4),
    "PSI": Place("Hips", None, 0.0, offset=(0, 0, 0), soft=4.0, wobble=0.4),
}  # fmt: skip
# where shoulder blades are tracked separately
_ON_BLADE = Place("Shoulder", "Arm", 1.0, offset=(-98, -78, -85), soft=9.0, wobble=0.4)
_PIG = (
    "LFHD RFHD LBHD RBHD C7 T10 CLAV STRN RBAK LSHO LUPA LELB LFRM LWRA LWRB LFIN RSHO RUPA RELB RFRM RWRA RWRB RFIN "
    "LASI RASI LPSI RPSI LTHI LKNE LTIB LANK LHEE LTOE RTHI RKNE RTIB RANK RHEE RTOE"
)
_LEG_OF_SPRINTER = (
    "{0}THLP {0}THLD {0}THAP {0}THAD {0}LEPI {0}PAT {0}MEPI {0}TIAP {0}TIAD {0}TILAT {0}LMAL {0}MMAL {0}HEEL {0}MFS "
    "{0}MFL {0}P1MT {0}TOE {0}P5MT"
)
SETS = {
    "plug_in_gait": tuple(_PIG.split()),
    "driveline": tuple((_PIG + " LMELB RMELB LMKNE RMKNE LMANK RMANK").split()),
    "sprinter": tuple(
        (
            "C7 RSH LSH MAN T7 LARM LELB LFOREARM LWR RARM RELB RFOREARM RWR RASI LASI SACR P1 P2 P3 "
            + _LEG_OF_SPRINTER.format("L") + " " + _LEG_OF_SPRINTER.format("R")
        ).split()
    ),
    "full": tuple(
        (
            "LASI RASI LPSI RPSI LFHD RFHD LBHD RBHD C7 T10 CLAV STRN LACR LBAK RACR RBAK LUPA LELB LMELB RUPA RELB "
            "RMELB LFRM LWRA LWRB RFRM RWRA RWRB LFIN RFIN LTHI LKNE LMKNE RTHI RKNE RMKNE LTIB LANK LMANK RTIB RANK "
            "RMANK LHEE LMT1 LMT5 RHEE RMT1 RMT5 LHLX RHLX"
        ).split()
    ),
    "lower_body": tuple("LASI RASI LPSI RPSI LTHI LKNE LTIB LANK LHEE LTOE RTHI RKNE RTIB RANK RHEE RTOE".split()),
}
"""Labels of the marker sets that can be synthesized."""
STATIC_ONLY = {"sprinter": ("LMEPI", "RMEPI", "LMMAL", "RMMAL")}
"""Markers that are removed after the static trial."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MarkerPlacement:
    """M markers on a skeleton.

    Attributes:
        labels: labels.
        joint: (M,) joint that carries each.
        places: (M, 3) m in the joint's axes.
        soft: (M,) m/rad, shift of the skin under it.
        wobble: (M,) how much it lags behind shocks.
    """

    labels: tuple[str, ...]
    joint: np.ndarray
    places: np.ndarray
    soft: np.ndarray
    wobble: np.ndarray


def place_markers(skeleton: Skeleton, labels: tuple[str, ...], seed: int, scatter: float = 0.003) -> MarkerPlacement:
    """Place markers on a skeleton.

    Args:
        skeleton: as `to_marker_axes` gives it.
        labels: labels; those without a joint on the skeleton are left out.
        seed: of the scatter.
        scatter: standard deviation, m.
    Returns:
        The markers.
    """
    rng = np.random.default_rng(seed)
    size = compute_size(skeleton)
    rows = []
    for label in labels:
        found = _find_place(label, "LACR" in labels)
        shift = rng.normal(0.0, scatter, 3)
        if found is None or found[1] + found[0].on not in skeleton.names:
            continue
        place, side = found
        rows.append((label, skeleton.index(side + place.on), _compute_place(skeleton, label, place, side, size) + shift,
                     place))
    return MarkerPlacement(labels=tuple(row[0] for row in rows), joint=np.array([row[1] for row in rows], int),
                           places=np.array([row[2] for row in rows]), soft=np.array([row[3].soft for row in rows])
                           * 1e-3, wobble=np.array([row[3].wobble for row in rows]))


def _find_place(label: str, blades: bool) -> tuple[Place, str] | None:
    """Find the place of a label, and the side's prefix of its joint; blades: whether shoulder blades are tracked
    separately.
    """
    if blades and label in ("LBAK", "RBAK"):
        return _ON_BLADE, {"L": "Left", "R": "Right"}[label[0]]
    if label in MIDDLE:
        return MIDDLE[label], ""
    place = SIDED.get(label[1:])
    if place is None or label[0] not in "LR":
        return None
    sided = place.on in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
    return place, {"L": "Left", "R": "Right"}[label[0]] if sided else ""


def _compute_place(skeleton: Skeleton, label: str, place: Place, side: str, size: float) -> np.ndarray:
    """Compute the place (3,) m of a marker in its joint's axes."""
    mirrored = -1.0 if side == "Right" or (label[0] == "R" and label not in MIDDLE) else 1.0
    offset = np.array(place.offset) * [1.0, mirrored, 1.0] * 1e-3 * size
    if place.on == "Hips":
        return _place_on_pelvis(skeleton, label) + offset
    if place.to == "shoulders":
        return _find_shoulder_centre(skeleton) + offset
    if label[1:] in ("HEE", "HEEL"):  # as high as the toes, and some centimetres below the ankle on any rig
        toes = _find_offset(skeleton, side + "ToeBase")[2]
        return offset * [1.0, 1.0, 0.0] + [0.0, 0.0, min(toes + offset[2], -_HEEL_DROP * size)]
    return place.share * _find_offset(skeleton, side + place.to) + offset if place.to else offset


def _find_offset(skeleton: Skeleton, name: str) -> np.ndarray:
    """Offset (3,) m of a joint from its parent at rest; zero if there is no such joint, an average foot if there are no
    toes.
    """
    if name in skeleton.names:
        return skeleton.offsets[skeleton.index(name)]
    return np.array(_FOOT_OFFSET) * compute_size(skeleton) if name.endswith("ToeBase") else np.zeros(3)


def _find_shoulder_centre(skeleton: Skeleton) -> np.ndarray:
    """Compute the vector (3,) m from the chest's joint to the middle of both shoulder joints, or to the neck without
    arms.
    """
    arms = [_find_offset(skeleton, side + "Shoulder") + _find_offset(skeleton, side + "Arm")
            for side in ("Left", "Right")]
    return np.mean(arms, axis=0) if "LeftArm" in skeleton.names else _find_offset(skeleton, "Neck")


def _place_on_pelvis(skeleton: Skeleton, label: str) -> np.ndarray:
    """Compute a spine of the pelvis, or the sacrum's middle, in the hips' axes (3,) m."""
    left, right = (skeleton.offsets[skeleton.index(side + "UpLeg")] for side in ("Left", "Right"))
    half = 0.5 * np.linalg.norm(left - right)
    width = max((half - 0.0073) / 0.33, 0.12)
    depth = _DEPTH * width
    forward, up = 0.24 * depth + 0.0099, 0.30 * width + 0.0109
    tilted = np.array([[np.cos(_TILT), 0.0, np.sin(_TILT)], [0.0, 1.0, 0.0], [-np.sin(_TILT), 0.0, np.cos(_TILT)]])
    side = {"L": 1.0, "R": -1.0}.get(label[0], 0.0)
    local = np.array([forward, 0.5 * width * side, up])
    if not label.endswith("ASI"):
        local = np.array([forward - depth, 0.2 * width * side * label.endswith("PSI"), up])
    return 0.5 * (left + right) + tilted @ local


def compute_rigid_markers(motion: Motion, placement: MarkerPlacement) -> np.ndarray:
    """Compute markers that are rigid on their bones.

    Args:
        motion: the motion, T frames.
        placement: M markers.
    Returns:
        (T, M, 3) m, world frame.
    """
    positions, turns = forward_kinematics(motion)
    return positions[:, placement.joint] + quaternion.rotate(turns[:, placement.joint], placement.places)


def compute_skin_markers(motion: Motion, placement: MarkerPlacement, neutral: np.ndarray, seed: int,
                         softness: float = 1.0) -> np.ndarray:
    """Compute markers that the skin moves over the bones.

    Args:
        motion: the motion, T frames.
        placement: M markers.
        neutral: (J, 4) local rotations in which no skin is shifted.
        seed: of the directions of the shifts.
        softness: factor on all shifts; 0: bone.
    Returns:
        (T, M, 3) m, world frame.
    """
    rigid = compute_rigid_markers(motion, placement)
    if softness <= 0.0:
        return rigid
    _, turns = forward_kinematics(motion)
    shift = quaternion.rotate(turns[:, placement.joint], _compute_shifts(motion, placement, neutral, seed))
    return rigid + softness * (shift + placement.wobble[:, None] * _simulate_lag(rigid, motion.fps))


def _compute_shifts(motion: Motion, placement: MarkerPlacement, neutral: np.ndarray, seed: int) -> np.ndarray:
    """Compute the shifts (T, M, 3) m, in the segments' axes, that follow the joints' angles."""
    rng = np.random.default_rng(seed)
    bends = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(neutral), motion.rotations))
    shifts = np.zeros((len(motion), len(placement.labels), 3))
    for joint in np.unique(placement.joint):
        beside = _adjacent_bends(motion, int(joint), bends)
        common = _choose_directions(rng)
        for marker in np.flatnonzero(placement.joint == joint):
            mix = _COMMON_SHARE * common + np.sqrt(1.0 - _COMMON_SHARE**2) * _choose_directions(rng)
            shifts[:, marker] = placement.soft[marker] * beside @ mix
    return shifts


def _adjacent_bends(motion: Motion, joint: int, bends: np.ndarray) -> np.ndarray:
    """Compute the bends (T, 6) rad of the joint above a segment (none for the root) and of the one below, limited to a
    radian.
    """
    children = motion.skeleton.children(joint)
    own = bends[:, joint] if joint else np.zeros((len(motion), 3))
    below = np.mean([bends[:, child] for child in children], axis=0) if children else np.zeros((len(motion), 3))
    return np.tanh(np.concatenate([own, below], axis=1))


def _choose_directions(rng: np.random.Generator) -> np.ndarray:
    """Choose for each of six bends a direction of about unit length in which the skin shifts: (6, 3)."""
    return rng.normal(0.0, 1.0 / np.sqrt(3.0), (6, 3)) * np.repeat([0.8, 0.6], 3)[:, None]


def _simulate_lag(rigid: np.ndarray, fps: float) -> np.ndarray:
    """Simulate how a damped mass on each marker lags behind it, (T, M, 3) m, limited to some centimetres."""
    from scipy.signal import cont2discrete, lfilter

    pull = 2.0 * np.pi * _FLESH_RATE
    if fps < 4.0 * _FLESH_RATE or len(rigid) < 8:
        return np.zeros_like(rigid)
    acceleration = np.gradient(np.gradient(rigid, axis=0), axis=0) * fps**2
    above, below, _ = cont2discrete(([1.0], [1.0, 2.0 * _DAMPING * pull, pull**2]), 1.0 / fps, "bilinear")
    lag = -lfilter(np.ravel(above), below, acceleration, axis=0)
    length = np.linalg.norm(lag, axis=-1, keepdims=True)
    return lag * np.where(length > 1e-9, _LONGEST_LAG * np.tanh(length / _LONGEST_LAG) / np.maximum(length, 1e-9), 1.0)
