"""The model that is fitted to markers: a skeleton, where each marker lies on it, and how its joints may turn.

Limits follow the ranges of living adults (Kapandji; Boone and Azen 1979) with a margin: they stop what no body does,
and allow what throwers do (an upper arm laid back far beyond a clinic's table).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import Skeleton, freeze_array

_UNLIMITED = (-np.inf, np.inf)
_FIXED = (0.0, 0.0)
# joint (left side) -> axis order, limits in degrees of its three angles, pull to the rest pose in metres per radian
_FREEDOM_TABLE = {"Hips": ("ZYX", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.0),
                  "Spine": ("YXZ", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.01),
                  "Spine1": ("YXZ", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.01),
                  "Chest": ("YXZ", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.01),
                  "Neck": ("YXZ", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.01),
                  "Neck1": ("YXZ", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.01),
                  "Head": ("YXZ", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.01),
                  "Shoulder": ("ZXY", ((-45, 45), (-25, 60), _FIXED), 0.004),
                  "Scapula": ("ZXY", ((-45, 45), (-25, 60), (-50, 50)), 0.004),
                  "Arm": ("XZY", (_UNLIMITED, _UNLIMITED, _UNLIMITED), 0.0),
                  "ForeArm": ("ZXY", ((-165, 18), (-18, 18), (-150, 150)), 0.0),
                  "Hand": ("XZY", ((-100, 100), (-60, 60), _FIXED), 0.002),
                  "UpLeg": ("YXZ", ((-160, 75), (-75, 75), (-80, 80)), 0.0),
                  "Leg": ("YXZ", ((-25, 170), (-12, 12), (-60, 60)), 0.0),
                  "Foot": ("YXZ", ((-75, 90), (-60, 60), (-60, 60)), 0.0),
                  "ToeBase": ("YXZ", ((-80, 60), _FIXED, _FIXED), 0.002)}
_WEAK_PULL = 0.004  # pull in metres per radian of a joint with fewer markers than a technical frame needs
_WEAK_FOOT_PULL = 0.01  # heel, toe and ankle lie nearly on a line: a millimetre of skin would be 2 degrees of roll


@dataclass(frozen=True, eq=False)
class Freedom:
    """How each of J joints may turn relative to its parent, as three angles one after the other.

    Attributes:
        order: for each joint a permutation of "XYZ": intrinsic rotations about the joint's own axes, in that order (as
            `quaternion.from_euler`).
        free: (J, 3) bool, in that order; an angle that is not free stays zero.
        low: (J, 3) radians, -inf where there is no limit.
        high: (J, 3) radians, inf where there is no limit. The root's row limits its rotation; its place is free.
    Raises:
        InputError: if shapes do not match, an order is no permutation, or limits exclude zero.
    """

    order: tuple[str, ...]
    free: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "order", tuple(self.order))
        object.__setattr__(self, "free", freeze_array(self.free, dtype=bool).reshape(-1, 3))
        object.__setattr__(self, "low", freeze_array(self.low).reshape(-1, 3))
        object.__setattr__(self, "high", freeze_array(self.high).reshape(-1, 3))
        count = len(self.order)
        if not len(self.free) == len(self.low) == len(self.high) == count:
            raise InputError("model", f"freedom of {count}, {len(self.free)}, {len(self.low)}, {len(self.high)} joints")
        if any(sorted(order) != ["X", "Y", "Z"] for order in self.order):
            raise InputError("model", "an axis order that is no permutation of XYZ", "for instance ZXY")
        if not (self.low <= 0.0).all() or not (self.high >= 0.0).all():
            raise InputError("model", "limits that exclude zero", "low <= 0 <= high, in radians")


@dataclass(frozen=True)
class BallMarker:
    """A marker on the surface of a ball that a hand holds.

    Attributes:
        label: of the marker.
        joint: index of the hand.
        centre: (3,) metres, the ball's centre in the hand's frame.
        radius: metres.
    """

    label: str
    joint: int
    centre: tuple[float, float, float]
    radius: float


@dataclass(frozen=True, eq=False, kw_only=True)
class MarkerModel:
    """A body of J joints with M markers on it.

    The cost of a pose is the sum over the markers of weight x distance^2, plus the sum over the joints of (stiffness x
    angle)^2.

    Attributes:
        skeleton: rest pose is a T-pose facing +X, all joint frames equal the world's (`template`).
        markers: M labels.
        joint: (M,) index of the joint that carries each marker.
        places: (M, 3) metres in that joint's frame.
        sigma: (M,) metres by which a marker deviates from its place (root mean square per coordinate).
        edge_sigma: (M,) root of eq. 5.4 for the marker's cluster: how far its edges deviate, as a share of their length
            (Fredriksson section 5.3.2); NaN for a single marker.
        freedom: how the joints may turn.
        stiffness: (J,) metres per radian, pull towards the rest pose. Zero for joints that markers determine; small for
            spine and neck, whose joints share evenly what only their ends show (section 5.3.1).
        centre_sigma: (J,) metres, uncertainty of the joint's centre.
        ball: how a ball with a marker lies in the hand, where that is known.
        subject: whose model it is.
        sessions: names of the recordings that it was built from.
        set_name: name of its marker set.
        notes: messages on how it was built.
    Raises:
        InputError: if shapes do not match, or a value is out of range.
    """

    skeleton: Skeleton
    markers: tuple[str, ...]
    joint: np.ndarray
    places: np.ndarray
    sigma: np.ndarray
    edge_sigma: np.ndarray
    freedom: Freedom
    stiffness: np.ndarray
    centre_sigma: np.ndarray
    ball: BallMarker | None = None
    subject: str = ""
    sessions: tuple[str, ...] = ()
    set_name: str = ""
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self):
        for name in ("markers", "sessions", "notes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        object.__setattr__(self, "joint", freeze_array(self.joint, dtype=int).reshape(-1))
        object.__setattr__(self, "places", freeze_array(self.places).reshape(-1, 3))
        for name in ("sigma", "edge_sigma", "stiffness", "centre_sigma"):
            object.__setattr__(self, name, freeze_array(getattr(self, name)).reshape(-1))
        self._check()

    def _check(self):
        """Raise InputError for shapes, names and values that are not valid."""
        count, joints = len(self.markers), len(self.skeleton)
        if not count:
            raise InputError("model", "no markers", "at least three")
        if not len(self.joint) == len(self.places) == len(self.sigma) == len(self.edge_sigma) == count:
            raise InputError("model", f"{count} markers, {len(self.places)} places, {len(self.joint)} joints of them")
        if not len(self.freedom.order) == len(self.stiffness) == len(self.centre_sigma) == joints:
            found = f"{joints} joints, {len(self.freedom.order)} freedoms, {len(self.stiffness)} pulls"
            raise InputError("model", found)
        if len(set(self.markers)) != count:
            raise InputError("model", "two markers with one name", "unique labels")
        if self.joint.min() < 0 or self.joint.max() >= joints:
            raise InputError("model", "a marker on a joint that does not exist", f"0 to {joints - 1}")
        if not np.isfinite(self.places).all() or not (self.sigma > 0.0).all():
            raise InputError("model", "a marker's place or sigma is not a number", "metres, sigma above 0")
        if not (self.stiffness >= 0.0).all():
            raise InputError("model", "a stiffness below zero", "metres per radian")

    def collect_clusters(self) -> dict[int, np.ndarray]:
        """Return joint -> indices of the markers that it carries."""
        return {int(joint): np.flatnonzero(self.joint == joint) for joint in np.unique(self.joint)}


def build_freedom(joints: Sequence[str], parents: Sequence[int], counts: Mapping[str, int]) -> tuple[Freedom,
        np.ndarray]:
    """Build freedom and stiffness of joints.

    Args:
        joints: J joint names, parents first.
        parents: (J,) index of each joint's parent.
        counts: joint -> number of markers that it carries. A joint without markers on it or below it cannot turn.
    Returns:
        The freedom, and (J,) metres per radian.
    """
    below = [counts.get(name, 0) for name in joints]
    # `below`: markers on each joint and all joints below it, summed from the tips to the root
    for index in range(len(joints) - 1, 0, -1):
        below[parents[index]] += below[index]
    orders, limits, pulls = [], [], []
    for name, under in zip(joints, below):
        part = name.removeprefix("Left").removeprefix("Right")
        order, ranges, pull = _FREEDOM_TABLE[part]
        if not under:
            ranges = (_FIXED, _FIXED, _FIXED)
        elif name.startswith("Right"):  # mirrored across the plane of X and Z: turns about X and Z change their sign
            ranges = tuple(span if axis == "Y" else (-span[1], -span[0]) for axis, span in zip(order, ranges))
        orders.append(order)
        limits.append(np.radians(ranges))
        weak = _WEAK_FOOT_PULL if part == "Foot" else _WEAK_PULL
        pulls.append(pull if pull or counts.get(name, 0) >= 3 or name == "Hips" else weak)
    limits = np.array(limits)
    return Freedom(tuple(orders), limits[..., 1] > limits[..., 0], limits[..., 0], limits[..., 1]), np.array(pulls)
