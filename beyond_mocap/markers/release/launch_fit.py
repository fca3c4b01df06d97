"""Fit the launch of a ball to a marker on its surface: release time, trajectory and spin together (eq. 6.2-6.4).

Before the release the marker is fixed in the hand's frame; after it, it circles the centre of a flying ball:

    y(t) = p + v (t - t0) + g (t - t0)^2 / 2 + air + cos(w (t - t0)) a + sin(w (t - t0)) b

This is eq. 6.3 with the rotating marker written as its circle (a, b: where it starts and where it is a quarter turn
later; its part along the spin axis is included in p). For a given rate w the equation is linear in p, v, a and b, so
all release times, on both sides of the first guess, and all rates are tried at once. The paper searched before the
guess alone, with the hand's velocity as the ball's: its throws came out 1.15 m/s too slow (section 8.2.2). Here the
speed follows from the flight, and only the time from the hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...ball.physics import Ball, compute_air_acceleration
from ...base.time_series import interpolate_columns

MAX_SPIN = 2.0 * np.pi * 50.0  # rad/s: 3000 revolutions per minute, the maximum of pitched baseballs
_RATE_COUNT = 60  # spin rates that are tried
_MIN_FRAMES = 2  # frames of flight that must be visible
_FIRST_SECONDS = 0.11  # s of flight with which release and spin are searched
_LONGER_SECONDS = (0.17, 0.25, 0.35)  # s of flight that are used next, as long as the ball still flies
_LATER_SIGMA = 0.03  # metres by which a flight may deviate a moment later, before air and spin are known
_HELD_SECONDS = 0.12  # s before the release in which the marker is fixed in the hand
_HAND_SPEED_UNCERTAINTY = 0.2  # uncertainty of the hand's speed as the ball's, as a share of it
_NOISE = 0.0015  # metres, noise of a marker
_ROBUST_LIMIT = 5.0  # multiples of the noise beyond which a marker has less weight
_FINE_STEP = 0.125  # frames, the finest step of the release time


@dataclass(frozen=True, eq=False)
class HeldMarker:
    """The evidence of the hand over T frames.

    Attributes:
        marker: (T, 3) metres, where the ball's marker would be if the ball were held throughout.
        centre: (T, 3) metres, the ball's centre, likewise.
        velocity: (T, 3) m/s of the ball, likewise.
        sigma: metres, uncertainty of the marker's place.
    """

    marker: np.ndarray
    centre: np.ndarray
    velocity: np.ndarray
    sigma: float = 0.006


@dataclass(frozen=True, eq=False, kw_only=True)
class LaunchFit:
    """How the ball left the hand.

    Attributes:
        time: s from frame 0.
        position: (3,) metres, its centre at that time.
        velocity: (3,) m/s.
        spin: (3,) rad/s, zero where unknown.
        offset: (3,) metres from centre to marker at the release.
        circle: metres, radius of the marker's circle; no ball is smaller.
        residual: metres, root mean square of the marker in flight.
        time_sigma: s, one standard deviation.
        speed_sigma: m/s, one standard deviation.
        frames: visible frames of flight.
        seconds: s of flight that were used.
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    offset: np.ndarray
    circle: float
    residual: float
    time_sigma: float
    speed_sigma: float
    frames: int
    seconds: float


