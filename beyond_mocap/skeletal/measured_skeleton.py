"""The skeleton of a person whose joints are seen: the project's adult with the measured length of each bone."""

from __future__ import annotations

import numpy as np

from ..motion.retargeting.adult import ADULT_LEG, build_adult_skeleton
from ..motion.skeleton import Skeleton

_BONES = (("Leg", "hip", "knee"), ("Foot", "knee", "ankle"), ("ForeArm", "shoulder", "elbow"),
          ("Hand", "elbow", "wrist"))
_TRUNK = ("Spine", "Spine1", "Spine2")
_RANGE = (0.7, 1.4)  # of the adult's own proportions: what lies beyond is a wrong joint


def build_measured_skeleton(joints: dict[str, np.ndarray]) -> Skeleton:
    """Build the skeleton; left and right are equally long, as they are but for a few millimetres.

    Args:
        joints: landmark -> (T, 3) metres, smoothed; hips, knees, ankles and shoulders at least.
    Returns:
        22 joints in the adult's rest pose.
    """
    adult = build_adult_skeleton()
    offsets, tips = np.array(adult.offsets), np.array(adult.end_offsets)
    index = {name: number for number, name in enumerate(adult.names)}
    size = (_measure_both(joints, "hip", "knee") + _measure_both(joints, "knee", "ankle")) / ADULT_LEG
    offsets, tips = offsets * size, tips * size
    for side in ("Left", "Right"):
        for name, first, last in _BONES:
            _set_length(offsets, index[side + name], _measure_both(joints, first, last))
        if "left_toe" in joints and "right_toe" in joints:
            _set_length(offsets, index[side + "ToeBase"], _measure_both(joints, "ankle", "toe"))
    _set_width(offsets, index, "UpLeg", 0.5 * _measure(joints["left_hip"], joints["right_hip"]))
    _fit_trunk(offsets, index, joints)
    return Skeleton(adult.names, adult.parents, offsets, adult.end_parents, tips)


def _fit_trunk(offsets: np.ndarray, index: dict[str, int], joints: dict[str, np.ndarray]) -> None:
    """Give the trunk the measured height from hips to shoulders, and the shoulders their width, in place."""
    shoulders = 0.5 * (joints["left_shoulder"] + joints["right_shoulder"])
    measured = _measure(0.5 * (joints["left_hip"] + joints["right_hip"]), shoulders)
    height = sum(offsets[index[name]] for name in (*_TRUNK, "LeftShoulder", "LeftArm")) - offsets[index["LeftUpLeg"]]
    factor = float(np.clip(measured / np.hypot(height[0], height[2]), *_RANGE))
    for name in (*_TRUNK, "LeftShoulder", "RightShoulder"):
        offsets[index[name]] *= factor
    width = 0.5 * _measure(joints["left_shoulder"], joints["right_shoulder"])
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        beside = sign * offsets[index[f"{side}Shoulder"], 1]
        offsets[index[f"{side}Arm"], 1] = sign * max(width - beside, 0.3 * width)


def _set_width(offsets: np.ndarray, index: dict[str, int], part: str, half: float) -> None:
    """Set how far the joints of both sides are from the middle, in place, within `_RANGE` of the adult's."""
    usual = offsets[index[f"Left{part}"], 1]
    half = float(np.clip(half, _RANGE[0] * usual, _RANGE[1] * usual))
    offsets[index[f"Left{part}"], 1], offsets[index[f"Right{part}"], 1] = half, -half


def _set_length(offsets: np.ndarray, joint: int, length: float | None) -> None:
    """Set the length of a bone, in place; within `_RANGE` of the adult's, and the adult's where it is not seen."""
    usual = float(np.linalg.norm(offsets[joint]))
    if length is not None:
        offsets[joint] *= float(np.clip(length / usual, *_RANGE))


def _measure_both(joints: dict[str, np.ndarray], first: str, last: str):
    """Measure the mean length of a bone of both sides; None where neither is seen."""
    found = [_measure(joints[f"{side}_{first}"], joints[f"{side}_{last}"]) for side in ("left", "right")
             if f"{side}_{first}" in joints and f"{side}_{last}" in joints]
    return float(np.mean(found)) if found else None


def _measure(first: np.ndarray, last: np.ndarray) -> float:
    """Measure the median distance of two joints."""
    return float(np.median(np.linalg.norm(first - last, axis=1)))
