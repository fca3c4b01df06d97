"""When a foot, or its heel or its toe, is in contact with the ground, detected from its joints alone.

A point of the foot (ankle, toe) is in contact where it is low and slow, both judged by the clip itself. *Low* is near
the lower envelope of the point's own height, because floors drift in real recordings: by centimetres in optical ones (a
tilted volume), by decimetres in inertial suits, which integrate height. *Slow* is near the lower envelope of its own
speed, by a share of how fast it swings around that moment: a planted foot slides 2 cm/s in a good walk, 0.5 m/s in a
suit, and the ankle of a sprinter hardly falls below 1 m/s. Two thresholds each (enter, leave) and minimum durations
keep the labels from flickering.
"""

from __future__ import annotations

import numpy as np

from ..base.time_series import find_runs, number_runs
from .humanoid import Humanoid, identify_joints, measure_leg_length
from .motion import Motion, forward_kinematics
from .skeleton import Skeleton

_ENVELOPE_SECONDS = 2.0  # longer than a walk's cycle: every foot touches the ground once within it
_SWING_SECONDS = 1.2
_DIFFERENCE_SECONDS = 1.0 / 60.0  # to either side, over which a foot's speed is measured
_LOW = (0.045, 0.06)  # metres above the envelope: to enter, to leave
_SLOW = (0.15, 0.25)  # metres per second above the envelope: to enter, to leave, where the foot hardly moves
_SLOW_SHARE = (0.04, 0.08)  # of the swing's speed: to enter, to leave
_RAISED = 0.10  # metres above the other foot's envelope: this foot has no contact at all
_UPRIGHT = 0.45  # of the leg's length: hips above the foot
_ANKLE = 0.087  # of the leg's length
_SHORTEST = 0.04  # seconds of contact
_SHORTEST_GAP = 0.05  # seconds; shorter gaps within a stance are closed
_ZERO_FLOOR_RANGE = (-0.02, 0.065)  # metres that toe joints may be over a floor at height 0


def measure_floor_height(motion: Motion, positions: np.ndarray | None = None) -> float:
    """Measure the clip's floor: the 2nd percentile of its toes' heights, of the ankles' where it has no toes.

    Args:
        motion: T frames, world, Z up.
        positions: (T, J, 3) m, its joints, where they are known.
    Returns:
        Height of the lowest foot joint, metres.
    """
    body = identify_joints(motion.skeleton)
    places = forward_kinematics(motion)[0] if positions is None else positions
    return float(np.percentile(places[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2], 2))


def measure_sole_height(skeleton: Skeleton) -> float:
    """Measure the height of a flat foot's foremost joint above the ground.

    Args:
        skeleton: the body.
    Returns:
        Metres: 0 where that joint is a toe, which defines the floor; an ankle's usual height (as `neutral` has it)
        where there are no toes.
    """
    body = identify_joints(skeleton)
    return 0.0 if body.left.toe is not None or body.right.toe is not None else _ANKLE * measure_leg_length(skeleton)


def measure_ground_height(motion: Motion) -> float:
    """Measure the height in metres of the ground under the clip's soles."""
    return measure_floor_height(motion) - measure_sole_height(motion.skeleton)


def estimate_recorded_floor(motion: Motion) -> tuple[float, float]:
    """Estimate the floor of a recording, and how high above it the foremost joint of a flat foot is.

    The floor is at height 0 where the soles are as near to 0 as soles and toe joints of recordings are (toe joints are
    4 to 6 cm above it in CMU, 4 in Bandai, 2 in the synthetic gait); else it is `measure_ground_height`.

    Args:
        motion: T frames, world, Z up.
    Returns:
        Height of the floor, and of the joint above it, metres.
    """
    height = measure_ground_height(motion)
    floor = resolve_floor_height(height)
    return floor, measure_floor_height(motion) - floor


def resolve_floor_height(height: float) -> float:
    """Return 0 if the lowest height of a body is as it is over a floor at height 0, else the height; metres."""
    return 0.0 if _ZERO_FLOOR_RANGE[0] <= height <= _ZERO_FLOOR_RANGE[1] else height


def detect_contacts(motion: Motion) -> np.ndarray:
    """Detect which foot is flat on the ground.

    Flat is heel and toe (docs/reference/report-figures.md averages the speed of both): while a foot rolls, one of them
    moves. On recordings without sliding such stances travel a few millimetres.

    Args:
        motion: T frames, at 25 frames per second or more.
    Returns:
        (T, 2) bool, left and right foot.
    """
    return detect_heel_toe_contacts(motion).all(axis=2)


