"""A synthetic ball in a hand: held, released and flying, with one marker that turns with it, as ground truth.

Until release the ball moves with the hand. Then its centre flies on with its last velocity (without air by default) and
the ball turns at a steady rate, as in Fredriksson, section 6.3, eq. 6.2-6.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.time_series import interpolate_columns
from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from ...motion.supports import GRAVITY
from .bent_fingers import FingerRoll, roll_ball
from .synthetic_body import compute_size

_GRIP = (0.012, 0.105, -0.036)  # m, of a left hand in a T-pose: between the fingers, on the palm's side
_STEP = 1e-3  # s, step of flights with air drag


@dataclass(frozen=True)
class BallRequest:
    """Request for a synthetic ball.

    Attributes:
        release: s at which the ball leaves the hand.
        side: "Left" or "Right".
        radius: m.
        spin_rate: revolutions per second in flight.
        seconds_seen: s of flight after which no camera sees it.
        drag: 1/m, see `ball.physics`.
        label: of the marker.
        grip: (3,) m, the ball's centre in the hand's axes of a T-pose; None: as a hand holds it.
        outward: direction of the marker from the centre of a held ball, in a left hand's axes of a T-pose.
        roll: how the ball rolls out over bent fingers, instead of leaving a rigid grip; None: it does not.
    """

    release: float
    side: str = "Right"
    radius: float = 0.0366
    spin_rate: float = 12.0
    seconds_seen: float = 0.3
    drag: float = 0.0
    label: str = "BALL"
    grip: tuple[float, float, float] | None = None
    outward: tuple[float, float, float] = (0.25, 0.15, -0.95)
    roll: FingerRoll | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class BallTruth:
    """Ground truth of a synthetic ball, without noise.

    Attributes:
        request: the request.
        places: (T, 3) m, the ball's centre.
        marker: (T, 3) m, the marker.
        position: (3,) m, the centre at release.
        velocity: (3,) m/s of the centre at release.
        spin: (3,) rad/s in flight.
        grip: (3,) m, the centre in the hand's axes.
    """

    request: BallRequest
    places: np.ndarray
    marker: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    grip: np.ndarray

    @property
    def speed(self) -> float:
        """Speed at release, m/s."""
        return float(np.linalg.norm(self.velocity))


def build_ball(truth: Motion, request: BallRequest) -> BallTruth:
    """Build the ball of a motion in marker axes.

    Args:
        truth: the motion, as `to_marker_axes` gives it.
        request: the request.
    Returns:
        The ball's ground truth.
    Raises:
        InputError: if the body has no such hand, or the release is outside the motion.
    """
    name = request.side + "Hand"
    if name not in truth.skeleton.names:
        raise InputError("synthetic ball", f"no joint {name}", "a body with that hand", "choose the other side")
    if not 0.0 < request.release < truth.duration:
        raise InputError("synthetic ball", f"release at {request.release:g} s", f"within 0 to {truth.duration:g} s")
    hand = truth.skeleton.index(name)
    side_sign = np.array([1.0, 1.0 if request.side == "Left" else -1.0, 1.0])
    grip = np.array(request.grip) if request.grip is not None else _GRIP * side_sign * compute_size(truth.skeleton)
    positions, turns = (rows[:, hand] for rows in forward_kinematics(truth))
    held = positions + quaternion.rotate(turns, grip)
    outward = np.array(request.outward) * side_sign
    outward = request.radius * outward / np.linalg.norm(outward)
    times = np.arange(len(truth)) / truth.fps
    position, velocity, turn = _find_release(times, held, turns, request.release)
    if request.roll is not None:
        held, position, velocity = roll_ball(times, positions, turns, request.roll, release=request.release,
                                             radius=request.radius, side=side_sign)
    spin = 2.0 * np.pi * request.spin_rate * _find_backspin_axis(velocity)
    after = np.maximum(times - request.release, 0.0)
    flight = _simulate_flight(position, velocity, after, request.drag)
    flying = times > request.release
    places = np.where(flying[:, None], flight, held)
    spun = quaternion.multiply(quaternion.from_rotation_vector(after[:, None] * spin), turn)
    marker = places + quaternion.rotate(np.where(flying[:, None], spun, turns), outward)
    return BallTruth(request=request, places=places, marker=marker, position=position, velocity=velocity, spin=spin,
                     grip=grip)


def _find_release(times, held, turns, release: float):
    """Interpolate place (3,), velocity (3,) and the hand's rotation (4,) at release, between the frames."""
    from scipy.interpolate import CubicSpline

    path = CubicSpline(times, held, axis=0)
    frame = min(max(int(release * (len(times) - 1) / times[-1]), 0), len(times) - 2)
    share = (release - times[frame]) / (times[frame + 1] - times[frame])
    return path(release), path(release, 1), quaternion.slerp(turns[frame], turns[frame + 1], np.array(share))


def _find_backspin_axis(velocity: np.ndarray) -> np.ndarray:
    """Compute the level axis (3,) about which a ball of this velocity has backspin; any axis if it flies straight up.
    """
    across = np.cross([0.0, 0.0, 1.0], velocity)
    return -across / np.linalg.norm(across) if np.linalg.norm(across) > 1e-6 else np.array([0.0, 1.0, 0.0])


def _simulate_flight(position: np.ndarray, velocity: np.ndarray, after: np.ndarray, drag: float) -> np.ndarray:
    """Compute the places (T, 3) m of the centre `after` (T,) seconds of flight."""
    fall = np.array([0.0, 0.0, -GRAVITY])
    if drag == 0.0:
        return position + after[:, None] * velocity + 0.5 * after[:, None] ** 2 * fall
    steps = np.arange(int(np.ceil(after.max() / _STEP)) + 2)
    places = np.empty((len(steps), 3))
    for step in steps:
        places[step] = position
        pull = fall - drag * np.linalg.norm(velocity) * velocity
        position, velocity = position + _STEP * velocity + 0.5 * _STEP**2 * pull, velocity + _STEP * pull
    return interpolate_columns(after, steps * _STEP, places)
