"""One colour table, all from the set of M. Okabe and K. Ito (Color Universal Design, 2008), distinct for every kind of
colour vision; scales go from blue over yellow to vermilion, so that they also change in lightness.
"""

from __future__ import annotations

import numpy as np

BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
BLUE, SKY, GREEN = (0.0, 0.447, 0.698), (0.337, 0.706, 0.914), (0.0, 0.620, 0.451)
YELLOW, ORANGE, VERMILION = (0.941, 0.894, 0.259), (0.902, 0.624, 0.0), (0.835, 0.369, 0.0)
PURPLE, GREY = (0.800, 0.475, 0.655), (0.62, 0.62, 0.62)

LEFT, RIGHT, MIDDLE = SKY, PURPLE, WHITE
TRANSITION, BALL, STRIKE, GAP = WHITE, ORANGE, GREEN, VERMILION
TRACK_SPEED, BODY_SPEED = SKY, ORANGE
HEADING, HEADING_KEY = YELLOW, PURPLE
FLIGHT, SUPPORT, FORCE, UNSUPPORTED_FORCE = ORANGE, GREEN, SKY, VERMILION
SCALE = (BLUE, SKY, YELLOW, ORANGE, VERMILION)
"""From good to bad; the middle one is the limit of the target."""

ROOT_STOPS = (0.0, 0.005, 0.015, 0.05, 0.5)
"""Metres of root error at the colours of SCALE: targets of mean and 95 % are the second and third."""

SLIDE_STOPS = (0.0, 0.005, 0.021, 0.05, 0.1)
"""Metres that a stance slides, at the colours of SCALE: the target of the median, and what eyes notice."""


def map_to_colours(values: np.ndarray, stops: tuple[float, ...], alpha: float = 1.0) -> np.ndarray:
    """Map values to colours between `stops`; NaN is grey.

    Args:
        values: (N,) values.
        stops: values at the colours of SCALE.
        alpha: opacity.
    Returns:
        (N, 4) float32.
    """
    table = np.array(SCALE)
    known = np.isfinite(values)
    at = np.where(known, values, 0.0)
    out = np.empty((len(values), 4), np.float32)
    for channel in range(3):
        out[:, channel] = np.where(known, np.interp(at, stops, table[:, channel]), GREY[channel])
    out[:, 3] = alpha
    return out


def repeat_colour(colour: tuple[float, float, float], count: int, alpha: float = 1.0) -> np.ndarray:
    """Repeat one colour for `count` vertices: (N, 4) float32."""
    return np.tile(np.array((*colour, alpha), np.float32), (count, 1))
