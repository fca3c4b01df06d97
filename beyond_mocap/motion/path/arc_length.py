"""Arc length of a path: metres at a parameter, and back (Path editing §3.2, eq. 4.1, by quadrature instead of steps).

The speed is integrated piece by piece: on each piece it is sampled at Gauss-Legendre nodes and written as a Legendre
series, whose integral is a polynomial. A piece whose series has not converged is halved, so that corners of the speed
(where it vanishes and returns) end up in pieces too short to matter. The table then needs no more path evaluations.
"""

from __future__ import annotations

import numpy as np

from .path import Path

TOLERANCE = 1e-8
"""Allowed error of a whole path's length, metres; for very long paths the share _ROUNDING of the length."""

_ROUNDING = 1e-11  # share of the speed below which errors are indistinguishable from rounding of large coordinates
_MAX_PIECES = 50_000  # pieces halved at a time

_ORDER = 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_ORDER)
_MAX_HALVINGS = 40
_MAX_NEWTON_STEPS = 60


def _build_series_matrix() -> np.ndarray:
    """Build the matrix (ORDER, ORDER) from values at the nodes to Legendre coefficients."""
    values = np.polynomial.legendre.legvander(_NODES, _ORDER - 1)
    return (values * _WEIGHTS[:, None] * (np.arange(_ORDER) + 0.5)).T


def _build_integral_matrix() -> np.ndarray:
    """Build the matrix (ORDER + 1, ORDER) from values at the nodes to coefficients of 1, x, x^2, ... of the integral
    from -1 to x.
    """
    legendre = np.polynomial.legendre
    columns = [legendre.leg2poly(legendre.legint(unit, lbnd=-1)) for unit in np.eye(_ORDER)]
    powers = np.zeros((_ORDER + 1, _ORDER))
    for order, column in enumerate(columns):
        powers[: len(column), order] = column
    return powers @ _build_series_matrix()


_SERIES, _INTEGRAL = _build_series_matrix(), _build_integral_matrix()


class ArcLength:
    """The arc length table of one path.

    Attributes:
        length: of the whole path, metres.
    """

    def __init__(self, path: Path):
        """Build the table of any path, also one with zero speed somewhere."""
        starts, widths, values = _split_pieces(path)
        self._edges = np.append(starts, path.domain[1])
        self._widths = widths
        self._powers = np.ascontiguousarray((0.5 * widths[:, None] * (values @ _INTEGRAL.T)).T)
        self._speeds = self._powers[1:] * np.arange(1, _ORDER + 1)[:, None]
        self._before = np.concatenate([[0.0], np.cumsum(np.maximum(self._powers.sum(axis=0), 0.0))])
        self.length = float(self._before[-1])

    def distance_at(self, u: np.ndarray) -> np.ndarray:
        """Return the metres (N,) from the path's start to parameters u (N,), which are clamped to the domain."""
        u = np.clip(np.asarray(u, dtype=float), self._edges[0], self._edges[-1])
        piece = np.clip(np.searchsorted(self._edges, u, side="right") - 1, 0, len(self._widths) - 1)
        local = 2.0 * (u - self._edges[piece]) / self._widths[piece] - 1.0
        return self._before[piece] + _evaluate_polynomials(self._powers[:, piece], local)

    def parameter_at(self, s: np.ndarray) -> np.ndarray:
        """Return the parameters (N,) at arc lengths s (N,) metres, which are clamped to 0 .. length."""
        s = np.clip(np.asarray(s, dtype=float), 0.0, self.length)
        piece = np.clip(np.searchsorted(self._before, s, side="right") - 1, 0, len(self._widths) - 1)
        remaining = s - self._before[piece]
        local = _solve_polynomials(self._powers[:, piece], self._speeds[:, piece], remaining)
        return self._edges[piece] + 0.5 * (local + 1.0) * self._widths[piece]


def _split_pieces(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Split the path into pieces on which the series of the speed converges.

    Returns:
        Starts (P,), widths (P,) and the speed at their nodes (P, ORDER), in rising order.
    """
    edges = np.asarray(path.breaks, dtype=float)
    starts, widths, done = edges[:-1], np.diff(edges), []
    allowed = TOLERANCE / (path.domain[1] - path.domain[0])
    for halving in range(_MAX_HALVINGS):
        at = starts[:, None] + 0.5 * (_NODES + 1.0) * widths[:, None]
        values = np.linalg.norm(path.at(at.ravel(), 1), axis=1).reshape(at.shape)
        # a piece is fine when the last two coefficients of its series are negligible
        tail = np.abs(values @ _SERIES[-2:].T).sum(axis=1)
        fine = tail <= max(allowed, _ROUNDING * values.max())
        if halving == _MAX_HALVINGS - 1 or np.count_nonzero(~fine) > _MAX_PIECES:
            fine[:] = True
        done.append((starts[fine], widths[fine], values[fine]))
        if fine.all():
            break
        half = 0.5 * widths[~fine]
        starts, widths = np.concatenate([starts[~fine], starts[~fine] + half]), np.concatenate([half, half])
    starts, widths, values = (np.concatenate(parts) for parts in zip(*done))
    order = np.argsort(starts)
    return starts[order], widths[order], values[order]


def _evaluate_polynomials(powers: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Evaluate polynomials (K, N), one for each x (N,), by Horner's rule."""
    value = powers[-1]
    for row in powers[-2::-1]:
        value = value * x + row
    return value


def _solve_polynomials(powers: np.ndarray, speeds: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Solve x (N,) in [-1, 1] at which rising polynomials (K, N) reach `targets` (N,): Newton's method, else bisection.
    """
    low, high = np.full(len(targets), -1.0), np.ones(len(targets))
    whole = powers.sum(axis=0)
    x = np.clip(2.0 * targets / np.where(whole > 0.0, whole, 1.0) - 1.0, -1.0, 1.0)
    for _ in range(_MAX_NEWTON_STEPS):
        off = _evaluate_polynomials(powers, x) - targets
        high, low = np.where(off > 0.0, x, high), np.where(off > 0.0, low, x)
        speed = _evaluate_polynomials(speeds, x)
        step = x - off / np.where(speed > 0.0, speed, 1.0)
        step = np.where((speed > 0.0) & (step >= low) & (step <= high), step, 0.5 * (low + high))
        moved = np.abs(step - x).max(initial=0.0)
        x = step
        if moved < 1e-13:
            break
    return x
