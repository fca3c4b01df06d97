"""Geometry of ball contact: where the ball may be within its noise, how far the body is from it, its trajectory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...annotation.striking import find_nearest_point, measure_ball_gap
from ...base.easing import quintic_step_by_powers
from ...base.vectors import unit_vectors
from ...motion.quaternion import rotate_about_up
from ...motion.supports import GRAVITY
from ...motion.track import BALL_RADIUS

BALL_SECONDS = 0.3  # s before and after a key moment over which the ball's shift grows and fades
_SLACK = 0.06  # m that the ball may be above or below where the part would strike it squarely
_ANGLES = np.radians([0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0])  # about the vertical, that are tried
_ALONG = (0.5, 0.2, 0.8)  # shares of the part's line that are tried
# costs in metres by which the foot is moved
_ANGLE_COST = 0.08  # per radian off the part's own direction
_ALONG_COST = 0.1  # per share of the line off its middle
_INSIDE_COST = 15.0  # per metre of ball inside the other leg
_MISS_COST = 3.0  # per metre that the part cannot be moved
_ON_GROUND = 0.02  # m above its radius up to which a ball counts as on the ground

Line = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class BallRange:
    """How far the ball may be moved.

    Attributes:
        total: m, in all.
        vertical: m of that, up or down.
    """

    total: float
    vertical: float


@dataclass(frozen=True, eq=False)
class Aim:
    """Where a part strikes the ball.

    Attributes:
        direction: (3,) level, unit, from part to ball.
        along: share of the part's line, from its start (the ankle) to its end (the toes).
    """

    direction: np.ndarray
    along: float = 0.5


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """A ball and a part brought together by each of N aims.

    Attributes:
        ball: (N, 3) m, its centre after it was moved.
        need: (N, 3) m, what the part still has to move to touch it.
    """

    ball: np.ndarray
    need: np.ndarray


def choose_aim(
    line: Line, radius: float, direction: np.ndarray, rise: float, ball: np.ndarray, ball_range: BallRange,
    avoid: Sequence[tuple[Line, float]], possible: Callable[[np.ndarray], np.ndarray],
) -> Aim:
    """Choose the aim that needs the least of the body, within 60 degrees of a direction: inside, instep or outside.

    Args:
        line: ends (3,) m of the part's line.
        radius: m, the part's own.
        direction: (3,) level, unit, where the part strikes.
        rise: sine of the ball's elevation as seen from the part.
        ball: (3,) m as measured.
        ball_range: how far the ball may be moved.
        avoid: (line, radius) of parts that the ball must not lie in.
        possible: returns, for a move (3,) m of the part, the move that the body can make.
    """
    shares = _ALONG[: 1 if rise else None]
    aims = [Aim(rotate_about_up(direction, angle), along) for angle in _ANGLES for along in shares]
    found = solve_contacts(line, radius, aims, rise=rise, ball=ball, ball_range=ball_range, avoid=avoid)
    least = np.linalg.norm(found.need, axis=1)
    least += _ANGLE_COST * np.abs(np.repeat(_ANGLES, len(aims) // len(_ANGLES)))
    least += _ALONG_COST * np.abs([aim.along - 0.5 for aim in aims])
    for other, own in avoid:
        least += _INSIDE_COST * np.maximum(-measure_ball_gap(other, own, found.ball), 0.0)
    best, cost = aims[0], np.inf
    # from the lowest bound on: `possible` is expensive and only adds cost, so stop where no bound is lower
    for number in np.argsort(least, kind="stable"):
        if least[number] >= cost:
            break
        need = found.need[number]
        whole = least[number] + _MISS_COST * float(np.linalg.norm(need - possible(need)))
        best, cost = (aims[number], whole) if whole < cost else (best, cost)
    return best


def solve_contacts(
    line: Line, radius: float, aims: Sequence[Aim], rise: float, ball: np.ndarray, ball_range: BallRange,
    avoid: Sequence[tuple[Line, float]] = (),
) -> ContactSolution:
    """Bring ball and part together by each of N aims.

    The ball moves as far as it may, and out of what it must avoid; the part moves the rest.

    Args:
        line: ends (3,) m of the part's line.
        radius: m, the part's own.
        aims: N aims.
        rise: sine of the ball's elevation as seen from the part.
        ball: (3,) m as measured.
        ball_range: how far the ball may be moved.
        avoid: (line, radius) of parts that the ball must not lie in.
    """
    along = np.array([aim.along for aim in aims])[:, None]
    start = line[0] + along * (line[1] - line[0])
    above = rise * (radius + BALL_RADIUS)
    height = np.clip(start[:, 2] + above, ball[2] - ball_range.vertical, ball[2] + ball_range.vertical)
    height = np.maximum(height, BALL_RADIUS)
    # what the height lacks after the ball has moved up or down: within _SLACK it is ignored, beyond it the part
    # rises
    lift = height - start[:, 2] - above
    lift = np.stack([0.0 * lift, 0.0 * lift, lift - np.clip(lift, -_SLACK, _SLACK)], axis=1)
    raised = tuple((end + lift)[:, None] for end in line)
    start[:, 2] = height
    touching = find_touching_places(raised, radius, start, np.array([aim.direction for aim in aims]))
    # the part of `ball_range.total` that is left for level moves
    level = np.sqrt(np.maximum(ball_range.total**2 - (height - ball[2]) ** 2, 0.0))
    away = touching[:, :2] - ball[:2]
    places = np.concatenate([ball[:2] + _limit_length(away, level), height[:, None]], axis=1)
    for other, own in avoid:
        out = unit_vectors((places - find_nearest_point(other, places))[:, :2])
        places[:, :2] += np.maximum(-measure_ball_gap(other, own, places), 0.0)[:, None] * out
        places[:, :2] = ball[:2] + _limit_length(places[:, :2] - ball[:2], level)
    return ContactSolution(places, places - touching + lift)


def _limit_length(move: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Limit level moves (N, 2) m to lengths `limit` (N,) m."""
    return move * np.minimum(1.0, limit / np.maximum(np.linalg.norm(move, axis=1), 1e-12))[:, None]


