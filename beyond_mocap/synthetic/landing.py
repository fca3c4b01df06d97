"""Synthetic continuation of a recording that ends in flight: free fall, landing, lying still, and getting up.

Goalkeepers' dives are recorded on hard floors and stop before the landing. Held there, or cut to the next clip, the
body hangs in the air. Here it keeps falling: its centre by gravity, its limbs and its spin from their last state toward
the pose of landing. The ground stops the fall and friction the sliding; the body settles, turns to the start of the
nearest way of getting up, and gets up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.easing import quintic_step
from ..base.vectors import cross_product, unit_vectors
from ..motion import quaternion
from ..motion.humanoid import Humanoid, identify_joints
from ..motion.motion import Motion, compute_pose, concatenate_motions, resample, sample_frames
from ..motion.retargeting.neutral import build_neutral_stance
from ..motion.skeleton import Skeleton
from ..motion.spring import Offset
from ..motion.supports import GRAVITY
from .lying import build_lying_pose, compute_lowest_root, raise_arms, smooth_above

FLIGHT_HEIGHT = 0.25
"""Metres between the lowest part of the body and the ground above which a recording's end is a flight."""

LEAST_LEAN = np.radians(25.0)
"""Rad: a trunk that leans less lands on its feet, which is not synthesized here."""

_MEASURE_SECONDS = 0.05  # s over which speeds at the recording's end are measured
_FASTEST_TURN = 6.0  # rad/s; faster rotations at the end are artefacts of filters
_CENTRE_SHARE = 0.25  # of the distance from hips to neck: the body's centre, which falls freely
_LONGEST_FALL = 1.5  # s
_SETTLE_SECONDS, _LYING_SECONDS = 0.4, 0.15  # s from touching the ground to turning, and from there to getting up
_START_SECONDS = 0.4  # s in which getting up reaches its full speed
_FRICTION = 0.13  # seconds in which a sliding body loses two thirds of its speed
_CUSHION = 0.05  # m over which the ground stops the fall
_RATES = (11.0, 11.0, 7.0)  # per second: in the air, landing, turning over and getting up
_GET_UP_RATE = 1.25  # playback rate: players get up faster than performers in a studio
_LEAD_SECONDS = 0.4  # s before the hips rise at which a recording of getting up starts
_RISE = 0.04  # m above their lowest height that the hips rise before getting up begins
# m/s^2 of swapped markers, and s before the end in which they are searched
_SWAP_ACCELERATION, _SWAP_SECONDS = 1500.0, 0.12


@dataclass(frozen=True, eq=False, kw_only=True)
class Landing:
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
    recorded_count: int
    touch_frame: int
    rise_frame: int
    get_up_index: int
    get_up_frames: np.ndarray


def ends_in_flight(motion: Motion) -> bool:
    """Whether the last frame shows a body above the ground (height 0) that will not land on its feet."""
    last = motion.rotations[-1:]
    above = float(motion.root_positions[-1, 2] - compute_lowest_root(motion.skeleton, last)[0])
    if above < FLIGHT_HEIGHT or len(motion) < 3:
        return False
    return bool(np.arccos(np.clip(_find_axes(motion.skeleton, last)[0][0, 2], -1.0, 1.0)) > LEAST_LEAN)


