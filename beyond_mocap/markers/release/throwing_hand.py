"""The throwing hand, frame by frame, from its own markers; where the ball lies in it, and a first guess of the release.

A solved motion is filtered, which removes the very peak of a throw; the hand's markers are not filtered. Where at least
three markers near the wrist are visible, they give the hand's frame (eq. 3.14), else the motion does. The ball's centre
in that frame follows from a marker on its surface (eq. 6.1). The paper prints a radius of 0.37, which is 0.037 m in
decimetres; here it is a parameter, and is fitted where the marker was at enough different places of the ball.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...ball.flight import Launch, simulate_flight
from ...ball.physics import Ball
from ...base.easing import smoothstep
from ...base.time_series import find_runs
from ...motion.hand import Hand
from ..rigid_fit import fit_rigid
from ..trial import MarkerTrial

MAX_WRIST_DISTANCE = 0.14  # metres from the wrist within which a marker belongs to the hand
_ITERATIONS = 4  # iterations of places and shift
_LIFTS = sorted(np.arange(-40, 41) / 100.0, key=abs)  # metres, vertical shifts that are tried, small ones first
_FOREARM_MARGIN = 0.02  # metres nearer to the elbow than the wrist; from there on markers belong to the forearm
_KNUCKLES = (0.055, 0.115)  # metres from the wrist, where a marker is on the heads of the metacarpals
_REACH_OF_KNUCKLES = 2.22  # fingers are 1.22 times the third metacarpal, Buchholz et al. 1992 (see `without_ball`)
_MAX_MISFIT_RATIO = 4.0  # multiples of the usual misfit of the hand's markers, above which one of them is misplaced
_MAX_SPREAD = 0.012  # metres of spread in the hand's frame, below which a marker belongs to the hand

_USUAL_SIGMA = 0.03  # metres, uncertainty of the usual place of a ball's centre
_SIGMA = 0.003  # metres, deviation of a marker's distance from the centre from the radius
_MIN_SPREAD_SHARE = 0.5  # spread of the marker's places, as a share of the radius, from which on it is fitted
_RADIUS_RANGE = (0.5, 2.0)  # range of a fitted radius, as shares of the expected one
_MAX_STEPS = 40  # Gauss-Newton steps at most

_SETTLING_SECONDS = 0.10  # s before the release in which the ball moves from its usual place to where it leaves
_MAX_FLIGHT = 10.0  # s of flight, bounces and rolling at most

# distance from hand to marker, relative to the held one, at which the ball has left (section 6.2)
RELEASE_DISTANCE_RATIO = 1.1
_HELD_SECONDS = (0.30, 0.05)  # s before the hand is fastest, between which the ball is held
_MIN_RELEASED_FRAMES = 3  # frames for which the distance must stay larger


def refine_hand(hand: Hand, trial: MarkerTrial, excluded: tuple[str, ...] = ()) -> Hand:
    """Replace the hand's motion by that of its own markers, in every frame in which they determine it.

    A constant shift of the motion against the markers, as from placing feet on the floor, is found and removed.

    Args:
        hand: the hand of a solved motion, T frames.
        trial: T frames, evenly spaced.
        excluded: labels that are not on the hand (the ball's).
    Returns:
        The hand with origin, rotation and reach from its markers.
    """
    lift = _find_vertical_shift(hand, trial, excluded)
    names, seen = _select_hand_markers(replace(hand, origin=hand.origin + lift, elbow=hand.elbow + lift), trial,
                                       excluded)
    if not names:
        return hand
    shift = lift
    for _ in range(_ITERATIONS):
        local = np.einsum("tji,tmj->tmi", hand.rotation, seen - (hand.origin + shift)[:, None, :])
        places = np.nanmedian(local, axis=0)
        shift = shift + np.nanmedian(seen - _place_markers(hand, shift, places), axis=(0, 1))
    moved = replace(hand, origin=hand.origin + shift, elbow=hand.elbow + shift, shift=shift)
    fit = fit_rigid(places, seen)
    is_reliable = fit.is_determined & (fit.rms < max(_MAX_MISFIT_RATIO * _compute_median(fit.rms), _MAX_SPREAD))
    known = np.isfinite(seen).all(axis=-1) & ~(fit.is_determined & ~is_reliable)[:, None]
    offset = np.where(known[..., None], seen - _place_markers(hand, shift, places), 0.0).sum(axis=1)
    offset = offset / np.maximum(known.sum(axis=1), 1)[:,
                                                       None]  # one or two markers can move the hand, but not rotate it
    return replace(moved, reach=_estimate_reach(hand, places), origin=np.where(is_reliable[:, None], fit.shift,
                                                                               moved.origin + offset),
                   rotation=np.where(is_reliable[:, None, None], fit.rotation, moved.rotation), markers=names)


def _compute_median(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0


def _estimate_reach(hand: Hand, places: np.ndarray) -> float:
    """Estimate the length in metres from wrist to fingertip: mean of the skeleton's and that from a knuckle marker."""
    along = places @ hand.finger
    knuckles = along[(along > _KNUCKLES[0]) & (along < _KNUCKLES[1])]
    return hand.reach if not len(knuckles) else 0.5 * (hand.reach + _REACH_OF_KNUCKLES * float(np.median(knuckles)))


def _place_markers(hand: Hand, shift: np.ndarray, places: np.ndarray) -> np.ndarray:
    return (hand.origin + shift)[:, None, :] + np.einsum("tij,mj->tmi", hand.rotation, places)


def _find_vertical_shift(hand: Hand, trial: MarkerTrial, excluded: tuple[str, ...]) -> np.ndarray:
    """Find the vertical shift (3,) metres between motion and markers.

    With the right shift, the distances of the hand's own markers from the wrist do not change over time.
    """
    is_frequent = np.count_nonzero(trial.visibility[:: max(len(trial) // 300, 1)], axis=0) > 2
    candidates = [number for number, label in enumerate(trial.labels) if label not in excluded and is_frequent[number]]
    few = trial.positions[:: max(len(trial) // 300, 1), candidates]
    if not candidates:
        return np.zeros(3)
    origin = hand.origin[:: max(len(trial) // 300, 1), None, :]
    near = np.flatnonzero(np.nanmedian(np.linalg.norm(few[..., :2] - origin[..., :2], axis=-1), axis=0)
                          < MAX_WRIST_DISTANCE)
    best, found = np.inf, 0.0
    for height in _LIFTS if len(near) >= 3 else ():
        away = np.linalg.norm(few[:, near] - origin - [0.0, 0.0, height], axis=-1)
        spread = np.sort(np.nanstd(away, axis=0))[:3].sum()
        if spread < best:
            best, found = spread, height
    return np.array([0.0, 0.0, found])


def _select_hand_markers(hand: Hand, trial: MarkerTrial, excluded: tuple[str, ...]) -> tuple[tuple[str, ...],
        np.ndarray]:
    """Select the markers that stay with the hand: labels and places (T, M, 3) metres."""
    away = np.linalg.norm(trial.positions - hand.origin[:, None, :], axis=-1)
    forearm = float(np.median(np.linalg.norm(hand.origin - hand.elbow, axis=-1)))
    selected = []
    for number, label in enumerate(trial.labels):
        known = np.isfinite(away[:, number])
        if label in excluded or np.count_nonzero(known) < max(0.3 * len(trial), 1):
            continue
        distance = away[known, number]
        spread = np.subtract(*np.percentile(distance, [90, 10]))
        arm = np.median(np.linalg.norm(trial.positions[known, number] - hand.elbow[known], axis=-1))
        if np.median(distance) < MAX_WRIST_DISTANCE and spread < 3.0 * _MAX_SPREAD and arm > forearm - _FOREARM_MARGIN:
            selected.append(number)
    return tuple(trial.labels[number] for number in selected), trial.positions[:, selected]


@dataclass(frozen=True, eq=False)
class HandBall:
    """Where a ball lies in the hand.

    Attributes:
        centre: (3,) metres in the hand's frame.
        radius: metres.
        sigma: metres, uncertainty of the centre.
        is_radius_fitted: whether the radius was fitted.
    """

    centre: np.ndarray
    radius: float
    sigma: float
    is_radius_fitted: bool = False


def fit_hand_ball(points: np.ndarray, radius: float, usual_centre: np.ndarray, fit_radius: bool = False) -> HandBall:
    """Fit the centre of a sphere that has all points on its surface.

    Args:
        points: (N, 3) metres, markers in the hand's frame, of one throw or, better, of several with the marker
            elsewhere on the ball.
        radius: metres, known or expected.
        usual_centre: (3,) metres, where balls usually lie; it decides where one place leaves the centre undetermined.
        fit_radius: fit the radius too, where the places are far enough apart.
    Returns:
        The ball in the hand.
    Source: Fredriksson section 6.1, equation (6.1).
    """
    points = np.asarray(points, float).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=-1)]
    if not len(points):
        return HandBall(np.asarray(usual_centre, float), radius, _USUAL_SIGMA)
    places = points[:: max(len(points) // 400, 1)]  # neighbours in time add no information
    spread = float(np.median(np.linalg.norm(places - np.median(places, axis=0), axis=-1)))
    fit = None
    if fit_radius and len(places) >= 4 and spread > _MIN_SPREAD_SHARE * radius:
        fit = _fit_sphere(places, radius, usual_centre, True)
        off = np.abs(np.linalg.norm(places - fit.centre, axis=-1) - fit.radius)
        if not (_RADIUS_RANGE[0] * radius < fit.radius < _RADIUS_RANGE[1] * radius and np.median(off) < _SIGMA):
            fit = None  # the points do not fit a ball of this kind
    return fit or _fit_sphere(places, radius, usual_centre, False)


def _fit_sphere(places: np.ndarray, radius: float, usual_centre: np.ndarray, fit_radius: bool) -> HandBall:
    """Fit the sphere by Gauss-Newton, started on the usual side of the markers."""
    mean = places.mean(axis=0)
    toward = np.asarray(usual_centre, float) - mean  # from the markers' mean to the usual centre
    # unknowns: centre (3) and radius
    unknowns = np.append(mean + toward * (radius / max(np.linalg.norm(toward), 1e-9)), radius)
    pull = np.append(np.full(3, 1.0 / _USUAL_SIGMA**2), 0.0)
    for _ in range(_MAX_STEPS):
        arms = unknowns[:3] - places
        length = np.maximum(np.linalg.norm(arms, axis=-1), 1e-9)
        miss = length - unknowns[3]
        weight = 1.0 / (_SIGMA**2 * (1.0 + (miss / (3.0 * _SIGMA)) ** 2))  # outliers have less weight
        jacobian = np.column_stack([arms / length[:, None], np.full(len(places), -1.0 if fit_radius else 0.0)])
        normal = np.einsum("n,ni,nj->ij", weight, jacobian, jacobian) + np.diag(pull) + np.diag([1.0, 1.0, 1.0, 1e-3])
        toward = np.einsum("n,ni,n->i", weight, jacobian, miss) + pull * (unknowns - np.append(usual_centre, 0.0))
        step = np.linalg.solve(normal, toward)
        unknowns = unknowns - step
        if np.abs(step).max() < 1e-8:
            break
    sigma = float(np.sqrt(np.trace(np.linalg.inv(normal)[:3, :3])))
    return HandBall(unknowns[:3], float(unknowns[3]), sigma, fit_radius)


def place_ball(hand: Hand, centre: np.ndarray, launch: Launch, ball: Ball, ground: float = 0.0) -> np.ndarray:
    """Place the ball in every frame of the hand.

    Shortly before the release, the ball moves to the place of the launch on a spline in the hand's frame, without a
    jump in place or speed.

    Args:
        hand: T frames.
        centre: (3,) metres, where the ball lies in the hand's frame.
        launch: how it leaves, s from frame 0.
        ball: its physics.
        ground: metres, height of the ground.
    Returns:
        (T, 3) metres, the ball's centre.
    """
    times = hand.times
    held = hand.to_world(centre)
    release_place = _interpolate_at(held, hand.fps, launch.time)
    gap = np.asarray(launch.position, float) - release_place
    k = int(np.clip(round(launch.time * hand.fps), 0, len(hand) - 1))
    gap_in_hand = hand.rotation[k].T @ gap
    share = smoothstep(1.0 - (launch.time - times) / _SETTLING_SECONDS)
    places = held + share[:, None] * np.einsum("tij,j->ti", hand.rotation, gap_in_hand)
    in_flight = times > launch.time
    if in_flight.any():
        seconds = min(float(times[-1] - launch.time), _MAX_FLIGHT) + 1.0 / hand.fps
        places[in_flight] = simulate_flight(launch, ball, seconds, ground).at(times[in_flight])
    return places


def _interpolate_at(held: np.ndarray, fps: float, time: float) -> np.ndarray:
    """Interpolate a place (3,) at a time between two frames."""
    at = np.clip(time * fps, 0.0, len(held) - 1.0)
    low = min(int(at), len(held) - 2)
    return held[low] + (at - low) * (held[low + 1] - held[low])


def compute_speeds(places: np.ndarray, fps: float) -> np.ndarray:
    """Compute the speed of a point by differences over two frames.

    Args:
        places: (T, 3) metres.
        fps: frames per second.
    Returns:
        (T,) m/s.
    """
    if len(places) < 2:
        return np.zeros(len(places))
    return np.linalg.norm(np.gradient(places, 1.0 / fps, axis=0), axis=-1)


def compute_steady_speeds(places: np.ndarray, fps: float) -> np.ndarray:
    """Compute speeds like `compute_speeds`, with single outlier frames removed by a median filter.

    Returns:
        (T,) m/s.
    """
    from scipy.signal import medfilt

    return medfilt(compute_speeds(places, fps), 5)


def find_fastest_frame(places: np.ndarray, fps: float) -> int:
    """Find the frame in which a point (T, 3) metres is fastest, ignoring single outliers."""
    return int(np.argmax(compute_steady_speeds(places, fps)))


def find_release_by_distance(hand: np.ndarray, marker: np.ndarray, fps: float) -> int | None:
    """Find the frame from which on the ball's marker is 10 % further from the hand than while held.

    Args:
        hand: (T, 3) metres.
        marker: (T, 3) metres, NaN where not visible.
        fps: frames per second.
    Returns:
        The frame; None if there is none, or the marker is visible too rarely.
    Source: Fredriksson section 6.2.
    """
    away = np.linalg.norm(marker - hand, axis=-1)
    seen = np.flatnonzero(np.isfinite(away))
    if len(seen) < 2 * _MIN_RELEASED_FRAMES:
        return None
    peak = find_fastest_frame(hand, fps)
    first, last = (max(peak - int(round(seconds * fps)), 0) for seconds in _HELD_SECONDS)
    held = away[first : max(last, first + 1)]
    held = held[np.isfinite(held)]
    if not len(held):  # hidden by the fingers: the smallest distances are used instead
        held = np.sort(away[seen])[: max(len(seen) // 20, 3)]
    is_further = away[seen] > RELEASE_DISTANCE_RATIO * np.median(held)
    releases = [a for a, b in find_runs(is_further) if b - a >= _MIN_RELEASED_FRAMES and seen[a] >= first]
    return int(seen[releases[0]]) if releases else None
