"""Simulate thousands of flights at once: the physics of `flight`, in steps that all balls take together.

Each ball has its own clock. A ball without spin and quadratic drag flies from bounce to bounce in closed form (one
step per hop); others take fourth-order Runge-Kutta steps. A step that ends below the ground is repeated up to the
bounce, which is found to about 1e-9 s; the ball continues from there. `flight.simulate_flight` is the reference: tests
compare the two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .flight import MIN_HOP_SPEED, MIN_SLIP_SPEED
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

STEP = 0.12
"""s: the longest step of a flight without a closed form."""
SLIDE_STEP = 0.01
"""s: the longest step of a ball that slides."""
LANDING_TOLERANCE = 1e-6
"""m from the ground: closer than this, Newton's method takes its last step."""
AIR, SLIDE, ROLL, REST = range(4)


@dataclass(frozen=True, eq=False)
class Balls:
    """Many balls (B), each at one moment.

    Attributes:
        position: (B, 3) m of the centres, world frame.
        velocity: (B, 3) m/s.
        spin: (B, 3) rad/s.
        phase: (B,) one of AIR, SLIDE, ROLL, REST.
        bounces: (B,) how often each ball has left the ground again.
    """

    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    phase: np.ndarray
    bounces: np.ndarray


def build_balls(position: np.typing.ArrayLike, velocity: np.ndarray, spin: np.ndarray | None, ball: Ball,
                ground: float = 0.0) -> Balls:
    """Build balls (B) at their launch.

    A ball that is too low is moved onto the ground and bounces at once if it moves down. Every argument may be (3,):
    the same for all.

    Args:
        position: (B, 3) m of the centres.
        velocity: (B, 3) m/s.
        spin: (B, 3) rad/s. None: no spin.
        ball: the ball's physics.
        ground: m, height of the ground.
    Returns:
        The balls, in the air or on the ground.
    """
    spin = np.zeros(3) if spin is None else spin
    shape = np.broadcast_shapes(np.shape(position), np.shape(velocity), np.shape(spin), (1, 3))
    position, velocity, spin = (np.broadcast_to(value, shape).astype(float)
                                for value in (position, velocity, spin))
    low = ground + ball.radius
    position[:, 2] = np.maximum(position[:, 2], low)
    balls = Balls(position, velocity, spin, np.zeros(shape[0], int), np.zeros(shape[0], int))
    _apply_bounce(balls, np.flatnonzero((position[:, 2] <= low) & (velocity[:, 2] <= MIN_HOP_SPEED)), ball)
    return balls


@np.errstate(over="ignore", invalid="ignore")  # trial launches may overflow
def simulate_balls(balls: Balls, ball: Ball, seconds: float | np.ndarray, ground: float = 0.0,
                   most_bounces: int | None = None) -> Balls:
    """Simulate balls for some time.

    Args:
        balls: the balls (B); they are not changed.
        ball: the ball's physics.
        seconds: (B,) s, or one number for all.
        ground: m, height of the ground.
        most_bounces: after this many bounces balls fall through the ground, so that a solver's residuals stay smooth.
    Returns:
        The balls at the later time.
    """
    balls = Balls(*(value.copy() for value in vars(balls).values()))
    left = np.broadcast_to(np.asarray(seconds, float), balls.phase.shape).copy()
    bounce_limit = np.iinfo(int).max if most_bounces is None else most_bounces
    longest = np.inf if _has_closed_form(balls, ball) else STEP
    # Every pass moves each ball by one step of its phase; `left` is what remains of its time.
    while len(moving := np.flatnonzero((left > 0.0) & (balls.phase != REST))):
        for phase, step in ((AIR, _step_flight), (SLIDE, _step_slide), (ROLL, _step_roll)):
            which = moving[balls.phase[moving] == phase]
            if len(which):
                steps = np.minimum(left[which], longest)
                left[which] -= step(balls, which, steps, ball, low=ground + ball.radius, most=bounce_limit)
    return balls


