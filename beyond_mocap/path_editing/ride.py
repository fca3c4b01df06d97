"""Path editing: one good clip rides another path (Gleicher 2001, told by Path editing §3), and its feet stay planted.

`prepare` finds a motion's own path and what the motion is relative to it, once; `ride` lays that on a new path,
quickly, as often as the path is dragged.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..base.errors import InputError, TimedLine
from ..base.settings import defaults, setting
from ..base.time_series import runs
from ..motion import contacts, quaternion
from ..motion.foot_plant import Planted
from ..motion.humanoid import heading as facing
from ..motion.humanoid import identify
from ..motion.motion import Motion, forward_kinematics
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path
from ..motion.path.terrain import Terrain
from ..motion.track import zero_phase_hann
from ..synthesis.construct.on_track import bend_forward, lean_into_curves, missing_lean
from . import ground_contact, path_frame, path_time
from .cycle import cycled
from .detour import with_detours
from .foot_ride import LONGEST, Ground, Steps, follow
from .loops import Loop, find_loops
from .path_frame import MovingFrame, Residuals
from .path_time import Ending, Timing, Way

_DEFAULTS = defaults("path_editing")
ENDS = setting("path_editing", "end").choice_names
_SPEED = setting("path_editing", "speed")
LEANS_FROM = (0.7, 1.5)
"""m/s below which nobody leans into a bend, and from which on all of it counts: walkers lean too, on a path that is as
smooth as these."""
INTO_SLOPE, MOST_FORWARD, SLOPE_SECONDS = 0.45, 0.2, 0.6
"""Share of a slope by which the trunk leans into it, and radians of that at most (Leroux, Fung and Barbeau 2002: some
3 degrees forward at a rise of 10 %, backward going down); seconds over which a slope is felt."""
OUT_OF_REACH = 0.03
"""Metres that a foot may be short of its place without being told."""
STILL = 0.05
"""Metres of path below which a motion stands still."""


@dataclass(frozen=True, kw_only=True)
class RideSettings:
    """What a user chooses; the settings table says what each means.
    detours: (arc m, width m, offset m to the left) each."""

    fit: str = _DEFAULTS["fit"]
    degree: int = _DEFAULTS["degree"]
    by_arc_length: bool = _DEFAULTS["by_arc_length"]
    speed: float = _DEFAULTS["speed"]
    end: str = _DEFAULTS["end"]
    cycle: bool = _DEFAULTS["cycle"]
    frame: str = _DEFAULTS["frame"]
    plant: bool = _DEFAULTS["plant"]
    lean: bool = _DEFAULTS["lean"]
    bends: bool = _DEFAULTS["bends"]
    slopes: bool = _DEFAULTS["slopes"]
    climbs: bool = _DEFAULTS["climbs"]
    delay: float = _DEFAULTS["delay"]
    detours: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self):
        path_frame.check_frame(self.frame)
        if self.end not in ENDS:
            raise InputError("end of path", str(self.end), " or ".join(ENDS))
        if self.fit not in path_frame.KINDS:
            raise InputError("path fit", str(self.fit), " or ".join(path_frame.KINDS))
        if not _SPEED.least <= self.speed <= _SPEED.most:
            raise InputError("speed", f"{self.speed:g} times", f"{_SPEED.least:g} to {_SPEED.most:g}")
        if not 0.0 <= self.delay < 86400.0:
            raise InputError("delay", f"{self.delay:g} s", "0 or more seconds")


@dataclass(frozen=True, eq=False, kw_only=True)
class RideSource:
    """A motion relative to its own path: all that does not depend on the new one.

    motion; standing (T, 2, 2) bool, left and right, heel and toe; path with seconds as its parameter; arc: its length;
    moving: its frame at every frame; residuals; frame: the one of FRAMES they are relative to; humanoid: whether it has
    feet that can be planted; still: whether it goes nowhere; sole: metres that the
    foremost joint of a flat foot is over the ground; warnings."""

    motion: Motion
    standing: np.ndarray
    path: Path
    arc: ArcLength
    moving: MovingFrame
    residuals: Residuals
    frame: str
    humanoid: bool
    still: bool
    sole: float = 0.0
    warnings: tuple[str, ...] = ()

    @cached_property
    def loops(self) -> tuple[Loop, ...]:
        """Where the motion can be repeated, the best first; looked for when it is first asked."""
        return find_loops(self.residuals)

    @cached_property
    def way(self) -> Way:
        """The slopes and bends of its own path."""
        return path_time.way_of(self.path, self.arc)

    @cached_property
    def bends(self) -> np.ndarray:
        """(T,) 1/m: how much its own path bends over the ground."""
        return ground_contact.curvature(self.path, np.arange(len(self.motion)) / self.motion.fps)


@dataclass(frozen=True, eq=False, kw_only=True)
class Ridden:
    """A motion on its new path, N frames. frames (N,): of the source, in general fractional; standing (N, 2, 2) bool,
    carried from there; arc (N,) m, origin (N, 3) m and heading (N,) radians: where the moving frame is; seams (S,):
    first frames after a jump from a cycle's end to its start, faded over; again (R,): first frames where motion and
    path begin anew, a cut, at which nobody stands; correction (N, 2) m by which each foot was moved, miss (N, 2) m that
    it is short of where it should be; laid: root (N, 3) m and local rotations (N, J, 4) before leaning and planting."""

    motion: Motion
    frames: np.ndarray
    standing: np.ndarray
    arc: np.ndarray
    origin: np.ndarray
    heading: np.ndarray
    seams: np.ndarray
    correction: np.ndarray
    miss: np.ndarray
    laid: tuple[np.ndarray, np.ndarray]
    source: RideSource
    warnings: tuple[str, ...] = field(default=())
    again: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))

    @cached_property
    def rigid(self) -> Motion:
        """The motion before leaning and planting."""
        return Motion(self.motion.skeleton, *self.laid, self.motion.fps)

    @property
    def once(self) -> Ridden:
        """The ride until motion and path begin anew: each time they are laid out alike."""
        if not len(self.again):
            return self
        return replace(self.showing(np.arange(self.again[0])), again=np.zeros(0, dtype=int))

    def showing(self, which: np.ndarray) -> Ridden:
        """The frames `which` (N,)."""
        rows = ("frames", "standing", "arc", "origin", "heading", "correction", "miss")
        motion, laid = self.motion, tuple(values[which] for values in self.laid)
        motion = replace(motion, root_positions=motion.root_positions[which], rotations=motion.rotations[which])
        return replace(self, **{name: getattr(self, name)[which] for name in rows}, motion=motion, laid=laid)


def prepare(motion: Motion, settings: RideSettings, standing: np.ndarray | None = None,
            path: Path | None = None) -> RideSource:
    """The motion relative to its own path.

    standing: (T, 2, 2) bool, by default told from the motion (`contacts.points`). path: its own path, its parameter
    seconds from the first frame, by default fitted as `settings` say. InputError for less than two frames."""
    if len(motion) < 2:
        raise InputError("motion", f"{len(motion)} frame", "two or more frames")
    humanoid, told = _humanoid(motion)
    if standing is None:
        standing = contacts.points(motion) if humanoid else np.zeros((len(motion), 2, 2), dtype=bool)
    path = path or (_fitted if humanoid else _fitted_any)(motion, standing, settings)
    times = np.arange(len(motion)) / motion.fps
    arc = ArcLength(path)
    metres = arc.at(times)
    still = bool(metres[-1] - metres[0] < STILL)
    moving = path_frame.moving_frame(path.at(times), path.at(times, 1), metres, motion.fps, _faces(motion, humanoid))
    place, turned = path_frame.relative(settings.frame, moving, motion.root_positions, motion.rotations[:, 0])
    rotations = motion.rotations.copy()
    rotations[:, 0] = turned
    under, up = _own_ground(motion, standing, path, arc=arc, moving=moving,
                            metres=metres) if humanoid else _flat(len(motion))
    residuals = Residuals(place=place, rotations=rotations, step=np.diff(metres, prepend=metres[:1]),
                          standing=np.asarray(standing, bool), frames=np.arange(len(motion), dtype=float),
                          turn=np.diff(moving.heading, prepend=moving.heading[:1]), under=under, up=up, fps=motion.fps,
                          skeleton=motion.skeleton)
    sole = contacts.recorded_floor(motion)[1] if humanoid else 0.0
    return RideSource(motion=motion, standing=residuals.standing, path=path, arc=arc, moving=moving,
                      residuals=residuals, frame=settings.frame, humanoid=humanoid, still=still, sole=sole,
                      warnings=told)


def ride(source: RideSource, path: Path, settings: RideSettings, ground: Terrain | None = None) -> Ridden:
    """The motion of `source` on `path`.

    ground: a `motion.path.terrain.Terrain` that the feet are to follow; without it the path's own height, level across
    it.
    The motion's own path, ridden without planting and leaning, gives the motion itself. Raises InputError where the
    path has no length."""
    path = with_detours(path, settings.detours)
    arc = source.arc if path is source.path else ArcLength(path)
    residuals, seams, timing, end = _timed(source, path, arc, settings)
    rows = path_time.take_rows(residuals, timing.at)
    at = _parameters(source, path, arc, timing=timing, rows=rows, settings=settings)
    origin, tangent = path.at(at), path.at(at, 1)
    own = _faces(source.motion, source.humanoid) if source.still and path is source.path else None
    moving = path_frame.moving_frame(origin, tangent, timing.arc, residuals.fps, own)
    root, rotations = path_frame.placed(source.frame, moving, rows.place, rows.rotations)
    laid = root, rotations
    if settings.lean and source.humanoid:
        rotations = _leaned(source, rows, moving, timing=timing, rotations=rotations, seams=seams)
    correction, miss = np.zeros((len(root), 2)), np.zeros((len(root), 2))
    if settings.plant and source.humanoid:
        free, strained = _strained(source, path, at, tangent=tangent, timing=timing, rows=rows)
        under = _ground(path, arc, settings, terrain=ground, moving=moving, timing=timing, rows=rows)
        steps, more = _steps(source, rows, moving, timing, free)
        held = follow(residuals.skeleton, root, rotations, standing=rows.standing, fps=residuals.fps, ground=under,
                      sole=source.sole, steps=steps)
        if free.any():
            held = _let_go(held, root, rotations, free, residuals.fps)
            rows = rows.changed(standing=rows.standing & ~free[:, None, None])
        more = (*strained, *more, *_out_of_reach(held.miss, residuals.fps), *_beside(ground, origin))
        end = replace(end, told=(*end.told, *more))
        root, rotations, correction, miss = held.root, held.rotations, held.correction, held.miss
    motion = Motion(residuals.skeleton, root, rotations, residuals.fps)
    ridden = Ridden(motion=motion, frames=rows.frames, standing=rows.standing, arc=timing.arc, origin=origin,
                    heading=moving.heading, seams=seams, correction=correction, miss=miss, laid=laid, source=source,
                    warnings=(*source.warnings, *end.told), again=end.again)  # fmt: skip
    return _begun_again(ridden, end) if len(end.again) else ridden


def _timed(source: RideSource, path: Path, arc: ArcLength,
           settings: RideSettings) -> tuple[Residuals, np.ndarray, Timing, Ending]:
    """The residuals as they are shown, once through, cut or cycled; the cycles' seams; when each is shown where; and
    what happens at the path's end."""
    residuals, seams, told = source.residuals, np.zeros(0, dtype=int), ()
    wishes = path_time.Wishes(settings.slopes and settings.plant and source.humanoid, settings.climbs, settings.bends)
    plain = wishes.none or source.still or path is source.path or not settings.by_arc_length
    way = None if plain else path_time.way_of(path, arc)
    if way is not None and way.plain(wishes) and source.way.plain(wishes):
        way = None
    if settings.cycle and settings.by_arc_length:
        asked = arc.length
        if way is not None:
            asked = path_time.asked_length(residuals, _own_way(source, residuals), way, wishes)
        around = cycled(residuals, asked, source.loops)
        residuals, seams, told = around.residuals, around.seams, around.told
    elif settings.cycle:
        told = ("by time the motion fills every path: it is not cycled",)
    if source.still:
        told += ("the motion stands still: it is placed at the path's beginning",)
    if way is not None:
        own = _own_way(source, residuals)
        timing = path_time.by_way(residuals, own, way, wishes=wishes, speed=settings.speed, delay=settings.delay,
                        closed=path.closed)
    elif settings.by_arc_length or source.still:
        timing = path_time.by_arc_length(residuals, settings.speed, settings.delay)
    else:
        timing = path_time.by_time(residuals, path, arc, settings.speed, settings.delay)
    # a cycle ends with the path: what is a hair longer does not begin anew
    wish = "stop" if len(seams) else settings.end
    end = path_time.find_ending(timing.arc, arc.length, residuals.fps, wish, path.closed or source.still)
    timing = timing.first(end.count)
    seams = np.searchsorted(timing.at, seams - 1e-9)
    return residuals, seams[seams < end.count], timing, replace(end, told=(*told, *end.told))


