"""Who meets the ball is on it after he was kept out of others' bodies and has turned his head: both move striking parts
off the ball by centimetres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...annotation.ball_contact import surfaces
from ...annotation.striking import ball_gap
from ...motion.motion import Motion, pose_kinematics
from ...motion.track import BALL_RADIUS
from ...synthesis.construct.strike_at import Meeting, met_at
from ...synthesis.take import KeyResult, Take

CLOSED = 0.15
"""Metres of gap that are closed, as much as `synthesis.construct.strike` closes; who misses the ball by more
plays as he does."""

OPEN = 1e-3
"""Metres of gap that are left."""

EASE = 0.3
"""Seconds before and after a touch in which the part comes to the ball and goes back, less where another touch lies
within them."""


def at_ball(take: Take, ball: np.ndarray) -> Take:
    """The take with its striking parts on the ball (T, 3) m, NaN where it is not known, at each key moment at which
    they were meant to be. Frames further than EASE from such a moment keep their bits."""
    touches = [key for key in take.keys if surfaces(take.motion.skeleton, key.touching)]
    found = (_meeting(take.motion, key, ball, _alone(key, touches)) for key in touches)
    meetings = [meeting for meeting in found if meeting is not None]
    if not meetings:
        return take
    return replace(take, motion=met_at(take.motion, take.contacts, meetings, grounded=True).motion)


def _alone(key: KeyResult, touches: Sequence[KeyResult]) -> tuple[float, float]:
    """Frames before and after a touch in which the body is its own."""
    apart = [round(other.frame) - round(key.frame) for other in touches]
    before, after = [-step for step in apart if step < 0], [step for step in apart if step > 0]
    return min(before, default=np.inf), min(after, default=np.inf)


def _meeting(motion: Motion, key: KeyResult, ball: np.ndarray, alone: tuple[float, float]) -> Meeting | None:
    """What brings a part to the ball at one key moment; None where it is there, or too far."""
    frame = int(np.clip(np.rint(key.frame), 0, len(motion) - 1))
    parts = surfaces(motion.skeleton, key.touching)
    if not np.isfinite(ball[frame]).all():
        return None
    places, world = pose_kinematics(motion.skeleton, motion.root_positions[frame], motion.rotations[frame])
    gaps = [abs(float(ball_gap(part.line(places, world), part.radius, ball[frame]))) for part in parts]
    nearest = int(np.argmin(gaps))
    if not OPEN < gaps[nearest] < CLOSED:
        return None
    entry, leave = (min(EASE * motion.fps, frames) for frames in alone)
    return Meeting(float(frame), parts[nearest], ball[frame], radius=BALL_RADIUS, entry=entry, leave=leave)
