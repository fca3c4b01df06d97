"""The ball's way over a whole trial: in the hand until its release, then flying (Fredriksson §6.2)."""

from __future__ import annotations

import numpy as np

from ...ball.flight import Launch, fly
from ...ball.physics import Ball
from ...base.easing import smoothstep
from ...motion.hand import Hand

_SETTLES = 0.10  # s before the release from which on the ball moves from its usual place to where it leaves
_FOLLOWED = 10.0  # s of flight, bounces and rolling at most


def carried_and_thrown(hand: Hand, centre: np.ndarray, launch: Launch, ball: Ball, ground: float = 0.0) -> np.ndarray:
    """(T, 3) m: the ball's centre in every frame of the hand.

    centre: (3,) m, where the ball lies in the hand's frame. launch: how it leaves, s from frame 0. Shortly before, the
    ball goes over to the place of the launch on a spline in the hand's frame, without a jump in place or speed.
    """
    times = hand.times
    held = hand.carried(centre)
    leaves = _held_at(held, hand.fps, launch.time)
    gap = np.asarray(launch.position, float) - leaves
    k = int(np.clip(round(launch.time * hand.fps), 0, len(hand) - 1))
    gap_in_hand = hand.rotation[k].T @ gap
    share = smoothstep(1.0 - (launch.time - times) / _SETTLES)
    places = held + share[:, None] * np.einsum("tij,j->ti", hand.rotation, gap_in_hand)
    gone = times > launch.time
    if gone.any():
        seconds = min(float(times[-1] - launch.time), _FOLLOWED) + 1.0 / hand.fps
        places[gone] = fly(launch, ball, seconds, ground).at(times[gone])
    return places


def _held_at(held: np.ndarray, fps: float, time: float) -> np.ndarray:
    """(3,): where it is at a time between two frames."""
    at = np.clip(time * fps, 0.0, len(held) - 1.0)
    low = min(int(at), len(held) - 2)
    return held[low] + (at - low) * (held[low + 1] - held[low])
