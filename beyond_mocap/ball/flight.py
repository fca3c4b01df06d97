"""Simulate one ball from its launch until it rests: flight, bounces, sliding and rolling; find where it meets a wall or
the plane of its target.

Between bounces, scipy's DOP853 integrates the flight with the bounce as an event (eq. 4); the bounce is an impulse
(eq. 5). A ball that would rise less than a few millimetres stays on the ground, so that the bounces end.

Source: Ball handling, section 4, equations 3 to 6; impact points: Fredriksson, section 8.2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..motion import quaternion
from .physics import (
    Ball,
    compute_air_acceleration,
    compute_bounce,
    compute_deceleration,
    compute_grip,
    compute_rolling_spin,
    compute_sliding,
    compute_slip,
    vector_length,
)

MIN_HOP_SPEED = 0.12
"""m/s: a ball that leaves the ground more slowly stays on it; it would rise 0.7 mm."""
MIN_SLIP_SPEED = 1e-6
"""m/s: below this velocity of its lowest point a ball rolls."""
ROTATION_STEP = 1.0 / 480.0
"""s: the step in which rotations are accumulated."""
_IMPACT_STEP = 1.0 / 480.0  # s between the positions tested before the bisection

_LONGEST_TO_WALL = 6.0  # s: the longest flight to a wall that is simulated
_WALL_STEP = 0.004  # s between the tested positions


@dataclass(frozen=True, eq=False)
class Launch:
    """The state of a ball at its launch.

    Attributes:
        time: s.
        position: (3,) m of its centre, world frame.
        velocity: (3,) m/s.
        spin: (3,) rad/s about the world's axes.
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class FlightPiece:
    """A part of a flight.

    Attributes:
        kind: "air", "slide", "roll" or "rest".
        first: s, its start.
        last: s, its end.
        state: function of times (N,) s that gives position, velocity and spin (N, 9).
    """

    kind: str
    first: float
    last: float
    state: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False, kw_only=True)
