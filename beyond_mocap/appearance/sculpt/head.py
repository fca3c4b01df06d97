"""The head: skull, jaw, face, ears and neck, and the hair that can stand on it."""

from __future__ import annotations

import numpy as np

from ...base.easing import smoothstep
from ..landmarks import HEAD
from .fields import Field, build_chain, build_ellipsoid, build_loft, carve, join, place

EYE, EYE_RADIUS = np.array([0.0790, 0.0315, 0.040]), 0.0128
"""Middle of the left eyeball from HEAD, and its radius."""

_SKULL = (  # up; middle, front, back, half widths
    (-0.040, 0.016, 0.036, 0.052, 0.043, 0.043), (-0.015, 0.012, 0.060, 0.080, 0.056, 0.056),
    (0.015, 0.006, 0.080, 0.092, 0.064, 0.064), (0.045, 0.000, 0.090, 0.096, 0.069, 0.069),
    (0.075, 0.000, 0.090, 0.094, 0.070, 0.070), (0.095, 0.000, 0.080, 0.080, 0.060, 0.060),
)
_FACE = (
    (-0.074, 0.060, 0.014, 0.016, 0.012, 0.012), (-0.068, 0.056, 0.032, 0.026, 0.026, 0.026),
    (-0.055, 0.046, 0.046, 0.040, 0.033, 0.033), (-0.038, 0.040, 0.049, 0.050, 0.040, 0.040),
    (-0.015, 0.036, 0.054, 0.060, 0.046, 0.046), (0.010, 0.034, 0.055, 0.060, 0.054, 0.054),
    (0.030, 0.034, 0.056, 0.060, 0.060, 0.060), (0.055, 0.034, 0.060, 0.060, 0.061, 0.061),
    (0.080, 0.032, 0.060, 0.060, 0.058, 0.058), (0.100, 0.020, 0.050, 0.060, 0.050, 0.050),
)
_NECK = (
    (-0.190, -0.022, 0.054, 0.080, 0.090, 0.090), (-0.150, -0.016, 0.052, 0.072, 0.070, 0.070),
    (-0.110, -0.008, 0.051, 0.066, 0.060, 0.060), (-0.070, 0.000, 0.051, 0.066, 0.057, 0.057),
    (-0.030, 0.004, 0.050, 0.070, 0.056, 0.056), (0.000, 0.004, 0.045, 0.070, 0.050, 0.050),
)


def build_head() -> Field:
    """Build head and neck, without the eyeballs."""
    both = (1.0, -1.0)
    jaw = [build_chain([(0.004, s * 0.052, 0.010, 0.013), (0.018, s * 0.041, -0.038, 0.012),
                        (0.068, s * 0.016, -0.060, 0.013)]) for s in both]
    dome = build_ellipsoid((-0.004, 0.0, 0.067), (0.0985, 0.0755, 0.0885))
    solid = join(0.026, build_loft(_SKULL, 2.1), dome, build_loft(_FACE, 2.2), *jaw)
    cheeks = [build_ellipsoid((0.062, s * 0.043, 0.013), (0.024, 0.019, 0.020)) for s in both]
    brows = [build_chain([(0.089, s * 0.010, 0.055, 0.007), (0.085, s * 0.034, 0.060, 0.0075),
                          (0.068, s * 0.056, 0.054, 0.007)]) for s in both]
    solid = join(0.018, solid, *cheeks, build_ellipsoid((0.084, 0.0, -0.026), (0.016, 0.024, 0.020)),
                 build_ellipsoid((0.081, 0.0, -0.062), (0.015, 0.019, 0.013)))
    solid = join(0.010, solid, *brows)
    solid = carve(0.016, solid, *[build_ellipsoid((0.103, s * 0.034, 0.039), (0.019, 0.018, 0.0125)) for s in both])
    solid = _add_lids(solid)
    solid = _add_nose_and_mouth(solid)
    ears = [place(_build_ear(), (-0.002, s * 0.074, 0.030), _turn_ear(s)) for s in both]
    solid = join(0.006, solid, *ears)
    muscles = [build_chain([(-0.020, s * 0.062, -0.010, 0.016), (0.026, s * 0.016, -0.150, 0.011)]) for s in both]
    throat = build_ellipsoid((0.041, 0.0, -0.103), (0.012, 0.012, 0.018))
    neck = join(0.014, build_loft(_NECK, 2.1), *muscles, throat)
    return place(join(0.026, neck, solid), HEAD, np.eye(3))


