"""The model that is fitted to markers: a skeleton, where each marker lies on it, and how its joints may turn.

Limits follow the ranges of living adults (Kapandji; Boone and Azen 1979) with a margin: they stop what no body does,
and leave throwers what they do (an upper arm laid back far beyond a clinic's table).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import Skeleton, frozen_array

_ANY = (-np.inf, np.inf)
_NONE = (0.0, 0.0)
# joint (left side) -> axis order, limits in degrees of each of its three angles, pull in metres per radian
_TABLE = {"Hips": ("ZYX", (_ANY, _ANY, _ANY), 0.0), "Spine": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
          "Spine1": ("YXZ", (_ANY, _ANY, _ANY), 0.01), "Chest": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
          "Neck": ("YXZ", (_ANY, _ANY, _ANY), 0.01), "Neck1": ("YXZ", (_ANY, _ANY, _ANY), 0.01),
          "Head": ("YXZ", (_ANY, _ANY, _ANY), 0.01), "Shoulder": ("ZXY", ((-45, 45), (-25, 60), _NONE), 0.004),
          "Scapula": ("ZXY", ((-45, 45), (-25, 60), (-50, 50)), 0.004), "Arm": ("XZY", (_ANY, _ANY, _ANY), 0.0),
          "ForeArm": ("ZXY", ((-165, 18), (-18, 18), (-150, 150)), 0.0),
          "Hand": ("XZY", ((-100, 100), (-60, 60), _NONE), 0.002),
          "UpLeg": ("YXZ", ((-160, 75), (-75, 75), (-80, 80)), 0.0),
          "Leg": ("YXZ", ((-25, 170), (-12, 12), (-60, 60)), 0.0),
          "Foot": ("YXZ", ((-75, 90), (-60, 60), (-60, 60)), 0.0), "ToeBase": ("YXZ", ((-80, 60), _NONE, _NONE), 0.002)}
_WEAK = 0.004  # pull in metres per radian of a joint whose own markers are fewer than a technical frame needs
_WEAK_FOOT = 0.01  # heel and toe lie nearly on a line with the ankle: a millimetre of skin would be 2 degrees of roll


@dataclass(frozen=True, eq=False)
class Freedom:
    """How each of J joints may turn against its parent, as three angles one after the other.

    order: per joint a permutation of "XYZ": intrinsic turns about the joint's own axes, in that order (as
    `quaternion.from_euler`). free: (J, 3) bool, in that order; an angle that is not free stays zero. low, high: (J, 3)
    radians, -inf and inf where nothing stops it. The root's row speaks of its rotation; it may be anywhere."""

    order: tuple[str, ...]
    free: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "order", tuple(self.order))
        object.__setattr__(self, "free", frozen_array(self.free, dtype=bool).reshape(-1, 3))
        object.__setattr__(self, "low", frozen_array(self.low).reshape(-1, 3))
        object.__setattr__(self, "high", frozen_array(self.high).reshape(-1, 3))
        count = len(self.order)
        if not len(self.free) == len(self.low) == len(self.high) == count:
            raise InputError("model", f"freedom of {count}, {len(self.free)}, {len(self.low)}, {len(self.high)} joints")
        if any(sorted(order) != ["X", "Y", "Z"] for order in self.order):
            raise InputError("model", "an axis order that is no permutation of XYZ", "for instance ZXY")
        if not (self.low <= 0.0).all() or not (self.high >= 0.0).all():
            raise InputError("model", "limits that leave out zero", "low <= 0 <= high, in radians")


@dataclass(frozen=True)
class BallMarker:
    """A marker on the surface of a ball that a hand holds.

    label: the marker. joint: index of the hand. centre: (3,) m, the ball's centre in the hand's frame. radius: m."""

    label: str
    joint: int
    centre: tuple[float, float, float]
    radius: float


@dataclass(frozen=True, eq=False, kw_only=True)
class MarkerModel:
    """A body of J joints with M markers on it.

    skeleton: rest pose = T-pose facing +X, all frames the world's (`template`). markers: M labels. joint: (M,) index of
    the joint that carries each. places: (M, 3) m in that joint's frame. sigma: (M,) m, how far a marker strays from its
    place (root mean square a coordinate). edge_sigma: (M,), root of eq. 5.4 for the marker's cluster: how far, as a
    share of their length, its edges stray (Fredriksson §5.3.2); NaN for a lone marker. freedom: how the joints turn.
    stiffness: (J,) metres per radian, a pull towards the rest pose: the cost of a pose is the sum over the markers of
    weight x distance^2, plus that over the joints of (stiffness x angle)^2. Zero for joints that markers tell; small
    for spine and neck, whose joints share out evenly what only their ends show (§5.3.1). centre_sigma: (J,) m, how
    uncertain the centre of the joint is. ball: how a ball with a marker lies in the hand, where that is known. subject,
    sessions, set_name: whose model it is, out of which recordings and of which marker set. notes: lines for people on
    how it was found."""

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
        object.__setattr__(self, "joint", frozen_array(self.joint, dtype=int).reshape(-1))
        object.__setattr__(self, "places", frozen_array(self.places).reshape(-1, 3))
        for name in ("sigma", "edge_sigma", "stiffness", "centre_sigma"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)).reshape(-1))
        self._check()

    def _check(self):
        count, joints = len(self.markers), len(self.skeleton)
        if not count:
            raise InputError("model", "no markers", "at least three")
        if not len(self.joint) == len(self.places) == len(self.sigma) == len(self.edge_sigma) == count:
            raise InputError("model", f"{count} markers, {len(self.places)} places, {len(self.joint)} joints of them")
        if not len(self.freedom.order) == len(self.stiffness) == len(self.centre_sigma) == joints:
            found = f"{joints} joints, {len(self.freedom.order)} freedoms, {len(self.stiffness)} pulls"
            raise InputError("model", found)
        if len(set(self.markers)) != count:
            raise InputError("model", "two markers of one name", "unique labels")
        if self.joint.min() < 0 or self.joint.max() >= joints:
            raise InputError("model", "a marker on a joint that is not there", f"0 to {joints - 1}")
        if not np.isfinite(self.places).all() or not (self.sigma > 0.0).all():
            raise InputError("model", "a marker's place or sigma is no number", "metres, sigma above 0")
        if not (self.stiffness >= 0.0).all():
            raise InputError("model", "a stiffness below zero", "metres per radian")

    def clusters(self) -> dict[int, np.ndarray]:
        """Joint -> indices of the markers that it carries."""
        return {int(joint): np.flatnonzero(self.joint == joint) for joint in np.unique(self.joint)}


def freedom_of(joints: Sequence[str], parents: Sequence[int], counts: Mapping[str, int]) -> tuple[Freedom, np.ndarray]:
    """Freedom and stiffness (J,) of these joints.

    counts: joint -> number of markers it carries. A joint with no marker on it nor on anything below it is held."""
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
