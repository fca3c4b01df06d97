"""A body as capsules along its skeleton, and how deep two bodies overlap.

A capsule is everything within its radius of a straight line. The overlap of two bodies is the largest value, over all
pairs of a capsule of each, of the sum of both radii minus the distance of the two lines; negative if they are apart.
The radii are those of a slim adult; the wide trunk has three lines (across the hips, up the spine, across the
shoulders).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np

from ...motion.humanoid import estimate_stature, identify_joints
from ...motion.motion import Motion, forward_kinematics
from ...motion.skeleton import Skeleton

HEAD_LENGTH_AND_RADIUS = 0.10, 0.095
"""m at a stature of 1.80 m: from the head's joint to the end of its line, and its radius."""

HAND_LENGTH = 0.09
"""m by which the forearm's line extends into the hand."""

RADII = {
    "hips": 0.10, "spine": 0.12, "shoulders": 0.075, "upper_arm": 0.055, "lower_arm": 0.042,
    "upper_leg": 0.085, "lower_leg": 0.052, "foot": 0.042,
}
"""m at a stature of 1.80 m."""

CONTACT_DISTANCE = 2.5
"""m between the middles of two bodies' hips: farther apart they cannot touch."""

_STATURE = 1.80  # m, the stature the radii are given for


@dataclass(frozen=True)
class Capsule:
    """One part of a body.

    Attributes:
        start: joint at the start of its line.
        end: joint at the end of its line.
        radius: m.
        beyond: m by which the line extends past the end joint.
        limb: "arm", "leg", or "" for trunk and head.
        side: 0 left, 1 right.
        along: how far start and end are down a leg, 0 at the hip and 1 at the ankle.
    """

    start: int
    end: int
    radius: float
    beyond: float = 0.0
    limb: str = ""
    side: int = 0
    along: tuple[float, float] = (0.0, 0.0)


def build_capsules(skeleton: Skeleton) -> tuple[Capsule, ...]:
    """Build the capsules of a body.

    Args:
        skeleton: the body's skeleton.
    Returns:
        The capsules; the first is across the hips.
    Raises:
        InputError: if the skeleton has no legs.
    """
    return _build_cached_capsules(_SkeletonKey(skeleton))


class _SkeletonKey:
    """A skeleton that compares by its fingerprint, so that results can be cached."""

    def __init__(self, skeleton: Skeleton):
        self.skeleton, self.key = skeleton, skeleton.fingerprint

    def __hash__(self):
        return hash(self.key)

    def __eq__(self, other):
        return self.key == other.key


@lru_cache(maxsize=64)
def _build_cached_capsules(key: _SkeletonKey) -> tuple[Capsule, ...]:
    body, size = identify_joints(key.skeleton), estimate_stature(key.skeleton) / _STATURE
    radius = {part: size * value for part, value in RADII.items()}
    top = body.neck_or_chest
    found = [Capsule(body.left.upper_leg, body.right.upper_leg, radius["hips"])]
    if top != body.hips:
        found.append(Capsule(body.hips, top, radius["spine"]))
    if body.head is not None and top != body.head:
        found.append(Capsule(top, body.head, size * HEAD_LENGTH_AND_RADIUS[1], size * HEAD_LENGTH_AND_RADIUS[0]))
    if body.left.upper_arm is not None and body.right.upper_arm is not None:
        found.append(Capsule(body.left.upper_arm, body.right.upper_arm, radius["shoulders"]))
    for side, limb in enumerate((body.left, body.right)):
        if None not in (limb.upper_arm, limb.lower_arm, limb.hand):
            found.append(Capsule(limb.upper_arm, limb.lower_arm, radius["upper_arm"], limb="arm", side=side))
            found.append(Capsule(limb.lower_arm, limb.hand, radius["lower_arm"], size * HAND_LENGTH, limb="arm",
                                 side=side))
        leg = [(limb.upper_leg, limb.lower_leg, "upper_leg", (0.0, 0.5)),
               (limb.lower_leg, limb.foot, "lower_leg", (0.5, 1.0)), (limb.foot, limb.toe, "foot", (1.0, 1.0))]
        for start, end, part, along in leg if limb.toe is not None else leg[:2]:
            found.append(Capsule(start, end, radius[part], limb="leg", side=side, along=along))
    return tuple(found)


