"""Arms, hands, legs and boots of the left side, each in a frame in which the limb hangs straight down."""

from __future__ import annotations

import numpy as np

from ..landmarks import HIP, WRIST
from ..stance import ARM_TILT
from .fields import Field, blend_minimum, build_chain, build_cone, build_ellipsoid, build_loft, join

ARM_TURN = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(ARM_TILT), -np.sin(ARM_TILT)],
                     [0.0, np.sin(ARM_TILT), np.cos(ARM_TILT)]])
"""Axes (3, 3) of the left arm's frame: the arm hangs along -z in it, origin at SHOULDER."""

_ARM = (  # up from the shoulder; middle, front, back, outer, inner
    (0.030, 0.000, 0.000, 0.030, 0.030, 0.028, 0.030), (-0.010, 0.000, 0.000, 0.052, 0.052, 0.046, 0.050),
    (-0.060, 0.000, 0.000, 0.057, 0.055, 0.052, 0.046), (-0.110, 0.000, 0.000, 0.053, 0.053, 0.050, 0.042),
    (-0.150, 0.000, 0.000, 0.051, 0.052, 0.043, 0.041), (-0.200, 0.000, 0.000, 0.051, 0.049, 0.041, 0.040),
    (-0.260, 0.000, 0.000, 0.043, 0.042, 0.039, 0.038), (-0.306, 0.000, 0.000, 0.039, 0.041, 0.041, 0.040),
    (-0.345, 0.000, 0.000, 0.043, 0.040, 0.044, 0.041), (-0.385, 0.000, 0.000, 0.044, 0.038, 0.044, 0.038),
    (-0.440, 0.000, 0.000, 0.039, 0.034, 0.038, 0.034), (-0.500, 0.000, 0.000, 0.033, 0.029, 0.029, 0.026),
    (-0.545, 0.000, 0.000, 0.029, 0.027, 0.022, 0.021), (-0.580, 0.000, 0.000, 0.026, 0.024, 0.018, 0.017),
)
_LEG = (  # height; middle, front, back, outer, inner
    (0.960, 0.000, 0.085, 0.060, 0.060, 0.060, 0.060), (0.900, 0.000, 0.088, 0.088, 0.096, 0.082, 0.080),
    (0.820, 0.002, 0.089, 0.090, 0.090, 0.083, 0.080), (0.740, 0.004, 0.090, 0.086, 0.082, 0.080, 0.073),
    (0.660, 0.004, 0.090, 0.078, 0.073, 0.071, 0.066), (0.590, 0.002, 0.090, 0.064, 0.063, 0.058, 0.060),
    (0.545, 0.000, 0.090, 0.058, 0.057, 0.053, 0.056), (0.510, 0.000, 0.090, 0.057, 0.055, 0.053, 0.054),
    (0.470, -0.002, 0.090, 0.052, 0.054, 0.051, 0.050), (0.430, -0.004, 0.090, 0.047, 0.061, 0.053, 0.052),
    (0.380, -0.006, 0.089, 0.044, 0.069, 0.056, 0.056), (0.340, -0.006, 0.089, 0.043, 0.067, 0.053, 0.053),
    (0.270, -0.004, 0.090, 0.040, 0.052, 0.044, 0.043), (0.200, -0.003, 0.090, 0.036, 0.041, 0.036, 0.036),
    (0.140, -0.002, 0.090, 0.034, 0.037, 0.034, 0.034), (0.090, -0.002, 0.090, 0.038, 0.042, 0.036, 0.035),
    (0.050, 0.000, 0.090, 0.045, 0.045, 0.034, 0.034),
)


def build_arm() -> Field:
    """Build upper arm and forearm, in the arm's frame."""
    biceps = build_ellipsoid((0.020, -0.002, -0.185), (0.028, 0.028, 0.070))
    triceps = build_ellipsoid((-0.022, 0.006, -0.150), (0.026, 0.028, 0.075))
    deltoid = build_ellipsoid((0.0, 0.020, -0.055), (0.050, 0.032, 0.075))
    brachial = build_ellipsoid((0.016, 0.016, -0.355), (0.026, 0.026, 0.060))
    point = build_ellipsoid((-0.028, 0.0, -0.306), (0.014, 0.014, 0.018))
    return join(0.03, build_loft(_ARM), *(biceps, triceps, deltoid, brachial, point))


