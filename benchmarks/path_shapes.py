"""New paths to try recordings on: name -> places (N, 3) m, the first at the origin and setting out along +x.

`FAIR` bends with a radius of 2 m or more and stays level; `TIGHT` has corners and smaller bends; `HILLS` go up and come
down again over a rounded top.
"""

from __future__ import annotations

import numpy as np

STEP = 0.02  # metres between places


def straight(length: float = 30.0) -> np.ndarray:
    """A straight line."""
    return np.column_stack([np.arange(0.0, length, STEP), *np.zeros((2, len(np.arange(0.0, length, STEP))))])


def circle(radius: float, rounds: float = 1.0) -> np.ndarray:
    """A circle to the left."""
    return bent(lambda s: np.full_like(s, 1.0 / radius), 2.0 * np.pi * radius * rounds)


def bent(curvature, length: float) -> np.ndarray:
    """The line whose curvature, 1/m to the left, is curvature(s (N,) m)."""
    s = np.arange(0.0, length, STEP)
    bend = curvature(s)
    heading = np.concatenate([[0.0], np.cumsum(0.5 * STEP * (bend[1:] + bend[:-1]))])
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = STEP * np.column_stack([np.cos(middle), np.sin(middle)])
    return np.column_stack([np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), np.zeros(len(s))])


def winding(radius: float = 2.5, wave: float = 9.0, length: float = 30.0) -> np.ndarray:
    """An S after the other; `radius` m where it bends most."""
    return bent(lambda s: np.sin(2.0 * np.pi * s / wave) / radius, length)


def zigzag(leg: float = 3.0, angle: float = 60.0, legs: int = 10) -> np.ndarray:
    """Straight legs that turn by `angle` degrees to and fro: the corners alone."""
    way = np.radians(angle) * (np.arange(legs) % 2)
    steps = leg * np.column_stack([np.cos(way), np.sin(way), np.zeros(legs)])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def eight(size: float = 3.5, rounds: float = 1.5) -> np.ndarray:
    """A figure of eight (Gerono's), 2 `size` m long."""
    t = np.linspace(0.0, 2.0 * np.pi * rounds, 3000)
    line = size * np.column_stack([np.sin(t), np.sin(t) * np.cos(t), np.zeros_like(t)])
    return line @ _turned(-0.25 * np.pi)


def walkabout(length: float = 30.0, seed: int = 3, tightest: float = 2.0) -> np.ndarray:
    """A stroll of bends of all sizes, `tightest` m at least."""
    rng = np.random.default_rng(seed)
    waves, phases, size = rng.uniform(5.0, 16.0, 5), rng.uniform(0.0, 2.0 * np.pi, 5), rng.uniform(0.4, 1.0, 5)
    s = np.arange(0.0, length, STEP)
    bend = np.sum(size * np.sin(2.0 * np.pi * s[:, None] / waves + phases), axis=1)
    return bent(lambda at: np.interp(at, s, bend / np.abs(bend).max() / tightest), length)


def hill(degrees: float, way: float = 4.0, length: float = 30.0) -> np.ndarray:
    """Up for `way` m over the ground, over the top and down again, and so on; slopes of `degrees` but for 1 m around
    tops and valleys."""
    line = straight(length)
    slope = np.tan(np.radians(degrees)) * np.clip(np.sin(np.pi * line[:, 0] / way) * way / np.pi, -1.0, 1.0)
    line[:, 2] = np.cumsum(slope) * STEP
    return line


def _turned(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


FAIR = {
    "straight": straight(), "circle 8 m": circle(8.0), "circle 3 m": circle(3.0, 2.0), "circle 2 m": circle(2.0, 3.0),
    "winding": winding(), "walkabout": walkabout(),
}  # fmt: skip
TIGHT = {"eight": eight(), "zigzag": zigzag(), "circle 1 m": circle(1.0, 5.0)}
HILLS = {f"hill {degrees}": hill(degrees) for degrees in (5, 10, 15)}
ALL = {**FAIR, **TIGHT, **HILLS}
