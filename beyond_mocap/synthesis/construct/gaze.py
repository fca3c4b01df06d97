"""Bodies that watch the ball: the head turns to it first, then the shoulders; hips, legs and feet stay as they are.

People follow a moving thing with eyes, head, shoulders and hips, in this order, each a little after the one before.
Skeletons have no joints for eyes, so the head stops short of the ball by the angle that eyes take. Hips follow by the
planned heading (`synthesis.heading_plan`), with steps. Here head and shoulders turn, by shares of the angle between
hips and ball that are continuous all round the body: ahead they follow the ball, to the side they stay at the limits of
neck and trunk, and for a ball behind they return and change sides without a jump.

The ball is seen late, turns are limited in speed and smoothed over short windows, and attention wanders slowly with the
clock and the player's seed. So a frame depends on a second or two around it and on nothing else.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation import LOCOMOTION_LABELS
from ...base.easing import smoothstep
from ...base.time_series import interpolate_columns
from ...base.vectors import arctan2, measure_lengths, unit_vectors
from ...library.library import Library
from ...motion import quaternion
from ...motion.humanoid import identify_joints
from ...motion.motion import Motion, compute_pose, sample_frames
from ...motion.retargeting.structure import list_ancestors
from ...motion.skeleton import Skeleton
from ...motion.track import smooth_zero_phase_hann
from .pins import estimate_look_axis

HEAD_DELAYS = (0.10, 0.25)
"""s by which heads follow the ball's bearing; each player has their own."""
SHOULDER_DELAY = 0.12
"""s by which shoulders follow later than the head."""

MAX_YAW, MAX_UP, MAX_DOWN = np.radians(70.0), np.radians(50.0), np.radians(55.0)
"""Largest turns of the head, from straight ahead of the shoulders and from level."""
MAX_TWIST = np.radians(38.0)
"""Largest twist of the shoulders against the hips; trunks reach some 45 degrees without effort."""
EYE_ANGLE = np.radians(12.0)
"""By how much the head stops short of the ball: eyes take the rest, and small movements altogether."""
TWIST_FREE_ANGLE = np.radians(8.0)
"""Bearing of the ball up to which shoulders hardly follow."""
TWIST_SHARE = 0.9
"""Share that shoulders take of the bearing beyond it."""
HEAD_SPEED, SHOULDER_SPEED = np.radians(280.0), np.radians(140.0)
"""Largest speeds, rad/s, of head against shoulders and of shoulders against hips."""
HEAD_SECONDS, SHOULDER_SECONDS = 0.4, 0.8
"""s, windows that smooth the turning of head and shoulders."""
NOD_SECONDS = 1.0
"""s, window that removes nods and sway from where a head looks: recorded heads nod by 8 to 10 degrees in a second."""

LEAST_ATTENTION, LEAST_ATTENTION_FAR = 0.45, 0.15
"""Shares of the head's turn at the least attentive moments, for a ball on the pitch around and for one far away."""
NEAR_DISTANCES, FAR_DISTANCES = (4.0, 12.0), (25.0, 60.0)
"""m: a ball closer than the first is always watched, beyond the second attention varies; and where a ball is far."""
SPRINT_SPEEDS, SPRINT_LOSS = (3.5, 6.0), 0.65
"""m/s between which runners turn less and less, and the share that a sprint removes."""
MEMORY_SECONDS = 2.0
"""s after and before its last measurement in which a ball is watched where the track places it."""

NECK_SHARE = 0.35  # share of the head's turn that the neck takes
LOOK_POSES = 200  # poses from which the look axis is estimated
_TRUNK_SECONDS = 0.6  # s, window that removes the sway of steps from the trunk's heading
_FADE_SECONDS = 0.4  # s in which watching begins and ends beside a time without a ball
_ATTENTION_SECONDS = 0.6  # s, window that smooths attention
_WAVE_PERIODS = (5.3, 8.9, 13.7)  # s, periods of the waves of attention: no common multiple within a match
_OVERHEAD = 0.5  # level length of a unit direction below which its side counts less and less
_BEHIND = 0.5  # cosine from straight behind beyond which the body begins to turn back
_NEAR_BALL = 2.0  # m within which a ball turns the shoulders less and less
_look_axes: weakref.WeakKeyDictionary[Library, np.ndarray] = weakref.WeakKeyDictionary()


