"""How joints of the body may turn: axis orders, which angles are free, limits, and the pull of joints that markers
hardly tell.

Limits follow the ranges of living adults (Kapandji; Boone and Azen 1979) with a margin: they stop what no body does,
and leave throwers what they do (an upper arm laid back far beyond a clinic's table).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .model import Freedom

_ANY = (-np.inf, np.inf)
_NONE = (0.0, 0.0)
# joint (left side) -> axis order, limits in degrees of each of its three angles, pull in metres per radian
_TABLE = {
    "Hips": ("ZYX", (_ANY, _ANY, _ANY), 0.0),
    "Spine": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
    "Spine1": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
    "Chest": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
    "Neck": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
    "Neck1": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
    "Head": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
    "Shoulder": ("ZXY", ((-45, 45), (-25, 60), _NONE), 0.004),
    "Scapula": ("ZXY", ((-45, 45), (-25, 60), (-50, 50)), 0.004),
    "Arm": ("XZY", (_ANY, _ANY, _ANY), 0.0),
    "ForeArm": ("ZXY", ((-165, 18), (-18, 18), (-150, 150)), 0.0),
    "Hand": ("XZY", ((-100, 100), (-60, 60), _NONE), 0.002),
    "UpLeg": ("YXZ", ((-160, 75), (-75, 75), (-80, 80)), 0.0),
    "Leg": ("YXZ", ((-25, 170), (-12, 12), (-60, 60)), 0.0),
    "Foot": ("YXZ", ((-75, 90), (-60, 60), (-60, 60)), 0.0),
    "ToeBase": ("YXZ", ((-80, 60), _NONE, _NONE), 0.002),
}
_WEAK = 0.004  # pull in metres per radian of a joint whose own markers are fewer than a technical frame needs
_WEAK_FOOT = 0.01  # heel and toe lie nearly on a line with the ankle: a millimetre of skin would be 2 degrees of roll


def freedom_of(joints: Sequence[str], parents: Sequence[int], counts: Mapping[str, int]) -> tuple[Freedom, np.ndarray]:
    """Freedom and stiffness (J,) of these joints.

    counts: joint -> number of markers it carries. A joint with no marker on it nor on anything below it is held.
    """
    below = [counts.get(name, 0) for name in joints]
    for index in range(len(joints) - 1, 0, -1):
        below[parents[index]] += below[index]
    orders, limits, pulls = [], [], []
    for name, under in zip(joints, below):
        part = name.removeprefix("Left").removeprefix("Right")
        order, ranges, pull = _TABLE[part]
        if not under:
            ranges = (_NONE, _NONE, _NONE)
        elif name.startswith("Right"):  # mirrored across the plane of X and Z: turns about X and Z change their sign
            ranges = tuple(span if axis == "Y" else (-span[1], -span[0]) for axis, span in zip(order, ranges))
        orders.append(order)
        limits.append(np.radians(ranges))
        weak = _WEAK_FOOT if part == "Foot" else _WEAK
        pulls.append(pull if pull or counts.get(name, 0) >= 3 or name == "Hips" else weak)
    limits = np.array(limits)
    return Freedom(tuple(orders), limits[..., 1] > limits[..., 0], limits[..., 0], limits[..., 1]), np.array(pulls)