def fit_launch(marker: np.ndarray, held: HeldMarker, fps: float, guess: float, ball: Ball, radius: float,
               window: float = 0.12) -> LaunchFit | None:
    """Fit the launch that explains the ball's marker.

    Args:
        marker: (T, 3) metres, NaN where not visible.
        held: the evidence of the hand.
        fps: frames per second.
        guess: s, first guess of the release time.
        ball: says what acts on it in the air.
        radius: metres, of the ball.
        window: s before and after the guess in which release times are tried.
    Returns:
        The launch; None where the marker is not visible away from the hand in at least two frames.
    Source: Fredriksson section 6.2, equations (6.2) to (6.4).
    """
    search = _LaunchSearch(marker, held, fps, ball, radius)
    first, last = max(guess - window, search.times[1]), min(guess + window, search.times[-2])
    release_times = np.arange(np.ceil(first * fps), np.floor(last * fps) + 1) / fps
    rates = np.arange(1, _RATE_COUNT + 1) * (min(MAX_SPIN, 0.9 * np.pi * fps) / _RATE_COUNT)
    flights = [(flight, t) for t in release_times
               if (flight := search.fit_flight(t, t + _FIRST_SECONDS, rates)) is not None]
    if not flights or not search.has_left_hand(last):
        return None
    best, release_time = min(flights, key=lambda found: found[0].cost + search.compute_later_cost(*found))
    best, release_time = search.refine_flight(best, release_time, rates[1] - rates[0], _FIRST_SECONDS)
    seconds = _FIRST_SECONDS
    # use more of the flight as long as it brings more frames and the residual stays small
    for longer in _LONGER_SECONDS:
        longer_fit, longer_time = search.refine_flight(best, release_time, 2.0 / longer, longer)
        if longer_fit.frames == best.frames or longer_fit.residual > max(1.5 * best.residual, 2.0 * _NOISE):
            break
        best, release_time, seconds = longer_fit, longer_time, longer
    return search.build_result(best, release_time, seconds)


@dataclass(eq=False, kw_only=True)
class _Flight:
    """One solved flight.

    Attributes:
        cost: with the held frames before it.
        velocity: (3,) m/s.
        place: (3,) metres, p of eq. 6.3.
        circle: a and b of eq. 6.3, (3,) metres each.
        rate: rad/s of spin.
        residual: metres, root mean square.
        speed_sigma: m/s, one standard deviation.
        frames: frames of flight.
    """

    cost: float
    velocity: np.ndarray
    place: np.ndarray
    circle: tuple[np.ndarray, np.ndarray]
    rate: float
    residual: float
    speed_sigma: float
    frames: int


