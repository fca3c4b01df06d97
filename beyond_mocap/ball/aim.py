"""The launch that arrives: a ball that leaves here is there at that time, after so many bounces (Ball handling §4 eq.
7, 8).

The ball's place at the wanted time is a smooth function of its launch velocity as long as the number of bounces stays.
A first guess comes from a ball that only linear drag slows, whose heights have a closed form; from there a damped
Newton iteration (eq. 7: differences of three launches beside it; eq. 8: as much of the step as helps) goes on with the
ball's own physics, for all aims at once. Where height and time leave several launches, the one that goes up and bounces
late is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..base.errors import InputError
from ..base.vectors import arctan2
from . import batch
from .physics import Ball, length

CLOSE = 0.01
"""m: what passes as a hit."""
NEARLY = 1e-3
"""m from the target beyond which a better launch is looked for."""
EXACT = 1e-4
"""m from the target at which the iteration ends."""
ROUNDS = 14
LONGEST_STEP = 15.0
"""m/s that one step may change a launch."""
HEIGHTS = 20
"""Launch speeds upward that are looked at for a first guess."""
TIMES = np.geomspace(0.1, 6.0, 40)
"""s that are looked at where the time is free."""
FASTEST_TRIED = 200.0
"""m/s beyond which no launch is begun with."""
ELSE = (1.06, 0.94, 1.15, 0.85)
"""Of the time with the slowest launch, where the ball's own physics does not allow that one: it lies at the edge of
what can be, where a rebound just reaches the target's height."""
JUST_NOW = 5e-3
"""s that the last bounce lies back at least: a ball on the ground at its target would do by its first touch of it."""
NUDGE = 1e-3
"""m/s by which a launch is varied to see where that takes it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Aimed:
    """How balls (B) have to leave: velocity (B, 3) m/s, spin (B, 3) rad/s as given, seconds (B,) until each is there,
    miss (B,) m that it passes its target by then, possible (B,) bool: hit, within the speeds allowed. Where not,
    velocity is the best that was found."""

    velocity: np.ndarray
    spin: np.ndarray
    seconds: np.ndarray
    miss: np.ndarray
    possible: np.ndarray


def aim(start: np.ndarray, target: np.ndarray, ball: Ball, seconds: np.ndarray | None = None, bounces: int = 0,
        spin: np.ndarray | None = None, fastest: float | None = None, near: np.ndarray | None = None,
        ground: float = 0.0, loft: float | None = None, about: np.ndarray | None = None) -> Aimed:
    """Launches from `start` (B, 3) m so that after exactly `bounces` bounces the ball's centre is at `target` (B, 3) m.

    seconds (B,) after the launch; a number: all alike; None: the time with the slowest launch, or the one that leaves
    nearest to `loft` rad over the horizon. spin (B, 3) rad/s, None: none. fastest m/s: launches beyond are not
    possible. near (B, 3) m/s: a launch close to the one wanted (the last one, while a target is dragged); rows of it
    that are not finite are not used. about (B,) s: where the time is free, it is looked for near to these. Any of
    start, target, spin may be (3,): the same for all. Starts and targets lower than a ball can lie are set onto the
    ground. InputError: numbers that cannot be meant."""
    problem = _Problem.of(start, target, ball, seconds=seconds, bounces=bounces, spin=spin, ground=ground)
    if seconds is None:
        problem = problem.at_time(_chosen_times(problem, loft, about))
    velocity, miss = _solved(problem, near)
    for share in ELSE if seconds is None else ():
        far = np.flatnonzero(~(miss <= CLOSE))
        if not len(far):
            break
        part = problem.only(far).at_time(problem.seconds[far] * share)
        second, rest = _solved(part, None)
        hit = rest <= CLOSE
        velocity[far[hit]], miss[far[hit]] = second[hit], rest[hit]
        problem.seconds[far[hit]] = part.seconds[hit]
    possible = miss <= CLOSE
    if fastest is not None:
        possible &= length(velocity) <= fastest
    return Aimed(velocity=velocity, spin=problem.spin, seconds=problem.seconds, miss=miss, possible=possible)


def along_ground(start: np.ndarray, target: np.ndarray, ball: Ball, seconds: np.ndarray | None = None,
                 arrives: float = 2.0, fastest: float | None = None, ground: float = 0.0) -> Aimed:
    """Level launches from `start` (B, 3) m for balls that slide and roll to where `target` (B, 3) m lies on the ground.

    seconds (B,) or a number; None: so that they still have `arrives` m/s there. A start over the ground is set onto it.
    InputError as `aim`."""
    problem = _Problem.of(start, target, ball, seconds=seconds, bounces=0, spin=None, ground=ground)
    low = ground + ball.radius
    problem.start[:, 2], problem.target[:, 2] = low, low
    way = problem.target - problem.start
    distance = length(way)
    along = way / np.maximum(distance, 1e-9)[:, None]
    if seconds is None:
        problem = problem.at_time(_ground_times(ball, distance, arrives))
    speed = _ground_speeds(problem, distance)
    velocity = along * speed[:, None]
    miss = length(problem.arrived(velocity)[0] - problem.target)
    possible = miss <= CLOSE
    if fastest is not None:
        possible &= speed <= fastest
    return Aimed(velocity=velocity, spin=problem.spin, seconds=problem.seconds, miss=miss, possible=possible)


def out_of_reach(start: np.ndarray, target: np.ndarray, aimed: Aimed, index: int, fastest: float,
                 what: str) -> InputError:
    """The error that says why aim `index` cannot be: how far it is, how fast the ball would have to leave, and what a
    human gives. what: who or which pass is meant."""
    start, target = np.atleast_2d(start), np.atleast_2d(target)
    far = np.linalg.norm(target[min(index, len(target) - 1)] - start[min(index, len(start) - 1)])
    speed = float(length(aimed.velocity[index]))
    found = f"the target is {far:.1f} m away, to be reached in {aimed.seconds[index]:.2f} s"
    if aimed.miss[index] > CLOSE:
        return InputError(what, f"{found}: no launch does that with this number of bounces", "",
                          "give it more time, another number of bounces, or a nearer target")
    expected = f"at most {fastest:.0f} m/s, which is what a human gives it"
    return InputError(what, f"{found}: that takes {speed:.0f} m/s", expected, "give it more time or a nearer target")


@np.errstate(over="ignore", invalid="ignore")  # launches that are tried and lead nowhere
def _solved(problem: _Problem, near: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Launch velocities (B, 3) and misses (B,): from the launches nearby, then from first guesses, then from a search,
    each only for those that still miss."""
    count = len(problem.start)
    velocity = np.full((count, 3), np.nan) if near is None else np.broadcast_to(near, (count, 3)).astype(float)
    miss = np.full(count, np.inf)
    known = np.flatnonzero(np.isfinite(velocity).all(axis=1))
    if len(known):
        velocity[known], miss[known] = _newton(problem.only(known), velocity[known])
    for guessed in (lambda part: part.guessed()[0], _Problem.searched):
        far = np.flatnonzero(~(miss <= NEARLY))
        if not len(far):
            break
        part = problem.only(far)
        second, rest = _newton(part, guessed(part))
        better = (rest < miss[far]) | ~np.isfinite(velocity[far]).all(axis=1)
        velocity[far[better]], miss[far[better]] = second[better], rest[better]
    return velocity, miss


