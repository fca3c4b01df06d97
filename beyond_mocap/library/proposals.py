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
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..annotation import LOCOMOTION, ClipAnnotation, choose_gaits
from ..annotation.gaits import STANDING, remove_short_runs
from ..annotation.labels import find_label
from ..annotation.striking import build_part_surfaces
from ..annotation.vocabulary import DIRECTIONS
from ..base.time_series import find_equal_runs, find_runs
from ..base.vectors import arctan2
from ..motion import contacts, quaternion
from ..motion.humanoid import Humanoid, compute_heading_from_positions, identify_joints, measure_leg_length
from ..motion.motion import Motion, forward_kinematics
from ..motion.supports import GRAVITY
from ..motion.t_poses import find_t_poses
from .folder.label_sources import Proposal
from .library import Library

if TYPE_CHECKING:
    from .classify.classifier import Classifier

GAITS = tuple((word, find_label(word).gait) for word in LOCOMOTION)
"""Each gait and the speed in m/s from which on it applies, where no library has its own."""


_GAIT_SECONDS, _SHORTEST = 0.5, 0.5  # seconds over which speed is averaged; least duration of a stretch
_FOOT_SECONDS = 0.012  # seconds over which a foot's speed is averaged: a kick's peak is short
# a kick's foot is faster against the pelvis than this, and than a stride at the pelvis's speed v: m/s, share of v, m/s
_KICK, _STRIDE, _STRIDE_MARGIN = 6.5, 1.25, 3.5
_KICK_BEFORE, _KICK_AFTER = 0.25, 0.25  # seconds of a kick around its key moment
# m/s of the pelvis; m above the floor; cosine of the foot's path and its inner side
_RUNNING, _HIGH, _INSIDE = 2.0, 0.40, 0.65
_UPRIGHT = 0.5  # share of the trunk's direction that points up
_FLIGHT, _FALL_SHARE = 0.26, 0.6  # seconds without contact; least rise of the pelvis, share of that of free flight
_NOD = 1.0  # m/s of the head against the chest, forward: jumps without a ball have up to 0.5
_TURN_RATE, _TURN = np.radians(45.0), np.radians(50.0)
_TURN_SPEED = 2.0  # m/s: a body that travels faster runs a curve
_LYING, _UP = 0.45, 0.85  # pelvis height in leg lengths: of a body on the ground, of one that has got up


def propose_labels(
    motion: Motion, gaits: Sequence[tuple[str, float]] = GAITS, classifier: "Classifier | None" = None,
    t_pose_frames: tuple[int, int] | None = None,
) -> tuple[Proposal, ...]:
    """Propose labels for a recording.

    Args:
        motion: T frames.
        gaits: each gait's label and the m/s from which on it applies, slow to fast (`list_gaits` of a library).
        classifier: trained on annotated clips; None uses the rules alone.
        t_pose_frames: number of frames at the start and at the end that get no labels; None finds T-poses.
            So the jump out of one is no kick.
    Returns:
        The proposals, ordered by their first frame.
    Raises:
        InputError: if the skeleton has no legs.
    """
    first, at_end = find_t_poses(motion) if t_pose_frames is None else t_pose_frames
    if first or at_end:
        left = motion.frames(first, len(motion) - at_end) if first + at_end < len(motion) else None
        proposals = () if left is None else propose_labels(left, gaits, classifier, (0, 0))
        return tuple(replace(one, annotation=_shift_row(one.annotation, first)) for one in proposals)
    seen = _RecordingSignals.from_motion(motion)
    kicks = _propose_kicks(seen)
    low = _propose_ground(seen)
    proposals = [*_propose_locomotion(seen, gaits), *kicks, *_propose_jumps(seen, kicks), *_propose_turns(seen), *low]
    rule_proposals = tuple(sorted(proposals, key=lambda one: (one.annotation.start, one.annotation.end)))
    return rule_proposals if classifier is None else classifier.propose_labels(motion, rule_proposals)


