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

from ....base.easing import smoothstep
from ....base.errors import TimedMessage
from ....base.time_series import interpolate_columns
from ....library.clip import Clip
from ....library.library import Library
from ....motion.motion import Motion, sample_frames
from ....motion.track import SampledTrack
from ....motion.track.ball_path import BallPath
from ...plan import Plan
from ...search.source_frames import SourceFrames
from ..ball_detour import lead_ball_around_body
from .recorded_placement import Placements
from .recorded_touches import NEAR, find_nearest_parts, find_shown_touches, find_touches

_JUMP = 1.0  # m within a frame from which on a shown ball is reported to jump
_JOINED = 4.0  # m up to which two clips' balls are joined; beyond it, it is another ball
_FREE_SECONDS = 3.0  # for which a ball moves on as recorded, beyond the piece that shows its clip
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
    all_touches = np.zeros(0, int)
    for start, end in zip(edges, edges[1:]):
        clip = library.clips[source.clip[start]]
        if clip.ball is None:
            continue
        window = slice(min(max(free, start - reach), start), min(len(motion), end + reach))
        clip_frame = _extend_frames(source.clip_frame[start:end], start - window.start, window.stop - end)
        carried, touches = _carry_piece(clip, clip_frame, motion.frames(window.start, window.stop),
                                        shown=slice(start - window.start, end - window.start))
        known = np.flatnonzero(np.isfinite(carried[:, 0]))
        if len(known):  # instead of the ball of the pieces before
            ball[start:] = np.nan
            ball[window][known] = carried[known]
            all_touches = np.append(all_touches, window.start + touches)
            free = window.start + int(known[-1]) + 2  # a frame without a ball lies between two that do not meet
    ball = _join_pieces(ball, edges, all_touches, int(round(_JOIN_SECONDS * motion.fps)))
    return lead_ball_around_body(motion.skeleton, motion.root_positions, motion.rotations, ball=ball,
                                 held=[(frame, frame) for frame in all_touches], fps=motion.fps)


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


def _carry_piece(clip: Clip, clip_frame: np.ndarray, motion: Motion, shown: slice) -> tuple[np.ndarray, np.ndarray]:
    """Carry the ball of one clip through one piece, and on until the clip's body touches it again.

    Args:
        clip: a clip with a ball.
        clip_frame: (N,) fractional frames of it, which need not lie within it.
        motion: N frames.
        shown: the frames of the piece that shows the clip.
    Returns:
        (N, 3) m, NaN where it is not known; and the frames of its touches: none where it is only seen near by.
    """
    recorded = interpolate_columns(clip_frame, np.arange(len(clip.ball)), clip.ball, fill_value=np.nan)
    played = sample_frames(clip.motion, np.clip(clip_frame, 0, len(clip.motion) - 1))
    body = Motion(motion.skeleton, *played, motion.fps)
    parts = find_nearest_parts(body, motion, recorded)
    touches = shown.start + find_shown_touches(parts.gap[shown], clip, clip_frame[shown], motion.fps)
    if not len(touches):
        return np.full_like(recorded, np.nan), touches
    ball = Placements.from_bodies(recorded, parts, body, motion).place_between(touches)
    hidden = find_touches(parts.gap)  # of the clip's body alone, outside the piece
    first, last = hidden[hidden < shown.start], hidden[hidden >= shown.stop]
    ball[: first[-1] + 1 if len(first) else 0] = np.nan
    ball[last[0] if len(last) else len(ball) :] = np.nan
    return ball, touches[parts.gap[touches] <= NEAR]


def _join_pieces(ball: np.ndarray, edges: Sequence[int], touches: np.ndarray, reach: int) -> np.ndarray:
    """Join the balls (T, 3) m of pieces that follow each other, over at most `reach` frames to either side; a ball that
    is touched (K,) stays at the part, so the joint lies between two touches.
    """
    joined = ball.copy()
    for start, edge, end in zip(edges, edges[1:], edges[2:]):
        before_last = ball[edge - 2] if edge - start > 1 and np.isfinite(ball[edge - 2]).all() else ball[edge - 1]
        jump = ball[edge] - 2.0 * ball[edge - 1] + before_last
        if not np.linalg.norm(jump) <= _JOINED:  # also where one of them is not known
            continue
        first, last = touches[touches < edge].max(initial=start - 1), touches[touches >= edge].min(initial=end)
        before, behind = min(reach, edge - 1 - first), min(reach, last - edge)
        share = before / max(before + behind, 1)
        rise = smoothstep(np.arange(1, before + 1) / (before + 1.0))[:, None]
        fall = smoothstep(np.arange(behind, 0, -1) / (behind + 1.0))[:, None]
        joined[edge - before : edge] += share * rise * jump
        joined[edge : edge + behind] -= (1.0 - share) * fall * jump
    return joined
