"""One ball's whole way from a launch until it rests: flight, bounces, sliding, rolling (Ball handling §4 eq. 3 to 6),
and where it meets a wall (Fredriksson §8.2's impact points) or the plane of its target.

The pieces between bounces are integrated by scipy's DOP853 with the bounce as an event (eq. 4), the bounce itself is an
impulse (eq. 5). A ball that would rise less than a few millimetres again stays on the ground, so that its bounces end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..motion import quaternion
from .physics import Ball, bounced, gripped, in_air, length, rolling_spin, sliding, slip, slowing

LEAST_HOP = 0.12
"""m/s: a ball that leaves the ground slower stays on it; it would have risen 0.7 mm."""
STANDS_STILL = 1e-6
"""m/s of the lowest point below which a ball rolls."""
FINE = 1.0 / 480.0
"""s: the steps in which rotations are summed up."""
_IMPACT_STEP = 1.0 / 480.0  # s between the places that are looked at first

_LONGEST_TO_WALL = 6.0  # s that a flight is followed
_WALL_STEP = 0.004  # s between the places that are looked at


@dataclass(frozen=True, eq=False)
class Launch:
    """How a ball leaves: time s, position (3,) m of its centre, velocity (3,) m/s, spin (3,) rad/s."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch of the way: kind "air", "slide", "roll" or "rest"; first and last, s; state(times (N,)) -> (N, 9),
    position, velocity and spin."""

    kind: str
    first: float
    last: float
    state: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False, kw_only=True)
class Flight:
    """The way of a ball. Before its launch it lies at the start, after `end` it stays where it is then.

    pieces in order of time. bounces (K,) s: when it met the ground and left it again. rolls_from, rests_from: s, None
    where it never does. end: s, up to when it was followed. launch, ball: what was asked."""

    launch: Launch
    ball: Ball
    pieces: tuple[Piece, ...]
    bounces: np.ndarray
    rolls_from: float | None
    rests_from: float | None
    end: float

    def at(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Positions (N, 3) m of the ball's centre at `times` (N,) s."""
        return self.states(times)[:, :3]

    def velocity(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Velocities (N, 3) m/s at `times` (N,) s; at a bounce the one after it."""
        return self.states(times)[:, 3:6]

    def spin(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Spins (N, 3) rad/s about the world's axes at `times` (N,) s."""
        return self.states(times)[:, 6:]

    def states(self, times: np.typing.ArrayLike) -> np.ndarray:
        """Position, velocity and spin (N, 9) at `times` (N,) s."""
        times = np.clip(np.asarray(times, float), self.launch.time, self.end)
        which = np.searchsorted([piece.first for piece in self.pieces], times, side="right") - 1
        out = np.empty((len(times), 9))
        for i in np.unique(which):
            out[which == i] = self.pieces[i].state(times[which == i])
        return out

    def rotations(self, times: np.ndarray) -> np.ndarray:
        """Rotations (N, 4) of the ball's body at `times` (N,) s, in any order; unturned at the launch,
        sign-continuous."""
        times = np.clip(np.asarray(times, float), self.launch.time, self.end)
        steps = np.arange(self.launch.time, self.end, FINE)
        knots = np.unique(np.concatenate([steps, [piece.first for piece in self.pieces], times]))
        spins = self.spin(0.5 * (knots[1:] + knots[:-1]))
        turns = quaternion.from_rotation_vector(spins * np.diff(knots)[:, None])
        turned = np.concatenate([quaternion.identity(1), _one_after_another(turns)])
        return quaternion.continuous(quaternion.normalized(turned[np.searchsorted(knots, times)]))


def fly(launch: Launch, ball: Ball, seconds: float, ground: float = 0.0, landing: bool = False) -> Flight:
    """The way of a ball for `seconds` after its launch over level ground at height `ground` m (eq. 6).

    landing: it ends where the ball first comes down, where that is before. A ball launched lower than it can lie is set
    onto the ground. InputError: seconds that are no time."""
    if not 0.0 <= seconds < np.inf:
        raise InputError("flight", f"{seconds} seconds", "a time of 0 s or more")
    flight = _Integrator(launch, ball, launch.time + max(float(seconds), 1e-9), ground + ball.radius)
    return flight.whole(landing)


class _Integrator:
    """Piece after piece until the end; `low`: height of the centre of a ball that lies on the ground."""

    def __init__(self, launch: Launch, ball: Ball, end: float, low: float):
        self.launch, self.ball, self.end, self.low = launch, ball, end, low
        self.time = float(launch.time)
        self.position = np.array(launch.position, float)
        self.position[2] = max(self.position[2], low)
        self.velocity, self.spin = np.array(launch.velocity, float), np.array(launch.spin, float)
        self.pieces: list[Piece] = []
        self.bounces: list[float] = []
        self.rolls_from: float | None = None
        self.rests_from: float | None = None

    def whole(self, landing: bool) -> Flight:
        if self.position[2] <= self.low and self.velocity[2] <= LEAST_HOP:
            self._meet_ground()
        while self._flies() and self._left():
            self._air()
            if landing and self._left():
                self.end = self.time
        if self._left():
            self._slide()
        if self._left():
            self._roll()
        if self._left() or not self.pieces:
            self._rest()
        return Flight(launch=self.launch, ball=self.ball, pieces=tuple(self.pieces), bounces=np.array(self.bounces),
                      rolls_from=self.rolls_from, rests_from=self.rests_from, end=self.end)

    def _left(self) -> bool:
        return self.time < self.end

    def _flies(self) -> bool:
        return self.position[2] > self.low or self.velocity[2] > 0.0

    def _air(self) -> None:
        """A flight up to its bounce or the end."""
        def change(_, state):
            faster = in_air(state[3:6], state[6:], self.ball)
            return np.concatenate([state[3:6], faster, -self.ball.spin_decay * state[6:]])

        def lands(_, state):  # a ball that rises has not landed, though it may still touch the ground from before
            return state[2] - self.low + (state[5] > 0.0)

        self._integrate("air", change, lands)
        if self._left():
            self.position[2] = self.low
            self._meet_ground()

    def _meet_ground(self) -> None:
        """The bounce; too low a hop is none."""
        self.velocity, self.spin = bounced(self.velocity, self.spin, self.ball)
        if self.velocity[2] > LEAST_HOP:
            self.bounces.append(self.time)
        else:
            self.velocity[2] = 0.0

    def _slide(self) -> None:
        """Over the ground until the lowest point stands still."""
        self.rolls_from = self.time
        over = slip(self.velocity, self.spin, self.ball)
        if self.ball.friction and length(over) > STANDS_STILL:
            def change(_, state):
                faster, turning = sliding(state[3:6], state[6:], self.ball, over)
                return np.concatenate([state[3:6], faster, turning])

            def stands(_, state):
                return slip(state[3:6], state[6:], self.ball) @ over

            self._integrate("slide", change, stands)
        if self._left():
            self.velocity, self.spin = gripped(self.velocity, self.spin, self.ball)

    def _roll(self) -> None:
        """Straight on, slower and slower; a ball without friction keeps its spin meanwhile."""
        self.rolls_from = self.time
        speed = length(self.velocity)
        if speed < STANDS_STILL:
            return
        along, spin = self.velocity / speed, self.spin
        about_up = np.array([0.0, 0.0, spin[2]])
        if self.ball.friction:
            spin = about_up

        def change(_, state):
            return np.concatenate([state[3:6], -along * slowing(state[3:6] @ along, self.ball),
                                   -self.ball.spin_decay * state[6:]])

        def stands(_, state):
            return state[3:6] @ along

        self.spin = spin
        self._integrate("roll", change, stands)
        if self.ball.friction:
            free = self.pieces[-1].state

            def state(times):
                out = free(times)
                out[:, 6:] += rolling_spin(out[:, 3:6], self.ball)
                return out

            self.pieces[-1] = Piece("roll", self.pieces[-1].first, self.pieces[-1].last, state)
        if self._left():
            self.velocity = np.zeros(3)

    def _rest(self) -> None:
        """It lies; what spin it has left, the ground brakes."""
        self.rests_from = first = self.time
        position, spin = self.position.copy(), self.spin.copy()
        size, brake = float(length(spin)), self.ball.rolling / self.ball.radius

        def state(times):
            out = np.zeros((len(times), 9))
            out[:, :3] = position
            out[:, 6:] = spin * (np.maximum(size - brake * (times - first), 0.0) / max(size, 1e-12))[:, None]
            return out

        self._keep("rest", self.end, state)

    def _integrate(self, kind: str, change, event) -> None:
        """One piece by the solver, until the event or the end; the state is then the one at its last moment."""
        from scipy.integrate import solve_ivp

        event.terminal, event.direction = True, -1
        start = np.concatenate([self.position, self.velocity, self.spin])
        found = solve_ivp(change, (self.time, self.end), start, method="DOP853", rtol=1e-9, atol=1e-10, events=event,
                          dense_output=True)
        solution, last = found.sol, float(found.t[-1])
        self._keep(kind, last, lambda times: solution(times).T)
        final = found.y[:, -1]
        self.position, self.velocity, self.spin = final[:3].copy(), final[3:6].copy(), final[6:].copy()

    def _keep(self, kind: str, last: float, state) -> None:
        self.pieces.append(Piece(kind, self.time, last, state))
        self.time = last if last < self.end else self.end


def _one_after_another(turns: np.ndarray) -> np.ndarray:
    """(N, 4): each of the turns (N, 4) after all before it, in log N passes."""
    out, shift = turns.copy(), 1
    while shift < len(out):
        out[shift:] = quaternion.multiply(out[shift:], out[:-shift])
        shift *= 2
    return out


def find_crossing(flight: Flight, target: np.ndarray) -> np.ndarray:
    """(3,) m: the ball's centre where it first meets the upright plane through `target` (3,) m that is square to the
    line from its launch, or the ground before that; NaN where it does neither by the flight's end."""
    start = np.asarray(flight.launch.position, float)
    level = (np.asarray(target, float) - start) * [1.0, 1.0, 0.0]
    far = float(np.linalg.norm(level))
    level /= max(far, 1e-9)
    last = min([flight.end, *flight.bounces[:1], *([flight.rolls_from] if flight.rolls_from is not None else [])])
    if last <= flight.launch.time:  # it leaves along the ground
        last = flight.end
    times = np.append(np.arange(flight.launch.time, last, _IMPACT_STEP), last)
    gone = (flight.at(times) - start) @ level
    beyond = np.flatnonzero(gone >= far)
    if not len(beyond):
        return flight.at([last])[0] if last < flight.end else np.full(3, np.nan)
    low, high = times[max(beyond[0] - 1, 0)], times[beyond[0]]
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (flight.at([middle])[0] - start) @ level >= far else (middle, high)
    return flight.at([high])[0]


def meet_wall(position: np.ndarray, velocity: np.ndarray, ball: Ball, foot: np.ndarray, ahead: np.ndarray,
               spin: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> tuple[np.ndarray, float]:
    """Place (3,) m of the ball's centre at the wall and seconds after its launch; at its first touch of the ground
    where that comes first, and where it is after 6 s or four times what it would take without air where neither does.

    position (3,) m, velocity (3,) m/s, spin (3,) rad/s: the launch. foot (2,) m: a point of the wall on the ground,
    ahead (2,): from where it is thrown towards it, the wall's normal."""
    unhindered = np.hypot(*(foot - position[:2])) / max(np.hypot(*velocity[:2]), 1e-9)
    free = position[2] > ball.radius or velocity[2] > LEAST_HOP  # else it bounces as it is launched
    flight = fly(Launch(0.0, position, velocity, spin), ball, min(_LONGEST_TO_WALL, 0.5 + 4.0 * unhindered),
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
