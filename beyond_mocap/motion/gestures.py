"""Made soccer moves beside the gait: kicks, a trap, a dribble, a header, a throw-in, getting up, a celebration.

Each is the gait's own posture with key poses laid over it, given as tables of angles over seconds from the key moment (the
touch of the ball). Instants, foot speeds and ranges of the instep kick follow Nunome, Asai, Ikegami and Sakurai 2002 (Med Sci
Sports Exerc 34) and Lees, Asai, Andersen, Nunome and Sterzing 2010 (J Sports Sci 28): backswing to 100 degrees of knee flexion,
impact with the knee near 45 and opening, support foot down a fifth of a second before, the opposite arm flung out and across.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from . import gait_tables as tables
from . import quaternion
from .adult import adult_skeleton
from .footsteps import Footsteps, lift_off_ground
from .gait import Course, GaitStyle, footsteps, plan, posture_over, with_feet
from .gait_tables import smooth_step
from .motion import Motion
from .neutral import Neutral, neutral_stance
from .posture import Posture, to_motion
from .skeleton import Skeleton

LEFT, RIGHT = 0, 1


@dataclass(frozen=True, eq=False)
class Gesture:
    """A made move. motion; key: seconds of the key moment (None for continuous moves); start, end: seconds of the move."""

    motion: Motion
    key: float | None
    start: float
    end: float


@dataclass(frozen=True)
class Strike:
    """How the right foot meets the ball and what the body does meanwhile; seconds from the touch, metres, degrees.

    foot: rows (time, ahead of the hips, left of them, ankle height, pitch, yaw, roll); an adult's metres. pelvis, spine: rows
    (time, list, tilt, turn). left_arm, right_arm: rows (time, flexion, abduction, inward, elbow). speeds: rows (time, m/s).
    pace: factor on the cadence around the touch. at: share of the right foot's swing at which it touches. sink: rows
    (time, metres the hips are lowered). head: nod in degrees.
    """

    foot: tuple
    pelvis: tuple
    spine: tuple
    left_arm: tuple
    right_arm: tuple
    speeds: tuple
    pace: float
    at: float
    sink: tuple
    head: float = 14.0


_KICK_SPEEDS = ((-2.6, 2.4), (-1.4, 2.9), (-0.6, 2.8), (0.0, 1.9), (0.45, 1.3), (1.0, 1.6), (2.2, 2.3))
STRIKES = {
    "kick low inside": Strike(
        foot=(
            (-0.15, -0.42, -0.14, 0.34, 45, -35, 0),
            (0.0, 0.30, -0.11, 0.105, 2, -68, -6),
            (0.09, 0.58, -0.08, 0.22, -4, -62, -8),
            (0.20, 0.60, -0.09, 0.32, 0, -40, -4),
        ),
        pelvis=((-0.15, 4, 4, -20), (0.0, 5, -2, 6), (0.18, 3, -4, 16)),
        spine=((-0.15, -10, 8, 24), (0.0, -9, 10, -4), (0.18, -4, 12, -16)),
        left_arm=((-0.15, -12, 48, 10, 30), (0.0, 22, 42, 20, 38), (0.2, 36, 24, 30, 48)),
        right_arm=((-0.15, 26, 22, 25, 42), (0.0, -16, 32, 15, 34), (0.2, -28, 30, 10, 30)),
        speeds=_KICK_SPEEDS,
        pace=0.86,
        at=0.46,
        sink=((-0.1, 0.01), (0.0, 0.015), (0.2, 0.005)),
    ),
    "kick low top": Strike(
        foot=(
            (-0.14, -0.52, -0.16, 0.50, 88, -8, 0),
            (0.0, 0.24, -0.09, 0.175, 36, -10, 6),
            (0.07, 0.66, 0.02, 0.42, 18, 2, 4),
            (0.17, 0.70, 0.10, 0.72, -10, 10, 0),
            (0.30, 0.56, 0.06, 0.48, -2, 6, 0),
        ),
        pelvis=((-0.14, 4, 6, -32), (0.0, 8, -6, 2), (0.17, 4, -12, 26)),
        spine=((-0.14, -14, 2, 42), (0.0, -16, 10, 2), (0.17, -8, 26, -30)),
        left_arm=((-0.16, -30, 78, 0, 18), (0.0, 24, 62, 15, 30), (0.18, 58, 26, 40, 42)),
        right_arm=((-0.16, 34, 24, 25, 48), (0.0, -26, 36, 10, 34), (0.18, -48, 36, 0, 22)),
        speeds=_KICK_SPEEDS,
        pace=0.80,
        at=0.42,
        sink=((-0.1, 0.015), (0.0, 0.02), (0.2, 0.0)),
    ),
    "receive foot low inside": Strike(
        foot=(
            (-0.16, 0.26, -0.14, 0.16, 0, -48, 0),
            (0.0, 0.34, -0.14, 0.15, -4, -70, -6),
            (0.16, 0.10, -0.15, 0.13, 2, -66, -4),
            (0.26, 0.10, -0.13, 0.11, 2, -45, 0),
        ),
        pelvis=((-0.16, 4, 2, -4), (0.0, 5, 0, 2), (0.16, 4, 2, -10)),
        spine=((-0.16, -6, 9, 4), (0.0, -7, 12, -2), (0.16, -5, 14, 6)),
        left_arm=((-0.16, 12, 40, 15, 42), (0.0, 16, 46, 15, 40), (0.2, 12, 40, 15, 45)),
        right_arm=((-0.16, 4, 36, 15, 42), (0.0, -6, 42, 15, 40), (0.2, 6, 36, 15, 42)),
        speeds=((-2.4, 2.4), (-1.2, 2.2), (-0.4, 1.2), (0.0, 0.8), (0.4, 0.9), (1.0, 1.9), (2.2, 2.6)),
        pace=0.72,
        at=0.5,
        sink=((-0.1, 0.04), (0.0, 0.05), (0.25, 0.04)),
        head=24.0,
    ),
}


def strike(kind: str, skeleton: Skeleton | None = None, fps: float = 60.0, speed: float = 1.0, seed: int = 0) -> Gesture:
    """The right foot meets the ball after an approach and runs on: `kind` is one of STRIKES; facing and travelling +X.

    speed: factor on the approach's speed. At the key moment the ball is at the foot, see `foot` of the Strike.
    """
    recipe = STRIKES[kind]
    neutral = neutral_stance(skeleton or adult_skeleton())
    key = -recipe.speeds[0][0]
    end = key + recipe.speeds[-1][0]
    times = np.arange(int(round(end * fps)) + 1) / fps
    speeds = speed * _keyed(recipe.speeds, times - key)[:, 0]
    style = GaitStyle(head=np.radians(recipe.head))
    course = plan(speeds, None, fps, neutral, style=style, seed=seed)
    course = _in_step(course, key, recipe)
    steps = tuple(footsteps(course, neutral, style, side) for side in (LEFT, RIGHT))
    posture = posture_over(course, steps, neutral, style, seed)
    posture = _laid_over(posture, course, steps, key, recipe, neutral)
    begin, land = _swing_around(steps[RIGHT], key)
    return Gesture(to_motion(posture.frames(course.asked), neutral), key, begin - 0.15, land + 0.1)


def _in_step(course: Course, key: float, recipe: Strike) -> Course:
    """The course with a cadence that dips around the touch, and a phase at which the right foot is in its swing there."""
    rate = np.gradient(course.phase, course.times)
    dip = 1.0 - (1.0 - recipe.pace) * np.exp(-(((course.times - key - 0.1) / 0.33) ** 2))
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rate * dip)[1:] + 0.5 * (rate * dip)[:-1])])
    phase = phase * (course.times[1] - course.times[0])
    duty = float(tables.at_speed("duty", np.interp(key - 0.2, course.times, course.gear)))
    wanted = 0.5 + duty + recipe.at * (1.0 - duty)
    return replace(course, phase=phase + wanted - np.interp(key, course.times, phase))


def _swing_around(steps: Footsteps, moment: float) -> tuple[float, float]:
    """Seconds at which the swing around `moment` begins and ends."""
    which = int(steps.current(np.array([moment]))[0])
    return float(steps.off[which]), float(steps.on[which + 1])


def _laid_over(posture: Posture, course: Course, steps, key: float, recipe: Strike, neutral: Neutral) -> Posture:
    scale = neutral.leg / tables.LEG
    times = course.times - key
    hips = posture.hips.copy()
    ease = _envelope(times, -0.42, -0.16, 0.26, 0.65)
    hips[:, 2] -= scale * ease * _keyed(recipe.sink, times)[:, 0]
    posture = with_feet(posture.changed(hips=hips), course.times, steps, neutral)
    pelvis = _mixed(posture.pelvis, np.radians(_keyed(recipe.pelvis, times)), ease)
    spine = _mixed(posture.spine, np.radians(_keyed(recipe.spine, times)), ease)
    head = posture.head - (pelvis + spine - posture.pelvis - posture.spine) * np.array([0.8, 0.6, 0.95])
    arms = posture.arms.copy()
    for side, rows in ((LEFT, recipe.left_arm), (RIGHT, recipe.right_arm)):
        arms[:, side, :4] = _mixed(arms[:, side, :4], np.radians(_keyed(rows, times)), ease)
    posture = posture.changed(pelvis=pelvis, spine=spine, head=head, arms=arms)
    return _kicking_foot(posture, course, _swing_around(steps[RIGHT], key), key, recipe.foot, neutral)


def _kicking_foot(posture: Posture, course: Course, swing: tuple[float, float], key: float, rows, neutral: Neutral) -> Posture:
    """The right foot's swing between `swing` seconds led through the rows of a Strike; its ends stay as they were."""
    scale = neutral.leg / tables.LEG
    inside = (course.times > swing[0]) & (course.times < swing[1])
    edges = np.flatnonzero(inside)[[0, -1]] + [-1, 1]
    ground = posture.hips * [1.0, 1.0, 0.0]
    into = quaternion.about_up(-posture.heading)
    frame = np.concatenate([quaternion.rotate(into, posture.ankles[:, RIGHT] - ground), posture.feet[:, RIGHT]], axis=1)
    frame[:, 5] -= posture.heading
    rows = np.array([r for r in rows if swing[0] + 0.04 < key + r[0] < swing[1] - 0.04], dtype=float)
    values = np.column_stack([rows[:, 1:4] * scale, np.radians(rows[:, [6, 4, 5]])])
    at = np.concatenate([course.times[edges[:1]], key + rows[:, 0], course.times[edges[1:]]])
    speeds = np.gradient(frame, course.times, axis=0)[edges + [-1, 1]]
    through = np.concatenate([frame[edges[:1]], values, frame[edges[1:]]])
    path = CubicSpline(at, through, axis=0, bc_type=((1, speeds[0]), (1, speeds[1])))(course.times[inside])
    ankles, feet = posture.ankles.copy(), posture.feet.copy()
    back = quaternion.about_up(posture.heading[inside])
    ankles[inside, RIGHT] = ground[inside] + quaternion.rotate(back, path[:, :3])
    edge = np.sin(np.pi * (course.times[inside] - swing[0]) / (swing[1] - swing[0]))
    ankles[inside, RIGHT, 2] += lift_off_ground(ankles[inside, RIGHT, 2], path[:, 4], neutral) * np.sqrt(np.maximum(edge, 0.0))
    feet[inside, RIGHT] = path[:, 3:] + np.stack([0 * path[:, 0], 0 * path[:, 0], posture.heading[inside]], axis=-1)
    return posture.changed(ankles=ankles, feet=feet)


