"""Shirt and shorts: solids around the trunk, looser than the body, with folds."""

from __future__ import annotations

import numpy as np

from ...base.easing import smoothstep
from ..landmarks import SHOULDER
from .fields import Field, build_chain, build_ellipsoid, build_loft, join, mirror, place
from .limbs import ARM_TURN, build_arm_core

_TRUNK = (  # height; middle, front, back, half widths
    (0.800, 0.000, 0.000, 0.140, 0.140, 0.192, 0.192), (0.880, 0.000, 0.000, 0.138, 0.146, 0.190, 0.190),
    (0.940, 0.000, 0.000, 0.132, 0.142, 0.184, 0.184), (1.000, 0.000, 0.000, 0.125, 0.126, 0.173, 0.173),
    (1.060, 0.000, 0.000, 0.121, 0.112, 0.164, 0.164), (1.120, 0.000, 0.000, 0.121, 0.110, 0.162, 0.162),
    (1.200, 0.000, 0.000, 0.126, 0.118, 0.170, 0.170), (1.280, -0.004, 0.000, 0.134, 0.124, 0.182, 0.182),
    (1.350, -0.008, 0.000, 0.131, 0.124, 0.186, 0.186), (1.410, -0.012, 0.000, 0.115, 0.118, 0.180, 0.180),
    (1.460, -0.016, 0.000, 0.092, 0.104, 0.150, 0.150), (1.505, -0.018, 0.000, 0.076, 0.084, 0.100, 0.100),
    (1.540, -0.018, 0.000, 0.068, 0.074, 0.072, 0.072), (1.580, -0.012, 0.000, 0.062, 0.070, 0.066, 0.066),
)


def build_shirt() -> Field:
    """Build the shirt with both sleeves, open at no end."""
    both = (1.0, -1.0)
    trunk = build_loft(_TRUNK, 2.3)
    traps = [build_chain([(-0.026, s * 0.040, 1.530, 0.032), (-0.028, s * 0.105, 1.492, 0.036),
                          (-0.026, s * 0.165, 1.462, 0.044)]) for s in both]
    chest = [build_ellipsoid((0.062, s * 0.070, 1.365), (0.060, 0.088, 0.062)) for s in both]
    blades = [build_ellipsoid((-0.094, s * 0.085, 1.375), (0.042, 0.070, 0.085)) for s in both]
    lats = [build_ellipsoid((-0.030, s * 0.150, 1.310), (0.065, 0.040, 0.110)) for s in both]
    solid = join(0.05, trunk, *traps, *chest, *blades, *lats)
    sleeve = place(_build_sleeve(), SHOULDER, ARM_TURN)
    solid, shorts = join(0.05, solid, sleeve, mirror(sleeve)), build_shorts()
    return join(0.02, lambda points: solid(points) - _measure_shirt_folds(points), lambda points: shorts(points) - 0.01)


def _build_sleeve() -> Field:
    """Build the left sleeve in the arm's frame, wider towards its end."""
    core = build_arm_core()
    deltoid = build_ellipsoid((0.0, 0.016, -0.055), (0.052, 0.036, 0.075))
    solid = join(0.03, core, deltoid)

    def measure(points: np.ndarray) -> np.ndarray:
        down = -points[:, 2]
        angle = np.arctan2(points[:, 1], points[:, 0])
        loose = 0.005 + 0.013 * smoothstep(down, 0.05, 0.20)
        folds = 0.0030 * smoothstep(down, 0.06, 0.2) * np.sin(3.0 * angle + 38.0 * down)
        return solid(points) - loose - folds

    return measure


def _measure_shirt_folds(points: np.ndarray) -> np.ndarray:
    """Measure how far folds stand out (N,) m: drapes that fall from chest and blades, and creases at the waist."""
    x, y, z = points.T
    low = smoothstep(z, 1.26, 1.00)
    angle = np.arctan2(y, x)
    drapes = 0.0060 * low * np.sin(9.0 * angle + 5.0 * np.sin(7.0 * z)) * (0.7 + 0.3 * np.sin(3.0 * angle + 1.0))
    waist = np.exp(-(((z - 1.07) / 0.09) ** 2))
    creases = 0.0050 * waist * np.sin(62.0 * z + 2.2 * np.sin(2.0 * angle + 0.6) + 1.5 * np.sin(angle))
    hang = 0.006 * smoothstep(z, 1.06, 0.90)
    return drapes + creases + hang


_SHORTS_LEG = (  # height; middle, front, back, outer, inner
    (0.960, 0.000, 0.090, 0.080, 0.085, 0.080, 0.080), (0.900, 0.000, 0.092, 0.102, 0.116, 0.098, 0.090),
    (0.820, 0.004, 0.096, 0.106, 0.108, 0.100, 0.087), (0.740, 0.006, 0.098, 0.104, 0.100, 0.098, 0.084),
    (0.660, 0.006, 0.099, 0.103, 0.098, 0.098, 0.084), (0.560, 0.006, 0.100, 0.102, 0.097, 0.097, 0.084),
)
_SEAT = (
    (0.830, -0.004, 0.000, 0.070, 0.080, 0.150, 0.150), (0.860, -0.002, 0.000, 0.108, 0.122, 0.174, 0.174),
    (0.920, -0.002, 0.000, 0.122, 0.136, 0.179, 0.179), (0.980, 0.000, 0.000, 0.118, 0.122, 0.170, 0.170),
    (1.040, 0.000, 0.000, 0.110, 0.104, 0.157, 0.157), (1.100, 0.000, 0.000, 0.105, 0.095, 0.150, 0.150),
)


def build_shorts() -> Field:
    """Build the shorts with both legs, open at no end."""
    leg = build_loft(_SHORTS_LEG, 2.1)
    seat = build_loft(_SEAT, 2.2)
    glutes = [build_ellipsoid((-0.078, s * 0.078, 0.900), (0.064, 0.074, 0.080)) for s in (1.0, -1.0)]
    solid = join(0.03, join(0.02, leg, mirror(leg)), seat, *glutes)

    def measure(points: np.ndarray) -> np.ndarray:
        side = np.where(points[:, 1] > 0.0, 1.0, -1.0)
        angle = np.arctan2(side * points[:, 1] - 0.098, points[:, 0])
        flare = smoothstep(points[:, 2], 0.88, 0.66)
        folds = 0.0075 * flare * np.sin(7.0 * angle + 4.0 * np.sin(6.0 * points[:, 2]) + 0.7 * side)
        return solid(points) - folds * smoothstep(np.abs(points[:, 1]), 0.0, 0.03)

    return measure