def _begun_again(ridden: Ridden, end: Ending) -> Ridden:
    """The ride as often as its end says; whoever is set back does not stand meanwhile."""
    shown = ridden.showing(end.shown)
    standing = shown.standing.copy()
    standing[end.again - 1] = standing[end.again] = False
    return replace(shown, standing=standing)


def _own_way(source: RideSource, residuals: Residuals) -> Way:
    """What the motion's own path is like at every row."""
    return path_time.way_at(source.way, source.arc.at(residuals.frames / residuals.fps), residuals.step * residuals.fps)


def _own_slope(source: RideSource, rows: Residuals) -> np.ndarray:
    """(N,) radians that the motion's own path rises at every row."""
    return np.interp(rows.frames, np.arange(len(source.moving.slope)), source.moving.slope)


def _parameters(source: RideSource, path: Path, arc: ArcLength, timing: Timing, rows: Residuals,
                settings: RideSettings) -> np.ndarray:
    """(N,) parameters of the path; the motion's own path keeps its time, so that nothing is lost there."""
    if path is source.path:
        return rows.frames / rows.fps
    if not settings.by_arc_length:
        return path_time.parameter_at(path, timing.at / max(len(source.residuals) - 1, 1))
    return arc.parameter(timing.arc % arc.length if path.closed and arc.length > 0.0 else timing.arc)