def dribble(speed: float, duration: float, skeleton: Skeleton | None = None, fps: float = 30.0, seed: int = 0, **way) -> Motion:
    """Running with the ball at the feet: short strides, bent knees, the eyes down, each right swing ends in a touch.

    `way`: turn_rate, phase as for `gait`.
    """
    neutral = neutral_stance(skeleton or adult_skeleton())
    style = GaitStyle(cadence=1.12, crouch=np.radians(7), lean=np.radians(4), head=np.radians(20), abduct=np.radians(9))
    course = plan(speed, duration, fps, neutral, style=style, seed=seed, **way)
    steps = tuple(footsteps(course, neutral, style, side) for side in (LEFT, RIGHT))
    posture = posture_over(course, steps, neutral, style, seed)
    ankles, feet = posture.ankles.copy(), posture.feet.copy()
    which = steps[RIGHT].current(course.times)
    share = (course.times - steps[RIGHT].off[which]) / (steps[RIGHT].on[which + 1] - steps[RIGHT].off[which])
    touch = np.where(share > 0, np.exp(-(((np.clip(share, 0, 1) - 0.78) / 0.1) ** 2)), 0.0)
    touch = touch * smooth_step(np.clip((1.0 - share) / 0.1, 0, 1))
    scale = neutral.leg / tables.LEG
    ahead = np.stack([np.cos(posture.heading), np.sin(posture.heading), 0 * touch], axis=-1)
    ankles[:, RIGHT] += 0.05 * scale * touch[:, None] * ahead
    feet[:, RIGHT, 1] += np.radians(16) * touch
    feet[:, RIGHT, 2] -= np.radians(22) * touch
    ankles[:, RIGHT, 2] += touch * lift_off_ground(ankles[:, RIGHT, 2], feet[:, RIGHT, 1], neutral)
    posture = posture.changed(ankles=ankles, feet=feet)
    return to_motion(posture.frames(course.asked), neutral)


