"""Labels for recordings without annotations, proposed by rules from the motion alone.

Locomotion follows from the pelvis's speed and from the heading while the body travels. Actions are found by what stands
out: a foot that swings faster than any stride of that speed (a kick: the key moment is the foot's highest speed, the
side the faster foot's), a body that falls freely for longer than a run does (a jump: its highest point), a head that
strikes forward in the air (a header), a body that turns on the spot, one that gets up from the ground. There is no ball
in a recording, so what only a ball shows (dribbling, receiving) is not proposed.

`propose_labels` is the entry point. With a classifier trained on annotated clips (`library.classify`) the rules are its
input: it weighs them with what it has learned, and they stay for all acts that it does not know.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

from ..annotation import LOCOMOTION, ClipAnnotation, automatic_gaits
from ..annotation.gaits import STANDING, without_short_runs
from ..annotation.labels import find_label
from ..annotation.striking import part_surfaces
from ..annotation.vocabulary import DIRECTIONS
from ..base.time_series import equal_runs, runs
from ..base.vectors import arctan2
from ..motion import contacts, quaternion
from ..motion.humanoid import Humanoid, heading_from_positions, identify, leg_length
from ..motion.motion import Motion, forward_kinematics
from .library import Library
from .word_sources import Proposal

if TYPE_CHECKING:
    from .classify.classifier import Classifier

GAITS = tuple((word, find_label(word).gait) for word in LOCOMOTION)
"""Each gait and the speed in m/s from which on it applies, where no library has its own."""


_GAIT_SECONDS, _SHORTEST = 0.5, 0.5  # seconds over which speed is averaged; least duration of a stretch
_FOOT_SECONDS = 0.012  # seconds over which a foot's speed is averaged: a kick's peak is short
# a kick's foot is faster against the pelvis than this, and than a stride at the pelvis's speed v: m/s, share of v, m/s
_KICK, _STRIDE, _ABOVE_STRIDE = 6.5, 1.25, 3.5
_KICK_BEFORE, _KICK_AFTER = 0.25, 0.25  # seconds of a kick around its key moment
# m/s of the pelvis; m above the floor; cosine of the foot's path and its inner side
_RUNNING, _HIGH, _INSIDE = 2.0, 0.40, 0.65
_UPRIGHT = 0.5  # share of the trunk's direction that points up
_FLIGHT, _FALLS = 0.26, 0.6  # seconds without contact; least rise of the pelvis, share of that of free flight
_NOD = 1.0  # m/s of the head against the chest, forward: jumps without a ball have up to 0.5
_TURN_RATE, _TURN = np.radians(45.0), np.radians(50.0)
_TURN_SPEED = 2.0  # m/s: a body that travels faster runs a curve
_LYING, _UP = 0.45, 0.85  # pelvis height in leg lengths: of a body on the ground, of one that has got up


def propose(
    motion: Motion, gaits: Sequence[tuple[str, float]] = GAITS, classifier: "Classifier | None" = None
) -> tuple[Proposal, ...]:
    """Propose labels for a recording.

    Args:
        motion: T frames.
        gaits: each gait's label and the m/s from which on it applies, slow to fast (`list_gaits` of a library).
        classifier: trained on annotated clips; None uses the rules alone.
    Returns:
        The proposals, ordered by their first frame.
    Raises:
        InputError: if the skeleton has no legs.
    """
    seen = _Seen.of(motion)
    kicks = _kicks(seen)
    low = _on_ground(seen)
    found = [*_locomotion(seen, gaits), *kicks, *_jumps(seen, kicks), *_turns(seen), *low]
    ruled = tuple(sorted(found, key=lambda one: (one.annotation.start, one.annotation.end)))
    return ruled if classifier is None else classifier.propose(motion, ruled)


def gaits_of(library: Library) -> tuple[tuple[str, float], ...]:
    """List the gaits of a library with the speeds at which its own annotations change; InputError where it has none."""
    return tuple(zip([gait.word for gait in library.gaits], [0.0, *library.gait_thresholds.tolist()]))


@dataclass(frozen=True, eq=False, kw_only=True)
class _Seen:
    """The signals that the rules use.

    Attributes:
        motion: T frames.
        body: its joints by meaning.
        places: (T, J, 3) metres, world.
        world: (T, J, 4) world rotations.
        speed: (T,) m/s of the pelvis over the ground.
        path: (T, 2) m/s, its velocity.
        facing: (T,) radians, unwrapped.
        leg, floor: metres.
        upright: (T,) share of the trunk's direction that points up.
    """

    motion: Motion
    body: Humanoid
    places: np.ndarray
    world: np.ndarray
    speed: np.ndarray
    path: np.ndarray
    facing: np.ndarray
    leg: float
    floor: float
    upright: np.ndarray

    @classmethod
    def of(cls, motion: Motion) -> "_Seen":
        """Compute the signals of a motion."""
        body = identify(motion.skeleton)
        places, world = forward_kinematics(motion)
        path = _velocity(places[:, body.hips, :2], motion.fps, _GAIT_SECONDS / 4.0)
        trunk = places[:, body.neck_or_chest] - places[:, body.hips]
        upright = trunk[:, 2] / np.maximum(np.linalg.norm(trunk, axis=1), 1e-9)
        facing = np.unwrap(heading_from_positions(motion.skeleton, places))
        floor = contacts.ground_height(motion)
        return cls(motion=motion, body=body, places=places, world=world, speed=np.linalg.norm(path, axis=1), path=path,
                   facing=facing, leg=leg_length(motion.skeleton), floor=floor, upright=upright)

    def row(self, start: float, end: float, words, key: int | None = None) -> ClipAnnotation:
        last = len(self.motion) - 1
        return ClipAnnotation(int(max(0, round(start))), int(min(last, round(end))), key, tuple(words))

    def frames(self, seconds: float) -> float:
        return seconds * self.motion.fps


def _velocity(places: np.ndarray, fps: float, seconds: float) -> np.ndarray:
    """Compute the velocity (T, n) m/s of positions (T, n) m, smoothed over about `seconds`."""
    if len(places) < 2:
        return np.zeros_like(places)
    return np.gradient(gaussian_filter1d(places, max(seconds * fps, 0.5), axis=0, mode="nearest"), axis=0) * fps


def _locomotion(seen: _Seen, gaits) -> list[Proposal]:
    """Propose stretches of one gait and one direction."""
    fps, words = seen.motion.fps, [word for word, _ in gaits]
    limits = np.array([speed for _, speed in gaits][1:])
    middle = np.concatenate([[0.0], 0.5 * (limits[1:] + limits[:-1]), [limits[-1] + 1.0]]) if len(limits) else [0.0]
    gait = automatic_gaits(seen.speed, fps, middle, limits, hysteresis=0.1, minimum=_SHORTEST)
    off = quaternion.wrapped(arctan2(seen.path[:, 1], seen.path[:, 0]) - seen.facing)
    quarter = without_short_runs(np.round(off / (np.pi / 2.0)).astype(int) % 4, int(_SHORTEST * fps))
    way = np.where(np.array([words[g] == STANDING for g in gait]), -1, quarter)
    # one number for gait and direction together: gait * 5, plus 0 standing still, 1 to 4 the quarter of travel
    kind = without_short_runs(gait * 5 + way + 1, int(_SHORTEST * fps))
    out = []
    for start, stop in equal_runs(kind):
        number, facing = divmod(int(kind[start]), 5)
        said = (words[number],) if facing == 0 else (words[number], DIRECTIONS[facing - 1])
        speed = float(seen.speed[start:stop].mean())
        near = float(np.min(np.abs(limits - speed))) if len(limits) else 1.0
        sure = float(np.clip(0.5 + near, 0.5, 0.95))
        out.append(Proposal(seen.row(start, stop - 1, said), sure, f"{speed:.1f} m/s"))
    return out


def _kicks(seen: _Seen) -> list[Proposal]:
    """Propose kicks: feet that swing faster than a stride; of two within half a second the faster."""
    fps, found = seen.motion.fps, []
    for side, limb in (("left", seen.body.left), ("right", seen.body.right)):
        toe = seen.places[:, limb.toe_or_foot]
        swing = _velocity(toe - seen.places[:, seen.body.hips], fps, _FOOT_SECONDS)
        over = np.linalg.norm(swing, axis=1) - np.maximum(_KICK, _STRIDE * seen.speed + _ABOVE_STRIDE)
        speed = np.linalg.norm(_velocity(toe, fps, _FOOT_SECONDS), axis=1)
        for peak in find_peaks(np.pad(over, 1, constant_values=-np.inf), height=0.0)[0] - 1:
            near = slice(max(0, peak - int(seen.frames(0.1))), peak + int(seen.frames(0.1)) + 1)
            key = near.start + int(np.argmax(speed[near]))
            if seen.upright[key] > _UPRIGHT:
                found.append((float(over[peak]), key, side, float(speed[key])))
    found.sort(reverse=True)
    kept: list = []
    for one in found:
        if all(abs(one[1] - other[1]) > seen.frames(0.5) for other in kept):
            kept.append(one)
    return [_kick(seen, *one) for one in kept]


def _kick(seen: _Seen, over: float, key: int, side: str, speed: float) -> Proposal:
    """Build the proposal of a kick with its side, pace, height, surface and direction."""
    limb = getattr(seen.body, side)
    ankle, toe = seen.places[:, limb.foot], seen.places[:, limb.toe_or_foot]
    words = ["kick", side, "running" if seen.speed[key] >= _RUNNING else "standing"]
    height = float(ankle[key, 2] - seen.floor)
    words.append("high" if height > _HIGH else "low")
    words.append("inside" if _inner_share(seen, side, key) > _INSIDE else "top")
    words.append(DIRECTIONS[_kicked_way(seen, toe, key)])
    start, end = key - seen.frames(_KICK_BEFORE), key + seen.frames(_KICK_AFTER)
    return Proposal(seen.row(start, end, words, key), float(np.clip(0.5 + 0.15 * over, 0.5, 0.95)),
                    f"{side} foot at {speed:.1f} m/s")


def _inner_share(seen: _Seen, side: str, key: int) -> float:
    """Compute the cosine between the foot's velocity and its inner side: across the plane of shin and foot."""
    ankle, tip = part_surfaces(seen.motion.skeleton, "foot", (side,))[0].line(seen.places, seen.world)
    shin = ankle[key] - seen.places[key, getattr(seen.body, side).lower_leg]
    inner = np.cross(tip[key] - ankle[key], shin) * (1.0 if side == "right" else -1.0)
    way = _velocity(ankle, seen.motion.fps, _FOOT_SECONDS)[key]
    return float(way @ inner / max(np.linalg.norm(way) * np.linalg.norm(inner), 1e-9))