def _leaned(source: RideSource, rows: Residuals, moving: MovingFrame, timing: Timing, rotations: np.ndarray,
            seams: np.ndarray) -> np.ndarray:
    """The body leant into bends, and its trunk into slopes, as far as the motion did not do so on its own path."""
    fps = rows.fps
    since = np.diff(timing.arc, prepend=timing.arc[:1])
    own_slope = _own_slope(source, rows)
    own_speed = np.column_stack([rows.step * np.cos(own_slope) * fps, np.zeros(len(rows))])
    lean = missing_lean(since * np.cos(moving.slope) * fps, moving.heading, own_speed, turn=rows.turn, seams=seams,
                        fps=fps, slow=LEANS_FROM)
    if np.abs(lean).max(initial=0.0) > 1e-9:
        rotations = lean_into_curves(rows.skeleton, rotations, moving.heading, lean)
    steeper = zero_phase_hann((moving.slope - own_slope)[:, None], fps, SLOPE_SECONDS)[:, 0]
    if np.abs(steeper).max(initial=0.0) > 1e-6:
        forward = np.clip(INTO_SLOPE * steeper, -MOST_FORWARD, MOST_FORWARD)
        rotations = bend_forward(rows.skeleton, rotations, moving.heading, forward)
    return rotations


def _strained(source: RideSource, path: Path, at: np.ndarray, tangent: np.ndarray, timing: Timing,
              rows: Residuals) -> tuple[np.ndarray, tuple[str, ...]]:
    """Frames (N,) bool in which no foot could follow the path, and what is told of them."""
    if path is source.path or source.still:
        return np.zeros(len(rows), dtype=bool), ()
    own = np.interp(rows.frames, np.arange(len(source.bends)), source.bends)
    bent = ground_contact.find_tight(path, at, timing.arc, own, rows.fps)
    risen = ground_contact.find_steep(tangent, timing.arc, _own_slope(source, rows), rows.fps)
    return bent | risen, ground_contact.strain_lines(bent, risen, rows.fps)


