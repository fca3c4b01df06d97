"""How well clips with the requested labels fit a key moment: where, how high, in which direction and how hard they
strike.

A ball leaves an instep 1.06 to 1.3 times as fast as the foot (Kellis and Katis 2007, J Sports Sci Med 6, 154-165), so
its speed says how fast the foot was: that of the swing against the player, who carries it along. A swing is played
slower or faster around the touch until it is as fast (`swing_rate`), within limits. Everything is compared in the frame
of travel: x along the player's direction of travel at the key moment (where they face, if they stand), y to the left.
Speed and turning are weighed by the search itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from ...annotation.ball_contact import SENDING, build_surfaces, find_striking_part
from ...annotation.striking import trace_fastest_surface
from ...annotation.vocabulary import SIDES
from ...base.time_series import interpolate_columns
from ...base.vectors import arctan2
from ...library.clip import Clip
from ...library.keys import Key
from ...library.library import Library
from ...motion import quaternion
from ...motion.motion import compute_pose, sample_frames
from ...motion.plant_place import compute_plant_shift, measure_plant_place
from ...motion.skeleton import Skeleton
from ...motion.track import SampledTrack
from ..requested_actions import LEAVING_SECONDS
from .request import library_frame, name_clip_key

HEIGHT_COST = 0.8  # per metre of height beyond the noise
PLACE_COST = 0.6  # per metre on the ground beyond the noise
TURN_COST = 0.1  # per radian that the body has to turn to the ball, and m/s of the player
ANGLE_COST = 0.2  # per radian between the part's velocity and the leaving ball
FAR_ANGLE_COST = 0.6  # per radian beyond what a body turns to it
LOFT_COST = 0.2  # per radian between the elevations of both, beyond the noise
SPEED_COST = 1.2  # per unit of the logarithm of the ball's speed over the part's, outside of the usual range
SPEED_RATIO = (1.06, 1.3)
"""Speed of the leaving ball over that of the foot."""

SWING_RATES = (0.65, 1.4)
"""Limits of the playback rate of a swing at its touch, and of its share of the clip's own rate."""

PLANT_COST = 1.5  # per metre that a kick's plant foot is off its usual place, beyond what its step can go elsewhere
_FREE_PLANT = 0.08  # m
_RATIO_SOUGHT = (1.1, 1.25)  # of speeds: what a swing is played for, within SPEED_RATIO
_SWING_COST = 0.25  # per unit of the logarithm of a swing's own rate

FAST_BALL, FAST_PART = 3.0, 1.5
"""m/s from which on the velocities of ball and part count."""

MAX_TURN_TO_EXIT = np.radians(40.0)
"""Largest turn of a body to the direction in which its ball leaves (`construct.turn_to_ball`)."""

_FULL_TURN_SPEED = 1.5  # m/s up to which a body turns by all of it; the plant foot of a faster one would be dragged

_NOISE = 0.15  # m by which a tracked ball may be off without saying anything about the clip
TURN_REACH = 0.25  # m between part and ball that the ball's noise and the limb make up for
_FARTHEST = 1.0  # m on the ground beyond which the cost does not grow
_LOFT_NOISE = np.radians(15.0)  # a foot that meets the ball below its middle lifts it by more than it rises itself
_MET = 0.4  # m between the middle of a part and a recorded ball that it meets
_STILL_SPEED = 0.5  # m/s up to which a direction of travel is noise: there the body's facing stands for it
_MOMENT = 1.0 / 30.0  # s before and after a key frame between which velocities are measured: frames of most takes


@dataclass(frozen=True, eq=False)
class BallMeasurement:
    """What the track says about the ball at a key moment, in the frame of travel; NaN throughout where there is no
    ball.

    Attributes:
        place: (2,) m from the player.
        height: m, NaN where it is not measured.
        exit_velocity: (3,) m/s just after, upward NaN where heights are not measured.
        speed: m/s of the player.
    """

    place: np.ndarray
    height: float
    exit_velocity: np.ndarray
    speed: float = 0.0