def _add_lids(solid: Field) -> Field:
    """Add lids around the eyeballs, with an almond opening."""
    for side in (1.0, -1.0):
        eye = EYE * [1.0, side, 1.0]
        lid = build_ellipsoid(eye, np.full(3, EYE_RADIUS + 0.0022))
        opening = build_chain([eye + [0.012, -side * 0.0095, -0.0015], eye + [0.014, side * 0.001, 0.0005],
                               eye + [0.010, side * 0.0105, 0.001]] @ np.eye(3, 4) + [0.0, 0.0, 0.0, 0.0056])
        solid = join(0.006, solid, lid)
        solid = carve(0.0025, solid, opening)
    return solid


def _add_nose_and_mouth(solid: Field) -> Field:
    """Add the nose with its wings, and lips parted by a line."""
    nose = [build_chain([(0.086, 0.0, 0.050, 0.0075), (0.098, 0.0, 0.022, 0.0085), (0.1065, 0.0, 0.004, 0.0105)])]
    nose += [build_ellipsoid((0.0945, s * 0.0125, 0.0005), (0.0115, 0.0065, 0.0075)) for s in (1.0, -1.0)]
    solid = join(0.011, solid, *nose)
    nostrils = [build_ellipsoid((0.1005, s * 0.0065, -0.0075), (0.005, 0.003, 0.003)) for s in (1.0, -1.0)]
    solid = carve(0.004, solid, *nostrils)
    upper = _lay(solid, ((0.023, -0.0305, 0.0015), (0.014, -0.0275, 0.0034), (0.005, -0.0255, 0.0044)))
    lower = _lay(solid, ((0.021, -0.0325, 0.0015), (0.012, -0.0360, 0.0044), (0.004, -0.0375, 0.0056)))
    solid = join(0.005, solid, upper, lower)
    line = _lay(solid, ((0.0255, -0.0310, 0.0014), (0.013, -0.0312, 0.0020), (0.003, -0.0315, 0.0022)))
    crease = _lay(solid, ((0.013, -0.0475, 0.0025), (0.004, -0.0480, 0.0030)))
    return carve(0.006, carve(0.0028, solid, line), crease)


def _lay(solid: Field, nodes) -> Field:
    """Build capsules that lie on the front of a solid; nodes are rows (left, up, radius) m, mirrored to the right."""
    left, up, radius = np.array(nodes, dtype=float).T
    both = np.concatenate([left, -left[::-1]]), np.concatenate([up, up[::-1]])
    points = np.stack([np.full(len(both[0]), 0.12), *both], axis=1)
    for _ in range(40):
        points[:, 0] -= 0.7 * solid(points)
    return build_chain(np.column_stack([points, np.concatenate([radius, radius[::-1]])]))


def _build_ear() -> Field:
    """Build the left ear around its middle: a shell with a rim, hollow, and a lobe."""
    shell = build_ellipsoid((0.0, 0.004, 0.0), (0.0185, 0.0075, 0.0310))
    rim = build_chain([(0.012, 0.004, 0.012, 0.0035), (0.006, 0.006, 0.026, 0.004), (-0.009, 0.009, 0.024, 0.004),
                       (-0.016, 0.011, 0.006, 0.0038), (-0.011, 0.009, -0.014, 0.0035),
                       (0.003, 0.006, -0.026, 0.005)])
    hollow = build_ellipsoid((0.002, 0.0125, 0.000), (0.0105, 0.008, 0.017))
    return carve(0.004, join(0.006, shell, rim), hollow)


