"""Solve launches towards one target: the speeds with which it can be reached (`solve_arcs`, the flatter of the two
launches of each speed), and the strike that sends a ball there (`solve_shot`).

At each frame in which a part can strike, the ball touches the part on the side of its launch. All launches are solved
at once, and the frame in which the part moves fastest along its launch is chosen.

Source: Ball handling, section 4, figure 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..annotation.striking import Surface
from ..base.errors import InputError
from ..base.time_series import interpolate_columns
from ..motion.motion import Motion, compute_pose, sample_frames
from . import batch
from .aim import solve_launches
from .aim_problem import HIT_TOLERANCE, AimResult, build_reach_error
from .contact import StrikeSurface, compute_ball_centre
from .ground_launch import solve_ground_launches
from .physics import Ball, vector_length

RISE = 0.3
"""Upward share of the horizontal distance in the first guess of a launch."""
_TIMES = 28  # number of flight times tried, evenly spaced in their logarithm
_ELEVATIONS = np.radians(np.arange(0.0, 76.0, 5.0))  # above the line to the target
_SLACK = 1.03  # factor on the speed, for elevations between those tried
_LONGEST = 2.0  # times sqrt(2 distance / gravity), the flight time of the slowest launch without air


@dataclass(frozen=True, eq=False, kw_only=True)
class Strikes:
    """Where a part can strike, at N frames of a scene, world frame.

    Attributes:
        frames: (N,) of the scene.
        start: (N, 3) m, one end of the part's line.
        end: (N, 3) m, the other end.
        radius: m around the line.
        velocity: (N, 3) m/s of its middle.
    """

    frames: np.ndarray
    start: np.ndarray
    end: np.ndarray
    radius: float
    velocity: np.ndarray

    @classmethod
    def from_motion(cls, motion: Motion, surface: Surface, rows: np.ndarray, frames: np.ndarray) -> Strikes:
        """Sample the strikes of a motion.

        Args:
            motion: the motion, placed in the world.
            surface: the striking surface.
            rows: (N,) frames of the motion.
            frames: (N,) the scene's frames they correspond to.
        Returns:
            The strikes.
        """
        step = 0.5
        lines = []
        for offset in (-step, 0.0, step):
            root, local = sample_frames(motion, np.clip(rows + offset, 0, len(motion) - 1))
            lines.append(np.array(surface.compute_line(*compute_pose(motion.skeleton, root, local))))
        duration = np.clip(rows + step, 0, len(motion) - 1) - np.clip(rows - step, 0, len(motion) - 1)
        velocity = (lines[2] - lines[0]).mean(axis=0) * (motion.fps / np.maximum(duration, 1e-9))[:, None]
        return cls(frames=np.asarray(frames), start=lines[1][0], end=lines[1][1], radius=surface.radius,
                   velocity=velocity)

    def place_balls(self, towards: np.ndarray, radius: float) -> np.ndarray:
        """Place balls of `radius` m that leave along `towards` (N, 3): their centres (N, 3) m."""
        return compute_ball_centre(StrikeSurface(self.start, self.end, self.radius, self.velocity), towards, radius)


@dataclass(frozen=True, eq=False)
class Shot:
    """The launches from all frames (N,), and the chosen one.

    Attributes:
        frames: (N,) of the scene.
        starts: (N, 3) m, the ball's centre at each strike.
        launches: the launches.
        chosen_index: which of the N is used.
    """

    frames: np.ndarray
    starts: np.ndarray
    launches: AimResult
    chosen_index: int

    @property
    def start(self) -> np.ndarray:
        """(3,) m: the ball's centre at the strike."""
        return self.starts[self.chosen_index]

    @property
    def velocity(self) -> np.ndarray:
        """(3,) m/s at the launch."""
        return self.launches.velocity[self.chosen_index]

    @property
    def seconds(self) -> float:
        """s from the strike to the target."""
        return float(self.launches.seconds[self.chosen_index])


def solve_shot(strikes: Strikes, target: np.ndarray, ball: Ball, seconds: np.ndarray | None = None, bounces: int = 0,
               spin_turns: tuple[float, float] = (0.0, 0.0), ground: bool = False, fastest: float = np.inf,
               previous: AimResult | None = None, subject: str = "aim") -> Shot:
    """Solve the strike that sends a ball to a target.

    Args:
        strikes: where the part can strike (N frames).
        target: (3,) m, world frame.
        ball: the ball's physics.
        seconds: (N,) s from each frame to the target, or one number. None: the slowest launch.
        bounces: how often the ball bounces before the target.
        spin_turns: back spin and spin to the left, turns per second.
        ground: the ball goes along the ground; `bounces` is then ignored.
        fastest: m/s, the highest launch speed.
        previous: launches of a similar shot, as initial guess.
        subject: what the error message names.
    Returns:
        The shot.
    Raises:
        InputError: if no frame has a possible launch, or the target is where the ball is struck.
    """
    target = np.asarray(target, float)
    direction = target - 0.5 * (strikes.start + strikes.end)
    towards = direction + vector_length(direction)[:, None] * [0.0, 0.0,
                                                               RISE] if previous is None else previous.velocity
    initial_velocity, initial_seconds = (None, None) if previous is None else (previous.velocity, previous.seconds)
    spin = compute_spins(direction, spin_turns)
    # The ball's position depends on the launch direction: solve twice, the second time from the first directions.
    for _ in range(1 if previous is not None else 2):
        if ground:
            towards = towards * [1.0, 1.0, 0.0]
        starts = strikes.place_balls(towards, ball.radius)
        if vector_length(starts - target).min() < ball.radius:
            raise InputError(subject, "the target is where the ball is struck", "a target farther away",
                             "move the target")
        result = solve_ground_launches(starts, target, ball, seconds,
                                       fastest=fastest) if ground else solve_launches(starts, target, ball,
                seconds=seconds, bounces=bounces, spin=spin, fastest=fastest, initial_velocity=initial_velocity,
                initial_seconds=initial_seconds)
        towards, initial_velocity, initial_seconds = result.velocity, result.velocity, result.seconds
    if ground:
        starts[:, 2] = ball.radius
    if not result.possible.any():
        best = int(np.argmin(np.where(result.miss <= HIT_TOLERANCE, vector_length(result.velocity), np.inf)))
        raise build_reach_error(starts, np.broadcast_to(target, starts.shape), result, index=best, fastest=fastest,
                                subject=subject)
    return Shot(strikes.frames, starts, result, _choose_launch(strikes, result))


