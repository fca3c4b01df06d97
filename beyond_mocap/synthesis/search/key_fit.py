"""How well clips with the requested labels fit a key moment: where, how high and in which direction they strike.

Everything is compared in the frame of travel: x along the player's direction of travel at the key moment, y to the
left. Speed and turning are weighed by the search itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...annotation.ball_contact import build_surfaces
from ...annotation.striking import trace_fastest_surface
from ...base.vectors import arctan2
from ...library.keys import Key
from ...library.library import Library
from ...motion import quaternion
from ...motion.motion import compute_pose, sample_frames
from ...motion.track import SampledTrack
from .request import library_frame

HEIGHT_COST = 0.8  # per metre of height beyond the noise
PLACE_COST = 0.6  # per metre on the ground beyond the noise
ANGLE_COST = 0.2  # per radian between the part's velocity and the leaving ball
_NOISE = 0.15  # m by which a tracked ball may be off without saying anything about the clip
_FARTHEST = 1.0  # m on the ground beyond which the cost does not grow
_FAST_BALL, _FAST_PART = 3.0, 1.5  # m/s from which on the directions of ball and part count
_MOMENT = 1.0 / 60.0  # s before and after a key frame between which velocities are measured
_LEAVING = (0.06, 0.3)  # s after a key moment between which the ball's velocity is measured


@dataclass(frozen=True, eq=False)
class BallMeasurement:
    """What the track says about the ball at a key moment, in the frame of travel; NaN throughout where there is no
    ball.

    Attributes:
        place: (2,) m from the player.
        height: m, NaN where it is not measured.
        exit_velocity: (2,) m/s just after.
    """

    place: np.ndarray
    height: float
    exit_velocity: np.ndarray


@dataclass(frozen=True, eq=False)
class StrikeMeasurements:
    """How the key moments of K clips strike, in the frame of travel; NaN for what touches no ball.

    Attributes:
        place: (K, 2) m of the part's middle from the hips.
        height: (K,) m.
        velocity: (K, 2) m/s.
    """

    place: np.ndarray
    height: np.ndarray
    velocity: np.ndarray


def measure_ball(track: SampledTrack, frame: float, is_height_known: bool) -> BallMeasurement:
    """Measure the ball of a sampled track at a key moment.

    Args:
        track: the sampled track.
        frame: fractional frame.
        is_height_known: whether its height is measured.
    """
    def interpolate_ball(second: float) -> np.ndarray:
        where = np.clip(frame + second * track.fps, 0, len(track.times) - 1)
        return np.array([np.interp(where, np.arange(len(track.times)), column) for column in track.ball.T])

    here = int(np.clip(round(frame), 0, len(track.times) - 1))
    back = -float(track.direction[here])
    ball = interpolate_ball(0.0)
    leaving = (interpolate_ball(_LEAVING[1]) - interpolate_ball(_LEAVING[0]))[:2] / (_LEAVING[1] - _LEAVING[0])
    place = quaternion.rotate_level(ball[None, :2] - track.positions[here], np.array([back]))[0]
    height = float(ball[2]) if is_height_known else np.nan
    return BallMeasurement(place, height, quaternion.rotate_level(leaving[None], np.array([back]))[0])


def measure_strikes(library: Library, keys: Sequence[Key]) -> StrikeMeasurements:
    """Measure how clips' key moments strike; of two parts that may strike, the faster one counts.

    Args:
        library: the clips.
        keys: K key moments.
    """
    roots, poses = zip(*(_fetch_poses_around(library, key) for key in keys))
    places, rotations = compute_pose(library.skeleton, np.concatenate(roots), np.concatenate(poses))
    places, rotations = (values.reshape(len(keys), 3, *values.shape[1:]) for values in (places, rotations))
    frame = np.array([round(library_frame(library, key)) for key in keys])
    back = -_travel_direction(library, np.clip(frame, 0, len(library.frames) - 1))
    rows = [_measure_strike(library, key, p, r, a) for key, p, r, a in zip(keys, places, rotations, back)]
    place, height, velocity = zip(*rows)
    return StrikeMeasurements(np.array(place), np.array(height), np.array(velocity))


def _fetch_poses_around(library: Library, key: Key):
    """Fetch root and pose a moment before, at, and a moment after a key frame."""
    motion = library.clips[key.clip].motion
    own = np.clip(key.frame + np.array([-1.0, 0.0, 1.0]) * _MOMENT * motion.fps, 0, len(motion) - 1)
    return sample_frames(motion, own)


def _travel_direction(library: Library, frame: np.ndarray) -> np.ndarray:
    """Compute the direction of travel (K,) rad in the clips' own world, or the facing where they stand still."""
    velocity = library.frames.velocity[frame]
    aside = arctan2(velocity[:, 1], velocity[:, 0])
    return library.frames.heading[frame] + np.where(np.linalg.norm(velocity, axis=1) > 0.5, aside, 0.0)


def _measure_strike(library: Library, key: Key, places: np.ndarray, rotations: np.ndarray, back: float):
    """Measure place (2,), height and velocity (2,) of the striking part; places (3, J, 3), rotations (3, J, 4)."""
    found = build_surfaces(library.skeleton, key.labels)
    if not found:
        return np.full(2, np.nan), np.nan, np.full(2, np.nan)
    middle = trace_fastest_surface(found, places, rotations)
    level = np.stack([(middle[1] - places[1, 0])[:2], (middle[2] - middle[0])[:2] / (2.0 * _MOMENT)])
    place, velocity = quaternion.rotate_level(level, np.full(2, back))
    return place, float(middle[1, 2]), velocity


def compute_key_misfit(found: StrikeMeasurements, ball: BallMeasurement) -> np.ndarray:
    """Compute the cost (K,) of serving a key moment with that ball by each clip; what is not known costs nothing."""
    apart = np.linalg.norm(found.place - ball.place, axis=1)
    cost = PLACE_COST * np.clip(apart - _NOISE, 0.0, _FARTHEST)
    cost = np.nan_to_num(cost)
    cost += np.nan_to_num(HEIGHT_COST * np.maximum(np.abs(found.height - ball.height) - _NOISE, 0.0))
    turned = arctan2(*found.velocity.T[::-1]) - arctan2(ball.exit_velocity[1], ball.exit_velocity[0])
    turned = np.abs(quaternion.wrap_angle(turned))
    fast = (np.linalg.norm(found.velocity, axis=1) > _FAST_PART) & (np.linalg.norm(ball.exit_velocity) > _FAST_BALL)
    return cost + ANGLE_COST * np.where(fast, turned, 0.0)
