"""The foot-plant filter (Fredriksson section 5.4): feet in contact with the ground are held in place, without drift.

Heels and toes (the ankle and the toe joint) are held one by one, since a foot that rolls stands on one of them. Two
kinds of contact are found:

- Stances, by height and speed (`motion.contacts`): low, and slower than a part that carries load moves. They last 0.1 s
  in a sprint, where the source's window never fires: that is half a second long.
- Long stands, by the source's window. It passes over the recording; where a point has the same mean place in its first
  half as in its second, it is in contact. This finds feet that stand high, or drift.

Each contact is held at its mean place and released along a Bezier curve, and the leg follows by IK, so that no bone
changes its length.

Two things are corrected here. A foot that swings back and forth also has the same mean place in both halves: it is in
contact only where it also stays near that place. And a body that shifts its feet by less than one window shows moves
decimetres in a minute: a contact ends where the foot has moved further than `max_distance` from its place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.easing import smoothstep
from ...base.errors import InputError
from ...base.time_series import find_runs
from ...motion import quaternion
from ...motion.contacts import detect_heel_toe_contacts
from ...motion.humanoid import Limb, identify_joints
from ...motion.limb import solve_posed_limb
from ...motion.motion import Motion, compute_pose

WINDOW, STILL = 0.5, 0.0015
"""Seconds of the window (100 frames at 200 per second in the source), and metres between the halves' means."""

_EASE, _APART = 0.1, 0.01  # s of easing in and out; metres from the held place beyond which a contact ends

# Ankle and toe in a stance: m/s up to which they stand (a heel that rises over standing toes reaches 1 m/s in sprints),
# and metres that they may lie off their held place (toe markers of standing feet travel 40 mm in hard pitches).
_STANCE_LIMITS = ((0.3, 0.012), (0.6, 0.025))
# Share of a toe's speed in the swing up to which it stands: 0.9 m/s at 9 m/s, where the limit above lets it slide in
# two fifths of the 0.11 s in which the leg carries load. More would count the landing as a part of the place to hold.
_SWING_SHARE, _SWING_PERCENTILE = 0.05, 95.0
_MIN_STANCE_SECONDS = 0.03  # s, a third of a sprinter's stance
_SPEED_SECONDS = 1.0 / 60.0  # s to either side, over which a point's speed is measured
_SOFT_LENGTH = 0.002  # metres below full length at which a leg with a held foot begins to ease


@dataclass(frozen=True, eq=False)
class PlantFilterResult:
    """The result of the foot-plant filter.

    Attributes:
        motion: the motion with its feet held.
        held: (T, 2, 2) bool, left and right, ankle and toe.
        ankle_shift: (T, 2) metres by which each ankle was moved.
        miss: (T, 2) metres that a leg was short of its held ankle.
    """

    motion: Motion
    held: np.ndarray
    ankle_shift: np.ndarray
    miss: np.ndarray


def filter_foot_plants(motion: Motion, window: float = WINDOW, max_drift: float = STILL) -> PlantFilterResult:
    """Hold ankles and toes in place where they are in contact.

    Only leg joints change, in frames in which something is held or released.

    Args:
        motion: T frames.
        window: seconds.
        max_drift: metres between the means of both halves of the window, up to which a point is in contact.
    Returns:
        The motion, what is held, and the corrections.
    Raises:
        InputError: if the skeleton has no two legs, or a number is not positive.
    Source: Fredriksson section 5.4.
    """
    if min(window, max_drift) <= 0:
        raise InputError("foot plant", f"{window} s, {max_drift} m", "positive numbers")
    body = identify_joints(motion.skeleton)
    places, world = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    rotations = np.array(motion.rotations)
    held = np.zeros((len(motion), 2, 2), bool)
    moved, miss = np.zeros((len(motion), 2)), np.zeros((len(motion), 2))
    sizes = max(2, round(window * motion.fps / 2.0)), max_drift, _APART
    is_low = detect_heel_toe_contacts(motion)
    for side, limb in enumerate((body.left, body.right)):
        points = [places[:, limb.foot], places[:, limb.toe_or_foot]]
        contacts = [join_contacts(detect_stances(point, is_low[:, side, kind], motion.fps, *_STANCE_LIMITS[kind],
                                                 swing_share=kind * _SWING_SHARE),
                                  detect_contacts(point, *sizes), len(motion)) for kind, point in enumerate(points)]
        held[:, side] = np.stack([_build_mask(spans, len(motion)) for spans in contacts], axis=1)
        shifts = [compute_hold_shift(point, spans, max(1, round(_EASE * motion.fps))) for point,
                  spans in zip(points, contacts)]
        foot = _Foot(limb, places, world, *shifts)
        active = np.flatnonzero(foot.weight > 0)
        if len(active):
            leg_rotations, missed = foot.solve_leg(motion.skeleton, active)
            for joint, local in leg_rotations.items():
                rotations[active, joint] = quaternion.match_signs(local, rotations[active, joint])
            moved[active, side], miss[active, side] = np.linalg.norm(foot.ankle_shift[active], axis=1), missed
    return PlantFilterResult(replace(motion, rotations=rotations), held, moved, miss)