def add_landing(motion: Motion, get_up_motions: Sequence[Motion]) -> Landing:
    """Continue a recording with flight, landing and getting up, by the recording of getting up that needs least rolling
    over.

    Args:
        motion: ends in flight; the ground has height 0.
        get_up_motions: recordings of the same skeleton from lying to standing, one or more, on the same ground.
    Returns:
        The recording with its continuation.
    """
    skeleton, body, fps = motion.skeleton, identify_joints(motion.skeleton), motion.fps
    motion = motion.frames(0, _count_trusted(motion))
    track = _MovingPose(motion)
    landing, lying = _build_lying_poses(motion, get_up_motions)
    fall = np.arange(1, int(_LONGEST_FALL * fps) + 1) / fps
    poses = track.blend_toward(landing, fall, _RATES[0])
    centre = _Fall.from_motion(motion, body)
    height = centre.compute_height(fall) - _find_centre(skeleton, body, poses)[:, 2]
    # the first frame in which the lowest part of the body is below the ground
    is_below = height < compute_lowest_root(skeleton, poses, arms=False)
    touched = int(np.argmax(is_below)) if is_below.any() else len(fall) - 1
    seconds_down = float(fall[touched])
    track = track.pose_after(landing, seconds_down, _RATES[0])
    settle = np.arange(1, int(_SETTLE_SECONDS * fps) + 1) / fps
    down = track.blend_toward(lying, settle, _RATES[1])
    track = track.pose_after(lying, float(settle[-1]), _RATES[1])
    get_up_index, up = _find_nearest(get_up_motions, down[-1], fps)
    wait, frames_shown = int(_LYING_SECONDS * fps), _get_up_timing(len(up), fps)
    get_up = _align_direction(up, down[-1])
    goal = sample_frames(get_up, frames_shown)
    rolling = track.blend_toward(goal[1], np.arange(1, len(frames_shown) + 1) / fps, _RATES[2])
    rotations = np.concatenate([poses[: touched + 1], down, rolling])
    root = _build_root(motion, centre, rotations, flight=touched + 1, settling=len(down), up=get_up,
                       frames_shown=frames_shown)
    rotations = raise_arms(skeleton, root, rotations, fps)
    root[:, 2] += smooth_above(np.maximum(compute_lowest_root(skeleton, rotations) - root[:, 2], 0.0), fps)
    out = Motion(
        skeleton, np.concatenate([motion.root_positions, root]), np.concatenate([motion.rotations, rotations]), fps
    )
    first = len(motion) + touched
    start = first + 1 + len(down) + wait
    get_up_source = get_up_motions[get_up_index]
    begin = _find_start(get_up_source)
    frames = begin + frames_shown[wait:] * (_GET_UP_RATE * get_up_source.fps / fps)
    return Landing(motion=out, recorded_count=len(motion), touch_frame=first, rise_frame=start,
                   get_up_index=get_up_index, get_up_frames=np.clip(frames, 0, len(get_up_source) - 1))


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
    def from_motion(cls, motion: Motion, body: Humanoid) -> "_Fall":
        """Measure it over the last frames; gravity in these frames is taken into account."""
        count = _count_measured(motion)
        last = motion.frames(len(motion) - 1 - count, len(motion))
        middle = last.root_positions + _find_centre(motion.skeleton, body, last.rotations)
        seconds = count / motion.fps
        speed = (middle[-1] - middle[0]) / seconds - [0.0, 0.0, 0.5 * GRAVITY * seconds]
        return cls(middle[-1], speed)

    def compute_height(self, seconds: np.ndarray) -> np.ndarray:
        """Compute the height (T,) m after `seconds` (T,)."""
        return self.place[2] + self.speed[2] * seconds - 0.5 * GRAVITY * seconds**2

    def compute_level(self, seconds: np.ndarray, down: float) -> np.ndarray:
        """Compute the position (T, 2) m on the ground plane: at constant speed until `down` s, then sliding to a stop.
        """
        slid = np.where(seconds > down, _FRICTION * (1.0 - np.exp(-np.maximum(seconds - down, 0.0) / _FRICTION)), 0.0)
        return self.place[:2] + (np.minimum(seconds, down) + slid)[:, None] * self.speed[:2]


class _MovingPose:
    """Local rotations (J, 4) in motion, with their angular velocity (J, 3) rad/s in their own frames and its change.

    `blend_toward` lets their offset from a goal fade.
    """

    def __init__(self, motion: Motion | None = None, pose=None, speed=None, acceleration=None):
        if motion is not None:
            count = _count_measured(motion)
            before, pose = motion.rotations[-1 - count], motion.rotations[-1]
            rotation = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(before), pose))
            speed = rotation * (motion.fps / count)
            fast = np.linalg.norm(speed, axis=-1, keepdims=True)
            speed = speed * np.minimum(1.0, _FASTEST_TURN / np.maximum(fast, 1e-9))
            acceleration = np.zeros_like(speed)
        self.pose, self.speed, self.acceleration = pose, speed, acceleration

    def _find_offset(self, goal: np.ndarray) -> Offset:
        """Compute the offset from a goal (J, 4), as rotation vectors that turn the goal."""
        off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(goal), self.pose))
        return Offset(off, self.speed, self.acceleration)

    def blend_toward(self, goal: np.ndarray, seconds: np.ndarray, rate: float) -> np.ndarray:
        """Compute the local rotations (T, J, 4) after `seconds` (T,); goal: (J, 4), or (T, J, 4) where it moves, from
        rest.
        """
        first = goal if goal.ndim == 2 else goal[0]
        return quaternion.multiply(
            goal, quaternion.from_rotation_vector(self._find_offset(first).evaluate_decay(seconds, rate).place))

    def pose_after(self, goal: np.ndarray, seconds: float, rate: float) -> "_MovingPose":
        """Compute the state after `seconds`."""
        off = self._find_offset(goal).evaluate_decay(np.array([seconds]), rate)
        pose = quaternion.multiply(goal, quaternion.from_rotation_vector(off.place[0]))
        return _MovingPose(None, pose, off.speed[0], off.acceleration[0])


