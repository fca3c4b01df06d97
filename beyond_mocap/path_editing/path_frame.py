"""A motion's own path, and the motion relative to a path: where the body is, and how it is turned, in its moving frame.

Smooth curves through the motion's places on the ground (Path editing §3.1.1): a polynomial, as the paper has it, and a
smoothing spline, which does not care how long the motion is.

The frame "path" is the one of §3.1.2.2 and §3.1.3: its Z stays up, its X is the path's tangent projected on the ground.
The other two show why it is the one to take: "tangent" follows the whole tangent, so that a hill tips the body over;
"absolute" (§3.1.2.1) turns the body with the path, but not what it is off the path.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ..base.banded_least_squares import BandedLeastSquares
from ..base.errors import InputError
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.contacts import recorded_floor
from ..motion.humanoid import identify
from ..motion.motion import Motion, forward_kinematics
from ..motion.path.path import Path, PolynomialPath, SplinePath
from ..motion.path.smooth_spline import smoothing_spline, spline_pieces
from ..motion.skeleton import Skeleton
from ..motion.track import zero_phase_hann

FRAMES = ("path", "tangent", "absolute")

CLEAR = 0.25
"""m/s over the ground from which on a direction of travel is believed; below, the heading is carried across."""
_FULL, _POWER, _MOST = 0.5, 8, 1e6  # weight of a direction: (speed / _FULL) ** _POWER, at most _MOST
_STIFF, _TIGHT = 0.1, 0.03  # seconds: of the heading's smoothness, and beyond which a gap is crossed in a straight line
_STILL = 0.01  # m/s: a path passed slower has no heading
_COMES, _SURELY = 1.0, 0.6  # seconds; m/s above which speed alone counts

KINDS = ("spline", "polynomial")
SECONDS = 0.3
"""Sway faster than about 0.7 of a second goes by the path, slower is a way taken."""
_ORDER, _PASSES = 3, 4
_ENDS, _ENDS_SECONDS = 5.0, 0.15  # times that the first and last frame count more, and how soon that is over
_FLAT = 0.10  # metres between the lowest and highest ground that a flat recording seems to have


@dataclass(frozen=True, eq=False, kw_only=True)
class Residuals:
    """T frames of a motion in the moving frame of its own path.

    place (T, 3) m of the root and rotations (T, J, 4) local, the root's relative to the frame; step (T,) m of the
    path's length since the frame before, 0 in the first; standing (T, 2, 2) bool of heels and toes, left and right;
    frames (T,) of the source, in general fractional; turn (T,) radians that the path turns since the frame before;
    under (T, 2) m from the path up to the ground under each foot and up (T, 2, 3) its normal in the frame; fps,
    skeleton. Every array has a row a frame."""

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


def placed(frame: str, moving: MovingFrame, place: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root (T, 3) m and local rotations (T, J, 4) in the world of what is `place` and `rotations` in the moving frame
    (Path editing §4.2.2, §4.2.3): the inverse of `relative`."""
    off, body = moving.turns(frame)
    out = np.array(rotations, dtype=float)
    out[:, 0] = quaternion.multiply(body, out[:, 0])
    return moving.origin + quaternion.rotate(off, place), out


def moving_frame(origin: np.ndarray, tangent: np.ndarray, arc: np.ndarray, fps: float,
                 otherwise: float | None = None) -> MovingFrame:
    """The frame at places `origin` (T, 3) m of a path with tangents (T, 3) of any length, passed at lengths `arc` (T,)
    m.

    otherwise: the heading in radians of a path that leads nowhere over the ground; without it its first tangent's."""
    length = np.linalg.norm(tangent, axis=1)
    along = tangent / np.maximum(length, 1e-12)[:, None]
    pace = np.abs(np.gradient(arc)) * fps if len(arc) > 1 else np.zeros(1)
    level = np.linalg.norm(along[:, :2], axis=1)
    return MovingFrame(origin, heading(along, pace * level, fps, otherwise),
                       arctan2(along[:, 2], np.maximum(level, 1e-12)))


