"""When a foot, or its heel or its toe, stands on the ground, seen from its joints alone.

A point of the foot (ankle, toe) stands where it is low and slow, both judged by the clip itself. *Low* is near the
lower envelope of the point's own height, because floors drift in real recordings: by centimetres in optical ones (a
tilted volume), by decimetres in inertial suits, which integrate height. *Slow* is near the lower envelope of its own
speed, by a share of how fast it swings around that moment: a planted foot slides 2 cm/s in a good walk, 0.5 m/s in a
suit, and the ankle of a sprinter hardly falls below 1 m/s. Two thresholds each (enter, leave) and shortest durations
keep the labels from flickering.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import grey_opening, maximum_filter1d

from ..base.time_series import run_numbers, runs
from .humanoid import Humanoid, identify, leg_length
from .motion import Motion, forward_kinematics
from .skeleton import Skeleton

_ENVELOPE_SECONDS = 2.0  # longer than a walk's cycle: every foot has stood once within it
_SWING_SECONDS = 1.2
_DIFFERENCE_SECONDS = 1.0 / 60.0  # to either side, over which a foot's speed is measured
_LOW = (0.045, 0.06)  # metres above the envelope: to enter, to leave
_SLOW = (0.15, 0.25)  # metres per second above the envelope: to enter, to leave, where the foot hardly moves
_SLOW_SHARE = (0.04, 0.08)  # of the swing's speed: to enter, to leave
_HELD_UP = 0.10  # metres above the other foot's envelope: this foot does not stand at all
_UPRIGHT = 0.45  # of the leg's length: hips above the foot
_ANKLE = 0.087  # of the leg's length
_SHORTEST = 0.04  # seconds of contact
_SHORTEST_GAP = 0.05  # s; shorter gaps within a stance are closed
_AT_ZERO = (-0.02, 0.065)  # metres: what toe joints may be over a floor at height 0


def floor_height(motion: Motion) -> float:
    """The clip's floor in metres: 2nd percentile of its toes' heights, of the ankles' where it has no toes."""
    body = identify(motion.skeleton)
    positions, _ = forward_kinematics(motion)
    return float(np.percentile(positions[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2], 2))


def sole_height(skeleton: Skeleton) -> float:
    """Metres from the ground up to the foremost joint of a foot that stands flat: 0 where that is a toe, which the
    floor is told by; an ankle's usual height (as `neutral` has it) where there are no toes."""
    body = identify(skeleton)
    return 0.0 if body.left.toe is not None or body.right.toe is not None else _ANKLE * leg_length(skeleton)


def ground_height(motion: Motion) -> float:
    """The height in metres of the ground that the clip's soles stand on."""
    return floor_height(motion) - sole_height(motion.skeleton)


def recorded_floor(motion: Motion) -> tuple[float, float]:
    """The height in metres of the floor of a recording, and how high over it the foremost joint of a flat foot is.

    That floor is at height 0 where the soles are as near to it as soles and toe joints of recordings are (toe joints of
    CMU are 4 to 6 cm over it, of Bandai 4, of the made gait 2); else it is as high as `ground_height`."""
    height = ground_height(motion)
    floor = at_zero(height)
    return floor, floor_height(motion) - floor


def at_zero(height: float) -> float:
    """0 where what is lowest of a body is as high, in metres, as it is over a floor at height 0; else the height."""
    return 0.0 if _AT_ZERO[0] <= height <= _AT_ZERO[1] else height


def detect(motion: Motion) -> np.ndarray:
    """Which foot stands flat on the ground: (T, 2) bool, left and right; any rate from 25 fps up.

    Flat is heel and toe (../shared/metrics.md averages the speed of both): while a foot rolls over one of them moves.
    On recordings without sliding such stances travel a few millimetres."""
    return points(motion).all(axis=2)