class Flight:
    """The trajectory of a ball. Before its launch it is at the start; after `end` it stays where it is then.

    Attributes:
        launch: the requested launch.
        ball: the ball's physics.
        pieces: in order of time.
        bounces: (K,) s, when it hit the ground and left it again.
        rolls_from: s, None if it never rolls.
        rests_from: s, None if it never rests.
        end: s, up to when it was simulated.
    """

    launch: Launch
    ball: Ball
    pieces: tuple[FlightPiece, ...]
    bounces: np.ndarray
    rolls_from: float | None
    rests_from: float | None
    end: float

    def at(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Give the positions (N, 3) m of the ball's centre at `times` (N,) s, world frame."""
        return self.states(times)[:, :3]

    def velocity(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Give the velocities (N, 3) m/s at `times` (N,) s; at a bounce, the one after it."""
        return self.states(times)[:, 3:6]

    def spin(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Give the spins (N, 3) rad/s about the world's axes at `times` (N,) s."""
        return self.states(times)[:, 6:]

    def states(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Give position, velocity and spin (N, 9) at `times` (N,) s."""
        times = np.clip(np.asarray(times, float), self.launch.time, self.end)
        which = np.searchsorted([piece.first for piece in self.pieces], times, side="right") - 1
        out = np.empty((len(times), 9))
        for i in np.unique(which):
            out[which == i] = self.pieces[i].state(times[which == i])
        return out

    def rotations(self, times: np.ndarray) -> np.ndarray:
        """Give the ball's rotations as quaternions (N, 4) at `times` (N,) s, in any order.

        The rotation is the identity at the launch; signs are continuous.
        """
        times = np.clip(np.asarray(times, float), self.launch.time, self.end)
        steps = np.arange(self.launch.time, self.end, ROTATION_STEP)
        knots = np.unique(np.concatenate([steps, [piece.first for piece in self.pieces], times]))
        spins = self.spin(0.5 * (knots[1:] + knots[:-1]))
        turns = quaternion.from_rotation_vector(spins * np.diff(knots)[:, None])
        accumulated = np.concatenate([quaternion.identity(1), _accumulate_rotations(turns)])
        return quaternion.unify_signs(quaternion.normalize(accumulated[np.searchsorted(knots, times)]))


def simulate_flight(launch: Launch, ball: Ball, seconds: float, ground: float = 0.0, landing: bool = False) -> Flight:
    """Simulate a ball over level ground (eq. 6).

    Args:
        launch: the launch; a ball below the height of a ball on the ground is moved onto it.
        ball: the ball's physics.
        seconds: s to simulate after the launch.
        ground: m, height of the ground.
        landing: stop where the ball first comes down, if that is earlier.
    Returns:
        The flight.
    Raises:
        InputError: if `seconds` is negative or not finite.
    """
    if not 0.0 <= seconds < np.inf:
        raise InputError("flight", f"a duration of {seconds} s", "a duration of 0 s or more")
    flight = _Integrator(launch, ball, launch.time + max(float(seconds), 1e-9), ground + ball.radius)
    return flight.integrate_flight(landing)


class _Integrator:
    """Integrate a flight piece by piece. `low`: m, height of the centre of a ball on the ground."""

    def __init__(self, launch: Launch, ball: Ball, end: float, low: float):
        self.launch, self.ball, self.end, self.low = launch, ball, end, low
        self.time = float(launch.time)
        self.position = np.array(launch.position, float)
        self.position[2] = max(self.position[2], low)
        self.velocity, self.spin = np.array(launch.velocity, float), np.array(launch.spin, float)
        self.pieces: list[FlightPiece] = []
        self.bounces: list[float] = []
        self.rolls_from: float | None = None
        self.rests_from: float | None = None

    def integrate_flight(self, landing: bool) -> Flight:
        """Integrate air, slide, roll and rest in order; with `landing`, stop at the first landing."""
        if self.position[2] <= self.low and self.velocity[2] <= MIN_HOP_SPEED:
            self._apply_bounce()
        while self._is_in_air() and self._has_time_left():
            self._integrate_air()
            if landing and self._has_time_left():
                self.end = self.time
        if self._has_time_left():
            self._integrate_slide()
        if self._has_time_left():
            self._integrate_roll()
        if self._has_time_left() or not self.pieces:
            self._add_rest()
        return Flight(launch=self.launch, ball=self.ball, pieces=tuple(self.pieces), bounces=np.array(self.bounces),
                      rolls_from=self.rolls_from, rests_from=self.rests_from, end=self.end)

    def _has_time_left(self) -> bool:
        return self.time < self.end

    def _is_in_air(self) -> bool:
        return self.position[2] > self.low or self.velocity[2] > 0.0

    def _integrate_air(self) -> None:
        """Integrate a flight up to its bounce or the end."""
        def compute_derivative(_, state):
            faster = compute_air_acceleration(state[3:6], state[6:], self.ball)
            return np.concatenate([state[3:6], faster, -self.ball.spin_decay * state[6:]])

        def measure_height(_, state):  # a rising ball has not landed, even if it still touches the ground
            return state[2] - self.low + (state[5] > 0.0)

        self._integrate_piece("air", compute_derivative, measure_height)
        if self._has_time_left():
            self.position[2] = self.low
            self._apply_bounce()

    def _apply_bounce(self) -> None:
        """Apply the bounce; too low a hop is none."""
        self.velocity, self.spin = compute_bounce(self.velocity, self.spin, self.ball)
        if self.velocity[2] > MIN_HOP_SPEED:
            self.bounces.append(self.time)
        else:
            self.velocity[2] = 0.0

    def _integrate_slide(self) -> None:
        """Integrate the slide over the ground until the lowest point has no slip."""
        self.rolls_from = self.time
        over = compute_slip(self.velocity, self.spin, self.ball)
        if self.ball.friction and vector_length(over) > MIN_SLIP_SPEED:
            def compute_derivative(_, state):
                faster, turning = compute_sliding(state[3:6], state[6:], self.ball, over)
                return np.concatenate([state[3:6], faster, turning])

            def measure_slip(_, state):
                return compute_slip(state[3:6], state[6:], self.ball) @ over

            self._integrate_piece("slide", compute_derivative, measure_slip)
        if self._has_time_left():
            self.velocity, self.spin = compute_grip(self.velocity, self.spin, self.ball)

    def _integrate_roll(self) -> None:
        """Integrate the roll: straight, with falling speed; a ball without friction keeps its spin."""
        self.rolls_from = self.time
        speed = vector_length(self.velocity)
        if speed < MIN_SLIP_SPEED:
            return
        along, spin = self.velocity / speed, self.spin
        about_up = np.array([0.0, 0.0, spin[2]])
        if self.ball.friction:
            spin = about_up

        def compute_derivative(_, state):
            return np.concatenate([state[3:6], -along * compute_deceleration(state[3:6] @ along, self.ball),
                                   -self.ball.spin_decay * state[6:]])

        def measure_speed(_, state):
            return state[3:6] @ along

        self.spin = spin
        self._integrate_piece("roll", compute_derivative, measure_speed)
        if self.ball.friction:
            free = self.pieces[-1].state

            def state(times):
                out = free(times)
                out[:, 6:] += compute_rolling_spin(out[:, 3:6], self.ball)
                return out

            self.pieces[-1] = FlightPiece("roll", self.pieces[-1].first, self.pieces[-1].last, state)
        if self._has_time_left():
            self.velocity = np.zeros(3)

    def _add_rest(self) -> None:
        """Add the piece in which the ball rests; the ground brakes the spin it has left."""
        self.rests_from = first = self.time
        position, spin = self.position.copy(), self.spin.copy()
        size, brake = float(vector_length(spin)), self.ball.rolling / self.ball.radius

        def state(times):
            out = np.zeros((len(times), 9))
            out[:, :3] = position
            out[:, 6:] = spin * (np.maximum(size - brake * (times - first), 0.0) / max(size, 1e-12))[:, None]
            return out

        self._add_piece("rest", self.end, state)

    def _integrate_piece(self, kind: str, change, event) -> None:
        """Integrate one piece until the event or the end; the state is then the one at its last moment."""
        from scipy.integrate import solve_ivp

        event.terminal, event.direction = True, -1
        start = np.concatenate([self.position, self.velocity, self.spin])
        found = solve_ivp(change, (self.time, self.end), start, method="DOP853", rtol=1e-9, atol=1e-10, events=event,
                          dense_output=True)
        solution, last = found.sol, float(found.t[-1])
        self._add_piece(kind, last, lambda times: solution(times).T)
        final = found.y[:, -1]
        self.position, self.velocity, self.spin = final[:3].copy(), final[3:6].copy(), final[6:].copy()

    def _add_piece(self, kind: str, last: float, state) -> None:
        self.pieces.append(FlightPiece(kind, self.time, last, state))
        self.time = last if last < self.end else self.end


def _accumulate_rotations(turns: np.ndarray) -> np.ndarray:
    """Accumulate the rotations (N, 4), each applied after all before it, in log N passes."""
    out, shift = turns.copy(), 1
    # A parallel prefix product: after each pass, row i holds the product of the last 2 * shift rotations up to i.
    while shift < len(out):
        out[shift:] = quaternion.multiply(out[shift:], out[:-shift])
        shift *= 2
    return out


def find_crossing(flight: Flight, target: np.ndarray) -> np.ndarray:
    """Find where the ball first meets the upright plane through the target, or the ground before that.

    The plane is perpendicular to the horizontal line from the launch to the target.

    Args:
        flight: the flight.
        target: (3,) m, world frame.
    Returns:
        (3,) m of the ball's centre; NaN if it meets neither by the end of the flight.
    """
    start = np.asarray(flight.launch.position, float)
    level = (np.asarray(target, float) - start) * [1.0, 1.0, 0.0]
    far = float(np.linalg.norm(level))
    level /= max(far, 1e-9)
    last = min([flight.end, *flight.bounces[:1], *([flight.rolls_from] if flight.rolls_from is not None else [])])
    if last <= flight.launch.time:  # launched along the ground
        last = flight.end
    times = np.append(np.arange(flight.launch.time, last, _IMPACT_STEP), last)
    distances = (flight.at(times) - start) @ level
    beyond = np.flatnonzero(distances >= far)
    if not len(beyond):
        return flight.at([last])[0] if last < flight.end else np.full(3, np.nan)
    low, high = times[max(beyond[0] - 1, 0)], times[beyond[0]]
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (flight.at([middle])[0] - start) @ level >= far else (middle, high)
    return flight.at([high])[0]


def find_wall_impact(position: np.ndarray, velocity: np.ndarray, ball: Ball, foot: np.ndarray, ahead: np.ndarray,
                     spin: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> tuple[np.ndarray, float]:
    """Find where and when a ball meets a wall, or the ground if that comes first.

    If it meets neither, the result is where it is after 6 s, or after 0.5 s plus four times its flight time without
    air.

    Args:
        position: (3,) m, the ball's centre at the launch, world frame.
        velocity: (3,) m/s at the launch.
        ball: the ball's physics.
        foot: (2,) m, a point of the wall on the ground.
        ahead: (2,) the wall's normal, away from the thrower.
        spin: (3,) rad/s at the launch.
    Returns:
        Position (3,) m of the ball's centre, and seconds after the launch.
    """
    unhindered = np.hypot(*(foot - position[:2])) / max(np.hypot(*velocity[:2]), 1e-9)
    free = position[2] > ball.radius or velocity[2] > MIN_HOP_SPEED  # otherwise it bounces at the launch
    flight = simulate_flight(Launch(0.0, position, velocity, spin), ball, min(_LONGEST_TO_WALL, 0.5 + 4.0 * unhindered),
                             landing=free)
    touches = [time for time in (*flight.bounces[:1], flight.rolls_from) if time is not None and time > _WALL_STEP]
    last = min(touches, default=flight.end)
    times = np.append(np.arange(0.0, last, _WALL_STEP), last)
    places = flight.at(times)
    beyond = (places[:, :2] - foot) @ (np.asarray(ahead, float) / np.hypot(*ahead))
    through = np.flatnonzero((beyond[:-1] < 0.0) & (beyond[1:] >= 0.0))
    if not len(through):
        return places[-1], float(last)
    i = int(through[0])
    share = -beyond[i] / (beyond[i + 1] - beyond[i])
    seconds = times[i] + share * (times[i + 1] - times[i])
    return flight.at(np.array([seconds]))[0], float(seconds)
