"""The balls of the clips that are shown ride along on the synthesized body.

Where a body part touches the ball in the clip, the ball touches the same part of the synthesized body, also where the
recorded one is some centimetres off it: a marker lies on a ball's surface, and a skeleton has no skin. Between two
touches, as in a dribble, the ball moves as in the clip, placed by both touches and led from one to the other; before
the first and after the last it keeps that touch's placement, so a kicked ball flies as it was recorded, also while the
body goes on with another clip. What lifts or lowers it ends at the ground, where it lies as recorded.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....annotation.striking import BODY_PARTS, build_part_surfaces, find_nearest_point
from ....base.easing import smoothstep
from ....base.errors import TimedMessage
from ....base.time_series import interpolate_columns
from ....library.clip import Clip
from ....library.library import Library
from ....motion import quaternion
from ....motion.humanoid import compute_heading
from ....motion.motion import Motion, forward_kinematics, sample_frames
from ....motion.track import BALL_RADIUS, SampledTrack
from ....motion.track.ball_path import BallPath
from ...plan import Plan
from ...search.source_frames import SourceFrames

_JUMP = 1.0  # m between two clips' balls from which on they are not joined
_TOUCH, _NEAR = 0.03, 0.15  # m between part and ball: always a touch; a touch where it is nearest
_FARTHEST = 1.5  # m from the body at its nearest: a ball that takes no part in what is shown
_LYING = 0.05  # m above rest up to which a ball keeps its height where it is brought to the part
_LIFTED = 0.3  # m above rest from which on a ball is as much higher or lower as the part that touches it
_FREE_SECONDS = 3.0  # for which a ball moves on as recorded, beyond the piece that shows its clip
_KEY_SECONDS = 0.1  # before and after a key moment, which is the touch there
_JOIN_SECONDS = 0.3  # before and after a transition over which two clips' balls are joined


def carry_recorded_ball(library: Library, source: SourceFrames, motion: Motion) -> np.ndarray:
    """Carry the balls of the shown clips along with the synthesized body.

    Args:
        library: the clips.
        source: what T output frames show.
        motion: T frames on the pitch.
    Returns:
        (T, 3) m, the ball's centre; NaN where it is not known.
    """
    edges = [0, *source.transitions.tolist(), len(motion)]
    ball, reach, free = np.full((len(motion), 3), np.nan), int(round(_FREE_SECONDS * motion.fps)), 0
    for start, end in zip(edges, edges[1:]):
        clip = library.clips[source.clip[start]]
        if clip.ball is None:
            continue
        window = slice(min(max(free, start - reach), start), min(len(motion), end + reach))
        clip_frame = _extend_frames(source.clip_frame[start:end], start - window.start, window.stop - end)
        carried = _carry_piece(clip, clip_frame, motion.frames(window.start, window.stop),
                               shown=slice(start - window.start, end - window.start))
        known = np.flatnonzero(np.isfinite(carried[:, 0]))
        if len(known):  # instead of the ball of the pieces before
            ball[start:] = np.nan
            ball[window][known] = carried[known]
            free = window.start + int(known[-1]) + 2  # a frame without a ball lies between two that do not meet
    return _join_pieces(ball, edges, int(round(_JOIN_SECONDS * motion.fps)))


def _extend_frames(clip_frame: np.ndarray, before: int, after: int) -> np.ndarray:
    """Extend fractional clip frames (N,) by frames before and after, at the playback rates of both ends."""
    rates = np.diff(clip_frame) if len(clip_frame) > 1 else np.ones(1)
    first, last = rates[0], rates[-1]
    return np.concatenate([clip_frame[0] + first * np.arange(-before, 0), clip_frame,
                           clip_frame[-1] + last * np.arange(1, after + 1)])


def build_ball_path(library: Library, plan: Plan, track: SampledTrack, *, source: SourceFrames, motion: Motion,
                    ball: np.ndarray) -> BallPath | None:
    """Build the path of a take's ball: the track's, or where it has none and the plan asks for it the recordings'.

    Args:
        library: the clips.
        plan: the plan as requested.
        track: the track at the output's rate.
        source: what the T frames show.
        motion: T frames, in the library's size.
        ball: (T, 3) m of the track, as it is met.
    Returns:
        The path, None without a ball.
    """
    if np.any(np.isfinite(track.ball[:, :2])):
        return BallPath(track.times, ball, track.ball_measured)
    carried = carry_recorded_ball(library, source, motion) if plan.recorded_ball else ball[:0]
    return BallPath(track.times, carried, np.zeros(len(carried), bool)) if np.isfinite(carried).any() else None


def report_recorded_ball(plan: Plan, ball: BallPath | None, seams: Sequence[int]) -> list[str]:
    """Report for how long a recorded ball is shown, and where it changes its place from clip to clip.

    Args:
        plan: of a whole take.
        ball: of the take, T frames; None without any.
        seams: frames at which another clip begins.
    Returns:
        Lines for the user; none where the track has a ball or the plan asks for none.
    """
    if not plan.recorded_ball or np.isfinite(plan.track.ball).any():
        return []
    if ball is None:
        return ["no clip that is shown has a recorded ball"]
    known = np.isfinite(ball.positions).all(axis=1)
    shown = f"{known.sum() / plan.fps:.1f} of {len(known) / plan.fps:.1f} s"
    messages = [] if known.all() else [f"a recorded ball is shown for {shown}: the other clips have none"]
    return [*messages, *(TimedMessage(f"{ball.times[edge]:.1f} s: the recorded ball jumps from one clip to the next",
                                      (ball.times[edge], ball.times[edge]))
                         for edge in _find_jumps(ball.positions, seams))]


def _find_jumps(ball: np.ndarray, transitions: Sequence[int]) -> list[int]:
    """Find the transitions at which the balls (T, 3) m of two clips are not joined."""
    return [edge for edge in transitions if np.linalg.norm(ball[edge] - ball[edge - 1]) > _JUMP]


def _carry_piece(clip: Clip, clip_frame: np.ndarray, motion: Motion, shown: slice) -> np.ndarray:
    """Carry the ball of one clip through one piece, and on until the clip's body touches it again.

    Args:
        clip: a clip with a ball.
        clip_frame: (N,) fractional frames of it, which need not lie within it.
        motion: N frames.
        shown: the frames of the piece that shows the clip.
    Returns:
        (N, 3) m, NaN where it is not known.
    """
    recorded = interpolate_columns(clip_frame, np.arange(len(clip.ball)), clip.ball, fill_value=np.nan)
    played = sample_frames(clip.motion, np.clip(clip_frame, 0, len(clip.motion) - 1))
    body = Motion(motion.skeleton, *played, motion.fps)
    gap, here, there = _find_nearest_parts(body, motion, recorded)
    touches = _find_touches(gap[shown])
    touches = shown.start + _move_to_keys(touches, clip, clip_frame[shown], gap[shown], motion.fps)
    if not len(touches):
        return np.full_like(recorded, np.nan)
    others = _find_touches(gap)
    first = max(others[others < shown.start], default=-1) + 1
    last = min(others[others >= shown.stop], default=len(gap))
    recorded[:first], recorded[last:] = np.nan, np.nan
    turn, height = compute_heading(motion) - compute_heading(body), recorded[:, 2] - BALL_RADIUS
    level = quaternion.rotate_level((recorded - here)[:, :2], turn)
    lift = (there - here)[:, 2] * np.clip(height / _LIFTED, 0.0, 1.0)
    met = np.column_stack([there[:, :2] + level, recorded[:, 2] + lift])
    pull = _find_pull(met, there, gap, np.linalg.norm(recorded - here, axis=1) - gap)
    lift, full = lift + pull[:, 2], np.clip(height, 1e-6, _LIFTED)

    def place(touch: np.ndarray) -> np.ndarray:
        """Place each frame's ball as at a touch (N,)."""
        level = quaternion.rotate_level((recorded - here[touch])[:, :2], turn[touch]) + (there + pull)[touch, :2]
        lifted = recorded[:, 2] + lift[touch] * np.clip(height / full[touch], 0.0, 1.0)
        return np.column_stack([level, np.maximum(lifted, BALL_RADIUS)])

    frames, after = np.arange(len(gap)), np.searchsorted(touches, np.arange(len(gap)))
    before, behind = touches[np.maximum(after - 1, 0)], touches[np.minimum(after, len(touches) - 1)]
    share = np.clip((frames - before) / np.maximum(behind - before, 1), 0.0, 1.0)[:, None]
    return (1.0 - share) * place(before) + share * place(behind)