def _shift_row(row: ClipAnnotation, frames: int) -> ClipAnnotation:
    key = None if row.key is None else row.key + frames
    return replace(row, start=row.start + frames, end=row.end + frames, key=key)


def list_gaits(library: Library) -> tuple[tuple[str, float], ...]:
    """List the gaits of a library with the speeds at which its own annotations change; InputError where it has none."""
    return tuple(zip([gait.label for gait in library.gaits], [0.0, *library.gait_thresholds.tolist()]))


@dataclass(frozen=True, eq=False, kw_only=True)
class _RecordingSignals:
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
    def from_motion(cls, motion: Motion) -> "_RecordingSignals":
        """Compute the signals of a motion."""
        body = identify_joints(motion.skeleton)
        places, world = forward_kinematics(motion)
        path = _compute_velocity(places[:, body.hips, :2], motion.fps, _GAIT_SECONDS / 4.0)
        trunk = places[:, body.neck_or_chest] - places[:, body.hips]
        upright = trunk[:, 2] / np.maximum(np.linalg.norm(trunk, axis=1), 1e-9)
        facing = np.unwrap(compute_heading_from_positions(motion.skeleton, places))
        floor = contacts.measure_ground_height(motion)
        return cls(motion=motion, body=body, places=places, world=world, speed=np.linalg.norm(path, axis=1), path=path,
                   facing=facing, leg=measure_leg_length(motion.skeleton), floor=floor, upright=upright)

    def build_row(self, start: float, end: float, words, key: int | None = None) -> ClipAnnotation:
        """Build the annotation of the frames `start` to `end`, rounded and clamped to the motion."""
        last = len(self.motion) - 1
        return ClipAnnotation(int(max(0, round(start))), int(min(last, round(end))),
                              None if key is None else int(key), tuple(words))

    def to_frames(self, seconds: float) -> float:
        """Convert seconds to frames of the motion."""
        return seconds * self.motion.fps


def _compute_velocity(places: np.ndarray, fps: float, seconds: float) -> np.ndarray:
    """Compute the velocity (T, n) m/s of positions (T, n) m, smoothed over about `seconds`."""
    if len(places) < 2:
        return np.zeros_like(places)
    return np.gradient(gaussian_filter1d(places, max(seconds * fps, 0.5), axis=0, mode="nearest"), axis=0) * fps


def _propose_locomotion(seen: _RecordingSignals, gaits) -> list[Proposal]:
    """Propose stretches of one gait and one direction."""
    fps, words = seen.motion.fps, [word for word, _ in gaits]
    limits = np.array([speed for _, speed in gaits][1:])
    middle = np.concatenate([[0.0], 0.5 * (limits[1:] + limits[:-1]), [limits[-1] + 1.0]]) if len(limits) else [0.0]
    gait = choose_gaits(seen.speed, fps, middle, limits, hysteresis=0.1, minimum=_SHORTEST)
    off = quaternion.wrap_angle(arctan2(seen.path[:, 1], seen.path[:, 0]) - seen.facing)
    quarter = remove_short_runs(np.round(off / (np.pi / 2.0)).astype(int) % 4, int(_SHORTEST * fps))
    direction = np.where(np.array([words[g] == STANDING for g in gait]), -1, quarter)
    # one number for gait and direction together: gait * 5, plus 0 standing still, 1 to 4 the quarter of travel
    kind = remove_short_runs(gait * 5 + direction + 1, int(_SHORTEST * fps))
    out = []
    for start, stop in find_equal_runs(kind):
        number, facing = divmod(int(kind[start]), 5)
        labels = (words[number],) if facing == 0 else (words[number], DIRECTIONS[facing - 1])
        speed = float(seen.speed[start:stop].mean())
        near = float(np.min(np.abs(limits - speed))) if len(limits) else 1.0
        confidence = float(np.clip(0.5 + near, 0.5, 0.95))
        out.append(Proposal(seen.build_row(start, stop - 1, labels), confidence, f"{speed:.1f} m/s"))
    return out