def _let_go(held: Planted, root: np.ndarray, rotations: np.ndarray, free: np.ndarray, fps: float) -> Planted:
    """The planted motion, but where it is `free` (N,) bool as it was laid out: root (N, 3) m, rotations (N, J, 4)."""
    much = ground_contact.share_free(free, fps)[:, None]
    turned = quaternion.slerp(held.rotations, rotations, much)
    miss = np.where(free[:, None], 0.0, held.miss)
    return Planted(held.root + much * (root - held.root), turned, (1.0 - much) * held.correction, miss)


def _steps(source: RideSource, rows: Residuals, moving: MovingFrame, timing: Timing,
           free: np.ndarray) -> tuple[Steps | None, tuple[str, ...]]:
    """How long steps are on the new path, against their own, and what of that legs cannot do; free (N,) bool: where no
    feet are planted."""
    own = rows.step * np.cos(_own_slope(source, rows))
    times = path_time.stretched(np.diff(timing.arc, prepend=timing.arc[:1]) * np.cos(moving.slope), own, rows.fps)
    if times is None:
        return None, ()
    worst = (np.maximum(times / LONGEST[1], LONGEST[0] / np.maximum(times, 1e-3)) > 1.05) & ~free
    told = []
    for first, end in runs(worst):
        span = first / rows.fps, (end - 1) / rows.fps
        much = times[first:end][np.argmax(np.abs(np.log(np.maximum(times[first:end], 1e-3))))]
        asks = f"the path asks for steps {much:.1f} times as long as they were; feet slide"
        told.append(TimedLine(f"{span[0]:.1f} s: {asks}", span))
    return Steps(moving.heading, times), tuple(told)


