"""How far a movement has come, 0 .. 1 (Fredriksson §7.4): by what the limb has travelled, by how far a leg is
stretched, or by time warping (§9.3); and how much each control point of a phase-functioned network counts then.

Control points are weighed by a Catmull-Rom spline that does not close (§3.6.2 eq. 3.25-3.26). As printed, theta_k1 and
theta_k2 do not sum to one with the others. The uniform spline through p_0 .. p_3 is
p_1 + t (p_2 - p_0) / 2 + t^2 (p_0 - 5/2 p_1 + 2 p_2 - 1/2 p_3) + t^3 (3/2 (p_1 - p_2) + 1/2 (p_3 - p_0)); collecting
each point's factors gives theta_k1 = 1 - 5/2 t^2 + 3/2 t^3 (printed: 1/2 t^3) and
theta_k2 = 1/2 t + 2 t^2 - 3/2 t^3 (printed: 1/2 t^2); theta_k0 and theta_k3 are printed right.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...base.errors import InputError
from ...base.vectors import distance_along

AT_RELEASE = 0.66
"""c of eq. 7.2: the phase at which the ball leaves, beside the third control point."""
_STILL = 1e-6  # metres of travel below which a stretch has no distance to go by, and time takes its place
_POINTS = 100  # of a reference curve
_REACH = 0.25  # of a curve's length: how far the warping may leave the straight road
_PACE = 0.02  # of the fastest speed: what a step costs that lets one curve wait


def motion_phase(effector: np.ndarray, release: float, fps: float) -> np.ndarray:
    """The motion phase (T,) of each frame: the part of its way that the limb's end has gone (eq. 7.2).

    effector: (T, 3) metres. release: the fractional frame, where the phase is `AT_RELEASE`. fps: frames per second.

    The second branch is printed as c + part; the phase is to end at 1, so it is c + (1 - c) part. Where the limb keeps
    still before or after the release, time takes the place of distance."""
    _check(effector, fps)
    at = np.arange(len(effector), dtype=float)
    gone = distance_along(effector)
    return _pinned(at, gone, float(np.clip(release, 0.0, at[-1])))


def _pinned(at: np.ndarray, gone: np.ndarray, release: float) -> np.ndarray:
    """Phases from a rising quantity `gone` (T,) at frames `at` (T,): 0 at the start, c at the release, 1 at the end."""
    then = np.interp(release, at, gone)
    before = _part(gone, gone[0], then, at=at, first=at[0], last=release)
    after = _part(gone, then, gone[-1], at=at, first=release, last=at[-1])
    return np.where(at < release, AT_RELEASE * before, AT_RELEASE + (1.0 - AT_RELEASE) * after)


def _part(gone, low, high, at, first, last) -> np.ndarray:
    """The part of low .. high, else of first .. last, clipped to 0 .. 1."""
    if high - low < _STILL:
        gone, low, high = at, first, last
    return np.clip((gone - low) / max(high - low, 1e-12), 0.0, 1.0)


def distance_phase(distance, reach: tuple[float, float], xp=np):
    """The phase (...) of a leg whose toe is `distance` (...) metres from the leg's top (eq. 7.3), clipped to 0 .. 1.

    reach: shortest and longest distance in the training data. xp: numpy or jax.numpy."""
    low, high = reach
    return xp.clip((distance - low) / (high - low), 0.0, 1.0)


def speed_curve(effector: np.ndarray, release: float, fps: float, points: int = _POINTS) -> np.ndarray:
    """The limb's speed (2 points - 1,) as a curve that examples can be compared by: `points` evenly spaced moments
    before the release and as many after it, the release in the middle, the fastest speed 1."""
    _check(effector, fps)
    at = np.arange(len(effector), dtype=float)
    release = float(np.clip(release, 0.0, at[-1]))
    speed = np.linalg.norm(np.gradient(effector, axis=0), axis=1) * fps if len(at) > 1 else np.zeros(1)
    moments = np.concatenate([np.linspace(0.0, release, points), np.linspace(release, at[-1], points)[1:]])
    curve = np.interp(moments, at, speed)
    return curve / max(curve.max(), 1e-12)


def reference_curve(examples: Iterable[tuple[np.ndarray, float]], fps: float, rounds: int = 3) -> np.ndarray:
    """The speed curve (N,) that examples are warped to: their mean, warped to it again `rounds` times so that what they
    share stays sharp.

    examples: (effector (T, 3), release) of each. InputError where there is none."""
    curves = [speed_curve(effector, release, fps) for effector, release in examples]
    if not curves:
        raise InputError("reference curve", "no example", "one at least")
    mean = np.mean(curves, axis=0)
    for _ in range(rounds):
        mean = np.mean([_warped_to(curve, mean) for curve in curves], axis=0)
    return mean


def warped_phase(effector: np.ndarray, release: float, fps: float, reference: np.ndarray) -> np.ndarray:
    """The phase (T,) of each frame by dynamic time warping of the limb's speed to a reference curve (§9.3).

    What looks alike has the same phase then, also where one subject winds up longer than another. The release stays
    pinned to `AT_RELEASE`: both sides of it are warped alone. reference: of `reference_curve`."""
    _check(effector, fps)
    half = (len(reference) + 1) // 2
    curve = speed_curve(effector, release, fps, half)
    at = np.arange(len(effector), dtype=float)
    release = float(np.clip(release, 0.0, at[-1]))
    before = warp(curve[:half], reference[:half]) / (half - 1)
    after = warp(curve[half - 1 :], reference[half - 1 :]) / (half - 1)
    early = np.interp(at, np.linspace(0.0, max(release, 1e-9), half), before)
    late = np.interp(at, np.linspace(release, max(at[-1], release + 1e-9), half), after)
    return np.where(at < release, AT_RELEASE * early, AT_RELEASE + (1.0 - AT_RELEASE) * late)


def _warped_to(curve: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """A speed curve with its moments shifted to where the reference is most alike."""
    half = (len(curve) + 1) // 2
    sides = []
    for mine, theirs in ((curve[:half], reference[:half]), (curve[half - 1 :], reference[half - 1 :])):
        sides.append(np.interp(np.arange(half), warp(mine, theirs), mine))
    return np.concatenate([sides[0], sides[1][1:]])


def warp(curve: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Where in `reference` (M,) each moment of `curve` (N,) belongs: indices (N,), rising, 0 at the start and M - 1 at
    the end.

    Dynamic time warping (Sakoe and Chiba 1978): the cheapest monotone road through |curve_i - reference_j|, within a
    band about the straight one. A moment that belongs to several indices is given their middle; flat stretches of the
    road are made to rise, because a phase that stands still says nothing."""
    cost = np.abs(curve[:, None] - reference[None, :])
    count, length = cost.shape
    best = np.full((count + 1, length + 1), np.inf)
    best[0, 0] = 0.0
    band = max(int(_REACH * length), abs(count - length) + 1)
    for i in range(count):
        centre = i * (length - 1) // max(count - 1, 1)
        for j in range(max(0, centre - band), min(length, centre + band + 1)):
            step = min(best[i, j], best[i, j + 1] + _PACE, best[i + 1, j] + _PACE)
            best[i + 1, j + 1] = cost[i, j] + step
    return _rising(_middles(_road(best), count), length)


