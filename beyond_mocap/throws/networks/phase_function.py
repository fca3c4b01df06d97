"""How much each control point of a phase-functioned network counts at a phase: a Catmull-Rom spline that does not close
(Fredriksson §3.6.2 eq. 3.25-3.26).

As printed, theta_k1 and theta_k2 do not sum to one with the others. The uniform Catmull-Rom spline through p_0 .. p_3
is p_1 + t (p_2 - p_0) / 2 + t^2 (p_0 - 5/2 p_1 + 2 p_2 - 1/2 p_3) + t^3 (3/2 (p_1 - p_2) + 1/2 (p_3 - p_0)); collecting
each point's factors gives theta_k1 = 1 - 5/2 t^2 + 3/2 t^3 (printed: 1/2 t^3) and
theta_k2 = 1/2 t + 2 t^2 - 3/2 t^3 (printed: 1/2 t^2); theta_k0 and theta_k3 are printed right.
"""

from __future__ import annotations

import numpy as np


def weights(phase, points: int = 4, xp=np):
    """Weights (..., points) of the control points at phases (...) of 0 .. 1; they sum to one.

    The control points stand evenly, at 0, 1/3, 2/3 and 1 where they are four; phases beyond the ends count as the ends.
    One point is a plain feed-forward network. xp: numpy or jax.numpy.

    Written as one kernel around each point (the same four polynomials, by distance); the points before the first and
    after the last are the first and the last again (eq. 3.26), so their weights are added to those.
    """
    phase = xp.clip(xp.asarray(phase), 0.0, 1.0)[..., None]
    if points == 1:
        return xp.ones_like(phase)
    every = _kernel(xp.abs(phase * (points - 1) - xp.arange(-1, points + 1)), xp)
    first, last = every[..., 0:1] + every[..., 1:2], every[..., -2:-1] + every[..., -1:]
    return xp.concatenate([first, every[..., 2:-2], last], -1)


def weights_at(phase: float, points: int = 4) -> list[float]:
    """The same for one phase, without numpy: many times as fast for one frame. eq. 3.25 (corrected) and 3.26."""
    if points == 1:
        return [1.0]
    along = min(max(phase, 0.0), 1.0) * (points - 1)
    k = min(int(along), points - 2)
    t = along - k
    out = [0.0] * points
    out[max(k - 1, 0)] += t * (t * (1.0 - 0.5 * t) - 0.5)
    out[k] += 1.0 + t * t * (1.5 * t - 2.5)
    out[k + 1] += t * (t * (2.0 - 1.5 * t) + 0.5)
    out[min(k + 2, points - 1)] += t * t * (0.5 * t - 0.5)
    return out


def _kernel(d, xp):
    """A point's weight at a distance of `d` >= 0 points."""
    near = 1.0 + d * d * (1.5 * d - 2.5)
    far = 2.0 + d * (d * (2.5 - 0.5 * d) - 4.0)
    return xp.where(d < 1.0, near, xp.where(d < 2.0, far, 0.0))
