"""Path editing: a clip follows another path (Gleicher 2001, as described in Path editing §3), and its feet stay
planted.

`path_edit_source` finds a motion's own path and the motion relative to it, once; `edit_path` constructs the motion on a
new path, fast enough to repeat it while the path is dragged.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..base.errors import TimedMessage
from ..base.time_series import find_runs
from ..motion import quaternion
from ..motion.foot_plant import PlantResult
from ..motion.motion import Motion
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path
from ..motion.path.terrain import Terrain
from ..motion.track import smooth_zero_phase_hann
from ..synthesis.construct.track_following import bend_forward, compute_missing_lean, lean_into_curves
from . import ground_contact, path_frame, path_time
from .cycle import cycle_motion, stays_in_place
from .detour import add_detours
from .foot_planting import LONGEST, Ground, StepScale, plant_feet_on_ground
from .path_edit_settings import PathEditSettings
from .path_edit_source import PathEditSource, compute_mean_heading
from .path_frame import MovingFrame, Residuals
from .path_time import Ending, Timing

LEAN_SPEEDS = (0.7, 1.5)
"""Metres per second below which a body does not lean into a bend, and from which on it leans fully: walkers lean too,
on a path as smooth as these."""
INTO_SLOPE, MOST_FORWARD, SLOPE_SECONDS = 0.45, 0.2, 0.6
"""Share of a slope by which the trunk leans into it, and radians of that at most (Leroux, Fung and Barbeau 2002: some 3
degrees forward at a rise of 10 %, backward going down); seconds over which a slope is averaged."""
OUT_OF_REACH = 0.03
"""Metres that a foot may be short of its place without a warning."""


@dataclass(frozen=True, eq=False, kw_only=True)
class EditedMotion:
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
    transitions: np.ndarray
    correction: np.ndarray
    miss: np.ndarray
    constructed: tuple[np.ndarray, np.ndarray]
    source: PathEditSource
    warnings: tuple[str, ...] = field(default=())
    restarts: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))

    @cached_property
    def rigid(self) -> Motion:
        """The motion before leaning and planting."""
        return Motion(self.motion.skeleton, *self.constructed, self.motion.fps)

    @property
    def remove_repeats(self) -> EditedMotion:
        """The edited motion up to its first restart: all laps are alike."""
        if not len(self.restarts):
            return self
        return replace(self.select_frames(np.arange(self.restarts[0])), restarts=np.zeros(0, dtype=int))

    def select_frames(self, which: np.ndarray) -> EditedMotion:
        """Select frames (N,) of the edited motion."""
        rows = ("frames", "standing", "arc", "origin", "heading", "correction", "miss")
        motion, constructed = self.motion, tuple(values[which] for values in self.constructed)
        motion = replace(motion, root_positions=motion.root_positions[which], rotations=motion.rotations[which])
        return replace(self, **{name: getattr(self, name)[which] for name in rows}, motion=motion,
                       constructed=constructed)


def edit_path(source: PathEditSource, path: Path, settings: PathEditSettings,
              ground: Terrain | None = None) -> EditedMotion:
    """Construct the motion of a source on a new path.

    On the motion's own path, without planting and leaning, the result is the motion itself.

    Args:
        source: the motion relative to its own path.
        path: the new path, world frame.
        settings: timing, feet, detours.
        ground: a mesh that the feet follow; None: the path's own height, level across it.
    Returns:
        The edited motion with its contacts and warnings.
    Raises:
        InputError: if the path has no length.
    """
    path = add_detours(path, settings.detours)
    arc = source.arc if path is source.path else ArcLength(path)
    residuals, transitions, timing, end = _build_timing(source, path, arc, settings)
    # Timing first, then pose and place in the moving frame, then lean, then feet.
    rows = path_time.resample_residuals(residuals, timing.at)
    at = _compute_parameters(source, path, arc, timing=timing, rows=rows, settings=settings)
    origin, tangent = path.at(at), path.at(at, 1)
    own = compute_mean_heading(source.motion, source.has_legs) if source.is_still and path is source.path else None
    moving = path_frame.build_moving_frame(origin, tangent, timing.arc, residuals.fps, own)
    root, rotations = path_frame.from_moving_frame(source.frame, moving, rows.place, rows.rotations)
    constructed = root, rotations
    if settings.lean and source.has_legs:
        rotations = _apply_lean(source, rows, moving, timing=timing, rotations=rotations, transitions=transitions)
    correction, miss = np.zeros((len(root), 2)), np.zeros((len(root), 2))
    if settings.plant and source.has_legs:
        free, strained = _find_strain(source, path, at, tangent=tangent, timing=timing, rows=rows)
        under = _build_ground(path, arc, settings, terrain=ground, moving=moving, timing=timing, rows=rows)
        steps, more = _compute_step_scale(source, rows, moving, timing, free)
        planted = plant_feet_on_ground(residuals.skeleton, root, rotations, standing=rows.standing, fps=residuals.fps,
                                       ground=under, sole=source.sole, steps=steps)
        if free.any():
            planted = _release_feet(planted, root, rotations, free, residuals.fps)
            rows = rows.replace_fields(standing=rows.standing & ~free[:, None, None])
        more = (*strained, *more, *_report_out_of_reach(planted.miss, residuals.fps),
                *_report_missing_ground(ground, origin))
        end = replace(end, messages=(*end.messages, *more))
        root, rotations, correction, miss = planted.root, planted.rotations, planted.correction, planted.miss
    motion = Motion(residuals.skeleton, root, rotations, residuals.fps)
    edited = EditedMotion(motion=motion, frames=rows.frames, standing=rows.standing, arc=timing.arc, origin=origin,
                          heading=moving.heading, transitions=transitions, correction=correction, miss=miss,
                          constructed=constructed, source=source, warnings=(*source.warnings, *end.messages),
                          restarts=end.restarts)  # fmt: skip
    return _repeat_laps(edited, end) if len(end.restarts) else edited


def _build_timing(source: PathEditSource, path: Path, arc: ArcLength,
                  settings: PathEditSettings) -> tuple[Residuals, np.ndarray, Timing, Ending]:
    """Build the timing: the residuals, cut or cycled; their transitions; row and arc length of each frame; the
    ending.
    """
    residuals, transitions, messages = source.residuals, np.zeros(0, dtype=int), ()
    options = path_time.StepOptions(settings.slopes and settings.plant and source.has_legs, settings.climbs,
                                    settings.bends)
    is_plain = options.is_empty or source.is_still or path is source.path or not settings.by_arc_length
    profile = None if is_plain else path_time.build_profile(path, arc)
    if profile is not None and profile.leaves_steps_unchanged(options) and source.profile.leaves_steps_unchanged(
            options):
        profile = None
    if settings.cycle and settings.by_arc_length:
        required_length = arc.length
        if profile is not None:
            required_length = path_time.compute_required_length(residuals, source.sample_profile(residuals), profile,
                                                                options)
        around = cycle_motion(residuals, required_length, source.loops)
        residuals, transitions, messages = around.residuals, around.transitions, around.messages
    elif settings.cycle:
        messages = ("by time the motion fills the whole path: cycling has no effect",)
    if source.is_still:
        messages += ("the motion stays in place: it is put at the start of the path",)
    if profile is not None:
        own = source.sample_profile(residuals)
        timing = path_time.build_timing_by_profile(residuals, own, profile, options=options, speed=settings.speed,
                                                   delay=settings.delay, closed=path.closed)
    elif settings.by_arc_length or source.is_still:
        timing = path_time.build_timing_by_arc_length(residuals, settings.speed, settings.delay)
    else:
        timing = path_time.build_timing_by_time(residuals, path, arc, settings.speed, settings.delay)
    # A cycled motion ends with the path: where it is slightly longer it does not restart.
    end_mode = "stop" if len(transitions) else settings.end
    end = path_time.find_ending(timing.arc, arc.length, residuals.fps, end_mode, path.closed or source.is_still)
    timing = timing.first(end.count)
    if not (settings.cycle or path.closed or stays_in_place(source.residuals)):
        messages += path_time.report_rest(timing, arc.length, residuals.fps)
    transitions = np.searchsorted(timing.at, transitions - 1e-9)
    return residuals, transitions[transitions < end.count], timing, replace(end, messages=(*messages, *end.messages))


def _repeat_laps(edited: EditedMotion, end: Ending) -> EditedMotion:
    """Repeat the edited motion as its ending says; around a restart no foot is in contact."""
    repeated = edited.select_frames(end.displayed)
    standing = repeated.standing.copy()
    standing[end.restarts - 1] = standing[end.restarts] = False
    return replace(repeated, standing=standing)


def _compute_parameters(source: PathEditSource, path: Path, arc: ArcLength, timing: Timing, rows: Residuals,
                        settings: PathEditSettings) -> np.ndarray:
    """Compute the parameters (N,) of the path; the motion's own path keeps its time exactly."""
    if path is source.path:
        return rows.frames / rows.fps
    if not settings.by_arc_length:
        return path_time.parameter_at(path, timing.at / max(len(source.residuals) - 1, 1))
    return arc.parameter_at(timing.arc % arc.length if path.closed and arc.length > 0.0 else timing.arc)


