"""A motion's own path, and the motion relative to a path: its place and rotation in a moving frame.

Paths are smooth curves through the motion's places on the ground (Path editing §3.1.1): a polynomial, as in the paper,
and a smoothing spline, which works for any duration.

The frame "path" is the one of §3.1.2.2 and §3.1.3: its Z stays up, its X is the path's tangent projected on the ground.
The other two serve for comparison: "tangent" follows the whole tangent, so that a hill tips the body over; "absolute"
(§3.1.2.1) turns the body with the path, but not its offset from the path.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ..base.banded_least_squares import BandedLeastSquares
from ..base.errors import InputError
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.contacts import estimate_recorded_floor
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion, forward_kinematics
from ..motion.path.path import Path, PolynomialPath, SplinePath
from ..motion.path.smooth_spline import count_spline_pieces, fit_smoothing_spline
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann

FRAMES = ("path", "tangent", "absolute")

CLEAR_SPEED = 0.25
"""Metres per second over the ground from which on a direction of travel is used; below, the heading is interpolated."""
_FULL, _POWER, _MOST = 0.5, 8, 1e6  # weight of a direction: (speed / _FULL) ** _POWER, at most _MOST
_STIFF, _TIGHT = 0.1, 0.03  # seconds: smoothness of the heading; longest gap that is not interpolated linearly
_STILL_SPEED = 0.01  # m/s: a path passed more slowly has no heading
_PROGRESS_SECONDS, _SURE_SPEED = 1.0, 0.6  # seconds over which progress is averaged; m/s above which speed alone counts

KINDS = ("spline", "polynomial")
SWAY_SECONDS = 0.3
"""Sway faster than a period of about 0.7 s is left out of the path; slower movement belongs to it."""
_ORDER, _PASSES = 3, 4
_ENDS, _ENDS_SECONDS = 5.0, 0.15  # additional weight of the first and last frame, and how soon it decays
_FLAT = 0.10  # metres between the lowest and highest measured ground of a flat recording


@dataclass(frozen=True, eq=False, kw_only=True)
class Residuals:
    """T frames of a motion in the moving frame of its own path; every array has one row a frame.

    Attributes:
        place: (T, 3) metres, the root in the moving frame.
        rotations: (T, J, 4) local rotations, the root's relative to the moving frame.
        step: (T,) metres of path since the frame before, 0 in the first.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe.
        frames: (T,) source frames, fractional in general.
        turn: (T,) radians that the path turns since the frame before.
        under: (T, 2) metres from the path up to the ground under each foot.
        up: (T, 2, 3) normal of that ground, in the moving frame.
        fps: frames per second.
        skeleton: of the motion.
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
        """Every array by the name of its field."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def replace_fields(self, **changes) -> Residuals:
        """Return a copy with some fields replaced."""
        return replace(self, **changes)

    def select_rows(self, which) -> Residuals:
        """Select frames.

        Args:
            which: a slice or indices; steps and turns stay as they are.
        Returns:
            The residuals of these frames.
        """
        return replace(self, **{name: values[which] for name, values in self.arrays.items()})


@dataclass(frozen=True, eq=False)
class MovingFrame:
    """The moving frame in each of T frames.

    Attributes:
        origin: (T, 3) metres, world frame.
        heading: (T,) radians, unwrapped.
        slope: (T,) radians by which the tangent rises.
    """

    origin: np.ndarray
    heading: np.ndarray
    slope: np.ndarray

    def compute_rotations(self, frame: str) -> tuple[np.ndarray, np.ndarray]:
        """Compute the rotations from the moving frame into the world.

        Args:
            frame: one of FRAMES.
        Returns:
            (T, 4) rotations of offsets from the path, and (T, 4) of the body.
        """
        level = quaternion.from_up_angle(self.heading)
        if frame == "absolute":
            return quaternion.identity(len(level)), level
        if frame == "tangent":
            tipped = quaternion.multiply(level, quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), -self.slope))
            return tipped, tipped
        return level, level


def check_frame(frame: str) -> None:
    """Raise InputError if `frame` is none of FRAMES."""
    if frame not in FRAMES:
        raise InputError("frame", str(frame), f"one of {', '.join(FRAMES)}")


def to_moving_frame(frame: str, moving: MovingFrame, root: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray,
        np.ndarray]:
    """Convert the root from the world to the moving frame.

    Args:
        frame: one of FRAMES.
        moving: the moving frame.
        root: (T, 3) metres, world frame.
        rotations: (T, 4) of the root, world frame.
    Returns:
        (T, 3) metres and (T, 4) rotations in the moving frame.
    """
    off, body = moving.compute_rotations(frame)
    place = quaternion.rotate(quaternion.inverse(off), root - moving.origin)
    return place, quaternion.multiply(quaternion.inverse(body), rotations)


def from_moving_frame(frame: str, moving: MovingFrame, place: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray,
        np.ndarray]:
    """Convert a motion from the moving frame to the world, the inverse of `to_moving_frame`.

    Args:
        frame: one of FRAMES.
        moving: the moving frame.
        place: (T, 3) metres of the root, in the moving frame.
        rotations: (T, J, 4) local, the root's in the moving frame.
    Returns:
        (T, 3) metres of the root and (T, J, 4) local rotations, world frame.
    Source: Path editing §4.2.2, §4.2.3.
    """
    off, body = moving.compute_rotations(frame)
    out = np.array(rotations, dtype=float)
    out[:, 0] = quaternion.multiply(body, out[:, 0])
    return moving.origin + quaternion.rotate(off, place), out


def build_moving_frame(origin: np.ndarray, tangent: np.ndarray, arc: np.ndarray, fps: float,
                       default_heading: float | None = None) -> MovingFrame:
    """Build the moving frame along a path.

    Args:
        origin: (T, 3) metres, places on the path.
        tangent: (T, 3) tangents of any length.
        arc: (T,) metres along the path.
        fps: frames per second.
        default_heading: radians, heading of a path that does not move over the ground; None: that of its first tangent.
    Returns:
        Origin, heading and slope in each frame.
    """
    length = np.linalg.norm(tangent, axis=1)
    along = tangent / np.maximum(length, 1e-12)[:, None]
    pace = np.abs(np.gradient(arc)) * fps if len(arc) > 1 else np.zeros(1)
    level = np.linalg.norm(along[:, :2], axis=1)
    return MovingFrame(origin, compute_heading(along, pace * level, fps, default_heading),
                       arctan2(along[:, 2], np.maximum(level, 1e-12)))


def compute_heading(along: np.ndarray, speed: np.ndarray, fps: float, default_heading: float
                    | None = None) -> np.ndarray:
    """Compute the heading of travel along a path.

    Where the horizontal tangent vanishes (standing still, vertical stretches, cusps) it has no meaning, and a body in
    place must not spin with it. So the heading is the solution of least squares over frames, sum w |h - a|^2 + s^4
    |h''|^2 + (s^2 / t)^2 |h'|^2, with a the tangent's direction, s = _STIFF, t = _TIGHT, and a weight w that falls
    steeply below a slow walk, _FULL. At a walk and above, the result is the tangent's own direction. A body that sways
    or shifts its feet counts as slow, however fast that is: the weight follows the progress within a second.

    Args:
        along: (T, 3) unit tangents.
        speed: (T,) metres per second over the ground.
        fps: frames per second.
        default_heading: radians, for a path without any movement.
    Returns:
        (T,) radians, unwrapped.
    """
    mean = smooth_zero_phase_hann(along[:, :2] * speed[:, None], fps, _PROGRESS_SECONDS) if len(along) > 2 else along[:,
            :2]
    speed = np.maximum(np.minimum(np.linalg.norm(mean, axis=1), speed), speed - _SURE_SPEED)
    raw = arctan2(along[:, 1], along[:, 0])
    clear = speed >= min(CLEAR_SPEED, 0.5 * speed.max(initial=0.0))
    if len(raw) < 3 or speed.max(initial=0.0) < _STILL_SPEED:
        return np.full(len(raw), raw[0] if default_heading is None else default_heading)
    at = np.arange(len(raw))
    near = np.interp(at, at[clear], np.unwrap(raw[clear]))
    # Unwrap all directions about those of the clear frames, so that noise at low speed adds no full turns.
    goal = near + quaternion.wrap_angle(raw - near)
    weight = np.minimum((speed / _FULL) ** _POWER, _MOST) + 1e-9
    stiff = (_STIFF * fps) ** 4
    squares = BandedLeastSquares(len(raw), reach=2)
    squares.add_difference(2, stiff)
    squares.add_difference(1, stiff / (_TIGHT * fps) ** 2)
    # relative to the first direction: the unknowns stay small, and so does their rounding
    squares.add_value(weight, goal=goal - goal[0])
    return goal[0] + squares.solve()[:, 0]


def fit_path(motion: Motion, standing: np.ndarray, kind: str = "spline", degree: int = 13) -> Path:
    """Fit the path of a motion on the ground; its parameter is seconds from the first frame.

    Args:
        motion: of a skeleton with legs.
        standing: (T, 2, 2) bool, as `contacts.detect_heel_toe_contacts` of the motion.
        kind: one of KINDS.
        degree: of the polynomial.
    Returns:
        The path, world frame.
    Raises:
        InputError: for another kind, too high a degree, or fewer than two frames.
    """
    if kind not in KINDS:
        raise InputError("path fit", kind, " or ".join(KINDS))
    places, times = project_to_ground(motion, standing), np.arange(len(motion)) / motion.fps
    return fit_spline(places, times) if kind == "spline" else fit_polynomial(places, times, degree)


def fit_polynomial(places: np.ndarray, times: np.ndarray, degree: int) -> PolynomialPath:
    """Fit the polynomial of a given degree by least squares.

    Legendre polynomials of time scaled to -1 .. 1 are nearly orthogonal over even frames, so that degree 45 is as exact
    as degree 2. Where frames are so few for the degree that the polynomial would oscillate between them, a cubic spline
    adds samples.

    Args:
        places: (T, 3) metres.
        times: (T,) seconds, rising.
        degree: 1 or more.
    Returns:
        The polynomial path.
    Raises:
        InputError: if the degree is below 1, or too high for the number of frames.
    """
    places, times = _check_samples(places, times)
    if not 1 <= degree <= len(times) - 1:
        raise InputError("path fit", f"degree {degree}", f"1 to {len(times) - 1}, fewer than the frames")
    places, times = _densify_samples(places, times, degree)
    scaled = (2.0 * times - times[0] - times[-1]) / (times[-1] - times[0])
    basis = np.polynomial.legendre.legvander(scaled, degree)
    orthogonal, triangle = np.linalg.qr(basis)
    origin = places.mean(axis=0)
    coefficients = np.linalg.solve(triangle, orthogonal.T @ (places - origin))
    coefficients[0] += origin
    return PolynomialPath(coefficients, (float(times[0]), float(times[-1])))


def _densify_samples(places: np.ndarray, times: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Resample places (M, 3) and times (M,) so densely that the polynomial does not oscillate between them.

    Least squares at even times do not while twice the root of their number is at least the degree (Dahlquist and Björck
    1974).
    """
    if degree <= 2.0 * np.sqrt(len(times)):
        return places, times
    from scipy.interpolate import CubicSpline

    parts = int(np.ceil(0.35 * degree**2 / (len(times) - 1)))
    fine = np.interp(np.arange(parts * (len(times) - 1) + 1) / parts, np.arange(len(times)), times)
    return CubicSpline(times, places)(fine), fine


