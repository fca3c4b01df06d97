"""Bring a part of the body to a ball that stays where it is: the ball's flight is given, the body meets it.

`synthesis.construct.strike` moves a tracked ball within its noise; here there is no noise. The part moves by the
shortest vector that closes the gap at the frame of the strike: a limb swings about its upper joint, head and chest move
by bending the spine, any other joint with the whole body. Before and after it is eased, a foot between its lift-off and
its landing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation.striking import Surface, ball_gap, nearest_on
from ...motion.humanoid import identify
from ...motion.motion import Motion
from .carry import (
    MOST_SWING,
    Body,
    Resting,
    above_ground,
    foot_kept,
    limb_carried,
    limb_chain,
    spine_bent,
    swing_to,
    swung,
)
from .meeting import eased_around

LONGEST, SHORTEST = 0.5, 0.12  # s before and after a strike within which the part comes to the ball and returns
MOST = 0.35  # m, largest move of a part
_ROUNDS, _CLOSE = 6, 2e-4  # most rounds of the iteration, and m at which it ends


@dataclass(frozen=True, eq=False)
class Meeting:
    """One strike.

    Attributes:
        frame: output frame, fractional.
        surface: what strikes.
        ball: (3,) m, the ball's centre, NaN where it is missed.
        radius: m, of the ball.
        entry: frames before within which the body may be changed.
        leave: frames after.
    """

    frame: float
    surface: Surface
    ball: np.ndarray
    radius: float
    entry: float
    leave: float


@dataclass(frozen=True, eq=False)
class Met:
    """A motion with its strikes solved.

    Attributes:
        motion: the motion.
        gap: (K,) m between the surfaces at each strike, NaN where the ball is missed.
        moved: (K,) m that the part was moved, NaN where the ball is missed.
    """

    motion: Motion
    gap: np.ndarray
    moved: np.ndarray


def met_at(motion: Motion, standing: np.ndarray, meetings: Sequence[Meeting], grounded: bool = False) -> Met:
    """Bring the parts of a motion to the ball at every strike, within the reach of a body.

    Frames away from the strikes stay bit for bit.

    Args:
        motion: T frames.
        foot_contacts: (T, 2) bool, left and right foot in contact.
        strikes: K strikes.
        has_ground: whether the ground is at height 0 and no foot goes through it.
    """
    root, rotations = np.array(motion.root_positions), np.array(motion.rotations)
    gap, moved = np.full(len(meetings), np.nan), np.full(len(meetings), np.nan)
    count = len(motion)
    for number, meeting in enumerate(meetings):
        if not np.all(np.isfinite(meeting.ball)):
            continue
        at = int(np.clip(round(meeting.frame), 0, count - 1))
        share = _share(meeting, at, count, standing, motion.fps)
        span = np.flatnonzero(share > 0.0)
        low, high = span[0], span[-1] + 1
        body = Body.posed(motion.skeleton, root[low:high], rotations[low:high])
        struck, moved[number], gap[number] = _reached(body, meeting, at - low, share[low:high], grounded)
        root[low:high], rotations[low:high] = struck.root, struck.rotations
    return Met(replace(motion, root_positions=root, rotations=rotations), gap, moved)


def _share(meeting: Meeting, at: int, count: int, standing: np.ndarray, fps: float) -> np.ndarray:
    """Compute the share (T,) of the shift that the part has.

    It is 1 at the strike, 0 outside entry and exit and while the foot is in contact, except for the shortest ease that
    a body needs.
    """
    low = at - np.clip(meeting.entry, SHORTEST * fps, LONGEST * fps)
    high = at + np.clip(meeting.leave, SHORTEST * fps, LONGEST * fps)
    if meeting.surface.part == "foot":
        stands = standing[:, ("left", "right").index(meeting.surface.side)]
        before, after = np.flatnonzero(stands[:at]), np.flatnonzero(stands[at + 1 :])
        lift, land = before[-1] if len(before) else -np.inf, at + 1 + after[0] if len(after) else np.inf
        low, high = max(low, min(lift, at - SHORTEST * fps)), min(high, max(land, at + SHORTEST * fps))
    return eased_around(np.arange(count), low, at, at, high)


def _reached(body: Body, meeting: Meeting, at: int, share: np.ndarray, grounded: bool) -> tuple[Body, float, float]:
    """Bring the part to the ball; return the body, how far the part was moved, and the gap that is left, m."""
    shift, struck, best = np.zeros(3), body, (body, 0.0, abs(_gap(body, meeting, at)))
    for _ in range(_ROUNDS):
        line = struck.line(meeting.surface, at)
        way = meeting.ball - nearest_on(line, meeting.ball)
        far = np.linalg.norm(way)
        need = way * (1.0 - (meeting.surface.radius + meeting.radius) / max(far, 1e-9))
        if np.linalg.norm(need) < _CLOSE:
            break
        shift = shift + need
        shift *= min(1.0, MOST / max(np.linalg.norm(shift), 1e-9))
        if grounded and meeting.surface.part == "foot":
            shift = above_ground(body, meeting.surface, at, shift)
        struck = _carried(body, meeting.surface, at, shift=shift, share=share, grounded=grounded)
        left = abs(_gap(struck, meeting, at))
        if left < best[2]:
            best = struck, float(np.linalg.norm(shift)), left
    return best


def _gap(body: Body, meeting: Meeting, at: int) -> float:
    """Measure the gap, m, between part and ball."""
    return float(ball_gap(body.line(meeting.surface, at), meeting.surface.radius, meeting.ball, meeting.radius))


def _carried(body: Body, surface: Surface, at: int, shift: np.ndarray, share: np.ndarray, grounded: bool) -> Body:
    """Move the surface by `shift` (3,) m at frame `at`, by its share (W,) around it."""
    root, rotations = body.root, body.rotations
    if surface.part in ("foot", "hand", "tool"):
        chain, most = limb_chain(body.skeleton, surface), MOST_SWING["foot" if surface.part == "foot" else "hand"]
        swing = swing_to(body, chain, at, body.places[at, chain[2]] + shift, most)
        moves = swung(body, chain, swing, share)
        if grounded and surface.part == "foot":
            moves = above_ground(body, surface, slice(None), moves)
        rotations = limb_carried(body, Resting.of(body, chain), moves)
    elif surface.part in ("head", "chest"):
        rotations = spine_bent(body, surface, at, shift, share)
    else:
        root, human = root + share[:, None] * shift, identify(body.skeleton)
        for limb in (human.left, human.right):
            rotations = foot_kept(body, limb, root, rotations)
    return Body.posed(body.skeleton, root, rotations)
