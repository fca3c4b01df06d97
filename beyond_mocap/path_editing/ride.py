"""Path editing: a clip follows another path (Gleicher 2001, as described in Path editing §3), and its feet stay
planted.

`prepare_source` finds a motion's own path and the motion relative to it, once; `edit_path` constructs the motion on a
new path, fast enough to repeat it while the path is dragged.
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
"""Metres per second below which a body does not lean into a bend, and from which on it leans fully: walkers lean too,
on a path as smooth as these."""
INTO_SLOPE, MOST_FORWARD, SLOPE_SECONDS = 0.45, 0.2, 0.6
"""Share of a slope by which the trunk leans into it, and radians of that at most (Leroux, Fung and Barbeau 2002: some 3
degrees forward at a rise of 10 %, backward going down); seconds over which a slope is averaged."""
OUT_OF_REACH = 0.03
"""Metres that a foot may be short of its place without a warning."""
STILL = 0.05
"""Metres of path below which a motion counts as standing still."""


@dataclass(frozen=True, kw_only=True)
class RideSettings:
    """Settings of a path edit; the settings table describes each of them.

    Attributes:
        detours: (arc, width, offset to the left) of each detour, metres.
    Raises:
        InputError: if a value is unknown or outside its limits.
    """

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
            raise InputError("speed", f"{self.speed:g}", f"a factor from {_SPEED.least:g} to {_SPEED.most:g}")
        if not 0.0 <= self.delay < 86400.0:
            raise InputError("delay", f"{self.delay:g} s", "0 s or more, less than a day")


@dataclass(frozen=True, eq=False, kw_only=True)
class RideSource:
    """A motion relative to its own path: everything that does not depend on the new one.

    Attributes:
        motion: as recorded.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe.
        path: the motion's own path; its parameter is seconds.
        arc: the arc length of that path.
        moving: the moving frame in every frame.
        residuals: the motion in the moving frame.
        frame: the one of FRAMES that they are relative to.
        humanoid: whether it has feet that can be planted.
        still: whether it stays in place.
        sole: metres from the ground to the foremost joint of a flat foot.
        warnings: for the user.
    """

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
        """Where the motion can be repeated, lowest cost first; searched on first use."""
        return find_loops(self.residuals)

    @cached_property
    def way(self) -> Way:
        """Slope and curvature of the motion's own path."""
        return path_time.way_of(self.path, self.arc)

    @cached_property
    def bends(self) -> np.ndarray:
        """(T,) 1/m, curvature of the motion's own path over the ground."""
        return ground_contact.curvature(self.path, np.arange(len(self.motion)) / self.motion.fps)


@dataclass(frozen=True, eq=False, kw_only=True)
class Ridden:
    """A motion on its new path, N frames.

    Attributes:
        motion: the edited motion.
        frames: (N,) source frames, fractional in general.
        standing: (N, 2, 2) bool, contacts carried from the source.
        arc: (N,) metres along the new path.
        origin: (N, 3) metres, the moving frame's origin, world frame.
        heading: (N,) radians, the moving frame's heading.
        transitions: (S,) first frames after a jump from a loop's end to its start, blended.
        correction: (N, 2) metres by which planting moved each foot.
        miss: (N, 2) metres that each foot is short of its place.
        constructed: root (N, 3) m and local rotations (N, J, 4) before leaning and planting.
        source: the motion relative to its own path.
        warnings: for the user.
        restarts: (R,) first frames where motion and path restart: cuts, without any contact.
    """

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
        """The edited motion up to its first restart: all laps are alike."""
        if not len(self.again):
            return self
        return replace(self.showing(np.arange(self.again[0])), again=np.zeros(0, dtype=int))

    def showing(self, which: np.ndarray) -> Ridden:
        """Select frames (N,) of the edited motion."""
        rows = ("frames", "standing", "arc", "origin", "heading", "correction", "miss")
        motion, laid = self.motion, tuple(values[which] for values in self.laid)
        motion = replace(motion, root_positions=motion.root_positions[which], rotations=motion.rotations[which])
        return replace(self, **{name: getattr(self, name)[which] for name in rows}, motion=motion, laid=laid)


