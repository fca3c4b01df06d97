"""Synthetic continuation of a recording that ends in flight: free fall, landing, lying still, and getting up.

Goalkeepers' dives are recorded on hard floors and stop before the landing. Held there, or cut to the next clip, the
body
hangs in the air. Here it keeps falling: its centre by gravity, its limbs and its spin from their last state toward the
pose of landing. The ground stops the fall and friction the sliding; the body settles, turns to the start of the nearest
way of getting up, and gets up.
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
"""Metres between the lowest part of the body and the ground above which a recording's end is a flight."""

LEANING = np.radians(25.0)
"""Rad: a trunk that leans less lands on its feet, which is not synthesized here."""

_MEASURED = 0.05  # s over which speeds at the recording's end are measured
_FASTEST_TURN = 6.0  # rad/s; faster rotations at the end are artefacts of filters
_MIDDLE = 0.25  # of the distance from hips to neck: the body's centre, which falls freely
_LONGEST_FALL = 1.5  # s
_SETTLING, _LYING_STILL = 0.4, 0.15  # s from touching the ground to turning, and from there to getting up
_STARTING = 0.4  # s in which getting up reaches its full speed
_FRICTION = 0.13  # seconds in which a sliding body loses two thirds of its speed
_CUSHION = 0.05  # m over which the ground stops the fall
_RATES = (11.0, 11.0, 7.0)  # per second: in the air, landing, turning over and getting up
_HASTE = 1.25  # playback rate: players get up faster than performers in a studio
_LEAD = 0.4  # s before the hips rise at which a recording of getting up starts
_RISEN = 0.04  # m above their lowest height that the hips rise before getting up begins
_SWAPPED, _SWAPPED_SECONDS = 1500.0, 0.12  # m/s^2 of swapped markers, and s before the end in which they are searched


@dataclass(frozen=True, eq=False, kw_only=True)
class Landed:
    """A recording with its continuation.

    Attributes:
        motion: the recording, frame by frame as it was, and what follows.
        recorded_count: recorded frames that are kept: all except a few after a jump of markers near the end.
        touch_frame: frame at which the body meets the ground.
        rise_frame: first frame of getting up.
        get_up_index: index of the recording of getting up.
        get_up_frames: (R,) fractional frames of that recording, from `rise_frame` on.
    """

    motion: Motion
    recorded: int
    touched: int
    rising: int
    way: int
    way_frames: np.ndarray


def ends_in_flight(motion: Motion) -> bool:
    """Whether the last frame shows a body above the ground (height 0) that will not land on its feet."""
    last = motion.rotations[-1:]
    above = float(motion.root_positions[-1, 2] - lowest_root(motion.skeleton, last)[0])
    if above < IN_THE_AIR or len(motion) < 3:
        return False
    return bool(np.arccos(np.clip(_axes(motion.skeleton, last)[0][0, 2], -1.0, 1.0)) > LEANING)


def landed(motion: Motion, ways_up: Sequence[Motion]) -> Landed:
    """Continue a recording with flight, landing and getting up, by the recording of getting up that needs least rolling
    over.

    Args:
        motion: ends in flight; the ground has height 0.
        get_up_motions: recordings of the same skeleton from lying to standing, one or more, on the same ground.
    Returns:
        The recording with its continuation.
    """
    skeleton, body, fps = motion.skeleton, identify(motion.skeleton), motion.fps
    motion = motion.frames(0, _trusted(motion))
    track = _Track(motion)
    landing, lying = _lying_poses(motion, ways_up)
    fall = np.arange(1, int(_LONGEST_FALL * fps) + 1) / fps
    poses = track.towards(landing, fall, _RATES[0])
    centre = _Fall.of(motion, body)
    height = centre.height(fall) - _to_middle(skeleton, body, poses)[:, 2]
    # the first frame in which the lowest part of the body is below the ground
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
    """The body's centre at the recording's end.

    Attributes:
        place: (3,) m.
        speed: (3,) m/s.
    """

    place: np.ndarray
    speed: np.ndarray

    @classmethod
    def of(cls, motion: Motion, body: Humanoid) -> "_Fall":
        """Measure it over the last frames; gravity in these frames is taken into account."""
        count = _measured(motion)
        last = motion.frames(len(motion) - 1 - count, len(motion))
        middle = last.root_positions + _to_middle(motion.skeleton, body, last.rotations)
        seconds = count / motion.fps
        speed = (middle[-1] - middle[0]) / seconds - [0.0, 0.0, 0.5 * GRAVITY * seconds]
        return cls(middle[-1], speed)

    def height(self, seconds: np.ndarray) -> np.ndarray:
        """Compute the height (T,) m after `seconds` (T,)."""
        return self.place[2] + self.speed[2] * seconds - 0.5 * GRAVITY * seconds**2

    def level(self, seconds: np.ndarray, down: float) -> np.ndarray:
        """Compute the position (T, 2) m on the ground plane: at constant speed until `down` s, then sliding to a stop.
        """
        slid = np.where(seconds > down, _FRICTION * (1.0 - np.exp(-np.maximum(seconds - down, 0.0) / _FRICTION)), 0.0)
        return self.place[:2] + (np.minimum(seconds, down) + slid)[:, None] * self.speed[:2]