def _road(best: np.ndarray) -> list[tuple[int, int]]:
    """The cheapest road back from the last pair to the first."""
    i, j = best.shape[0] - 1, best.shape[1] - 1
    road = []
    while i and j:
        road.append((i - 1, j - 1))
        choices = ((best[i - 1, j - 1], i - 1, j - 1), (best[i - 1, j] + _PACE, i - 1, j),
                   (best[i, j - 1] + _PACE, i, j - 1))  # fmt: skip
        _, i, j = min(choices, key=lambda choice: choice[0])
    return road[::-1]


def _middles(road: list[tuple[int, int]], count: int) -> np.ndarray:
    """For each moment the middle of the indices that the road pairs it with."""
    pairs = np.array(road)
    number = np.bincount(pairs[:, 0], minlength=count)
    return np.bincount(pairs[:, 0], pairs[:, 1], minlength=count) / number


def _rising(indices: np.ndarray, length: int) -> np.ndarray:
    """The road through the middles of its flat stretches, from 0 to length - 1, strictly rising."""
    values, place = np.unique(indices, return_inverse=True)
    at = np.bincount(place, np.arange(len(indices))) / np.bincount(place)
    at[0], at[-1] = 0.0, len(indices) - 1.0
    values[0], values[-1] = 0.0, length - 1.0
    return np.interp(np.arange(len(indices)), at, values)


def _check(effector: np.ndarray, fps: float) -> None:
    if np.ndim(effector) != 2 or np.shape(effector)[1] != 3 or not len(effector):
        raise InputError("phase", f"places of shape {np.shape(effector)}", "(T, 3), one frame at least")
    if not (np.all(np.isfinite(effector)) and fps > 0):
        raise InputError("phase", "a place or a rate that is no number", "metres and frames per second")


def weigh_points(phase, points: int = 4, xp=np):
    """Weights (..., points) of the control points at phases (...) of 0 .. 1; they sum to one.

    The control points stand evenly, at 0, 1/3, 2/3 and 1 where they are four; phases beyond the ends count as the ends.
    One point is a plain feed-forward network. xp: numpy or jax.numpy.

    Written as one kernel around each point (the same four polynomials, by distance); the points before the first and
    after the last are the first and the last again (eq. 3.26), so their weights are added to those."""
    phase = xp.clip(xp.asarray(phase), 0.0, 1.0)[..., None]
    if points == 1:
        return xp.ones_like(phase)
    every = _kernel(xp.abs(phase * (points - 1) - xp.arange(-1, points + 1)), xp)
    first, last = every[..., 0:1] + every[..., 1:2], every[..., -2:-1] + every[..., -1:]
    return xp.concatenate([first, every[..., 2:-2], last], -1)


def weigh_points_at(phase: float, points: int = 4) -> list[float]:
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