@dataclass(frozen=True, eq=False)
class StrikeMeasurements:
    """How the key moments of K clips strike, in the frame of travel; NaN for what touches no ball.

    Attributes:
        place: (K, 2) m of the part's middle from the hips.
        height: (K,) m.
        velocity: (K, 3) m/s against the player's travel.
        sends: (K,) bool, the labels say that the ball is sent: only its velocity follows the part's.
        plant_off: (K,) m by which the plant foot of a kick is off its usual place, 0 where it is not known.
        rate: (K,) playback rate of the clips, already part of the velocity.
        keeps_rate: (K,) bool, the swing is played no faster or slower than the rest of its clip.
    """

    place: np.ndarray
    height: np.ndarray
    velocity: np.ndarray
    sends: np.ndarray
    plant_off: np.ndarray | float = 0.0
    rate: np.ndarray | float = 1.0
    keeps_rate: np.ndarray | bool = False

    def play(self, choice: np.ndarray, rate: np.ndarray) -> "StrikeMeasurements":
        """Return the same of clips `choice` (P,) played at playback rates (P,)."""
        off, keeps_rate = (np.broadcast_to(values, self.height.shape)[choice]
                           for values in (self.plant_off, self.keeps_rate))
        return StrikeMeasurements(self.place[choice], self.height[choice], rate[:, None] * self.velocity[choice],
                                  self.sends[choice], plant_off=off, rate=rate, keeps_rate=keeps_rate)


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
    is_still = track.heading is not None and track.speed[here] <= _STILL_SPEED
    back = -float(track.heading[here] if is_still else track.direction[here])
    ball = interpolate_ball(0.0)
    first, last = LEAVING_SECONDS
    leaving = (interpolate_ball(last) - interpolate_ball(first)) / (last - first)
    leaving[2] = leaving[2] if is_height_known else np.nan
    place = quaternion.rotate_level(ball[None, :2] - track.positions[here], np.array([back]))[0]
    height = float(ball[2]) if is_height_known else np.nan
    return BallMeasurement(place, height, _rotate_about_up(leaving, back), float(track.speed[here]))


def measure_strikes(library: Library, keys: Sequence[Key]) -> StrikeMeasurements:
    """Measure how clips' key moments strike; of two parts that may strike, the faster one counts.

    Each key moment of a clip is measured once, in whichever library the clip is.

    Args:
        library: the clips.
        keys: K key moments.
    """
    known = [_measured.setdefault(library.clips[key.clip], {}) for key in keys]
    names = [name_clip_key(library, key) for key in keys]
    missing = [number for number, (rows, name) in enumerate(zip(known, names)) if name not in rows]
    if missing:
        for number, row in zip(missing, _measure_rows(library, [keys[number] for number in missing])):
            known[number][names[number]] = row
    columns = zip(*(rows[name] for rows, name in zip(known, names)))
    return StrikeMeasurements(*(np.array(values) for values in columns))


_measured: WeakKeyDictionary[Clip, dict[Key, tuple]] = WeakKeyDictionary()


def _measure_rows(library: Library, keys: Sequence[Key]) -> list[tuple]:
    """Measure place, height, velocity, whether the ball is sent, and the plant foot of each of K key moments."""
    roots, poses = zip(*(_fetch_poses_around(library, key) for key in keys))
    places, rotations = compute_pose(library.skeleton, np.concatenate(roots), np.concatenate(poses))
    places, rotations = (values.reshape(len(keys), 3, *values.shape[1:]) for values in (places, rotations))
    frame = np.array([round(library_frame(library, key)) for key in keys])
    first, count = (values[[key.clip for key in keys]] for values in (library.frames.first, library.frames.count))
    frame = np.clip(frame, first, first + count - 1)  # the next clip's frames are others in another library
    back = -_travel_direction(library, frame)
    rows = [_measure_strike(library, key, p, r, a) for key, p, r, a in zip(keys, places, rotations, back)]
    place, height, velocity, plant_off = (np.array(values) for values in zip(*rows))
    velocity[:, 0] -= np.linalg.norm(library.frames.velocity[frame], axis=1)
    sends = np.array([bool(SENDING & key.labels) for key in keys])
    return list(zip(place, height, velocity, sends, np.where(sends, plant_off, 0.0)))


