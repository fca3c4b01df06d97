"""Simulate flights in coarse steps, about one sample apart, in which a ball may bounce once.

`batch.simulate_trajectories` is the reference: at 0.04 s the two agree within some centimetres over a second. A few
dozen balls at a time cost calls of numpy and not arithmetic, so the steps work on components that lie in one piece.
"""

from __future__ import annotations

import numpy as np

from ..physics import Ball, compute_air_acceleration, compute_bounce

_MIN_HOP_SPEED = 0.35  # m/s upward after a bounce: a lower hop ends within one step


def simulate_coarse_trajectories(place: np.ndarray, velocity: np.ndarray, spin: np.ndarray, ball: Ball, step: float,
                                 count: int) -> tuple[np.ndarray, np.ndarray]:
    """Simulate balls in coarse steps.

    Args:
        place: (B, 3) m at the launch.
        velocity: (B, 3) m/s at the launch.
        spin: (B, 3) rad/s at the launch.
        ball: the ball's physics.
        step: s between the moments.
        count: number of steps.
    Returns:
        Positions (B, count + 1, 3) m and velocities (B, count + 1, 3) m/s.
    """
    state, low = np.concatenate([place.T, velocity.T, spin.T]), ball.radius  # (9, B)
    moments = np.empty((count + 1, 6, len(place)))
    state[2] = np.maximum(state[2], low)
    lies = (state[2] <= low) & (state[5] <= _MIN_HOP_SPEED)
    state[5, lies] = 0.0
    moments[0] = state[:6]
    for index in range(1, count + 1):
        stays = lies.nonzero()[0]
        if len(stays) == len(lies):
            state = _step_ground(state, ball, step)
        elif not len(stays):
            state, lies = _step_air(state, ball=ball, step=step, low=low)
        else:
            flies = (~lies).nonzero()[0]
            state[:, stays] = _step_ground(state[:, stays], ball, step)
            state[:, flies], lies[flies] = _step_air(state[:, flies], ball=ball, step=step, low=low)
        moments[index] = state[:6]
    return moments[:, :3].transpose(2, 0, 1), moments[:, 3:].transpose(2, 0, 1)


def _step_air(state: np.ndarray, ball: Ball, step: float, low: float) -> tuple[np.ndarray, np.ndarray]:
    """Step balls (9, B) in the air by Heun's method; one that crosses the ground bounces once within the step.

    Returns:
        (9, B), and (B,) bool: the balls that stay on the ground from there.
    """
    place, velocity, spin = state[:3], state[3:6], state[6:]
    first = compute_air_acceleration(velocity.T, spin.T, ball).T
    then = compute_air_acceleration((velocity + step * first).T, spin.T, ball).T
    after = velocity + 0.5 * step * (first + then)
    there = place + step * velocity + step**2 / 6.0 * (2.0 * first + then)
    out, lies = np.concatenate([there, after, spin]), np.zeros(state.shape[1], bool)
    down = ((there[2] <= low) & (after[2] < 0.0)).nonzero()[0]
    if len(down):
        out[:, down], lies[down] = _bounce(state[:, down], first[:, down], ball=ball, step=step, low=low)
    return out, lies


def _bounce(state: np.ndarray, pull: np.ndarray, ball: Ball, step: float, low: float) -> tuple[np.ndarray, np.ndarray]:
    """Step balls (9, B) with accelerations `pull` (3, B) m/s^2 to the ground by a parabola, and on after the bounce."""
    place, velocity, spin = state[:3], state[3:6], state[6:]
    deep, down = np.maximum(place[2] - low, 0.0), np.minimum(-pull[2], -1e-6)
    until = (velocity[2] + np.sqrt(np.maximum(velocity[2]**2 - 2.0 * pull[2] * deep, 0.0))) / down
    until = np.clip(np.abs(until), 0.0, step)
    impact = velocity + until * pull
    there = place + until * 0.5 * (velocity + impact)
    rebound, turned = (values.T for values in compute_bounce(impact.T, spin.T, ball))
    lies = rebound[2] < _MIN_HOP_SPEED
    rebound[2, lies] = 0.0
    left, falls = step - until, np.where(lies, 0.0, -ball.gravity)
    there = there + left * rebound
    there[2] = low + np.maximum(left * rebound[2] + 0.5 * falls * left**2, 0.0)
    rebound[2] += falls * left
    return np.concatenate([there, rebound, turned]), lies


def _step_ground(state: np.ndarray, ball: Ball, step: float) -> np.ndarray:
    """Step balls (9, B) on the ground, without upward speed: slide while there is slip, else roll.

    The laws are those of `physics.compute_sliding`, `compute_grip` and `compute_deceleration`.
    """
    flat, spin, radius = state[3:5], state[6:8], ball.radius
    slip = np.stack([flat[0] - radius * spin[1], flat[1] + radius * spin[0]])
    size = _compute_length(slip)
    rub = slip * (-ball.friction * ball.gravity / np.maximum(size, 1e-12))
    slid = flat + step * (rub + flat * -(ball.linear_drag + ball.drag * _compute_length(flat)))
    turned = spin + step * (_compute_spin_change(rub, ball) - ball.spin_decay * spin)
    reverses = (slid[0] - radius * turned[1]) * slip[0] + (slid[1] + radius * turned[0]) * slip[1] <= 0.0
    stops = (size <= 1e-6) | reverses
    grip = flat + slip * (-ball.inertia / (1.0 + ball.inertia)) if ball.friction else flat
    speed = _compute_length(grip)
    slower = np.maximum(speed - step * (ball.rolling + ball.linear_drag * speed + ball.drag * speed**2), 0.0)
    rolled = grip * (slower / np.maximum(speed, 1e-9))
    out = state.copy()
    out[:2] += step * np.where(stops, 0.5 * (grip + rolled), 0.5 * (flat + slid))
    out[3:5] = np.where(stops, rolled, slid)
    out[6:8] = np.where(stops, np.stack([-rolled[1], rolled[0]]) / radius, turned)
    out[8] = np.where(stops, state[8], state[8] - step * (ball.spin_decay * state[8]))
    return out


def _compute_length(flat: np.ndarray) -> np.ndarray:
    """Lengths (B,) of horizontal vectors (2, B)."""
    return np.sqrt(flat[0] * flat[0] + flat[1] * flat[1])


def _compute_spin_change(push: np.ndarray, ball: Ball) -> np.ndarray:
    """Compute the spin change (2, B) rad/s by a horizontal velocity change (2, B) m/s at the lowest point."""
    return np.stack([push[1], -push[0]]) / (ball.inertia * ball.radius)
