"""Launches towards one target: at which speeds it can be reached (`arcs`, the flatter of both of every speed), and the
strike that sends a ball there (`shoot`).

From each frame in which a part can strike, the ball lies where the part touches it on the side of its launch; all
launches are aimed at once (Ball handling §4, Fig. 6), and the frame in which the part moves fastest along its launch is
taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..annotation.striking import Surface
from ..base.errors import InputError
from ..base.time_series import interpolate
from ..motion.motion import Motion, at_frames, pose_kinematics
from . import batch
from .aim import CLOSE, Aimed, aim, along_ground, out_of_reach
from .contact import StruckFrom, ball_centre
from .physics import Ball, length

RISE = 0.3
"""How much the first guess of a launch leads up, for one that leads level."""
_TIMES = 28  # flight times tried, evenly spaced in their logarithm
_ELEVATIONS = np.radians(np.arange(0.0, 76.0, 5.0))  # above the line to the target
_SLACK = 1.03  # on a speed, for what lies between elevations
_LONGEST = 2.0  # times the flight of the slowest launch where there is no air: sqrt(2 far / gravity)


@dataclass(frozen=True, eq=False, kw_only=True)
class Strikes:
    """Where a part can strike, at frames (N,) of a scene, in the world: start, end (N, 3) m of its line, radius m,
    velocity (N, 3) m/s."""

    frames: np.ndarray
    start: np.ndarray
    end: np.ndarray
    radius: float
    velocity: np.ndarray

    @classmethod
    def of(cls, motion: Motion, surface: Surface, rows: np.ndarray, frames: np.ndarray) -> Strikes:
        """Those of a motion's `rows` (N,), which are the scene's `frames` (N,)."""
        step = 0.5
        lines = []
        for offset in (-step, 0.0, step):
            root, local = at_frames(motion, np.clip(rows + offset, 0, len(motion) - 1))
            lines.append(np.array(surface.line(*pose_kinematics(motion.skeleton, root, local))))
        taken = np.clip(rows + step, 0, len(motion) - 1) - np.clip(rows - step, 0, len(motion) - 1)
        velocity = (lines[2] - lines[0]).mean(axis=0) * (motion.fps / np.maximum(taken, 1e-9))[:, None]
        return cls(frames=np.asarray(frames), start=lines[1][0], end=lines[1][1], radius=surface.radius,
                   velocity=velocity)

    def balls(self, towards: np.ndarray, radius: float) -> np.ndarray:
        """(N, 3) m: the centre of a ball of `radius` m that leaves along `towards` (N, 3)."""
        return ball_centre(StruckFrom(self.start, self.end, self.radius, self.velocity), towards, radius)


@dataclass(frozen=True, eq=False)
class Shot:
    """The launches from all frames (N,), and which one is taken: starts (N, 3) m, aimed, chosen."""

    frames: np.ndarray
    starts: np.ndarray
    aimed: Aimed
    chosen: int

    @property
    def start(self) -> np.ndarray:
        """(3,) m: the ball's centre at the strike."""
        return self.starts[self.chosen]

    @property
    def velocity(self) -> np.ndarray:
        """(3,) m/s with which it leaves."""
        return self.aimed.velocity[self.chosen]

    @property
    def seconds(self) -> float:
        """s until it is at the target."""
        return float(self.aimed.seconds[self.chosen])


def shoot(strikes: Strikes, target: np.ndarray, ball: Ball, seconds: np.ndarray | None = None, bounces: int = 0,
          turns: tuple[float, float] = (0.0, 0.0), ground: bool = False, fastest: float = np.inf,
          near: Aimed | None = None, what: str = "aim") -> Shot:
    """The strike that sends a ball to `target` (3,) m.

    seconds (N,) from each frame on, or one number; None: the slowest launch. turns: back spin and spin to the left,
    turns a second. ground: it goes along the ground; else after so many bounces. near: the launches of a shot like it,
    to begin with. InputError where no frame has one that is possible within `fastest` m/s; `what` is named there."""
    target = np.asarray(target, float)
    way = target - 0.5 * (strikes.start + strikes.end)
    towards = way + length(way)[:, None] * [0.0, 0.0, RISE] if near is None else near.velocity
    launch, about = (None, None) if near is None else (near.velocity, near.seconds)
    spin = spins(way, turns)
    for _ in range(1 if near is not None else 2):
        if ground:
            towards = towards * [1.0, 1.0, 0.0]
        starts = strikes.balls(towards, ball.radius)
        if length(starts - target).min() < ball.radius:
            raise InputError(what, "the target is where the ball is struck", "a target some way off", "move the target")
        aimed = along_ground(starts, target, ball, seconds, fastest=fastest) if ground else \
            aim(starts, target, ball, seconds=seconds, bounces=bounces, spin=spin, fastest=fastest, near=launch,
                about=about)
        towards, launch, about = aimed.velocity, aimed.velocity, aimed.seconds
    if ground:
        starts[:, 2] = ball.radius
    if not aimed.possible.any():
        best = int(np.argmin(np.where(aimed.miss <= CLOSE, length(aimed.velocity), np.inf)))
        raise out_of_reach(starts, np.broadcast_to(target, starts.shape), aimed, index=best, fastest=fastest, what=what)
    return Shot(strikes.frames, starts, aimed, _chosen(strikes, aimed))