def simulate_states(position: np.typing.ArrayLike, velocity: np.ndarray, spin: np.ndarray | None, ball: Ball,
                    seconds: np.ndarray, ground: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Simulate balls to one moment each. Every argument may be (3,) or one number: the same for all.

    Args:
        position: (B, 3) m at the launch.
        velocity: (B, 3) m/s at the launch.
        spin: (B, 3) rad/s. None: no spin.
        ball: the ball's physics.
        seconds: (B,) s after the launch.
        ground: m, height of the ground.
    Returns:
        Positions (B, 3) m and velocities (B, 3) m/s.
    """
    balls = simulate_balls(build_balls(position, velocity, spin, ball, ground), ball, seconds, ground)
    return balls.position, balls.velocity


def simulate_trajectories(position: np.typing.ArrayLike, velocity: np.ndarray, spin: np.ndarray | None, ball: Ball,
                          times: np.ndarray, ground: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Simulate balls and sample their trajectories.

    Args:
        position: (B, 3) or (3,) m at the launch.
        velocity: (B, 3) or (3,) m/s at the launch.
        spin: (B, 3) or (3,) rad/s. None: no spin.
        ball: the ball's physics.
        times: (T,) s after the launch, ascending, not negative.
        ground: m, height of the ground.
    Returns:
        Positions (B, T, 3) m and velocities (B, T, 3) m/s.
    """
    balls = build_balls(position, velocity, spin, ball, ground)
    places, velocities = [], []
    for seconds in np.diff(np.asarray(times, float), prepend=0.0):
        balls = simulate_balls(balls, ball, seconds, ground)
        places.append(balls.position)
        velocities.append(balls.velocity)
    return np.stack(places, axis=1), np.stack(velocities, axis=1)


def compute_drag_factors(drag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute f = (1 - e^-d) / d and (1 - f) / d for d >= 0; by their series where d is small."""
    small = drag < 1e-4
    safe = np.where(small, 1.0, drag)
    first = np.where(small, 1.0 - drag / 2.0 + drag**2 / 6.0, -np.expm1(-safe) / safe)
    return first, np.where(small, 0.5 - drag / 6.0 + drag**2 / 24.0, (1.0 - first) / safe)


def _has_closed_form(balls: Balls, ball: Ball) -> bool:
    return ball.drag == 0.0 and not ball.friction and (ball.lift[0] == 0.0 or not balls.spin.any())


def _step_flight(balls: Balls, which: np.ndarray, steps: np.ndarray, ball: Ball, low: float, most: int) -> np.ndarray:
    """Step the balls that fly, up to the ground at most; return the durations (W,) s."""
    move = _compute_linear_flight if _has_closed_form(balls, ball) else _integrate_runge_kutta
    start = _select_rows(balls.position, which), _select_rows(balls.velocity, which), _select_rows(balls.spin, which)
    place, velocity, spin = move(*start, steps, ball)
    landing = np.flatnonzero((place[:, 2] < low) & (velocity[:, 2] < 0.0) & (balls.bounces[which] < most))
    if len(landing):
        steps = steps.copy()
        before = _select_rows(start[0], landing), _select_rows(start[1], landing), _select_rows(start[2], landing)
        under = (place[landing], velocity[landing])
        # Repeat the step of the balls that ended below the ground, up to the moment of landing.
        steps[landing] = _find_landing_times(move, before, under, steps=steps[landing], ball=ball, low=low)
        place[landing], velocity[landing], spin[landing] = move(*before, steps[landing], ball)
        place[landing, 2] = low
    balls.position[which], balls.velocity[which], balls.spin[which] = place, velocity, spin
    _apply_bounce(balls, which[landing], ball)
    return steps


def _select_rows(values: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Select rows of (B, 3), stored so that x, y and z are contiguous: twice as fast to compute with."""
    return values.T[:, which].T


def _find_landing_times(move, start: tuple, ends: tuple, steps: np.ndarray, ball: Ball, low: float) -> np.ndarray:
    """Find when balls that end below the ground after `steps` (W,) s reach it.

    Newton's method, kept between a moment above the ground and one below it. It starts where a parabola through both
    would land.

    Args:
        move: the step function.
        start: position (W, 3) m, velocity (W, 3) m/s and spin (W, 3) rad/s at the start of the step.
        ends: position and velocity at its end.
        steps: (W,) s, the duration of the step.
        ball: the ball's physics.
        low: m, height of the centre of a ball on the ground.
    Returns:
        (W,) s from the start of the step to the ground.
    """
    above, below = np.zeros(len(steps)), steps.copy()
    rise, height, bend = start[1][:, 2], start[0][:, 2] - low, (start[1][:, 2] - ends[1][:, 2]) / steps
    guess = (rise + np.sqrt(np.maximum(rise**2 + 2.0 * bend * height, 0.0))) / bend
    far = np.arange(len(steps))
    for _ in range(12):
        guess[far] = np.where((guess > above) & (guess < below), guess, 0.5 * (above + below))[far]
        place, velocity, _ = move(*(_select_rows(value, far) for value in start), guess[far], ball)
        over, down = place[:, 2] - low, velocity[:, 2] < 0.0
        # A ball that has just bounced and rises is above the ground, in spite of rounding errors.
        still = (over > 0.0) | ~down
        above[far[still]], below[far[~still]] = guess[far[still]], guess[far[~still]]
        guess[far] -= over / np.where(down, velocity[:, 2], -1e9)
        far = far[np.abs(over) >= LANDING_TOLERANCE]
        if not len(far):
            break
    return guess


def _apply_bounce(balls: Balls, which: np.ndarray, ball: Ball) -> None:
    """Apply the bounce to balls on the ground; after too low a hop they slide or roll instead."""
    if not len(which):
        return
    velocity, spin = compute_bounce(balls.velocity[which], balls.spin[which], ball)
    hops = velocity[:, 2] > MIN_HOP_SPEED
    velocity[:, 2] = np.where(hops, velocity[:, 2], 0.0)
    balls.velocity[which], balls.spin[which] = velocity, spin
    balls.bounces[which] += hops
    stay = which[~hops]
    if len(stay):
        slides = (vector_length(compute_slip(balls.velocity[stay], balls.spin[stay], ball))
                  > MIN_SLIP_SPEED) & (ball.friction > 0.0)
        balls.phase[stay] = SLIDE
        _start_rolling(balls, stay[~slides], ball)


def _start_rolling(balls: Balls, which: np.ndarray, ball: Ball) -> None:
    """Set balls rolling from now on."""
    if len(which):
        balls.velocity[which], balls.spin[which] = compute_grip(balls.velocity[which], balls.spin[which], ball)
        balls.phase[which] = ROLL


def _step_slide(balls: Balls, which: np.ndarray, steps: np.ndarray, ball: Ball, low: float, most: int) -> np.ndarray:
    """Step the balls that slide, until the lowest point has no slip; return the durations (W,) s."""
    velocity, spin = balls.velocity[which], balls.spin[which]
    before = compute_slip(velocity, spin, ball)
    faster, turning = compute_sliding(velocity, spin, ball)
    # The slip shrinks at an almost constant rate: its size now gives the time until the ball rolls.
    shrinks = -np.einsum("bi,bi->b", compute_slip(faster, turning, ball), before) / np.maximum(vector_length(before),
            1e-12)
    until = vector_length(before) / np.maximum(shrinks, 1e-12)
    taken = np.minimum(np.minimum(steps, SLIDE_STEP), until)
    h = taken[:, None]
    faster_then, turning_then = compute_sliding(velocity + 0.5 * h * faster, spin + 0.5 * h * turning, ball)
    balls.position[which] += h * velocity + h * h * (faster + 2.0 * faster_then) / 6.0
    balls.velocity[which] += h * faster_then
    balls.spin[which] += h * turning_then
    _start_rolling(balls, which[until <= taken], ball)
    return taken


def _step_roll(balls: Balls, which: np.ndarray, steps: np.ndarray, ball: Ball, low: float, most: int) -> np.ndarray:
    """Step the balls that roll, at most until they rest; return the durations (W,) s."""
    velocity = balls.velocity[which]
    speed = vector_length(velocity)
    along = velocity / np.maximum(speed, 1e-12)[:, None]
    steps = np.minimum(steps, 5.0 * STEP)
    taken = np.minimum(steps, speed / np.maximum(compute_deceleration(0.5 * speed, ball), 1e-12))
    # Fourth-order Runge-Kutta on the speed alone: the direction does not change.
    one = compute_deceleration(speed, ball)
    two = compute_deceleration(speed - 0.5 * taken * one, ball)
    three = compute_deceleration(speed - 0.5 * taken * two, ball)
    four = compute_deceleration(speed - taken * three, ball)
    slower = np.maximum(speed - taken * (one + 2.0 * two + 2.0 * three + four) / 6.0, 0.0)
    balls.position[which] += along * (taken * speed - taken**2 * (one + two + three) / 6.0)[:, None]
    balls.velocity[which] = along * slower[:, None]
    decayed = balls.spin[which] * np.exp(-ball.spin_decay * taken)[:, None]
    balls.spin[which] = compute_rolling_spin(balls.velocity[which], ball) + decayed * [0, 0,
            1] if ball.friction else decayed
    stopped = slower <= 1e-4
    balls.velocity[which[stopped]] = 0.0
    balls.phase[which[stopped]] = REST
    return taken


def _compute_linear_flight(position, velocity, spin, steps, ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute flight under gravity and linear drag alone, over `steps` (W,) s of any length."""
    drag = ball.linear_drag * steps
    falling = np.array([0.0, 0.0, -ball.gravity])
    first, second = compute_drag_factors(drag)
    place = position + velocity * (steps * first)[:, None] + falling * (steps**2 * second)[:, None]
    faster = velocity * np.exp(-drag)[:, None] + falling * (steps * first)[:, None]
    return place, faster, spin * np.exp(-ball.spin_decay * steps)[:, None]


def _integrate_runge_kutta(position, velocity, spin, steps, ball: Ball) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrate one step of `steps` (W,) s by the classical fourth-order method, with the exact decay of the spin."""
    h = steps[:, None]
    half, whole = (spin * np.exp(-ball.spin_decay * steps * share)[:, None] for share in (0.5, 1.0))
    one = compute_air_acceleration(velocity, spin, ball)
    two = compute_air_acceleration(velocity + 0.5 * h * one, half, ball)
    three = compute_air_acceleration(velocity + 0.5 * h * two, half, ball)
    four = compute_air_acceleration(velocity + h * three, whole, ball)
    place = position + h * velocity + h * h / 6.0 * (one + two + three)
    return place, velocity + h / 6.0 * (one + 2.0 * (two + three) + four), whole
