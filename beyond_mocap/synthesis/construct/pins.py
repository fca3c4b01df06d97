"""Pins: a hand or foot that has to be at a place for a while, and a gaze that is turned to one.

A limb comes to its pin and leaves it within FADE seconds: there its offset from its own path is that at the pin, fading
away. At a pin that holds it comes to rest, at a momentary one it passes. Two-bone inverse kinematics take it there
(`limb`). Where the limb is too short, first the spine bends towards the pin and then the pelvis comes nearer, the feet
held in place; what still lacks is reported. The gaze turns the head, with it the neck and a little the chest, within
the range of a neck. Frames without a pin stay bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.easing import smoothstep
from ...base.time_series import find_runs
from ...base.vectors import arctan2, unit_vector
from ...motion import quaternion
from ...motion.humanoid import Humanoid, compute_heading_from_positions, identify_joints
from ...motion.limb import solve_two_bone
from ...motion.motion import Motion, compute_pose
from ...motion.skeleton import Skeleton
from .move_body_part import arm_chain, list_joint_chain

FADE = 0.3  # s before and after a pin in which the body comes to it and leaves it
MAX_BEND, MAX_SHIFT = 0.6, 0.25  # largest rad of the spine and m of the pelvis for a pin out of reach
MAX_YAW, MAX_PITCH = np.radians(100.0), np.radians(55.0)  # largest turns of a gaze from straight ahead of the body
REACH_SHARE = 0.985  # share of a limb's length up to which it reaches alone
_SOFT, _SOFT_LACK = 0.004, 0.02  # m over which limbs extend softly, and over which the body begins to follow
_CHEST_SHARE, _NECK_SHARE = 0.15, 0.35  # of the turn of a gaze; the head has the rest
_GLIDE = 2.0  # frames in which a limb that leaves a pin takes up the body's speed
_HELD_SHIFT = 0.02  # m of the pelvis from which on the feet are held entirely by inverse kinematics
_NEAR = 0.01  # m by which a foot may be moved and still counts as in contact


@dataclass(frozen=True, eq=False)
class PinFrames:
    """One pin in frames.

    Attributes:
        first: first frame, fractional.
        last: last frame, fractional.
        place: (3,) m, world.
    """

    first: float
    last: float
    place: np.ndarray

    @property
    def frames(self) -> tuple[int, int]:
        """First and last whole frame that the pin's time touches."""
        low = int(np.floor(self.first + 1e-6))
        return low, max(int(np.ceil(self.last - 1e-6)), low)


@dataclass(frozen=True, eq=False)
class PinTarget:
    """Where one part of the body has to be over T frames.

    Attributes:
        share: (T,) of the pin at each frame, 1 where it holds and 0 where there is none.
        place: (T, 3) m of the pin, of the next or last one where the share is below 1.
        pins: the pins, in order of time.
    """

    share: np.ndarray
    place: np.ndarray
    pins: tuple[PinFrames, ...]

    def cut_target(self, low: int, high: int) -> "PinTarget":
        """Cut out the frames low .. high."""
        inside = [stay for stay in self.pins if low <= stay.frames[0] and stay.frames[1] < high]
        moved = tuple(PinFrames(stay.first - low, stay.last - low, stay.place) for stay in inside)
        return PinTarget(self.share[low:high], self.place[low:high], moved)


@dataclass(frozen=True, eq=False)
class PinnedMotion:
    """A motion with its pins.

    Attributes:
        root: (T, 3) m, world.
        rotations: (T, J, 4) local.
        contacts: (T, 2) bool, without those of feet on their way to a pin.
        miss: m, or radians for a gaze, by which each pin is missed, in the order given.
    """

    root: np.ndarray
    rotations: np.ndarray
    contacts: np.ndarray
    miss: tuple[float, ...]


def apply_pins(motion: Motion, contacts: np.ndarray, pins: Sequence, start: float, look: np.ndarray) -> PinnedMotion:
    """Bring the hands, feet and gaze of a motion to their pins.

    Args:
        motion: T frames.
        contacts: (T, 2) bool, left and right foot in contact.
        pins: objects with `time` and `hold` s, `part` and `position` m (`plan.Pin`), no two of one part at one time.
        start: s, time of frame 0 on the pins' clock.
        look: (3,) unit, direction in which the head joint looks, in its own frame (`estimate_look_axis`).
    """
    out, targets = _PinSolver(motion, np.array(contacts), look), {}
    for part in dict.fromkeys(pin.part for pin in pins):
        targets[part] = build_target([pin for pin in pins if pin.part == part], start, motion.fps, len(motion))
    affected = np.zeros(len(motion), bool)
    for found in targets.values():
        affected |= found.share > 0.0
    for low, high in find_runs(affected):
        out.solve_frames(low, high, {part: found.cut_target(low, high) for part, found in targets.items()})
    for part in ("left_foot", "right_foot"):
        if part in targets:
            out.clear_contacts(part, targets[part])
    return PinnedMotion(out.root, out.rotations, out.contacts, tuple(out.measure_miss(pin, start) for pin in pins))