# rows: seconds from the touch, then (hips up, ahead), (list, tilt, turn), spine, arms (flexion, abduction, inward, elbow)
_HEADER = {
    "trunk": (  # tilt of the pelvis, flexion of the spine, nod of the head
        (-1.1, 0, 2, 2), (-0.62, 14, 20, -22), (-0.30, 2, 2, -4), (-0.10, -8, -18, -10), (0.0, -2, 4, 6), (0.12, 8, 22, 4),
        (0.30, 10, 14, -6), (0.46, 18, 18, -14), (0.8, 6, 8, -2), (1.4, 0, 2, 2),
    ),
    "arms": (
        (-1.1, 2, 10, 12, 16), (-0.60, -48, 18, 5, 30), (-0.28, 78, 34, 20, 70), (-0.08, 55, 52, 30, 80), (0.0, 25, 50, 30, 85),
        (0.14, -2, 46, 20, 75), (0.34, 12, 44, 15, 50), (0.8, 6, 20, 12, 28), (1.4, 2, 10, 12, 16),
    ),
    "crouch": ((-1.1, 0), (-0.92, 0.01), (-0.58, 0.27), (-0.48, 0.25)),
    "absorb": ((0.42, 0.20), (0.56, 0.22), (1.0, 0.04), (1.5, 0)),
    "legs": ((-0.24, 0.0), (-0.06, 0.16), (0.08, 0.10), (0.24, 0.0)),
}
_FLIGHT = 0.25