def prepare(motion: Motion, settings: RideSettings, standing: np.ndarray | None = None,
            path: Path | None = None) -> RideSource:
    """Compute a motion relative to its own path.

    Args:
        motion: two frames or more.
        settings: how the path is fitted, and the frame of the residuals.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe; None: detected (`contacts.points`).
        path: its own path, with seconds from the first frame as parameter; None: fitted.
    Returns:
        The source for `edit_path`.
    Raises:
        InputError: for fewer than two frames.
    """
    if len(motion) < 2:
        raise InputError("motion", f"{len(motion)} frame", "two frames or more")
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
    """Construct the motion of a source on a new path.

    On the motion's own path, without planting and leaning, the result is the motion itself.

    Args:
        source: of `prepare_source`.
        path: the new path, world frame.
        settings: timing, feet, detours.
        ground: a mesh that the feet follow; None: the path's own height, level across it.
    Returns:
        The edited motion with its contacts and warnings.
    Raises:
        InputError: if the path has no length.
    """
    path = with_detours(path, settings.detours)
    arc = source.arc if path is source.path else ArcLength(path)
    residuals, seams, timing, end = _timed(source, path, arc, settings)
    # Timing first, then pose and place in the moving frame, then lean, then feet.
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
    """Build the timing: the residuals, cut or cycled; their transitions; row and arc length of each frame; the
    ending.
    """
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
        told = ("by time the motion fills the whole path: cycling has no effect",)
    if source.still:
        told += ("the motion stays in place: it is put at the start of the path",)
    if way is not None:
        own = _own_way(source, residuals)
        timing = path_time.by_way(residuals, own, way, wishes=wishes, speed=settings.speed, delay=settings.delay,
                        closed=path.closed)
    elif settings.by_arc_length or source.still:
        timing = path_time.by_arc_length(residuals, settings.speed, settings.delay)
    else:
        timing = path_time.by_time(residuals, path, arc, settings.speed, settings.delay)
    # A cycled motion ends with the path: where it is slightly longer it does not restart.
    wish = "stop" if len(seams) else settings.end
    end = path_time.find_ending(timing.arc, arc.length, residuals.fps, wish, path.closed or source.still)
    timing = timing.first(end.count)
    seams = np.searchsorted(timing.at, seams - 1e-9)
    return residuals, seams[seams < end.count], timing, replace(end, told=(*told, *end.told))


def _begun_again(ridden: Ridden, end: Ending) -> Ridden:
    """Repeat the edited motion as its ending says; around a restart no foot is in contact."""
    shown = ridden.showing(end.shown)
    standing = shown.standing.copy()
    standing[end.again - 1] = standing[end.again] = False
    return replace(shown, standing=standing)


def _own_way(source: RideSource, residuals: Residuals) -> Way:
    """Sample the profile of the motion's own path at every row."""
    return path_time.way_at(source.way, source.arc.at(residuals.frames / residuals.fps), residuals.step * residuals.fps)


def _own_slope(source: RideSource, rows: Residuals) -> np.ndarray:
    """Compute the slope (N,) radians of the motion's own path at every row."""
    return np.interp(rows.frames, np.arange(len(source.moving.slope)), source.moving.slope)


def _parameters(source: RideSource, path: Path, arc: ArcLength, timing: Timing, rows: Residuals,
                settings: RideSettings) -> np.ndarray:
    """Compute the parameters (N,) of the path; the motion's own path keeps its time exactly."""
    if path is source.path:
        return rows.frames / rows.fps
    if not settings.by_arc_length:
        return path_time.parameter_at(path, timing.at / max(len(source.residuals) - 1, 1))
    return arc.parameter(timing.arc % arc.length if path.closed and arc.length > 0.0 else timing.arc)


def _leaned(source: RideSource, rows: Residuals, moving: MovingFrame, timing: Timing, rotations: np.ndarray,
            seams: np.ndarray) -> np.ndarray:
    """Lean the body into bends, and its trunk into slopes, beyond what the motion did on its own path."""
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
    """Find the frames (N,) bool in which no foot can follow the path, with messages."""
    if path is source.path or source.still:
        return np.zeros(len(rows), dtype=bool), ()
    own = np.interp(rows.frames, np.arange(len(source.bends)), source.bends)
    bent = ground_contact.find_tight(path, at, timing.arc, own, rows.fps)
    risen = ground_contact.find_steep(tangent, timing.arc, _own_slope(source, rows), rows.fps)
    return bent | risen, ground_contact.strain_lines(bent, risen, rows.fps)


def _let_go(held: Planted, root: np.ndarray, rotations: np.ndarray, free: np.ndarray, fps: float) -> Planted:
    """Blend the planted motion to the constructed one (root (N, 3) m, rotations (N, J, 4)) where it is `free` (N,)
    bool.
    """
    much = ground_contact.share_free(free, fps)[:, None]
    turned = quaternion.slerp(held.rotations, rotations, much)
    miss = np.where(free[:, None], 0.0, held.miss)
    return Planted(held.root + much * (root - held.root), turned, (1.0 - much) * held.correction, miss)