def compute_spins(direction: np.ndarray, spin_turns: tuple[float, float]) -> np.ndarray:
    """Compute the spins of balls that leave along a direction.

    Args:
        direction: (N, 3), any length.
        spin_turns: back spin and spin to the left, turns per second.
    Returns:
        (N, 3) rad/s, world frame.
    """
    level = direction * [1.0, 1.0, 0.0] / np.maximum(vector_length(direction * [1.0, 1.0, 0.0]), 1e-9)[:, None]
    back = np.stack([level[:, 1], -level[:, 0], np.zeros(len(direction))], axis=1)
    return 2.0 * np.pi * (spin_turns[0] * back + spin_turns[1] * np.array([0.0, 0.0, 1.0]))


def _choose_launch(strikes: Strikes, launches: AimResult) -> int:
    """Choose, among the possible launches, the one along which the part moves fastest."""
    along = launches.velocity / np.maximum(vector_length(launches.velocity), 1e-9)[:, None]
    return int(np.argmax(np.where(launches.possible, np.sum(strikes.velocity * along, axis=1), -np.inf)))


@dataclass(frozen=True, eq=False)
class Arcs:
    """Launches that reach one target, in order of rising speed.

    Attributes:
        speeds: (N,) m/s, ascending.
        velocities: (N, 3) m/s.
        seconds: (N,) s of flight.
    """

    speeds: np.ndarray
    velocities: np.ndarray
    seconds: np.ndarray

    @property
    def slowest(self) -> float:
        """m/s: below this speed the target cannot be reached."""
        return float(self.speeds[0])

    def at(self, speed: float) -> np.ndarray:
        """Give the launch (3,) m/s with this speed, limited to the speeds that exist."""
        return interpolate_columns(speed, self.speeds, self.velocities)


def solve_arcs(start: np.ndarray, target: np.ndarray, ball: Ball, spin: np.ndarray | None = None) -> Arcs:
    """Solve the launches that reach a target directly, without a bounce.

    Args:
        start: (3,) m, the ball's centre at the launch.
        target: (3,) m.
        ball: the ball's physics.
        spin: (3,) rad/s. None: no spin.
    Returns:
        The launches from the slowest to the flattest.
    """
    distance = float(np.linalg.norm(np.asarray(target, float) - start))
    least = distance / 60.0
    longest = max(_LONGEST * np.sqrt(2.0 * distance / ball.gravity), 2.0 * least)
    seconds = np.geomspace(least, longest, _TIMES)
    result = solve_launches(start, target, ball, seconds, spin=spin)
    good = np.flatnonzero(result.miss <= HIT_TOLERANCE)
    speeds = vector_length(result.velocity[good])
    # Times up to the slowest launch, longest first: the flatter of the two launches of each speed.
    flat = good[: int(np.argmin(speeds)) + 1][::-1]
    return Arcs(vector_length(result.velocity[flat]), result.velocity[flat], seconds[flat])


def is_out_of_reach(start: np.ndarray, target: np.ndarray, ball: Ball, speed: float,
                    spin: np.ndarray | None = None) -> bool:
    """Say whether no launch of at most `speed` m/s reaches the target.

    Simulates a fan of flights: much faster than solving the launch. It never rejects a target that can be reached.

    Args:
        start: (3,) m, the ball's centre at the launch.
        target: (3,) m.
        ball: the ball's physics.
        speed: m/s.
        spin: (3,) rad/s. None: no spin.
    Returns:
        True if the target is out of reach.
    """
    offset = np.asarray(target, float) - start
    level = float(np.hypot(offset[0], offset[1]))
    rise = np.minimum(np.arctan2(offset[2], level) + _ELEVATIONS, np.radians(89.0))
    ahead = np.array([offset[0], offset[1], 0.0]) / max(level, 1e-9)
    velocity = _SLACK * speed * (np.cos(rise)[:, None] * ahead + np.sin(rise)[:, None] * [0.0, 0.0, 1.0])
    count = np.zeros(len(rise), int)
    spin = np.zeros(3) if spin is None else np.asarray(spin, float)
    balls = batch.Balls(np.tile(np.asarray(start, float), (len(rise), 1)), velocity, np.tile(spin, (len(rise), 1)),
                        count, count)
    longest = 2.0 * speed / ball.gravity + 1.0
    for _ in range(int(np.ceil(longest / batch.STEP))):
        before = balls.position
        balls = batch.simulate_balls(balls, ball, batch.STEP, most_bounces=0)
        here, there = (np.array([(place - start) @ ahead, place[:, 2]]) for place in (before, balls.position))
        # A flight that crosses the target's distance in this step, at or above the target, can be lowered to hit it.
        passes = (here[0] < level) & (there[0] >= level)
        share = (level - here[0]) / np.maximum(there[0] - here[0], 1e-9)
        if np.any(passes & (here[1] + share * (there[1] - here[1]) >= target[2] - HIT_TOLERANCE)):
            return False
        if not np.any((there[0] < level) & (there[1] > min(target[2], start[2]) - 5.0)):
            break
    return True