def compute_capsule_lines(motion: Motion) -> np.ndarray:
    """Compute both ends of every capsule's line.

    Args:
        motion: T frames.
    Returns:
        (T, C, 2, 3) m, world frame.
    """
    parts, places = build_capsules(motion.skeleton), forward_kinematics(motion)[0]
    start, end = (places[:, [getattr(part, name) for part in parts]] for name in ("start", "end"))
    offset = end - start
    length = np.maximum(np.linalg.norm(offset, axis=-1, keepdims=True), 1e-9)
    return np.stack([start, end + offset / length * np.array([part.beyond for part in parts])[:, None]], axis=2)


@dataclass(frozen=True, eq=False)
class CapsuleContacts:
    """K pairs of capsules that overlap or nearly do.

    Attributes:
        frame: (K,) frame.
        one: (K,) capsule of the first body.
        other: (K,) capsule of the second body.
        depth: (K,) m of overlap.
        radii: (K,) m, the sum of both radii.
        direction: (K, 3) unit vector from the other to the one.
        share_one: (K,) position of the nearest point along the line of the one, 0 to 1.
        share_other: (K,) the same along the line of the other.
    """

    frame: np.ndarray
    one: np.ndarray
    other: np.ndarray
    depth: np.ndarray
    radii: np.ndarray
    direction: np.ndarray
    share_one: np.ndarray
    share_other: np.ndarray

    def select_rows(self, rows: np.ndarray) -> CapsuleContacts:
        """Select some of the pairs by their indices."""
        return CapsuleContacts(*(getattr(self, field.name)[rows] for field in fields(self)))


def find_capsule_contacts(one: np.ndarray, other: np.ndarray, radii: tuple[np.ndarray, ...],
                          min_depth: float = 0.0) -> CapsuleContacts:
    """Find where the capsules of two bodies overlap by at least `min_depth`.

    Args:
        one: (T, C, 2, 3) m, ends of the first body's lines.
        other: (T, D, 2, 3) m, ends of the second body's lines.
        radii: (C,) and (D,) m.
        min_depth: m; negative values also find capsules that are close.
    Returns:
        The pairs.
    """
    offset = one[:, 0].sum(axis=1) - other[:, 0].sum(axis=1)
    near = np.flatnonzero(np.einsum("tk,tk->t", offset, offset) < (2.0 * CONTACT_DISTANCE) ** 2)
    # Two cheap filters before the exact distance: hips far apart, then spheres around the lines.
    frame, a, b = np.nonzero(_has_near_spheres(one[near], other[near], radii[0][:, None] + radii[1] - min_depth))
    frame = near[frame]
    offset, at_a, at_b = find_nearest_points(one[frame, a], other[frame, b])
    distance = np.linalg.norm(offset, axis=1)
    both = radii[0][a] + radii[1][b]
    depth = both - distance
    keep = np.flatnonzero(depth >= min_depth)
    direction = offset[keep] / np.maximum(distance[keep], 1e-9)[:, None]
    return CapsuleContacts(frame[keep], a[keep], b[keep], depth=depth[keep], radii=both[keep], direction=direction,
                           share_one=at_a[keep], share_other=at_b[keep])


def _has_near_spheres(one: np.ndarray, other: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Say (T, C, D) bool whether the spheres around two lines, enlarged by `reach` (C, D) m together, meet."""
    (a, half_a), (b, half_b) = (
        (0.5 * (ends[:, :, 0] + ends[:, :, 1]), 0.5 * np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2))
        for ends in (one, other)
    )
    square = (a * a).sum(axis=2)[:, :, None] + (b * b).sum(axis=2)[:, None] - 2.0 * (a @ b.transpose(0, 2, 1))
    return square <= (half_a[:, :, None] + half_b[:, None] + reach) ** 2


def find_nearest_points(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find where straight lines are nearest to each other.

    Args:
        one: (K, 2, 3) m, ends of the first lines.
        other: (K, 2, 3) m, ends of the second lines.
    Returns:
        Vectors (K, 3) m from the other's nearest point to the one's, and the shares (K,) along both lines.
    Source: Ericson 2005, Real-Time Collision Detection, section 5.1.9.
    """
    p, q = one[:, 0], other[:, 0]
    u, v, w = one[:, 1] - p, other[:, 1] - q, p - q
    uu, vv, uv = (np.einsum("kc,kc->k", a, b) for a, b in ((u, u), (v, v), (u, v)))
    uw, vw = np.einsum("kc,kc->k", u, w), np.einsum("kc,kc->k", v, w)
    uu, vv = np.maximum(uu, 1e-12), np.maximum(vv, 1e-12)
    across = uu * vv - uv * uv
    parallel = across < 1e-9 * uu * vv
    s = np.clip(np.where(parallel, 0.5, (uv * vw - uw * vv) / np.where(parallel, 1.0, across)), 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return w + s[:, None] * u - t[:, None] * v, s, t
