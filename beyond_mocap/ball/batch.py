"""Thousands of flights at once: the physics of `flight`, in steps that all balls take together.

Each ball has its own clock. A ball without spin and without quadratic drag flies from bounce to bounce in closed form
(one step a hop); others take Runge-Kutta steps of fourth order. Where a step ends below the ground it is taken again up
to the bounce, which is found to some 1e-9 s; then the ball goes on from there. `fly` is the judge: tests compare the
two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .flight import LEAST_HOP, STANDS_STILL
from .physics import Ball, bounced, gripped, in_air, length, rolling_spin, sliding, slip, slowing

STEP = 0.12
"""s: the longest step of flights that have no closed form."""
SLIDE_STEP = 0.01
"""s: the longest step of a ball that slides."""
CLOSE = 1e-6
"""m from the ground at which one more step of Newton's method is the last."""
AIR, SLIDE, ROLL, REST = range(4)


@dataclass(frozen=True, eq=False)
class Balls:
    """Many balls (B) at one moment each: position (B, 3) m, velocity (B, 3) m/s, spin (B, 3) rad/s, phase (B,) one of
    AIR, SLIDE, ROLL, REST, bounces (B,) how often each has left the ground again."""

    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    phase: np.ndarray
    bounces: np.ndarray

    def only(self, which: np.ndarray) -> Balls:
        """Those of a mask or of indices."""
        return Balls(*(value[which] for value in vars(self).values()))


def launched(position: np.typing.ArrayLike, velocity: np.ndarray, spin: np.ndarray | None, ball: Ball,
             ground: float = 0.0) -> Balls:
    """Balls (B) at their launch; the arguments (B, 3), or (3,) for all alike; spin None: none. One that lies too low is
    set onto the ground, and meets it at once where its way leads down."""
    spin = np.zeros(3) if spin is None else spin
    shape = np.broadcast_shapes(np.shape(position), np.shape(velocity), np.shape(spin), (1, 3))
    position, velocity, spin = (np.broadcast_to(value, shape).astype(float)
                                for value in (position, velocity, spin))
    low = ground + ball.radius
    position[:, 2] = np.maximum(position[:, 2], low)
    balls = Balls(position, velocity, spin, np.zeros(shape[0], int), np.zeros(shape[0], int))
    _meet_ground(balls, np.flatnonzero((position[:, 2] <= low) & (velocity[:, 2] <= LEAST_HOP)), ball)
    return balls


@np.errstate(over="ignore", invalid="ignore")  # launches that are tried may be faster than numbers go
def after(balls: Balls, ball: Ball, seconds: float | np.ndarray, ground: float = 0.0,
          most_bounces: int | None = None) -> Balls:
    """The balls `seconds` (B,) or one number later. most_bounces: then they fly on through the ground (what a solver
    wants, whose targets must move smoothly with the launch)."""
    balls = Balls(*(value.copy() for value in vars(balls).values()))
    left = np.broadcast_to(np.asarray(seconds, float), balls.phase.shape).copy()
    most = np.iinfo(int).max if most_bounces is None else most_bounces
    longest = np.inf if _has_closed_form(balls, ball) else STEP
    while len(going := np.flatnonzero((left > 0.0) & (balls.phase != REST))):
        for phase, step in ((AIR, _air), (SLIDE, _slide), (ROLL, _roll)):
            which = going[balls.phase[going] == phase]
            if len(which):
                steps = np.minimum(left[which], longest)
                left[which] -= step(balls, which, steps, ball, low=ground + ball.radius, most=most)
    return balls