def _kicked_way(seen: _Seen, toe: np.ndarray, key: int) -> int:
    """Find the index into DIRECTIONS of the foot's swing relative to the heading."""
    way = _velocity(toe, seen.motion.fps, _FOOT_SECONDS)[key]
    off = quaternion.wrapped(arctan2(way[1], way[0]) - seen.facing[key])
    return int(np.round(off / (np.pi / 2.0))) % 4


def _jumps(seen: _Seen, kicks: list[Proposal]) -> list[Proposal]:
    """Propose jumps: flights longer and higher than a run's, except in kicks. With a head that strikes: headers."""
    fps, hips = seen.motion.fps, seen.places[:, seen.body.hips, 2]
    feet = seen.places[:, [seen.body.left.toe_or_foot, seen.body.right.toe_or_foot], 2]
    rest = np.percentile(feet, 10, axis=0)
    air = np.all(feet > rest + 0.05, axis=1)
    found = []
    for start, stop in runs(air):
        if stop - start < seen.frames(_FLIGHT):
            continue
        key = start + int(np.argmax(hips[start:stop]))
        rise = float(hips[key] - 0.5 * (hips[start] + hips[stop - 1]))
        taken = any(abs(key - one.annotation.key) < seen.frames(0.5) for one in kicks)
        if rise < _FALLS * 9.81 / 8.0 * ((stop - start) / fps) ** 2 or taken:
            continue
        head = _nod(seen, key)
        words = ("header", "jump") if head > _NOD else ("jump",)
        why = f"{(stop - start) / fps:.2f} s in the air" + (f", head at {head:.1f} m/s" if head > _NOD else "")
        row = seen.row(start - seen.frames(0.4), stop + seen.frames(0.4), words, key)
        found.append(Proposal(row, 0.6 if head > _NOD else 0.8, why))
    return found


