"""The timing of a path edit: where on its new path the body is in each frame, and which source frame it displays.

By arc length (Path editing §3.2) the body passes the new path as fast as the motion passed its own path; by time
(figure 3.8) each path takes the same time, whatever its length. A speed factor plays the motion faster or slower; the
displayed frames are then between recorded ones.

By arc length the new path may also change the steps. Uphill and downhill steps are shorter and quicker at the same
speed (runners at a given speed: Padulo et al. 2012, "Kinematics of running at different slopes and speeds"; walkers
downhill: Kawamura et al. 1991). Two options slow the body down: on slopes by Tobler's hiking function (Tobler 1993),
and in tight bends by the two-thirds power law (Lacquaniti et al. 1983; of walkers: Vieilledent et al. 2001). Half of
that are shorter steps and half a slower tempo, since people keep the ratio of the two when they slow down (Sekiya et
al. 1996, the walk ratio).

Where a path ends before the motion does, the motion stops there or restarts with the path (§3.2.3). A closed path has
no end: the motion goes round and round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..base.errors import InputError, TimedMessage
from ..base.vectors import cross_on_ground
from ..motion import quaternion
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path
from ..motion.track import smooth_zero_phase_hann
from .path_frame import Residuals

SLOPE_SHORTENING = 0.4
"""Share by which steps are shorter on slopes: this times the slope."""
SLOW_RADIUS = 2.0
"""Metres of radius below which bends slow the body down."""
LEAST_STEP, LEAST_SPEED = 0.8, 0.35
"""Lower limits: of a step's length, as a share of that on level ground, and of the speed."""
_GRID = 0.05  # metres
_SMOOTH = 0.7  # metres of path over which slopes and bends are averaged
_STRIDE_SECONDS, _SPEED_OFFSET = 0.5, 0.05  # s over which strides are averaged; m/s added so that creeping has no ratio
_BEND_SPEED = 0.4  # m/s; below it a motion's own bends are ignored

LENGTH_TOLERANCE = 1e-3
"""Metres by which a motion may overshoot the path and still count as of its length."""
SHORTEST = 1e-6
"""Metres below which a path has no length."""
_STEP = 0.5  # metres; a shorter path gets a warning, and so does a longer rest of a path
# seconds: shortest lap that is repeated; longest cut end without a warning
_SHORTEST_LAP, _UNNOTICED_SECONDS = 0.5, 0.1