class _Track:
    """Local rotations (J, 4) in motion, with their angular velocity (J, 3) rad/s in their own frames and its change.

    `blend_toward` lets their offset from a goal fade.
    """

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
        """Compute the offset from a goal (J, 4), as rotation vectors that turn the goal."""
        off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(goal), self.pose))
        return Offset(off, self.speed, self.acceleration)

    def towards(self, goal: np.ndarray, seconds: np.ndarray, rate: float) -> np.ndarray:
        """Compute the local rotations (T, J, 4) after `seconds` (T,); goal: (J, 4), or (T, J, 4) where it moves, from
        rest.
        """
        first = goal if goal.ndim == 2 else goal[0]
        return quaternion.multiply(goal, quaternion.from_rotation_vector(self._off(first).faded(seconds, rate).place))

    def at(self, goal: np.ndarray, seconds: float, rate: float) -> "_Track":
        """Compute the state after `seconds`."""
        off = self._off(goal).faded(np.array([seconds]), rate)
        pose = quaternion.multiply(goal, quaternion.from_rotation_vector(off.place[0]))
        return _Track(None, pose, off.speed[0], off.acceleration[0])


def _shown(count: int, fps: float) -> np.ndarray:
    """Compute the fractional frames (R,) in which a recording of getting up plays.

    Its first frame stays for a while, then it accelerates to its own speed.
    """
    start = _STARTING * fps
    played = np.arange(int(count + 0.5 * start)) / start
    frames = start * np.where(played < 1.0, played**3 - 0.5 * played**4, played - 0.5)
    return np.concatenate([np.zeros(int(_LYING_STILL * fps)), np.minimum(frames, count - 1)])


def _trusted(motion: Motion) -> int:
    """Count the frames before a joint jumps within the last tenth of a second, where markers are lost and swapped."""
    count = min(int(_SWAPPED_SECONDS * motion.fps), len(motion) - 3)
    last = motion.frames(len(motion) - count, len(motion))
    places, _ = pose_kinematics(motion.skeleton, last.root_positions, last.rotations)
    jumps = np.linalg.norm(np.diff(places, 2, axis=0), axis=2).max(axis=1) * motion.fps**2 > _SWAPPED
    return len(motion) - count + int(np.argmax(jumps)) + 2 if jumps.any() else len(motion)


def _measured(motion: Motion) -> int:
    """Count the frames over which the recording's last speeds are measured."""
    return int(np.clip(round(_MEASURED * motion.fps), 1, len(motion) - 1))


