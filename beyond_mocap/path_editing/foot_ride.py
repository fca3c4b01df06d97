"""The feet of a motion that rides another path: held where they stand, on level ground or any other.

As `foot_plant`, with three differences. The ground may rise and tip (`ground_contact`): feet keep the height above it
that they had above their own, soles and their steps tip with it, and the pelvis follows the mean of what is under both
feet. A leg that is asked to be straighter than it was nears its full length gently, the same in the air and on the
ground, so that no knee pops when a foot arrives. And only the joints of the legs are looked at, since paths are
dragged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..base.vectors import unit_vector
from ..motion import foot_plant, quaternion
from ..motion.foot_plant import Foot, Planted, settled
from ..motion.humanoid import Limb, identify
from ..motion.limb import CLEAR_BEND, bent_limb
from ..motion.motion import pose_kinematics
from ..motion.skeleton import Skeleton
from ..motion.track import zero_phase_hann
from .ground_contact import Surface, footing

MOST_SHIFT = 0.45
"""Metres that a standing foot is moved over the ground at most, before it is held less firmly: bodies that turn on the
spot turn otherwise on another path."""
FIRST_DROP = 0.015
"""Metres that the pelvis is lowered before a heel is raised where a leg does not reach."""
DROP_BY_SLOPE = 0.15
"""Metres more that the pelvis is lowered at most, times the slope of the ground: downhill the other foot is low."""
SINK_BY_SLOPE = 0.15
"""Metres by which the pelvis is lower, times the slope: knees bend more on slopes, up and down."""
SPARE = 0.008
"""Metres below full length within which a leg that was bent more eases towards it."""
LONGEST = (0.3, 1.3)
"""How many times as long as it was a step is made at least and at most."""
BENT_ALOFT, STRAIGHT_ALOFT, STIFF = 0.2, 0.01, 0.05
"""Weights of what the goals ask of a leg in the air, bent more or straighter than it was, against 1 on the ground, and
of a smooth course."""
LEAST_BEND = 0.05
"""Root of the metres that a leg always lacks to its full length."""
_FIRM = 4.0  # how sharply: at full length asked, a sixth of SPARE is left
_PELVIS_SECONDS, _STRIDE = 0.5, 0.5  # seconds; metres between the feet on stairs, in the mean
_UP = np.array([0.0, 0.0, 1.0])
_ROUNDS, _SLIDES_FROM = 2, 0.004  # rounds of holding stances less firmly; m of sliding that need none
_FLOOR, _EVEN = 200.0, 0.003  # smoothness of a recording's floor: waves of half a second pass half; metres
_NEAR, _FIRMER = 0.004, 8  # metres off its goal beyond which a standing foot is held more firmly, times in a row
_MORE_BENT = 0.5  # share of its new bend from which on a leg's own direction counts fully
_BEHIND = 0.1  # seconds by which a rise or drop is spread


@dataclass(frozen=True, eq=False)
class Ground:
    """What the feet go on. own (T, 2) m: heights of each foot's ground that the motion was laid with; up (T, 2, 3) its
    normals; surface: what they are to go on instead, None where that is the same."""

    own: np.ndarray
    up: np.ndarray
    surface: Surface | None = None


@dataclass(frozen=True, eq=False)
class Steps:
    """How long steps are: direction (T,) radians of travel and times (T,) as long as the motion was laid out with."""

    direction: np.ndarray
    times: np.ndarray


def follow(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, standing: np.ndarray, fps: float,
           ground: Ground, sole: float, steps: Steps | None = None) -> Planted:
    """The motion with its feet held wherever `standing` (T, 2, 2) says that heels and toes stand.

    root (T, 3) m and rotations (T, J, 4) local: the motion laid out. sole: metres that the foremost joint of a flat
    foot is above its ground. steps: None where they are as long as they were."""
    legs, kept, limbs = _legs(skeleton)
    places, world = pose_kinematics(legs, root, rotations[:, kept])
    scale, spread = 30.0 / fps, _frames(_BEHIND, fps)
    feet = [_steady(foot_plant.laid_foot(places, world, limb, standing[:, side])) for side, limb in enumerate(limbs)]
    if steps is not None:
        feet = [_stretched(foot, root, steps) for foot in feet]
    feet = [foot_plant.turned_flat(foot, scale) for foot in feet]
    feet, lifted = _on_own_ground(feet, ground.own, sole, scale)
    firm = [foot.weight for foot in feet]
    for turn in range(_ROUNDS + 1):
        shifts = [foot_plant.held_shift(foot.moves, weight, scale, MOST_SHIFT)[0] for foot, weight in zip(feet, firm)]
        put = [foot.moved(np.pad(by, ((0, 0), (0, 1)))) for foot, by in zip(feet, shifts)]
        put, up, most = _on_ground(put, standing, fps, ground, lifted)
        first = foot_plant.pelvis_drop(put, [foot.heel for foot in put], spread, FIRST_DROP)
        put = [replace(foot, hip=foot.hip - first[:, None] * _UP) for foot in put]
        goals = [_goal(foot, spread) for foot in put]
        drop = foot_plant.pelvis_drop(put, [goal for goal, _ in goals], spread, most - FIRST_DROP)
        short = [foot_plant.lacking(foot, goal, drop) for foot, (goal, _) in zip(put, goals)]
        if turn == _ROUNDS or max(s.max(initial=0.0) for s in short) <= _SLIDES_FROM:
            break
        firm = [foot_plant.held_less(weight, s) for weight, s in zip(firm, short)]
    down = (first + drop - up)[:, None] * _UP
    places = places - down[:, None]
    out, correction, miss = np.array(rotations, dtype=float), np.zeros((len(root), 2)), np.zeros((len(root), 2))
    for side, (foot, (goal, turned)) in enumerate(zip(put, goals)):
        hip = foot.hip - drop[:, None] * _UP
        target = _eased(foot, goal, hip, scale)
        joints = (foot.limb.upper_leg, foot.limb.lower_leg, foot.limb.foot)
        clear = _clear_bend(foot, np.linalg.norm(target - hip, axis=1))
        found, _ = bent_limb(legs, places, world, joints, target, end_rotation=turned, soft=1e-4, clear=clear)
        for joint, local in found.items():
            out[:, kept[joint]] = local
        miss[:, side] = np.where(foot.carries > 0.0, np.linalg.norm(target - goal, axis=1), 0.0)
        correction[:, side] = np.linalg.norm((target - places[:, foot.limb.foot])[:, :2], axis=1)
    return Planted(root - down, out, correction, miss)


@lru_cache(maxsize=32)
def _legs(skeleton: Skeleton) -> tuple[Skeleton, list[int], tuple[Limb, ...]]:
    """A skeleton's legs and what they hang on, their joints in the whole one, and the limbs by the joints of the
    part."""
    body = identify(skeleton)
    named = [[limb.upper_leg, limb.lower_leg, limb.foot, limb.toe_or_foot] for limb in (body.left, body.right)]
    legs, kept = skeleton.part([joint for side in named for joint in side])
    found = []
    for limb, joints in zip((body.left, body.right), named):
        upper, lower, foot, toe = (kept.index(joint) for joint in joints)
        found.append(replace(limb, upper_leg=upper, lower_leg=lower, foot=foot, toe=None if limb.toe is None else toe))
    return legs, kept, tuple(found)


def _steady(foot: Foot) -> Foot:
    """The foot with its left as it is in the mean of the frames where it lies level: seen from above a foot that stands
    on its toes points nowhere."""
    level = np.linalg.norm((foot.toe - foot.heel)[:, :2], axis=1, keepdims=True)
    own = np.sum(quaternion.rotate(quaternion.inverse(foot.rotation), foot.left) * level**2, axis=0)
    left = quaternion.rotate(foot.rotation, unit_vector(own)) * [1.0, 1.0, 0.0]
    size = np.linalg.norm(left, axis=1, keepdims=True)
    return replace(foot, left=np.where(size > 0.1, left / np.maximum(size, 1e-9), foot.left))


def _stretched(foot: Foot, root: np.ndarray, steps: Steps) -> Foot:
    """The foot further before or behind the body, as far as LONGEST allows."""
    along = np.stack([np.cos(steps.direction), np.sin(steps.direction)], axis=1)
    ahead = np.sum((0.5 * (foot.heel + foot.toe) - root)[:, :2] * along, axis=1)
    much = np.clip(steps.times, *LONGEST) - 1.0
    return foot.moved(np.pad((much * ahead)[:, None] * along, ((0, 0), (0, 1))))


def _on_own_ground(feet: list[Foot], own: np.ndarray, sole: float, scale: float) -> tuple[list[Foot], np.ndarray]:
    """Feet on their ground, `own` (T, 2) m high, since the floors of recordings are uneven and drift; metres (T,) by
    which the body is off it: by as much as the feet that stand, and as they were in the air."""
    above = [foot.moved(-height[:, None] * _UP) for foot, height in zip(feet, own.T)]
    lifts = [foot_plant.lift_to_ground(foot, sole, scale) for foot in above]
    weights = [foot.carries for foot in feet]
    lifted = sum((w * lift for w, lift in zip(weights, lifts)), np.zeros(()))
    off = settled(lifted, sum(weights, np.zeros(())), scale, _FLOOR)
    if np.abs(off).max(initial=0.0) > _EVEN:
        lifts = [off + foot_plant.lift_to_ground(foot.moved(off[:, None] * _UP), sole, scale) for foot in above]
    return [foot.moved(by[:, None] * _UP) for foot, by in zip(feet, lifts)], off


def _frames(seconds: float, fps: float) -> int:
    return int(round(seconds * fps))


def _on_ground(feet: list[Foot], standing: np.ndarray, fps: float, ground: Ground,
               lifted: np.ndarray) -> tuple[list[Foot], np.ndarray, float]:
    """Feet on their ground, metres (T,) by which the body goes up for that, and metres by which it may go down further;
    lifted (T,) m: by which the feet were lifted before."""
    if ground.surface is None:
        up = lifted
        return [replace(foot, hip=foot.hip + up[:, None] * _UP) for foot in feet], up, foot_plant.MOST_DROP
    over = np.stack([np.stack([foot.heel, foot.toe], axis=1) for foot in feet], axis=1)
    clear = over[..., 2].min(axis=2) - ground.own
    under = footing(over[..., :2], standing, clear, fps, ground.surface)
    rise = under.height - ground.own
    steep = _steepness(under.height, under.normal, fps)
    steeper = np.maximum(steep - _steepness(ground.own, ground.up, fps), 0.0)
    up = lifted + _followed(rise.mean(axis=1) - SINK_BY_SLOPE * steeper, fps)
    tip = quaternion.between(ground.up, under.normal)
    put = [_tipped(foot, tip[:, side], rise[:, side] + under.lift[:, side], up) for side, foot in enumerate(feet)]
    return put, up, foot_plant.MOST_DROP + DROP_BY_SLOPE * float(steep.max(initial=0.0))


def _steepness(height: np.ndarray, normal: np.ndarray, fps: float) -> np.ndarray:
    """(T,) how steep the ground is that two feet are on, from its heights (T, 2) m and normals (T, 2, 3)."""
    slope = np.linalg.norm(normal[..., :2], axis=2) / np.maximum(normal[..., 2], 0.1)
    apart = np.abs(np.diff(height, axis=1)) / _STRIDE
    return np.maximum(slope.mean(axis=1), zero_phase_hann(apart, fps, 1.0)[:, 0])


def _followed(height: np.ndarray, fps: float) -> np.ndarray:
    """The pelvis's share (T,) m of what is under the feet."""
    return zero_phase_hann(height[:, None], fps, _PELVIS_SECONDS)[:, 0]