def fit_spline(places: np.ndarray, times: np.ndarray) -> SplinePath:
    """Fit a smoothing spline: least squares with a cost on the change of acceleration.

    The remainder is smoothed again and added, which makes the limit between path and sway sharper (Tukey's twicing).

    The distance of a body from its new path is that of the motion from its own path, in the mean over a stride, so this
    is the root error of the whole path edit. Measured on 14 recordings (CMU, LAFAN1, Bandai, runs, kicks), root error
    mean / 95 % in cm, and the loss of a sway of one stride a second: cost on acceleration, 0.4 s: 0.5 to 9 / 1 to 27, 2
    %; 0.2 s: 0.3 to 2 / 0.6 to 8, 29 %; this one: 0.2 to 1.2 / 0.3 to 2.5, 8 %. In walks its heading wobbles by a
    degree rms about its own mean over 1.5 s. Without the weight on the ends, where values exist on one side only, 0.2
    to 1.4 / 0.5 to 4.3.

    Args:
        places: (T, 3) metres.
        times: (T,) seconds, rising.
    Returns:
        The spline path.
    Raises:
        InputError: for fewer than two frames or places that are not finite.
    """
    places, times = _check_samples(places, times)
    after, left = times - times[0], times[-1] - times
    weights = 1.0 + _ENDS * (np.exp(-after / _ENDS_SECONDS) + np.exp(-left / _ENDS_SECONDS))
    pieces, rest, coefficients = count_spline_pieces(times[-1] - times[0], SWAY_SECONDS), places, 0.0
    for _ in range(_PASSES):
        knots, more = fit_smoothing_spline(rest, times, pieces, stiff=SWAY_SECONDS, order=min(_ORDER, len(places)),
                                           weights=weights)
        coefficients = coefficients + more
        path = SplinePath(knots, coefficients)
        rest = places - path.at(times)
    return path


