"""When a rider is where on its new path, and which frame of its motion it shows there.

By arc length (Path editing §3.2) the new path is passed as fast as the motion passed its own; by time (figure 3.8) each
path is passed within the same time, however long it is. A speed factor plays the motion faster or slower; the frames
shown then lie between recorded ones.

By arc length the new path may also ask for other steps than its own did. Uphill and downhill steps are shorter and
quicker, the speed stays (runners at a given speed: Padulo et al. 2012, "Kinematics of running at different slopes and
speeds"; walkers downhill: Kawamura et al. 1991). Who wishes it goes slower there, by Tobler's hiking function (Tobler
1993), and slower in tight bends, by the two-thirds power law (Lacquaniti et al. 1983; of walkers: Vieilledent et al.
2001); half of that are shorter steps and half a slower tempo, as people keep the ratio of the two when they slow down
(Sekiya et al. 1996, the walk ratio).

Where a path ends before the motion does, the motion stops there or begins again with the path (§3.2.3); a closed path
has no end: the motion goes round and round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..base.errors import InputError, TimedLine
from ..base.vectors import cross_level
from ..motion import quaternion
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path
from ..motion.track import zero_phase_hann
from .path_frame import Residuals

SHORTER = 0.4
"""By how much steps are shorter on slopes: this times the slope, as a share."""
BEND = 2.0
"""Metres of radius below which bends slow."""
LEAST_STEP, LEAST_SPEED = 0.8, 0.35
"""Shares of a step's length on the level, and of the speed, that are kept at least."""
_GRID = 0.05  # metres
_SMOOTH = 0.7  # metres of path over which slopes and bends are felt
_STRIDE_SECONDS, _CREEPS = 0.5, 0.05  # s over which a stride is told, m/s that say nothing about it
_MOVES = 0.4  # m/s; whoever is slower tells nothing about bends

REACHED = 1e-3
"""Metres by which a motion may overshoot the path and still be of its length."""
SHORTEST = 1e-6
"""Metres that a path is long at least."""
_STEP = 0.5  # metres; a path or lap shorter than this is told
_SHORTEST_LAP, _UNSEEN = 0.5, 0.1  # seconds: of a lap that is begun anew, and of a motion's end that nobody misses


@dataclass(frozen=True)
class Wishes:
    """Whether steps are shorter on slopes, and whether slopes and bends slow."""

    slopes: bool = False
    climbs: bool = False
    bends: bool = False

    @property
    def none(self) -> bool:
        return not (self.slopes or self.climbs or self.bends)


@dataclass(frozen=True, eq=False)
class Way:
    """What a path is like, for steps: slope (N,), the tangent's rise over the ground, and bend (N,), 1 / m over the
    ground, at arc (N,) m."""

    arc: np.ndarray
    slope: np.ndarray
    bend: np.ndarray

    def plain(self, wishes: Wishes) -> bool:
        """Whether wishes change nothing on it."""
        length, tempo = _steps(self, wishes)
        return bool(max(np.abs(length - 1.0).max(), np.abs(tempo - 1.0).max()) < 1e-4)


@dataclass(frozen=True, eq=False)
class Timing:
    """N output frames: at (N,) the row of the residuals that is shown, fractional; arc (N,) m of the new path."""

    at: np.ndarray
    arc: np.ndarray

    def first(self, count: int) -> Timing:
        """Its first `count` frames."""
        return Timing(self.at[:count], self.arc[:count])


def by_arc_length(residuals: Residuals, speed: float, delay: float) -> Timing:
    """The motion `speed` times as fast as it was recorded, `delay` seconds later; it waits in its first frame."""
    at = _played(len(residuals), speed, delay, residuals.fps)
    return Timing(at, np.interp(at, np.arange(len(residuals)), np.cumsum(residuals.step)))


def by_way(residuals: Residuals, own: Way, new: Way, wishes: Wishes, speed: float, delay: float,
           closed: bool) -> Timing:
    """As `by_arc_length`, with the steps that the new path asks for beyond what its own, `own` at every row, did.

    The length s run on the new path, the length S of the motion and its row p at time t follow ds / k(s) = dS /
    k_own(p), dt = dp r_own(p) / r(s), with the lengths k and the tempo r of steps: two sums and two inversions."""
    k_own, r_own = _steps(own, wishes)
    k, r = _steps(new, wishes)
    asked = np.cumsum(residuals.step / k_own)
    laps = int(np.ceil(asked[-1] / max((new.arc[-1] - new.arc[0]) * LEAST_SPEED, 1e-9))) + 1 if closed else 1
    arc = np.concatenate([new.arc + lap * new.arc[-1] for lap in range(laps)])
    k, r = np.tile(k, laps), np.tile(r, laps)
    run = np.concatenate([[0.0], np.cumsum(np.diff(arc) * 0.5 * (1.0 / k[1:] + 1.0 / k[:-1]))])
    beyond = np.maximum(asked - run[-1], 0.0) * k[-1]
    s = np.interp(asked, run, arc) + beyond
    pace = speed * np.interp(s, arc, r) / r_own
    clock = np.concatenate([[0.0], np.cumsum(2.0 / (pace[1:] + pace[:-1]))])
    waits = np.zeros(int(round(delay * residuals.fps)))
    at = np.interp(np.arange(int(np.floor(clock[-1] + 1e-6)) + 1), clock, np.arange(len(clock)))
    at = np.concatenate([waits, at])
    return Timing(at, np.interp(at, np.arange(len(s)), s))


