"""Where a ball lies in the hand: its centre in the hand's frame, from one marker on its surface (eq. 6.1).

The paper prints a radius of 0.37, which is 0.037 m in decimetres; here it is a parameter, and is fitted where the
marker was at enough different places of the ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_USUAL_SIGMA = 0.03  # m, how sure that is
_SIGMA = 0.003  # m, a marker's distance from the centre against the radius
_LEAST_SPREAD = 0.5  # of the radius, the smallest spread of the markers that tells it
_SIZES = (0.5, 2.0)  # of the expected radius
_ROUNDS = 40


@dataclass(frozen=True, eq=False)
class HandBall:
    """centre: (3,) m in the hand's frame. radius: m. sigma: m, how uncertain the centre is. fitted: whether the radius
    is."""

    centre: np.ndarray
    radius: float
    sigma: float
    fitted: bool = False


def ball_in_hand(points: np.ndarray, radius: float, usual: np.ndarray, fit_radius: bool = False) -> HandBall:
    """The centre that has all `points` (N, 3) m, markers in the hand's frame, on its surface (eq. 6.1).

    points: of one throw or, better, of several, in each of which the marker was elsewhere on the ball. A single place
    leaves the centre anywhere on a sphere about it: then `usual` (3,) m, where balls usually lie, chooses. radius: m,
    or what is expected. fit_radius: find it too, where the places are far enough apart to tell it.
    """
    points = np.asarray(points, float).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=-1)]
    if not len(points):
        return HandBall(np.asarray(usual, float), radius, _USUAL_SIGMA)
    places = _places(points)
    spread = float(np.median(np.linalg.norm(places - np.median(places, axis=0), axis=-1)))
    found = None
    if fit_radius and len(places) >= 4 and spread > _LEAST_SPREAD * radius:
        found = _fitted(places, radius, usual, True)
        off = np.abs(np.linalg.norm(places - found.centre, axis=-1) - found.radius)
        if not (_SIZES[0] * radius < found.radius < _SIZES[1] * radius and np.median(off) < _SIGMA):
            found = None  # points that are no ball of this kind
    return found or _fitted(places, radius, usual, False)


def _fitted(places: np.ndarray, radius: float, usual: np.ndarray, fitted: bool) -> HandBall:
    """Gauss-Newton from the usual side."""
    value = np.append(_start(places, radius, usual), radius)
    pull = np.append(np.full(3, 1.0 / _USUAL_SIGMA**2), 0.0)
    for _ in range(_ROUNDS):
        arms = value[:3] - places
        length = np.maximum(np.linalg.norm(arms, axis=-1), 1e-9)
        miss = length - value[3]
        weight = 1.0 / (_SIGMA**2 * (1.0 + (miss / (3.0 * _SIGMA)) ** 2))  # what lies far off counts less
        slope = np.column_stack([arms / length[:, None], np.full(len(places), -1.0 if fitted else 0.0)])
        normal = np.einsum("n,ni,nj->ij", weight, slope, slope) + np.diag(pull) + np.diag([1.0, 1.0, 1.0, 1e-3])
        toward = np.einsum("n,ni,n->i", weight, slope, miss) + pull * (value - np.append(usual, 0.0))
        step = np.linalg.solve(normal, toward)
        value = value - step
        if np.abs(step).max() < 1e-8:
            break
    sigma = float(np.sqrt(np.trace(np.linalg.inv(normal)[:3, :3])))
    return HandBall(value[:3], float(value[3]), sigma, fitted)


def _places(points: np.ndarray) -> np.ndarray:
    """At most some hundred of the points, evenly taken: neighbours in time say the same."""
    return points[:: max(len(points) // 400, 1)]


def _start(places: np.ndarray, radius: float, usual: np.ndarray) -> np.ndarray:
    """On the side of the markers' mean on which the usual centre is."""
    mean = places.mean(axis=0)
    toward = np.asarray(usual, float) - mean
    return mean + toward * (radius / max(np.linalg.norm(toward), 1e-9))