def _get_up_timing(count: int, fps: float) -> np.ndarray:
    """Compute the fractional frames (R,) in which a recording of getting up plays.

    Its first frame stays for a while, then it accelerates to its own speed.
    """
    start = _START_SECONDS * fps
    played = np.arange(int(count + 0.5 * start)) / start
    frames = start * np.where(played < 1.0, played**3 - 0.5 * played**4, played - 0.5)
    return np.concatenate([np.zeros(int(_LYING_SECONDS * fps)), np.minimum(frames, count - 1)])


def _count_trusted(motion: Motion) -> int:
    """Count the frames before a joint jumps within the last tenth of a second, where markers are lost and swapped."""
    count = min(int(_SWAP_SECONDS * motion.fps), len(motion) - 3)
    last = motion.frames(len(motion) - count, len(motion))
    places, _ = compute_pose(motion.skeleton, last.root_positions, last.rotations)
    jumps = np.linalg.norm(np.diff(places, 2, axis=0), axis=2).max(axis=1) * motion.fps**2 > _SWAP_ACCELERATION
    return len(motion) - count + int(np.argmax(jumps)) + 2 if jumps.any() else len(motion)


def _count_measured(motion: Motion) -> int:
    """Count the frames over which the recording's last speeds are measured."""
    return int(np.clip(round(_MEASURE_SECONDS * motion.fps), 1, len(motion) - 1))