def _propose_kicks(seen: _RecordingSignals) -> list[Proposal]:
    """Propose kicks: feet that swing faster than a stride; of two within half a second the faster."""
    from scipy.signal import find_peaks

    fps, found = seen.motion.fps, []
    for side, limb in (("left", seen.body.left), ("right", seen.body.right)):
        toe = seen.places[:, limb.toe_or_foot]
        swing = _compute_velocity(toe - seen.places[:, seen.body.hips], fps, _FOOT_SECONDS)
        over = np.linalg.norm(swing, axis=1) - np.maximum(_KICK, _STRIDE * seen.speed + _STRIDE_MARGIN)
        speed = np.linalg.norm(_compute_velocity(toe, fps, _FOOT_SECONDS), axis=1)
        for peak in find_peaks(np.pad(over, 1, constant_values=-np.inf), height=0.0)[0] - 1:
            near = slice(max(0, peak - int(seen.to_frames(0.1))), peak + int(seen.to_frames(0.1)) + 1)
            key = near.start + int(np.argmax(speed[near]))
            if seen.upright[key] > _UPRIGHT:
                found.append((float(over[peak]), key, side, float(speed[key])))
    found.sort(reverse=True)
    selected: list = []
    for one in found:
        if all(abs(one[1] - other[1]) > seen.to_frames(0.5) for other in selected):
            selected.append(one)
    return [_build_kick(seen, *one) for one in selected]


def _build_kick(seen: _RecordingSignals, over: float, key: int, side: str, speed: float) -> Proposal:
    """Build the proposal of a kick with its side, pace, height, surface and direction."""
    limb = getattr(seen.body, side)
    ankle, toe = seen.places[:, limb.foot], seen.places[:, limb.toe_or_foot]
    words = ["kick", side, "running" if seen.speed[key] >= _RUNNING else "standing"]
    height = float(ankle[key, 2] - seen.floor)
    words.append("high" if height > _HIGH else "low")
    words.append("inside" if _compute_inner_share(seen, side, key) > _INSIDE else "top")
    words.append(DIRECTIONS[_find_kick_direction(seen, toe, key)])
    start, end = key - seen.to_frames(_KICK_BEFORE), key + seen.to_frames(_KICK_AFTER)
    return Proposal(seen.build_row(start, end, words, key), float(np.clip(0.5 + 0.15 * over, 0.5, 0.95)),
                    f"{side} foot at {speed:.1f} m/s")


def _compute_inner_share(seen: _RecordingSignals, side: str, key: int) -> float:
    """Compute the cosine between the foot's velocity and its inner side: across the plane of shin and foot."""
    ankle, tip = build_part_surfaces(seen.motion.skeleton, "foot", (side,))[0].compute_line(seen.places, seen.world)
    shin = ankle[key] - seen.places[key, getattr(seen.body, side).lower_leg]
    inner = np.cross(tip[key] - ankle[key], shin) * (1.0 if side == "right" else -1.0)
    velocity = _compute_velocity(ankle, seen.motion.fps, _FOOT_SECONDS)[key]
    return float(velocity @ inner / max(np.linalg.norm(velocity) * np.linalg.norm(inner), 1e-9))


def _find_kick_direction(seen: _RecordingSignals, toe: np.ndarray, key: int) -> int:
    """Find the index into DIRECTIONS of the foot's swing relative to the heading."""
    velocity = _compute_velocity(toe, seen.motion.fps, _FOOT_SECONDS)[key]
    off = quaternion.wrap_angle(arctan2(velocity[1], velocity[0]) - seen.facing[key])
    return int(np.round(off / (np.pi / 2.0))) % 4


