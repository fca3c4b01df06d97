"""The ball of a reception: it goes with the part that gives with it, loses its speed there and rolls on.

A kicked ball leaves at once. A ball that is taken stays on the foot, thigh or chest while that gives: without this it
would bounce off in one frame with the speed that it has a moment later. Its further course is kept; it is entered from
rest over ROLL_SECONDS, along s(u) = u^2 (2 - u), the cubic that starts at rest and ends on time at the course's own
speed. The ball is then never more than 0.044 s behind its measured course.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...annotation.ball_contact import TAKING, build_surfaces
from ...annotation.striking import Surface, measure_ball_gap
from ...base.easing import smoothstep
from ...base.time_series import interpolate_columns
from ...motion.motion import compute_pose
from ...motion.skeleton import Skeleton
from ...motion.track import BALL_RADIUS

GIVE_SECONDS, ROLL_SECONDS = 0.1, 0.3
"""Seconds after the touch in which the ball goes with the part, and after which it is back on its course."""

_GIVING = frozenset({"foot", "thigh", "chest"})
_NEAR = 0.03  # m of gap up to which a part has met the ball


def give_with_ball(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, ball: np.ndarray, *, held: tuple[int, int],
    words: Iterable[str], until: float, fps: float,
) -> np.ndarray:
    """Let the ball go with the part that takes it, then roll on along its course.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, world.
        rotations: (T, J, 4) local.
        ball: (T, 3) m, its centre, which touches the part in the held frames.
        held: the two frames of the touch.
        words: labels of the motion.
        until: frame at which the ball changes its course for another reason.
        fps: frames per second.
    Returns:
        (T, 3) m; unchanged where the labels do not take the ball, or the part does not meet it.
    """
    start = held[1]
    count = int(min(round(ROLL_SECONDS * fps), until - start, len(ball) - 1 - start))
    if not TAKING & set(words) or count < 2 or not np.isfinite(ball[start : start + count + 1]).all():
        return ball
    span = slice(start, start + count + 1)
    places, world = compute_pose(skeleton, root[span], rotations[span])
    moved = _measure_give(build_surfaces(skeleton, words), places, world, ball[start])
    if moved is None:
        return ball
    passed = np.arange(count + 1) / count
    on_course = interpolate_columns(count * passed**2 * (2.0 - passed), np.arange(count + 1.0), ball[span])
    stays = 1.0 - smoothstep(np.clip((passed * count / fps - GIVE_SECONDS) / (ROLL_SECONDS - GIVE_SECONDS), 0.0, 1.0))
    stays *= passed < 1.0
    out = ball.copy()
    out[span] = on_course + stays[:, None] * moved
    out[span, 2] = np.maximum(out[span, 2], BALL_RADIUS)
    return out


def _measure_give(surfaces: Iterable[Surface], places: np.ndarray, world: np.ndarray, ball: np.ndarray
                  ) -> np.ndarray | None:
    """Measure how far the middle of the part that meets the ball (3,) m moves from the first of T frames on: (T, 3) m.

    None where no part that gives meets it.
    """
    giving = [part for part in surfaces if part.part in _GIVING]
    lines = [part.compute_line(places, world) for part in giving]
    gaps = [float(measure_ball_gap((line[0][0], line[1][0]), part.radius, ball)) for part, line in zip(giving, lines)]
    if not gaps or min(gaps) > _NEAR:
        return None
    middle = np.mean(lines[int(np.argmin(gaps))], axis=0)
    return middle - middle[0]
