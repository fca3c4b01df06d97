"""The foot of a reception is slow against the pelvis around its touch: a fast one is a kick to the eye.

A clip that is played faster than recorded, another one that begins close by, and the way to the ball all make it fast.
Its path against the pelvis stays; it is passed along more slowly around the touch, and caught up with before and after,
as far as the swing lasts.
"""

from __future__ import annotations

import numpy as np

from ...annotation.striking import Surface
from ...base.easing import smoothstep
from ...motion.humanoid import identify_joints
from .move_body_part import Body, LimbReference, limb_chain, limit_to_ground, move_limb

CALM_SPEED = 2.6
"""m/s of the ankle against the pelvis up to which it is left alone; the project's target is 3 at most."""

_AROUND_SECONDS = 0.16  # before and after the touch in which the foot is slow; the target holds for 0.13
_CATCH_UP_SECONDS = 0.2  # before and after that in which it catches up with its own time
_SLOWEST = 0.35  # factor on its speed
_STRENGTHS = (0.0, 0.25, 0.5, 0.75, 1.0)  # shares of the slowing down that are tried
_CATCH_UP_SPEED, _FASTER = 5.5, 1.15  # m/s up to which the foot may catch up, below a kick; factor on its own speed
_SLOW_SHARE = 0.5  # of a swing too short for both that is slow


def calm_foot(body: Body, foot: Surface, held: tuple[int, int], is_in_contact: np.ndarray, fps: float) -> Body:
    """Slow a foot down around the frames in which it takes a ball.

    Args:
        body: the body, W frames, with the foot at the ball.
        foot: the foot's surface.
        held: first and last frame of the touch, among the body's, in which the foot stays as it is.
        is_in_contact: (W,) bool, the foot is on the ground and stays where it is.
        fps: frames per second.
    Returns:
        The body; itself where the foot is slow enough, or has no joints of its own.
    """
    chain, frames = limb_chain(body.skeleton, foot), np.arange(len(body.root))
    if None in chain or len(frames) < 4:
        return body
    away = body.places[:, chain[2]] - body.places[:, identify_joints(body.skeleton).hips]
    beyond = frames - np.clip(frames, *held)
    slow = np.abs(beyond) <= _AROUND_SECONDS * fps
    fastest = _measure_speed(away, fps)[slow].max()
    if fastest <= CALM_SPEED:
        return body
    lag = (1.0 - max(CALM_SPEED / fastest, _SLOWEST)) * beyond * _compute_share(beyond, is_in_contact, fps)
    moves = [limit_to_ground(body, foot, slice(None), _delay(away, part * lag)) for part in _STRENGTHS]
    moved = min(moves, key=lambda one: _rate_path(away, one, slow, fps))
    rotations = move_limb(body, LimbReference.from_body(body, chain), moved)
    return Body.from_pose(body.skeleton, body.root, rotations) if moved.any() else body


def _delay(away: np.ndarray, lag: np.ndarray) -> np.ndarray:
    """Compute the moves (W, 3) m of a point that passes its path (W, 3) m `lag` (W,) frames late; 0 where it does not.
    """
    from scipy.interpolate import CubicSpline

    frames = np.arange(len(away))
    return np.where(lag[:, None] != 0.0, CubicSpline(frames, away)(frames - lag) - away, 0.0)


def _rate_path(away: np.ndarray, moves: np.ndarray, slow: np.ndarray, fps: float) -> tuple[bool, float]:
    """Rate moves (W, 3) m: whether the foot catches up too fast, and its largest speed in the frames `slow` (W,)."""
    most = max(_FASTER * _measure_speed(away, fps).max(), _CATCH_UP_SPEED)
    speed = _measure_speed(away + moves, fps)
    return bool(speed.max() > most), float(speed[slow].max())


def _measure_speed(away: np.ndarray, fps: float) -> np.ndarray:
    """Measure the speed (W,) m/s along a path (W, 3) m."""
    return np.linalg.norm(np.gradient(away, axis=0), axis=1) * fps


def _compute_share(beyond: np.ndarray, is_in_contact: np.ndarray, fps: float) -> np.ndarray:
    """Compute the share (W,) of its lag that a foot has: 1 around the touch, 0 where it catches up, or on the ground.

    Args:
        beyond: (W,) frames from the touch, negative before it, 0 while it is held.
        is_in_contact: (W,) bool.
        fps: frames per second.
    """
    share = np.zeros(len(beyond))
    for side in (beyond < 0, beyond > 0):
        passed = np.abs(beyond[side]).astype(float)
        landed = passed[is_in_contact[side]]
        # the ends of the window do not change either
        end = min((_AROUND_SECONDS + _CATCH_UP_SECONDS) * fps, landed.min(initial=np.inf), passed.max(initial=0))
        around = min(_AROUND_SECONDS * fps, _SLOW_SHARE * end)
        share[side] = 1.0 - smoothstep(np.clip((passed - around) / max(end - around, 1e-9), 0.0, 1.0))
    return share