def watch_ball(
    motion: Motion, ball: np.ndarray, *, look: np.ndarray, speed: np.ndarray, seed: int = 0, start: float = 0.0,
    head_share: np.ndarray | float = 1.0, shoulder_share: np.ndarray | float = 1.0,
) -> Motion:
    """Turn head and shoulders of a motion to the ball; only the joints from the spine up rotate.

    Args:
        motion: T frames.
        ball: (T, 3) m, world, NaN where there is none to watch (`hide_lost_ball`).
        look: (3,) unit, direction in which the head joint looks, in its own frame (`estimate_look`).
        speed: (T,) m/s of the player.
        seed: of the player's habits.
        start: s of the first frame on the clock with which attention wanders.
        head_share: (T,) share of the head's turn that is applied; frames with 0 keep their bits.
        shoulder_share: (T,) the same of the shoulders.
    Returns:
        The motion; the motion itself where no ball is known at all.
    """
    known = np.isfinite(ball).all(axis=1)
    if not known.any():
        return motion
    fps, frames, body = motion.fps, np.arange(len(motion)), identify_joints(motion.skeleton)
    joints, world = compute_pose(motion.skeleton, motion.root_positions, motion.rotations, _list_upper_joints(motion))
    trunk = measure_trunk(motion.skeleton, joints, fps)
    habits, eased = draw_habits(seed), _fade_beside_gaps(known, fps)
    away = interpolate_columns(frames, frames[known], ball[known]) - joints[:, body.head_or_neck]
    sprint = smoothstep(speed, *SPRINT_SPEEDS)
    attention = compute_attention(habits, start + frames / fps, measure_lengths(away[:, :2]), sprint, fps)

    def see(delay: float) -> np.ndarray:
        """The direction (T, 3) m to the ball `delay` s ago, as the body stands now."""
        return quaternion.rotate_about_up(_delay(away, delay, fps), -trunk.heading)

    twist = compute_twist(see(habits.delay + SHOULDER_DELAY), trunk.twist, fps)
    twist = twist * eased * shoulder_share * (1.0 - SPRINT_LOSS * sprint)
    motion, twist = turn_spine(motion, world, np.array([0.0, 0.0, 1.0]), twist)
    if body.neck is None and body.head is None:
        return motion
    above = [joint for joint in (body.neck, body.head_or_neck) if joint is not None]
    above = sorted({*above, *(motion.skeleton.parents[joint] for joint in above)})
    world[:, above] = quaternion.multiply(quaternion.from_up_angle(twist)[:, None], world[:, above])
    yaw, pitch = compute_head_angles(see(habits.delay), trunk.twist + twist, fps)
    sight = quaternion.rotate(world[:, body.head_or_neck], np.broadcast_to(look, away.shape))
    turn = _compute_head_turn(_remove_nods(sight, trunk.heading, fps), trunk.heading + yaw, pitch)
    return _turn_head(motion, world, (eased * head_share * attention)[:, None] * turn)


def _list_upper_joints(motion: Motion) -> set[int]:
    """List what decides how a body looks, thighs and upper arms, head and spine, with all joints above these."""
    body = identify_joints(motion.skeleton)
    ends = [body.head_or_neck, *body.spine]
    ends += [joint for limb in (body.left, body.right) for joint in (limb.upper_leg, limb.upper_arm)]
    return {joint for end in ends if end is not None for joint in list_ancestors(motion.skeleton.parents, end)}


def hide_lost_ball(ball: np.ndarray, is_measured: np.ndarray, fps: float) -> np.ndarray:
    """Hide the ball farther than MEMORY_SECONDS from its next measurement, where its place is a guess.

    Args:
        ball: (T, 3) m, world, NaN where unknown.
        is_measured: (T,) bool.
        fps: frames per second.
    Returns:
        (T, 3) m, NaN where it is hidden.
    """
    lost = _measure_distance(is_measured) > MEMORY_SECONDS * fps
    return np.where(lost[:, None], np.nan, ball)