@dataclass(frozen=True, eq=False, kw_only=True)
class _Problem:
    """Aims (B): start, target, spin (B, 3), seconds (B,), and what they have in common."""

    start: np.ndarray
    target: np.ndarray
    spin: np.ndarray
    seconds: np.ndarray
    ball: Ball
    bounces: int
    ground: float

    @classmethod
    def of(cls, start, target, ball, seconds, bounces, spin, ground) -> _Problem:
        start, target = np.asarray(start, float), np.asarray(target, float)
        spin = np.zeros(3) if spin is None else np.asarray(spin, float)
        timed = np.ones(1) if seconds is None else np.asarray(seconds, float)
        shape = np.broadcast_shapes(start.shape, target.shape, spin.shape, (*timed.reshape(-1, 1).shape[:1], 3), (1, 3))
        start, target, spin = (np.broadcast_to(value, shape).copy() for value in (start, target, spin))
        if bounces < 0 or int(bounces) != bounces:
            raise InputError("aim", f"{bounces} bounces", "a whole number, 0 or more")
        if not (np.isfinite(start).all() and np.isfinite(target).all() and np.isfinite(spin).all()):
            raise InputError("aim", "a place or spin that is not a number")
        if not (np.isfinite(timed).all() and (timed > 0.0).all()):
            raise InputError("aim", f"{np.min(timed):g} s of flight", "a time of more than 0 s")
        for place in (start, target):
            place[:, 2] = np.maximum(place[:, 2], ground + ball.radius)
        return cls(start=start, target=target, spin=spin, seconds=np.broadcast_to(timed, shape[:1]).copy(), ball=ball,
                   bounces=int(bounces), ground=ground)

    def at_time(self, seconds: np.ndarray) -> _Problem:
        return replace(self, seconds=seconds)

    def only(self, which: np.ndarray) -> _Problem:
        """Some of the aims; an index may come again."""
        return replace(self, start=self.start[which], target=self.target[which], spin=self.spin[which],
                       seconds=self.seconds[which])

    def arrived(self, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the balls (B, 3) m are in time, and after how many bounces (B,); more bounces than asked for are not
        made, and one of this moment does not count. A ball that lies on the ground is not struck into it: -1
        bounces."""
        balls = batch.launched(self.start, velocity, self.spin, self.ball, self.ground)
        balls = batch.after(balls, self.ball, self.seconds, self.ground, self.bounces)
        low, rising = self.ground + self.ball.radius, balls.velocity[:, 2]
        just = (balls.bounces > 0) & (rising > 0.0) & (balls.position[:, 2] - low < JUST_NOW * rising)
        lies = self.start[:, 2] < low + 1e-3
        return balls.position, np.where(lies & (velocity[:, 2] < 0.0), -1, balls.bounces - just)

    def guessed(self) -> tuple[np.ndarray, np.ndarray]:
        """Launch velocities (B, 3) of balls that linear drag as strong as theirs slows; exact for such balls. And (B,)
        bool: whether there is one that is at the target's height in time."""
        way = self.target - self.start
        drag = self.ball.linear_drag + self.ball.drag * length(way) / self.seconds
        level = way[:, :2] / (batch.drag_shares(drag * self.seconds)[0] * self.seconds)[:, None]
        upward, found = self._upward(drag)
        return np.column_stack([level, upward]), found

    def _upward(self, drag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(B,) m/s: the highest launch upward with which such a ball is at the target's height in time, and (B,) bool
        whether there is one; else the nearest to it."""
        gravity, low = self.ball.gravity, self.ground + self.ball.radius
        first, second = batch.drag_shares(drag * self.seconds)
        direct = (self.target[:, 2] - self.start[:, 2] + gravity * self.seconds**2 * second) / (self.seconds * first)
        if not self.bounces:
            return direct, np.ones(len(direct), bool)
        top = gravity * self.seconds * second / first + 0.5  # as high as it may go up and still be down in time
        tried = top[:, None] - (top[:, None] + 40.0) * np.linspace(0.0, 1.0, HEIGHTS) ** 2

        def over(upward):
            args = (self.start[:, None, 2] - low, upward, drag[:, None], self.seconds[:, None])
            return _height_after(*args, self.bounces, self.ball) - (self.target[:, None, 2] - low)

        return _highest_root(over, tried)

    def searched(self) -> np.ndarray:
        """Launch velocities (B, 3) found with the ball's own physics: of a row of launches upward, each brought to the
        target's distance, the one that comes nearest to its height; slower, for where the first guess leads nowhere."""
        count = len(self.start)
        many = self.only(np.repeat(np.arange(count), HEIGHTS))
        top = self.ball.gravity * self.seconds * (0.5 + 0.1 * self.seconds) + 1.0
        upward = (top[:, None] - (top[:, None] + 40.0) * np.linspace(0.0, 1.0, HEIGHTS) ** 2).ravel()
        way = (many.target - many.start)[:, :2]
        level = way / many.seconds[:, None]
        for _ in range(3):
            place, made = many.arrived(np.column_stack([level, upward]))
            gone = np.sum((place - many.start)[:, :2] * way, axis=1) / np.maximum(np.sum(way * way, axis=1), 1e-9)
            level = level * np.clip(1.0 / np.maximum(gone, 1e-2), 0.3, 3.0)[:, None]
            level /= np.maximum(length(np.column_stack([level, 0.0 * upward])) / FASTEST_TRIED, 1.0)[:, None]
        place, made = many.arrived(np.column_stack([level, upward]))
        short = np.where(made == self.bounces, length(place - many.target), np.inf).reshape(count, HEIGHTS)
        best = np.arange(count) * HEIGHTS + np.argmin(short, axis=1)
        return np.column_stack([level, upward])[best]


def _newton(problem: _Problem, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Launch velocities (B, 3) and the distances (B,) m by which they miss; infinite where the bounces are not those
    asked.

    The slopes of eq. 7 are taken from launches beside the first one and kept up by what each step shows (Broyden's
    rule); where that no longer helps they are taken anew, and an aim that still does not come nearer is given up."""
    velocity = guess / np.maximum(length(guess) / FASTEST_TRIED, 1.0)[:, None]
    short, miss = _short(problem, velocity)
    slope = np.empty((len(guess), 3, 3))
    stale, stuck = np.ones(len(guess), bool), np.zeros(len(guess), int)
    for _ in range(ROUNDS):
        now = np.flatnonzero((miss > EXACT) & (stuck < 3))
        if not len(now):
            break
        old = now[stale[now]]
        if len(old):
            slope[old] = _slopes(problem.only(old), velocity[old], problem.target[old] - short[old])
            stale[old] = False
        step = _step(slope[now], short[now]) * np.array([1.0, 0.3, 0.1])[stuck[now]][:, None]
        step /= np.maximum(length(step) / LONGEST_STEP, 1.0)[:, None]
        new_short, new_miss = _short(problem.only(now), velocity[now] + step)
        slope[now] += _learnt(slope[now], step, short[now] - new_short)
        lost = np.isinf(miss[now])
        better = np.where(lost, ~np.isinf(new_miss) | (length(new_short) < length(short[now])), new_miss < miss[now])
        stale[now] = ~better | (new_miss > 0.3 * miss[now])
        stuck[now] = np.where(better & (lost | (new_miss < 0.9 * miss[now])), 0, stuck[now] + 1)
        won = now[better]
        velocity[won] += step[better]
        short[won], miss[won] = new_short[better], new_miss[better]
    return velocity, miss


def _short(problem: _Problem, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What is missing to the targets (B, 3) m, and how much that is (B,), infinite where a bounce is lacking."""
    place, made = problem.arrived(velocity)
    short = problem.target - place
    return short, np.where(made == problem.bounces, length(short), np.inf)


def _slopes(problem: _Problem, velocity: np.ndarray, place: np.ndarray) -> np.ndarray:
    """(B, 3, 3) s: how the places (B, 3) where the launches (B, 3) lead move with them."""
    count = len(velocity)
    nudged = (velocity[:, None] + NUDGE * np.eye(3)).reshape(-1, 3)
    beside, _ = problem.only(np.repeat(np.arange(count), 3)).arrived(nudged)
    return np.swapaxes(beside.reshape(count, 3, 3) - place[:, None], 1, 2) / NUDGE


def _step(slope: np.ndarray, short: np.ndarray) -> np.ndarray:
    """(B, 3) m/s that slopes (B, 3, 3) ask for to make up for `short` (B, 3), damped a little."""
    turned = np.swapaxes(slope, 1, 2)
    square = turned @ slope + 1e-9 * np.eye(3)
    with np.errstate(invalid="ignore"):  # launches that lead nowhere have infinite slopes
        can = np.isfinite(square).all(axis=(1, 2)) & (np.linalg.det(square) != 0.0)
    return np.linalg.solve(np.where(can[:, None, None], square, np.eye(3)), turned @ short[:, :, None])[:, :, 0]


def _learnt(slope: np.ndarray, step: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Broyden's correction (B, 3, 3) of slopes with which a step (B, 3) should have moved the ball as it did, by (B,
    3)."""
    wrong = moved - np.einsum("bij,bj->bi", slope, step)
    return wrong[:, :, None] * step[:, None] / np.maximum(np.sum(step * step, axis=1), 1e-12)[:, None, None]


def _chosen_times(problem: _Problem, loft: float | None, about: np.ndarray | None) -> np.ndarray:
    """(B,) s: of TIMES (or from `about` on), and then of times beside it, the one with the slowest launch, or the
    launch nearest to `loft` rad, as the first guesses have it."""
    coarse = about if about is not None else _best_time(problem, np.tile(TIMES, (len(problem.start), 1)), loft)
    return _best_time(problem, coarse[:, None] * np.linspace(0.9, 1.1, 11), loft)


def _best_time(problem: _Problem, times: np.ndarray, loft: float | None) -> np.ndarray:
    """(B,) s: of each row of `times` (B, N) the best one."""
    count, each = times.shape
    launch, found = problem.only(np.repeat(np.arange(count), each)).at_time(times.ravel()).guessed()
    worth = length(launch)
    if loft is not None:
        worth = np.abs(arctan2(launch[:, 2], length(launch * [1.0, 1.0, 0.0])) - loft)
    best = np.argmin(np.where(found, worth, worth + 1e6).reshape(count, each), axis=1)
    return times[np.arange(count), best]


def _height_after(height, upward, drag, seconds, bounces: int, ball: Ball) -> np.ndarray:
    """Heights m over a ball that lies on the ground, of balls under linear drag after `bounces` bounces; NaN where they
    have not made them by then. All arguments broadcast."""
    height, upward, drag, left = (value.copy() for value in np.broadcast_arrays(height, upward, drag, seconds))
    for _ in range(bounces):
        fall = (upward + np.sqrt(upward**2 + 2.0 * ball.gravity * height)) / ball.gravity
        for _ in range(4):
            place, rise = _fallen(height, upward, drag, fall, ball.gravity)
            fall = np.maximum(fall - place / np.minimum(rise, -1e-6), 1e-9)
        left = left - fall
        upward = -ball.restitution * _fallen(height, upward, drag, fall, ball.gravity)[1]
        height = np.zeros_like(height)
    return np.where(left >= 0.0, _fallen(height, upward, drag, np.maximum(left, 0.0), ball.gravity)[0], np.nan)


def _fallen(height, upward, drag, seconds, gravity: float) -> tuple[np.ndarray, np.ndarray]:
    """Height and speed upward after `seconds` under linear drag."""
    first, second = batch.drag_shares(drag * seconds)
    place = height + upward * seconds * first - gravity * seconds**2 * second
    return place, upward * np.exp(-drag * seconds) - gravity * seconds * first


def _highest_root(value, tried: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(B,) of each row of `tried` (B, N), falling, the first place where `value` of it changes sign, found by halving;
    where it never does, the one that comes nearest to zero. And (B,) bool: whether it does."""
    rows, values = np.arange(len(tried)), value(tried)
    changes = values[:, 1:] * values[:, :-1] <= 0.0
    first, found = np.argmax(changes, axis=1), changes.any(axis=1)
    out = tried[rows, np.argmin(np.where(np.isnan(values), np.inf, np.abs(values)), axis=1)]
    high, low = tried[rows, first], tried[rows, first + 1]
    sign = np.sign(values[rows, first])
    for _ in range(24):
        middle = 0.5 * (high + low)
        same = np.sign(value(middle[:, None])[:, 0]) == sign
        high, low = np.where(same, middle, high), np.where(same, low, middle)
    return np.where(found, 0.5 * (high + low), out), found


def _ground_speeds(problem: _Problem, distance: np.ndarray) -> np.ndarray:
    """(B,) m/s of a level launch with which the ball has gone `distance` (B,) m in time."""
    low, high = np.zeros(len(distance)), np.full(len(distance), 120.0)
    for _ in range(24):
        speed = 0.5 * (low + high)
        level = speed[:, None] * [1.0, 0.0, 0.0]
        place, _ = batch.states([0.0, 0.0, problem.ball.radius], level, None, problem.ball, problem.seconds)
        low, high = np.where(place[:, 0] < distance, speed, low), np.where(place[:, 0] < distance, high, speed)
    return high


def _ground_times(ball: Ball, distance: np.ndarray, arrives: float) -> np.ndarray:
    """(B,) s until a ball on the ground that still has some `arrives` m/s at `distance` (B,) m is there."""
    times, gone, left = _ground_table(ball)
    out = np.empty(len(distance))
    for i, far in enumerate(distance):
        there = [np.interp(far, row, times, right=np.inf) for row in gone]
        still = [np.interp(time, times, row) if np.isfinite(time) else -1.0 for time, row in zip(there, left)]
        fast = int(np.argmax(np.array(still) >= arrives))  # the slowest launch with enough left
        share = np.clip((arrives - still[fast - 1]) / (still[fast] - still[fast - 1]), 0.0, 1.0) if fast else 1.0
        before = there[fast - 1] if fast and np.isfinite(there[fast - 1]) else there[fast]
        out[i] = before + share * (there[fast] - before)
    return np.where(np.isfinite(out), out, times[-1])


@lru_cache(maxsize=16)
def _ground_table(ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (T,) s, and metres gone and m/s left (S, T) of level launches with ever higher speed."""
    times, speeds = np.linspace(0.0, 10.0, 41), np.geomspace(0.3, 60.0, 28)
    gone, left = batch.courses([0.0, 0.0, ball.radius], speeds[:, None] * [1.0, 0.0, 0.0], None, ball, times)
    return times, gone[:, :, 0], left[:, :, 0]
