"""Many flights in even steps: the physics of `ball` as finely as samples can tell, for fits that try thousands.

One step is a sample's distance. Within it a ball may bounce once; it goes on along a parabola. `batch.courses` is the
judge; at 0.04 s they agree within some centimetres over a second.
"""

from __future__ import annotations

import numpy as np

from ..physics import Ball, bounced, gripped, in_air, length, rolling_spin, sliding, slip, slowing

_LEAST_HOP = 0.35  # m/s upward after a bounce: less is over within one step


def coarse_courses(
    place: np.ndarray, velocity: np.ndarray, spin: np.ndarray, ball: Ball, step: float, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (B, count + 1, 3) of balls launched with place, velocity and spin (B, 3), at every
    `step` s."""
    place, velocity, spin = place.copy(), velocity.copy(), spin.copy()
    places, velocities = np.empty((count + 1, *place.shape)), np.empty((count + 1, *place.shape))
    low = ball.radius
    place[:, 2] = np.maximum(place[:, 2], low)
    lies = (place[:, 2] <= low) & (velocity[:, 2] <= _LEAST_HOP)
    velocity[lies, 2] = 0.0
    places[0], velocities[0] = place, velocity
    for index in range(1, count + 1):
        flies, stays = np.flatnonzero(~lies), np.flatnonzero(lies)
        if len(flies):
            place[flies], velocity[flies], spin[flies], lies[flies] = _in_air(
                place[flies], velocity[flies], spin[flies], ball=ball, step=step, low=low)  # fmt: skip
        if len(stays):
            rolling = _on_ground(place[stays], velocity[stays], spin[stays], ball, step)
            place[stays], velocity[stays], spin[stays] = rolling
        places[index], velocities[index] = place, velocity
    return places.transpose(1, 0, 2), velocities.transpose(1, 0, 2)


def _in_air(place, velocity, spin, ball: Ball, step: float, low: float):
    first = in_air(velocity, spin, ball)
    then = in_air(velocity + step * first, spin, ball)
    after = velocity + 0.5 * step * (first + then)
    there = place + step * velocity + step**2 / 6.0 * (2.0 * first + then)
    lies = np.zeros(len(place), bool)
    down = np.flatnonzero((there[:, 2] <= low) & (after[:, 2] < 0.0))
    if len(down):
        fall, pull = velocity[down, 2], first[down, 2]
        deep = np.maximum(place[down, 2] - low, 0.0)
        until = (fall + np.sqrt(np.maximum(fall**2 - 2.0 * pull * deep, 0.0))) / np.minimum(-pull, -1e-6)
        until = np.clip(np.abs(until), 0.0, step)[:, None]
        meets = velocity[down] + until * first[down]
        flat = place[down] + until * 0.5 * (velocity[down] + meets)
        away, turned = bounced(meets, spin[down], ball)
        low_hop = away[:, 2] < _LEAST_HOP
        away[low_hop, 2] = 0.0
        left = step - until
        pulled = np.where(low_hop, 0.0, -ball.gravity)
        there[down] = flat + left * away
        there[down, 2] = low + np.maximum(left[:, 0] * away[:, 2] + 0.5 * pulled * left[:, 0] ** 2, 0.0)
        away[:, 2] += pulled * left[:, 0]
        after[down], spin[down], lies[down] = away, turned, low_hop
    return there, after, spin, lies


def _on_ground(place, velocity, spin, ball: Ball, step: float):
    before = slip(velocity, spin, ball)
    rubs = length(before) > 1e-6
    faster, turning = sliding(velocity, spin, ball)
    slid, turned = velocity + step * faster, spin + step * turning
    stops = ~rubs | ((slip(slid, turned, ball) * before).sum(axis=1) <= 0.0)
    grip, spun = gripped(velocity, spin, ball)
    speed = length(grip)
    slower = np.maximum(speed - step * slowing(speed, ball), 0.0)
    rolled = grip * (slower / np.maximum(speed, 1e-9))[:, None]
    after = np.where(stops[:, None], rolled, slid)
    spun = np.where(stops[:, None], rolling_spin(rolled, ball) + spun * [0.0, 0.0, 1.0], turned)
    middle = np.where(stops[:, None], 0.5 * (grip + rolled), 0.5 * (velocity + slid))
    return place + step * middle, after, spun