def header(skeleton: Skeleton | None = None, fps: float = 60.0, seed: int = 0) -> Gesture:
    """A jump from both feet out of standing, the trunk arched and thrown at the ball at the top, and landing."""
    neutral = neutral_stance(skeleton or adult_skeleton())
    scale = neutral.leg / tables.LEG
    key = 1.5
    course, steps, posture = _standing(neutral, key + 1.9, fps, seed, width=0.10)
    times = course.times - key
    air = _FLIGHT * np.sqrt(scale)
    trunk, arms = np.radians(_keyed(_HEADER["trunk"], times)), np.radians(_keyed(_HEADER["arms"], times))
    ease = _envelope(times, -1.1, -0.8, 0.9, 1.4)
    pitch = np.radians(62) * _envelope(times, -air - 0.14, -air, air, air + 0.12)
    hips, ankles, feet, toes = posture.hips.copy(), posture.ankles.copy(), posture.feet.copy(), posture.toes.copy()
    rise, tuck = _jump(times, air, hips[:, 2], neutral, pitch)
    hips[:, 2] = rise
    for side in (LEFT, RIGHT):
        ankles[:, side], feet[:, side, 1], toes[:, side] = _jumping_foot(
            ankles[:, side], feet[:, side, 2], times, air, rise, pitch, tuck * scale, neutral
        )
    pelvis = posture.pelvis + np.stack([0 * times, trunk[:, 0], 0 * times], -1) * ease[:, None]
    spine = posture.spine + np.stack([0 * times, trunk[:, 1], 0 * times], -1) * ease[:, None]
    head = posture.head + np.stack([0 * times, trunk[:, 2], 0 * times], -1) * ease[:, None]
    both = posture.arms.copy()
    for side in (LEFT, RIGHT):
        both[:, side, :4] = _mixed(both[:, side, :4], arms, ease)
    posture = posture.changed(
        hips=hips, ankles=ankles, feet=feet, toes=toes, pelvis=pelvis, spine=spine, head=head, arms=both
    )
    return Gesture(to_motion(posture.frames(course.asked), neutral), key, key - 0.9, key + 0.9)


