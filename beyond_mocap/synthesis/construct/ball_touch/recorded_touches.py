"""Where a body touches the ball that was recorded with it: the nearest part in each frame, and the frames of touches.

A recorded ball is rarely exactly at the part: a marker lies on a ball's surface, and a skeleton has no skin. So it may
be some centimetres away where it is touched, or inside the part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....annotation.striking import BODY_PARTS, build_part_surfaces, find_nearest_point
from ....library.clip import Clip
from ....motion.motion import Motion, forward_kinematics
from ....motion.track import BALL_RADIUS

NEAR = 0.15
"""m between part and ball up to which it is touched where it is nearest."""
_TOUCH = 0.03  # m between both, to either side: always a touch
_DEEPEST = 0.1  # m inside a part from which on it goes through the ball: from where it is touched is not known
_FARTHEST = 1.5  # m from the body at its nearest: a ball that takes no part in what is shown
_KEY_SECONDS = 0.1  # before and after a key moment, which is the touch there


@dataclass(frozen=True, eq=False, kw_only=True)
class NearestParts:
    """The part of the body that is nearest to the recorded ball, in each of N frames.

    Attributes:
        gap: (N,) m between both surfaces as recorded, negative inside the part; infinite where no ball is known.
        recorded: (N, 3) m, the part's nearest point in the clip.
        shown: (N, 3) m, the same point of the synthesized body.
        reach: (N,) m from that point to the centre of a ball that touches the part.
    """

    gap: np.ndarray
    recorded: np.ndarray
    shown: np.ndarray
    reach: np.ndarray


def find_nearest_parts(recorded: Motion, shown: Motion, ball: np.ndarray) -> NearestParts:
    """Find the part nearest to the ball in each frame of a clip.

    Args:
        recorded: N frames of the clip.
        shown: the same as synthesized.
        ball: (N, 3) m, of the clip; NaN where it is not known.
    """
    gaps, here, there, reach = [], [], [], []
    poses = forward_kinematics(recorded), forward_kinematics(shown)
    for surface in (one for part in (*BODY_PARTS, "thigh") for one in build_part_surfaces(recorded.skeleton, part)):
        line = surface.compute_line(*poses[0])
        nearest = find_nearest_point(line, ball)
        along = np.linalg.norm(line[1] - line[0], axis=1)
        share = (np.linalg.norm(nearest - line[0], axis=1) / np.maximum(along, 1e-9))[:, None]
        start, end = surface.compute_line(*poses[1])
        reach.append(surface.radius + BALL_RADIUS)
        gaps.append(np.linalg.norm(ball - nearest, axis=1) - surface.radius - BALL_RADIUS)
        here.append(nearest)
        there.append(start + share * (end - start))
    gap, frames = np.nan_to_num(np.array(gaps), nan=np.inf), np.arange(len(ball))
    best = np.argmin(gap, axis=0)
    return NearestParts(gap=gap[best, frames], recorded=np.array(here)[best, frames],
                        shown=np.array(there)[best, frames], reach=np.array(reach)[best])


def find_shown_touches(gap: np.ndarray, clip: Clip, clip_frame: np.ndarray, fps: float) -> np.ndarray:
    """Find the touches of a piece that shows a clip.

    Args:
        gap: (N,) m between body and ball as recorded.
        clip: the clip.
        clip_frame: (N,) fractional frames of it.
        fps: frames per second of the N frames.
    Returns:
        Their frames, in order; that of the nearest ball where there is no touch, none where the ball is always far.
    """
    touches = find_touches(gap)
    if not len(touches) and gap.min() <= _FARTHEST:
        touches = np.array([int(np.argmin(np.abs(gap)))])
    return _move_to_keys(touches, clip, clip_frame, gap, fps)


def find_touches(gap: np.ndarray) -> np.ndarray:
    """Find the frames of touches from the gaps (N,) m between body and ball as recorded."""
    before, after = np.concatenate([[np.inf], gap[:-1]]), np.concatenate([gap[1:], [np.inf]])
    is_nearest = (gap <= before) & (gap < after) & (gap <= NEAR)
    is_entered = (gap <= NEAR) & (after < -_DEEPEST)  # the frame before the part goes through the ball
    return np.flatnonzero((is_nearest | is_entered | (np.abs(gap) <= _TOUCH)) & (gap >= -_DEEPEST))


def _move_to_keys(touches: np.ndarray, clip: Clip, clip_frame: np.ndarray, gap: np.ndarray, fps: float) -> np.ndarray:
    """Move touches to the key moments of a clip that are near them in time, where the ball is near the body: there it
    changes its velocity, but one that is recorded off the part may be nearest before or after.
    """
    for key in (row.key for row in clip.annotations if row.key is not None):
        at = int(np.argmin(np.abs(clip_frame - key)))
        is_shown = abs(clip_frame[at] - key) <= clip.motion.fps / fps and gap[at] <= NEAR
        is_same = np.abs(touches - at) <= _KEY_SECONDS * fps
        if is_shown and is_same.any():
            touches = np.union1d(touches[~is_same], [at])
    return touches