def build_target(pins: Sequence, start: float, fps: float, count: int) -> PinTarget:
    """Convert the pins of one part to frames.

    A pin holds on all frames that its time touches; between two that are less than twice FADE apart the part stays
    bound. Pins outside the frames have no effect.

    Args:
        pins: of one part, in order of time.
        start: s, time of frame 0.
        fps: frames per second.
        count: number of frames.
    """
    share, place, stays = np.zeros(count), np.zeros((count, 3)), []
    at, fade = np.arange(count), max(FADE * fps, 1.0)
    for pin in pins:
        end = pin.time + pin.hold
        pin_frames = PinFrames((pin.time - start) * fps, min((end - start) * fps, count - 1.0), np.array(pin.position))
        (first, last), before = pin_frames.frames, stays[-1] if stays else None
        if first < 0 or first >= count:
            continue
        if before is not None and first - before.frames[1] < 2.0 * fade:
            between = (at > before.frames[1]) & (at < first)
            progress = smoothstep((at[between] - before.frames[1]) / (first - before.frames[1]))
            share[between] = 1.0
            place[between] = before.place + progress[:, None] * (pin_frames.place - before.place)
        else:
            is_coming = (at < first) & (at > first - fade)
            share[is_coming], place[is_coming] = smoothstep(1.0 - (first - at[is_coming]) / fade), pin_frames.place
        inside = (at >= first) & (at <= last)
        share[inside], place[inside] = 1.0, pin_frames.place
        is_leaving = (at > last) & (at < last + fade)
        share[is_leaving], place[is_leaving] = smoothstep(1.0 - (at[is_leaving] - last) / fade), pin_frames.place
        stays.append(pin_frames)
    return PinTarget(share, place, tuple(stays))


def estimate_look_axis(skeleton: Skeleton, rotations: np.ndarray) -> np.ndarray:
    """Estimate the direction in which the head joint looks, as the mean over poses of people in locomotion.

    Args:
        skeleton: the skeleton.
        rotations: (T, J, 4) local.
    Returns:
        (3,) unit, in the head joint's own frame.
    """
    places, world = compute_pose(skeleton, np.zeros((len(rotations), 3)), rotations)
    facing = compute_heading_from_positions(skeleton, places)
    ahead = np.column_stack([np.cos(facing), np.sin(facing), np.zeros(len(facing))])
    mean = quaternion.rotate(quaternion.inverse(world[:, identify_joints(skeleton).head_or_neck]), ahead).mean(axis=0)
    return unit_vector(mean)


