"""What follows a recording that ends in flight: free fall, the landing, lying still, and getting up.

Goalkeepers' dives are recorded over floors that nobody likes to land on, and stop before the landing. Held there, or
cut to the next clip, the body hangs in the air. Here it falls on: its middle as a stone does, its limbs and its own
spin from what they were towards the pose it lands in; the ground stops the fall, friction the sliding; it settles,
turns as the nearest way of getting up begins, and gets up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.easing import quintic_step
from ..base.vectors import cross, unit_vectors
from ..motion import quaternion
from ..motion.humanoid import Humanoid, identify
from ..motion.motion import Motion, at_frames, concatenate, pose_kinematics, resample
from ..motion.retargeting.neutral import neutral_stance
from ..motion.skeleton import Skeleton
from ..motion.spring import Offset
from .gait_tables import GRAVITY
from .resting import arms_above_ground, lowest_root, on_the_side, widened

IN_THE_AIR = 0.25
"""Metres between the lowest part of the body and the ground, above which a recording's end is a flight."""

LEANING = np.radians(25.0)
"""A trunk that leans less comes down on its feet, which is not made here."""

_MEASURED = 0.05  # seconds over which speeds at the recording's end are taken
_FASTEST_TURN = 6.0  # radians per second; faster ones are the end of a filter
_MIDDLE = 0.25  # of the way from hips to neck: the body's middle, which falls freely
_LONGEST_FALL = 1.5  # s
_SETTLING, _LYING_STILL = 0.4, 0.15  # seconds from touching the ground to turning, and from there to getting up
_STARTING = 0.4  # seconds in which the way up gathers speed
_FRICTION = 0.13  # seconds in which a sliding body loses two thirds of its speed
_CUSHION = 0.05  # metres over which the ground takes the fall up
_RATES = (11.0, 11.0, 7.0)  # per second: in the air, landing, turning over and getting up
_HASTE = 1.25  # a player gets up faster than who shows it in a studio
_LEAD = 0.4  # seconds before the hips rise at which a way of getting up is begun
_RISEN = 0.04  # m of the hips above where they lay, from which a way up begins
_SWAPPED, _SWAPPED_SECONDS = 1500.0, 0.12  # metres per second squared of a marker taken for another, near the end


@dataclass(frozen=True, eq=False, kw_only=True)
class Landed:
    """motion: the recording, frame by frame as it was, and what follows. recorded, touched, rising: number of recorded
    frames that are kept (all, but for a few behind a jump of its markers just before its end), the frame at which the
    body meets the ground, and the one from which on the way up is played. way: index of the way up, and way_frames
    (R,): its fractional frames from `rising` on."""

    motion: Motion
    recorded: int
    touched: int
    rising: int
    way: int
    way_frames: np.ndarray


def ends_in_flight(motion: Motion) -> bool:
    """Whether the last frame shows a body off the ground (height 0) that will not come down on its feet."""
    last = motion.rotations[-1:]
    above = float(motion.root_positions[-1, 2] - lowest_root(motion.skeleton, last)[0])
    if above < IN_THE_AIR or len(motion) < 3:
        return False
    return bool(np.arccos(np.clip(_axes(motion.skeleton, last)[0][0, 2], -1.0, 1.0)) > LEANING)