def _nod(seen: _Seen, key: int) -> float:
    """Measure the highest forward speed (m/s) of the head against the chest within a quarter of a second of `key`."""
    if seen.body.head is None:
        return 0.0
    way = seen.places[:, seen.body.head] - seen.places[:, seen.body.chest]
    speed = _velocity(way, seen.motion.fps, 0.03)[:, :2]
    ahead = np.stack([np.cos(seen.facing), np.sin(seen.facing)], axis=1)
    near = slice(max(0, key - int(seen.frames(0.25))), key + int(seen.frames(0.25)) + 1)
    return float(np.max(np.sum(speed * ahead, axis=1)[near]))


def _turns(seen: _Seen) -> list[Proposal]:
    """Propose stretches in which the body turns by more than _TURN without travelling fast."""
    rate = _velocity(seen.facing[:, None], seen.motion.fps, 0.1)[:, 0]
    out = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turning = (sign * rate > _TURN_RATE) & (seen.speed < _TURN_SPEED) & (seen.upright > _UPRIGHT)
        for start, stop in runs(turning):
            angle = abs(float(seen.facing[stop - 1] - seen.facing[start]))
            if angle >= _TURN and stop - start >= seen.frames(0.25):
                sure = float(np.clip(0.4 + angle / np.pi, 0.5, 0.95))
                row = seen.row(start, stop - 1, ("turning", side))
                out.append(Proposal(row, sure, f"{np.degrees(angle):.0f} degrees"))
    return out


def _on_ground(seen: _Seen) -> list[Proposal]:
    """Propose lying on the ground, and getting up from it."""
    height = seen.places[:, seen.body.hips, 2] - seen.floor
    low, up = height < _LYING * seen.leg, height > _UP * seen.leg
    out = []
    for start, stop in runs(low):
        if stop - start < seen.frames(0.3):
            continue
        out.append(Proposal(seen.row(start, stop - 1, ("ground",)), 0.7, "pelvis on the ground"))
        risen = np.flatnonzero(up[stop:])
        if len(risen) and risen[0] < seen.frames(4.0):
            words = ("getting_up", "front" if _belly_down(seen, start, stop) else "back")
            out.append(Proposal(seen.row(max(start, stop - seen.frames(1.0)), stop + risen[0], words), 0.7, "rises"))
    return out


def _belly_down(seen: _Seen, start: int, stop: int) -> bool:
    """Whether the body lies on its front: across the hips x up the spine points down."""
    at = slice(start, stop)
    body, places = seen.body, seen.places
    across = places[at, body.left.upper_leg] - places[at, body.right.upper_leg]
    spine = places[at, body.chest] - places[at, body.hips]
    return float(np.mean(np.cross(across, spine)[:, 2])) < 0.0