class _PinSolver:
    """A motion whose parts are brought to their pins, stretch by stretch."""

    def __init__(self, motion: Motion, contacts: np.ndarray, look: np.ndarray):
        self.skeleton, self.look, self.contacts, self.before = motion.skeleton, look, contacts, motion
        self.root, self.rotations = np.array(motion.root_positions), np.array(motion.rotations)
        self.body = identify_joints(motion.skeleton)

    def solve_frames(self, low: int, high: int, targets: dict[str, PinTarget]) -> None:
        """Solve the frames low .. high, all that pins touch there.

        Order: feet, gaze, hands, and the gaze again, since the hands may have turned it away.
        """
        # goals of limbs, places of soles and rotations of feet before anything moves
        part = _FrameRange(self.skeleton, self.body, self.root[low:high], self.rotations[low:high])
        chains = {part: chain for part, chain in _limb_chains(self.body).items() if part in targets
                  and None not in chain}
        goals = {name: part.compute_goal(chain[-1], targets[name]) for name, chain in chains.items()}
        soles = {name: part.places[:, chain[-1]].copy() for name, chain in _limb_chains(self.body).items()
                 if "foot" in name}
        soles.update({name: goal for name, goal in goals.items() if "foot" in name})
        turns = {name: part.world[:, _limb_chains(self.body)[name][-1]].copy() for name in soles}
        share = {name: targets[name].share for name in goals}
        for name in goals:
            if "foot" in name:
                part.move_body_closer(chains[name], goals[name], share[name], bend=False)
        if "gaze" in targets:
            part.turn_gaze(targets["gaze"], self.look, whole=True)
        for name in goals:
            if "hand" in name:
                part.move_body_closer(chains[name], goals[name], share[name], bend=True)
        # a moved pelvis must not pull planted feet out of reach
        part.lower_pelvis(self.root[low:high], _limb_chains(self.body), soles, self.contacts[low:high], self.before.fps)
        moved = np.linalg.norm(part.root - self.root[low:high], axis=1) / _HELD_SHIFT
        # feet without a pin are held in place by as much as the pelvis has moved
        for name, place in soles.items():
            weight = np.maximum(targets[name].share if name in targets else 0.0, np.minimum(moved, 1.0))
            part.reach_goal(_limb_chains(self.body)[name], place, weight, turns[name])
        for name in goals:
            if "hand" in name:
                part.reach_goal(chains[name], goals[name], share[name])
        if "gaze" in targets:
            part.turn_gaze(targets["gaze"], self.look, whole=False)
        self.root[low:high] = part.root
        signed = quaternion.match_signs(part.rotations, self.rotations[low:high])
        self.rotations[low:high] = quaternion.normalize(signed)

    def clear_contacts(self, part: str, found: PinTarget) -> None:
        """Clear the contacts of a foot on its way to or from a pin."""
        joint, side = _limb_chains(self.body)[part][-1], part == "right_foot"
        held = np.zeros(len(self.root), bool)
        for stay in found.pins:
            held[stay.frames[0] : stay.frames[1] + 1] = stay.last > stay.first
        frames = np.flatnonzero((found.share > 0.0) & ~held)
        old, _ = compute_pose(self.skeleton, self.before.root_positions[frames], self.before.rotations[frames])
        new, _ = compute_pose(self.skeleton, self.root[frames], self.rotations[frames])
        self.contacts[frames, int(side)] &= np.linalg.norm(new[:, joint] - old[:, joint], axis=1) < _NEAR

    def measure_miss(self, pin, start: float) -> float:
        """Measure the largest miss while a pin holds; infinite for a pin outside the motion or a missing part."""
        stays = build_target([pin], start, self.before.fps, len(self.root)).pins
        chain = _limb_chains(self.body).get(pin.part, (self.body.head_or_neck,))
        if not stays or None in chain:
            return np.inf
        stay = stays[0]
        at = np.arange(stay.frames[0], min(stay.frames[1], len(self.root) - 1) + 1)
        places, world = compute_pose(self.skeleton, self.root[at], self.rotations[at])
        away = stay.place - places[:, chain[-1]]
        if pin.part != "gaze":
            # the fractional ends of the pin count as well as its whole frames
            inside = np.unique(np.clip([stay.first, *at, stay.last], stay.first, stay.last))
            lines = [np.interp(inside, at, column) for column in away.T]
            return float(np.linalg.norm(lines, axis=0).max())
        sight = quaternion.rotate(world[:, chain[-1]], np.broadcast_to(self.look, away.shape))
        return float(np.arccos(np.clip(np.sum(sight * away, axis=-1) / np.linalg.norm(away, axis=1), -1.0, 1.0)).max())


def _limb_chains(body: Humanoid) -> dict[str, tuple]:
    """Return the joints of the limb of each part."""
    return {"left_foot": body.left.leg, "right_foot": body.right.leg,
            "left_hand": arm_chain(body.left), "right_hand": arm_chain(body.right)}