def build_arm_core() -> Field:
    """Build the arm without muscles, for sleeves."""
    return build_loft(_ARM)


_PALM = (  # below the wrist; middle, front, back, away from the palm, towards it
    (0.040, 0.000, 0.000, 0.026, 0.026, 0.018, 0.018), (0.000, 0.000, 0.000, 0.029, 0.027, 0.020, 0.019),
    (-0.020, 0.001, 0.000, 0.032, 0.030, 0.018, 0.018), (-0.045, 0.002, 0.001, 0.037, 0.036, 0.016, 0.017),
    (-0.070, 0.002, 0.002, 0.040, 0.040, 0.014, 0.016), (-0.090, 0.002, 0.002, 0.041, 0.041, 0.013, 0.014),
    (-0.100, 0.002, 0.001, 0.038, 0.038, 0.010, 0.011),
)
_FINGERS = (  # knuckle ahead and below the wrist, lengths of three phalanges, radius, curl of each, fan
    (0.0315, 0.093, (0.042, 0.026, 0.021), 0.0092, (16.0, 30.0, 20.0), 5.0),
    (0.0110, 0.097, (0.046, 0.029, 0.022), 0.0095, (20.0, 36.0, 24.0), 1.5),
    (-0.0100, 0.094, (0.042, 0.027, 0.021), 0.0090, (26.0, 40.0, 26.0), -2.5),
    (-0.0300, 0.087, (0.033, 0.021, 0.018), 0.0080, (32.0, 42.0, 26.0), -8.0),
)


def build_bare_arm(light: bool) -> Field:
    """Build arm and hand, in the arm's frame.

    Args:
        light: as in `build_hand`.
    """
    return join(0.012, build_arm(), build_hand(light))


def build_hand(light: bool) -> Field:
    """Build hand and wrist, in the arm's frame: relaxed, fingers half closed, thumb apart.

    Args:
        light: whether for the light body, on which fingers touch.
    """
    knuckles = [build_ellipsoid((ahead, 0.006, -down), (0.010, 0.009, 0.011)) for ahead, down, *_ in _FINGERS]
    heel = build_ellipsoid((0.018, -0.013, -0.038), (0.019, 0.014, 0.028))
    other_heel = build_ellipsoid((-0.022, -0.010, -0.045), (0.014, 0.012, 0.032))
    thumb = build_chain([(0.022, -0.006, -0.022, 0.0145), (0.044, -0.014, -0.058, 0.0120),
                         (0.050, -0.020, -0.087, 0.0105), (0.047, -0.027, -0.108, 0.0080)])
    palm = join(0.012, build_loft(_PALM, 2.6), heel, other_heel, *knuckles)
    palm = join(0.014, palm, thumb)
    fingers = [_build_finger(*row) for row in _FINGERS]
    return _lower(join(0.008 if light else 0.0035, palm, *fingers), WRIST)


def _build_finger(ahead: float, down: float, lengths, radius: float, curls, fan: float) -> Field:
    """Build a finger from its knuckle, curled towards the palm (-y) and fanned forwards."""
    here, angle, nodes = np.array([ahead, 0.002, -down + 0.010]), 0.0, []
    sideways = np.sin(np.radians(fan))
    for index, (length, curl) in enumerate(zip(lengths, curls)):
        nodes.append((*here, radius * (1.06 - 0.08 * index)))
        angle += np.radians(curl)
        here = here + (length + 0.010 * (index == 0)) * np.array([sideways, -np.sin(angle), -np.cos(angle)])
    nodes.append((*here, 0.78 * radius))
    return build_chain(nodes)


def _lower(field: Field, down: float) -> Field:
    return lambda points: field(points + np.array([0.0, 0.0, down]))


