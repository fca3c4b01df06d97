"""Pins: a hand or foot that has to be at a place for a while, and a gaze that is turned to one.

A limb comes to its pin and leaves it within FADE seconds: there it is off its own way by what it is off at the pin,
fading away. At a pin that holds it comes to rest, at a momentary one it passes. It gets there by two-bone inverse
kinematics (`limb`). Where the limb is too short, first the spine bends towards the pin and then the pelvis comes
nearer, the feet held where they are; what still lacks is reported. The gaze turns the head, with it the neck and a
little the chest, as far as a neck can. Frames without a pin keep their bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.easing import smoothstep
from ...base.time_series import runs
from ...base.vectors import arctan2, unit_vector
from ...motion import quaternion
from ...motion.humanoid import Humanoid, heading_from_positions, identify
from ...motion.limb import two_bone
from ...motion.motion import Motion, pose_kinematics
from ...motion.skeleton import Skeleton
from .carry import arm, joints_down, leg

FADE = 0.3  # s before and behind a pin in which the body comes to it and leaves it
MOST_BEND, MOST_SHIFT = 0.6, 0.25  # rad that the spine bends and m that the pelvis moves for a pin out of reach
MOST_YAW, MOST_PITCH = np.radians(100.0), np.radians(55.0)  # from straight ahead of the body that a gaze turns
STRETCH = 0.985  # of a limb's length up to which it reaches by itself
_SOFT, _SOFT_LACK = 0.004, 0.02  # m over which limbs ease at full length, and over which the body begins to go along
_CHEST_SHARE, _NECK_SHARE = 0.15, 0.35  # of a look's turn; the head has the rest
_GLIDE = 2.0  # frames in which a limb that leaves a pin takes up the body's speed
_MOVED = 0.02  # m that the pelvis is moved where its feet are wholly held by reaching
_NEAR = 0.01  # m by which a foot may be moved and still counts as standing


@dataclass(frozen=True, eq=False)
class Stay:
    """One pin in frames (fractional), from first to last, at a place (3,) m."""

    first: float
    last: float
    place: np.ndarray

    @property
    def frames(self) -> tuple[int, int]:
        """The whole frames that its time touches."""
        low = int(np.floor(self.first + 1e-6))
        return low, max(int(np.ceil(self.last - 1e-6)), low)


@dataclass(frozen=True, eq=False)
class Target:
    """Where one part has to be: share (T,) of the pin at each frame, 1 where it holds and 0 where there is none; place
    (T, 3) m of the pin, the next one's or the last one's where the share is below 1; stays: in the order of time."""

    share: np.ndarray
    place: np.ndarray
    stays: tuple[Stay, ...]

    def cut(self, low: int, high: int) -> "Target":
        """The frames low .. high."""
        inside = [stay for stay in self.stays if low <= stay.frames[0] and stay.frames[1] < high]
        moved = tuple(Stay(stay.first - low, stay.last - low, stay.place) for stay in inside)
        return Target(self.share[low:high], self.place[low:high], moved)


@dataclass(frozen=True, eq=False)
class Pinned:
    """rotations (T, J, 4), root (T, 3) m, contacts (T, 2) bool without those of feet on their way to a pin; miss: m, or
    radians for a gaze, by which each pin is missed, in the order given."""

    root: np.ndarray
    rotations: np.ndarray
    contacts: np.ndarray
    miss: tuple[float, ...]


def pinned(motion: Motion, contacts: np.ndarray, pins: Sequence, start: float, look: np.ndarray) -> Pinned:
    """A motion whose frame 0 is at second `start`, with its hands, feet and gaze at their pins.

    pins: anything with time and hold s, part and position m (`plan.Pin`), no two of a part at one time. contacts (T, 2)
    bool. look (3,): which way the head joint looks, in its own frame (`look_axis`)."""
    out, targets = _Work(motion, np.array(contacts), look), {}
    for part in dict.fromkeys(pin.part for pin in pins):
        targets[part] = target([pin for pin in pins if pin.part == part], start, motion.fps, len(motion))
    touched = np.zeros(len(motion), bool)
    for found in targets.values():
        touched |= found.share > 0.0
    for low, high in runs(touched):
        out.work(low, high, {part: found.cut(low, high) for part, found in targets.items()})
    for part in ("left_foot", "right_foot"):
        if part in targets:
            out.lift(part, targets[part])
    return Pinned(out.root, out.rotations, out.contacts, tuple(out.miss(pin, start) for pin in pins))


def target(pins: Sequence, start: float, fps: float, count: int) -> Target:
    """What the pins of one part, in the order of time, ask for over `count` frames. A pin holds on all frames that
    touch its time; between two that are less than twice FADE apart the part is not let go. Pins outside count for
    nothing."""
    share, place, stays = np.zeros(count), np.zeros((count, 3)), []
    at, fade = np.arange(count), max(FADE * fps, 1.0)
    for pin in pins:
        end = pin.time + pin.hold
        stay = Stay((pin.time - start) * fps, min((end - start) * fps, count - 1.0), np.array(pin.position))
        (first, last), before = stay.frames, stays[-1] if stays else None
        if first < 0 or first >= count:
            continue
        if before is not None and first - before.frames[1] < 2.0 * fade:
            between = (at > before.frames[1]) & (at < first)
            way = smoothstep((at[between] - before.frames[1]) / (first - before.frames[1]))
            share[between] = 1.0
            place[between] = before.place + way[:, None] * (stay.place - before.place)
        else:
            coming = (at < first) & (at > first - fade)
            share[coming], place[coming] = smoothstep(1.0 - (first - at[coming]) / fade), stay.place
        inside = (at >= first) & (at <= last)
        share[inside], place[inside] = 1.0, stay.place
        leaving = (at > last) & (at < last + fade)
        share[leaving], place[leaving] = smoothstep(1.0 - (at[leaving] - last) / fade), stay.place
        stays.append(stay)
    return Target(share, place, tuple(stays))


def look_axis(skeleton: Skeleton, rotations: np.ndarray) -> np.ndarray:
    """(3,) unit: the direction in the head joint's own frame in which bodies with the local rotations (T, J, 4) look
    ahead, on the average of T poses of people who go their way."""
    places, world = pose_kinematics(skeleton, np.zeros((len(rotations), 3)), rotations)
    facing = heading_from_positions(skeleton, places)
    ahead = np.column_stack([np.cos(facing), np.sin(facing), np.zeros(len(facing))])
    mean = quaternion.rotate(quaternion.inverse(world[:, identify(skeleton).head_or_neck]), ahead).mean(axis=0)
    return unit_vector(mean)


class _Work:
    """A motion on its way to its pins."""

    def __init__(self, motion: Motion, contacts: np.ndarray, look: np.ndarray):
        self.skeleton, self.look, self.contacts, self.before = motion.skeleton, look, contacts, motion
        self.root, self.rotations = np.array(motion.root_positions), np.array(motion.rotations)
        self.body = identify(motion.skeleton)

    def work(self, low: int, high: int, targets: dict[str, Target]) -> None:
        """Frames low .. high, all that pins touch there: feet, gaze, hands, and the gaze again, which the hands may
        have turned away."""
        part = _Part(self.skeleton, self.body, self.root[low:high], self.rotations[low:high])
        chains = {part: chain for part, chain in _chains(self.body).items() if part in targets and None not in chain}
        goals = {name: part.goal(chain[-1], targets[name]) for name, chain in chains.items()}
        soles = {name: part.places[:, chain[-1]].copy() for name, chain in _chains(self.body).items() if "foot" in name}
        soles.update({name: goal for name, goal in goals.items() if "foot" in name})
        turns = {name: part.world[:, _chains(self.body)[name][-1]].copy() for name in soles}
        share = {name: targets[name].share for name in goals}
        for name in goals:
            if "foot" in name:
                part.come_nearer(chains[name], goals[name], share[name], bend=False)
        if "gaze" in targets:
            part.gaze(targets["gaze"], self.look, whole=True)
        for name in goals:
            if "hand" in name:
                part.come_nearer(chains[name], goals[name], share[name], bend=True)
        part.settle(self.root[low:high], _chains(self.body), soles, self.contacts[low:high], self.before.fps)
        moved = np.linalg.norm(part.root - self.root[low:high], axis=1) / _MOVED
        for name, place in soles.items():
            weight = np.maximum(targets[name].share if name in targets else 0.0, np.minimum(moved, 1.0))
            part.reach(_chains(self.body)[name], place, weight, turns[name])
        for name in goals:
            if "hand" in name:
                part.reach(chains[name], goals[name], share[name])
        if "gaze" in targets:
            part.gaze(targets["gaze"], self.look, whole=False)
        self.root[low:high] = part.root
        signed = quaternion.signed_like(part.rotations, self.rotations[low:high])
        self.rotations[low:high] = quaternion.normalized(signed)

    def lift(self, part: str, found: Target) -> None:
        """A foot on its way to or from a pin does not stand."""
        joint, side = _chains(self.body)[part][-1], part == "right_foot"
        held = np.zeros(len(self.root), bool)
        for stay in found.stays:
            held[stay.frames[0] : stay.frames[1] + 1] = stay.last > stay.first
        way = np.flatnonzero((found.share > 0.0) & ~held)
        old, _ = pose_kinematics(self.skeleton, self.before.root_positions[way], self.before.rotations[way])
        new, _ = pose_kinematics(self.skeleton, self.root[way], self.rotations[way])
        self.contacts[way, int(side)] &= np.linalg.norm(new[:, joint] - old[:, joint], axis=1) < _NEAR

    def miss(self, pin, start: float) -> float:
        """The largest miss while a pin holds; that of a pin outside the motion, or of a part that the body has not,
        is infinite."""
        stays = target([pin], start, self.before.fps, len(self.root)).stays
        chain = _chains(self.body).get(pin.part, (self.body.head_or_neck,))
        if not stays or None in chain:
            return np.inf
        stay = stays[0]
        at = np.arange(stay.frames[0], min(stay.frames[1], len(self.root) - 1) + 1)
        places, world = pose_kinematics(self.skeleton, self.root[at], self.rotations[at])
        away = stay.place - places[:, chain[-1]]
        if pin.part != "gaze":
            inside = np.unique(np.clip([stay.first, *at, stay.last], stay.first, stay.last))
            lines = [np.interp(inside, at, column) for column in away.T]
            return float(np.linalg.norm(lines, axis=0).max())
        sight = quaternion.rotate(world[:, chain[-1]], np.broadcast_to(self.look, away.shape))
        return float(np.arccos(np.clip(np.sum(sight * away, axis=-1) / np.linalg.norm(away, axis=1), -1.0, 1.0)).max())


def _chains(body: Humanoid) -> dict[str, tuple]:
    return {"left_foot": leg(body.left), "right_foot": leg(body.right),
            "left_hand": arm(body.left), "right_hand": arm(body.right)}


class _Part:
    """The frames W of a motion that pins touch without a break: root (W, 3) m, rotations (W, J, 4), and places and
    world rotations of the joints, kept up to date."""

    def __init__(self, skeleton: Skeleton, body: Humanoid, root: np.ndarray, rotations: np.ndarray):
        self.skeleton, self.body = skeleton, body
        self.root, self.rotations = root.copy(), rotations.copy()
        self._pose()

    def _pose(self) -> None:
        self.places, self.world = pose_kinematics(self.skeleton, self.root, self.rotations)

    def goal(self, joint: int, found: Target) -> np.ndarray:
        """(W, 3) m where a limb's end goes: its own way, and off it what it is off at its pins."""
        own, at = self.places[:, joint], np.arange(len(self.root))
        off, known = np.zeros_like(own), []
        for stay in found.stays:
            low, high = stay.frames[0], min(stay.frames[1], len(own) - 1)
            inside = slice(low, high + 1)
            passed = own[inside] if stay.last > stay.first else [np.interp(stay.first, at, column) for column in own.T]
            off[inside] = stay.place - passed
            known.append((low, high, stay.last > stay.first))
        for (_, high, held), (low, _, holds) in zip([(0, -1, False), *known], [*known, (len(own), 0, False)]):
            gap = np.arange(high + 1, low)
            after = self._off_from(off, own, high, gap, held) if high >= 0 else np.zeros((len(gap), 3))
            before = self._off_from(off, own, low, gap, holds) if low < len(own) else np.zeros((len(gap), 3))
            if high >= 0 and low < len(own):
                way = smoothstep((gap - high) / (low - high))[:, None]
                off[gap] = (after + way * (before - after)) * found.share[gap, None]
            else:
                off[gap] = (after + before) * found.share[gap, None]
        return own + off

    def _off_from(self, off: np.ndarray, own: np.ndarray, edge: int, gap: np.ndarray, held: bool) -> np.ndarray:
        """(G, 3) m that the limb is off in the frames `gap` next to a pin's frame `edge`: as much as there, and where
        the pin holds it goes on a while as it was going there, so that the limb comes to rest and leaves softly."""
        if not held or not len(gap):
            return np.broadcast_to(off[edge], (len(gap), 3))
        beside = edge - 1 if gap[0] > edge else edge + 1
        speed = (own[beside] - own[edge]) * (1.0 if gap[0] > edge else -1.0)
        away = gap - edge
        return off[edge] + (np.sign(away) * _GLIDE * (1.0 - np.exp(-np.abs(away) / _GLIDE)))[:, None] * speed

    def come_nearer(self, chain, goal: np.ndarray, share: np.ndarray, bend: bool) -> None:
        """Bends the spine (for a hand) and moves the pelvis so far that the limb, which is `share` (W,) on its way,
        reaches its goal (W, 3)."""
        reach, spine = STRETCH * self._length(chain), self.body.spine if bend else ()
        for _ in range(3 if spine else 0):
            self._bend(spine, chain[0], goal, reach, share / 3.0)
        lack, way = self._lack(chain[0], goal, reach)
        shift = (share * np.minimum(lack, MOST_SHIFT))[:, None] * way
        self.root = self.root + np.column_stack([shift[:, :2], np.minimum(shift[:, 2], 0.0)])
        self._pose()

    def settle(self, root: np.ndarray, chains: dict, soles: dict, contacts: np.ndarray, fps: float) -> None:
        """Lowers a pelvis that has been moved away from `root` (W, 3) so far that a foot which stands, contacts (W, 2),
        is in reach of where it stands, soles (W, 3) by name."""
        if np.array_equal(root, self.root):
            return
        window = np.hanning(max(3, int(0.3 * fps)) + 2)
        drop = np.zeros(len(root))
        for side, name in enumerate(("left_foot", "right_foot")):
            stands = np.convolve(np.pad(contacts[:, side].astype(float), len(window) // 2, mode="edge"), window, "same")
            stands = stands[len(window) // 2 : len(window) // 2 + len(root)] / window.sum()
            hip, bones = self.places[:, chains[name][0]], self._length(chains[name])
            own = np.linalg.norm(hip + root - self.root - soles[name], axis=1)
            longest = np.maximum(STRETCH * bones, np.minimum(own, bones))
            aside = np.linalg.norm((hip - soles[name])[:, :2], axis=1)
            highest = soles[name][:, 2] + np.sqrt(np.maximum(longest**2 - aside**2, 0.0))
            drop = np.maximum(drop, np.clip(hip[:, 2] - highest, 0.0, MOST_SHIFT) * stands)
        self.root = self.root - drop[:, None] * [0.0, 0.0, 1.0]
        self._pose()

    def _length(self, chain) -> float:
        """Metres of a limb, stretched."""
        bones = joints_down(self.skeleton, chain[0], chain[-1])[:0:-1]
        return float(sum(np.linalg.norm(self.skeleton.offsets[joint]) for joint in bones))

    def _lack(self, joint: int, goal: np.ndarray, reach) -> tuple[np.ndarray, np.ndarray]:
        """(W,) m that `joint` is too far from the goal, setting in softly, and (W, 3) the way there."""
        away = goal - self.places[:, joint]
        distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        return _SOFT_LACK * np.logaddexp(0.0, (distance - reach) / _SOFT_LACK), away / distance[:, None]

    def _bend(self, spine: tuple[int, ...], top: int, goal: np.ndarray, reach, share: np.ndarray) -> None:
        """Turns the joints of the spine evenly so that `top` comes nearer to the goal by what it lacks."""
        lack, way = self._lack(top, goal, reach)
        low = self.places[:, spine[0]]
        old = self.places[:, top] - low
        turn = quaternion.to_rotation_vector(quaternion.between(old, old + lack[:, None] * way))
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        turn *= np.minimum(1.0, MOST_BEND / np.maximum(angle, 1e-9)) * (3.0 * share[:, None]) / len(spine)
        for joint in spine:
            self._turn(joint, turn)

    def _turn(self, joint: int, turn: np.ndarray) -> None:
        """Turns a joint, and all that hangs on it, by rotation vectors (W, 3) in the world."""
        world = quaternion.multiply(quaternion.from_rotation_vector(turn), self.world[:, joint])
        parent = self.skeleton.parents[joint]
        above = self.world[:, parent] if parent >= 0 else quaternion.identity(len(world))
        self.rotations[:, joint] = quaternion.multiply(quaternion.inverse(above), world)
        self._pose()

    def reach(self, chain, goal: np.ndarray, share: np.ndarray, turn: np.ndarray | None = None) -> None:
        """Brings a limb's end to its goal (W, 3), and to the rotation `turn` (W, 4) in the world where that is given;
        where the share (W,) is small, its joints go over from their own rotations."""
        if not np.any(share > 0.0):
            return
        found = two_bone(self.skeleton, self.root, self.rotations, chain, goal, end_rotation=turn,
                         keep_end_rotation=False, soft=_SOFT).rotations
        weight = smoothstep(4.0 * share)
        for joint in joints_down(self.skeleton, chain[0], chain[-1]):
            near = quaternion.signed_like(found[:, joint], self.rotations[:, joint])
            mixed = quaternion.slerp(self.rotations[:, joint], near, weight)
            self.rotations[:, joint] = np.where(weight[:, None] >= 1.0, near, mixed)
        self._pose()

    def gaze(self, found: Target, look: np.ndarray, whole: bool) -> None:
        """Turns the head so that it looks at the place, with the neck and the chest where the whole body is meant."""
        head, neck, chest = self.body.head_or_neck, self.body.neck, self.body.chest
        turn = self._gaze_turn(head, found, look)
        if whole:
            self._turn(chest, _CHEST_SHARE * found.share[:, None] * turn)
            if neck is not None and neck != head:
                self._turn(neck, _NECK_SHARE * found.share[:, None] * turn)
            self._turn(head, found.share[:, None] * (1.0 - _CHEST_SHARE - _NECK_SHARE * (neck != head)) * turn)
        else:
            self._turn(head, smoothstep((found.share - 0.7) / 0.3)[:, None] * turn)

    def _gaze_turn(self, head: int, found: Target, look: np.ndarray) -> np.ndarray:
        """(W, 3) rotation vectors, in the world, from where the head looks to the place, as far as a neck can."""
        sight = quaternion.rotate(self.world[:, head], np.broadcast_to(look, (len(self.root), 3)))
        away = found.place - self.places[:, head]
        facing = heading_from_positions(self.skeleton, self.places)
        yaw = np.clip(quaternion.wrapped(arctan2(away[:, 1], away[:, 0]) - facing), -MOST_YAW, MOST_YAW) + facing
        pitch = np.clip(arctan2(away[:, 2], np.hypot(away[:, 0], away[:, 1])), -MOST_PITCH, MOST_PITCH)
        wanted = np.column_stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
        return quaternion.to_rotation_vector(quaternion.between(sight, wanted))