class _LaunchSearch:
    """Flights for one throw. `air` is the effect of drag and lift on the marker, once a launch is known."""

    def __init__(self, marker, held: HeldMarker, fps: float, ball: Ball, radius: float):
        self.marker, self.held, self.fps, self.ball, self.radius = marker, held, fps, ball, radius
        self.times = np.arange(len(marker)) / fps
        self.seen = np.isfinite(marker).all(axis=-1)
        self.air = np.zeros_like(marker)

    def fit_flight(self, t0: float, end: float, rates: np.ndarray) -> _Flight | None:
        """Solve the flight from `t0` to `end` for the best of `rates` (R,) rad/s; None without frames.

        For each rate a linear least-squares problem in p, v, a and b (4 x 3 unknowns), with the prior as four more
        rows.
        """
        used = self.seen & (self.times > t0) & (self.times <= end)
        count = int(np.count_nonzero(used))
        if count < _MIN_FRAMES:
            return None
        tau = self.times[used] - t0
        target = self.marker[used] - self.air[used]
        target[:, 2] += 0.5 * self.ball.gravity * tau**2
        # columns 1, t, cos(w t) and sin(w t) of eq. 6.3 for each spin rate w
        basis = np.empty((len(rates), count, 4))
        basis[..., 0], basis[..., 1] = 1.0, tau
        basis[..., 2], basis[..., 3] = np.cos(rates[:, None] * tau), np.sin(rates[:, None] * tau)
        prior_rows, prior_values = self._build_prior(t0)
        basis, target = basis / _NOISE, target / _NOISE
        normal = np.einsum("rni,rnj->rij", basis, basis) + np.einsum("ki,kj->ij", prior_rows, prior_rows)
        right = np.einsum("rni,nc->ric", basis, target) + np.einsum("ki,kc->ic", prior_rows, prior_values)
        solved = np.linalg.solve(normal, right)
        miss = np.sum((np.einsum("rni,ric->rnc", basis, solved) - target) ** 2, axis=-1)
        prior_misses = np.einsum("ki,ric->rkc", prior_rows, solved) - prior_values
        cost = _limit_squares(miss).sum(axis=-1) + np.sum(prior_misses**2, axis=(-1, -2))
        k = int(np.argmin(cost))
        # degrees of freedom: 3 coordinates a frame minus 12 unknowns
        excess = max(float(miss[k].sum()) / max(3 * count - 12, 1), 1.0)
        sigma = float(np.sqrt(np.linalg.inv(normal[k])[1, 1] * excess))
        residual = float(np.sqrt(miss[k].mean())) * _NOISE
        place, velocity, a, b = solved[k]
        total = float(cost[k]) + self._compute_held_cost(t0)
        return _Flight(cost=total, velocity=velocity, place=place, circle=(a, b), rate=float(rates[k]),
                       residual=residual, speed_sigma=sigma, frames=count)

    def has_left_hand(self, last: float) -> bool:
        """Return whether the marker is seen away from its held place, up to a first flight after `last`."""
        used = self.seen & (self.times <= last + _FIRST_SECONDS)
        away = np.linalg.norm(self.marker[used] - self.held.marker[used], axis=-1)
        return np.count_nonzero(away[-_MIN_FRAMES:] > 3.0 * self.held.sigma) >= _MIN_FRAMES

    def compute_later_cost(self, flight: _Flight, t0: float) -> float:
        """Compute the cost of the marker's deviation from this flight in the next stretch.

        A hand that hardly moves yet also looks like a flight, but does not continue as one.
        """
        end = t0 + _FIRST_SECONDS
        used = self.seen & (self.times > end) & (self.times <= end + _FIRST_SECONDS)
        tau = (self.times[used] - t0)[:, None]
        trajectory = flight.place + flight.velocity * tau - [0.0, 0.0, 0.5 * self.ball.gravity] * tau**2
        away = np.sum((self.marker[used] - trajectory) ** 2, axis=-1) / _LATER_SIGMA**2
        return float(np.sum(_limit_squares(away)))

    def _build_prior(self, t0: float) -> tuple[np.ndarray, np.ndarray]:
        """Build the prior as four rows: where the marker leaves, the hand's speed, and the size of the circle."""
        place, velocity = _interpolate_at(self.held.marker, self.fps, t0), _interpolate_at(self.held.velocity, self.fps,
                t0)
        speed_sigma = max(_HAND_SPEED_UNCERTAINTY * float(np.linalg.norm(velocity)), 1.0)
        weight = 1.0 / self.held.sigma
        known = np.diag([weight, 1.0 / speed_sigma, 1.0 / self.radius, 1.0 / self.radius])
        known[0, 2] = weight
        return known, np.stack([place * weight, velocity / speed_sigma, np.zeros(3), np.zeros(3)])

    def _compute_held_cost(self, t0: float) -> float:
        """Compute the cost of the marker's deviation from its held place, up to `t0`."""
        used = self.seen & (self.times > t0 - _HELD_SECONDS) & (self.times <= t0)
        away = np.sum((self.marker[used] - self.held.marker[used]) ** 2, axis=-1) / (0.5 * self.held.sigma) ** 2
        return float(np.sum(_limit_squares(away)))

    def refine_flight(self, flight: _Flight, t0: float, width: float, seconds: float) -> tuple[_Flight, float]:
        """Refine a flight with `seconds` of samples: spin rate, release time and the effect of air.

        Returns the flight and its release time.
        """
        end = t0 + seconds
        for iteration in range(4):
            self.air = _simulate_air(self.times, t0, flight.velocity, self._compute_spin(flight, t0)[0], self.ball)
            rates = np.maximum(flight.rate + np.linspace(-width, width, 21), 1e-3)
            flight = self.fit_flight(t0, end, rates) or flight
            width = max(width / 5.0, 0.05)
            # release times are refined in ever smaller steps around the best
            step = (1.0, 0.5, 0.25, _FINE_STEP)[iteration] / self.fps
            candidates = [(self.fit_flight(t, end, np.array([flight.rate])), t) for t in t0 + step * np.arange(-3, 4)]
            flight, t0 = min(((f, t) for f, t in [*candidates, (flight, t0)] if f is not None),
                             key=lambda ft: ft[0].cost)
        return flight, t0

    def _compute_spin(self, flight: _Flight, t0: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute spin (3,) rad/s, offset (3,) metres of the marker from the centre, and the centre (3,) metres at the
        release.

        The plane of the circle gives the axis. The offset along it may have either sign; the one is taken that puts the
        centre nearer to where the hand has it.
        """
        a, b = flight.circle
        marker, held_centre, radius = flight.place + a, _interpolate_at(self.held.centre, self.fps, t0), self.radius
        axis = np.cross(a, b)
        size = float(np.linalg.norm(axis))
        if size < (0.2 * radius) ** 2 or flight.frames < 5:
            direction = marker - held_centre
            offset = direction * (radius / max(float(np.linalg.norm(direction)), 1e-9))
            return np.zeros(3), offset, marker - offset
        axis = axis / size
        along = np.sqrt(max(radius**2 - float(a @ a), 0.0)) * axis
        offset = min((a + along, a - along), key=lambda o: float(np.linalg.norm(marker - o - held_centre)))
        return axis * flight.rate, offset, marker - offset

    def build_result(self, flight: _Flight, t0: float, seconds: float) -> LaunchFit:
        """Build the final launch; the uncertainty of its time is the shift at which the cost grows by one."""
        rate, end = np.array([flight.rate]), t0 + seconds
        sides = []
        for sign in (-1.0, 1.0):
            shifts = sign * np.arange(1, 41) * _FINE_STEP / self.fps
            worse = [f is None or f.cost > flight.cost + 1.0
                     for f in (self.fit_flight(t0 + s, end, rate) for s in shifts)]
            sides.append(abs(shifts[worse.index(True)]) if True in worse else abs(shifts[-1]))
        spin, offset, centre = self._compute_spin(flight, t0)
        sigma = float(np.hypot(np.mean(sides), 0.2 / self.fps))
        return LaunchFit(time=float(t0), position=centre, velocity=flight.velocity, spin=spin, offset=offset,
                         circle=float(np.linalg.norm(flight.circle[0])), residual=flight.residual, time_sigma=sigma,
                         speed_sigma=flight.speed_sigma, frames=flight.frames, seconds=seconds)  # fmt: skip


def _limit_squares(squares: np.ndarray) -> np.ndarray:
    """Reduce the weight of large squared misses (in units of noise)."""
    limit = _ROBUST_LIMIT**2
    return np.where(squares < limit, squares, limit * (1.0 + np.log(np.maximum(squares, limit) / limit)))


def _interpolate_at(values: np.ndarray, fps: float, t: float) -> np.ndarray:
    """Interpolate values (T, 3) at one time, by the parabola through the three nearest frames."""
    k = int(np.clip(round(t * fps), 1, len(values) - 2))
    x = t * fps - k
    low, mid, high = values[k - 1], values[k], values[k + 1]
    return mid + 0.5 * x * (high - low) + 0.5 * x * x * (high - 2.0 * mid + low)


def _simulate_air(times: np.ndarray, t0: float, velocity: np.ndarray, spin: np.ndarray, ball: Ball) -> np.ndarray:
    """Simulate by how much air moves a ball off the parabola, (T, 3) metres, launched at `t0` with `velocity` and
    `spin`.
    """
    step = 0.002
    count = int(min(max(times[-1] - t0, step), 2.0 * _LONGER_SECONDS[-1]) / step) + 2
    v, offsets, drift = np.array(velocity, float), np.zeros((count, 3)), np.zeros(3)
    for k in range(1, count):
        push = compute_air_acceleration(v[None], spin[None], ball)[0]
        extra = push + [0.0, 0.0, ball.gravity]
        offsets[k] = offsets[k - 1] + drift * step + 0.5 * extra * step**2
        drift, v = drift + extra * step, v + push * step
    at = np.clip(times - t0, 0.0, (count - 1) * step)
    return interpolate_columns(at, np.arange(count) * step, offsets)
