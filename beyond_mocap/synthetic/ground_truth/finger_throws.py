"""Varied synthetic throws with a known release, to measure how far estimates and their margins hold.

Bodies, styles, speeds, frame rates, places of markers, and fingers are drawn from a seed. The ball rolls out over bent
fingers, or leaves out of a rigid grip. Fingers are drawn wide, since no recording shows them: 10 to 45 degrees bent,
8 % shorter or longer than usual, yielding by up to a sixth of a radian during the roll or pushing a little.
"""

from __future__ import annotations

import numpy as np

from ...motion.hand import build_hand
from ..performers import Performer, build_performer_throw, build_thrower
from ..throws import Throw, build_throw
from .bent_fingers import FingerRoll
from .synthetic_ball import BallRequest
from .synthetic_body import compute_size
from .synthetic_markers import SyntheticTrial, build_trial

_RATES = (120.0, 200.0, 240.0, 360.0)
_SUBJECTS = 12
_SLOWEST, _FASTEST = 8.0, 36.0  # m/s
_SIDEARM_SHARE = 0.25
_HAND_LENGTH = 0.18  # m from wrist to fingertips of an adult
_LENGTH, _BEND = (0.92, 1.08), (10.0, 45.0)  # of the usual length; degrees
_START, _END = (0.62, 0.78), (0.86, 0.97)  # shares of the hand's length where the ball lies, and where it leaves
_ROLL, _BEND_CHANGE = (0.7, 1.3), (-0.3, 0.1)  # of the seconds that a bead on a rod needs; rad during the roll
_RELEASE = (-0.3, 0.3)  # rolls by which the ball leaves before or after the planned time
_MIN_TURN = 5.0  # rad/s of a hand


def build_finger_throw(seed: int, is_rigid: bool = False) -> SyntheticTrial:
    """Build a throw with markers of the set `driveline`, and its ball.

    Args:
        seed: of everything that varies; the same throw for both kinds of release.
        is_rigid: the ball leaves a rigid grip, instead of rolling out over bent fingers.
    Returns:
        The trial and its ground truth.
    """
    chance = np.random.default_rng([seed, 26])
    thrower = build_thrower(seed % _SUBJECTS)
    thrown = _build_body(thrower, chance)
    roll = _draw_roll(thrown, chance)
    release = thrown.release + float(chance.uniform(*_RELEASE)) * roll.seconds
    ball = BallRequest(release, side=thrown.arm.capitalize(), roll=None if is_rigid else roll)
    return build_trial(thrown.motion, "driveline", seed=seed, ball=ball)


def _build_body(thrower: Performer, chance: np.random.Generator) -> Throw:
    """Build the motion of a throw."""
    speed = float(chance.uniform(_SLOWEST, min(_FASTEST, thrower.fastest)))
    target = float(np.clip(0.6 * speed, 4.0, 18.0)), float(chance.uniform(-1.0, 1.0)), float(chance.uniform(0.6, 1.6))
    fps = float(chance.choice(_RATES))
    if chance.uniform() < _SIDEARM_SHARE:
        return build_throw(target, speed, thrower.side, "sidearm", skeleton=thrower.skeleton, fps=fps)
    return build_performer_throw(thrower, target, speed, chance, fps)


def _draw_roll(thrown: Throw, chance: np.random.Generator) -> FingerRoll:
    """Draw how the ball rolls out of the hand of a throw."""
    hand = build_hand(thrown.motion, thrown.arm)
    moves = np.gradient(hand.to_world(hand.finger) - hand.origin, 1.0 / hand.fps, axis=0)
    turn = max(float(np.linalg.norm(moves[int(thrown.release * hand.fps)])), _MIN_TURN)
    start, end = float(chance.uniform(*_START)), float(chance.uniform(*_END))
    seconds = float(np.arccosh(end / start) / turn * chance.uniform(*_ROLL))
    length = _HAND_LENGTH * compute_size(thrown.motion.skeleton) * float(chance.uniform(*_LENGTH))
    return FingerRoll(length=length, bend=float(np.radians(chance.uniform(*_BEND))),
                      bend_rate=float(chance.uniform(*_BEND_CHANGE)) / seconds, start=start, end=end,
                      seconds=seconds)  # fmt: skip
