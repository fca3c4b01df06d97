"""Dribbling: the ball is touched step by step in front of the striding feet, and rolls and slows in between.

A feed has the ball of a dribble near the player, often inside the body. The feet stay as they are and the ball is
fitted to them: which strides touch it, on which side, and for how long they push it is chosen by dynamic programming,
so that the ball stays out of the body, lies near its samples, and moves where the foot sends it. Between two touches
it rolls (`roll`); at key moments it stays where it was met. Where the feed has measured it out of reach of the feet, it
has been knocked on: it keeps its course until it is near again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....annotation.body_solid import BodySolid, build_leg_surfaces
from ....base.time_series import find_runs
from ....motion.motion import compute_pose
from ....motion.skeleton import Skeleton
from ...take import DribbleTouch
from ..contact_geometry import move_ball_at
from .dribble_search import SOONEST, DribblePart, DribbleSearch

KEY_SECONDS = 0.5  # s from either end of a stretch within which a key moment begins or ends the dribble
OUT_OF_REACH = 1.1
"""Metres on the ground from pelvis to ball beyond which no foot touches it: 0.64 m to a striking foot, 0.15 m of foot
and ball, and 0.3 m by which a measured ball may be off."""
_KNOCKED_SECONDS, _MEASURED_SHARE = 0.3, 0.5  # least s out of reach, and share of it that has to be measured
_THROUGH = 0.03  # m inside the legs from which on a ball passes through them
_ROLLS_SECONDS = 0.8  # s beside such a stretch in which a ball without a touch of its own just rolls


@dataclass(frozen=True, eq=False)
class DribbleResult:
    """A dribbled ball.

    Attributes:
        ball: (T, 3) m, its centre, world.
        pushes: the touches, in order of time.
    """

    ball: np.ndarray
    pushes: tuple[DribbleTouch, ...]


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
    knocked = [run for run in _find_knocked_on(path, root, measured, fps)
               if _is_clear(skeleton, root, rotations, path, run=run, held=held, fps=fps)] if stretches else []
    for low, high in stretches:
        for part in _split_parts(low, high, held, knocked, course_changes, count=len(path), fps=fps):
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
            pushes += [DribbleTouch(p.first + part.low, p.last + part.low, p.side) for p in search.pushes]
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


def _find_knocked_on(ball: np.ndarray, root: np.ndarray, measured: np.ndarray, fps: float) -> list[tuple[int, int]]:
    """Find the runs of frames, first and end, in which a measured ball (T, 3) m is out of reach of the feet."""
    away = np.linalg.norm(ball[:, :2] - root[:, :2], axis=1) > OUT_OF_REACH
    return [(first, end) for first, end in find_runs(away)
            if end - first >= _KNOCKED_SECONDS * fps and measured[first:end].mean() >= _MEASURED_SHARE]


def _is_clear(skeleton: Skeleton, root, rotations, ball: np.ndarray, *, run: tuple[int, int], held, fps: float) -> bool:
    """Return whether a ball (T, 3) m that is out of reach for a run of frames does not pass through the legs on its
    way from or to a key moment close by.
    """
    most, (first, end) = _ROLLS_SECONDS * fps, run
    ways = [range(pair[1] + 1, first) for pair in held if 0 < first - pair[1] <= most]
    ways += [range(end, pair[0]) for pair in held if 0 < pair[0] - end <= most]
    frames = np.array([frame for way in ways for frame in way], dtype=int)
    if not len(frames):
        return True
    solid = BodySolid.from_pose(build_leg_surfaces(skeleton), *compute_pose(skeleton, root[frames], rotations[frames]))
    return bool(solid.measure_gaps(ball[frames], np.arange(len(frames))).min() > -_THROUGH)


def _split_parts(low: float, high: float, held, knocked: Sequence[tuple[int, int]], course_changes: Sequence[float],
                 count: int, fps: float) -> list[DribblePart]:
    """Split a stretch where the ball is met and where it is knocked on; what only rolls there is left out."""
    out = []
    for part in _split_at_touches(low, high, held, count, fps):
        cuts = [(first, end) for first, end in knocked if first <= part.high and end > part.low]
        pieces = _cut_part(part, cuts)
        out += pieces if not cuts else [piece for piece in pieces if _is_touched(piece, course_changes, fps)]
    return out


def _cut_part(part: DribblePart, cuts: Sequence[tuple[int, int]]) -> list[DribblePart]:
    """Cut runs of frames, first and end, out of a part; the cut ends are open."""
    out, low, is_met = [], part.low, part.is_met_at_start
    for first, end in cuts:
        out.append(DribblePart(low, first - 1, is_met, False))
        low, is_met = end, False
    return [*out, DribblePart(low, part.high, is_met, part.is_met_at_end)]


def _is_touched(part: DribblePart, course_changes: Sequence[float], fps: float) -> bool:
    """Return whether a part beside a ball that is knocked on has touches: it is long, or the ball changes its course.
    """
    low, high = (edge + sign * is_met * SOONEST * fps for edge, sign, is_met in (
        (part.low, 1, part.is_met_at_start), (part.high, -1, part.is_met_at_end)))
    changes = any(low <= frame <= high for frame in course_changes)
    return part.high - part.low >= (SOONEST if changes else _ROLLS_SECONDS) * fps


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