def _find_axes(skeleton: Skeleton, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute unit vectors (T, 3) in the world: along the trunk to the neck, to the body's left, and ahead of the
    chest.
    """
    body = identify_joints(skeleton)
    places, _ = compute_pose(skeleton, np.zeros((len(rotations), 3)), rotations)
    top = body.neck_or_chest
    along = unit_vectors(places[:, top] - places[:, body.hips])
    left = places[:, body.left.upper_leg] - places[:, body.right.upper_leg]
    left = unit_vectors(left - np.sum(left * along, axis=1, keepdims=True) * along)
    return along, left, cross_product(left, along)


def _find_centre(skeleton: Skeleton, body: Humanoid, rotations: np.ndarray) -> np.ndarray:
    """Compute the vector (T, 3) m from the root to the body's centre; rotations (T, J, 4) local."""
    places, _ = compute_pose(skeleton, np.zeros((len(rotations), 3)), rotations)
    top = body.neck_or_chest
    return places[:, body.hips] + _CENTRE_SHARE * (places[:, top] - places[:, body.hips])


def _find_direction(skeleton: Skeleton, rotations: np.ndarray) -> float:
    """Compute the direction of the head, rad about the vertical, of a body that lies or nearly does; rotations (J, 4).
    """
    along = _find_axes(skeleton, rotations[None])[0][0]
    return float(np.arctan2(along[1], along[0]))


def _build_lying_poses(motion: Motion, ways_up: Sequence[Motion]) -> tuple[np.ndarray, np.ndarray]:
    """Build local rotations (J, 4) of landing and of lying, on the lower side, the head in its current direction."""
    left = _find_axes(motion.skeleton, motion.rotations[-1:])[1][0]
    neutral = build_neutral_stance(motion.skeleton, concatenate_motions([motion, *ways_up]))  # upright at least there
    poses = []
    for settled in (False, True):
        pose = build_lying_pose(neutral, bool(left[2] < 0.0), settled)
        turn = _find_direction(motion.skeleton, motion.rotations[-1]) - _find_direction(motion.skeleton, pose)
        poses.append(_rotate_body(pose, turn))
    return poses[0], poses[1]


def _rotate_body(rotations: np.ndarray, angle: float) -> np.ndarray:
    """Rotate local rotations (..., J, 4) of the body by `angle` rad about the vertical."""
    out = rotations.copy()
    out[..., 0, :] = quaternion.multiply(quaternion.from_up_angle(np.array(angle)), rotations[..., 0, :])
    return out


def _find_start(get_up: Motion) -> float:
    """Find the frame at which to start a recording of getting up: a little before the hips rise."""
    height = get_up.root_positions[:, 2]
    lying = int(np.argmin(height[: max(len(height) // 2, 1)]))
    rising = lying + int(np.argmax(height[lying:] > height[lying] + _RISE))
    return max(0.0, rising - _LEAD_SECONDS * get_up.fps)


def _find_nearest(get_ups: Sequence[Motion], lying: np.ndarray, fps: float) -> tuple[int, Motion]:
    """Find the recording of getting up that needs least rolling over from lying (J, 4), cut to its start and at `fps`.
    """
    candidates = []
    for number, get_up in enumerate(get_ups):
        cut = get_up.frames(int(round(_find_start(get_up))), len(get_up))
        cut = resample(replace(cut, fps=_GET_UP_RATE * get_up.fps), fps)
        first = _align_direction(cut, lying).rotations[0, 0]
        off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(first), lying[0]))
        candidates.append((float(np.linalg.norm(off)), number, cut))
    _, number, cut = min(candidates, key=lambda row: row[:2])
    return number, cut


def _align_direction(get_up: Motion, lying: np.ndarray) -> Motion:
    """Turn a recording about the vertical so that its head points in the direction of the lying body (J, 4)."""
    angle = _find_direction(get_up.skeleton, lying) - _find_direction(get_up.skeleton, get_up.rotations[0])
    root = quaternion.rotate(quaternion.from_up_angle(np.array(angle)), get_up.root_positions)
    return Motion(get_up.skeleton, root, _rotate_body(get_up.rotations, angle), get_up.fps)


def _build_root(motion: Motion, fall: _Fall, rotations, flight: int, settling: int, up: Motion,
                frames_shown) -> np.ndarray:
    """Compute the root (N, 3) m after the recording.

    Args:
        flight, settling: number of frames of each.
        up: recording of getting up.
        frames_shown: (R,) its fractional frames in the frames that are left.
    """
    skeleton, body, fps = motion.skeleton, identify_joints(motion.skeleton), motion.fps
    seconds = np.arange(1, len(rotations) + 1) / fps
    middle = _find_centre(skeleton, body, rotations)
    root = np.empty((len(rotations), 3))
    root[:, :2] = fall.compute_level(seconds, flight / fps) - middle[:, :2]
    ground = compute_lowest_root(skeleton, rotations, arms=False)
    free = fall.compute_height(np.minimum(seconds, (flight + settling) / fps)) - middle[:, 2]
    root[:, 2] = _blend_to_ground(free, ground, quintic_step(seconds / 0.15))
    start = flight + settling
    goal, pose = sample_frames(up, frames_shown)
    root[start:, :2] = _continue_path(root[start - 3 : start, :2], goal[:, :2], fps)
    times = np.arange(len(frames_shown)) / fps
    clear = np.maximum(goal[:, 2] - compute_lowest_root(skeleton, pose, arms=False), 0.0)
    root[start:, 2] += quintic_step((times - _LYING_SECONDS) / 0.6) * clear
    return root


def _blend_to_ground(free: np.ndarray, ground: np.ndarray, ease: np.ndarray) -> np.ndarray:
    """Blend heights (T,): `free` where it is above `ground`, otherwise `ground`, and never below.

    The change is spread over some centimetres, and eased in (T,) from the recording's end.
    """
    above = free - ground
    return ground + 0.5 * (above + np.hypot(above, 2.0 * _CUSHION * ease))


def _continue_path(before: np.ndarray, path: np.ndarray, fps: float) -> np.ndarray:
    """Continue places (3, 2) m along a path (R, 2); the difference in speed fades."""
    speed = (before[-1] - before[-2]) * fps
    bend = (before[-1] - 2.0 * before[-2] + before[-3]) * fps**2
    fading = Offset(np.zeros(2), speed, bend).evaluate_decay(np.arange(1, len(path) + 1) / fps, _RATES[2]).place
    return before[-1] + path - path[0] + fading