def _apply_lean(source: PathEditSource, rows: Residuals, moving: MovingFrame, timing: Timing, rotations: np.ndarray,
                transitions: np.ndarray) -> np.ndarray:
    """Lean the body into bends, and its trunk into slopes, beyond what the motion did on its own path."""
    fps = rows.fps
    since = np.diff(timing.arc, prepend=timing.arc[:1])
    own_slope = source.sample_slope(rows)
    own_speed = np.column_stack([rows.step * np.cos(own_slope) * fps, np.zeros(len(rows))])
    lean = compute_missing_lean(since * np.cos(moving.slope) * fps, moving.heading, own_speed, turn=rows.turn,
                                transitions=transitions, fps=fps, upright_speed=LEAN_SPEEDS)
    if np.abs(lean).max(initial=0.0) > 1e-9:
        rotations = lean_into_curves(rows.skeleton, rotations, moving.heading, lean)
    steeper = smooth_zero_phase_hann((moving.slope - own_slope)[:, None], fps, SLOPE_SECONDS)[:, 0]
    if np.abs(steeper).max(initial=0.0) > 1e-6:
        forward = np.clip(INTO_SLOPE * steeper, -MOST_FORWARD, MOST_FORWARD)
        rotations = bend_forward(rows.skeleton, rotations, moving.heading, forward)
    return rotations