def _jump(times, air: float, standing: np.ndarray, neutral: Neutral, pitch) -> tuple[np.ndarray, np.ndarray]:
    """Height of the hips (N,) metres, free fall in the air, and how far (N,) the ankles are drawn up and back there."""
    scale = neutral.leg / tables.LEG
    take_off = np.mean(standing) + 0.085 * scale  # on the toes, legs stretched
    speed = tables.GRAVITY * air
    flight = take_off + speed * (times + air) - 0.5 * tables.GRAVITY * (times + air) ** 2
    crouch = np.array(_HEADER["crouch"])
    absorb = np.array(_HEADER["absorb"])
    base = float(np.mean(standing))
    before = CubicSpline(
        np.r_[crouch[:, 0], -air], np.r_[base - scale * crouch[:, 1], take_off], bc_type=((1, 0.0), (1, speed))
    )
    after = CubicSpline(
        np.r_[air, absorb[:, 0]], np.r_[take_off, base - scale * absorb[:, 1]], bc_type=((1, -speed), (1, 0.0))
    )
    rise = np.where(np.abs(times) <= air, flight, np.where(times < 0, before(times), after(times)))
    rise = np.where((times < crouch[0, 0]) | (times > absorb[-1, 0]), standing, rise)
    return rise, _keyed(_HEADER["legs"], times)[:, 0] * (np.abs(times) < air)


def _jumping_foot(ankle, yaw, times, air, rise, pitch, tuck, neutral: Neutral):
    """Ankle (N, 3), pitch (N,) and toe bend (N,) of a foot that rolls up on its ball, hangs in the air and comes down again."""
    ball_ahead, drop = neutral.ball[0, 0], -neutral.ball[0, 2]
    ahead = ball_ahead - ball_ahead * np.cos(pitch) + drop * np.sin(pitch)
    up = neutral.ankle_height - drop + ball_ahead * np.sin(pitch) + drop * np.cos(pitch)
    out = ankle.copy()
    flying = np.abs(times) < air
    take_off = rise[np.argmin(np.abs(times + air))]
    up = up + np.where(flying, rise - take_off + 0.45 * tuck, 0.0)
    along = ahead - tuck
    out[:, 0] += along * np.cos(yaw)
    out[:, 1] += along * np.sin(yaw)
    out[:, 2] = up
    return out, pitch, np.where(flying, 0.3, 1.0) * pitch