class _FrameRange:
    """The W frames of a motion that pins touch without a break.

    Attributes:
        root: (W, 3) m, world.
        rotations: (W, J, 4) local.
        places, world: (W, J, 3) m and (W, J, 4) of the joints, world, kept up to date.
    """

    def __init__(self, skeleton: Skeleton, body: Humanoid, root: np.ndarray, rotations: np.ndarray):
        self.skeleton, self.body = skeleton, body
        self.root, self.rotations = root.copy(), rotations.copy()
        self._update_pose()

    def _update_pose(self) -> None:
        self.places, self.world = compute_pose(self.skeleton, self.root, self.rotations)

    def compute_goal(self, joint: int, found: PinTarget) -> np.ndarray:
        """Compute where the end of a limb goes: its own path plus its offset at the pins.

        Args:
            joint: the limb's end joint.
            found: its target.
        Returns:
            (W, 3) m, world.
        """
        own, at = self.places[:, joint], np.arange(len(self.root))
        off, known = np.zeros_like(own), []
        for stay in found.pins:
            low, high = stay.frames[0], min(stay.frames[1], len(own) - 1)
            inside = slice(low, high + 1)
            passed = own[inside] if stay.last > stay.first else [np.interp(stay.first, at, column) for column in own.T]
            off[inside] = stay.place - passed
            known.append((low, high, stay.last > stay.first))
        # the gaps between pins; (0, -1) and (len, 0) stand for the frames before the first and behind the last one
        for (_, high, held), (low, _, holds) in zip([(0, -1, False), *known], [*known, (len(own), 0, False)]):
            gap = np.arange(high + 1, low)
            after = self._offset_beside_pin(off, own, high, gap, held) if high >= 0 else np.zeros((len(gap), 3))
            before = self._offset_beside_pin(off, own, low, gap, holds) if low < len(own) else np.zeros((len(gap), 3))
            # between two pins go over from the offset of the one to that of the next
            if high >= 0 and low < len(own):
                progress = smoothstep((gap - high) / (low - high))[:, None]
                off[gap] = (after + progress * (before - after)) * found.share[gap, None]
            else:
                off[gap] = (after + before) * found.share[gap, None]
        return own + off

    def _offset_beside_pin(self, off: np.ndarray, own: np.ndarray, edge: int, gap: np.ndarray,
                           held: bool) -> np.ndarray:
        """Compute the offset (G, 3) m of a limb in the frames `gap` next to a pin's frame `edge`.

        It is that at the pin; next to a pin that holds it glides a little further, so that the limb comes to rest and
        leaves softly.
        """
        if not held or not len(gap):
            return np.broadcast_to(off[edge], (len(gap), 3))
        beside = edge - 1 if gap[0] > edge else edge + 1
        speed = (own[beside] - own[edge]) * (1.0 if gap[0] > edge else -1.0)
        away = gap - edge
        return off[edge] + (np.sign(away) * _GLIDE * (1.0 - np.exp(-np.abs(away) / _GLIDE)))[:, None] * speed

    def move_body_closer(self, chain, goal: np.ndarray, share: np.ndarray, bend: bool) -> None:
        """Bend the spine (for a hand) and move the pelvis so far that the limb reaches its goal.

        Args:
            chain: joints of the limb.
            goal: (W, 3) m, world.
            share: (W,) of the pin.
            bend: whether the spine bends first.
        """
        reach, spine = REACH_SHARE * self._limb_length(chain), self.body.spine if bend else ()
        for _ in range(3 if spine else 0):
            self._bend_spine(spine, chain[0], goal, reach, share / 3.0)
        lack, direction = self._measure_lack(chain[0], goal, reach)
        shift = (share * np.minimum(lack, MAX_SHIFT))[:, None] * direction
        self.root = self.root + np.column_stack([shift[:, :2], np.minimum(shift[:, 2], 0.0)])
        self._update_pose()

    def lower_pelvis(self, root: np.ndarray, chains: dict, soles: dict, contacts: np.ndarray, fps: float) -> None:
        """Lower a moved pelvis so far that each foot in contact stays in reach of its place.

        Args:
            root: (W, 3) m, before the pelvis was moved.
            chains: joints of the limbs by part.
            soles: (W, 3) m by part, where the feet have to be.
            contacts: (W, 2) bool.
            fps: frames per second.
        """
        if np.array_equal(root, self.root):
            return
        window = np.hanning(max(3, int(0.3 * fps)) + 2)
        drop = np.zeros(len(root))
        for side, name in enumerate(("left_foot", "right_foot")):
            # contacts smoothed over 0.3 s, so that the pelvis sinks and rises gradually
            contact_weight = np.convolve(np.pad(contacts[:, side].astype(float), len(window) // 2, mode="edge"), window,
                                         "same")
            contact_weight = contact_weight[len(window) // 2 : len(window) // 2 + len(root)] / window.sum()
            hip, bones = self.places[:, chains[name][0]], self._limb_length(chains[name])
            own = np.linalg.norm(hip + root - self.root - soles[name], axis=1)
            longest = np.maximum(REACH_SHARE * bones, np.minimum(own, bones))
            # Pythagoras: the highest hip from which a leg of that length reaches the sole
            aside = np.linalg.norm((hip - soles[name])[:, :2], axis=1)
            highest = soles[name][:, 2] + np.sqrt(np.maximum(longest**2 - aside**2, 0.0))
            drop = np.maximum(drop, np.clip(hip[:, 2] - highest, 0.0, MAX_SHIFT) * contact_weight)
        self.root = self.root - drop[:, None] * [0.0, 0.0, 1.0]
        self._update_pose()

    def _limb_length(self, chain) -> float:
        """Compute the length of a stretched limb, m."""
        bones = list_joint_chain(self.skeleton, chain[0], chain[-1])[:0:-1]
        return float(sum(np.linalg.norm(self.skeleton.offsets[joint]) for joint in bones))

    def _measure_lack(self, joint: int, goal: np.ndarray, reach) -> tuple[np.ndarray, np.ndarray]:
        """Compute how far (W,) m `joint` is too far from the goal, softly, and the direction (W, 3) to it."""
        away = goal - self.places[:, joint]
        distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        return _SOFT_LACK * np.logaddexp(0.0, (distance - reach) / _SOFT_LACK), away / distance[:, None]

    def _bend_spine(self, spine: tuple[int, ...], top: int, goal: np.ndarray, reach, share: np.ndarray) -> None:
        """Turn the joints of the spine evenly so that `top` comes nearer to the goal by what it lacks."""
        lack, direction = self._measure_lack(top, goal, reach)
        low = self.places[:, spine[0]]
        old = self.places[:, top] - low
        turn = quaternion.to_rotation_vector(quaternion.rotation_between(old, old + lack[:, None] * direction))
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        turn *= np.minimum(1.0, MAX_BEND / np.maximum(angle, 1e-9)) * (3.0 * share[:, None]) / len(spine)
        for joint in spine:
            self._turn_joint(joint, turn)

    def _turn_joint(self, joint: int, turn: np.ndarray) -> None:
        """Turn a joint, and all below it, by rotation vectors (W, 3) in the world."""
        world = quaternion.multiply(quaternion.from_rotation_vector(turn), self.world[:, joint])
        parent = self.skeleton.parents[joint]
        above = self.world[:, parent] if parent >= 0 else quaternion.identity(len(world))
        self.rotations[:, joint] = quaternion.multiply(quaternion.inverse(above), world)
        self._update_pose()

    def reach_goal(self, chain, goal: np.ndarray, share: np.ndarray, turn: np.ndarray | None = None) -> None:
        """Bring the end of a limb to its goal.

        Args:
            chain: joints of the limb.
            goal: (W, 3) m, world.
            share: (W,) of the pin; where it is small the joints blend from their own rotations.
            turn: (W, 4) world rotation of the end joint, if it is given.
        """
        if not np.any(share > 0.0):
            return
        found = solve_two_bone(self.skeleton, self.root, self.rotations, chain, goal, end_rotation=turn,
                               keep_end_rotation=False, soft=_SOFT).rotations
        weight = smoothstep(4.0 * share)
        for joint in list_joint_chain(self.skeleton, chain[0], chain[-1]):
            near = quaternion.match_signs(found[:, joint], self.rotations[:, joint])
            mixed = quaternion.slerp(self.rotations[:, joint], near, weight)
            self.rotations[:, joint] = np.where(weight[:, None] >= 1.0, near, mixed)
        self._update_pose()

    def turn_gaze(self, found: PinTarget, look: np.ndarray, whole: bool) -> None:
        """Turn the head so that it looks at the place, with neck and chest if `whole`."""
        head, neck, chest = self.body.head_or_neck, self.body.neck, self.body.chest
        turn = self._gaze_turn(head, found, look)
        if whole:
            self._turn_joint(chest, _CHEST_SHARE * found.share[:, None] * turn)
            if neck is not None and neck != head:
                self._turn_joint(neck, _NECK_SHARE * found.share[:, None] * turn)
            self._turn_joint(head, found.share[:, None] * (1.0 - _CHEST_SHARE - _NECK_SHARE * (neck != head)) * turn)
        else:
            self._turn_joint(head, smoothstep((found.share - 0.7) / 0.3)[:, None] * turn)

    def _gaze_turn(self, head: int, found: PinTarget, look: np.ndarray) -> np.ndarray:
        """Compute world rotation vectors (W, 3) from where the head looks to the place, within a neck's range."""
        sight = quaternion.rotate(self.world[:, head], np.broadcast_to(look, (len(self.root), 3)))
        away = found.place - self.places[:, head]
        facing = compute_heading_from_positions(self.skeleton, self.places)
        yaw = np.clip(quaternion.wrap_angle(arctan2(away[:, 1], away[:, 0]) - facing), -MAX_YAW, MAX_YAW) + facing
        pitch = np.clip(arctan2(away[:, 2], np.hypot(away[:, 0], away[:, 1])), -MAX_PITCH, MAX_PITCH)
        target = np.column_stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
        return quaternion.to_rotation_vector(quaternion.rotation_between(sight, target))