def states(position: np.typing.ArrayLike, velocity: np.ndarray, spin: np.ndarray | None, ball: Ball,
           seconds: np.ndarray, ground: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Positions (B, 3) m and velocities (B, 3) m/s of balls, each `seconds` (B,) after its launch (one number: all
    alike).

    position, velocity, spin: (B, 3), or (3,) for all alike; spin None: none."""
    balls = after(launched(position, velocity, spin, ball, ground), ball, seconds, ground)
    return balls.position, balls.velocity


def courses(position: np.typing.ArrayLike, velocity: np.ndarray, spin: np.ndarray | None, ball: Ball, times: np.ndarray,
            ground: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (B, T, 3) of balls at `times` (T,) s after their launch, ascending and not negative."""
    balls = launched(position, velocity, spin, ball, ground)
    places, velocities = [], []
    for seconds in np.diff(np.asarray(times, float), prepend=0.0):
        balls = after(balls, ball, seconds, ground)
        places.append(balls.position)
        velocities.append(balls.velocity)
    return np.stack(places, axis=1), np.stack(velocities, axis=1)


def drag_shares(drag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(1 - e^-d) / d, and (1 - that) / d, for d >= 0; by their series where d is small."""
    small = drag < 1e-4
    safe = np.where(small, 1.0, drag)
    first = np.where(small, 1.0 - drag / 2.0 + drag**2 / 6.0, -np.expm1(-safe) / safe)
    return first, np.where(small, 0.5 - drag / 6.0 + drag**2 / 24.0, (1.0 - first) / safe)


def _has_closed_form(balls: Balls, ball: Ball) -> bool:
    return ball.drag == 0.0 and not ball.friction and (ball.lift[0] == 0.0 or not balls.spin.any())


def _air(balls: Balls, which: np.ndarray, steps: np.ndarray, ball: Ball, low: float, most: int) -> np.ndarray:
    """One step of those that fly, up to the ground at most; how long it was (W,) s."""
    move = _closed if _has_closed_form(balls, ball) else _runge_kutta
    start = _rows(balls.position, which), _rows(balls.velocity, which), _rows(balls.spin, which)
    place, velocity, spin = move(*start, steps, ball)
    landing = np.flatnonzero((place[:, 2] < low) & (velocity[:, 2] < 0.0) & (balls.bounces[which] < most))
    if len(landing):
        steps = steps.copy()
        before = _rows(start[0], landing), _rows(start[1], landing), _rows(start[2], landing)
        under = (place[landing], velocity[landing])
        steps[landing] = _until_ground(move, before, under, steps=steps[landing], ball=ball, low=low)
        place[landing], velocity[landing], spin[landing] = move(*before, steps[landing], ball)
        place[landing, 2] = low
    balls.position[which], balls.velocity[which], balls.spin[which] = place, velocity, spin
    _meet_ground(balls, which[landing], ball)
    return steps


def _rows(values: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Rows of (B, 3), laid out so that each of x, y and z is one stretch of memory: twice as fast to reckon with."""
    return values.T[:, which].T


def _until_ground(move, start: tuple, ends: tuple, steps: np.ndarray, ball: Ball, low: float) -> np.ndarray:
    """(W,) s in which balls that are below the ground at their `ends`, after `steps` (W,), get down to it: Newton's
    method, kept between a moment above the ground and one below it, from where a parabola through both would land."""
    above, below = np.zeros(len(steps)), steps.copy()
    rise, height, bend = start[1][:, 2], start[0][:, 2] - low, (start[1][:, 2] - ends[1][:, 2]) / steps
    guess = (rise + np.sqrt(np.maximum(rise**2 + 2.0 * bend * height, 0.0))) / bend
    far = np.arange(len(steps))
    for _ in range(12):
        guess[far] = np.where((guess > above) & (guess < below), guess, 0.5 * (above + below))[far]
        place, velocity, _ = move(*(_rows(value, far) for value in start), guess[far], ball)
        over, down = place[:, 2] - low, velocity[:, 2] < 0.0
        # A ball that has just bounced and rises is above the ground, whatever the last digits say.
        still = (over > 0.0) | ~down
        above[far[still]], below[far[~still]] = guess[far[still]], guess[far[~still]]
        guess[far] -= over / np.where(down, velocity[:, 2], -1e9)
        far = far[np.abs(over) >= CLOSE]
        if not len(far):
            break
    return guess


def _meet_ground(balls: Balls, which: np.ndarray, ball: Ball) -> None:
    """The bounce of those that are on the ground; too low a hop is none, and they slide or roll from there."""
    if not len(which):
        return
    velocity, spin = bounced(balls.velocity[which], balls.spin[which], ball)
    hops = velocity[:, 2] > LEAST_HOP
    velocity[:, 2] = np.where(hops, velocity[:, 2], 0.0)
    balls.velocity[which], balls.spin[which] = velocity, spin
    balls.bounces[which] += hops
    stay = which[~hops]
    if len(stay):
        slides = (length(slip(balls.velocity[stay], balls.spin[stay], ball)) > STANDS_STILL) & (ball.friction > 0.0)
        balls.phase[stay] = SLIDE
        _grip(balls, stay[~slides], ball)


def _grip(balls: Balls, which: np.ndarray, ball: Ball) -> None:
    """From now on these roll."""
    if len(which):
        balls.velocity[which], balls.spin[which] = gripped(balls.velocity[which], balls.spin[which], ball)
        balls.phase[which] = ROLL


def _slide(balls: Balls, which: np.ndarray, steps: np.ndarray, ball: Ball, low: float, most: int) -> np.ndarray:
    """One step of those that slide, up to where the lowest point stands still; how long it was (W,) s."""
    velocity, spin = balls.velocity[which], balls.spin[which]
    before = slip(velocity, spin, ball)
    faster, turning = sliding(velocity, spin, ball)
    # The slip shrinks at an almost even rate: what is left of it says how long the ball slides.
    shrinks = -np.einsum("bi,bi->b", slip(faster, turning, ball), before) / np.maximum(length(before), 1e-12)
    until = length(before) / np.maximum(shrinks, 1e-12)
    taken = np.minimum(np.minimum(steps, SLIDE_STEP), until)
    h = taken[:, None]
    faster_then, turning_then = sliding(velocity + 0.5 * h * faster, spin + 0.5 * h * turning, ball)
    balls.position[which] += h * velocity + h * h * (faster + 2.0 * faster_then) / 6.0
    balls.velocity[which] += h * faster_then
    balls.spin[which] += h * turning_then
    _grip(balls, which[until <= taken], ball)
    return taken


def _roll(balls: Balls, which: np.ndarray, steps: np.ndarray, ball: Ball, low: float, most: int) -> np.ndarray:
    """One step of those that roll, until they rest at most; how long it was (W,) s."""
    velocity = balls.velocity[which]
    speed = length(velocity)
    along = velocity / np.maximum(speed, 1e-12)[:, None]
    steps = np.minimum(steps, 5.0 * STEP)
    taken = np.minimum(steps, speed / np.maximum(slowing(0.5 * speed, ball), 1e-12))
    one = slowing(speed, ball)
    two = slowing(speed - 0.5 * taken * one, ball)
    three = slowing(speed - 0.5 * taken * two, ball)
    four = slowing(speed - taken * three, ball)
    slower = np.maximum(speed - taken * (one + 2.0 * two + 2.0 * three + four) / 6.0, 0.0)
    balls.position[which] += along * (taken * speed - taken**2 * (one + two + three) / 6.0)[:, None]
    balls.velocity[which] = along * slower[:, None]
    decayed = balls.spin[which] * np.exp(-ball.spin_decay * taken)[:, None]
    balls.spin[which] = rolling_spin(balls.velocity[which], ball) + decayed * [0, 0, 1] if ball.friction else decayed
    stands = slower <= 1e-4
    balls.velocity[which[stands]] = 0.0
    balls.phase[which[stands]] = REST
    return taken


def _closed(position, velocity, spin, steps, ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flight under gravity and linear drag alone, any `steps` (W,) s long."""
    drag = ball.linear_drag * steps
    falling = np.array([0.0, 0.0, -ball.gravity])
    first, second = drag_shares(drag)
    place = position + velocity * (steps * first)[:, None] + falling * (steps**2 * second)[:, None]
    faster = velocity * np.exp(-drag)[:, None] + falling * (steps * first)[:, None]
    return place, faster, spin * np.exp(-ball.spin_decay * steps)[:, None]


def _runge_kutta(position, velocity, spin, steps, ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One step of `steps` (W,) s of the classical fourth order; the spin decays meanwhile as it does in truth."""
    h = steps[:, None]
    half, whole = (spin * np.exp(-ball.spin_decay * steps * share)[:, None] for share in (0.5, 1.0))
    one = in_air(velocity, spin, ball)
    two = in_air(velocity + 0.5 * h * one, half, ball)
    three = in_air(velocity + 0.5 * h * two, half, ball)
    four = in_air(velocity + h * three, whole, ball)
    place = position + h * velocity + h * h / 6.0 * (one + two + three)
    return place, velocity + h / 6.0 * (one + 2.0 * (two + three) + four), whole