@dataclass(frozen=True)
class StepOptions:
    """Options of how the new path changes the steps.

    Attributes:
        slopes: steps are shorter on slopes.
        climbs: slopes slow the body down.
        bends: tight bends slow the body down.
    """

    slopes: bool = False
    climbs: bool = False
    bends: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether no option is on."""
        return not (self.slopes or self.climbs or self.bends)


@dataclass(frozen=True, eq=False)
class PathProfile:
    """Slope and curvature along a path.

    Attributes:
        arc: (N,) metres along the path.
        slope: (N,) rise of the tangent over its horizontal length.
        bend: (N,) 1 / m, curvature over the ground, never negative.
    """

    arc: np.ndarray
    slope: np.ndarray
    bend: np.ndarray

    def leaves_steps_unchanged(self, options: StepOptions) -> bool:
        """Return whether these options leave all steps on the path unchanged."""
        length, tempo = _compute_step_shares(self, options)
        return bool(max(np.abs(length - 1.0).max(), np.abs(tempo - 1.0).max()) < 1e-4)


@dataclass(frozen=True, eq=False)
class Timing:
    """The timing of N output frames.

    Attributes:
        at: (N,) row of the residuals that is displayed, fractional.
        arc: (N,) metres along the new path.
    """

    at: np.ndarray
    arc: np.ndarray

    def first(self, count: int) -> Timing:
        """Select the first `count` frames."""
        return Timing(self.at[:count], self.arc[:count])


def build_timing_by_arc_length(residuals: Residuals, speed: float, delay: float) -> Timing:
    """Build the timing of a motion that keeps its speed on the new path.

    Args:
        residuals: the motion relative to its own path.
        speed: playback rate, 1 as recorded.
        delay: seconds for which the body waits in its first frame.
    Returns:
        Row and arc length of each output frame.
    """
    at = _build_rows(len(residuals), speed, delay, residuals.fps)
    return Timing(at, np.interp(at, np.arange(len(residuals)), np.cumsum(residuals.step)))


def build_timing_by_profile(residuals: Residuals, own: PathProfile, new: PathProfile, options: StepOptions,
                            speed: float, delay: float, closed: bool) -> Timing:
    """Build the timing by arc length with the steps that the slopes and bends of the new path require.

    The length s on the new path, the length S of the motion and its row p at time t follow ds / k(s) = dS / k_own(p),
    dt = dp r_own(p) / r(s), with the lengths k and the tempo r of steps: two cumulative sums and two inversions.

    Args:
        residuals: the motion relative to its own path.
        own: profile of the motion's own path, at each row.
        new: profile of the new path.
        options: what changes the steps.
        speed: playback rate, 1 as recorded.
        delay: seconds for which the body waits in its first frame.
        closed: whether the new path is closed.
    Returns:
        Row and arc length of each output frame.
    """
    k_own, r_own = _compute_step_shares(own, options)
    k, r = _compute_step_shares(new, options)
    # Metres in steps of unit length, on the motion's side; the path's side is `run`, over as many laps as can be
    # needed.
    unit_steps = np.cumsum(residuals.step / k_own)
    laps = int(np.ceil(unit_steps[-1] / max((new.arc[-1] - new.arc[0]) * LEAST_SPEED, 1e-9))) + 1 if closed else 1
    arc = np.concatenate([new.arc + lap * new.arc[-1] for lap in range(laps)])
    k, r = np.tile(k, laps), np.tile(r, laps)
    run = np.concatenate([[0.0], np.cumsum(np.diff(arc) * 0.5 * (1.0 / k[1:] + 1.0 / k[:-1]))])
    # Beyond the end of an open path the last step length holds.
    beyond = np.maximum(unit_steps - run[-1], 0.0) * k[-1]
    s = np.interp(unit_steps, run, arc) + beyond
    # `clock` is the output frame at which each row is reached; inverted it gives the row of each output frame.
    pace = speed * np.interp(s, arc, r) / r_own
    clock = np.concatenate([[0.0], np.cumsum(2.0 / (pace[1:] + pace[:-1]))])
    waits = np.zeros(int(round(delay * residuals.fps)))
    at = np.interp(np.arange(int(np.floor(clock[-1] + 1e-6)) + 1), clock, np.arange(len(clock)))
    at = np.concatenate([waits, at])
    return Timing(at, np.interp(at, np.arange(len(s)), s))


def compute_required_length(residuals: Residuals, own: PathProfile, new: PathProfile, options: StepOptions) -> float:
    """Compute how far a motion moves, in its own steps, while it passes the whole new path.

    Args:
        residuals: the motion relative to its own path.
        own: profile of the motion's own path, at each row.
        new: profile of the new path.
        options: what changes the steps.
    Returns:
        Metres.
    """
    k, _ = _compute_step_shares(new, options)
    level = np.sum(residuals.step / _compute_step_shares(own, options)[0])
    recorded = residuals.step.sum() / level if level > 0.0 else 1.0
    return float(recorded * np.sum(np.diff(new.arc) * 0.5 * (1.0 / k[1:] + 1.0 / k[:-1])))


def build_profile(path: Path, arc: ArcLength) -> PathProfile:
    """Build the profile of a path every few centimetres, smoothed over the length of a step.

    Args:
        path: the path.
        arc: its arc length.
    Returns:
        Slope and curvature at even arc lengths.
    """
    count = int(np.clip(arc.length / _GRID, 8, 8000)) + 1
    s = np.linspace(0.0, arc.length, count)
    u = arc.parameter_at(s)
    first, second = path.at(u, 1), path.at(u, 2)
    level = np.linalg.norm(first[:, :2], axis=1)
    turn = np.abs(cross_on_ground(first, second))
    slope = np.clip(first[:, 2] / np.maximum(level, 1e-9), -3.0, 3.0)
    bend = np.minimum(turn / np.maximum(level, 1e-9) ** 3, 20.0)
    width = int(np.clip(_SMOOTH / max(s[1], 1e-9), 1, count))
    mode = "wrap" if path.closed else "nearest"
    return PathProfile(s, *(uniform_filter1d(uniform_filter1d(v, width, mode=mode), width, mode=mode)
                            for v in (slope, bend)))


def sample_profile(profile: PathProfile, arc: np.ndarray, pace: np.ndarray) -> PathProfile:
    """Sample a profile where a motion is; a body slower than _BEND_SPEED has no curvature.

    Args:
        profile: of the path.
        arc: (T,) metres along it.
        pace: (T,) m/s.
    Returns:
        The profile at each of the T frames.
    """
    bend = np.where(pace > _BEND_SPEED, np.interp(arc, profile.arc, profile.bend), 0.0)
    return PathProfile(arc, np.interp(arc, profile.arc, profile.slope), bend)


def _compute_step_shares(profile: PathProfile, options: StepOptions) -> tuple[np.ndarray, np.ndarray]:
    """Compute length and tempo of steps (N,) as shares of those on a level straight path."""
    shorter = np.maximum(1.0 - SLOPE_SHORTENING * np.abs(profile.slope),
                         LEAST_STEP) if options.slopes else np.ones(len(profile.slope))
    slower = np.ones(len(profile.slope))
    if options.climbs:  # Tobler: 6 exp(-3.5 |m + 0.05|) km/h, over its value on level ground
        slower = slower * np.exp(-3.5 * (np.abs(profile.slope + 0.05) - 0.05))
    if options.bends:
        slower = slower * np.maximum(profile.bend * SLOW_RADIUS, 1.0) ** (-1.0 / 3.0)
    half = np.sqrt(np.maximum(slower, LEAST_SPEED))
    return half * shorter, half / shorter


def build_timing_by_time(residuals: Residuals, path: Path, arc: ArcLength, speed: float, delay: float) -> Timing:
    """Build the timing of a motion that passes the whole path within its own duration.

    Args:
        residuals: the motion relative to its own path.
        path: the new path, whose parameter runs with time.
        arc: its arc length.
        speed: playback rate, 1 as recorded.
        delay: seconds for which the body waits in its first frame.
    Returns:
        Row and arc length of each output frame.
    """
    at = _build_rows(len(residuals), speed, delay, residuals.fps)
    return Timing(at, arc.distance_at(parameter_at(path, at / max(len(residuals) - 1, 1))))


def parameter_at(path: Path, share: np.ndarray) -> np.ndarray:
    """Compute the path's parameters (N,) at shares (N,) of the time, from 0 to 1."""
    low, high = path.domain
    return low + (high - low) * share


