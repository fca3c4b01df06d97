"""Dribbling: the ball is touched step by step in front of the striding feet, and rolls and slows in between.

A feed has the ball of a dribble near the player, often inside the body. The feet stay as they are and the ball is
fitted to them: which strides touch it, on which side, and for how long they push it is chosen by dynamic programming,
so that the ball stays out of the body, lies near its samples, and moves where the foot sends it. Between two touches
it rolls (`roll`); at key moments it stays where it was met.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...motion.skeleton import Skeleton
from .contact_geometry import move_ball_at
from .dribble_search import SOONEST, DribblePart, DribbleSearch, Push

KEY_SECONDS = 0.5  # s from either end of a stretch within which a key moment begins or ends the dribble


@dataclass(frozen=True, eq=False)
class DribbleResult:
    """A dribbled ball.

    Attributes:
        ball: (T, 3) m, its centre, world.
        pushes: the touches, in order of time.
    """

    ball: np.ndarray
    pushes: tuple[Push, ...]


def plan_dribbles(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, foot_contacts: np.ndarray, ball: np.ndarray,
    stretches: Sequence[tuple[float, float]], held: Sequence[tuple[int, int]], fps: float, *,
    measured: np.ndarray | None = None, course_changes: Sequence[float] = (),
) -> DribbleResult:
    """Replace the ball's trajectory in every dribble by one that is touched step by step.

    Frames before and after the stretches change only where the ball has to come to its first touch or leave its last.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, the motion on the pitch, which does not change.
        rotations: (T, J, 4) local.
        foot_contacts: (T, 2) bool, left and right foot in contact with the ground.
        ball: (T, 3) m, its centre, world, NaN where it is unknown.
        stretches: first and last frame of each dribble, fractional.
        held: first and last frame of each touch at a key moment.
        fps: frames per second.
        measured: (T,) bool, False where a sample has no weight.
        course_changes: frames outside the stretches at which the ball is known to change its course.
    Returns:
        The trajectory and the touches of all dribbles.
    """
    path, pushes = np.array(ball, dtype=float), []
    measured = np.isfinite(path).all(axis=1) if measured is None else np.asarray(measured, bool)
    for low, high in stretches:
        for part in _split_at_touches(low, high, held, len(path), fps):
            if not np.isfinite(path[part.low : part.high + 1]).all():
                continue
            search = DribbleSearch(skeleton, root, rotations, foot_contacts=foot_contacts, path=path, measured=measured,
                                   part=part, fps=fps)
            found = search.run()
            if found is None:
                continue
            before, after, part_path = found
            # found: frames counted from the part's first one
            path[part.low + before : part.low + after + 1] = part_path
            pushes += [Push(p.first + part.low, p.last + part.low, p.side) for p in search.pushes]
            touched = [*held, *((push.first, push.last) for push in pushes)]
            others = [*course_changes, *(edge for pair in touched for edge in pair)]
            path = _lead_open_ends(path, ball, part, first=before, last=after, others=others, fps=fps)
    return DribbleResult(path, tuple(sorted(pushes, key=lambda push: push.first)))


def _split_at_touches(low: float, high: float, held, count: int, fps: float) -> list[DribblePart]:
    """Split a stretch where the ball is met; key moments close to its ends become its ends."""
    reach = KEY_SECONDS * fps
    inside = sorted(pair for pair in held if low - reach <= pair[1] and pair[0] <= high + reach)
    low, high = max(int(np.ceil(low)), 0), min(int(np.floor(high)), count - 1)
    # each edge is (frames of a touch, None) or (None, open frame)
    edges = [(None, low), *((pair, None) for pair in inside), (None, high)]
    out = []
    for (before, open_low), (after, open_high) in zip(edges, edges[1:]):
        first = open_low if before is None else before[1]
        last = open_high if after is None else after[0]
        if last - first >= SOONEST * fps:
            out.append(DribblePart(first, last, before is not None, after is not None))
    return out


def _lead_open_ends(path, feed, part: DribblePart, first: int, last: int, others: Sequence[float],
                    fps: float) -> np.ndarray:
    """Lead the trajectory to the first touch and away from the last where a part has open ends.

    first, last: frames counted from the part's beginning.
    """
    first, last = part.low + first, part.low + last
    if not part.is_met_at_start:
        anchor = max((frame for frame in others if frame < first), default=first - int(fps))
        path = _lead_to_touch(path, first, int(anchor), feed)
    if not part.is_met_at_end:
        anchor = min((frame for frame in others if frame > last), default=last + int(fps))
        path = _lead_to_touch(path, last, int(anchor), feed)
    return path


def _lead_to_touch(path: np.ndarray, frame: int, anchor: int, feed: np.ndarray) -> np.ndarray:
    """Lead the trajectory from or to a touch at `frame`; the touch itself does not move."""
    out = move_ball_at(path, frame, anchor, path[frame] - feed[frame])
    out[frame] = path[frame]
    return out
