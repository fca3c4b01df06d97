"""Synthetic throws and kicks with known targets: ground truth on which networks are trained and tested, in folders.

For each subject a folder of BVH files with their labels (`NAME.txt`), and for all of them `throws.csv`, with
subject, limb, release time, speed and the point that the ball flew through. The ball flies through air, so the point
is its true position.

A kick is aimed as people aim: the whole approach is rotated to the target, a harder kick is swung faster, and the
ball rises as the foot (of `synthetic.kicks`) strikes it lower or with its toes less down
(`ball_release.strike_ball`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..annotation import KeyMoment, Span, Timeline, format_timeline
from ..annotation.striking import FOOT_RADIUS
from ..ball.flight import find_wall_impact
from ..ball.physics import BASEBALL, FOOTBALL, Ball
from ..base.errors import InputError, UserCancelledError
from ..base.time_series import interpolate_columns
from ..base.vectors import arctan2
from ..files.atomic import atomic_folder, atomic_write
from ..files.bvh import bvh
from ..motion import quaternion
from ..motion.motion import Motion, place_motion
from ..motion.retargeting.adult import ADULT_LEG, build_adult_skeleton
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.skeleton import Skeleton
from ..motion.supports import GRAVITY
from ..synthetic.gestures import choose_style
from ..synthetic.kicks import BEFORE, KICKS, KickStyle, build_kick, compute_contacts
from ..synthetic.performers import Performer, build_kicker, build_performer_throw, build_thrower, vary_kick
from .ball_release import strike_ball
from .throw_records import LAUNCH, TABLE_NAME, TARGET

COLUMNS = ("file", "subject", "limb", "release_s", *TARGET, "speed_m_s", *LAUNCH, "ball_x_m", "ball_y_m", "ball_z_m")
RATE = 120.0
"""Frames per second of the files."""
_TRIES = 50  # random targets that are tried
_INSIDE_LIMITS = (17.0, 1.2, 0.7)  # m/s and m up to which the inside of the foot is used, and its probability
MIN_SPEED, MAX_SPEED = 6.0, 36.0
"""Range of the ball speed, m/s."""
_TOE_CLEARANCE = 0.05  # m, height of the toe joint above the ground at the contact of an instep kick
_INSIDE_POINT = 0.35  # share of the foot, from ankle to toe joint, at which the inside strikes the ball
_STEEP = 0.5  # sine of the foot's slope above which the kick is an instep kick
_LOFTS = np.linspace(-16.0, 20.0, 5)  # degrees, sampled for an instep kick
_LIFTS = np.linspace(0.05, -0.03, 5)  # m, sampled for a kick with the inside
_ROUNDS = 6  # iterations with interpolated launches before exact ones
_HIT = 0.01  # m, tolerance of a hit


@dataclass(frozen=True, eq=False, kw_only=True)
class SyntheticExample:
    """A synthetic throw or kick.

    Attributes:
        motion: the motion.
        limb: as in `throws.csv`.
        release: s at which the ball leaves.
        position: (3,) m of the ball at the release.
        velocity: (3,) m/s of the ball at the release.
        impact: (3,) m, point that the ball flies through.
        labels: labels of the clip.
    """

    motion: Motion
    limb: str
    release: float
    position: np.ndarray
    velocity: np.ndarray
    impact: np.ndarray
    labels: str


def generate_throw(thrower: Performer, chance: np.random.Generator, fps: float = RATE) -> SyntheticExample:
    """Generate a throw of a subject at a random target 5 to 26 m away and up to 2.4 m high."""
    target, speed = _choose_target(thrower.fastest, chance)
    throw = build_performer_throw(thrower, target, speed, chance, fps)
    impact, _ = find_wall_impact(throw.position, throw.velocity, BASEBALL, np.array([target[0], 0.0]), np.eye(2)[0])
    words, limb = f"throwb high {throw.arm}", f"{throw.arm}_hand"
    return SyntheticExample(motion=throw.motion, limb=limb, release=throw.release, position=throw.position,
                            velocity=throw.velocity, impact=impact, labels=words)


def generate_kick(kicker: Performer, chance: np.random.Generator, fps: float = RATE) -> SyntheticExample:
    """Generate a kick of a subject at a random point of a goal 8 to 22 m away.

    Slower kicks are often with the inside of the foot.
    """
    for _ in range(_TRIES):
        target = chance.uniform((8.0, -3.4, 0.3), (22.0, 3.4, 2.2))
        speed = float(chance.uniform(12.0, kicker.fastest))
        inside = speed < _INSIDE_LIMITS[0] and target[2] < _INSIDE_LIMITS[1] and chance.uniform() < _INSIDE_LIMITS[2]
        style = vary_kick(kicker, KICKS["inside" if inside else "instep"], speed, chance)
        try:
            result = generate_kick_at(tuple(target), speed, kicker.side, style=style, skeleton=kicker.skeleton, fps=fps)
        except InputError:
            continue  # too far for this speed, or lower or higher than this foot sends it
        words = f"kick {result.foot} low {'inside' if inside else 'top'} running"
        return SyntheticExample(motion=result.motion, limb=f"{result.foot}_foot", release=result.contact,
                                position=result.ball, velocity=result.velocity, impact=target, labels=words)
    raise InputError("synthetic kicks", f"{kicker.name} with {kicker.fastest:g} m/s", "a performer who reaches a goal")


def _choose_target(fastest: float, chance: np.random.Generator) -> tuple[tuple[float, float, float], float]:
    """Choose a target (3,) m ahead and a speed (m/s) that reaches it on a flat arc."""
    for _ in range(_TRIES):
        ahead, up = float(chance.uniform(5.0, 26.0)), float(chance.uniform(0.1, 2.4))
        speed = float(chance.uniform(13.0, fastest))
        rise = up - 1.7
        least = np.sqrt(GRAVITY * (rise + np.hypot(rise, ahead)))
        if speed > 1.3 * least:
            return (ahead, 0.0, up), speed
    raise InputError("synthetic throws", f"a fastest throw of {fastest:g} m/s", "more than 20 m/s")


def generate_example(action: str, seed: int, order: int) -> tuple[str, SyntheticExample]:
    """Generate throw (or kick) number `order` of the subject of a seed, anywhere on the ground.

    Returns:
        The subject's name, and the example.
    """
    generate, create_subject = ACTIONS[action]
    subject, chance = create_subject(seed), np.random.default_rng([seed, order, 40])
    return subject.name, _place_randomly(generate(subject, chance), chance)


def _place_randomly(example: SyntheticExample, chance: np.random.Generator) -> SyntheticExample:
    """Move and rotate an example on the ground by random amounts."""
    angle, offset = float(chance.uniform(-np.pi, np.pi)), np.append(chance.uniform(-20.0, 20.0, 2), 0.0)
    turn = quaternion.from_up_angle(np.array(angle))
    position, velocity, impact = (quaternion.rotate(turn, v) for v in (example.position, example.velocity,
                                                                       example.impact))
    motion = place_motion(example.motion, angle, offset)
    return replace(example, motion=motion, position=position + offset, velocity=velocity, impact=impact + offset)


def write_examples(
    folder: Path, action: str, subjects: int, count: int, seed: int = 0,
    progress: Callable[[float, str], None] = lambda share, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> int:
    """Write throws or kicks of synthetic subjects to a folder, completely or not at all.

    Args:
        folder: new or empty folder.
        action: "throw" or "kick".
        subjects: number of subjects.
        count: number of throws or kicks of each.
        seed: of the first subject; the others follow.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Returns:
        The number of files.
    Raises:
        InputError: if the folder has files or cannot be written.
    """
    if action not in ACTIONS:
        raise InputError("action", action, " or ".join(ACTIONS))
    with atomic_folder(folder) as part:
        rows = [",".join(COLUMNS)]
        for number in range(subjects):
            for order in range(count):
                if cancelled():
                    raise UserCancelledError("cancelled")
                subject, example = generate_example(action, seed + number, order)
                progress((number * count + order) / (subjects * count), f"{subject}, {action} {order + 1}")
                rows.append(_write_example(part, subject, f"{subject}_{action}{order + 1:03d}", example))
        atomic_write(part / TABLE_NAME, "\n".join(rows) + "\n")
    return subjects * count


def _write_example(folder: Path, subject: str, name: str, example: SyntheticExample) -> str:
    """Write one example; return its row of the table."""
    subject_folder = folder / subject
    subject_folder.mkdir(exist_ok=True)
    bvh.write_bvh(subject_folder / f"{name}.bvh", example.motion)
    words, end = tuple(example.labels.split()), example.motion.duration
    timeline = Timeline((Span(0.0, end, words),), (KeyMoment(round(example.release, 6), words),))
    atomic_write(subject_folder / f"{name}.txt", format_timeline(timeline))
    speed = float(np.linalg.norm(example.velocity))
    numbers = (example.release, *example.impact, speed, *example.velocity, *example.position)
    return ",".join((f"{subject}/{name}.bvh", subject, example.limb, *(f"{number:.6f}" for number in numbers)))


ACTIONS = {"throw": (generate_throw, build_thrower), "kick": (generate_kick, build_kicker)}
"""action -> function that generates an example of a subject at random, and function that creates a subject by seed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Kick:
    """A synthetic kick.

    Attributes:
        motion: the body.
        contact: s at which the foot strikes the ball.
        foot: "left" or "right".
        ball: (3,) m, centre of the ball until then.
        velocity: (3,) m/s of the ball at the release.
        spin: (3,) rad/s of the ball at the release.
    """

    motion: Motion
    contact: float
    foot: str
    ball: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