def heading(along: np.ndarray, speed: np.ndarray, fps: float, otherwise: float | None = None) -> np.ndarray:
    """(T,) radians, unwrapped: the direction over the ground of tangents `along` (T, 3), passed at speed (T,) m/s over
    the ground.

    Where the horizontal tangent vanishes (standing still, vertical stretches, cusps) it says nothing, and a body that
    stands does not spin with it: least squares over frames, sum w |h - a|^2 + s^4 |h''|^2 + (s^2 / t)^2 |h'|^2 with a
    the tangent's direction, s = _STIFF, t = _TIGHT, and the weight w falling steeply below a slow walk, _FULL. At a
    walk and above that is the tangent's own direction. Who sways or shifts his feet about is slow, however fast that
    is: what counts is how far he comes within a second."""
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


def fit_path(motion: Motion, standing: np.ndarray, kind: str = "spline", degree: int = 13) -> Path:
    """The path of a motion, on the ground; its parameter is seconds from the first frame.

    standing: (T, 2, 2) bool, `contacts.points` of the motion. kind: one of KINDS. degree: of the polynomial. InputError
    for another kind, a degree too high, fewer than two frames."""
    if kind not in KINDS:
        raise InputError("path fit", kind, " or ".join(KINDS))
    places, times = places_on_ground(motion, standing), np.arange(len(motion)) / motion.fps
    return fit_spline(places, times) if kind == "spline" else fit_polynomial(places, times, degree)


def fit_polynomial(places: np.ndarray, times: np.ndarray, degree: int) -> PolynomialPath:
    """The polynomial of a degree that is nearest to places (T, 3) in metres at times (T,) in seconds, by least squares.

    Legendre polynomials of time scaled to -1 .. 1 are nearly orthogonal over even frames, so that degree 45 is as exact
    as degree 2. Where frames are so few for the degree that the polynomial would swing between them, they are filled up
    by a cubic spline through them. InputError where the degree is below 1 or there are too few frames for it."""
    places, times = _checked(places, times)
    if not 1 <= degree <= len(times) - 1:
        raise InputError("path fit", f"degree {degree}", f"1 to {len(times) - 1}, one less than the frames")
    places, times = _dense(places, times, degree)
    scaled = (2.0 * times - times[0] - times[-1]) / (times[-1] - times[0])
    basis = np.polynomial.legendre.legvander(scaled, degree)
    orthogonal, triangle = np.linalg.qr(basis)
    origin = places.mean(axis=0)
    coefficients = np.linalg.solve(triangle, orthogonal.T @ (places - origin))
    coefficients[0] += origin
    return PolynomialPath(coefficients, (float(times[0]), float(times[-1])))


