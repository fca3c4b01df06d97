"""A motion laid on the ground: which way the body faces, and where its root goes, at every frame.

The body's own sway about its path is kept: the root is the track plus the sway, turned with the body. Facing is not the
direction of travel; what is kept is the angle between the two that the recording had.
"""

from __future__ import annotations

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.time_series import runs
from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.track import zero_phase_hann

TURN_WEIGHT = 12.0  # of the recording's own turning per frame, against the direction of travel
OFF_THE_FEET = 40.0
"""How many times firmer the recording's own turning is followed by who flies, lies or kneels and so cannot turn at
will."""

_FLIGHT_SECONDS = 0.3  # without a foot on the ground; the flights of running are shorter
_LOW = 0.6  # of the usual height of the hips

STANDS = 0.3
"""m/s; below it a direction of travel says nothing about facing."""

FAINT, AIM = 1e-4, 0.004
"""Weights of the pull to where a standing body would turn: at any speed, and at rest (half way within 1.3 s)."""

HOLD = 1e6
"""Weight of a facing that is given: so much more than all else that it stays."""

ROOT_WINDOW = 1.5  # s, the window within which the root keeps to the track


def facing(
    direction: np.ndarray,
    speed: np.ndarray,
    velocity: np.ndarray,
    turn: np.ndarray,
    kept: np.ndarray | None = None,
    firm: np.ndarray | float = 1.0,
    aim: np.ndarray | None = None,
) -> np.ndarray:
    """(T,) facing in radians, unwrapped: the least squares compromise between travel and the recording's own turning.

    direction (T,) of travel on the track and speed (T,) m/s there; velocity (T, 2) m/s of the recording in its facing
    frame; turn (T,) radians the recording turned since the frame before. At speed the body keeps the recording's angle
    to the direction of travel; where either stands still there is no such angle and the recording's turning decides,
    with a little of `aim`. Every term is quadratic, so the whole is one tridiagonal system. kept: (T,) radians that the
    facing has to be, NaN where it is free: what lies around a stretch that is made anew. firm (T,): how many times
    firmer than usual the recording's own turning is followed (`firmness`). aim: (T,) radians that a body which stands
    slowly turns to.
    """
    own_speed = np.linalg.norm(velocity, axis=1)
    offset = arctan2(velocity[:, 1], velocity[:, 0])
    goal = direction - offset
    trust = _moving(speed) ** 2 * _moving(own_speed) ** 2
    goal, trust = _with_aim(goal, trust, speed, aim, turn)
    if kept is not None:
        goal, trust = np.where(np.isnan(kept), goal, kept), np.where(np.isnan(kept), trust, HOLD)
    return follow_turning(_unwrapped(goal, turn), trust, turn, firm)


def follow_turning(
    goal: np.ndarray, trust: np.ndarray, turn: np.ndarray, firm: np.ndarray | float = 1.0
) -> np.ndarray:
    """The angles for which sum trust (a - goal)^2 + TURN_WEIGHT firm (a' - turn)^2 is least.

    Args:
        goal: (T,) rad, without jumps of whole turns.
        trust: (T,), weight of the goal.
        turn: (T,) rad, wanted since the frame before.
        firm: (T,) or one number, how many times firmer than usual the turning is followed.
    Returns:
        (T,) rad.
    """
    if len(goal) < 2:
        return goal
    squares = BandedLeastSquares(len(goal), reach=1)
    squares.add_value(trust, goal=goal)
    squares.add({1: 1.0, 0: -1.0}, TURN_WEIGHT * np.broadcast_to(firm, len(goal))[1:], turn[1:])
    return squares.solve()[:, 0]


def firmness(standing: np.ndarray, height: np.ndarray, fps: float) -> np.ndarray:
    """(T,) `firm` of `facing`: OFF_THE_FEET where no foot stands for a while or the hips are low, else 1; standing
    (T, 2, 2) bool of heels and toes, height (T,) m of the root."""
    off = ~standing.any(axis=(1, 2))
    out = np.where(height < _LOW * np.median(height), OFF_THE_FEET, 1.0)
    for first, last in runs(off):
        if last - first >= _FLIGHT_SECONDS * fps:
            out[first:last] = OFF_THE_FEET
    return out


def _moving(speed: np.ndarray) -> np.ndarray:
    """(T,) 0 for those who stand, 1 from 1 m/s on: how far a velocity tells where its owner goes."""
    return np.clip((speed - STANDS) / (1.0 - STANDS), 0.0, 1.0)


def _with_aim(goal: np.ndarray, trust: np.ndarray, speed: np.ndarray, aim: np.ndarray | None, turn: np.ndarray):
    """Goals (T,) and their weights with the pull towards `aim`, felt only where little else is known."""
    if aim is None:
        return goal, trust + FAINT
    pull = FAINT + AIM * np.clip(1.0 - speed, 0.0, 1.0) ** 2
    goal, aim = _unwrapped(goal, turn), _unwrapped(aim, turn)
    aim = aim + 2.0 * np.pi * np.round((goal - aim) / (2.0 * np.pi))
    return (trust * goal + pull * aim) / (trust + pull), trust + pull


def _unwrapped(goal: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Angles without jumps of a full turn relative to what the recording's own turning leads one to expect."""
    expected = np.cumsum(turn)
    return np.unwrap(goal - expected) + expected


def root_with_sway(place: np.ndarray, sway: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(T, 2) root on the ground: `place` (T, 2) plus sway (T, 2, in the facing frame) turned by facing `angle` (T,)."""
    return place + quaternion.turned_level(sway, angle)


def pulled_to_track(
    root: np.ndarray, track: np.ndarray, fps: float, window: float = ROOT_WINDOW, rounds: int = 4
) -> np.ndarray:
    """(T, 2) root without what drifts slowly from the track (T, 2): the difference of the two, both seen through a
    Hann window of `window` seconds (../shared/metrics.md, root error), is removed `rounds` times; once would leave a
    third of it, since the window is not sharp."""
    smooth = zero_phase_hann(track, fps, window)
    for _ in range(rounds):
        root = root - (zero_phase_hann(root, fps, window) - smooth)
    return root