def _standing(neutral: Neutral, duration: float, fps: float, seed: int, width: float = 0.0):
    """Course, footsteps and posture of standing for `duration` seconds with feet `width` metres wider than usual."""
    style = GaitStyle(width=width, life=0.6)
    course = plan(0.0, duration, fps, neutral, style=style, seed=seed)
    steps = tuple(footsteps(course, neutral, style, side) for side in (LEFT, RIGHT))
    return course, steps, posture_over(course, steps, neutral, style, seed)


_THROW = {
    "trunk": (  # tilt of the pelvis, flexion of the spine, nod
        (-1.9, 0, 2, 4), (-1.2, 2, 4, 8), (-0.42, -10, -22, 12), (-0.22, -8, -26, 14), (0.0, 8, 12, -6), (0.22, 18, 32, -24),
        (0.6, 10, 18, -12), (1.3, 0, 2, 4),
    ),
    "arms": (  # flexion, abduction, inward, elbow, palm
        (-1.9, 28, 2, 18, 72, 20), (-1.2, 60, 2, 18, 80, 20), (-0.42, 168, 2, 14, 118, 10), (-0.22, 172, 2, 14, 112, 10),
        (0.0, 150, 2, 18, 32, 10), (0.2, 84, 2, 18, 14, 15), (0.6, 36, 6, 18, 22, 18), (1.3, 2, 9, 12, 16, 18),
    ),
    "hips": ((-1.9, 0.0, 0.0), (-0.9, -0.06, 0.02), (-0.42, 0.02, 0.05), (0.0, 0.34, 0.05), (0.3, 0.46, 0.04), (1.2, 0.46, 0.0)),
}


def throw_in(skeleton: Skeleton | None = None, fps: float = 60.0, seed: int = 0) -> Gesture:
    """A throw-in: the ball in both hands behind the head, the left foot steps ahead, the trunk whips; key: release."""
    neutral = neutral_stance(skeleton or adult_skeleton())
    scale = neutral.leg / tables.LEG
    key = 2.2
    course, _, posture = _standing(neutral, key + 2.0, fps, seed)
    times = course.times - key
    moved = _keyed(_THROW["hips"], times) * scale
    hips = posture.hips.copy()
    hips[:, 0] += moved[:, 0]
    hips[:, 2] -= moved[:, 1]
    steps = (
        _walked_steps(course, neutral, LEFT, key, ((-0.72, -0.36, 0.52),)),
        _walked_steps(course, neutral, RIGHT, key, ((0.16, 0.62, 0.46),)),
    )
    trunk, arms = np.radians(_keyed(_THROW["trunk"], times)), np.radians(_keyed(_THROW["arms"], times))
    ease = _envelope(times, -2.2, -1.6, 0.8, 1.5)
    nothing = np.zeros_like(times)
    lean = {
        name: getattr(posture, name) + ease[:, None] * np.stack([nothing, trunk[:, column], nothing], -1)
        for column, name in enumerate(("pelvis", "spine", "head"))
    }
    both = posture.arms.copy()
    for side in (LEFT, RIGHT):
        both[:, side] = _mixed(both[:, side], arms, ease)
    posture = with_feet(posture.changed(hips=hips, arms=both, **lean), course.times, steps, neutral)
    return Gesture(to_motion(posture.frames(course.asked), neutral), key, key - 1.3, key + 0.8)