def spins(way: np.ndarray, turns: tuple[float, float]) -> np.ndarray:
    """Spins (N, 3) rad/s of balls that leave along `way` (N, 3): back spin and spin to the left, turns a second."""
    level = way * [1.0, 1.0, 0.0] / np.maximum(length(way * [1.0, 1.0, 0.0]), 1e-9)[:, None]
    back = np.stack([level[:, 1], -level[:, 0], np.zeros(len(way))], axis=1)
    return 2.0 * np.pi * (turns[0] * back + turns[1] * np.array([0.0, 0.0, 1.0]))


def _chosen(strikes: Strikes, aimed: Aimed) -> int:
    """Of the launches that are possible, the one along which the part moves fastest."""
    along = aimed.velocity / np.maximum(length(aimed.velocity), 1e-9)[:, None]
    return int(np.argmax(np.where(aimed.possible, np.sum(strikes.velocity * along, axis=1), -np.inf)))


@dataclass(frozen=True, eq=False)
class Arcs:
    """Launches that reach one target, from the slowest to ever faster ones: speeds (N,) m/s, rising; velocities (N, 3)
    m/s; seconds (N,) of flight."""

    speeds: np.ndarray
    velocities: np.ndarray
    seconds: np.ndarray

    @property
    def slowest(self) -> float:
        """m/s below which the target cannot be reached."""
        return float(self.speeds[0])

    def at(self, speed: float) -> np.ndarray:
        """(3,) m/s: the launch of that speed, as far as there is one."""
        return interpolate(speed, self.speeds, self.velocities)


def arcs(start: np.ndarray, target: np.ndarray, ball: Ball, spin: np.ndarray | None = None) -> Arcs:
    """The launches from `start` (3,) m that lead straight to `target` (3,) m, without a bounce; spin (3,) rad/s."""
    far = float(np.linalg.norm(np.asarray(target, float) - start))
    least = far / 60.0
    longest = max(_LONGEST * np.sqrt(2.0 * far / ball.gravity), 2.0 * least)
    seconds = np.geomspace(least, longest, _TIMES)
    found = aim(start, target, ball, seconds, spin=spin)
    good = np.flatnonzero(found.miss <= CLOSE)
    speeds = length(found.velocity[good])
    flat = good[: int(np.argmin(speeds)) + 1][::-1]
    return Arcs(length(found.velocity[flat]), found.velocity[flat], seconds[flat])


def is_out_of_reach(start: np.ndarray, target: np.ndarray, ball: Ball, speed: float,
                    spin: np.ndarray | None = None) -> bool:
    """Whether no launch from `start` (3,) m of at most `speed` m/s comes as far as `target` (3,) m: a fan of flights,
    far quicker than looking for the launch, and never wrong about a target that can be reached."""
    way = np.asarray(target, float) - start
    level = float(np.hypot(way[0], way[1]))
    rise = np.minimum(np.arctan2(way[2], level) + _ELEVATIONS, np.radians(89.0))
    ahead = np.array([way[0], way[1], 0.0]) / max(level, 1e-9)
    velocity = _SLACK * speed * (np.cos(rise)[:, None] * ahead + np.sin(rise)[:, None] * [0.0, 0.0, 1.0])
    count = np.zeros(len(rise), int)
    spin = np.zeros(3) if spin is None else np.asarray(spin, float)
    balls = batch.Balls(np.tile(np.asarray(start, float), (len(rise), 1)), velocity, np.tile(spin, (len(rise), 1)),
                        count, count)
    longest = 2.0 * speed / ball.gravity + 1.0
    for _ in range(int(np.ceil(longest / batch.STEP))):
        before = balls.position
        balls = batch.after(balls, ball, batch.STEP, most_bounces=0)
        here, there = (np.array([(place - start) @ ahead, place[:, 2]]) for place in (before, balls.position))
        passes = (here[0] < level) & (there[0] >= level)
        share = (level - here[0]) / np.maximum(there[0] - here[0], 1e-9)
        if np.any(passes & (here[1] + share * (there[1] - here[1]) >= target[2] - CLOSE)):
            return False
        if not np.any((there[0] < level) & (there[1] > min(target[2], start[2]) - 5.0)):
            break
    return True