def project_to_ground(motion: Motion, standing: np.ndarray) -> np.ndarray:
    """Project a motion on the ground: the pelvis's x and y, and the height of the ground under it.

    Level ground is as high as `contacts.estimate_recorded_floor`. If all soles in contact are within 10 cm of height,
    the ground is flat; else its height is that of the feet in contact, and linear over time between stances.

    Args:
        motion: of a skeleton with legs.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe.
    Returns:
        (T, 3) metres, world frame.
    """
    body = identify_joints(motion.skeleton)
    positions, _ = forward_kinematics(motion)
    places = positions[:, body.hips].copy()
    floor, sole = estimate_recorded_floor(motion)
    places[:, 2] = floor
    feet = [(body.left.foot, body.left.toe_or_foot), (body.right.foot, body.right.toe_or_foot)]
    heights = _measure_ground_height(positions[..., 2][:, feet] - sole, standing, floor)
    known = np.flatnonzero(np.isfinite(heights))
    if len(known) < 2 or np.ptp(np.percentile(heights[known], [5, 95])) <= _FLAT:
        return places
    places[:, 2] = np.interp(np.arange(len(motion)), known, heights[known])
    return places


def _measure_ground_height(heights: np.ndarray, standing: np.ndarray, floor: float) -> np.ndarray:
    """Measure the height (T,) of the ground under the feet in contact, NaN without any, from joints' heights (T, 2, 2).

    An ankle is above the ground by its usual height above the toe where both are in contact; without toes, above the
    floor.
    """
    flat = standing.all(axis=2)
    above = np.median((heights[..., 0] - heights[..., 1])[flat]) if flat.any() else 0.0
    toes = np.where(standing[..., 1], heights[..., 1], np.nan)
    soles = np.where(standing[..., 1], toes, np.where(standing[..., 0], heights[..., 0] - above, np.nan))
    if flat.any() and above == 0.0:  # no toe joints
        soles = soles - (np.nanpercentile(soles, 2) - floor)
    count = np.isfinite(soles).sum(axis=1)
    return np.where(count > 0, np.nansum(soles, axis=1) / np.maximum(count, 1), np.nan)


def _check_samples(places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Check places (T, 3) and times (T,); return them as float arrays, or raise InputError."""
    places, times = np.asarray(places, dtype=float), np.asarray(times, dtype=float)
    if places.ndim != 2 or places.shape[1] != 3 or times.shape != (len(places),):
        raise InputError("path fit", f"places {places.shape}, times {times.shape}", "(T, 3) and (T,)")
    if len(times) < 2 or not np.all(np.diff(times) > 0.0):
        raise InputError("path fit", f"{len(times)} frames", "two or more frames with rising times")
    if not np.isfinite(places).all():
        wrong = np.flatnonzero(~np.isfinite(places).all(axis=1))[0]
        raise InputError("path fit", f"frame {wrong} is not finite", "finite coordinates in metres")
    return places, times
