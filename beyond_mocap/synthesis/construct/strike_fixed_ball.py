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

from ...annotation.striking import SIDED_PARTS, Surface, find_nearest_point, measure_ball_gap
from ...motion.humanoid import identify_joints
from ...motion.motion import Motion
from .contact_geometry import ease_around
from .move_body_part import (
    MAX_SWING,
    Body,
    LimbReference,
    bend_spine,
    compute_swing_shift,
    hold_foot,
    limb_chain,
    limit_to_ground,
    move_limb,
    solve_swing,
)

# s before and after a strike within which the part comes to the ball and returns
LONGEST_EASE, SHORTEST_EASE = 0.5, 0.12
MAX_SHIFT = 0.35  # m, largest move of a part
_ROUNDS, _CLOSE = 6, 2e-4  # most rounds of the iteration, and m at which it ends


@dataclass(frozen=True, eq=False)
class FixedStrike:
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
class FixedStrikeResult:
    """A motion with its strikes solved.

    Attributes:
        motion: the motion.
        gap: (K,) m between the surfaces at each strike, NaN where the ball is missed.
        moved: (K,) m that the part was moved, NaN where the ball is missed.
    """

    motion: Motion
    gap: np.ndarray
    moved: np.ndarray


def strike_fixed_ball(motion: Motion, foot_contacts: np.ndarray, strikes: Sequence[FixedStrike],
                      has_ground: bool = False) -> FixedStrikeResult:
    """Bring the parts of a motion to the ball at every strike, within the reach of a body.

    Frames away from the strikes stay bit for bit.

    Args:
        motion: T frames.
        foot_contacts: (T, 2) bool, left and right foot in contact.
        strikes: K strikes.
        has_ground: whether the ground is at height 0 and no foot goes through it.
    """
    root, rotations = np.array(motion.root_positions), np.array(motion.rotations)
    gap, moved = np.full(len(strikes), np.nan), np.full(len(strikes), np.nan)
    count = len(motion)
    for number, strike in enumerate(strikes):
        if not np.all(np.isfinite(strike.ball)):
            continue
        at = int(np.clip(round(strike.frame), 0, count - 1))
        share = _compute_share(strike, at, count, foot_contacts, motion.fps)
        span = np.flatnonzero(share > 0.0)
        low, high = span[0], span[-1] + 1
        body = Body.from_pose(motion.skeleton, root[low:high], rotations[low:high])
        reached, moved[number], gap[number] = _reach_ball(body, strike, at - low, share[low:high], has_ground)
        root[low:high], rotations[low:high] = reached.root, reached.rotations
    return FixedStrikeResult(replace(motion, root_positions=root, rotations=rotations), gap, moved)


def _compute_share(strike: FixedStrike, at: int, count: int, foot_contacts: np.ndarray, fps: float) -> np.ndarray:
    """Compute the share (T,) of the shift that the part has.

    It is 1 at the strike, 0 outside entry and exit and while the foot is in contact, except for the shortest ease that
    a body needs.
    """
    low = at - np.clip(strike.entry, SHORTEST_EASE * fps, LONGEST_EASE * fps)
    high = at + np.clip(strike.leave, SHORTEST_EASE * fps, LONGEST_EASE * fps)
    if strike.surface.part == "foot":
        in_contact = foot_contacts[:, ("left", "right").index(strike.surface.side)]
        before, after = np.flatnonzero(in_contact[:at]), np.flatnonzero(in_contact[at + 1 :])
        lift, land = before[-1] if len(before) else -np.inf, at + 1 + after[0] if len(after) else np.inf
        low, high = max(low, min(lift, at - SHORTEST_EASE * fps)), min(high, max(land, at + SHORTEST_EASE * fps))
    return ease_around(np.arange(count), low, at, at, high)


def _reach_ball(body: Body, strike: FixedStrike, at: int, share: np.ndarray, has_ground: bool) -> tuple[Body, float,
        float]:
    """Bring the part to the ball; return the body, how far the part was moved, and the gap that is left, m."""
    shift, moved_body, best = np.zeros(3), body, (body, 0.0, abs(_measure_gap(body, strike, at)))
    for _ in range(_ROUNDS):
        line = moved_body.surface_line(strike.surface, at)
        offset = strike.ball - find_nearest_point(line, strike.ball)
        far = np.linalg.norm(offset)
        need = offset * (1.0 - (strike.surface.radius + strike.radius) / max(far, 1e-9))
        if np.linalg.norm(need) < _CLOSE:
            break
        shift = shift + need
        shift *= min(1.0, MAX_SHIFT / max(np.linalg.norm(shift), 1e-9))
        if has_ground and strike.surface.part == "foot":
            shift = limit_to_ground(body, strike.surface, at, shift)
        moved_body = _move_part(body, strike.surface, at, shift=shift, share=share, has_ground=has_ground)
        left = abs(_measure_gap(moved_body, strike, at))
        if left < best[2]:
            best = moved_body, float(np.linalg.norm(shift)), left
    return best


def _measure_gap(body: Body, strike: FixedStrike, at: int) -> float:
    """Measure the gap, m, between part and ball."""
    return float(measure_ball_gap(body.surface_line(strike.surface, at), strike.surface.radius, strike.ball,
                                  strike.radius))


def _move_part(body: Body, surface: Surface, at: int, shift: np.ndarray, share: np.ndarray, has_ground: bool) -> Body:
    """Move the surface by `shift` (3,) m at frame `at`, by its share (W,) around it."""
    root, rotations = body.root, body.rotations
    if surface.part in SIDED_PARTS:
        chain, most = limb_chain(body.skeleton, surface), MAX_SWING["foot" if surface.part == "foot" else "hand"]
        swing = solve_swing(body, chain, at, body.places[at, chain[2]] + shift, most)
        moves = compute_swing_shift(body, chain, swing, share)
        if has_ground and surface.part == "foot":
            moves = limit_to_ground(body, surface, slice(None), moves)
        rotations = move_limb(body, LimbReference.from_body(body, chain), moves)
    elif surface.part in ("head", "chest"):
        rotations = bend_spine(body, surface, at, shift, share)
    else:
        root, human = root + share[:, None] * shift, identify_joints(body.skeleton)
        for limb in (human.left, human.right):
            rotations = hold_foot(body, limb, root, rotations)
    return Body.from_pose(body.skeleton, root, rotations)
