"""Fit the sculpted athlete to a skeleton: each part follows its bone's place and length, girths follow the stature."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import Humanoid, Limb, identify_joints
from ..motion.retargeting.neutral import NeutralStance
from .landmarks import ANKLE, BALL, ELBOW, HEAD, HIP, HIPS, KNEE, SEGMENTS, SHOULDER, SHOULDERS, WRIST
from .stance import ARM_TILT
from .template import Template

_ARM = np.array([0.0, np.sin(ARM_TILT), -np.cos(ARM_TILT)])
_MIRROR = np.array([1.0, -1.0, 1.0])


def fit_template(template: Template, stance: NeutralStance, scale: float, girths: Mapping[str, float]) -> np.ndarray:
    """Move the template's vertices to a skeleton.

    Args:
        template: V vertices.
        stance: the skeleton's stance with lifted arms.
        scale: its stature relative to 1.80 m.
        girths: by part, as in `look.BUILDS`.
    Returns:
        (V, 3) m, in that stance.
    """
    fitter = _Fitter(stance, scale, girths)
    out = np.zeros_like(template.vertices)
    for index, name in enumerate(SEGMENTS):
        share = np.sum(np.where(template.segments == index, template.shares, 0.0), axis=1)
        used = np.flatnonzero(share)
        out[used] += share[used, None] * fitter.move(name, template.vertices[used])
    return out


class _Fitter:
    """Moves points of the athlete along with one segment."""

    def __init__(self, stance: NeutralStance, scale: float, girths: Mapping[str, float]):
        self.stance, self.scale, self.girths = stance, scale, girths
        self.body: Humanoid = identify_joints(stance.skeleton)
        places = stance.positions
        self.hips = 0.5 * (places[self.body.left.upper_leg] + places[self.body.right.upper_leg])
        arms = [limb.upper_arm for limb in (self.body.left, self.body.right)]
        has_arms = None not in arms
        self.shoulders = (0.5 * (places[arms[0]] + places[arms[1]]) if has_arms
                          else self.hips + scale * (SHOULDERS - HIPS))
        self.head = (places[self.body.head] if self.body.head is not None
                     else self.shoulders + scale * (HEAD - SHOULDERS))

    def move(self, segment: str, points: np.ndarray) -> np.ndarray:
        """Move points (N, 3) m of the athlete with a segment."""
        part, _, side = segment.rpartition("_")
        if not part:
            return {"trunk": self._move_trunk, "neck": self._move_neck, "head": self._move_head}[side](points)
        limb, sign = (self.body.left, 1.0) if side == "left" else (self.body.right, -1.0)
        mirror = np.ones(3) if sign > 0.0 else _MIRROR
        if part in ("foot", "toe"):
            return self._move_foot(limb, points * mirror) * mirror
        if part in ("upper_leg", "lower_leg"):
            return self._move_leg(limb, part, points * mirror) * mirror
        return self._move_arm(limb, part, (points * mirror, mirror))

    def _move_trunk(self, points: np.ndarray) -> np.ndarray:
        share = (points[:, 2] - HIPS[2]) / (SHOULDERS[2] - HIPS[2])
        inner = np.clip(share, 0.0, 1.0)[:, None]
        girth = self.scale * np.interp(share, (0.05, 0.35, 0.7), [self.girths[k] for k in ("hips", "waist", "chest")])
        middle = HIPS + inner * (SHOULDERS - HIPS)
        return self.hips + inner * (self.shoulders - self.hips) + (points - middle) * np.stack(
            [girth, girth, np.full(len(points), self.scale)], axis=1)

    def _move_neck(self, points: np.ndarray) -> np.ndarray:
        start, end = SHOULDERS, HEAD
        share = ((points[:, 2] - start[2]) / (end[2] - start[2]))[:, None]
        girth = self.scale * self.girths["neck"]
        return self.shoulders + share * (self.head - self.shoulders) + girth * (
            points - (start + share * (end - start))) * [1.0, 1.0, 0.0]

    def _move_head(self, points: np.ndarray) -> np.ndarray:
        return self.head + self.scale * (points - HEAD)

    def _move_arm(self, limb: Limb, part: str, mirrored) -> np.ndarray:
        points, mirror = mirrored
        if limb.upper_arm is None or limb.lower_arm is None or limb.hand is None:
            return self._move_trunk(points * mirror)
        places = [self.stance.positions[joint] * mirror for joint in (limb.upper_arm, limb.lower_arm, limb.hand)]
        if part == "shoulder":
            joint = self._move_trunk(SHOULDER[None])
            return (self._move_trunk(points) + places[0] - joint) * mirror
        marks = [SHOULDER, SHOULDER + ELBOW * _ARM, SHOULDER + WRIST * _ARM]
        if part == "hand":
            return (places[2] + self.scale * (points - marks[2])) * mirror
        first = part == "lower_arm"
        ends = marks[first], marks[first + 1], places[first], places[first + 1]
        return _move_along(points, ends, self.scale * self.girths["arm"]) * mirror

    def _move_leg(self, limb: Limb, part: str, points: np.ndarray) -> np.ndarray:
        mirror = np.ones(3) if limb is self.body.left else _MIRROR
        places = [self.stance.positions[joint] * mirror for joint in (limb.upper_leg, limb.lower_leg, limb.foot)]
        knee, ankle = HIP * [1.0, 1.0, 0.0] + [0.0, 0.0, KNEE], HIP * [1.0, 1.0, 0.0] + [0.0, 0.0, ANKLE]
        if part == "upper_leg":
            ends = HIP, knee, places[0], places[1]
            return _move_along(points, ends, self.scale * self.girths["thigh"])
        return _move_along(points, (knee, ankle, places[1], places[2]), self.scale * self.girths["calf"])

    def _move_foot(self, limb: Limb, points: np.ndarray) -> np.ndarray:
        """Move the foot: its sole to the ground, its ball to the toe joint."""
        is_left = limb is self.body.left
        ankle = self.stance.positions[limb.foot] * (np.ones(3) if is_left else _MIRROR)
        ball, k = float(self.stance.ball[0 if is_left else 1][0]), self.scale
        ahead = np.where(points[:, 0] > BALL, ball + k * (points[:, 0] - BALL),
                         np.where(points[:, 0] > 0.0, ball / BALL, k) * points[:, 0])
        low = self.stance.ankle_height / ANKLE
        up = np.where(points[:, 2] < ANKLE, low, k) * (points[:, 2] - ANKLE)
        return ankle + np.stack([ahead, k * (points[:, 1] - HIP[1]), up], axis=1)


def _move_along(points: np.ndarray, ends, girth: float) -> np.ndarray:
    """Move points with a bone: lengthwise by the ratio of its lengths, across by `girth`.

    Args:
        points: (N, 3) m.
        ends: start and end (3,) m of the athlete's bone and of the skeleton's.
        girth: ratio.
    """
    start, end, other_start, other_end = ends
    length, other_length = np.linalg.norm(end - start), np.linalg.norm(other_end - other_start)
    along, other_along = (end - start) / length, (other_end - other_start) / max(other_length, 1e-6)
    share = (points - start) @ along
    across = points - start - share[:, None] * along
    turn = quaternion.rotation_between(along, other_along)
    lengthwise = (share * other_length / length)[:, None] * other_along
    return other_start + lengthwise + girth * quaternion.rotate(turn, across)
