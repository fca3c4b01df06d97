"""A ball that leaves a hand over bent fingers, as ground truth for releases that only the hand shows.

No marker sits on fingers, so a recording does not show how they are bent, how long they are and how far a ball rolls
out along them. All three change its velocity. Here they are known: the palm is straight, the fingers are an arc, and
the ball rolls along their inner side like a bead on a rotating rod (r'' = w^2 r), while they bend or yield at a steady
rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...motion import quaternion

_KNUCKLES = 0.45  # share of the length from wrist to fingertips at the knuckles: fingers are 1.22 metacarpals long
_THUMB_SIDE = 0.012  # m, of the ball's centre from the middle of the hand
_STEP = 1e-5  # s, over which the velocity at release is measured


@dataclass(frozen=True, kw_only=True)
class FingerRoll:
    """How a ball rolls out.

    Attributes:
        length: m from the wrist to the fingertips, along the fingers.
        bend: rad between palm and fingertips at release.
        bend_rate: rad/s by which the bend grows during the roll; negative where the fingers yield.
        start, end: shares of the length at which the ball touches the fingers, held and at release.
        seconds: s that the roll takes.
    """

    length: float
    bend: float
    bend_rate: float
    start: float
    end: float
    seconds: float

    def place_ball(self, radius: float, times: np.ndarray) -> np.ndarray:
        """Place the ball's centre in the axes of a left hand in a T-pose.

        Args:
            radius: m.
            times: (T,) s from the release.
        Returns:
            (T, 3) m.
        """
        since = np.maximum(np.asarray(times, float) + self.seconds, 0.0)
        share = self.start * np.cosh(np.arccosh(self.end / self.start) * since / self.seconds)
        curvature = (self.bend + self.bend_rate * (since - self.seconds)) / ((1.0 - _KNUCKLES) * self.length)
        along = (share - _KNUCKLES) * self.length
        angle = along * curvature
        forward = _KNUCKLES * self.length + along * np.sinc(angle / np.pi)
        inward = along * np.sinc(0.5 * angle / np.pi) * np.sin(0.5 * angle)  # (1 - cos) / curvature, stable at 0
        forward, inward = forward - radius * np.sin(angle), inward + radius * np.cos(angle)
        return np.stack([np.full_like(forward, _THUMB_SIDE), forward, -inward], axis=-1)


def roll_ball(times: np.ndarray, positions: np.ndarray, turns: np.ndarray, roll: FingerRoll, *, release: float,
              radius: float, side: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll a ball out of a moving hand.

    Args:
        times: (T,) s of the frames.
        positions: (T, 3) m, the wrist.
        turns: (T, 4), the hand's rotation.
        roll: how it rolls out.
        release: s.
        radius: m.
        side: (3,) signs that make a left hand's place one of this hand.
    Returns:
        The centre (T, 3) m while held (as it would go on, after the release), and position (3,) m and velocity (3,) m/s
        at release.
    """
    from scipy.interpolate import CubicSpline

    wrist, axes = CubicSpline(times, positions), CubicSpline(times, quaternion.to_matrix(turns))

    def place(at: np.ndarray) -> np.ndarray:
        local = roll.place_ball(radius, np.minimum(at - release, _STEP)) * side
        return wrist(at) + np.einsum("tij,tj->ti", axes(at), local)

    before, position, after = place(release + np.array([-_STEP, 0.0, _STEP]))
    return place(times), position, (after - before) / (2.0 * _STEP)