def _propose_jumps(seen: _RecordingSignals, kicks: list[Proposal]) -> list[Proposal]:
    """Propose jumps: flights longer and higher than a run's, except in kicks. With a head that strikes: headers."""
    fps, hips = seen.motion.fps, seen.places[:, seen.body.hips, 2]
    feet = seen.places[:, [seen.body.left.toe_or_foot, seen.body.right.toe_or_foot], 2]
    rest = np.percentile(feet, 10, axis=0)
    air = np.all(feet > rest + 0.05, axis=1)
    found = []
    for start, stop in find_runs(air):
        if stop - start < seen.to_frames(_FLIGHT):
            continue
        key = start + int(np.argmax(hips[start:stop]))
        rise = float(hips[key] - 0.5 * (hips[start] + hips[stop - 1]))
        taken = any(abs(key - one.annotation.key) < seen.to_frames(0.5) for one in kicks)
        if rise < _FALL_SHARE * GRAVITY / 8.0 * ((stop - start) / fps) ** 2 or taken:
            continue
        head = _measure_nod(seen, key)
        words = ("header", "jump") if head > _NOD else ("jump",)
        why = f"{(stop - start) / fps:.2f} s in the air" + (f", head at {head:.1f} m/s" if head > _NOD else "")
        row = seen.build_row(start - seen.to_frames(0.4), stop + seen.to_frames(0.4), words, key)
        found.append(Proposal(row, 0.6 if head > _NOD else 0.8, why))
    return found


def _measure_nod(seen: _RecordingSignals, key: int) -> float:
    """Measure the highest forward speed (m/s) of the head against the chest within a quarter of a second of `key`."""
    if seen.body.head is None:
        return 0.0
    offset = seen.places[:, seen.body.head] - seen.places[:, seen.body.chest]
    speed = _compute_velocity(offset, seen.motion.fps, 0.03)[:, :2]
    ahead = np.stack([np.cos(seen.facing), np.sin(seen.facing)], axis=1)
    near = slice(max(0, key - int(seen.to_frames(0.25))), key + int(seen.to_frames(0.25)) + 1)
    return float(np.max(np.sum(speed * ahead, axis=1)[near]))


def _propose_turns(seen: _RecordingSignals) -> list[Proposal]:
    """Propose stretches in which the body turns by more than _TURN without travelling fast."""
    rate = _compute_velocity(seen.facing[:, None], seen.motion.fps, 0.1)[:, 0]
    out = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turning = (sign * rate > _TURN_RATE) & (seen.speed < _TURN_SPEED) & (seen.upright > _UPRIGHT)
        for start, stop in find_runs(turning):
            angle = abs(float(seen.facing[stop - 1] - seen.facing[start]))
            if angle >= _TURN and stop - start >= seen.to_frames(0.25):
                confidence = float(np.clip(0.4 + angle / np.pi, 0.5, 0.95))
                row = seen.build_row(start, stop - 1, ("turning", side))
                out.append(Proposal(row, confidence, f"{np.degrees(angle):.0f} degrees"))
    return out


def _propose_ground(seen: _RecordingSignals) -> list[Proposal]:
    """Propose lying on the ground, and getting up from it."""
    height = seen.places[:, seen.body.hips, 2] - seen.floor
    low, up = height < _LYING * seen.leg, height > _UP * seen.leg
    out = []
    for start, stop in find_runs(low):
        if stop - start < seen.to_frames(0.3):
            continue
        out.append(Proposal(seen.build_row(start, stop - 1, ("ground",)), 0.7, "pelvis on the ground"))
        risen = np.flatnonzero(up[stop:])
        if len(risen) and risen[0] < seen.to_frames(4.0):
            words = ("getting_up", "front" if _is_prone(seen, start, stop) else "back")
            out.append(Proposal(seen.build_row(max(start, stop - seen.to_frames(1.0)), stop + risen[0], words), 0.7,
                                "rises"))
    return out


def _is_prone(seen: _RecordingSignals, start: int, stop: int) -> bool:
    """Whether the body lies on its front: across the hips x up the spine points down."""
    at = slice(start, stop)
    body, places = seen.body, seen.places
    across = places[at, body.left.upper_leg] - places[at, body.right.upper_leg]
    spine = places[at, body.chest] - places[at, body.hips]
    return float(np.mean(np.cross(across, spine)[:, 2])) < 0.0