def landed(motion: Motion, ways_up: Sequence[Motion]) -> Landed:
    """The recording with flight, landing and getting up behind it, by the way up that needs least turning over.

    motion: ends in flight, the ground at height 0. ways_up: at least one motion of the same skeleton from lying to
    standing, on the same ground."""
    skeleton, body, fps = motion.skeleton, identify(motion.skeleton), motion.fps
    motion = motion.frames(0, _trusted(motion))
    track = _Track(motion)
    landing, lying = _lying_poses(motion, ways_up)
    fall = np.arange(1, int(_LONGEST_FALL * fps) + 1) / fps
    poses = track.towards(landing, fall, _RATES[0])
    centre = _Fall.of(motion, body)
    height = centre.height(fall) - _to_middle(skeleton, body, poses)[:, 2]
    under = height < lowest_root(skeleton, poses, arms=False)
    touched = int(np.argmax(under)) if under.any() else len(fall) - 1
    seconds_down = float(fall[touched])
    track = track.at(landing, seconds_down, _RATES[0])
    settle = np.arange(1, int(_SETTLING * fps) + 1) / fps
    down = track.towards(lying, settle, _RATES[1])
    track = track.at(lying, float(settle[-1]), _RATES[1])
    way, up = _nearest_way(ways_up, down[-1], fps)
    wait, shown = int(_LYING_STILL * fps), _shown(len(up), fps)
    turned = _headed_as(up, down[-1])
    goal = at_frames(turned, shown)
    over = track.towards(goal[1], np.arange(1, len(shown) + 1) / fps, _RATES[2])
    rotations = np.concatenate([poses[: touched + 1], down, over])
    root = _root(motion, centre, rotations, flight=touched + 1, settling=len(down), up=turned, shown=shown)
    rotations = arms_above_ground(skeleton, root, rotations, fps)
    root[:, 2] += widened(np.maximum(lowest_root(skeleton, rotations) - root[:, 2], 0.0), fps)
    out = Motion(
        skeleton, np.concatenate([motion.root_positions, root]), np.concatenate([motion.rotations, rotations]), fps
    )
    first = len(motion) + touched
    start = first + 1 + len(down) + wait
    own = ways_up[way]
    begun = _begin(own)
    frames = begun + shown[wait:] * (_HASTE * own.fps / fps)
    return Landed(motion=out, recorded=len(motion), touched=first, rising=start, way=way,
                  way_frames=np.clip(frames, 0, len(own) - 1))


@dataclass(frozen=True, eq=False)
class _Fall:
    """The body's middle: place (3,) m and speed (3,) m/s at the recording's end."""

    place: np.ndarray
    speed: np.ndarray

    @classmethod
    def of(cls, motion: Motion, body: Humanoid) -> "_Fall":
        """From the last frames; what gravity did meanwhile is reckoned in."""
        count = _measured(motion)
        last = motion.frames(len(motion) - 1 - count, len(motion))
        middle = last.root_positions + _to_middle(motion.skeleton, body, last.rotations)
        seconds = count / motion.fps
        speed = (middle[-1] - middle[0]) / seconds - [0.0, 0.0, 0.5 * GRAVITY * seconds]
        return cls(middle[-1], speed)

    def height(self, seconds: np.ndarray) -> np.ndarray:
        """(T,) m."""
        return self.place[2] + self.speed[2] * seconds - 0.5 * GRAVITY * seconds**2

    def level(self, seconds: np.ndarray, down: float) -> np.ndarray:
        """(T, 2) m: at its speed until it is down, then sliding to rest."""
        slid = np.where(seconds > down, _FRICTION * (1.0 - np.exp(-np.maximum(seconds - down, 0.0) / _FRICTION)), 0.0)
        return self.place[:2] + (np.minimum(seconds, down) + slid)[:, None] * self.speed[:2]


class _Track:
    """Local rotations (J, 4) in motion: where they are, how fast they turn (J, 3) rad/s in their own frames, and how
    that changes; `towards` lets what they are off a goal fade."""

    def __init__(self, motion: Motion | None = None, pose=None, speed=None, acceleration=None):
        if motion is not None:
            count = _measured(motion)
            before, pose = motion.rotations[-1 - count], motion.rotations[-1]
            turned = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(before), pose))
            speed = turned * (motion.fps / count)
            fast = np.linalg.norm(speed, axis=-1, keepdims=True)
            speed = speed * np.minimum(1.0, _FASTEST_TURN / np.maximum(fast, 1e-9))
            acceleration = np.zeros_like(speed)
        self.pose, self.speed, self.acceleration = pose, speed, acceleration

    def _off(self, goal: np.ndarray) -> Offset:
        """What they are off a goal (J, 4), as rotation vectors that turn the goal."""
        off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(goal), self.pose))
        return Offset(off, self.speed, self.acceleration)

    def towards(self, goal: np.ndarray, seconds: np.ndarray, rate: float) -> np.ndarray:
        """Local rotations (T, J, 4) after `seconds` (T,); goal: (J, 4), or (T, J, 4) where it moves, from rest."""
        first = goal if goal.ndim == 2 else goal[0]
        return quaternion.multiply(goal, quaternion.from_rotation_vector(self._off(first).faded(seconds, rate).place))

    def at(self, goal: np.ndarray, seconds: float, rate: float) -> "_Track":
        """Where they are after `seconds`."""
        off = self._off(goal).faded(np.array([seconds]), rate)
        pose = quaternion.multiply(goal, quaternion.from_rotation_vector(off.place[0]))
        return _Track(None, pose, off.speed[0], off.acceleration[0])