def generate_kick_at(
    target: tuple[float, float, float] = (11.0, 0.0, 1.0), speed: float = 20.0, foot: str = "right",
    style: str | KickStyle = "instep", skeleton: Skeleton | None = None, fps: float = 120.0, ball: Ball = FOOTBALL,
) -> Kick:
    """Generate a kick with a three-step approach of a ball at the origin.

    Args:
        target: (3,) m, point that the ball flies through.
        speed: m/s of the ball at the release.
        foot: "left" or "right".
        style: a name of KICKS, or a custom style.
        skeleton: any humanoid skeleton, default the project's adult.
        fps: frames per second.
        ball: kind of ball.
    Raises:
        InputError: if the target is out of reach at that speed, or foot or style are unknown.
    """
    chosen_style = choose_style("kick", foot, "foot", style=style, styles=KICKS, speed=speed,
                                speeds=(MIN_SPEED, MAX_SPEED))
    neutral = build_neutral_stance(skeleton or build_adult_skeleton())
    return _KickSolver(chosen_style, neutral, foot, ball).solve_kick(np.asarray(target, dtype=float), speed, fps)


class _KickSolver:
    """Launches along +X that a style of kicking can reach, by how the foot strikes the ball."""

    def __init__(self, style: KickStyle, neutral: NeutralStance, foot: str, ball: Ball):
        self.style, self.neutral, self.foot, self.ball = style, neutral, foot, ball
        steep = _compute_slopes(compute_contacts(style, neutral, foot, [(0.0, 0.0)])[0])[0] > _STEEP
        self.variants = self._build_clear_variants(_LOFTS) if steep else np.stack([_LIFTS, np.zeros_like(_LIFTS)],
                                                                                  axis=-1)
        launches = self.compute_launches(self.variants)
        rising = arctan2(launches[:, 5], np.hypot(launches[:, 3], launches[:, 4]))
        order = np.argsort(rising)
        self.elevations, self.variants, self.launches = rising[order], self.variants[order], launches[order]

    def _build_clear_variants(self, lofts: np.ndarray) -> np.ndarray:
        """Build (lift, loft) pairs (N, 2) with the toes just above the ground."""
        ends, _ = compute_contacts(self.style, self.neutral, self.foot, [(0.0, loft) for loft in lofts])
        return np.stack([(_TOE_CLEARANCE - ends[:, 1, 2]) / (self.neutral.leg / ADULT_LEG), lofts], axis=-1)

    def compute_launches(self, variants: np.ndarray) -> np.ndarray:
        """Compute the ball's position m, velocity m/s and spin rad/s (N, 9) for (lift, loft) pairs (N, 2).

        They are those of the style's own pace.
        """
        ends, velocities = compute_contacts(self.style, self.neutral, self.foot, variants)
        middle = velocities.mean(axis=1)
        centre = np.stack([_find_contact_centre(*each, self.ball.radius) for each in zip(ends, middle)])
        found = strike_ball(ends, velocities, FOOT_RADIUS, centre, self.ball)
        return np.concatenate([centre, found.velocity, found.spin], axis=-1)

    def solve_kick(self, target: np.ndarray, speed: float, fps: float) -> Kick:
        """Generate the kick whose ball flies through the target, the ball at the origin."""
        away = float(np.hypot(target[0], target[1]))
        start = np.array([0.0, 0.0, self.ball.radius])
        fallen = 0.5 * self.ball.gravity * (away / speed) ** 2
        up, side = float(np.arctan2(target[2] - self.ball.radius + fallen, away)), 0.0
        is_near = False
        # correct elevation and direction by the miss; interpolated launches first, exact ones near the solution
        for number in range(_ROUNDS + 2):
            variant = interpolate_columns(up, self.elevations, self.variants)
            is_exact = is_near or number >= _ROUNDS
            launch = self.compute_launches(variant[None])[0] if is_exact else interpolate_columns(up, self.elevations,
                    self.launches)
            centre, velocity, spin = np.split(launch, 3)
            rate = speed / float(np.linalg.norm(velocity))
            turn = float(np.arctan2(target[1], target[0]) - np.arctan2(velocity[1], velocity[0])) + side
            rotated_launch = quaternion.rotate(quaternion.from_up_angle(np.array(turn)),
                                               np.stack([rate * velocity, rate * spin]))
            impact, _ = find_wall_impact(start, rotated_launch[0], self.ball, target[:2], target[:2],
                                         spin=rotated_launch[1])
            is_near = is_near or bool(np.linalg.norm(impact - target) < _HIT)
            if is_exact and np.linalg.norm(impact - target) < _HIT:
                break
            up += float(np.arctan2(target[2] - impact[2], away))
            side += float((impact[0] * target[1] - impact[1] * target[0]) / away**2)
        if np.linalg.norm(impact - target) > 5.0 * _HIT:
            raise InputError(
                "kick", f"a ball of {speed:g} m/s passes the target by {np.linalg.norm(impact - target):.2f} m",
                "a target within reach", "choose a higher speed, or a lower or nearer target",
            )
        motion = build_kick(self.style, self.neutral, self.foot, lift=variant[0], loft=variant[1], rate=rate, turn=turn,
                            fps=fps)
        back = start - quaternion.rotate(quaternion.from_up_angle(np.array(turn)), centre)
        return Kick(motion=place_motion(motion, 0.0, back), contact=BEFORE / rate, foot=self.foot, ball=start,
                    velocity=rotated_launch[0], spin=rotated_launch[1])