def _walked_steps(course: Course, neutral: Neutral, side: int, key: float, moves) -> Footsteps:
    """Stances of one foot that stands still but for `moves`: rows (leaves, lands, metres ahead), seconds from the key."""
    scale = neutral.leg / tables.LEG
    sign = 1.0 if side == LEFT else -1.0
    left = sign * 0.5 * tables.at_speed("width", 0.0) * scale
    behind = tables.at_speed("ahead", 0.0) * scale
    places = [behind] + [behind + scale * ahead for *_, ahead in moves]
    on = np.array([course.times[0] - 1.0] + [key + land for _, land, _ in moves] + [course.times[-1] + 2.0])
    off = np.array([key + leave for leave, *_ in moves] + [course.times[-1] + 1.0, course.times[-1] + 3.0])
    places = np.array(places + places[-1:])
    count = len(on)
    yaw = np.full(count, sign * np.radians(tables.at_speed("toe_out", 0.3)))
    return Footsteps(side, on, off, np.stack([places, np.full(count, left)], -1), yaw, np.full(count, 1.2), np.zeros(count))


# seconds from the beginning; hips ahead, height; tilt of pelvis, spine, head; ankles ahead (left, right), height; foot pitch
_UP = {
    "hips": ((0, 0.0, 0.125), (0.7, 0.0, 0.125), (1.25, 0.02, 0.125), (1.75, 0.18, 0.22), (2.15, 0.42, 0.44), (2.7, 0.52, 0.72),
             (3.3, 0.56, 0.90), (3.9, 0.57, 0.93)),
    "tilt": ((0, -88, -4, 6), (0.55, -84, 16, 20), (1.25, -34, 38, 10), (1.75, 12, 44, -16), (2.15, 40, 40, -34),
             (2.7, 38, 28, -30), (3.3, 10, 10, -8), (3.9, 0, 2, 4)),
    "left": ((0, 0.80, 0.075, -55), (0.5, 0.80, 0.075, -50), (1.1, 0.54, 0.074, -4), (1.4, 0.52, 0.0732, 0), (3.9, 0.52, 0.0732, 0)),
    "right": ((0, 0.82, 0.075, -60), (0.6, 0.80, 0.075, -55), (1.25, 0.46, 0.078, 0), (1.6, 0.44, 0.0732, 0), (2.6, 0.44, 0.0732, 6),
              (2.85, 0.50, 0.12, 18), (3.15, 0.54, 0.0732, 0), (3.9, 0.54, 0.0732, 0)),
    "wrists": ((0, 8), (0.75, 0), (1.0, -66), (1.25, -72), (1.6, -15), (1.85, -25), (2.05, -55), (2.35, -10), (2.8, 8)),
    "left_arm": ((0, 2, 26, 0, 12), (0.7, -6, 30, -8, 32), (1.25, -38, 22, -10, 24), (1.75, 8, 24, 10, 40), (2.2, 62, 8, 20, 20),
                 (2.7, 48, 6, 20, 16), (3.3, 12, 10, 14, 22), (3.9, 2, 9, 12, 15)),
    "right_arm": ((0, 4, 26, 0, 14), (0.7, -4, 30, -8, 30), (1.25, -36, 24, -10, 20), (1.6, -34, 24, -5, 12), (1.95, 16, 24, 5, 24),
                  (2.3, 50, 12, 15, 24), (2.7, 42, 8, 18, 22), (3.3, 10, 10, 14, 20), (3.9, 1, 9, 12, 15)),
}
_UP_TIME = 3.9