def compute_step_scale(new: np.ndarray, own: np.ndarray, fps: float) -> np.ndarray | None:
    """Compute how many times as long as recorded the steps of a motion are.

    Args:
        new: (T,) metres over the ground since the frame before, on the new path.
        own: (T,) metres over the ground since the frame before, as recorded.
        fps: frames per second.
    Returns:
        (T,) ratios; None if steps are as recorded.
    """
    if np.abs(new - own).max(initial=0.0) < 1e-4 / fps:
        return None
    both = smooth_zero_phase_hann(np.stack([new, own], axis=1), fps, _STRIDE_SECONDS) + _SPEED_OFFSET / fps
    return both[:, 0] / both[:, 1]


def resample_residuals(residuals: Residuals, at: np.ndarray) -> Residuals:
    """Resample the residuals at fractional rows.

    Values are cubics through the four rows around (Catmull and Rom 1974), since linear interpolation shakes what moves
    quickly. Foot contacts are those of the nearest row. Steps and turns are those from one output frame to the next.

    Args:
        residuals: the motion relative to its own path, T rows.
        at: (N,) rows, fractional.
    Returns:
        The residuals, N rows.
    """
    count = len(residuals)
    low = np.clip(np.floor(at + 1e-9).astype(int), 0, count - 1)
    share = np.clip(at - low, 0.0, 1.0)
    share[share < 1e-9] = 0.0
    if not share.any():
        whole = residuals.select_rows(low)
        return whole if np.all(np.diff(low) == 1) else _update_steps(residuals, whole, at)
    # Rows low - 1 to low + 2, and their Catmull-Rom weights at x between low and low + 1.
    around = np.clip(low + np.arange(-1, 3)[:, None], 0, count - 1)
    x = share
    weights = 0.5 * np.stack(
        [x * (-1.0 + x * (2.0 - x)), 2.0 + x * x * (3.0 * x - 5.0), x * (1.0 + x * (4.0 - 3.0 * x)), x * x * (x - 1.0)]
    )

    def blend_rows(values: np.ndarray) -> np.ndarray:
        return sum(w.reshape(-1, *[1] * (values.ndim - 1)) * values[row] for w, row in zip(weights, around))

    near = residuals.select_rows(np.where(share < 0.5, low, np.minimum(low + 1, count - 1)))
    out = {name: blend_rows(getattr(residuals, name)) for name in ("place", "under", "up")}
    rotations = quaternion.normalize(blend_rows(residuals.rotations))
    frames = residuals.frames[low] + share * (residuals.frames[np.minimum(low + 1, count - 1)] - residuals.frames[low])
    return _update_steps(residuals, near.replace_fields(rotations=rotations, frames=frames, **out), at)