def _shown(count: int, fps: float) -> np.ndarray:
    """Fractional frames (R,) of a way up of `count` frames as it is shown: its first for a while, then faster and
    faster until it plays as it is."""
    start = _STARTING * fps
    played = np.arange(int(count + 0.5 * start)) / start
    frames = start * np.where(played < 1.0, played**3 - 0.5 * played**4, played - 0.5)
    return np.concatenate([np.zeros(int(_LYING_STILL * fps)), np.minimum(frames, count - 1)])


def _trusted(motion: Motion) -> int:
    """Number of frames before a joint jumps within the last tenth of a second, where markers are lost and swapped."""
    count = min(int(_SWAPPED_SECONDS * motion.fps), len(motion) - 3)
    last = motion.frames(len(motion) - count, len(motion))
    places, _ = pose_kinematics(motion.skeleton, last.root_positions, last.rotations)
    jumps = np.linalg.norm(np.diff(places, 2, axis=0), axis=2).max(axis=1) * motion.fps**2 > _SWAPPED
    return len(motion) - count + int(np.argmax(jumps)) + 2 if jumps.any() else len(motion)


def _measured(motion: Motion) -> int:
    """Frames over which the recording's last speeds are taken."""
    return int(np.clip(round(_MEASURED * motion.fps), 1, len(motion) - 1))


