"""Phase of a movement, 0 to 1, and the weights of the control points of a phase-functioned network at a phase.

The phase is computed from the distance that the limb has travelled, from how far a leg is stretched, or by time
warping (Fredriksson sections 7.4 and 9.3).

Control points are weighted by a Catmull-Rom spline that does not close (section 3.6.2 eq. 3.25-3.26). As printed,
theta_k1 and theta_k2 do not sum to one with the others. The uniform spline through p_0 .. p_3 is p_1 + t (p_2 - p_0)
/ 2 + t^2 (p_0 - 5/2 p_1 + 2 p_2 - 1/2 p_3) + t^3 (3/2 (p_1 - p_2) + 1/2 (p_3 - p_0)); collecting the factors of each
point gives theta_k1 = 1 - 5/2 t^2 + 3/2 t^3 (printed: 1/2 t^3) and theta_k2 = 1/2 t + 2 t^2 - 3/2 t^3 (printed: 1/2
t^2); theta_k0 and theta_k3 are printed correctly.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...base.errors import InputError
from ...base.vectors import distances_along

AT_RELEASE = 0.66
"""c of eq. 7.2: the phase at which the ball leaves, near the third control point."""
_MIN_TRAVEL = 1e-6  # metres of travel below which time replaces distance
_POINTS = 100  # samples of a reference curve on each side of the release
_BAND = 0.25  # share of a curve's length: half-width of the warping band about the diagonal
_STEP_COST = 0.02  # share of the highest speed: cost of a step that advances only one of the two curves


def compute_motion_phase(effector: np.ndarray, release: float, fps: float) -> np.ndarray:
    """Compute the motion phase (T,) of each frame: the travelled share of the path of the limb's end (eq. 7.2).

    The second branch is printed as c + part; since the phase has to end at 1, it is c + (1 - c) part. Where the limb
    does not move before or after the release, time replaces distance.

    Args:
        effector: (T, 3) m, positions of the limb's end.
        release: fractional frame, where the phase is `AT_RELEASE`.
        fps: frames per second.
    Returns:
        Phases (T,) of 0 to 1.
    """
    _check_effector(effector, fps)
    at = np.arange(len(effector), dtype=float)
    travelled = distances_along(effector)
    return _pin_release(at, travelled, float(np.clip(release, 0.0, at[-1])))


def _pin_release(at: np.ndarray, quantity: np.ndarray, release: float) -> np.ndarray:
    """Compute phases from an increasing quantity (T,): 0 at the start, c at the release, 1 at the end."""
    at_release = np.interp(release, at, quantity)
    before = _compute_share(quantity, quantity[0], at_release, at=at, first=at[0], last=release)
    after = _compute_share(quantity, at_release, quantity[-1], at=at, first=release, last=at[-1])
    return np.where(at < release, AT_RELEASE * before, AT_RELEASE + (1.0 - AT_RELEASE) * after)


def _compute_share(quantity, low, high, at, first, last) -> np.ndarray:
    """Compute the share of low .. high, or of first .. last in time if that range is empty, clipped to 0 .. 1."""
    if high - low < _MIN_TRAVEL:
        quantity, low, high = at, first, last
    return np.clip((quantity - low) / max(high - low, 1e-12), 0.0, 1.0)


def compute_distance_phase(distance, reach: tuple[float, float], xp=np):
    """Compute the phase of a leg from the distance between its top and its toe (eq. 7.3).

    Args:
        distance: (...) m.
        reach: shortest and longest distance in the training data, m.
        xp: numpy or jax.numpy.
    Returns:
        Phases (...), clipped to 0 .. 1.
    """
    low, high = reach
    return xp.clip((distance - low) / (high - low), 0.0, 1.0)


def compute_speed_curve(effector: np.ndarray, release: float, fps: float, points: int = _POINTS) -> np.ndarray:
    """Compute the speed of a limb as a curve by which examples are compared.

    Args:
        effector: (T, 3) m.
        release: fractional frame.
        fps: frames per second.
        points: number of evenly spaced samples before the release, and of those after it.
    Returns:
        (2 points - 1,) speeds, the release in the middle, the highest speed 1.
    """
    _check_effector(effector, fps)
    at = np.arange(len(effector), dtype=float)
    release = float(np.clip(release, 0.0, at[-1]))
    speed = np.linalg.norm(np.gradient(effector, axis=0), axis=1) * fps if len(at) > 1 else np.zeros(1)
    moments = np.concatenate([np.linspace(0.0, release, points), np.linspace(release, at[-1], points)[1:]])
    curve = np.interp(moments, at, speed)
    return curve / max(curve.max(), 1e-12)


def compute_reference_curve(examples: Iterable[tuple[np.ndarray, float]], fps: float, rounds: int = 3) -> np.ndarray:
    """Compute the speed curve (N,) to which examples are warped.

    It is their mean; the curves are warped to it and averaged again `rounds` times, so that common features stay
    sharp.

    Args:
        examples: effector (T, 3) m and release frame of each example.
        fps: frames per second.
        rounds: repetitions.
    Raises:
        InputError: if there is no example.
    """
    curves = [compute_speed_curve(effector, release, fps) for effector, release in examples]
    if not curves:
        raise InputError("reference curve", "no example", "at least one")
    mean = np.mean(curves, axis=0)
    for _ in range(rounds):
        mean = np.mean([_warp_curve(curve, mean) for curve in curves], axis=0)
    return mean


def compute_warped_phase(effector: np.ndarray, release: float, fps: float, reference: np.ndarray) -> np.ndarray:
    """Compute the phase (T,) of each frame by dynamic time warping of the limb's speed to a reference curve.

    Similar moments then have the same phase, also where one subject winds up longer than another. The release stays
    pinned to `AT_RELEASE`: both sides of it are warped separately.

    Args:
        effector: (T, 3) m.
        release: fractional frame.
        fps: frames per second.
        reference: curve from `compute_reference_curve`.
    Source: Fredriksson section 9.3.
    """
    _check_effector(effector, fps)
    half = (len(reference) + 1) // 2
    curve = compute_speed_curve(effector, release, fps, half)
    at = np.arange(len(effector), dtype=float)
    release = float(np.clip(release, 0.0, at[-1]))
    before = align_curves(curve[:half], reference[:half]) / (half - 1)
    after = align_curves(curve[half - 1 :], reference[half - 1 :]) / (half - 1)
    early = np.interp(at, np.linspace(0.0, max(release, 1e-9), half), before)
    late = np.interp(at, np.linspace(release, max(at[-1], release + 1e-9), half), after)
    return np.where(at < release, AT_RELEASE * early, AT_RELEASE + (1.0 - AT_RELEASE) * late)


def _warp_curve(curve: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Shift the samples of a speed curve to where the reference is most similar."""
    half = (len(curve) + 1) // 2
    sides = []
    for half_curve, half_reference in ((curve[:half], reference[:half]), (curve[half - 1 :], reference[half - 1 :])):
        sides.append(np.interp(np.arange(half), align_curves(half_curve, half_reference), half_curve))
    return np.concatenate([sides[0], sides[1][1:]])