def asked_length(residuals: Residuals, own: Way, new: Way, wishes: Wishes) -> float:
    """Metres that a motion goes in its own steps while it passes the whole of a new way; own: its own at every row."""
    k, _ = _steps(new, wishes)
    level = np.sum(residuals.step / _steps(own, wishes)[0])
    recorded = residuals.step.sum() / level if level > 0.0 else 1.0
    return float(recorded * np.sum(np.diff(new.arc) * 0.5 * (1.0 / k[1:] + 1.0 / k[:-1])))


def way_of(path: Path, arc: ArcLength) -> Way:
    """What a path is like, every few centimetres, smoothed over what a step feels."""
    count = int(np.clip(arc.length / _GRID, 8, 8000)) + 1
    s = np.linspace(0.0, arc.length, count)
    u = arc.parameter(s)
    first, second = path.at(u, 1), path.at(u, 2)
    level = np.linalg.norm(first[:, :2], axis=1)
    turn = np.abs(cross_level(first, second))
    slope = np.clip(first[:, 2] / np.maximum(level, 1e-9), -3.0, 3.0)
    bend = np.minimum(turn / np.maximum(level, 1e-9) ** 3, 20.0)
    width = int(np.clip(_SMOOTH / max(s[1], 1e-9), 1, count))
    mode = "wrap" if path.closed else "nearest"
    return Way(s, *(uniform_filter1d(uniform_filter1d(v, width, mode=mode), width, mode=mode) for v in (slope, bend)))


def way_at(way: Way, arc: np.ndarray, pace: np.ndarray) -> Way:
    """The same at arc (T,) m passed at `pace` (T,) m/s: whoever stands goes no bend."""
    bend = np.where(pace > _MOVES, np.interp(arc, way.arc, way.bend), 0.0)
    return Way(arc, np.interp(arc, way.arc, way.slope), bend)


def _steps(way: Way, wishes: Wishes) -> tuple[np.ndarray, np.ndarray]:
    """Length and tempo of steps (N,) as shares of those on a level straight path."""
    shorter = np.maximum(1.0 - SHORTER * np.abs(way.slope), LEAST_STEP) if wishes.slopes else np.ones(len(way.slope))
    slower = np.ones(len(way.slope))
    if wishes.climbs:  # 6 exp(-3.5 |m + 0.05|) km/h
        slower = slower * np.exp(-3.5 * (np.abs(way.slope + 0.05) - 0.05))
    if wishes.bends:
        slower = slower * np.maximum(way.bend * BEND, 1.0) ** (-1.0 / 3.0)
    half = np.sqrt(np.maximum(slower, LEAST_SPEED))
    return half * shorter, half / shorter


def by_time(residuals: Residuals, path: Path, arc: ArcLength, speed: float, delay: float) -> Timing:
    """The same on a path whose parameter runs with time, from end to end within the motion."""
    at = _played(len(residuals), speed, delay, residuals.fps)
    return Timing(at, arc.at(parameter_at(path, at / max(len(residuals) - 1, 1))))


def parameter_at(path: Path, share: np.ndarray) -> np.ndarray:
    """The path's parameters (N,) when a share (N,) of the time is over."""
    low, high = path.domain
    return low + (high - low) * share


def stretched(new: np.ndarray, own: np.ndarray, fps: float) -> np.ndarray | None:
    """(T,) how many times as long as recorded the steps of a motion are that goes new (T,) m over the ground from frame
    to frame, where it went own (T,) m; None where they are as they were."""
    if np.abs(new - own).max(initial=0.0) < 1e-4 / fps:
        return None
    both = zero_phase_hann(np.stack([new, own], axis=1), fps, _STRIDE_SECONDS) + _CREEPS / fps
    return both[:, 0] / both[:, 1]