def _out_of_reach(miss: np.ndarray, fps: float) -> list[str]:
    """One line for all stances that legs do not reach, from their misses (N, 2) m."""
    far = miss.max(axis=1)
    spans = [(first / fps, (end - 1) / fps) for first, end in runs(far > OUT_OF_REACH)]
    if not spans:
        return []
    times = f"{len(spans)} times, first at {spans[0][0]:.1f} s" if len(spans) > 1 else f"at {spans[0][0]:.1f} s"
    much = f"feet do not reach where they should stand, by up to {100.0 * far.max():.0f} cm"
    return [TimedLine(f"{much}: {times}", *spans)]


def _ground(path: Path, arc: ArcLength, settings: RideSettings, terrain: Terrain | None, moving: MovingFrame,
            timing: Timing, rows: Residuals) -> Ground:
    """What the feet are to go on."""
    own = moving.origin[:, 2:] + rows.under
    up = quaternion.rotate(quaternion.about_up(moving.heading)[:, None], rows.up)
    if not settings.slopes or (terrain is None and ground_contact.is_level(path, arc) and not rows.under.any()):
        return Ground(own, up)
    if terrain is None:
        return Ground(own, up, ground_contact.path_surface(path, arc, timing.arc))
    return Ground(own, up, ground_contact.mesh_surface(terrain, moving.origin))


def _beside(ground: Terrain | None, origin: np.ndarray) -> tuple[str, ...]:
    """A line where the mesh lies nowhere under the path, origin (T, 3) m: it is elsewhere, or in another unit."""
    some = origin[::8]
    if ground is None or np.isfinite(ground.heights(some[:, :2], np.full(len(some), np.inf))[0]).any():
        return ()
    return ("the ground lies nowhere under the path: the path's own height counts",)


def _own_ground(motion: Motion, standing: np.ndarray, path: Path, arc: ArcLength, moving: MovingFrame,
                metres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Metres (T, 2) from the motion's own path up to the ground under its feet, and its normals (T, 2, 3) in the
    frame."""
    if ground_contact.is_level(path, arc):
        return _flat(len(motion))
    body = identify(motion.skeleton)
    joints = [[limb.foot, limb.toe_or_foot] for limb in (body.left, body.right)]
    feet = forward_kinematics(motion)[0][:, joints]
    clear = np.zeros((len(motion), 2))
    surface = ground_contact.path_surface(path, arc, metres)
    found = ground_contact.footing(feet[..., :2], standing, clear, motion.fps, surface)
    back = quaternion.about_up(-moving.heading)[:, None]
    return found.height - moving.origin[:, 2:], quaternion.rotate(back, found.normal)


def _flat(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((count, 2)), np.tile([0.0, 0.0, 1.0], (count, 2, 1))


def _humanoid(motion: Motion) -> tuple[bool, tuple[str, ...]]:
    try:
        identify(motion.skeleton)
    except InputError:
        return False, ("no legs were found in this skeleton: its feet are not planted and it does not lean",)
    return True, ()


def _faces(motion: Motion, humanoid: bool) -> float:
    """Radians: which way the body faces in the mean; for a path that leads nowhere."""
    if not humanoid:
        return 0.0
    turned = facing(motion)
    return float(np.arctan2(np.sin(turned).mean(), np.cos(turned).mean()))


def _fitted(motion: Motion, standing: np.ndarray, settings: RideSettings) -> Path:
    return path_frame.fit_path(motion, standing, settings.fit, settings.degree)


def _fitted_any(motion: Motion, standing: np.ndarray, settings: RideSettings) -> Path:
    """The path of a body without legs: its root's, as high as its lowest joint is in general."""
    places, _ = forward_kinematics(motion)
    line = motion.root_positions.copy()
    line[:, 2] = contacts.at_zero(float(np.percentile(places[..., 2].min(axis=1), 2)))
    times = np.arange(len(line)) / motion.fps
    if settings.fit == "spline":
        return path_frame.fit_spline(line, times)
    return path_frame.fit_polynomial(line, times, settings.degree)