def find_touching_places(line: Line, radius: float, start: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Find the centres of balls that touch surfaces, on rays that begin inside them.

    Searched on three grids, each 64 times finer, to some micrometres within a metre.

    Args:
        line: ends (N, 1, 3) m of the surfaces' lines.
        radius: m of the surfaces.
        start: (N, 3) m, inside.
        direction: (N, 3) unit.
    Returns:
        (N, 3) m.
    """
    near, step = np.zeros(len(start)), 1.0
    for _ in range(3):
        distances = near[:, None] + step * np.linspace(0.0, 1.0, 65)
        outside = measure_ball_gap(line, radius, start[:, None] + distances[..., None] * direction[:, None]) >= 0.0
        first = np.maximum(np.argmax(outside, axis=1) - 1, 0)
        near, step = near + first * step / 64, step / 64
    return start + (near + step)[:, None] * direction


def place_between_hands(hands: np.ndarray, radius: float, ball: np.ndarray, ball_range: BallRange) -> tuple[np.ndarray,
        np.ndarray]:
    """Place a ball between both hands, or as far towards there as it may move.

    Args:
        hands: (2, 2, 3) m, ends of the line of each hand.
        radius: m of a hand.
        ball: (3,) m as measured.
        ball_range: how far the ball may be moved.
    Returns:
        Its place (3,) m, and what each hand has to move (2, 3) m to touch it.
    """
    places = np.array([0.5 * (start + end) for start, end in hands])
    middle = places.mean(axis=0)
    away = middle - ball
    away[2] = np.clip(away[2], -ball_range.vertical, ball_range.vertical)
    place = ball + away * min(1.0, ball_range.total / max(np.linalg.norm(away), 1e-12))
    place[2] = max(place[2], BALL_RADIUS)
    out = unit_vectors(places - middle)
    return place, place + (radius + BALL_RADIUS) * out - places


def add_flight_arc(ball: np.ndarray, frame: float, height: float, free: np.ndarray, fps: float) -> np.ndarray:
    """Give the ball's trajectory an arc of free flight through a height where its height is not known.

    Args:
        ball: (T, 3) m.
        frame: where the arc has its top.
        height: m at the top.
        free: (T,) bool, where the height is not known.
        fps: frames per second.
    Returns:
        (T, 3) m; never lower than before.
    """
    seconds = (np.arange(len(ball)) - frame) / fps
    arc = height - 0.5 * GRAVITY * seconds**2
    out = ball.copy()
    out[:, 2] = np.where(free & (arc > ball[:, 2]), arc, ball[:, 2])
    return out


def shift_ball_eased(
    ball: np.ndarray, held: tuple[int, int], places: np.ndarray, bounds: tuple[int, int], fps: float
) -> np.ndarray:
    """Lead the ball's trajectory through two places, and ease it back to where it was.

    Args:
        ball: (T, 3) m.
        held: the two frames of the touch.
        places: (2, 3) m at these frames.
        bounds: frames at which it has to be back, if that is within BALL_SECONDS.
        fps: frames per second.
    Returns:
        (T, 3) m; never below the ball's radius.
    """
    reach = BALL_SECONDS * fps
    low, high = max(held[0] - reach, bounds[0]), min(held[1] + reach, bounds[1])
    frames = np.arange(max(int(np.ceil(low)), 0), min(int(high), len(ball) - 1) + 1)
    share = ease_around(frames, low, *held, high)
    ends = places - ball[list(held)]
    out = ball.copy()
    out[frames] += share[:, None] * np.where(frames[:, None] <= held[0], ends[0], ends[1])
    out[frames, 2] = np.maximum(out[frames, 2], BALL_RADIUS)
    return out


def lead_ball_through(ball: np.ndarray, held: tuple[int, int], places: np.ndarray,
                      bounds: tuple[int, int]) -> np.ndarray:
    """Lead the ball's trajectory through two places, from and to frames at which it changes its course anyway.

    Between them its velocity changes by the same at every frame, so that a flying ball keeps flying and a rolling one
    rolling.

    Args:
        ball: (T, 3) m.
        held: the two frames of the touch.
        places: (2, 3) m at these frames.
        bounds: frames before and after at which the course changes.
    """
    shifts = places - ball[list(held)]
    out = move_ball_at(move_ball_at(ball, held[0], bounds[0], shifts[0]), held[1], bounds[1], shifts[1])
    out[list(held)] = places
    return out


def move_ball_at(ball: np.ndarray, frame: int, anchor: int, shift: np.ndarray) -> np.ndarray:
    """Move the ball's trajectory at a frame, fading evenly to nothing at an anchor frame.

    Args:
        ball: (T, 3) m.
        frame: where it moves by the whole shift.
        anchor: from where on it does not move; before or after `frame`.
        shift: (3,) m.
    Returns:
        (T, 3) m; its height is the old one from the first frame on the ground.
    """
    between, out = np.arange(frame, anchor, 1 if anchor > frame else -1), ball.copy()
    between = between[(between >= 0) & (between < len(ball))]
    if not len(between):
        return out
    away = np.abs(between - frame)
    out[between, :2] += (1.0 - away / abs(anchor - frame))[:, None] * shift[:2]
    # the height fades until the ball lands or the anchor, whichever comes first
    low = np.flatnonzero(ball[between, 2] <= BALL_RADIUS + _ON_GROUND)
    lands = min(float(away[low[0]]) if len(low) else np.inf, float(abs(anchor - frame)))
    fades = np.maximum(1.0 - away / lands, 0.0) if lands else (away == 0).astype(float)
    out[between, 2] = np.maximum(out[between, 2] + fades * shift[2], BALL_RADIUS)
    return out


def ease_in_out(rising: np.ndarray, falling: np.ndarray) -> np.ndarray:
    """Ease 0 .. 1 .. 0, twice continuously differentiable.

    Args:
        rising: (N,) straight ramp from 0 on, 1 and more inside.
        falling: (N,) straight ramp down to 0, 1 and more inside.
    """
    return quintic_step_by_powers(np.minimum(rising, falling))


def ease_around(frames: np.ndarray, low: float, first: float, last: float, high: float) -> np.ndarray:
    """Ease 0 .. 1 .. 0, twice differentiable: 1 in frames first .. last, 0 up to `low` and from `high` on."""
    return ease_in_out((frames - low) / max(first - low, 1e-9), (high - frames) / max(high - last, 1e-9))
