"""The ball's physics against closed forms and an integrator written for this alone; targets aimed at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from beyond_mocap.ball import batch
from beyond_mocap.ball.aim import aim
from beyond_mocap.ball.flight import LEAST_HOP, Launch, fly
from beyond_mocap.ball.physics import BALLS, FOOTBALL, PAPER, Ball, energy

from benchmarks import effort
from benchmarks.markdown import head, row

LAUNCHES, TARGETS, MANY = 40, 300, 10_000
STEP = 2e-3  # s of the integrator that judges


def launches(count: int, seed: int = 4, spin: float = 60.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, velocities and spins (count, 3) as players give them to balls."""
    rng = np.random.default_rng(seed)
    place = np.column_stack([rng.uniform(-40, 40, (count, 2)), rng.uniform(0.12, 2.2, count)])
    speed, rise, way = (
        rng.uniform(4, 34, count), np.radians(rng.uniform(-5, 60, count)), rng.uniform(0, 2 * np.pi, count)
    )  # fmt: skip
    velocity = speed[:, None] * np.column_stack([np.cos(rise) * np.cos(way), np.cos(rise) * np.sin(way), np.sin(rise)])
    return place, velocity, rng.normal(0.0, spin, (count, 3))


def without_drag(place, velocity, ball: Ball, times: np.ndarray) -> np.ndarray:
    """(N, 3) m: parabola after parabola, each bounce keeping `restitution` of the fall (closed form, no friction); NaN
    from where the hops get too small to count."""
    fall, low = ball.gravity, ball.radius
    height, up, since = place[2] - low, velocity[2], 0.0
    out = np.full((len(times), 3), np.nan)
    out[:, :2] = place[:2] + velocity[:2] * times[:, None]
    while True:
        if since and up < LEAST_HOP:
            return out
        lands = (up + np.sqrt(up**2 + 2.0 * fall * height)) / fall
        hop = (times >= since) & (times <= since + lands)
        out[hop, 2] = low + height + up * (times[hop] - since) - 0.5 * fall * (times[hop] - since) ** 2
        if since + lands >= times[-1]:
            return out
        up, height, since = -ball.restitution * (up - fall * lands), 0.0, since + lands


def with_linear_drag(place, velocity, ball: Ball, times: np.ndarray) -> np.ndarray:
    """(N, 3) m of one flight before its first bounce: v' = -g z - k v, closed form."""
    k, down = ball.linear_drag, np.array([0.0, 0.0, ball.gravity / ball.linear_drag])
    left = (1.0 - np.exp(-k * times))[:, None] / k
    return place + (velocity + down) * left - down * times[:, None]


def judged(place, velocity, spin, ball: Ball, seconds: float) -> Callable[[np.ndarray], np.ndarray]:
    """The way with drag, lift and bounces by classical Runge-Kutta in steps of 2 ms, written from the equations alone:
    quadratic and linear drag, Magnus lift, spin decay; at the ground Cross' grip or slip. Until the hops get small."""
    scale, a, b = ball.lift

    def change(state):
        v, w = state[3:6], state[6:]
        speed, turn = np.sqrt(v @ v), np.sqrt(w @ w)
        acceleration = np.array([0.0, 0.0, -ball.gravity]) - (ball.linear_drag + ball.drag * speed) * v
        if scale and turn > 0.0:
            lift = scale / (a + b * speed / (ball.radius * turn)) * speed
            acceleration = acceleration + lift * np.cross(w / turn, v)
        return np.concatenate([v, acceleration, -ball.spin_decay * w])

    def step(state, dt):
        k1 = change(state)
        k2 = change(state + 0.5 * dt * k1)
        k3 = change(state + 0.5 * dt * k2)
        k4 = change(state + dt * k3)
        return state + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

    state, time = np.concatenate([place, velocity, spin]), 0.0
    times, states = [0.0], [state]
    while time < seconds:
        after, dt = step(state, STEP), STEP
        if after[2] < ball.radius and after[5] < 0.0:
            low, high = 0.0, STEP
            for _ in range(60):  # halving until the moment of the bounce
                dt = 0.5 * (low + high)
                low, high = (dt, high) if step(state, dt)[2] > ball.radius else (low, dt)
            after = _bounce(step(state, dt), ball)
        state, time = after, time + dt
        times.append(time), states.append(state)
        if state[2] <= ball.radius + 1e-9 and abs(state[5]) < 0.5:
            break  # small hops: how a ball comes to roll is a matter of definition
    when, where = np.array(times), np.array(states)[:, :3]

    def at(asked: np.ndarray) -> np.ndarray:
        """(N, 3) m, NaN after the last big hop;
        the steps are so small that a straight line between them is within 5 um."""
        out = np.column_stack([np.interp(asked, when, where[:, i]) for i in range(3)])
        out[asked > when[-1]] = np.nan
        return out

    return at


def _bounce(state, ball: Ball):
    """Grip-slip bounce: the push across is friction's at most, and no more than stops the lowest point."""
    v, w, r = state[3:6], state[6:], ball.radius
    point = np.array([v[0] - r * w[1], v[1] + r * w[0]])
    wanted = ball.inertia / (1.0 + ball.inertia) * np.linalg.norm(point)
    push = min(wanted, ball.friction * (1.0 + ball.restitution) * -v[2])
    way = -point / max(np.linalg.norm(point), 1e-12) * push
    turned = np.array([way[1], -way[0], 0.0]) / (ball.inertia * r)
    return np.concatenate([state[:2], [r], v[:2] + way, [-ball.restitution * v[2]], w + turned])


