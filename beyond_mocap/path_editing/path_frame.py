"""A motion relative to a path: where the body is, and how it is turned, in the path's moving frame.

The frame "path" is the one of Path editing §3.1.2.2 and §3.1.3: its Z stays up, its X is the path's tangent projected
on the ground. The other two show why it is the one to take: "tangent" follows the whole tangent, so that a hill tips
the body over; "absolute" (§3.1.2.1) turns the body with the path, but not what it is off the path.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ..base.banded_least_squares import BandedLeastSquares
from ..base.errors import InputError
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.skeleton import Skeleton
from ..motion.track import zero_phase_hann

FRAMES = ("path", "tangent", "absolute")

CLEAR = 0.25
"""m/s over the ground from which on a direction of travel is believed; below, the heading is carried across."""

_FULL, _POWER, _MOST = 0.5, 8, 1e6  # weight of a direction: (speed / _FULL) ** _POWER, at most _MOST
_STIFF, _TIGHT = 0.1, 0.03  # seconds: of the heading's smoothness, and beyond which a gap is crossed in a straight line
_STILL = 0.01  # m/s: a path passed slower has no heading
_COMES, _SURELY = 1.0, 0.6  # seconds; m/s above which speed alone counts


@dataclass(frozen=True, eq=False, kw_only=True)
class Residuals:
    """T frames of a motion in the moving frame of its own path.

    place (T, 3) m of the root and rotations (T, J, 4) local, the root's relative to the frame; step (T,) m of the
    path's length since the frame before, 0 in the first; standing (T, 2, 2) bool of heels and toes, left and right;
    frames (T,) of the source, in general fractional; turn (T,) radians that the path turns since the frame before;
    under (T, 2) m from the path up to the ground under each foot and up (T, 2, 3) its normal in the frame; fps,
    skeleton. Every array has a row a frame.
    """

    place: np.ndarray
    rotations: np.ndarray
    step: np.ndarray
    standing: np.ndarray
    frames: np.ndarray
    turn: np.ndarray
    under: np.ndarray
    up: np.ndarray
    fps: float
    skeleton: Skeleton

    def __len__(self) -> int:
        return len(self.place)

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Every array by its field's name."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def changed(self, **changes) -> Residuals:
        """The same but for some fields."""
        return replace(self, **changes)

    def rows(self, which) -> Residuals:
        """The frames `which`, a slice or indices; their steps and turns stay as they are."""
        return replace(self, **{name: values[which] for name, values in self.arrays.items()})


@dataclass(frozen=True, eq=False)
class MovingFrame:
    """Where the frame is and how it is turned: origin (T, 3) m, heading (T,) radians unwrapped, slope (T,) radians that
    the tangent rises."""

    origin: np.ndarray
    heading: np.ndarray
    slope: np.ndarray

    def turns(self, frame: str) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (T, 4) of what is off the path, and of the body, from `frame`, one of FRAMES, into the world."""
        level = quaternion.about_up(self.heading)
        if frame == "absolute":
            return quaternion.identity(len(level)), level
        if frame == "tangent":
            tipped = quaternion.multiply(level, quaternion.about_axis(np.array([0.0, 1.0, 0.0]), -self.slope))
            return tipped, tipped
        return level, level


def check_frame(frame: str) -> None:
    """InputError where `frame` is none of FRAMES."""
    if frame not in FRAMES:
        raise InputError("frame", str(frame), f"one of {', '.join(FRAMES)}")


def relative(frame: str, moving: MovingFrame, root: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The root's place (T, 3) m and rotation (T, 4) in the moving frame; root (T, 3) m and turned (T, 4) in the
    world."""
    off, body = moving.turns(frame)
    place = quaternion.rotate(quaternion.inverse(off), root - moving.origin)
    return place, quaternion.multiply(quaternion.inverse(body), turned)


def placed(
    frame: str, moving: MovingFrame, place: np.ndarray, rotations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Root (T, 3) m and local rotations (T, J, 4) in the world of what is `place` and `rotations` in the moving frame
    (Path editing §4.2.2, §4.2.3): the inverse of `relative`."""
    off, body = moving.turns(frame)
    out = np.array(rotations, dtype=float)
    out[:, 0] = quaternion.multiply(body, out[:, 0])
    return moving.origin + quaternion.rotate(off, place), out


def moving_frame(
    origin: np.ndarray, tangent: np.ndarray, arc: np.ndarray, fps: float, otherwise: float | None = None
) -> MovingFrame:
    """The frame at places `origin` (T, 3) m of a path with tangents (T, 3) of any length, passed at lengths `arc` (T,)
    m.

    otherwise: the heading in radians of a path that leads nowhere over the ground; without it its first tangent's."""
    length = np.linalg.norm(tangent, axis=1)
    along = tangent / np.maximum(length, 1e-12)[:, None]
    pace = np.abs(np.gradient(arc)) * fps if len(arc) > 1 else np.zeros(1)
    level = np.linalg.norm(along[:, :2], axis=1)
    return MovingFrame(
        origin, heading(along, pace * level, fps, otherwise), arctan2(along[:, 2], np.maximum(level, 1e-12))
    )


def heading(along: np.ndarray, speed: np.ndarray, fps: float, otherwise: float | None = None) -> np.ndarray:
    """(T,) radians, unwrapped: the direction over the ground of tangents `along` (T, 3), passed at speed (T,) m/s over
    the ground.

    Where the horizontal tangent vanishes (standing still, vertical stretches, cusps) it says nothing, and a body that
    stands does not spin with it: least squares over frames, sum w |h - a|^2 + s^4 |h''|^2 + (s^2 / t)^2 |h'|^2 with a
    the tangent's direction, s = _STIFF, t = _TIGHT, and the weight w falling steeply below a slow walk, _FULL. At a
    walk and above that is the tangent's own direction. Who sways or shifts his feet about is slow, however fast that
    is: what counts is how far he comes within a second.
    """
    mean = zero_phase_hann(along[:, :2] * speed[:, None], fps, _COMES) if len(along) > 2 else along[:, :2]
    speed = np.maximum(np.minimum(np.linalg.norm(mean, axis=1), speed), speed - _SURELY)
    raw = arctan2(along[:, 1], along[:, 0])
    clear = speed >= min(CLEAR, 0.5 * speed.max(initial=0.0))
    if len(raw) < 3 or speed.max(initial=0.0) < _STILL:
        return np.full(len(raw), raw[0] if otherwise is None else otherwise)
    at = np.arange(len(raw))
    near = np.interp(at, at[clear], np.unwrap(raw[clear]))
    goal = near + quaternion.wrapped(raw - near)
    weight = np.minimum((speed / _FULL) ** _POWER, _MOST) + 1e-9
    stiff = (_STIFF * fps) ** 4
    squares = BandedLeastSquares(len(raw), reach=2)
    squares.add_difference(2, stiff)
    squares.add_difference(1, stiff / (_TIGHT * fps) ** 2)
    # about the first direction: what is solved for stays small, and so does its rounding
    squares.add_value(weight, goal=goal - goal[0])
    return goal[0] + squares.solve()[:, 0]
