"""Statistics of short windows of motion, by which classifiers compare takes with recordings (`comparison`).

Nothing that depends on how a motion was measured is part of them. All bodies are on one skeleton at one frame rate.
Positions are seen through a window of 0.2 s, which leaves little of what resampling does to frames. Heights are above
the lowest foot within the window, so that floors do not matter. Contacts are detected on the motion itself. Left and
right have no names, since a take shows clips and their mirrored twins and recordings are not mirrored: of both sides
there is the greater and the lesser value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...base.time_series import time_derivative
from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.contacts import detect_heel_toe_contacts
from ...motion.humanoid import Humanoid, compute_heading_from_positions, identify_joints
from ...motion.motion import Motion, forward_kinematics
from ...motion.skeleton import Skeleton
from ...motion.track import smooth_zero_phase_hann

SECONDS, STEP_SECONDS = 1.0, 0.5  # length of a window, and from one window's start to the next one's
SMOOTHING_SECONDS = 0.2  # at 60 recorded frames a second a frame half-way between two keeps 97 % of 5 Hz
PATH_SECONDS = 0.5  # of the window through which the pelvis travels
_SLOW = 0.3  # m/s below which travel has no direction
_LEAST_SPREAD = 0.01  # m by which limbs move that can be in step with each other

_STATISTICS = {
    "median": lambda values: np.median(values, axis=1),
    "high": lambda values: np.percentile(values, 90, axis=1),
    "low": lambda values: np.percentile(values, 10, axis=1),
    "range": lambda values: np.percentile(values, 95, axis=1) - np.percentile(values, 5, axis=1),
    "share": lambda values: np.mean(values, axis=1),
}


class Signal(NamedTuple):
    """A quantity of every frame.

    Attributes:
        name: for people.
        unit: of its values.
        values: (T,), or (T, 2) for left and right.
        statistics: keys of _STATISTICS that are taken of it.
        is_planned: whether track and plan decide it: where the body goes, faces and looks, not how.
    """

    name: str
    unit: str
    values: np.ndarray
    statistics: tuple[str, ...]
    is_planned: bool = False


class Feature(NamedTuple):
    """One column of `WindowFeatures.values`: its name, unit, and whether track and plan decide it (`Signal`)."""

    name: str
    unit: str
    is_planned: bool


@dataclass(frozen=True, eq=False)
class WindowFeatures:
    """The windows of one motion, W of them.

    Attributes:
        features: F columns.
        values: (W, F).
        speed: (W,) m/s, mean.
        frames: (W, L) frame numbers.
    """

    features: tuple[Feature, ...]
    values: np.ndarray
    speed: np.ndarray
    frames: np.ndarray


def measure_windows(motion: Motion, look: np.ndarray) -> WindowFeatures:
    """Measure all windows of a motion that lie half a window or more from its ends.

    Args:
        motion: T frames on the library's skeleton at its rate.
        look: (3,) unit, direction in which the head looks, in its own frame (`synthesize.estimate_look`).
    """
    fps = motion.fps
    positions, rotations = forward_kinematics(motion)
    sight = quaternion.rotate(rotations[:, identify_joints(motion.skeleton).head_or_neck], look)
    positions = _smooth(positions, fps)
    frames = list_window_frames(len(motion), fps)
    body = identify_joints(motion.skeleton)
    path = smooth_zero_phase_hann(positions[:, body.hips, :2], fps, PATH_SECONDS)
    speed = np.linalg.norm(time_derivative(path, fps), axis=1)
    signals = [*_list_course_signals(motion.skeleton, positions, path, fps),
               *_list_joint_signals(motion.skeleton, positions, fps),
               *_list_posture_signals(motion.skeleton, positions, sight, path, body),
               *_list_foot_signals(motion, positions, body)]
    columns = [column for signal in signals for column in _measure_signal(signal, frames)]
    columns += _list_height_columns(positions, frames, body) + _list_rhythm_columns(motion.skeleton, positions, frames)
    return WindowFeatures(
        features=tuple(feature for feature, _ in columns), speed=speed[frames].mean(axis=1) if len(frames) else
        np.zeros(0), values=np.stack([values for _, values in columns], axis=1), frames=frames,
    )


def list_window_frames(count: int, fps: float) -> np.ndarray:
    """List the frames (W, L) of the windows of a motion of `count` frames; none near its ends, which lack neighbours.
    """
    length, step = round(SECONDS * fps), round(STEP_SECONDS * fps)
    starts = np.arange(length // 2, count - length - length // 2 + 1, step)
    return starts[:, None] + np.arange(length)


def _smooth(values: np.ndarray, fps: float) -> np.ndarray:
    """Smooth positions (T, J, 3) with the window of SMOOTHING_SECONDS."""
    return smooth_zero_phase_hann(values.reshape(len(values), -1), fps, SMOOTHING_SECONDS).reshape(values.shape)


def _measure_signal(signal: Signal, frames: np.ndarray) -> list[tuple[Feature, np.ndarray]]:
    """Measure the statistics (W,) of a signal in every window; of left and right the greater and the lesser one."""
    out = []
    for name in signal.statistics:
        title = f"{signal.name}, {name}"
        if signal.values.ndim == 1:
            found = [(title, _STATISTICS[name](signal.values[frames]))]
        else:
            both = np.stack([_STATISTICS[name](side[frames]) for side in signal.values.T])
            found = _list_both(title, both)
        out += [(Feature(text, signal.unit, signal.is_planned), values) for text, values in found]
    return out


def _list_both(title: str, both: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """List the greater and the lesser (W,) of the values (2, W) of both sides."""
    return [(f"{title} (greater side)", both.max(axis=0)), (f"{title} (lesser side)", both.min(axis=0))]


def _list_course_signals(skeleton: Skeleton, positions: np.ndarray, path: np.ndarray, fps: float) -> list[Signal]:
    """List what the track and the plan of headings decide; path (T, 2) m."""
    velocity = time_derivative(path, fps)
    heading = np.unwrap(compute_heading_from_positions(skeleton, positions))
    speed, travel = np.linalg.norm(velocity, axis=1), arctan2(velocity[:, 1], velocity[:, 0])
    acceleration = np.linalg.norm(time_derivative(velocity, fps), axis=1)
    off = np.where(speed > _SLOW, np.abs(np.degrees(quaternion.wrap_angle(heading - travel))), 0.0)
    return [
        Signal("travel speed", "m/s", speed, ("median", "range"), True),
        Signal("travel acceleration", "m/s^2", acceleration, ("median", "high"), True),
        Signal("heading rate", "deg/s", np.abs(np.degrees(time_derivative(heading, fps))), ("median", "high"), True),
        Signal("facing off travel", "deg", off, ("median", "range"), True),
    ]


def _list_joint_signals(skeleton: Skeleton, positions: np.ndarray, fps: float) -> list[Signal]:
    """List speeds and accelerations of the joints in the frame of the pelvis."""
    local = _compute_local(skeleton, positions)
    velocity = time_derivative(local, fps)
    acceleration = time_derivative(velocity, fps)
    signals = []
    for name, joints in list_named_joints(identify_joints(skeleton)).items():
        for what, unit, values in (("speed", "m/s", velocity), ("acceleration", "m/s^2", acceleration)):
            size = np.linalg.norm(values[:, joints], axis=-1)
            signals.append(Signal(f"{name} {what}", unit, size[:, 0] if len(joints) == 1 else size,
                                  ("median", "high")))
    jerk = np.linalg.norm(time_derivative(acceleration, fps), axis=-1).max(axis=1)
    return [*signals, Signal("largest jerk of a joint", "m/s^3", jerk, ("median", "high"))]


def list_named_joints(body: Humanoid) -> dict[str, list[int]]:
    """List the joints that are compared: name -> one joint, or those of left and right."""
    sides = {"elbow": "lower_arm", "hand": "hand", "knee": "lower_leg", "ankle": "foot", "toe": "toe"}
    both = {name: [getattr(body.left, part), getattr(body.right, part)] for name, part in sides.items()}
    middle = {"neck": [body.neck_or_chest], "head": [body.head]}
    return {name: joints for name, joints in {**both, **middle}.items() if None not in joints}


def _compute_local(skeleton: Skeleton, positions: np.ndarray) -> np.ndarray:
    """Compute positions (T, J, 3) from the pelvis in its own frame: X ahead, Y left.

    The heading would not do, since shoulders that are turned aside turn it, and legs would seem to go sideways.
    """
    body = identify_joints(skeleton)
    across = positions[:, body.left.upper_leg] - positions[:, body.right.upper_leg]
    ahead = arctan2(-across[:, 0], across[:, 1])
    return quaternion.rotate_about_up(positions - positions[:, body.hips, None], -ahead[:, None])


def _list_posture_signals(skeleton: Skeleton, positions: np.ndarray, sight: np.ndarray, path: np.ndarray,
                          body: Humanoid) -> list[Signal]:
    """List how head, trunk, arms and legs are held; sight (T, 3) is the direction of the eyes."""
    local = _compute_local(skeleton, positions)
    outward = np.array([1.0, -1.0])
    trunk = local[:, body.neck_or_chest]
    gaze = arctan2(sight[:, 1], sight[:, 0]) - compute_heading_from_positions(skeleton, positions)
    gaze, down = np.degrees(quaternion.wrap_angle(gaze)), -np.degrees(np.arcsin(np.clip(sight[:, 2], -1.0, 1.0)))
    signals = [
        Signal("trunk lean ahead", "deg", np.degrees(arctan2(trunk[:, 0], trunk[:, 2])), ("median", "range")),
        Signal("trunk lean aside", "deg", np.degrees(arctan2(trunk[:, 1], trunk[:, 2])), ("range",)),
        Signal("pelvis sway", "m", np.linalg.norm(positions[:, body.hips, :2] - path, axis=1), ("high",)),
        Signal("step width", "m", local[:, body.left.foot, 1] - local[:, body.right.foot, 1], ("median", "low")),
        Signal("foot ahead of the pelvis", "m", local[:, [body.left.foot, body.right.foot], 0], ("range",)),
        Signal("knee flexion", "deg", _measure_flexions(local, body, ("upper_leg", "lower_leg", "foot")),
               ("median", "high")),
        Signal("head turned aside", "deg", np.abs(gaze), ("median",), True),
        Signal("turn of the head", "deg", gaze, ("range",)),
        Signal("head down", "deg", down, ("median",), True),
        Signal("nod of the head", "deg", down, ("range",)),
    ]
    if None in (body.left.hand, body.right.hand, body.left.upper_arm, body.right.upper_arm):
        return signals
    hands = local[:, [body.left.hand, body.right.hand]]
    twist = _measure_twist(local, body)
    return [
        *signals,
        Signal("hand height above the pelvis", "m", hands[..., 2], ("median", "range")),
        Signal("hand ahead of the pelvis", "m", hands[..., 0], ("median", "range")),
        Signal("hand beside the pelvis", "m", hands[..., 1] * outward, ("median",)),
        Signal("elbow flexion", "deg", _measure_flexions(local, body, ("upper_arm", "lower_arm", "hand")),
               ("median", "range")),
        Signal("shoulders turned against the hips", "deg", np.abs(twist), ("median",), True),
        Signal("turn of the shoulders against the hips", "deg", twist, ("range",)),
    ]


def _measure_flexions(local: np.ndarray, body: Humanoid, parts: tuple[str, str, str]) -> np.ndarray:
    """Measure the flexion (T, 2) in degrees of the middle joint of a left and a right limb, 0 where it is straight."""
    out = []
    for limb in (body.left, body.right):
        top, middle, end = (local[:, getattr(limb, part)] for part in parts)
        upper, lower = middle - top, end - middle
        length = np.maximum(np.linalg.norm(upper, axis=1) * np.linalg.norm(lower, axis=1), 1e-9)
        out.append(np.degrees(np.arccos(np.clip(np.sum(upper * lower, axis=1) / length, -1.0, 1.0))))
    return np.stack(out, axis=1)


def _measure_twist(local: np.ndarray, body: Humanoid) -> np.ndarray:
    """Measure the turn (T,) in degrees of the line through the shoulders against that through the hips."""
    hips = local[:, body.left.upper_leg] - local[:, body.right.upper_leg]
    shoulders = local[:, body.left.upper_arm] - local[:, body.right.upper_arm]
    angles = (arctan2(line[:, 1], line[:, 0]) for line in (shoulders, hips))
    return np.degrees(quaternion.wrap_angle(next(angles) - next(angles)))


def _list_foot_signals(motion: Motion, positions: np.ndarray, body: Humanoid) -> list[Signal]:
    """List contacts, and how still the stillest point of both feet is."""
    down = detect_heel_toe_contacts(motion).any(axis=2)
    points = [joint for limb in (body.left, body.right) for joint in (limb.foot, limb.toe_or_foot)]
    speed = np.linalg.norm(time_derivative(positions[:, points, :2], motion.fps), axis=-1).min(axis=1)
    steps = np.diff(down.astype(int), axis=0, prepend=down[:1]).clip(0).sum(axis=1) * motion.fps
    return [
        Signal("both feet down", "", down.all(axis=1), ("share",)),
        Signal("no foot down", "", ~down.any(axis=1), ("share",)),
        Signal("foot strikes", "1/s", steps, ("share",)),
        Signal("speed of the stillest point of the feet", "m/s", speed, ("median", "high")),
    ]


def _list_height_columns(positions: np.ndarray, frames: np.ndarray,
                         body: Humanoid) -> list[tuple[Feature, np.ndarray]]:
    """List heights above the lowest foot of each window (W,)."""
    toes = positions[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2][frames]
    ankles = positions[:, [body.left.foot, body.right.foot], 2][frames]
    pelvis = positions[:, body.hips, 2][frames]
    lift, rise = (np.ptp(feet, axis=1).T for feet in (toes, ankles))
    out = [*_list_both("toe lift, highest", lift), *_list_both("ankle lift, highest", rise),
           ("pelvis height above the feet, median", np.median(pelvis, axis=1) - toes.min(axis=(1, 2))),
           ("pelvis height, range", np.ptp(pelvis, axis=1))]
    return [(Feature(name, "m", False), values) for name, values in out]


def _list_rhythm_columns(skeleton: Skeleton, positions: np.ndarray,
                         frames: np.ndarray) -> list[tuple[Feature, np.ndarray]]:
    """List how well arms and legs swing together in each window (W,), as correlations; 0 where they rest."""
    body, local = identify_joints(skeleton), _compute_local(skeleton, positions)
    feet = local[:, [body.left.foot, body.right.foot], 0][frames]
    out = [("left foot against right foot, correlation", _correlate(feet[..., 0], feet[..., 1]))]
    if None not in (body.left.hand, body.right.hand):
        hands = local[:, [body.left.hand, body.right.hand], 0][frames]
        both = np.stack([_correlate(hands[..., side], feet[..., 1 - side]) for side in (0, 1)])
        out += [*_list_both("hand with the other side's foot, correlation", both),
                ("left hand against right hand, correlation", _correlate(hands[..., 0], hands[..., 1]))]
    return [(Feature(name, "", False), values) for name, values in out]


def _correlate(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Correlate two quantities (W, L) m within each window."""
    a, b = (values - values.mean(axis=1, keepdims=True) for values in (a, b))
    size = [np.sqrt(np.mean(values**2, axis=1)) for values in (a, b)]
    moves = (size[0] > _LEAST_SPREAD) & (size[1] > _LEAST_SPREAD)
    return np.where(moves, np.mean(a * b, axis=1) / np.maximum(size[0] * size[1], 1e-9), 0.0)
