"""Where ball and body meet: where the ball goes within its noise, how far the body still is from it, and the ball's
path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..motion.striking import ball_gap
from ..motion.track import BALL_RADIUS

BALL_SECONDS = 0.3
"""Seconds before and after a key moment over which the ball's shift grows and fades."""

_SLACK = 0.06  # metres that the ball may be above or below where the part would strike it squarely
_ANGLES = np.radians([0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0])
_ANGLE_COST = 0.08  # metres of moved foot that a radian off the part's own direction is worth
_INSIDE_COST = 5.0  # and a metre of ball within the other foot
_GRAVITY = 9.81

Line = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Room:
    """How far the ball may be moved: in all, and of that up or down, m."""

    whole: float
    upright: float


@dataclass(frozen=True, eq=False)
class Meeting:
    """ball (3,) m: its centre, moved. need (3,) m: what the part has to move to touch it. direction (3,): from part to
    ball."""

    ball: np.ndarray
    need: np.ndarray
    direction: np.ndarray


def best_meeting(
    line: Line, radius: float, direction: np.ndarray, rise: float, ball: np.ndarray, room: Room, avoid: Sequence[tuple]
) -> Meeting:
    """The meeting that asks least of the body, of those within 60 degrees of `direction`.

    line: ends (3,) m of the part's line, radius its own, m; direction (3,) level, unit: where the part strikes; rise:
    sine of the ball's elevation as seen from the part; ball (3,) m as measured; avoid: (line, radius) that it may not
    lie in.
    """
    def cost(angle: float) -> tuple[float, Meeting]:
        found = meeting(line, radius, _turned(direction, angle), rise, ball, room)
        inside = sum(max(0.0, -float(ball_gap(other, own, found.ball))) for other, own in avoid)
        return np.linalg.norm(found.need) + _ANGLE_COST * abs(angle) + _INSIDE_COST * inside, found

    return min((cost(angle) for angle in _ANGLES), key=lambda pair: pair[0])[1]


def meeting(line: Line, radius: float, direction: np.ndarray, rise: float, ball: np.ndarray, room: Room) -> Meeting:
    """Ball and part meet with the ball in `direction` (3,) of the part: the ball moves as far as it may, the part the
    rest."""
    middle = 0.5 * (line[0] + line[1])
    above = rise * (radius + BALL_RADIUS)
    height = np.clip(middle[2] + above, ball[2] - room.upright, ball[2] + room.upright)
    height = max(height, BALL_RADIUS)
    lift = (height - middle[2] - above) - np.clip(height - middle[2] - above, -_SLACK, _SLACK)
    raised = line[0] + [0.0, 0.0, lift], line[1] + [0.0, 0.0, lift]
    touching = _touching(raised, radius, np.array([*middle[:2], height]), direction)
    level = np.sqrt(max(room.whole**2 - (height - ball[2]) ** 2, 0.0))
    away = touching[:2] - ball[:2]
    way = away * min(1.0, level / max(np.linalg.norm(away), 1e-12))
    place = np.array([*(ball[:2] + way), height])
    return Meeting(place, place - touching + [0.0, 0.0, lift], direction)


def _touching(line: Line, radius: float, start: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """The centre (3,) of a ball that touches the surface, on the ray from `start`, which is inside it, along
    `direction`; searched on ever finer grids, to some micrometres within a metre."""
    near, step = 0.0, 1.0
    for _ in range(3):
        ways = near + step * np.linspace(0.0, 1.0, 65)
        outside = ball_gap(line, radius, start + ways[:, None] * direction) >= 0.0
        near, step = ways[max(int(np.argmax(outside)) - 1, 0)], step / 64
    return start + (near + step) * direction


def held_meeting(hands: Sequence[Line], radius: float, ball: np.ndarray, room: Room) -> tuple[np.ndarray, np.ndarray]:
    """A ball between both hands: its place (3,) m, and what each hand has to move (2, 3) m to touch it."""
    places = np.array([0.5 * (start + end) for start, end in hands])
    middle = places.mean(axis=0)
    height = max(np.clip(middle[2], ball[2] - room.upright, ball[2] + room.upright), BALL_RADIUS)
    level = np.sqrt(max(room.whole**2 - (height - ball[2]) ** 2, 0.0))
    away = middle[:2] - ball[:2]
    place = np.array([*(ball[:2] + away * min(1.0, level / max(np.linalg.norm(away), 1e-12))), height])
    out = places - middle
    out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    return place, place + (radius + BALL_RADIUS) * out - places


def lofted(ball: np.ndarray, frame: float, height: float, free: np.ndarray, fps: float) -> np.ndarray:
    """The ball's path (T, 3) m with an arc of free flight through `height` m at `frame` where `free` (T,) says that its
    height is not known."""
    seconds = (np.arange(len(ball)) - frame) / fps
    arc = height - 0.5 * _GRAVITY * seconds**2
    out = ball.copy()
    out[:, 2] = np.where(free & (arc > ball[:, 2]), arc, ball[:, 2])
    return out


def shifted(
    ball: np.ndarray, held: tuple[int, int], places: np.ndarray, bounds: tuple[int, int], fps: float
) -> np.ndarray:
    """The ball's path (T, 3) m led through `places` (2, 3) m at the two frames `held`, and eased back to where it was.

    bounds: frames at which it has to be back, beside BALL_SECONDS. Never below its radius.
    """
    reach = BALL_SECONDS * fps
    low, high = max(held[0] - reach, bounds[0]), min(held[1] + reach, bounds[1])
    frames = np.arange(max(int(np.ceil(low)), 0), min(int(high), len(ball) - 1) + 1)
    share = eased((frames - low) / max(held[0] - low, 1e-9), (high - frames) / max(high - held[1], 1e-9))
    ends = places - ball[list(held)]
    out = ball.copy()
    out[frames] += share[:, None] * np.where(frames[:, None] <= held[0], ends[0], ends[1])
    out[frames, 2] = np.maximum(out[frames, 2], BALL_RADIUS)
    return out


def eased(rising: np.ndarray, falling: np.ndarray) -> np.ndarray:
    """0 .. 1 .. 0, twice continuously differentiable: rising and falling (N,) are the straight ramps, 1 and more
    inside."""
    x = np.clip(np.minimum(rising, falling), 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def _turned(direction: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * direction[0] - s * direction[1], s * direction[0] + c * direction[1], direction[2]])
