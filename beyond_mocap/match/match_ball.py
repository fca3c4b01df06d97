"""The one ball of a match: as it was solved, moved into players' hands and to their feet where they touch it; and ball
contact restored on players.

Collision avoidance and head tracking move striking parts off the ball by centimetres: `restore_ball_contact` solves the
contact again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..annotation.ball_contact import build_surfaces, measure_contact_gap
from ..annotation.striking import measure_ball_gap
from ..ball.tracked.solve import SolvedBall
from ..base.time_series import find_runs, interpolate_columns
from ..motion.motion import Motion, compute_pose
from ..motion.track import BALL_RADIUS, Track, clean_track
from ..motion.track.ball_path import BallPath
from ..motion.track.match_data import Match
from ..synthesis.construct.ball_detour import lead_ball_around_body
from ..synthesis.construct.ball_touch.touch_frames import find_nearest_frame
from ..synthesis.construct.contact_geometry import BALL_SECONDS
from ..synthesis.construct.near_miss import miss_ball
from ..synthesis.construct.strike_fixed_ball import FixedStrike, strike_fixed_ball
from ..synthesis.plan import Plan
from ..synthesis.resolved_touches import AT_BALL_GAP, build_trajectory
from ..synthesis.take import KeyResult, Take

_ROUNDING = 1e-4  # m, positions are rounded to this, as in files
_HELD_SECONDS = 4.0  # s before and after a key moment in which a ball may be held

MAX_CLOSED_GAP = 0.15
"""m: the largest gap that is closed, as `OUT_OF_REACH` in `ball_touch.reach_ball`; a player who misses the ball by more
is not corrected."""

MIN_GAP = 1e-3
"""m: smaller gaps are left."""

EASE_SECONDS = 0.3
"""s before and after a touch in which the part moves to the ball and back, less if another touch is within them."""


def build_ball_plan(match: Match, solved: SolvedBall | None, start: float, end: float, fps: float) -> Plan | None:
    """Build a plan that has the ball and no player, for `sample_ball`.

    Args:
        match: the match.
        solved: the solved ball, None if it is not solved.
        start: s.
        end: s.
        fps: frames per second.
    Returns:
        The plan, or None if the ball is not known anywhere.
    """
    inside = (match.times >= start - 1.0 / match.fps) & (match.times <= end + 1.0 / match.fps)
    times, ball = match.times[inside], match.ball[inside]
    if not np.isfinite(ball[:, :2]).all(axis=1).any():
        return None
    track, _ = clean_track(Track(times, np.zeros((len(times), 2)), ball, name="ball"))
    plan = Plan(track=track, fps=fps, solve_touches=solved is not None)
    return plan if solved is None else Plan(**{**vars(plan), "solved": build_trajectory(solved, "", plan)})


def sample_ball(plan: Plan, times: np.ndarray) -> BallPath:
    """Sample the ball of a plan before any player moves it: solved where that is known, otherwise as in the feed.

    Args:
        plan: the plan.
        times: (T,) s.
    Returns:
        The ball path.
    """
    sampled = plan.sample_track(plan.fps)
    place = interpolate_columns(times, sampled.times, sampled.ball, fill_value=np.nan)
    near = np.clip(np.searchsorted(sampled.times, times - 0.5 / plan.fps), 0, len(sampled) - 1)
    measured = sampled.ball_measured[near]
    if plan.solved is None:
        return BallPath(times, place, measured)
    solved, _ = plan.solved.interpolate(times)
    return BallPath(times, np.where(np.isfinite(solved), solved, place), measured)


def find_led_ball(take: Take, ball: BallPath | None) -> tuple[np.ndarray, np.ndarray]:
    """Find the frames (K,) of the match's clock at which a player moves the ball, and the offsets (K, 3) m.

    Args:
        take: of the player.
        ball: before any player moves it (`sample_ball` at the take's times), None without one.
    """
    if ball is None or take.ball is None:
        return np.zeros(0, int), np.zeros((0, 3))
    offset = take.ball.positions - ball.positions
    return _list_moved(offset, round(take.start_time * take.motion.fps))


def _list_moved(offset: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray]:
    """List the frames (K,) of the match's clock, counted from `first`, with an offset (T, 3) m, and these (K, 3)."""
    offset = np.where(np.isfinite(offset), offset, 0.0)
    affected = np.flatnonzero(np.abs(offset).max(axis=1) > 0.5 * _ROUNDING)
    return affected + first, offset[affected]


def apply_led_ball(ball: BallPath, first: int, led: Iterable[tuple[np.ndarray, np.ndarray]]) -> BallPath:
    """Apply to the ball what all players' `find_led_ball` found.

    A player does not move the ball where another one meets it (`lead_ball_between_players`), so several players'
    offsets add up without changing a touch.

    Args:
        ball: T frames.
        first: frame of the match's clock of its first frame.
        led: frames (K,) and offsets (K, 3) m of each player.
    Returns:
        The ball path.
    """
    places, is_led = np.array(ball.positions), np.zeros(len(ball.times), bool)
    for frames, offset in led:
        inside = (frames >= first) & (frames < first + len(places))
        np.add.at(places, frames[inside] - first, offset[inside])
        is_led[frames[inside] - first] = True
    places[is_led, 2] = np.maximum(places[is_led, 2], BALL_RADIUS)
    return BallPath(ball.times, np.round(places / _ROUNDING) * _ROUNDING, ball.measured)


def lead_ball_between_players(
    takes: Sequence[Take], motions: Sequence[Motion], firsts: Sequence[int],
    led: Sequence[tuple[np.ndarray, np.ndarray]], balls: Sequence[BallPath | None],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Lead the ball from one player's touch to the next one's, and around the bodies of all.

    A take's own ball knows no other player's touches of a dribble, and goes round its own body only.

    Args:
        takes: of all players.
        motions: the same after collision avoidance.
        firsts: frame of the match's clock of each one's first frame.
        led: what each moves the ball by (`find_led_ball`).
        balls: as for `find_led_ball`.
    Returns:
        The same, faded out where another player meets the ball, with the moves around each body added to that player's.
    """
    met = [first + _list_met_frames(take) for take, first in zip(takes, firsts)]
    touched, out = np.unique(np.concatenate([np.zeros(0, int), *met])), []
    for (frames, offset), own, take in zip(led, met, takes):
        share = _compute_led_share(frames, own, np.setdiff1d(touched, own), BALL_SECONDS * take.motion.fps)
        out.append((frames, share[:, None] * offset))
    for number, (motion, first, sampled) in enumerate(zip(motions, firsts, balls)):
        if sampled is None:
            continue
        ball = apply_led_ball(sampled, first, out).positions
        held = [(at, at) for at in touched - first if 0 <= at < len(ball)]
        around = lead_ball_around_body(motion.skeleton, motion.root_positions, motion.rotations, ball, held=held,
                                       fps=motion.fps)
        frames, offset = _list_moved(around - ball, first)
        out[number] = np.concatenate([out[number][0], frames]), np.concatenate([out[number][1], offset])
    return out


def _compute_led_share(frames: np.ndarray, own: np.ndarray, others: np.ndarray, reach: float) -> np.ndarray:
    """Compute the share (K,) of a player's offsets at frames that stays: all at `own` touches, none at `others`.

    It fades over `reach` frames, or from the touch before to the one after if these are closer.
    """
    before, after = _find_neighbours(own, frames)
    low, high = _find_neighbours(others, frames)
    rising = np.where(low > before, (frames - low) / np.minimum(after - low, reach), 1.0)
    falling = np.where(high < after, (high - frames) / np.minimum(high - before, reach), 1.0)
    return np.clip(np.minimum(rising, falling), 0.0, 1.0)


def _find_neighbours(touches: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the last touch up to each of K frames and the first one from it on: (K,), -inf and inf where there is none.
    """
    ends = np.array([-np.inf, *touches, np.inf])
    return ends[np.searchsorted(ends, frames, side="right") - 1], ends[np.searchsorted(ends, frames, side="left")]


def _list_met_frames(take: Take) -> np.ndarray:
    """List the frames (N,) in which a part of the body is at the take's ball, ascending."""
    if take.ball is None:
        return np.zeros(0, int)
    keys = [at for key in take.keys for at in _find_meeting(take, key)]
    pushes = [at for push in take.dribble_touches for at in range(push.first, push.last + 1)]
    return np.unique(np.array([*keys, *pushes], dtype=int))


def _find_meeting(take: Take, key: KeyResult) -> range:
    """Find the frames around a key moment in which the part that it names stays at the take's ball."""
    motion, reach = take.motion, round(_HELD_SECONDS * take.motion.fps)
    frame = find_nearest_frame(key.frame, len(motion))
    near = slice(max(frame - reach, 0), frame + reach + 1)
    pose = compute_pose(motion.skeleton, motion.root_positions[near], motion.rotations[near])
    gaps = measure_contact_gap(motion.skeleton, *pose, key.contact_labels, take.ball.positions[near])
    runs = [(first + near.start, end + near.start) for first, end in find_runs(np.abs(gaps) < AT_BALL_GAP)]
    return next((range(first, end) for first, end in runs if first <= frame < end), range(0))


def restore_ball_contact(take: Take, ball: np.ndarray) -> Take:
    """Solve ball contact again after collision avoidance and head tracking moved the striking part.

    A player who misses the ball by design (`synthesis.construct.near_miss`) keeps clear of it.

    Args:
        take: the take.
        ball: (T, 3) m, NaN where unknown.
    Returns:
        The take with its striking parts on the ball at each key moment that touches it. Frames farther than
        EASE_SECONDS from such a moment, and those away from a miss, keep their bits.
    """
    touches = [key for key in take.keys if build_surfaces(take.motion.skeleton, key.contact_labels)]
    found = (_build_meeting(take.motion, key, ball, _find_free_frames(key, touches)) for key in touches)
    meetings = [meeting for meeting in found if meeting is not None]
    motion = take.motion
    if meetings:
        motion = strike_fixed_ball(motion, take.contacts, meetings, has_ground=True).motion
    motion = miss_ball(motion, take.contacts, ball, take.keys, reaches=False)
    return take if motion is take.motion else replace(take, motion=motion)


def _find_free_frames(key: KeyResult, touches: Sequence[KeyResult]) -> tuple[float, float]:
    """Find the frames before and after a touch that are free of other touches."""
    gaps = [round(other.frame) - round(key.frame) for other in touches]
    before, after = [-step for step in gaps if step < 0], [step for step in gaps if step > 0]
    return min(before, default=np.inf), min(after, default=np.inf)


def _build_meeting(motion: Motion, key: KeyResult, ball: np.ndarray,
                   free_frames: tuple[float, float]) -> FixedStrike | None:
    """Build what moves a part to the ball at one key moment; None if it is there already, or too far away."""
    frame = int(np.clip(np.rint(key.frame), 0, len(motion) - 1))
    parts = build_surfaces(motion.skeleton, key.contact_labels)
    if not np.isfinite(ball[frame]).all():
        return None
    places, world = compute_pose(motion.skeleton, motion.root_positions[frame], motion.rotations[frame])
    gaps = [abs(float(measure_ball_gap(part.compute_line(places, world), part.radius, ball[frame]))) for part in parts]
    nearest = int(np.argmin(gaps))
    if not MIN_GAP < gaps[nearest] < MAX_CLOSED_GAP:
        return None
    entry, leave = (min(EASE_SECONDS * motion.fps, frames) for frames in free_frames)
    return FixedStrike(float(frame), parts[nearest], ball[frame], radius=BALL_RADIUS, entry=entry, leave=leave)