def _steps(source: RideSource, rows: Residuals, moving: MovingFrame, timing: Timing,
           free: np.ndarray) -> tuple[Steps | None, tuple[str, ...]]:
    """Compute the scale of the steps on the new path, with messages where legs cannot follow; free (N,) bool:
    unplanted.
    """
    own = rows.step * np.cos(_own_slope(source, rows))
    times = path_time.stretched(np.diff(timing.arc, prepend=timing.arc[:1]) * np.cos(moving.slope), own, rows.fps)
    if times is None:
        return None, ()
    worst = (np.maximum(times / LONGEST[1], LONGEST[0] / np.maximum(times, 1e-3)) > 1.05) & ~free
    told = []
    for first, end in runs(worst):
        span = first / rows.fps, (end - 1) / rows.fps
        much = times[first:end][np.argmax(np.abs(np.log(np.maximum(times[first:end], 1e-3))))]
        asks = f"the path needs steps {much:.1f} times as long as recorded; feet slide"
        told.append(TimedLine(f"{span[0]:.1f} s: {asks}", span))
    return Steps(moving.heading, times), tuple(told)


def _out_of_reach(miss: np.ndarray, fps: float) -> list[str]:
    """Report all stances that legs do not reach in one message, from their misses (N, 2) m."""
    far = miss.max(axis=1)
    spans = [(first / fps, (end - 1) / fps) for first, end in runs(far > OUT_OF_REACH)]
    if not spans:
        return []
    times = f"{len(spans)} times, first at {spans[0][0]:.1f} s" if len(spans) > 1 else f"at {spans[0][0]:.1f} s"
    much = f"feet do not reach their contacts, by up to {100.0 * far.max():.0f} cm"
    return [TimedLine(f"{much}: {times}", *spans)]


def _ground(path: Path, arc: ArcLength, settings: RideSettings, terrain: Terrain | None, moving: MovingFrame,
            timing: Timing, rows: Residuals) -> Ground:
    """Build the ground to plant the feet on."""
    own = moving.origin[:, 2:] + rows.under
    up = quaternion.rotate(quaternion.about_up(moving.heading)[:, None], rows.up)
    if not settings.slopes or (terrain is None and ground_contact.is_level(path, arc) and not rows.under.any()):
        return Ground(own, up)
    if terrain is None:
        return Ground(own, up, ground_contact.path_surface(path, arc, timing.arc))
    return Ground(own, up, ground_contact.mesh_surface(terrain, moving.origin))


def _beside(ground: Terrain | None, origin: np.ndarray) -> tuple[str, ...]:
    """Report if the mesh is nowhere under the path, origin (T, 3) m: it is elsewhere, or in another unit."""
    some = origin[::8]
    if ground is None or np.isfinite(ground.heights(some[:, :2], np.full(len(some), np.inf))[0]).any():
        return ()
    return ("the ground is nowhere under the path, so the path's own height is used: check its place and unit",)


def _own_ground(motion: Motion, standing: np.ndarray, path: Path, arc: ArcLength, moving: MovingFrame,
                metres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure the ground under the feet on the motion's own path: metres (T, 2) above it, and normals (T, 2, 3) in
    the frame.
    """
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
        return False, ("the skeleton has no recognizable legs: feet are not planted, and the body does not lean",)
    return True, ()


def _faces(motion: Motion, humanoid: bool) -> float:
    """Compute the mean heading of the body in radians, for a path without movement."""
    if not humanoid:
        return 0.0
    turned = facing(motion)
    return float(np.arctan2(np.sin(turned).mean(), np.cos(turned).mean()))


def _fitted(motion: Motion, standing: np.ndarray, settings: RideSettings) -> Path:
    return path_frame.fit_path(motion, standing, settings.fit, settings.degree)


def _fitted_any(motion: Motion, standing: np.ndarray, settings: RideSettings) -> Path:
    """Fit the path of a body without legs: that of its root, at the usual height of its lowest joint."""
    places, _ = forward_kinematics(motion)
    line = motion.root_positions.copy()
    line[:, 2] = contacts.at_zero(float(np.percentile(places[..., 2].min(axis=1), 2)))
    times = np.arange(len(line)) / motion.fps
    if settings.fit == "spline":
        return path_frame.fit_spline(line, times)
    return path_frame.fit_polynomial(line, times, settings.degree)