def _turn_ear(side: float) -> np.ndarray:
    """Build the axes of an ear: turned back a little, standing off the head, mirrored for the right."""
    yaw, roll = np.radians(14.0), np.radians(-8.0)
    lean = np.array([[np.cos(roll), 0.0, np.sin(roll)], [0.0, 1.0, 0.0], [-np.sin(roll), 0.0, np.cos(roll)]])
    turn = np.array([[np.cos(yaw), np.sin(yaw), 0.0], [-np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    return np.diag([1.0, side, 1.0]) @ turn @ lean


def build_brows(skin: Field) -> Field:
    """Build the hair of the eyebrows: thin strips that stand out of the skin."""
    strips = [build_chain([(0.096, s * 0.0120, 0.0560, 0.0034), (0.094, s * 0.0270, 0.0605, 0.0038),
                           (0.080, s * 0.0490, 0.0575, 0.0020)]) for s in (1.0, -1.0)]
    near = place(lambda points: np.minimum(strips[0](points), strips[1](points)), HEAD, np.eye(3))
    return lambda points: np.maximum(skin(points) - 0.0024, near(points) - 0.002)


# -- hair


def measure_hairline(points: np.ndarray, forehead: float = 0.100, nape: float = -0.035) -> np.ndarray:
    """Measure how far points (N, 3) m are within the hairline, about metres: positive where hair grows."""
    x, y, z = (points - HEAD).T
    line = np.interp(x, [-0.060, -0.034, -0.024, -0.010, 0.012, 0.018, 0.030, 0.040, 0.056, 0.080, 0.100],
                     [nape, nape + 0.015, 0.035, 0.066, 0.062, 0.014, 0.012, 0.058, 0.084, forehead - 0.008, forehead])
    return z - line - 0.10 * np.maximum(np.abs(y) - 0.03, 0.0) * (x > 0.045)


def build_hair(style: str, head: Field) -> Field:
    """Build hair as a solid that covers the head within the hairline and ends thin.

    Args:
        style: "short", "curly" or "tied".
        head: the field of `build_head`.
    """
    thick, top, rough, wave = _STYLES[style]

    def measure(points: np.ndarray) -> np.ndarray:
        local = points - HEAD
        within = smoothstep(measure_hairline(points), 0.0, 0.030)
        high = smoothstep(local[:, 2], 0.07, 0.14)
        depth = -0.004 + within * (0.004 + thick + (top - thick) * high)
        angle = np.arctan2(local[:, 1], local[:, 0])
        swell = rough * np.sin(wave * local[:, 0]) * np.sin(wave * local[:, 1]) * np.sin(wave * local[:, 2] + 1.0)
        strands = 0.35 * rough * np.sin(23.0 * angle + 60.0 * local[:, 2])
        return head(points) - depth - within * (swell + strands)

    tails = _build_tails(style)
    return join(0.012, measure, *tails) if tails else measure


_STYLES = {  # thickness at the sides and on top, roughness m, waves per metre times 2 pi
    "short": (0.0045, 0.018, 0.0030, 175.0),
    "curly": (0.017, 0.026, 0.0062, 190.0),
    "tied": (0.006, 0.009, 0.0010, 140.0),
}

def _build_tails(style: str) -> list[Field]:
    if style != "tied":
        return []
    knot = build_ellipsoid((-0.112, 0.0, 0.078), (0.022, 0.022, 0.022))
    tail = build_chain([(-0.112, 0.0, 0.078, 0.014), (-0.138, 0.0, 0.052, 0.020), (-0.146, 0.0, -0.010, 0.022),
                        (-0.138, 0.0, -0.070, 0.015), (-0.128, 0.0, -0.105, 0.004)])
    return [place(knot, HEAD, np.eye(3)), place(tail, HEAD, np.eye(3))]