def errors() -> list[list[str]]:
    """Rows: what was compared, the greatest distance, the target."""
    place, velocity, spin = launches(LAUNCHES)
    times, still = np.linspace(0.0, 3.0, 301), np.zeros(3)
    free = replace(PAPER, linear_drag=0.0, friction=0.0)
    parabola = max(_off(p, v, still, free, times, without_drag(p, v, free, times)) for p, v in zip(place, velocity))
    drags = replace(PAPER, friction=0.0)
    linear = max(_before_bounce(p, v, drags, times) for p, v in zip(place, velocity))
    rows = [
        ["no drag, bounces: closed form", f"{parabola:.1e}", "1e-6"],
        ["drag -0.2 v: closed form", f"{linear:.1e}", "1e-6"],
    ]
    for name, ball in BALLS.items():
        far = max(_off(p, v, w, ball, times, judged(p, v, w, ball, 3.0)(times))
                  for p, v, w in list(zip(place, velocity, spin))[:5])  # fmt: skip
        rows.append([f"{name}, spin, bounces: independent integrator", f"{far:.1e}", "1e-3"])
    return rows


def _off(place, velocity, spin, ball, times, expected) -> float:
    found = fly(Launch(0.0, place, velocity, spin), ball, times[-1]).at(times)
    hops = np.isfinite(expected).all(axis=1)
    return float(np.linalg.norm(found - expected, axis=1)[hops].max())


def _before_bounce(place, velocity, ball, times) -> float:
    flight = fly(Launch(0.0, place, velocity), ball, times[-1])
    before = times[times < (flight.bounces[0] if len(flight.bounces) else times[-1])]
    return float(
        np.linalg.norm(flight.at(before) - with_linear_drag(place, velocity, ball, before), axis=1).max(initial=0.0)
    )


def energy_gain() -> float:
    """The greatest gain of energy, joules, between two moments of any flight of any ball: none is allowed."""
    times, worst = np.linspace(0.0, 8.0, 2001), 0.0
    for ball in BALLS.values():
        for p, v, w in zip(*launches(LAUNCHES // 4, seed=8)):
            flight = fly(Launch(0.0, p, v, w), ball, 8.0)
            joules = energy(flight.at(times), flight.velocity(times), flight.spin(times), ball)
            worst = max(worst, float(np.diff(joules).max()))
    return worst


def aimed() -> list[list[str]]:
    """Rows: ball, bounces, targets, possible ones, misses in cm by `fly`, ms a target."""
    rng = np.random.default_rng(12)
    start = np.column_stack([rng.uniform(-10, 10, (TARGETS, 2)), rng.uniform(0.15, 1.9, TARGETS)])
    far, way = rng.uniform(3.0, 25.0, TARGETS), rng.uniform(0.0, 2.0 * np.pi, TARGETS)
    target = start + np.column_stack([far * np.cos(way), far * np.sin(way), np.zeros(TARGETS)])
    target[:, 2] = rng.uniform(0.15, 1.9, TARGETS)
    rows = []
    for ball in (PAPER, FOOTBALL):
        for bounces in (0, 1, 2):
            for seconds in (None, 0.35 + far / 11.0 + 0.35 * bounces):
                took, found = effort.seconds(lambda: aim(start, target, ball, seconds, bounces), 1)
                miss = [_miss(start[i], target[i], found, i, ball) for i in np.flatnonzero(found.possible)]
                rows.append([ball.name, str(bounces), "free" if seconds is None else "asked", str(TARGETS),
                             str(len(miss)), f"{100 * np.median(miss):.2g} / {100 * np.max(miss):.2g}",
                             f"{1000 * took / TARGETS:.2f}"])  # fmt: skip
    return rows


def _miss(start, target, found, i: int, ball: Ball) -> float:
    """Metres from the target at the time of arrival, flown anew."""
    flight = fly(Launch(0.0, start, found.velocity[i], found.spin[i]), ball, float(found.seconds[i]))
    return float(np.linalg.norm(flight.at(found.seconds[i : i + 1])[0] - target))


def batch_seconds() -> float:
    """Seconds for 10,000 flights of 2 s."""
    place, velocity, _ = launches(MANY)
    return effort.seconds(lambda: batch.states(place, velocity, None, FOOTBALL, 2.0))[0]


def section() -> list[str]:
    """Lines for results.md."""
    lines = [*head(("flight, compared with", "greatest distance m", "target")), *(row(one) for one in errors()), ""]
    lines += head(("aimed at targets, ball", "bounces", "arrival", "targets", "possible",
                   "miss cm (median / worst, target 2)", "ms each"))  # fmt: skip
    return [*lines, *(row(one) for one in aimed()), "",
            f"- greatest gain of energy anywhere: {energy_gain():.1e} J; {MANY} flights of 2 s at once: "
            f"{batch_seconds():.2f} s (target 0.3)"]  # fmt: skip