def _dense(places: np.ndarray, times: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (M, 3) at times (M,), so many that least squares at even times do not swing between them: twice the root
    of their number is at least the degree (Dahlquist and Björck 1974)."""
    if degree <= 2.0 * np.sqrt(len(times)):
        return places, times
    from scipy.interpolate import CubicSpline

    parts = int(np.ceil(0.35 * degree**2 / (len(times) - 1)))
    fine = np.interp(np.arange(parts * (len(times) - 1) + 1) / parts, np.arange(len(times)), times)
    return CubicSpline(times, places)(fine), fine


def fit_spline(places: np.ndarray, times: np.ndarray, seconds: float = SECONDS) -> SplinePath:
    """The smooth curve near places (T, 3) in metres at times (T,) in seconds: least squares, and a price on the change
    of acceleration; what is left over is smoothed again and added, which makes the step from way to sway steeper
    (Tukey's twicing). seconds: sets where that step is.

    A body rides as near to its new path as its own path is to it in the mean over a stride, so this is the root error
    of all that follows. Measured on 14 recordings (CMU, LAFAN1, Bandai, runs, kicks), root error mean / 95 % in cm, and
    what a sway of one stride a second loses: price on acceleration, 0.4 s: 0.5 to 9 / 1 to 27, 2 %; 0.2 s: 0.3 to 2 /
    0.6 to 8, 29 %; this one: 0.2 to 1.2 / 0.3 to 2.5, 8 %. Its heading wobbles by a degree rms about its own mean over
    1.5 s in walks. Without the weight on the ends, where there are values on one side only, 0.2 to 1.4 / 0.5 to 4.3."""
    places, times = _checked(places, times)
    after, left = times - times[0], times[-1] - times
    weights = 1.0 + _ENDS * (np.exp(-after / _ENDS_SECONDS) + np.exp(-left / _ENDS_SECONDS))
    pieces, rest, coefficients = spline_pieces(times[-1] - times[0], seconds), places, 0.0
    for _ in range(_PASSES):
        knots, more = smoothing_spline(rest, times, pieces, stiff=seconds, order=min(_ORDER, len(places)),
                                       weights=weights)
        coefficients = coefficients + more
        path = SplinePath(knots, coefficients)
        rest = places - path.at(times)
    return path


def places_on_ground(motion: Motion, standing: np.ndarray) -> np.ndarray:
    """Where the body is on the ground: (T, 3) metres, the pelvis's x and y and the height of the ground under it.

    standing: (T, 2, 2) bool, left and right, heel and toe. Level ground is as high as `contacts.recorded_floor`. Where
    the soles that stand lie within a hand's breadth of height, the ground is flat; else its height is that of the feet
    that stand, smoothed, and between stances a straight line over time."""
    body = identify(motion.skeleton)
    positions, _ = forward_kinematics(motion)
    places = positions[:, body.hips].copy()
    floor, sole = recorded_floor(motion)
    places[:, 2] = floor
    feet = [(body.left.foot, body.left.toe_or_foot), (body.right.foot, body.right.toe_or_foot)]
    heights = _soles(positions[..., 2][:, feet] - sole, standing, floor)
    known = np.flatnonzero(np.isfinite(heights))
    if len(known) < 2 or np.ptp(np.percentile(heights[known], [5, 95])) <= _FLAT:
        return places
    places[:, 2] = np.interp(np.arange(len(motion)), known, heights[known])
    return places


def _soles(heights: np.ndarray, standing: np.ndarray, floor: float) -> np.ndarray:
    """The ground's height (T,) under the feet that stand, NaN where none does, from joints' heights (T, 2, 2).

    An ankle is above the ground as much as it is usually above the toe where both stand; without toes, above the floor.
    """
    flat = standing.all(axis=2)
    above = np.median((heights[..., 0] - heights[..., 1])[flat]) if flat.any() else 0.0
    toes = np.where(standing[..., 1], heights[..., 1], np.nan)
    soles = np.where(standing[..., 1], toes, np.where(standing[..., 0], heights[..., 0] - above, np.nan))
    if flat.any() and above == 0.0:  # no toe joints
        soles = soles - (np.nanpercentile(soles, 2) - floor)
    count = np.isfinite(soles).sum(axis=1)
    return np.where(count > 0, np.nansum(soles, axis=1) / np.maximum(count, 1), np.nan)


def _checked(places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both as arrays of floats, or InputError."""
    places, times = np.asarray(places, dtype=float), np.asarray(times, dtype=float)
    if places.ndim != 2 or places.shape[1] != 3 or times.shape != (len(places),):
        raise InputError("path fit", f"places {places.shape}, times {times.shape}", "(T, 3) and (T,)")
    if len(times) < 2 or not np.all(np.diff(times) > 0.0):
        raise InputError("path fit", f"{len(times)} frames", "two or more, one after the other")
    if not np.isfinite(places).all():
        wrong = np.flatnonzero(~np.isfinite(places).all(axis=1))[0]
        raise InputError("path fit", f"frame {wrong} is not finite", "metres")
    return places, times