def points(motion: Motion) -> np.ndarray:
    """Which point of which foot stands: (T, 2, 2) bool, left and right, heel (ankle joint) and toe.

    Any rate from 25 fps up. A skeleton without toe joints has its ankles in both columns."""
    body = identify(motion.skeleton)
    positions, _ = forward_kinematics(motion)
    leg = leg_length(motion.skeleton)
    kinds = ((body.left.foot, body.right.foot), (body.left.toe_or_foot, body.right.toe_or_foot))
    out = np.stack([_points_down(positions, joints, body, leg, motion.fps) for joints in kinds], axis=2)
    for side in (0, 1):
        for kind in (0, 1):
            steady = ~_without_short(~out[:, side, kind], _SHORTEST_GAP * motion.fps)
            out[:, side, kind] = _without_short(steady, _SHORTEST * motion.fps)
    return out


def _points_down(positions: np.ndarray, joints: tuple[int, int], body: Humanoid, leg: float, fps: float) -> np.ndarray:
    """Contact (T, 2) of the left and right joint of one kind; positions (T, J, 3) metres, leg length in metres."""
    heights = positions[:, joints, 2]
    above = heights - _standing_heights(heights, positions[:, body.hips, 2], leg, fps)
    speed = _horizontal_speed(positions[:, joints, :2], fps)
    window = _window(_SWING_SECONDS, fps)
    swing = maximum_filter1d(speed, window, axis=0, mode="nearest")
    excess = speed - grey_opening(speed, size=(window, 1), mode="nearest")
    enter, leave = (
        (above < low) & (excess < np.maximum(slow, share * swing)) for low, slow, share in zip(_LOW, _SLOW, _SLOW_SHARE)
    )
    return np.stack([_hysteresis(enter[:, side], leave[:, side]) for side in (0, 1)], axis=1)


def _standing_heights(heights: np.ndarray, hips: np.ndarray, leg: float, fps: float) -> np.ndarray:
    """How high each point is when it stands, around each moment: (T, 2) metres; from heights (T, 2) and hips' (T,).

    Upright: the lower envelope, a morphological opening, which follows a drifting floor without lag. Where the hips are
    low (lying, getting up) a resting foot need not stand, so there it is the clip's own standing height."""
    envelope = grey_opening(heights, size=(_window(_ENVELOPE_SECONDS, fps), 1), mode="nearest")
    other = envelope[:, ::-1]
    envelope = np.where(envelope - other > _HELD_UP, other, envelope)
    upright = hips[:, None] - heights > _UPRIGHT * leg
    lowest = [np.percentile(h[u] if u.any() else h, 5) for h, u in zip(heights.T, upright.T)]
    return np.where(upright, envelope, np.minimum(envelope, lowest))


def _window(seconds: float, fps: float) -> int:
    """An odd number of frames."""
    return 2 * round(seconds * fps / 2) + 1


def _horizontal_speed(places: np.ndarray, fps: float) -> np.ndarray:
    """Speed (T, 2) in m/s of points (T, 2, 2), by central differences over a time that hardly depends on the rate."""
    reach = max(1, round(_DIFFERENCE_SECONDS * fps))
    frames = np.arange(len(places))
    after, before = np.minimum(frames + reach, len(places) - 1), np.maximum(frames - reach, 0)
    seconds = np.maximum(after - before, 1) / fps
    return np.linalg.norm(places[after] - places[before], axis=-1) / seconds[:, None]


def _hysteresis(enter: np.ndarray, leave: np.ndarray) -> np.ndarray:
    """Runs of `leave` (T,) that hold at least one frame of `enter` (T,)."""
    labels = run_numbers(leave)
    return leave & np.isin(labels, labels[enter & leave])


def _without_short(flags: np.ndarray, frames: float) -> np.ndarray:
    """`flags` (T,) without runs shorter than `frames`; runs that touch an end of the clip stay, they may go on."""
    out = flags.copy()
    for start, stop in runs(flags):
        if stop - start < frames and start > 0 and stop < len(flags):
            out[start:stop] = False
    return out
