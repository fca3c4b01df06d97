"""The foot-plant filter (Fredriksson section 5.4): feet in contact with the ground are held in place, without slow
drift.

A window passes over the recording. Where an ankle or a toe has the same mean place in the window's first half as in its
second, it is in contact. It is held at its mean place and released along a Bezier curve, and the leg follows by IK, so
that no bone changes its length.

Two things are corrected here. A foot that swings back and forth also has the same mean place in both halves: it is in
contact only where it also stays near that place. And a body that shifts its feet by less than one window shows moves
decimetres in a minute: a contact ends where the foot has moved further than `max_distance` from its place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.easing import smoothstep
from ...base.errors import InputError
from ...base.time_series import runs
from ...motion import quaternion
from ...motion.humanoid import Limb, identify
from ...motion.limb import bent_limb
from ...motion.motion import Motion, pose_kinematics

WINDOW, STILL, EASE, APART = 0.5, 0.0015, 0.1, 0.01
"""Seconds of the window (100 frames at 200 per second in the source), metres between the halves' means, seconds of
easing in and out, and metres from the held place beyond which a point is not in contact."""

_SOFT = 0.002  # metres below full length at which a leg with a held foot begins to ease


@dataclass(frozen=True, eq=False)
class PlantFiltered:
    """The result of the foot-plant filter.

    Attributes:
        motion: the motion with its feet held.
        held: (T, 2, 2) bool, left and right, ankle and toe.
        ankle_shift: (T, 2) metres by which each ankle was moved.
        miss: (T, 2) metres that a leg was short of its held ankle.
    """

    motion: Motion
    held: np.ndarray
    moved: np.ndarray
    miss: np.ndarray


def plant_filter(motion: Motion, window: float = WINDOW, still: float = STILL, ease: float = EASE,
                 apart: float = APART) -> PlantFiltered:
    """Hold ankles and toes in place where they are in contact.

    Only leg joints change, in frames in which something is held or released.

    Args:
        motion: T frames.
        window: seconds.
        max_drift: metres between the means of both halves of the window, up to which a point is in contact.
        ease: seconds of easing in and out.
        max_distance: metres from the held place beyond which a contact ends.
    Returns:
        The motion, what is held, and the corrections.
    Raises:
        InputError: if the skeleton has no two legs, or a number is not positive.
    Source: Fredriksson section 5.4.
    """
    if min(window, still, ease, apart) <= 0:
        raise InputError("foot plant", f"{window} s, {still} m, {ease} s, {apart} m", "positive numbers")
    body = identify(motion.skeleton)
    places, world = pose_kinematics(motion.skeleton, motion.root_positions, motion.rotations)
    rotations = np.array(motion.rotations)
    held = np.zeros((len(motion), 2, 2), bool)
    moved, miss = np.zeros((len(motion), 2)), np.zeros((len(motion), 2))
    sizes = max(2, round(window * motion.fps / 2.0)), still, apart
    for side, limb in enumerate((body.left, body.right)):
        points = [places[:, limb.foot], places[:, limb.toe_or_foot]]
        stands = [stances(point, *sizes) for point in points]
        held[:, side] = np.stack([_covered(spans, len(motion)) for spans in stands], axis=1)
        shifts = [hold(point, spans, max(1, round(ease * motion.fps))) for point, spans in zip(points, stands)]
        foot = _Foot(limb, places, world, *shifts)
        now = np.flatnonzero(foot.weight > 0)
        if len(now):
            found, short = foot.reached(motion.skeleton, now)
            for joint, local in found.items():
                rotations[now, joint] = quaternion.signed_like(local, rotations[now, joint])
            moved[now, side], miss[now, side] = np.linalg.norm(foot.ankle_shift[now], axis=1), short
    return PlantFiltered(replace(motion, rotations=rotations), held, moved, miss)


def stances(place: np.ndarray, half: int, still: float, apart: float) -> list[tuple[int, int]]:
    """Detect the contacts of a point.

    Args:
        place: (T, 3) metres.
        half: frames of half a window.
        max_drift: metres between the means of both halves.
        max_distance: metres from the contact's mean place.
    Returns:
        (first, end) frames of each contact.
    """
    count = len(place)
    if count < 2 * half:
        return []
    # cumulative sums give the mean over any half window: `mean[i]` is that of frames i to i + half
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(place - place[0], axis=0)])
    mean = (total[half:] - total[:-half]) / half
    begins = np.flatnonzero(np.linalg.norm(mean[half:] - mean[:-half], axis=1) <= still)
    marked = np.zeros(count, bool)
    for begin in begins:
        middle = 0.5 * (mean[begin] + mean[begin + half]) + place[0]
        inside = place[begin : begin + 2 * half]
        if np.linalg.norm(inside - middle, axis=1).max() <= apart:
            marked[begin : begin + 2 * half] = True
    pieces = [piece for span in runs(marked) for piece in _near_one_place(place, *span, apart)]
    return [(first, end) for first, end in pieces if end - first >= half]


def _near_one_place(place: np.ndarray, first: int, end: int, apart: float) -> list[tuple[int, int]]:
    """Halve a stretch that drifts until no frame of a piece is further than `max_distance` from the piece's mean."""
    inside = place[first:end]
    off = np.linalg.norm(inside - inside.mean(axis=0), axis=1).max()
    if off <= apart or end - first < 2:
        return [(first, end)]
    middle = (first + end) // 2
    return [*_near_one_place(place, first, middle, apart), *_near_one_place(place, middle, end, apart)]