def _tipped(foot: Foot, tip: np.ndarray, rise: np.ndarray, up: np.ndarray) -> Foot:
    """The foot tipped (T, 4) about its toe and brought up by rise (T,) m; its hip goes up by `up` (T,) m."""
    toe = foot.toe + rise[:, None] * _UP
    return replace(foot, hip=foot.hip + up[:, None] * _UP, toe=toe,
                   heel=toe + quaternion.rotate(tip, foot.heel - foot.toe),
                   rotation=quaternion.multiply(tip, foot.rotation), left=quaternion.rotate(tip, foot.left))


def _goal(foot: Foot, spread: int) -> tuple[np.ndarray, np.ndarray]:
    """Where the ankle goes (T, 3) and the foot's world rotation (T, 4): on its toe where the leg does not reach."""
    rise = foot_plant.spread_over(foot_plant.heel_rise(foot, np.zeros((1, 3))) * foot.weight[:, 1], spread)
    roll = quaternion.about_axis(foot.left, rise)
    return foot.toe + quaternion.rotate(roll, foot.heel - foot.toe), quaternion.multiply(roll, foot.rotation)


def _clear_bend(foot: Foot, far: np.ndarray) -> np.ndarray:
    """(T,) share of a leg's length by which its knee was to be off the line hip-ankle for its direction to be believed;
    far (T,) m: how long the leg is to be. Of a leg that bends much more than it did the direction's tremble grows."""
    return np.maximum(CLEAR_BEND, 0.5 * _MORE_BENT * np.sqrt(np.maximum(1.0 - (far / foot.length) ** 2, 0.0)))


