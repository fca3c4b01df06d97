"""Bring a part of the body near the ball without touching it: the player who loses a duel reaches and misses.

The ball is not moved. The nearest part that the labels name reaches to within FARTHEST of the ball's surface at the key
moment, if it can, unless the labels let the ball pass; then every part stays CLEARANCE away from the ball for
WINDOW_SECONDS around it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...annotation.ball_contact import build_surfaces, choose_contact_labels
from ...annotation.labels import avoids_ball
from ...annotation.striking import Surface, build_part_surfaces, measure_ball_gap
from ...annotation.vocabulary import SIDES
from ...motion.motion import Motion, compute_pose
from ...motion.track import BALL_RADIUS
from ..take import KeyResult
from .strike_fixed_ball import MAX_SHIFT, FixedStrike, strike_fixed_ball

CLEARANCE, FARTHEST = 0.05, 0.15
"""m from the ball's surface that a player who misses keeps at least, and that the reaching part is away at most."""

WINDOW_SECONDS = 0.2
"""s before and after a miss in which no part comes nearer: the ball is struck by the other player, and leaves."""

_AIM = 0.02  # m beyond a limit that is aimed at, so that the frames beside the solved one keep it too
_STANCE_COST = 0.3  # m, a raised foot reaches before one in contact that is so much nearer
_EASE_SECONDS = 0.3  # s over which a part leaves its motion and returns
_ROUNDS = 4  # most rounds: to push a part away at one frame may bring it nearer at another
_OTHER_PARTS = ("foot", "head")  # parts that keep away without being named


def miss_ball(
    motion: Motion, foot_contacts: np.ndarray, ball: np.ndarray, keys: Sequence[KeyResult], reaches: bool = True
) -> Motion:
    """Keep a body off the ball at every key moment that misses it. Frames away from these stay bit for bit.

    Args:
        motion: T frames on the pitch, ground at height 0.
        foot_contacts: (T, 2) bool, left and right foot in contact.
        ball: (T, 3) m, its centre, NaN where it is unknown.
        keys: all key moments; those in which the player meets the ball limit the time around the others.
        reaches: whether a part that is too far away comes nearer, too: not after bodies were separated.
    Returns:
        The motion.
    """
    met = [key.frame for key in keys if build_surfaces(motion.skeleton, key.contact_labels)]
    for key in keys:
        frames = _find_frames(key.frame, met, len(motion), motion.fps)
        if key.requested.misses_ball and len(frames) and np.isfinite(ball[frames]).all():
            labels = choose_contact_labels(key.words, key.requested.words)
            if reaches and not avoids_ball(labels):
                at = int(frames[np.abs(frames - key.frame).argmin()])
                motion = _reach_near(motion, foot_contacts, ball, labels, at)
            motion = _keep_clear(motion, foot_contacts, ball, labels, frames)
    return motion


def measure_clearance(
    motion: Motion, ball: np.ndarray, labels: Sequence[str], frames: Sequence[int] | np.ndarray
) -> np.ndarray:
    """Measure how far the parts of a body that may meet the ball are from it.

    Args:
        motion: T frames.
        ball: (T, 3) m, its centre.
        labels: labels that name the reaching part.
        frames: F frames.
    Returns:
        (P, F) m between the surfaces of each part and of the ball, negative where they overlap.
    """
    places, world = compute_pose(motion.skeleton, motion.root_positions[frames], motion.rotations[frames])
    return np.array([[measure_ball_gap(part.compute_line(places[n], world[n]), part.radius, ball[frame])
                      for n, frame in enumerate(frames)] for part in _list_parts(motion, labels)])


def _list_parts(motion: Motion, labels: Sequence[str]) -> list[Surface]:
    """List the parts that the labels name first, then the others that keep away."""
    named = build_surfaces(motion.skeleton, labels)
    others = [part for name in _OTHER_PARTS for part in build_part_surfaces(motion.skeleton, name)]
    known = {(part.part, part.side) for part in named}
    return [*named, *(part for part in others if (part.part, part.side) not in known)]


def _find_frames(frame: float, met: Sequence[float], count: int, fps: float) -> np.ndarray:
    """Find the frames around a miss in which the body keeps clear: up to halfway to where the player meets the ball."""
    before, after = ([0.5 * (frame + other) for other in met if side * (other - frame) > 0.0] for side in (-1, 1))
    low = max([frame - WINDOW_SECONDS * fps, *before, 0.0])
    high = min([frame + WINDOW_SECONDS * fps, *after, count - 1.0])
    return np.arange(int(np.ceil(low)), int(high) + 1)


def _reach_near(motion: Motion, foot_contacts: np.ndarray, ball: np.ndarray, labels: Sequence[str], at: int) -> Motion:
    """Bring the nearest named part, a raised foot before one in contact, to within FARTHEST of the ball at a frame."""
    named = build_surfaces(motion.skeleton, labels)
    if not named:
        return motion
    gaps = measure_clearance(motion, ball, labels, [at])[: len(named), 0]
    stands = [part.part == "foot" and foot_contacts[at, SIDES.index(part.side)] for part in named]
    nearest = int(np.argmin(gaps + _STANCE_COST * np.array(stands)))
    if not FARTHEST < gaps[nearest] < FARTHEST + MAX_SHIFT:
        return motion
    strike = _build_strike(named[nearest], ball, at, FARTHEST - _AIM, motion.fps)
    return strike_fixed_ball(motion, foot_contacts, [strike], has_ground=True).motion


def _keep_clear(motion: Motion, foot_contacts: np.ndarray, ball: np.ndarray, labels: Sequence[str],
                frames: np.ndarray) -> Motion:
    """Push every part away that comes nearer than CLEARANCE, at the frame where it is nearest."""
    parts = _list_parts(motion, labels)
    for _ in range(_ROUNDS):
        gaps = measure_clearance(motion, ball, labels, frames)
        close = np.flatnonzero(gaps.min(axis=1, initial=np.inf) < CLEARANCE)
        if not len(close):
            break
        strikes = [_build_strike(parts[n], ball, int(frames[gaps[n].argmin()]), CLEARANCE + _AIM, motion.fps)
                   for n in close]
        motion = strike_fixed_ball(motion, foot_contacts, strikes, has_ground=True).motion
    return motion


def _build_strike(part: Surface, ball: np.ndarray, frame: int, gap: float, fps: float) -> FixedStrike:
    """Build what brings a part to a gap, m, from the ball: a larger ball is met."""
    ease = _EASE_SECONDS * fps
    return FixedStrike(float(frame), part, ball[frame], radius=BALL_RADIUS + gap, entry=ease, leave=ease)
