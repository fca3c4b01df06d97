"""The targets of aimed balls, simulated to the time of arrival, and the launches that were found for them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from . import batch
from .physics import Ball, vector_length

HIT_TOLERANCE = 0.01
"""m: a miss up to this counts as a hit."""
REBOUND_MARGIN = 5e-3
"""s: the least time since the last bounce. Without it, a ball on the ground at its target would count its first touch
of the ground as a bounce."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AimProblem:
    """Targets (B): start, target, spin (B, 3), seconds (B,), and the ball, bounces and ground they share."""

    start: np.ndarray
    target: np.ndarray
    spin: np.ndarray
    seconds: np.ndarray
    ball: Ball
    bounces: int
    ground: float

    @classmethod
    def from_arguments(cls, start, target, ball, seconds, bounces, spin, ground) -> AimProblem:
        """Check and broadcast the arguments of `solve_launches` to (B, 3) and (B,).

        Args:
            start: (3,) or (B, 3) m, where the balls start.
            target: (3,) or (B, 3) m.
            ball: their kind.
            seconds: s of flight, a number or (B,); None: 1 s, until it is chosen.
            bounces: number of bounces before the target.
            spin: (3,) or (B, 3) rad/s; None: no spin.
            ground: m, height of the ground.
        Returns:
            The checked problem.
        """
        start, target = np.asarray(start, float), np.asarray(target, float)
        spin = np.zeros(3) if spin is None else np.asarray(spin, float)
        timed = np.ones(1) if seconds is None else np.asarray(seconds, float)
        shape = np.broadcast_shapes(start.shape, target.shape, spin.shape, (*timed.reshape(-1, 1).shape[:1], 3), (1, 3))
        start, target, spin = (np.broadcast_to(value, shape).copy() for value in (start, target, spin))
        if bounces < 0 or int(bounces) != bounces:
            raise InputError("aim", f"{bounces} bounces", "a whole number, 0 or more")
        if not (np.isfinite(start).all() and np.isfinite(target).all() and np.isfinite(spin).all()):
            raise InputError("aim", "a position or spin that is NaN or infinite", "finite numbers")
        if not (np.isfinite(timed).all() and (timed > 0.0).all()):
            raise InputError("aim", f"{np.min(timed):g} s of flight", "a time of more than 0 s")
        for place in (start, target):
            place[:, 2] = np.maximum(place[:, 2], ground + ball.radius)
        return cls(start=start, target=target, spin=spin, seconds=np.broadcast_to(timed, shape[:1]).copy(), ball=ball,
                   bounces=int(bounces), ground=ground)

    def with_seconds(self, seconds: np.ndarray) -> AimProblem:
        """Return the same problem with other seconds (B,) of flight."""
        return replace(self, seconds=seconds)

    def select_rows(self, rows: np.ndarray) -> AimProblem:
        """Select some of the targets; an index may occur more than once."""
        return replace(self, start=self.start[rows], target=self.target[rows], spin=self.spin[rows],
                       seconds=self.seconds[rows])

    def simulate_arrival(self, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate the balls to their time.

        More than the requested bounces are not simulated, and a bounce within REBOUND_MARGIN does not count. A ball on
        the ground cannot be struck into it: -1 bounces.

        Args:
            velocity: (B, 3) m/s, launch velocities.
        Returns:
            Positions (B, 3) m and bounces (B,).
        """
        balls = batch.build_balls(self.start, velocity, self.spin, self.ball, self.ground)
        balls = batch.simulate_balls(balls, self.ball, self.seconds, self.ground, self.bounces)
        low, rising = self.ground + self.ball.radius, balls.velocity[:, 2]
        just = (balls.bounces > 0) & (rising > 0.0) & (balls.position[:, 2] - low < REBOUND_MARGIN * rising)
        lies = self.start[:, 2] < low + 1e-3
        return balls.position, np.where(lies & (velocity[:, 2] < 0.0), -1, balls.bounces - just)


@dataclass(frozen=True, eq=False, kw_only=True)
class AimResult:
    """Launches for B targets.

    Attributes:
        velocity: (B, 3) m/s at the launch, world frame; where not possible, the best that was found.
        spin: (B, 3) rad/s, as given.
        seconds: (B,) s until each ball is at its target.
        miss: (B,) m between ball and target at that time.
        possible: (B,) bool, the target is hit within the allowed speed.
    """

    velocity: np.ndarray
    spin: np.ndarray
    seconds: np.ndarray
    miss: np.ndarray
    possible: np.ndarray


def build_reach_error(start: np.ndarray, target: np.ndarray, result: AimResult, index: int, fastest: float,
                      subject: str) -> InputError:
    """Build the error that explains why a launch is not possible: distance, required speed and human limit.

    Args:
        start: (3,) or (B, 3) m, the launch positions.
        target: (3,) or (B, 3) m.
        result: the launches that were found.
        index: which of the B launches.
        fastest: m/s, the highest allowed speed.
        subject: the player or pass the message names.
    Returns:
        The error, to be raised by the caller.
    """
    start, target = np.atleast_2d(start), np.atleast_2d(target)
    far = np.linalg.norm(target[min(index, len(target) - 1)] - start[min(index, len(start) - 1)])
    speed = float(vector_length(result.velocity[index]))
    found = f"the target is {far:.1f} m away and has to be reached in {result.seconds[index]:.2f} s"
    if result.miss[index] > HIT_TOLERANCE:
        return InputError(subject, f"{found}: no launch reaches it with this number of bounces", "",
                          "allow more time, change the number of bounces, or move the target")
    expected = f"at most {fastest:.0f} m/s, the fastest a person can launch the ball"
    return InputError(subject, f"{found}: that takes {speed:.0f} m/s", expected, "allow more time or move the target")