def _axes(skeleton: Skeleton, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors (T, 3) in the world: along the trunk to the neck, to the body's left, and ahead of the chest."""
    body = identify(skeleton)
    places, _ = pose_kinematics(skeleton, np.zeros((len(rotations), 3)), rotations)
    top = body.neck_or_chest
    along = unit_vectors(places[:, top] - places[:, body.hips])
    left = places[:, body.left.upper_leg] - places[:, body.right.upper_leg]
    left = unit_vectors(left - np.sum(left * along, axis=1, keepdims=True) * along)
    return along, left, cross(left, along)


def _to_middle(skeleton: Skeleton, body: Humanoid, rotations: np.ndarray) -> np.ndarray:
    """(T, 3) m from the root to the body's middle; rotations (T, J, 4) local."""
    places, _ = pose_kinematics(skeleton, np.zeros((len(rotations), 3)), rotations)
    top = body.neck_or_chest
    return places[:, body.hips] + _MIDDLE * (places[:, top] - places[:, body.hips])


def _headed(skeleton: Skeleton, rotations: np.ndarray) -> float:
    """Radians about the vertical of where the head points, of a body that lies or nearly does; rotations (J, 4)."""
    along = _axes(skeleton, rotations[None])[0][0]
    return float(np.arctan2(along[1], along[0]))


def _lying_poses(motion: Motion, ways_up: Sequence[Motion]) -> tuple[np.ndarray, np.ndarray]:
    """Local rotations (J, 4) of landing and of lying, on the side that is lower, the head where it points."""
    left = _axes(motion.skeleton, motion.rotations[-1:])[1][0]
    neutral = neutral_stance(motion.skeleton, concatenate([motion, *ways_up]))  # upright at least in the ways up
    poses = []
    for settled in (False, True):
        pose = on_the_side(neutral, bool(left[2] < 0.0), settled)
        turn = _headed(motion.skeleton, motion.rotations[-1]) - _headed(motion.skeleton, pose)
        poses.append(_turned(pose, turn))
    return poses[0], poses[1]


def _turned(rotations: np.ndarray, angle: float) -> np.ndarray:
    """Local rotations (..., J, 4) of the body turned by `angle` radians about the vertical."""
    out = rotations.copy()
    out[..., 0, :] = quaternion.multiply(quaternion.about_up(np.array(angle)), rotations[..., 0, :])
    return out


def _begin(way: Motion) -> float:
    """The frame from which a way up is worth playing: a little before the hips rise from where they lie."""
    height = way.root_positions[:, 2]
    lain = int(np.argmin(height[: max(len(height) // 2, 1)]))
    rising = lain + int(np.argmax(height[lain:] > height[lain] + _RISEN))
    return max(0.0, rising - _LEAD * way.fps)


def _nearest_way(ways: Sequence[Motion], lying: np.ndarray, fps: float) -> tuple[int, Motion]:
    """Which way up needs least turning over from lying (J, 4), and its motion at `fps` from where it is worth
    playing."""
    found = []
    for number, way in enumerate(ways):
        cut = way.frames(int(round(_begin(way))), len(way))
        cut = resample(replace(cut, fps=_HASTE * way.fps), fps)
        first = _headed_as(cut, lying).rotations[0, 0]
        off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(first), lying[0]))
        found.append((float(np.linalg.norm(off)), number, cut))
    _, number, cut = min(found, key=lambda row: row[:2])
    return number, cut


def _headed_as(way: Motion, lying: np.ndarray) -> Motion:
    """The way up turned about the vertical so that its head points where that of the lying body (J, 4) does."""
    angle = _headed(way.skeleton, lying) - _headed(way.skeleton, way.rotations[0])
    root = quaternion.rotate(quaternion.about_up(np.array(angle)), way.root_positions)
    return Motion(way.skeleton, root, _turned(way.rotations, angle), way.fps)


def _root(motion: Motion, fall: _Fall, rotations, flight: int, settling: int, up: Motion, shown) -> np.ndarray:
    """Root (N, 3) m behind the recording. flight, settling: frames of each; up: the way up, and the fractional frame of
    it shown (R,) in what is left."""
    skeleton, body, fps = motion.skeleton, identify(motion.skeleton), motion.fps
    seconds = np.arange(1, len(rotations) + 1) / fps
    middle = _to_middle(skeleton, body, rotations)
    root = np.empty((len(rotations), 3))
    root[:, :2] = fall.level(seconds, flight / fps) - middle[:, :2]
    ground = lowest_root(skeleton, rotations, arms=False)
    free = fall.height(np.minimum(seconds, (flight + settling) / fps)) - middle[:, 2]
    root[:, 2] = _cushioned(free, ground, quintic_step(seconds / 0.15))
    start = flight + settling
    goal, pose = at_frames(up, shown)
    root[start:, :2] = _carried(root[start - 3 : start, :2], goal[:, :2], fps)
    way = np.arange(len(shown)) / fps
    clear = np.maximum(goal[:, 2] - lowest_root(skeleton, pose, arms=False), 0.0)
    root[start:, 2] += quintic_step((way - _LYING_STILL) / 0.6) * clear
    return root


def _cushioned(free: np.ndarray, ground: np.ndarray, ease: np.ndarray) -> np.ndarray:
    """Heights (T,) that follow `free` above and `ground` below, and never go below the ground; the change is spread
    over some centimetres, eased in (T,) from the recording's end."""
    above = free - ground
    return ground + 0.5 * (above + np.hypot(above, 2.0 * _CUSHION * ease))


def _carried(before: np.ndarray, way: np.ndarray, fps: float) -> np.ndarray:
    """Places (R, 2) m that go on from the last of `before` (3, 2) as the way (R, 2) goes, its speed fading in."""
    speed = (before[-1] - before[-2]) * fps
    bend = (before[-1] - 2.0 * before[-2] + before[-3]) * fps**2
    left = Offset(np.zeros(2), speed, bend).faded(np.arange(1, len(way) + 1) / fps, _RATES[2]).place
    return before[-1] + way - way[0] + left