def build_leg() -> Field:
    """Build thigh, knee and shank."""
    y = HIP[1]
    kneecap = build_ellipsoid((0.044, y, 0.520), (0.020, 0.024, 0.028))
    inner = build_ellipsoid((0.032, y - 0.034, 0.590), (0.030, 0.026, 0.045))
    outer = build_ellipsoid((0.030, y + 0.034, 0.630), (0.034, 0.026, 0.065))
    shin = build_ellipsoid((0.036, y, 0.455), (0.014, 0.014, 0.024))
    calves = [build_ellipsoid((-0.042, y + s * 0.024, 0.370 + 0.012 * s), (0.034, 0.030, 0.075)) for s in (1.0, -1.0)]
    ham = [build_ellipsoid((-0.046, y + s * 0.036, 0.545), (0.012, 0.010, 0.060)) for s in (1.0, -1.0)]
    return join(0.026, build_loft(_LEG, 2.1), kneecap, inner, outer, shin, *calves, *ham)


def build_sock() -> Field:
    """Build the leg in its sock, with a shin guard."""
    leg = build_leg()
    guard = build_ellipsoid((0.014, HIP[1], 0.300), (0.034, 0.040, 0.120))
    solid = join(0.02, leg, guard)

    def measure(points: np.ndarray) -> np.ndarray:
        ribs = 0.0007 * np.sin(points[:, 2] * 2.0 * np.pi / 0.030) * (points[:, 2] < 0.17)
        return solid(points) - 0.0045 - ribs

    return measure


_BOOT = (  # ahead of the ankle; height, half width
    (-0.070, 0.024, 0.018), (-0.060, 0.072, 0.030), (-0.030, 0.084, 0.036), (0.010, 0.086, 0.037),
    (0.050, 0.080, 0.038), (0.090, 0.068, 0.043), (0.133, 0.058, 0.047), (0.161, 0.050, 0.045),
    (0.188, 0.040, 0.036), (0.203, 0.026, 0.022), (0.207, 0.012, 0.010),
)


def build_boot() -> Field:
    """Build the boot, flat below at the ground; its outline is that of `appearance.boots`."""
    y = HIP[1] + 0.004
    lengthwise = build_loft([(ahead, 0.0, 0.0, high, 0.030, wide, wide) for ahead, high, wide in _BOOT], 2.3)

    def upper(points: np.ndarray) -> np.ndarray:
        return lengthwise(np.stack([points[:, 2], points[:, 1] - y, points[:, 0]], axis=1))

    ankle = build_loft(((0.150, -0.002, y, 0.040, 0.044, 0.040, 0.040), (0.110, -0.002, y, 0.043, 0.048, 0.042, 0.042),
                        (0.070, 0.004, y, 0.052, 0.054, 0.041, 0.041), (0.040, 0.004, y, 0.058, 0.058, 0.038, 0.038)))
    tongue = build_cone((0.030, y, 0.105), (0.085, y, 0.062), 0.022, 0.018)
    solid = join(0.03, upper, ankle, tongue)
    floor = build_floor()
    return lambda points: -blend_minimum(-solid(points), -floor(points), 0.004)


_SOLE = ((-0.073, -0.068, -0.060, -0.045, -0.030, 0.133, 0.161, 0.188, 0.203, 0.210),
         (0.030, 0.017, 0.005, 0.0012, 0.0, 0.0, 0.0014, 0.0028, 0.0058, 0.013))
"""Metres ahead of the ankle, and height of the sole there: that of `appearance.boots`."""

_CHORD = 0.0004  # m by which the middles of the sole's faces lie above its curve


def build_floor() -> Field:
    """Build what is below the sole, which rises at toes, heel and both edges."""

    def measure(points: np.ndarray) -> np.ndarray:
        across = np.minimum(np.abs(points[:, 1] - HIP[1] - 0.004) / 0.045, 1.0)
        return np.interp(points[:, 0], *_SOLE) - _CHORD + 0.007 * across**3 - points[:, 2]

    return measure