def _find_strain(source: PathEditSource, path: Path, at: np.ndarray, tangent: np.ndarray, timing: Timing,
                 rows: Residuals) -> tuple[np.ndarray, tuple[str, ...]]:
    """Find the frames (N,) bool in which no foot can follow the path, with messages."""
    if path is source.path or source.is_still:
        return np.zeros(len(rows), dtype=bool), ()
    own = np.interp(rows.frames, np.arange(len(source.curvature)), source.curvature)
    bent = ground_contact.find_tight_bends(path, at, timing.arc, own, rows.fps)
    risen = ground_contact.find_steep_stretches(tangent, timing.arc, source.sample_slope(rows), rows.fps)
    return bent | risen, ground_contact.report_strain(bent, risen, rows.fps)


def _release_feet(planted: PlantResult, root: np.ndarray, rotations: np.ndarray, free: np.ndarray,
                  fps: float) -> PlantResult:
    """Blend the planted motion to the constructed one (root (N, 3) m, rotations (N, J, 4)) where it is `free` (N,)
    bool.
    """
    much = ground_contact.compute_free_share(free, fps)[:, None]
    blended = quaternion.slerp(planted.rotations, rotations, much)
    miss = np.where(free[:, None], 0.0, planted.miss)
    return PlantResult(planted.root + much * (root - planted.root), blended, (1.0 - much) * planted.correction, miss)


def _compute_step_scale(source: PathEditSource, rows: Residuals, moving: MovingFrame, timing: Timing,
                        free: np.ndarray) -> tuple[StepScale | None, tuple[str, ...]]:
    """Compute the scale of the steps on the new path, with messages where legs cannot follow; free (N,) bool:
    unplanted.
    """
    own = rows.step * np.cos(source.sample_slope(rows))
    scale = path_time.compute_step_scale(np.diff(timing.arc, prepend=timing.arc[:1]) * np.cos(moving.slope), own,
                                         rows.fps)
    if scale is None:
        return None, ()
    worst = (np.maximum(scale / LONGEST[1], LONGEST[0] / np.maximum(scale, 1e-3)) > 1.05) & ~free
    messages = []
    for first, end in find_runs(worst):
        span = first / rows.fps, (end - 1) / rows.fps
        much = scale[first:end][np.argmax(np.abs(np.log(np.maximum(scale[first:end], 1e-3))))]
        asks = f"the path needs steps {much:.1f} times as long as recorded; feet slide"
        messages.append(TimedMessage(f"{span[0]:.1f} s: {asks}", span))
    return StepScale(moving.heading, scale), tuple(messages)


def _report_out_of_reach(miss: np.ndarray, fps: float) -> list[str]:
    """Report all stances that legs do not reach in one message, from their misses (N, 2) m."""
    far = miss.max(axis=1)
    spans = [(first / fps, (end - 1) / fps) for first, end in find_runs(far > OUT_OF_REACH)]
    if not spans:
        return []
    times = f"{len(spans)} times, first at {spans[0][0]:.1f} s" if len(spans) > 1 else f"at {spans[0][0]:.1f} s"
    much = f"feet do not reach their contacts, by up to {100.0 * far.max():.0f} cm"
    return [TimedMessage(f"{much}: {times}", *spans)]


def _build_ground(path: Path, arc: ArcLength, settings: PathEditSettings, terrain: Terrain | None, moving: MovingFrame,
                  timing: Timing, rows: Residuals) -> Ground:
    """Build the ground to plant the feet on."""
    own = moving.origin[:, 2:] + rows.under
    up = quaternion.rotate(quaternion.from_up_angle(moving.heading)[:, None], rows.up)
    if not settings.slopes or (terrain is None and ground_contact.is_level(path, arc) and not rows.under.any()):
        return Ground(own, up)
    if terrain is None:
        return Ground(own, up, ground_contact.build_path_surface(path, arc, timing.arc))
    return Ground(own, up, ground_contact.build_mesh_surface(terrain, moving.origin))


def _report_missing_ground(ground: Terrain | None, origin: np.ndarray) -> tuple[str, ...]:
    """Report if the mesh is nowhere under the path, origin (T, 3) m: it is elsewhere, or in another unit."""
    some = origin[::8]
    if ground is None or np.isfinite(ground.find_heights(some[:, :2], np.full(len(some), np.inf))[0]).any():
        return ()
    return ("the ground is nowhere under the path, so the path's own height is used: check its place and unit",)
