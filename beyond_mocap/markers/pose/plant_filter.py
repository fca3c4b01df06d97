"""The foot-plant filter (Fredriksson §5.4): feet that stand are held at one place, without their slow floating.

A window goes over the recording; where an ankle or a toe is on average at the same place in its first half as in its
second, it stands. It is held there at its mean place, is let go along a Bezier curve, and the leg follows by IK, so
that no bone changes its length.

Two things are corrected. A foot that swings forth and back is also at the same mean place in both halves: it stands
only where it also keeps near that place. And a body that shifts its feet by less than can be seen in one window goes
decimetres in a minute: what is held at one place is ended where it has gone further than `apart` from it.
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
"""Seconds (his 100 frames, at his 200 per second), metres between the halves' means, seconds of easing in and out, and
metres from the held place beyond which a point does not stand there."""

_SOFT = 0.002  # metres below full length from which a leg eases where its foot is held


@dataclass(frozen=True, eq=False)
class PlantFiltered:
    """motion: the motion with its feet held. held: (T, 2, 2) bool, left and right, ankle and toe. moved: (T, 2) metres
    by which each ankle was moved. miss: (T, 2) metres that a leg was short of its held ankle."""

    motion: Motion
    held: np.ndarray
    moved: np.ndarray
    miss: np.ndarray


def plant_filter(motion: Motion, window: float = WINDOW, still: float = STILL, ease: float = EASE,
                 apart: float = APART) -> PlantFiltered:
    """A motion whose ankles and toes stay where they stand.

    window, ease: seconds. still, apart: metres, see the module. Only the joints of the legs of frames in which
    something is held or let go are changed. Raises InputError for a skeleton without two legs or numbers that are not
    positive. Source: Fredriksson §5.4.
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
    """(first, end) frames in which a point stands; place (T, 3) metres, `half` a window's frames."""
    count = len(place)
    if count < 2 * half:
        return []
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
    """A stretch, halved where it drifts until no frame of a piece is further than `apart` from the piece's mean."""
    inside = place[first:end]
    off = np.linalg.norm(inside - inside.mean(axis=0), axis=1).max()
    if off <= apart or end - first < 2:
        return [(first, end)]
    middle = (first + end) // 2
    return [*_near_one_place(place, first, middle, apart), *_near_one_place(place, middle, end, apart)]


def hold(place: np.ndarray, spans: list[tuple[int, int]], ease: int) -> tuple[np.ndarray, np.ndarray]:
    """Shift (T, 3) metres that brings a point to its mean place in every span, and its weight (T,): 1 inside, along a
    Bezier curve to 0 within `ease` frames on either side. Between two spans nearer than that it goes from one to the
    other."""
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
    """One foot and where it is to be: each point goes where it is held, and where only one is held the foot goes along
    with it as a whole, so that it rolls over a held toe as before."""

    def __init__(self, limb: Limb, places: np.ndarray, world: np.ndarray, of_ankle, of_toe):
        self.limb, self.places, self.world = limb, places, world
        (ankle_shift, ankle_weight), (toe_shift, toe_weight) = of_ankle, of_toe
        self.ankle_shift = ankle_shift + (1.0 - ankle_weight)[:, None] * toe_shift
        self.toe_shift = toe_shift + (1.0 - toe_weight)[:, None] * ankle_shift
        self.weight = np.maximum(ankle_weight, toe_weight)

    def reached(self, skeleton, now: np.ndarray) -> tuple[dict[int, np.ndarray], np.ndarray]:
        """Local rotations (N, 4) by joint at frames `now` (N,), and metres (N,) by which the ankle was missed."""
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