def _find_pull(ball: np.ndarray, part: np.ndarray, gap: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Find what lets a ball touch a part that it is near to: along the ground where the ball lies, otherwise straight
    to the part, and not through the floor.

    Args:
        ball: (N, 3) m, the ball's centre.
        part: (N, 3) m, the part's nearest point.
        gap: (N,) m that is recorded between both.
        reach: (N,) m from the part's point to the centre of a ball that touches it.
    Returns:
        (N, 3) m, 0 where the ball is not near, or touches the part already.
    """
    apart = ball - part
    height = np.maximum(part[:, 2] + apart[:, 2] * reach / np.maximum(np.linalg.norm(apart, axis=1), 1e-6), BALL_RADIUS)
    height = np.where(ball[:, 2] <= BALL_RADIUS + _LYING, ball[:, 2], height)
    level = np.sqrt(np.maximum(reach**2 - (height - part[:, 2]) ** 2, 0.0))
    share = level / np.maximum(np.linalg.norm(apart[:, :2], axis=1), 1e-6) - 1.0
    pull = np.column_stack([share[:, None] * apart[:, :2], height - ball[:, 2]])
    return np.where(((gap > 0.0) & (gap <= _NEAR))[:, None], pull, 0.0)


def _find_nearest_parts(shown: Motion, motion: Motion, ball: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the part nearest to the ball in each frame of a clip as shown.

    Args:
        shown: N frames of the clip.
        motion: the same as synthesized.
        ball: (N, 3) m, of the clip.
    Returns:
        Gap (N,) m, infinite where the ball is not known; the part's place (N, 3) m in the clip, and as synthesized.
    """
    gaps, here, there = [], [], []
    poses = forward_kinematics(shown), forward_kinematics(motion)
    for surface in (one for part in (*BODY_PARTS, "thigh") for one in build_part_surfaces(shown.skeleton, part)):
        line = surface.compute_line(*poses[0])
        nearest = find_nearest_point(line, ball)
        along = np.linalg.norm(line[1] - line[0], axis=1)
        share = (np.linalg.norm(nearest - line[0], axis=1) / np.maximum(along, 1e-9))[:, None]
        start, end = surface.compute_line(*poses[1])
        gaps.append(np.linalg.norm(ball - nearest, axis=1) - surface.radius - BALL_RADIUS)
        here.append(nearest)
        there.append(start + share * (end - start))
    gap, frames = np.nan_to_num(np.array(gaps), nan=np.inf), np.arange(len(ball))
    best = np.argmin(gap, axis=0)
    return gap[best, frames], np.array(here)[best, frames], np.array(there)[best, frames]


def _find_touches(gap: np.ndarray) -> np.ndarray:
    """Find the frames of touches from the gaps (N,) m; the nearest frame where there is none, or nothing if it is far.
    """
    sides = np.concatenate([[np.inf], gap, [np.inf]])
    is_nearest = (gap <= sides[:-2]) & (gap < sides[2:]) & (gap <= _NEAR)
    touches = np.flatnonzero(is_nearest | (gap <= _TOUCH))
    return touches if len(touches) or gap.min() > _FARTHEST else np.array([int(np.argmin(gap))])


def _move_to_keys(touches: np.ndarray, clip: Clip, clip_frame: np.ndarray, gap: np.ndarray, fps: float) -> np.ndarray:
    """Move touches to the key moments of a clip that are near them in time, where the ball is near the body: there it
    changes its velocity, but one that is recorded off the part may be nearest before or after.

    Args:
        touches: frames of the touches.
        clip: the clip.
        clip_frame: (N,) fractional frames of it.
        gap: (N,) m between body and ball.
        fps: frames per second of the N frames.
    Returns:
        Frames of the touches, in order.
    """
    for key in (row.key for row in clip.annotations if row.key is not None):
        at = int(np.argmin(np.abs(clip_frame - key)))
        is_shown = abs(clip_frame[at] - key) <= clip.motion.fps / fps and gap[at] <= _NEAR
        is_same = np.abs(touches - at) <= _KEY_SECONDS * fps
        if is_shown and is_same.any():
            touches = np.union1d(touches[~is_same], [at])
    return touches


def _join_pieces(ball: np.ndarray, edges: Sequence[int], reach: int) -> np.ndarray:
    """Join the balls (T, 3) m of pieces that follow each other, over at most `reach` frames to either side."""
    joined = ball.copy()
    for start, edge, end in zip(edges, edges[1:], edges[2:]):
        before_last = ball[edge - 2] if edge - start > 1 and np.isfinite(ball[edge - 2]).all() else ball[edge - 1]
        jump = ball[edge] - 2.0 * ball[edge - 1] + before_last
        if not np.linalg.norm(jump) <= _JUMP:  # also where one of them is not known
            continue
        before, behind = min(reach, edge - start), min(reach, end - edge)
        rise = smoothstep(np.arange(1, before + 1) / (before + 1.0))[:, None]
        fall = smoothstep(np.arange(behind, 0, -1) / (behind + 1.0))[:, None]
        joined[edge - before : edge] += 0.5 * rise * jump
        joined[edge : edge + behind] -= 0.5 * fall * jump
    return joined