def _compute_slopes(ends: np.ndarray) -> np.ndarray:
    """Compute the sines (N,) of the downward slope of feet with ends (N, 2, 3)."""
    return (ends[:, 0, 2] - ends[:, 1, 2]) / np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1)


def _find_contact_centre(ends: np.ndarray, velocity: np.ndarray, radius: float) -> np.ndarray:
    """Compute the centre (3,) m of a ball on the ground that a foot touches.

    The foot's line (2, 3) m moves with `velocity` (3,) m/s. A foot that points down strikes where its line is
    perpendicular to its velocity; a level one with its inside.
    """
    line = ends[1] - ends[0]
    along, far = line / np.linalg.norm(line), FOOT_RADIUS + radius
    normal = velocity - velocity @ along * along
    normal /= np.linalg.norm(normal)
    if abs(along[2]) > _STEEP:
        share = (radius - far * normal[2] - ends[0, 2]) / line[2]
        if 0.0 <= share <= 1.0:
            return ends[0] + share * line + far * normal
        point = ends[int(share > 1.0)]
        normal = _tilt_normal(point, normal, np.zeros(3), radius, far)
    else:
        point = ends[0] + _INSIDE_POINT * line
        normal = _tilt_normal(point, normal, along, radius, far)
    return point + far * normal


def _tilt_normal(point: np.ndarray, normal: np.ndarray, along: np.ndarray, height: float, far: float) -> np.ndarray:
    """Rotate a normal so that a ball at `height` m touches the foot.

    Returns the unit vector (3,) perpendicular to `along` (or free, if that is zero) for which `point` is `far` m
    from a centre at `height` m, as near to `normal` as possible.
    """
    up = np.array([0.0, 0.0, 1.0]) - along[2] * along
    level = normal - normal @ up / (up @ up) * up
    level /= np.linalg.norm(level)
    rise = np.clip((height - point[2]) / far / np.sqrt(up @ up), -0.9, 0.9)
    return np.sqrt(1.0 - rise**2) * level + rise * up / np.sqrt(up @ up)