def _axes(skeleton: Skeleton, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute unit vectors (T, 3) in the world: along the trunk to the neck, to the body's left, and ahead of the
    chest.
    """
    body = identify(skeleton)
    places, _ = pose_kinematics(skeleton, np.zeros((len(rotations), 3)), rotations)
    top = body.neck_or_chest
    along = unit_vectors(places[:, top] - places[:, body.hips])
    left = places[:, body.left.upper_leg] - places[:, body.right.upper_leg]
    left = unit_vectors(left - np.sum(left * along, axis=1, keepdims=True) * along)
    return along, left, cross(left, along)


def _to_middle(skeleton: Skeleton, body: Humanoid, rotations: np.ndarray) -> np.ndarray:
    """Compute the vector (T, 3) m from the root to the body's centre; rotations (T, J, 4) local."""
    places, _ = pose_kinematics(skeleton, np.zeros((len(rotations), 3)), rotations)
    top = body.neck_or_chest
    return places[:, body.hips] + _MIDDLE * (places[:, top] - places[:, body.hips])


def _headed(skeleton: Skeleton, rotations: np.ndarray) -> float:
    """Compute the direction of the head, rad about the vertical, of a body that lies or nearly does; rotations (J, 4).
    """
    along = _axes(skeleton, rotations[None])[0][0]
    return float(np.arctan2(along[1], along[0]))


def _lying_poses(motion: Motion, ways_up: Sequence[Motion]) -> tuple[np.ndarray, np.ndarray]:
    """Build local rotations (J, 4) of landing and of lying, on the lower side, the head in its current direction."""
    left = _axes(motion.skeleton, motion.rotations[-1:])[1][0]
    neutral = neutral_stance(motion.skeleton, concatenate([motion, *ways_up]))  # upright at least there
    poses = []
    for settled in (False, True):
        pose = on_the_side(neutral, bool(left[2] < 0.0), settled)
        turn = _headed(motion.skeleton, motion.rotations[-1]) - _headed(motion.skeleton, pose)
        poses.append(_turned(pose, turn))
    return poses[0], poses[1]


def _turned(rotations: np.ndarray, angle: float) -> np.ndarray:
    """Rotate local rotations (..., J, 4) of the body by `angle` rad about the vertical."""
    out = rotations.copy()
    out[..., 0, :] = quaternion.multiply(quaternion.about_up(np.array(angle)), rotations[..., 0, :])
    return out


def _begin(way: Motion) -> float:
    """Find the frame at which to start a recording of getting up: a little before the hips rise."""
    height = way.root_positions[:, 2]
    lain = int(np.argmin(height[: max(len(height) // 2, 1)]))
    rising = lain + int(np.argmax(height[lain:] > height[lain] + _RISEN))
    return max(0.0, rising - _LEAD * way.fps)


def _nearest_way(ways: Sequence[Motion], lying: np.ndarray, fps: float) -> tuple[int, Motion]:
    """Find the recording of getting up that needs least rolling over from lying (J, 4), cut to its start and at `fps`.
    """
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
    """Turn a recording about the vertical so that its head points in the direction of the lying body (J, 4)."""
    angle = _headed(way.skeleton, lying) - _headed(way.skeleton, way.rotations[0])
    root = quaternion.rotate(quaternion.about_up(np.array(angle)), way.root_positions)
    return Motion(way.skeleton, root, _turned(way.rotations, angle), way.fps)


def _root(motion: Motion, fall: _Fall, rotations, flight: int, settling: int, up: Motion, shown) -> np.ndarray:
    """Compute the root (N, 3) m after the recording.

    Args:
        flight, settling: number of frames of each.
        up: recording of getting up.
        frames_shown: (R,) its fractional frames in the frames that are left.
    """
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
    """Blend heights (T,): `free` where it is above `ground`, otherwise `ground`, and never below.

    The change is spread over some centimetres, and eased in (T,) from the recording's end.
    """
    above = free - ground
    return ground + 0.5 * (above + np.hypot(above, 2.0 * _CUSHION * ease))


def _carried(before: np.ndarray, way: np.ndarray, fps: float) -> np.ndarray:
    """Continue places (3, 2) m along a path (R, 2); the difference in speed fades."""
    speed = (before[-1] - before[-2]) * fps
    bend = (before[-1] - 2.0 * before[-2] + before[-3]) * fps**2
    left = Offset(np.zeros(2), speed, bend).faded(np.arange(1, len(way) + 1) / fps, _RATES[2]).place
    return before[-1] + way - way[0] + left