def detect_heel_toe_contacts(motion: Motion) -> np.ndarray:
    """Detect which point of which foot is on the ground.

    Args:
        motion: T frames, at 25 frames per second or more.
    Returns:
        (T, 2, 2) bool, left and right, heel (ankle joint) and toe. A skeleton without toe joints has its ankles in both
        columns.
    """
    body = identify_joints(motion.skeleton)
    positions, _ = forward_kinematics(motion)
    leg = measure_leg_length(motion.skeleton)
    kinds = ((body.left.foot, body.right.foot), (body.left.toe_or_foot, body.right.toe_or_foot))
    out = np.stack([_detect_joint_contacts(positions, joints, body, leg, motion.fps) for joints in kinds], axis=2)
    for side in (0, 1):
        for kind in (0, 1):
            steady = ~_remove_short_runs(~out[:, side, kind], _SHORTEST_GAP * motion.fps)
            out[:, side, kind] = _remove_short_runs(steady, _SHORTEST * motion.fps)
    return out


def _detect_joint_contacts(positions: np.ndarray, joints: tuple[int, int], body: Humanoid, leg: float,
                           fps: float) -> np.ndarray:
    """Detect the contact (T, 2) of the left and right joint of one kind; positions (T, J, 3) metres, leg length in
    metres.
    """
    from scipy.ndimage import grey_opening, maximum_filter1d

    heights = positions[:, joints, 2]
    above = heights - _estimate_contact_heights(heights, positions[:, body.hips, 2], leg, fps)
    speed = _compute_horizontal_speed(positions[:, joints, :2], fps)
    window = _count_window_frames(_SWING_SECONDS, fps)
    swing = maximum_filter1d(speed, window, axis=0, mode="nearest")
    excess = speed - grey_opening(speed, size=(window, 1), mode="nearest")
    # in contact: low, and slower above the envelope than a fixed speed or a share of the swing, whichever is larger
    enter, leave = (
        (above < low) & (excess < np.maximum(slow, share * swing)) for low, slow, share in zip(_LOW, _SLOW, _SLOW_SHARE)
    )
    return np.stack([_select_by_hysteresis(enter[:, side], leave[:, side]) for side in (0, 1)], axis=1)


def _estimate_contact_heights(heights: np.ndarray, hips: np.ndarray, leg: float, fps: float) -> np.ndarray:
    """Estimate how high each point is when in contact, around each moment: (T, 2) metres; heights (T, 2) and hips'
    (T,).

    Upright: the lower envelope, a morphological opening, which follows a drifting floor without lag. Where the hips are
    low (lying, getting up) a resting foot need not be on its sole, so there the clip's own contact height is the limit.
    """
    from scipy.ndimage import grey_opening

    envelope = grey_opening(heights, size=(_count_window_frames(_ENVELOPE_SECONDS, fps), 1), mode="nearest")
    other = envelope[:, ::-1]
    envelope = np.where(envelope - other > _RAISED, other, envelope)
    upright = hips[:, None] - heights > _UPRIGHT * leg
    lowest = [np.percentile(h[u] if u.any() else h, 5) for h, u in zip(heights.T, upright.T)]
    return np.where(upright, envelope, np.minimum(envelope, lowest))


def _count_window_frames(seconds: float, fps: float) -> int:
    """Return the odd number of frames nearest to a duration."""
    return 2 * round(seconds * fps / 2) + 1


def _compute_horizontal_speed(places: np.ndarray, fps: float) -> np.ndarray:
    """Compute the speed (T, 2) in m/s of points (T, 2, 2), by central differences over a time nearly independent of the
    rate.
    """
    reach = max(1, round(_DIFFERENCE_SECONDS * fps))
    frames = np.arange(len(places))
    after, before = np.minimum(frames + reach, len(places) - 1), np.maximum(frames - reach, 0)
    seconds = np.maximum(after - before, 1) / fps
    return np.linalg.norm(places[after] - places[before], axis=-1) / seconds[:, None]


def _select_by_hysteresis(enter: np.ndarray, leave: np.ndarray) -> np.ndarray:
    """Select the runs of `leave` (T,) that hold at least one frame of `enter` (T,)."""
    labels = number_runs(leave)
    return leave & np.isin(labels, labels[enter & leave])


def _remove_short_runs(flags: np.ndarray, frames: float) -> np.ndarray:
    """Remove runs shorter than `frames` from `flags` (T,); runs that touch an end of the clip stay, they may go on."""
    out = flags.copy()
    for start, stop in find_runs(flags):
        if stop - start < frames and start > 0 and stop < len(flags):
            out[start:stop] = False
    return out