def _fetch_poses_around(library: Library, key: Key):
    """Fetch root and pose a moment before, at, and a moment after a key frame."""
    motion = library.clips[key.clip].motion
    own = np.clip(key.frame + np.array([-1.0, 0.0, 1.0]) * _MOMENT * motion.fps, 0, len(motion) - 1)
    return sample_frames(motion, own)


def _travel_direction(library: Library, frame: np.ndarray) -> np.ndarray:
    """Compute the direction of travel (K,) rad in the clips' own world, or the facing where they stand still."""
    velocity = library.frames.velocity[frame]
    aside = arctan2(velocity[:, 1], velocity[:, 0])
    return library.frames.heading[frame] + np.where(np.linalg.norm(velocity, axis=1) > _STILL_SPEED, aside, 0.0)


def _measure_strike(library: Library, key: Key, places: np.ndarray, rotations: np.ndarray, back: float):
    """Measure place (2,), height and velocity (3,) of the striking part, and how far off the plant foot is.

    Args:
        places: (3, J, 3) m, world, a moment before, at, and a moment after the strike.
        rotations: (3, J, 4), world.
        back: rad that turn the clip's world into the frame of travel.
    """
    found = build_surfaces(library.skeleton, key.labels)
    if not found:
        return np.full(2, np.nan), np.nan, np.full(3, np.nan), 0.0
    middle = trace_fastest_surface(found, places, rotations)
    contact = _find_recorded_contact(library, key, middle[1])
    place = quaternion.rotate_level((contact - places[1, 0])[None, :2], np.array([back]))[0]
    velocity = _rotate_about_up((middle[2] - middle[0]) / (2.0 * _MOMENT), back)
    return place, float(contact[2]), velocity, _measure_plant_off(library.skeleton, places[1], key.labels)


def _find_recorded_contact(library: Library, key: Key, middle: np.ndarray) -> np.ndarray:
    """Find where (3,) m the ball is met: where the recording has it, else at the part's middle (3,) m."""
    clip = library.clips[key.clip]
    if clip.ball is None:
        return middle
    ball = interpolate_columns(key.frame, np.arange(len(clip.ball)), clip.ball)
    return ball if np.linalg.norm(ball - middle) <= _MET else middle


def _measure_plant_off(skeleton: Skeleton, places: np.ndarray, labels: frozenset[str]) -> float:
    """Measure how far, m, the plant foot is off its usual place, joints at (J, 3) m; 0 without one foot that kicks."""
    sides = [side for side in SIDES if side in labels]
    if len(sides) != 1 or find_striking_part(labels) != "foot":
        return 0.0
    shift = compute_plant_shift(skeleton, measure_plant_place(skeleton, places, sides[0]))
    return float(np.linalg.norm(shift))


def _rotate_about_up(vector: np.ndarray, angle: float) -> np.ndarray:
    """Rotate a vector (3,) about the vertical by an angle, rad."""
    return np.append(quaternion.rotate_level(vector[None, :2], np.array([angle]))[0], vector[2])


def compute_key_misfit(found: StrikeMeasurements, ball: BallMeasurement) -> np.ndarray:
    """Compute the cost (K,) of serving a key moment with that ball by each clip; what is not known costs nothing."""
    apart = np.linalg.norm(found.place - ball.place, axis=1)
    cost = PLACE_COST * np.clip(apart - _NOISE, 0.0, _FARTHEST)
    cost = np.nan_to_num(cost + TURN_COST * ball.speed * _compute_needed_turn(found.place, ball.place))
    cost += PLANT_COST * np.maximum(found.plant_off - _FREE_PLANT, 0.0)
    cost += np.nan_to_num(HEIGHT_COST * np.maximum(np.abs(found.height - ball.height) - _NOISE, 0.0))
    swing = compute_swing_rates(found, ball)
    velocity = swing[:, None] * found.velocity + [ball.speed, 0.0, 0.0]
    exit_misfit = _compute_exit_misfit(velocity, found.sends, ball.exit_velocity, compute_free_turn(ball.speed))
    return cost + _SWING_COST * np.abs(np.log(swing)) + exit_misfit