def detect_stances(place: np.ndarray, is_low: np.ndarray, fps: float, max_speed: float, max_distance: float, *,
                   swing_share: float = 0.0) -> list[tuple[int, int]]:
    """Detect the stances of a point.

    Args:
        place: (T, 3) metres.
        is_low: (T,) bool, where its height and speed allow for contact.
        fps: frames per second.
        max_speed: m/s.
        max_distance: metres from the stance's mean place.
        swing_share: share of the point's speed in the swing up to which it stands, where that is more.
    Returns:
        (first, end) frames of each stance, in pieces where the point moves on.
    """
    reach = max(1, round(_SPEED_SECONDS * fps))
    frames = np.arange(len(place))
    after, before = np.minimum(frames + reach, len(place) - 1), np.maximum(frames - reach, 0)
    speed = np.linalg.norm(place[after] - place[before], axis=-1) * fps / np.maximum(after - before, 1)
    max_speed = max(max_speed, swing_share * float(np.percentile(speed, _SWING_PERCENTILE)))
    least = max(2, round(_MIN_STANCE_SECONDS * fps))
    return [piece for span in find_runs(is_low & (speed < max_speed))
            for piece in _split_drifting(place, *span, max_distance) if piece[1] - piece[0] >= least]


def join_contacts(stances: list[tuple[int, int]], stands: list[tuple[int, int]], count: int) -> list[tuple[int, int]]:
    """Join stances with the long stands of `count` frames; where both are, the stance is held as a whole."""
    rest = _build_mask(stands, count) & ~_build_mask(stances, count)
    return sorted([*stances, *find_runs(rest)])


def detect_contacts(place: np.ndarray, half: int, max_drift: float, max_distance: float) -> list[tuple[int, int]]:
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
    begins = np.flatnonzero(np.linalg.norm(mean[half:] - mean[:-half], axis=1) <= max_drift)
    marked = np.zeros(count, bool)
    for begin in begins:
        middle = 0.5 * (mean[begin] + mean[begin + half]) + place[0]
        inside = place[begin : begin + 2 * half]
        if np.linalg.norm(inside - middle, axis=1).max() <= max_distance:
            marked[begin : begin + 2 * half] = True
    pieces = [piece for span in find_runs(marked) for piece in _split_drifting(place, *span, max_distance)]
    return [(first, end) for first, end in pieces if end - first >= half]


def _split_drifting(place: np.ndarray, first: int, end: int, max_distance: float) -> list[tuple[int, int]]:
    """Halve a stretch that drifts until no frame of a piece is further than `max_distance` from the piece's mean."""
    inside = place[first:end]
    off = np.linalg.norm(inside - inside.mean(axis=0), axis=1).max()
    if off <= max_distance or end - first < 2:
        return [(first, end)]
    middle = (first + end) // 2
    return [*_split_drifting(place, first, middle, max_distance), *_split_drifting(place, middle, end, max_distance)]


def compute_hold_shift(place: np.ndarray, spans: list[tuple[int, int]], ease: int) -> tuple[np.ndarray, np.ndarray]:
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
        distance = np.maximum(np.maximum(first - frames, frames - (end - 1)), 0) / (ease + 1)
        own = smoothstep(1.0 - np.minimum(distance, 1.0))
        # beyond its ends the contact's own correction fades; a foot that flies in is not pulled to the ground earlier
        shift += own[:, None] * (place[first:end].mean(axis=0) - place[np.clip(frames, first, end - 1)])
        share += own
        weight = np.maximum(weight, own)
    return shift / np.maximum(share, 1.0)[:, None], weight


def _build_mask(spans: list[tuple[int, int]], count: int) -> np.ndarray:
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

    def solve_leg(self, skeleton, frames: np.ndarray) -> tuple[dict[int, np.ndarray], np.ndarray]:
        """Solve the leg for its targets.

        Args:
            skeleton: the skeleton.
            frames: (N,) frames.
        Returns:
            Local rotations (N, 4) by joint, and metres (N,) by which the ankle was missed.
        """
        limb, places, world = self.limb, self.places[frames], self.world[frames]
        ankle = places[:, limb.foot]
        foot_rotation = world[:, limb.foot]
        if limb.toe is not None:
            along = places[:, limb.toe] - ankle
            held_direction = along + self.toe_shift[frames] - self.ankle_shift[frames]
            foot_rotation = quaternion.multiply(quaternion.rotation_between(along, held_direction), foot_rotation)
        chain = (limb.upper_leg, limb.lower_leg, limb.foot)
        soft = 1e-6 + _SOFT_LENGTH * self.weight[frames]
        return solve_posed_limb(skeleton, places, world, chain, ankle + self.ankle_shift[frames],
                                end_rotation=foot_rotation, soft=soft)