def _eased(foot: Foot, goal: np.ndarray, hip: np.ndarray, scale: float) -> np.ndarray:
    """Goals (T, 3) as a leg can follow them, brought nearer to the hip or further away.

    A knee bends with the root of what its leg lacks to its full length. In these roots what a leg is to differ from the
    recording is one smooth curve: what the goals ask for where the foot stands, and little of it in the air where that
    would make the leg straighter than it was."""
    line = goal - hip
    far = np.linalg.norm(line, axis=1)
    own = np.maximum(foot.own, 1e-5)
    room = SPARE * (1.0 - np.exp(-own / SPARE))
    left = room / _FIRM * np.logaddexp(0.0, _FIRM * (foot.length - far) / room)
    more = np.sqrt(left) - np.sqrt(own)
    stands = foot.carries > 0.0
    weight = np.where(stands, 1.0, np.where(more > 0.0, BENT_ALOFT, STRAIGHT_ALOFT))
    for _ in range(_FIRMER + 1):
        bend = np.sqrt(own) + settled(weight * more, weight, scale, STIFF)
        bend = 0.5 * (bend + np.sqrt(bend**2 + LEAST_BEND**2))
        off = np.where(stands, np.abs(foot.length - bend**2 - far), 0.0) / _NEAR
        if off.max(initial=0.0) <= 1.0:
            break
        weight = weight * np.maximum(off, 1.0) ** 2
    return hip + line * ((foot.length - bend**2) / np.maximum(far, 1e-9))[:, None]