def compute_swing_rates(found: StrikeMeasurements, ball: BallMeasurement) -> np.ndarray:
    """Compute how much faster (K,) than the rest of their clips swings are played, as fast as their ball needs.

    1 where the ball is not sent, or its speed is not known, or the swing keeps its rate.
    """
    carried, velocity = np.array([ball.speed, 0.0, 0.0]), np.nan_to_num(found.velocity)
    own, leaving = np.linalg.norm(velocity + carried, axis=1), float(np.linalg.norm(np.nan_to_num(ball.exit_velocity)))
    goal = np.clip(own, leaving / _RATIO_SOUGHT[1], leaving / _RATIO_SOUGHT[0])
    # |rate velocity + carried| = goal
    square, along = np.einsum("kd,kd->k", velocity, velocity), velocity @ carried
    root = np.sqrt(np.maximum(along**2 - square * (carried @ carried - goal**2), 0.0))
    limits = (np.maximum(limit, limit / found.rate) if limit < 1.0 else np.minimum(limit, limit / found.rate)
              for limit in SWING_RATES)
    rates = np.clip((root - along) / np.maximum(square, 1e-9), *limits)
    is_retimed = found.sends & ~np.asarray(found.keeps_rate) & (np.sqrt(square) > FAST_PART) & (leaving > FAST_BALL)
    return np.where(is_retimed, rates, 1.0)


def _compute_needed_turn(place: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Compute the turn (K,) rad about the hips that brings parts at (K, 2) m within TURN_REACH of a goal at (2,) m."""
    apart = np.abs(arctan2(place[:, 0] * goal[1] - place[:, 1] * goal[0], place @ goal))
    return np.maximum(apart - compute_free_angle(np.linalg.norm(place, axis=1), np.linalg.norm(goal), TURN_REACH), 0.0)


def compute_free_angle(part, goal, reach: float) -> np.ndarray:
    """Compute the angle, rad, at which a part and its goal, at distances from the hips, are `reach` apart.

    Args:
        part: (...) m.
        goal: (...) m.
        reach: m.
    Returns:
        (...) rad, 0 where they are farther apart at any angle, by the law of cosines.
    """
    return np.arccos(np.clip((part**2 + goal**2 - reach**2) / np.maximum(2.0 * part * goal, 1e-9), 0.0, 1.0))


def compute_free_turn(speed: float) -> float:
    """Compute how far a body at `speed` m/s can turn to the direction in which its ball leaves, rad.

    Its feet move as they did in the clip, so a body that turns against its travel drags the plant foot by as much.
    """
    return float(MAX_TURN_TO_EXIT * min(1.0, _FULL_TURN_SPEED / max(speed, _FULL_TURN_SPEED)))


def _compute_exit_misfit(velocity: np.ndarray, sends: np.ndarray, leaving: np.ndarray,
                         free_turn: float) -> np.ndarray:
    """Compute the cost (K,) of parts with velocities (K, 3) m/s for a ball that leaves with (3,) m/s.

    Nothing where the ball or the part is slow, or the ball is not sent (K,) bool: after a reception it goes where the
    next touch needs it.
    """
    level, speed = np.linalg.norm(velocity[:, :2], axis=1), np.linalg.norm(velocity, axis=1)
    ball_level, ball_speed = np.hypot(leaving[:1], leaving[1:2]), np.linalg.norm(np.nan_to_num(leaving))
    turned = arctan2(velocity[:, 1], velocity[:, 0]) - arctan2(leaving[1], leaving[0])
    turned = np.abs(quaternion.wrap_angle(turned))
    cost = ANGLE_COST * turned + FAR_ANGLE_COST * np.maximum(turned - free_turn, 0.0)
    loft = np.abs(arctan2(velocity[:, 2], level) - arctan2(leaving[2:], ball_level))
    cost += np.nan_to_num(LOFT_COST * np.maximum(loft - _LOFT_NOISE, 0.0))
    least, most = np.log(SPEED_RATIO)
    ratio = np.log(np.maximum(ball_speed, FAST_BALL) / np.maximum(speed, FAST_PART))
    cost += SPEED_COST * (np.maximum(least - ratio, 0.0) + np.maximum(ratio - most, 0.0))
    return np.where(sends & (speed > FAST_PART) & (ball_speed > FAST_BALL), cost, 0.0)
