"""Paths: smooth parametric curves in space that a motion is described relative to and can follow (Path editing §3.1).

A path lies on the ground under the body. Its parameter is seconds where it was fitted to a motion, and any rising value
where it was drawn; `arc_length` converts it to metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ..skeleton import freeze_array


class Path:
    """A curve in space, twice continuously differentiable, also where a closed curve joins its start.

    Attributes:
        domain: first and last parameter.
        breaks: (K,) rising parameters, the domain's ends among them, between which it is one polynomial.
        closed: whether it ends where it starts. Parameters beyond the domain then wrap around, else they are clamped.
    """

    domain: tuple[float, float]
    breaks: np.ndarray
    closed: bool = False

    def at(self, u: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Return the positions (N, 3) in metres at parameters u (N,), or their derivative of order `derivative`."""
        raise NotImplementedError

    def _to_domain(self, u: np.ndarray) -> np.ndarray:
        """Wrap or clamp parameters (N,) to the domain."""
        low, high = self.domain
        u = np.asarray(u, dtype=float)
        return low + (u - low) % (high - low) if self.closed else np.clip(u, low, high)


@dataclass(frozen=True, eq=False)
class PolynomialPath(Path):
    """One polynomial over the whole domain, as a series of Legendre polynomials, which stays exact for high degrees.

    Attributes:
        coefficients: (degree + 1, 3) metres.
        domain: see `Path`.
    """

    coefficients: np.ndarray
    domain: tuple[float, float]

    def __post_init__(self):
        object.__setattr__(self, "coefficients", freeze_array(self.coefficients))

    @property
    def breaks(self) -> np.ndarray:
        """See `Path`."""
        return np.linspace(*self.domain, len(self.coefficients))  # one piece would do, but its bends need as many

    def at(self, u: np.ndarray, derivative: int = 0) -> np.ndarray:
        """See `Path`."""
        low, high = self.domain
        scaled = (2.0 * self._to_domain(u) - low - high) / (high - low)
        legendre = np.polynomial.legendre
        series = self.coefficients if derivative == 0 else legendre.legder(self.coefficients, derivative)
        return legendre.legval(scaled, series).T * (2.0 / (high - low)) ** derivative


@dataclass(frozen=True, eq=False)
class SplinePath(Path):
    """A B-spline.

    Attributes:
        knots: (P + degree + 1,) not falling.
        coefficients: (P, 3) metres, its control points.
        degree: at least 1 (below 3 it is less smooth than a Path should be: at the user's request).
        closed: the last `degree` points repeat the first.
    """

    knots: np.ndarray
    coefficients: np.ndarray
    degree: int = 3
    closed: bool = False

    def __post_init__(self):
        knots, coefficients = freeze_array(self.knots), freeze_array(self.coefficients)
        if len(knots) != len(coefficients) + self.degree + 1 or self.degree < 1:
            raise InputError(
                "path", f"{len(knots)} knots, {len(coefficients)} control points, degree {self.degree}",
                "as many knots as control points + degree + 1",
            )
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "coefficients", coefficients)

    @cached_property
    def domain(self) -> tuple[float, float]:
        """See `Path`."""
        return float(self.knots[self.degree]), float(self.knots[-self.degree - 1])

    @cached_property
    def breaks(self) -> np.ndarray:
        """See `Path`."""
        return np.unique(self.knots[self.degree : len(self.knots) - self.degree])

    @cached_property
    def _spline(self):
        from scipy.interpolate import BSpline

        return BSpline(self.knots, self.coefficients - self.coefficients[0], self.degree)

    def at(self, u: np.ndarray, derivative: int = 0) -> np.ndarray:
        """See `Path`."""
        # relative to the first control point: far from the origin derivatives would lose precision
        values = self._spline(self._to_domain(u), derivative)
        return values if derivative else values + self.coefficients[0]