def hold(place: np.ndarray, spans: list[tuple[int, int]], ease: int) -> tuple[np.ndarray, np.ndarray]:
    """Compute the shift that brings a point to its mean place in every contact.

    Args:
        place: (T, 3) metres.
        spans: (first, end) frames of the contacts.
        ease: frames of easing before and after.
    Returns:
        The shift (T, 3) metres, and its weight (T,): 1 in contact, along a Bezier curve to 0 within `ease` frames.
        Between contacts that are closer, the point moves from one place to the other.
    """
    shift, weight = np.zeros_like(place), np.zeros(len(place))
    share, frames = np.zeros(len(place)), np.arange(len(place))
    for first, end in spans:
        gone = np.maximum(np.maximum(first - frames, frames - (end - 1)), 0) / (ease + 1)
        own = smoothstep(1.0 - np.minimum(gone, 1.0))
        shift += own[:, None] * (place[first:end].mean(axis=0) - place)
        share += own
        weight = np.maximum(weight, own)
    return shift / np.maximum(share, 1.0)[:, None], weight


def _covered(spans: list[tuple[int, int]], count: int) -> np.ndarray:
    out = np.zeros(count, bool)
    for first, end in spans:
        out[first:end] = True
    return out


class _Foot:
    """One foot and its targets.

    Each point moves to where it is held; where only one is held, the foot moves with it as a whole, so that it still
    rolls over a held toe.
    """

    def __init__(self, limb: Limb, places: np.ndarray, world: np.ndarray, of_ankle, of_toe):
        self.limb, self.places, self.world = limb, places, world
        (ankle_shift, ankle_weight), (toe_shift, toe_weight) = of_ankle, of_toe
        self.ankle_shift = ankle_shift + (1.0 - ankle_weight)[:, None] * toe_shift
        self.toe_shift = toe_shift + (1.0 - toe_weight)[:, None] * ankle_shift
        self.weight = np.maximum(ankle_weight, toe_weight)

    def reached(self, skeleton, now: np.ndarray) -> tuple[dict[int, np.ndarray], np.ndarray]:
        """Solve the leg for its targets.

        Args:
            skeleton: the skeleton.
            frames: (N,) frames.
        Returns:
            Local rotations (N, 4) by joint, and metres (N,) by which the ankle was missed.
        """
        limb, places, world = self.limb, self.places[now], self.world[now]
        ankle = places[:, limb.foot]
        turned = world[:, limb.foot]
        if limb.toe is not None:
            along = places[:, limb.toe] - ankle
            new = along + self.toe_shift[now] - self.ankle_shift[now]
            turned = quaternion.multiply(quaternion.between(along, new), turned)
        chain = (limb.upper_leg, limb.lower_leg, limb.foot)
        soft = 1e-6 + _SOFT * self.weight[now]
        return bent_limb(skeleton, places, world, chain, ankle + self.ankle_shift[now], end_rotation=turned, soft=soft)