def _update_steps(residuals: Residuals, rows: Residuals, at: np.ndarray) -> Residuals:
    """Compute steps and turns of rows `at` as differences of the accumulated ones."""
    index = np.arange(len(residuals))

    def difference_rows(values: np.ndarray) -> np.ndarray:
        return np.diff(np.interp(at, index, np.cumsum(values)), prepend=0.0)

    return rows.replace_fields(step=difference_rows(residuals.step), turn=difference_rows(residuals.turn))


def _build_rows(count: int, speed: float, delay: float, fps: float) -> np.ndarray:
    """Build the fractional row of each output frame, with the wait at the start."""
    last = int(np.floor((count - 1) / speed + 1e-6))
    waits = int(round(delay * fps))
    return np.concatenate([np.zeros(waits), np.arange(last + 1) * speed])


@dataclass(frozen=True, eq=False)
class Ending:
    """What happens at the end of the path.

    Attributes:
        count: frames from the start to the end of the path.
        displayed: (N,) which of these frames each output frame displays.
        restarts: (S,) output frames at which the motion restarts.
        messages: for the user.
    """

    count: int
    displayed: np.ndarray
    restarts: np.ndarray
    messages: tuple[str, ...] = ()


def find_ending(arc: np.ndarray, length: float, fps: float, end: str = "stop", closed: bool = False) -> Ending:
    """Find how a motion ends on a path.

    Args:
        arc: (T,) metres along the path in each frame, never falling.
        length: metres of the path.
        fps: frames per second.
        end: "stop", or "repeat": motion and path restart as often as there are frames, without the initial wait.
        closed: whether the path has no end.
    Returns:
        The frames to display and the messages.
    Raises:
        InputError: if the path has no length.
    """
    if not np.isfinite(length) or length <= SHORTEST:
        raise InputError("path", "has no length", "at least two different points", "draw a longer path")
    total = len(arc)
    whole = np.arange(total)
    none = np.zeros(0, dtype=int)
    short = (f"the path is only {length:.2f} m long, less than a step",) if length < _STEP else ()
    if closed:
        return Ending(total, whole, none, short)
    count = max(int(np.searchsorted(arc, length + LENGTH_TOLERANCE, side="right")), 1)
    if count == total:
        return Ending(total, whole, none, short)
    first = _find_start(arc[:count])
    if end == "repeat" and count - first >= _SHORTEST_LAP * fps:
        return _repeat_laps(first, count, total, fps, short)
    when, left = count / fps, (total - count) / fps
    line = TimedMessage(f"the path ends after {when:.1f} s, {left:.1f} s before the motion", (when, when))
    stops = (line,) if left > _UNNOTICED_SECONDS else ()
    brief = ("the path is too short to restart: a lap takes less than half a second",) if end == "repeat" else ()
    return Ending(count, whole[:count], none, (*stops, *brief, *short))


def report_rest(timing: Timing, length: float, fps: float) -> tuple[str, ...]:
    """Report the rest of a path of `length` metres on which there is no motion any more."""
    left, end = length - float(timing.arc[-1]), (len(timing.arc) - 1) / fps
    if left <= _STEP:
        return ()
    line = f"the motion ends {left:.1f} m before the end of the path: shorten the path, or switch Cycle on"
    return (TimedMessage(line, (end, end)),)


def _find_start(arc: np.ndarray) -> int:
    """Find the last of the frames that wait at the start of the path."""
    return max(int(np.searchsorted(arc, arc[0] + 1e-12, side="right")) - 1, 0)


def _repeat_laps(first: int, count: int, total: int, fps: float, messages: tuple[str, ...]) -> Ending:
    later = np.arange(total - count)
    displayed = np.concatenate([np.arange(count), first + later % (count - first)])
    restarts = np.arange(count, total, count - first)
    times = "once" if len(restarts) == 1 else f"{len(restarts)} times"
    line = TimedMessage(f"the path ends after {count / fps:.1f} s; the motion restarts {times}", (count / fps,) * 2)
    return Ending(count, displayed, restarts, (line, *messages))
