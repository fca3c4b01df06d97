"""Folders of made throws and kicks whose targets are known: the truth that networks are trained and tested on.

For each subject a folder of BVH files with their words (`NAME.txt`), and over all of them `throws.csv`, which says who
threw with what, when the ball left, how fast, and through which point it flew. The ball flies through air, so the point
is where it truly went.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..annotation import KeyMoment, Span, Timeline, format_timeline
from ..ball.flight import meet_wall
from ..ball.physics import BASEBALL
from ..base.errors import Cancelled, InputError
from ..files.bvh import bvh
from ..files.whole import atomic_write, whole_folder
from ..motion import quaternion
from ..motion.motion import Motion, place
from ..synthetic.kick_subjects import kick_style, kicker
from ..synthetic.kicks import KICKS
from ..synthetic.made_people import Person
from ..synthetic.throw_subjects import subject, subject_throws
from ..synthetic.throws import GRAVITY
from .made_kicks import kick
from .throw_examples import LAUNCH, TABLE_NAME, TARGET

COLUMNS = ("file", "subject", "limb", "release_s", *TARGET, "speed_m_s", *LAUNCH, "ball_x_m", "ball_y_m", "ball_z_m")
RATE = 120.0
_TRIES = 50
_INSIDE = (17.0, 1.2, 0.7)  # m/s and m up to which the inside serves, and how often


@dataclass(frozen=True, eq=False, kw_only=True)
class Planted:
    """A made throw or kick: motion, limb as in `throws.csv`, release s, position (3,) m and velocity (3,) m/s of the
    ball as it leaves, impact (3,) m where it flies through, words."""

    motion: Motion
    limb: str
    release: float
    position: np.ndarray
    velocity: np.ndarray
    impact: np.ndarray
    words: str


def planted_throw(thrower: Person, chance: np.random.Generator, fps: float = RATE) -> Planted:
    """A throw of this subject at some target 5 to 26 m away and up to 2.4 m high."""
    target, speed = _throw_order(thrower.fastest, chance)
    made = subject_throws(thrower, target, speed, chance, fps)
    impact, _ = meet_wall(made.position, made.velocity, BASEBALL, np.array([target[0], 0.0]), np.eye(2)[0])
    words, limb = f"throwb high {made.arm}", f"{made.arm}_hand"
    return Planted(motion=made.motion, limb=limb, release=made.release, position=made.position, velocity=made.velocity,
                   impact=impact, words=words)


def planted_kick(who: Person, chance: np.random.Generator, fps: float = RATE) -> Planted:
    """A kick of this subject at some place of a goal 8 to 22 m away; of the slower ones many with the inside of the
    foot."""
    for _ in range(_TRIES):
        target = chance.uniform((8.0, -3.4, 0.3), (22.0, 3.4, 2.2))
        speed = float(chance.uniform(12.0, who.fastest))
        inside = speed < _INSIDE[0] and target[2] < _INSIDE[1] and chance.uniform() < _INSIDE[2]
        style = kick_style(who, KICKS["inside" if inside else "instep"], speed, chance)
        try:
            made = kick(tuple(target), speed, who.side, style=style, skeleton=who.skeleton, fps=fps)
        except InputError:
            continue  # too far for this speed, or lower or higher than this foot sends it
        words = f"kick {made.foot} low {'inside' if inside else 'top'} running"
        return Planted(motion=made.motion, limb=f"{made.foot}_foot", release=made.contact, position=made.ball,
                       velocity=made.velocity, impact=target, words=words)
    raise InputError("planted kicks", f"{who.name} with {who.fastest:g} m/s", "one who reaches a goal")


def _throw_order(fastest: float, chance: np.random.Generator) -> tuple[tuple[float, float, float], float]:
    """A target (3,) m ahead and a speed m/s that reaches it on a flat arc."""
    for _ in range(_TRIES):
        ahead, up = float(chance.uniform(5.0, 26.0)), float(chance.uniform(0.1, 2.4))
        speed = float(chance.uniform(13.0, fastest))
        rise = up - 1.7
        least = np.sqrt(GRAVITY * (rise + np.hypot(rise, ahead)))
        if speed > 1.3 * least:
            return (ahead, 0.0, up), speed
    raise InputError("planted throws", f"a fastest throw of {fastest:g} m/s", "one of more than 20 m/s")


def planted(action: str, seed: int, order: int) -> tuple[str, Planted]:
    """The name of the subject of that seed, and its throw (or kick) number `order`, somewhere on the ground."""
    make, person = ACTIONS[action]
    who, chance = person(seed), np.random.default_rng([seed, order, 40])
    return who.name, _elsewhere(make(who, chance), chance)


def _elsewhere(made: Planted, chance: np.random.Generator) -> Planted:
    """The same somewhere else on the ground, turned by any angle."""
    angle, away = float(chance.uniform(-np.pi, np.pi)), np.append(chance.uniform(-20.0, 20.0, 2), 0.0)
    turn = quaternion.about_up(np.array(angle))
    position, velocity, impact = (quaternion.rotate(turn, v) for v in (made.position, made.velocity, made.impact))
    motion = place(made.motion, angle, away)
    return replace(made, motion=motion, position=position + away, velocity=velocity, impact=impact + away)


def write_planted(
    folder: Path, action: str, subjects: int, count: int, seed: int = 0,
    progress: Callable[[float, str], None] = lambda share, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> int:
    """Makes `count` throws (or kicks, by `action`) of each of `subjects` people in `folder`; how many there are then.

    The folder comes whole or not at all. seed: of the first subject, the others follow. InputError where the folder has
    files, or cannot be written.
    """
    if action not in ACTIONS:
        raise InputError("action", action, " or ".join(ACTIONS))
    with whole_folder(folder) as part:
        rows = [",".join(COLUMNS)]
        for number in range(subjects):
            for order in range(count):
                if cancelled():
                    raise Cancelled("cancelled")
                who, example = planted(action, seed + number, order)
                progress((number * count + order) / (subjects * count), f"{who}, {action} {order + 1}")
                rows.append(_written(part, who, f"{who}_{action}{order + 1:03d}", example))
        atomic_write(part / TABLE_NAME, "\n".join(rows) + "\n")
    return subjects * count


def _written(folder: Path, who: str, name: str, example: Planted) -> str:
    """Writes one example; its row of the table."""
    place_of = folder / who
    place_of.mkdir(exist_ok=True)
    bvh.write(place_of / f"{name}.bvh", example.motion)
    words, end = tuple(example.words.split()), example.motion.duration
    timeline = Timeline((Span(0.0, end, words),), (KeyMoment(round(example.release, 6), words),))
    atomic_write(place_of / f"{name}.txt", format_timeline(timeline))
    speed = float(np.linalg.norm(example.velocity))
    numbers = (example.release, *example.impact, speed, *example.velocity, *example.position)
    return ",".join((f"{who}/{name}.bvh", who, example.limb, *(f"{number:.6f}" for number in numbers)))


ACTIONS = {"throw": (planted_throw, subject), "kick": (planted_kick, kicker)}
"""action -> who makes one of somebody's examples by chance, and who makes somebody by seed."""