def estimate_look(library: Library) -> np.ndarray:
    """Estimate the direction (3,) in which heads look, in their own frame, over the library's locomotion; cached."""
    if library not in _look_axes:
        frames = library.frames
        gaits = [i for i, word in enumerate(frames.vocabulary) if word in LOCOMOTION_LABELS]
        going = np.flatnonzero(frames.words[:, gaits].any(axis=1) & (frames.velocity[:, 0] > 0.0))
        some = going[:: max(1, len(going) // LOOK_POSES)] if len(going) else np.arange(min(len(frames), LOOK_POSES))
        pairs = zip(frames.clip[some], frames.source[some])
        poses = [sample_frames(library.clips[clip].motion, np.array([frame]))[1] for clip, frame in pairs]
        _look_axes[library] = estimate_look_axis(library.skeleton, np.concatenate(poses))
    return _look_axes[library]


@dataclass(frozen=True, eq=False)
class Habits:
    """How a player watches.

    Attributes:
        delay: s by which the head follows the ball.
        phases, weights: of the waves of attention, one for each of _WAVE_PERIODS.
    """

    delay: float
    phases: np.ndarray
    weights: np.ndarray


def draw_habits(seed: int) -> Habits:
    """Draw a player's habits from their seed."""
    random = np.random.default_rng([seed, 9])
    delay = random.uniform(*HEAD_DELAYS)
    waves = len(_WAVE_PERIODS)
    return Habits(delay, random.uniform(0.0, 2.0 * np.pi, waves), random.uniform(0.5, 1.0, waves))


def compute_attention(habits: Habits, times: np.ndarray, distance: np.ndarray, sprint: np.ndarray,
                      fps: float) -> np.ndarray:
    """Compute the share of the head's turn that a player gives to the ball.

    It is full for a near ball, wanders in slow waves for others, and is less in a sprint.

    Args:
        habits: the player's.
        times: (T,) s on the clock.
        distance: (T,) m to the ball.
        sprint: (T,) how far the player sprints, 0 to 1.
        fps: frames per second.
    Returns:
        (T,), 0 to 1.
    """
    waves = np.sin(2.0 * np.pi * times[:, None] / np.array(_WAVE_PERIODS) + habits.phases) @ habits.weights
    awake = 0.5 + 0.5 * np.clip(1.6 * waves / habits.weights.sum() + 0.4, -1.0, 1.0)
    least = LEAST_ATTENTION + (LEAST_ATTENTION_FAR - LEAST_ATTENTION) * smoothstep(distance, *FAR_DISTANCES)
    far = smoothstep(distance, *NEAR_DISTANCES)
    share = 1.0 - far * (1.0 - least) * (1.0 - awake)
    share = share * (1.0 - SPRINT_LOSS * far * sprint)
    return np.clip(smooth_zero_phase_hann(share[:, None], fps, _ATTENTION_SECONDS)[:, 0], 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Trunk:
    """How a trunk faces, without the sway of steps.

    Attributes:
        heading: (T,) rad of the hips, world, unwrapped.
        twist: (T,) rad of the shoulders against the hips, to the left.
    """

    heading: np.ndarray
    twist: np.ndarray


def measure_trunk(skeleton: Skeleton, joints: np.ndarray, fps: float) -> Trunk:
    """Measure how the trunk faces, for joint positions (T, J, 3) m, world."""
    body = identify_joints(skeleton)
    hips = _measure_facing(joints, body.left.upper_leg, body.right.upper_leg)
    arms = body.left.upper_arm, body.right.upper_arm
    twist = np.zeros(len(hips)) if None in arms else quaternion.wrap_angle(_measure_facing(joints, *arms) - hips)
    return Trunk(*smooth_zero_phase_hann(np.column_stack([np.unwrap(hips), twist]), fps, _TRUNK_SECONDS).T)


def compute_bearing(seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the side to which a body turns for a direction, and its height; continuous except straight up and down.

    Args:
        seen: (N, 3), x ahead of the body, y to its left.
    Returns:
        (N,) rad to the left: the angle up to 90 degrees, as much up to 120, and less and less to none straight behind;
        and (N,) rad up.
    """
    unit = unit_vectors(seen)
    level = np.hypot(unit[:, 0], unit[:, 1])
    back = np.maximum(-unit[:, 0] - _BEHIND * level, 0.0) / (1.0 - _BEHIND)
    side = arctan2(unit[:, 1], np.maximum(unit[:, 0], back))
    return side * smoothstep(level / _OVERHEAD), arctan2(unit[:, 2], level)


def compute_twist(seen: np.ndarray, own: np.ndarray, fps: float) -> np.ndarray:
    """Compute the twist by which shoulders turn to the ball.

    Args:
        seen: (T, 3) m, direction to the ball, x ahead of the hips, y to their left.
        own: (T,) rad, twist of the shoulders against the hips that the motion has already.
        fps: frames per second.
    Returns:
        (T,) rad to the left.
    """
    side = compute_bearing(seen)[0] * smoothstep(measure_lengths(seen[:, :2]) / _NEAR_BALL)
    wanted = _limit_softly(TWIST_SHARE * np.sign(side) * _leave_rest(np.abs(side), TWIST_FREE_ANGLE), MAX_TWIST)
    wanted = np.clip(wanted, np.minimum(-MAX_TWIST - own, 0.0), np.maximum(MAX_TWIST - own, 0.0))
    return smooth_zero_phase_hann(_limit_speed(wanted, SHOULDER_SPEED / fps)[:, None], fps, SHOULDER_SECONDS)[:, 0]


def compute_head_angles(seen: np.ndarray, shoulders: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute the angles of a head that looks at the ball within the range of its neck.

    Args:
        seen: (T, 3) m, direction to the ball, x ahead of the hips, y to their left.
        shoulders: (T,) rad, twist of the shoulders against the hips.
        fps: frames per second.
    Returns:
        (T,) rad, yaw against the hips (to the left), and (T,) rad, pitch (up).
    """
    side, height = compute_bearing(seen)
    yaw = shoulders + _limit_softly(side - shoulders, MAX_YAW)
    pitch = np.where(height > 0.0, _limit_softly(height, MAX_UP), _limit_softly(height, MAX_DOWN))
    angles = np.column_stack([_limit_speed(angle, HEAD_SPEED / fps) for angle in (yaw, pitch)])
    yaw, pitch = smooth_zero_phase_hann(angles, fps, HEAD_SECONDS).T
    return yaw, pitch


def compute_release(touches: Sequence[tuple[float, float]], count: int, fade: float) -> np.ndarray:
    """Compute the share (count,) that is left beside touches: none within each (first, last) frame, all `fade` frames
    before and after.
    """
    at, away = np.arange(count), np.full(count, np.inf)
    for first, last in touches:
        away = np.minimum(away, np.maximum(np.maximum(first - at, at - last), 0.0))
    return smoothstep(away / fade)


def _measure_facing(joints: np.ndarray, left: int, right: int) -> np.ndarray:
    """Measure the heading (T,) rad across the line between two joints."""
    across = joints[:, left] - joints[:, right]
    return arctan2(-across[:, 0], across[:, 1])


def _leave_rest(angle: np.ndarray, rest: float) -> np.ndarray:
    """Compute what is left of angles (N,) of 0 or more when `rest` is taken off large ones, and all of small ones."""
    return np.sqrt(angle**2 + rest**2) - rest


def _limit_softly(angle: np.ndarray, limit: float) -> np.ndarray:
    """Limit angles (N,) softly to `limit`: up to three quarters of it they do not change."""
    free = 0.75 * limit
    over = np.maximum(np.abs(angle) - free, 0.0)
    return np.sign(angle) * (np.minimum(np.abs(angle), free) + (limit - free) * np.tanh(over / (limit - free)))


def _limit_speed(angle: np.ndarray, most: float) -> np.ndarray:
    """Limit the change of angles (T,) per frame; a fast change is caught up, after that the angles are as they were."""
    out, frame = angle.tolist(), 0
    for start in (np.flatnonzero(np.abs(np.diff(angle)) > most) + 1).tolist():
        if start < frame:
            continue
        frame, now = start, out[start - 1]
        while frame < len(out) and abs(out[frame] - now) > most:
            now = out[frame] = now + most if out[frame] > now else now - most
            frame += 1
    return np.array(out)


def _delay(values: np.ndarray, seconds: float, fps: float) -> np.ndarray:
    """Delay values (T, k) by whole frames; the first one holds before."""
    return values[np.maximum(np.arange(len(values)) - round(seconds * fps), 0)]


def _measure_distance(flags: np.ndarray) -> np.ndarray:
    """Measure the frames (T,) from each frame to the nearest True one, inf where there is none."""
    frames, found = np.arange(len(flags)), np.flatnonzero(flags)
    if not len(found):
        return np.full(len(flags), np.inf)
    after = np.searchsorted(found, frames)
    beside = [np.abs(frames - found[np.clip(after - back, 0, len(found) - 1)]) for back in (0, 1)]
    return np.minimum(*beside).astype(float)


def _fade_beside_gaps(known: np.ndarray, fps: float) -> np.ndarray:
    """Compute the weight (T,) of watching: 1 where a ball is known, fading to 0 beside times without one."""
    return smoothstep(_measure_distance(~known) / (_FADE_SECONDS * fps))


def turn_spine(motion: Motion, world: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> tuple[Motion, np.ndarray]:
    """Turn the spine about an axis, shared by its joints.

    Args:
        motion: T frames.
        world: (T, J, 4) rotations of its joints in the world.
        axis: (3,) or (T, 3) unit, world.
        angle: (T,) rad; frames with 0 keep their bits.
    Returns:
        The motion, and the turn (T,) rad that it takes: 0 without a spine.
    """
    body, parents = identify_joints(motion.skeleton), motion.skeleton.parents
    spine = [joint for joint in body.spine if joint not in (body.neck, body.head)]
    if not spine:
        return motion, np.zeros_like(angle)
    rotations, moved = np.array(motion.rotations), angle != 0.0
    axis = np.broadcast_to(axis, (len(motion), 3))[moved]
    for joint in spine:
        # turns about the axis do not change how it lies in a joint's frame
        local = quaternion.rotate(quaternion.inverse(world[moved, parents[joint]]), axis)
        turn = quaternion.from_axis_angle(local, angle[moved] / len(spine))
        rotations[moved, joint] = quaternion.multiply(turn, rotations[moved, joint])
    return replace(motion, rotations=rotations), angle


def _remove_nods(sight: np.ndarray, heading: np.ndarray, fps: float) -> np.ndarray:
    """Smooth where a head looks, (T, 3) unit, world, seen from the body with its heading (T,) rad.

    A head that looks at a ball still nods and sways with every step: only its slow course is turned to the ball.
    """
    own = smooth_zero_phase_hann(quaternion.rotate_about_up(sight, -heading), fps, NOD_SECONDS)
    return quaternion.rotate_about_up(unit_vectors(own), heading)


def _compute_head_turn(sight: np.ndarray, yaw: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """Compute the turns (T, 3), rotation vectors in the world, from where heads look to a direction, without the part
    that eyes take.

    sight: (T, 3) unit, world; yaw and pitch (T,) rad of the direction, world.
    """
    target = np.column_stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    turn = quaternion.to_rotation_vector(quaternion.rotation_between(sight, target))
    angle = measure_lengths(turn)[..., None]
    return turn * _leave_rest(angle, EYE_ANGLE) / np.maximum(angle, 1e-9)


def _turn_head(motion: Motion, world: np.ndarray, turn: np.ndarray) -> Motion:
    """Turn the head by rotation vectors (T, 3) in the world, of which the neck takes its share; world: (T, J, 4)."""
    body, parents = identify_joints(motion.skeleton), motion.skeleton.parents
    rotations, moved = np.array(motion.rotations), turn.any(axis=1)
    turn, world = turn[moved], world[moved]
    carried = quaternion.identity(len(turn))
    for joint, share in ((body.neck, NECK_SHARE), (body.head_or_neck, 1.0)):
        if joint is None or (share < 1.0 and joint == body.head_or_neck):
            continue
        turned = quaternion.from_rotation_vector(share * turn)
        below = quaternion.inverse(quaternion.multiply(carried, world[:, parents[joint]]))
        local = quaternion.multiply(below, quaternion.multiply(turned, world[:, joint]))
        rotations[moved, joint] = quaternion.match_signs(local, rotations[moved, joint])
        carried = turned
    return replace(motion, rotations=rotations)