def align_curves(curve: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Align a curve with a reference by dynamic time warping (Sakoe and Chiba 1978).

    The path of lowest cost through |curve_i - reference_j| is searched within a band about the diagonal. A sample
    that matches several indices gets their mean; flat parts of the path are made to increase, because a constant
    phase carries no information.

    Args:
        curve: (N,) speeds.
        reference: (M,) speeds.
    Returns:
        (N,) increasing indices into `reference`, 0 at the start and M - 1 at the end.
    """
    cost = np.abs(curve[:, None] - reference[None, :])
    count, length = cost.shape
    # best[i + 1, j + 1]: lowest cost of a path from the pair (0, 0) to the pair (i, j); row and column 0 are a border
    best = np.full((count + 1, length + 1), np.inf)
    best[0, 0] = 0.0
    band = max(int(_BAND * length), abs(count - length) + 1)
    for i in range(count):
        centre = i * (length - 1) // max(count - 1, 1)
        for j in range(max(0, centre - band), min(length, centre + band + 1)):
            # predecessors: both curves advance, only the curve advances, only the reference advances
            step = min(best[i, j], best[i, j + 1] + _STEP_COST, best[i + 1, j] + _STEP_COST)
            best[i + 1, j + 1] = cost[i, j] + step
    return _make_increasing(_average_matches(_trace_path(best), count), length)


def _trace_path(best: np.ndarray) -> list[tuple[int, int]]:
    """Trace the path of lowest cost back from the last pair; return its pairs (i, j) from the first."""
    i, j = best.shape[0] - 1, best.shape[1] - 1
    path = []
    while i and j:
        path.append((i - 1, j - 1))
        choices = ((best[i - 1, j - 1], i - 1, j - 1), (best[i - 1, j] + _STEP_COST, i - 1, j),
                   (best[i, j - 1] + _STEP_COST, i, j - 1))  # fmt: skip
        _, i, j = min(choices, key=lambda choice: choice[0])
    return path[::-1]


def _average_matches(path: list[tuple[int, int]], count: int) -> np.ndarray:
    """Average the reference indices that the path pairs with each of `count` samples."""
    pairs = np.array(path)
    number = np.bincount(pairs[:, 0], minlength=count)
    return np.bincount(pairs[:, 0], pairs[:, 1], minlength=count) / number


def _make_increasing(indices: np.ndarray, length: int) -> np.ndarray:
    """Interpolate through the middles of the flat parts of a path: from 0 to length - 1, strictly increasing."""
    values, place = np.unique(indices, return_inverse=True)
    at = np.bincount(place, np.arange(len(indices))) / np.bincount(place)
    at[0], at[-1] = 0.0, len(indices) - 1.0
    values[0], values[-1] = 0.0, length - 1.0
    return np.interp(np.arange(len(indices)), at, values)


def _check_effector(effector: np.ndarray, fps: float) -> None:
    """Raise InputError if the positions are not (T, 3) finite metres or the frame rate is not positive."""
    if np.ndim(effector) != 2 or np.shape(effector)[1] != 3 or not len(effector):
        raise InputError("phase", f"positions of shape {np.shape(effector)}", "(T, 3), at least one frame")
    if not (np.all(np.isfinite(effector)) and fps > 0):
        raise InputError("phase", "NaN or infinite values", "finite metres and frames per second")


def weigh_points(phase, points: int = 4, xp=np):
    """Compute the weights of the control points at a phase; they sum to one.

    The control points are evenly spaced, at 0, 1/3, 2/3 and 1 if there are four; phases beyond the ends count as the
    ends. One point is a plain feed-forward network. Written as one kernel around each point (the same four
    polynomials, by distance); the points before the first and after the last repeat these (eq. 3.26), so their
    weights are added to them.

    Args:
        phase: (...) of 0 .. 1.
        points: number of control points.
        xp: numpy or jax.numpy.
    Returns:
        (..., points) weights.
    """
    phase = xp.clip(xp.asarray(phase), 0.0, 1.0)[..., None]
    if points == 1:
        return xp.ones_like(phase)
    every = _evaluate_kernel(xp.abs(phase * (points - 1) - xp.arange(-1, points + 1)), xp)
    first, last = every[..., 0:1] + every[..., 1:2], every[..., -2:-1] + every[..., -1:]
    return xp.concatenate([first, every[..., 2:-2], last], -1)


def weigh_points_at(phase: float, points: int = 4) -> list[float]:
    """Compute the weights of the control points at one phase without numpy, many times as fast for a single frame.

    Source: Fredriksson eq. 3.25 (corrected) and 3.26.
    """
    if points == 1:
        return [1.0]
    along = min(max(phase, 0.0), 1.0) * (points - 1)
    k = min(int(along), points - 2)
    # the phase lies between points k and k + 1 at the share t; k - 1 and k + 2 are clamped to the ends
    t = along - k
    out = [0.0] * points
    out[max(k - 1, 0)] += t * (t * (1.0 - 0.5 * t) - 0.5)
    out[k] += 1.0 + t * t * (1.5 * t - 2.5)
    out[k + 1] += t * (t * (2.0 - 1.5 * t) + 0.5)
    out[min(k + 2, points - 1)] += t * t * (0.5 * t - 0.5)
    return out


def _evaluate_kernel(d, xp):
    """Evaluate a point's weight at a distance of `d` >= 0 points."""
    near = 1.0 + d * d * (1.5 * d - 2.5)
    far = 2.0 + d * (d * (2.5 - 0.5 * d) - 4.0)
    return xp.where(d < 1.0, near, xp.where(d < 2.0, far, 0.0))