def getting_up(skeleton: Skeleton | None = None, fps: float = 60.0, seed: int = 0, rest: float = 0.8) -> Gesture:
    """From lying on the back, face up, to standing: sitting up on the hands, feet drawn in, over the crouch; key: halfway.

    rest: seconds of lying before.
    """
    neutral = neutral_stance(skeleton or adult_skeleton())
    scale = neutral.leg / tables.LEG
    duration = rest + _UP_TIME + 0.9
    course, _, posture = _standing(neutral, duration, fps, seed)
    times = course.times - rest
    trunk = np.radians(_keyed(_UP["tilt"], times))
    way = _keyed(_UP["hips"], times) * scale
    on_feet = smooth_step((times - 3.2) / 0.7)
    nothing = np.zeros_like(times)
    hips = np.stack([way[:, 0], posture.hips[:, 1] * on_feet, way[:, 1]], -1)
    hips[:, 2] = _mixed(hips[:, 2], posture.hips[:, 2], on_feet)
    arms, ankles, feet = posture.arms.copy(), posture.ankles.copy(), posture.feet.copy()
    for side, name in ((LEFT, "left"), (RIGHT, "right")):
        arms[:, side, :4] = np.radians(_keyed(_UP[name + "_arm"], times))
        foot = _keyed(_UP[name], times)
        ankles[:, side, 0] = foot[:, 0] * scale
        ankles[:, side, 1] = (0.13, -0.13)[side] * scale
        ankles[:, side, 2] = foot[:, 1] * neutral.ankle_height / 0.0732
        feet[:, side] = np.stack([nothing, np.radians(foot[:, 2]), nothing + np.radians((14, -14)[side])], -1)
    posture = posture.changed(
        hips=hips,
        pelvis=np.stack([nothing, trunk[:, 0], nothing], -1),
        spine=np.stack([nothing, trunk[:, 1], nothing], -1),
        head=np.stack([nothing, trunk[:, 2], nothing], -1),
        arms=arms,
        wrists=np.radians(np.repeat(_keyed(_UP["wrists"], times), 2, axis=1)),
        ankles=ankles,
        feet=feet,
        toes=np.zeros_like(posture.toes),
    )
    return Gesture(to_motion(posture.frames(course.asked), neutral), rest + 1.9, rest + 0.3, rest + _UP_TIME)


def celebration(duration: float = 6.0, skeleton: Skeleton | None = None, fps: float = 30.0, seed: int = 0) -> Motion:
    """Running in a bow with both arms spread like wings, leaning into the curve."""
    neutral = neutral_stance(skeleton or adult_skeleton())
    times = np.arange(int(round(duration * fps)) + 1) / fps
    turn = 0.55 * np.sin(2.0 * np.pi * times / duration)
    course = plan(3.4 + 0.0 * times, None, fps, neutral, turn_rate=turn, seed=seed)
    steps = tuple(footsteps(course, neutral, GaitStyle(), side) for side in (LEFT, RIGHT))
    posture = posture_over(course, steps, neutral, GaitStyle(head=np.radians(-8)), seed)
    bank = np.interp(course.times, times, turn)
    flap = np.radians(5.0) * np.sin(2.0 * np.pi * 2.0 * course.phase)
    arms = posture.arms.copy()
    for side, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
        arms[:, side] = np.stack(
            [
                np.radians(8.0) + 0.15 * posture.arms[:, side, 0],
                np.radians(84.0) - sign * 0.5 * bank + flap,
                np.radians(-5.0) + 0.0 * bank,
                np.radians(14.0) + 0.0 * bank,
                np.radians(70.0) + 0.0 * bank,
            ],
            axis=-1,
        )
    posture = posture.changed(arms=arms)
    return to_motion(posture.frames(course.asked), neutral)


def _keyed(rows, times: np.ndarray) -> np.ndarray:
    """Rows (time, values...) as smooth curves without overshoot (T, values), held before the first and after the last."""
    table = np.array(rows, dtype=float)
    return PchipInterpolator(table[:, 0], table[:, 1:], axis=0)(np.clip(times, table[0, 0], table[-1, 0]))


def _envelope(times: np.ndarray, begin: float, full: float, fade: float, end: float) -> np.ndarray:
    """0 before `begin`, 1 from `full` to `fade`, 0 after `end` (T,)."""
    return smooth_step((times - begin) / (full - begin)) * (1.0 - smooth_step((times - fade) / (end - fade)))


def _mixed(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    weight = weight.reshape(weight.shape + (1,) * (a.ndim - 1))
    return a * (1.0 - weight) + b * weight