def take_rows(residuals: Residuals, at: np.ndarray) -> Residuals:
    """The residuals at rows `at` (N,), fractional: cubics through the four rows around (Catmull and Rom 1974), since
    straight lines between rows shake what moves quickly; feet that stand are those of the nearest row. Steps and turns
    are those from one output frame to the next."""
    count = len(residuals)
    low = np.clip(np.floor(at + 1e-9).astype(int), 0, count - 1)
    share = np.clip(at - low, 0.0, 1.0)
    share[share < 1e-9] = 0.0
    if not share.any():
        whole = residuals.rows(low)
        return whole if np.all(np.diff(low) == 1) else _stepped(residuals, whole, at)
    around = np.clip(low + np.arange(-1, 3)[:, None], 0, count - 1)
    x = share
    weights = 0.5 * np.stack(
        [x * (-1.0 + x * (2.0 - x)), 2.0 + x * x * (3.0 * x - 5.0), x * (1.0 + x * (4.0 - 3.0 * x)), x * x * (x - 1.0)]
    )

    def mixed(values: np.ndarray) -> np.ndarray:
        return sum(w.reshape(-1, *[1] * (values.ndim - 1)) * values[row] for w, row in zip(weights, around))

    near = residuals.rows(np.where(share < 0.5, low, np.minimum(low + 1, count - 1)))
    out = {name: mixed(getattr(residuals, name)) for name in ("place", "under", "up")}
    rotations = quaternion.normalized(mixed(residuals.rotations))
    frames = residuals.frames[low] + share * (residuals.frames[np.minimum(low + 1, count - 1)] - residuals.frames[low])
    return _stepped(residuals, near.changed(rotations=rotations, frames=frames, **out), at)


def _stepped(residuals: Residuals, rows: Residuals, at: np.ndarray) -> Residuals:
    index = np.arange(len(residuals))

    def since(values: np.ndarray) -> np.ndarray:
        return np.diff(np.interp(at, index, np.cumsum(values)), prepend=0.0)

    return rows.changed(step=since(residuals.step), turn=since(residuals.turn))


def _played(count: int, speed: float, delay: float, fps: float) -> np.ndarray:
    last = int(np.floor((count - 1) / speed + 1e-6))
    waits = int(round(delay * fps))
    return np.concatenate([np.zeros(waits), np.arange(last + 1) * speed])


@dataclass(frozen=True, eq=False)
class Ending:
    """count: frames from the beginning to the end of the path; shown (N,): which of these every output frame is; again
    (S,): output frames at which the motion begins anew; told: lines for the user."""

    count: int
    shown: np.ndarray
    again: np.ndarray
    told: tuple[str, ...] = ()


def find_ending(arc: np.ndarray, length: float, fps: float, end: str = "stop", closed: bool = False) -> Ending:
    """How a motion ends on a path `length` metres long, when it is at arc (T,) m, never falling, in its frames.

    end: "stop", or "repeat": motion and path begin again, as often as there are frames, without the wait that a rider
    begins with. InputError for a path that has no length."""
    if not np.isfinite(length) or length <= SHORTEST:
        raise InputError("path", "it has no length", "two different points", "draw a longer path")
    total = len(arc)
    whole = np.arange(total)
    none = np.zeros(0, dtype=int)
    short = (f"the path is only {length:.2f} m long, less than a step",) if length < _STEP else ()
    if closed:
        return Ending(total, whole, none, short)
    count = max(int(np.searchsorted(arc, length + REACHED, side="right")), 1)
    if count == total:
        return Ending(total, whole, none, short)
    first = _begins(arc[:count])
    if end == "repeat" and count - first >= _SHORTEST_LAP * fps:
        return _again(first, count, total, fps, short)
    when, left = count / fps, (total - count) / fps
    line = TimedLine(f"the path ends after {when:.1f} s, {left:.1f} s before the motion", (when, when))
    stops = (line,) if left > _UNSEEN else ()
    brief = ("the path is passed too quickly to begin again",) if end == "repeat" else ()
    return Ending(count, whole[:count], none, (*stops, *brief, *short))


def _begins(arc: np.ndarray) -> int:
    """The last of the frames that wait at the path's beginning."""
    return max(int(np.searchsorted(arc, arc[0] + 1e-12, side="right")) - 1, 0)


def _again(first: int, count: int, total: int, fps: float, told: tuple[str, ...]) -> Ending:
    later = np.arange(total - count)
    shown = np.concatenate([np.arange(count), first + later % (count - first)])
    again = np.arange(count, total, count - first)
    times = "once" if len(again) == 1 else f"{len(again)} times"
    line = TimedLine(f"the path ends after {count / fps:.1f} s; the motion begins again {times}", (count / fps,) * 2)
    return Ending(count, shown, again, (line, *told))
