"""Reconstruct a moving skeleton from optical markers (Fredriksson section 5).

The steps: label and clean the markers, build or take a model, solve the poses, filter the motion, estimate the floor
and, for throws, the release of the ball.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from .. import __version__
from ..base.errors import InputError, UserCancelledError, format_some
from ..base.settings import collect_defaults, find_setting
from ..motion.motion import Motion
from ..synthesis.one_thread import limit_to_one_thread
from .cleaning.clean import CleaningResult
from .model.model import MarkerModel
from .pose.pose import HeldBall, PoseSettings, PoseSolution, solve_poses
from .pose.residuals import measure_floor, measure_marker_visibility
from .reconstruction_figures import collect_figures, describe_foot_slide
from .trial import MarkerTrial
from .trial_preparation import (
    check_model_fits,
    check_prepared_trial,
    clean_prepared_trial,
    find_marker_set,
    prepare_trial,
)

if TYPE_CHECKING:
    from .release.release import Release

_DEFAULTS = collect_defaults("markers")
FILTERS = find_setting("markers", "filter").choice_names
RELEASES = find_setting("markers", "release").choice_names
_SMOOTHNESS = find_setting("markers", "smoothness")
_REPORTED_FLOOR_HEIGHT = 0.02  # metres from height 0 beyond which the floor height is reported
# Mean residuals in metres above which the fit is reported as poor: over all markers, and of one marker.
_POOR_MEAN_RESIDUAL, _POOR_MARKER_RESIDUAL = 0.015, 0.04

Progress = Callable[[float, str], None]


@dataclass(frozen=True, kw_only=True)
class ReconstructSettings:
    """Options of a reconstruction; the settings table describes each.

    Attributes:
        marker_set: the marker set, or None to use the shipped set that fits.
        weights: give markers of deformed clusters less weight.
        limits: keep joints within their limits.
        smoothness: seconds over which the whole sequence is solved as a smooth one; 0 solves each frame separately.
        filter: one of FILTERS.
        cutoff: hertz, of the Butterworth filter.
        plant: hold feet in place where they are in contact with the ground.
        floor: move motion and markers so that the floor is at height 0.
        radius: metres, of a ball that carries a marker; None to fit it or use that of the ball's kind.
        hold_ball: let the marker on the ball take part in the pose until the release.
        ball: kind of ball.
        release: "auto" searches for a release where a marker is on a ball or the file name contains a speed; "yes",
            "no".
    Raises:
        InputError: if a choice is unknown or the smoothness is out of range.
    """

    marker_set: object | None = None
    weights: bool = _DEFAULTS["weights"]
    limits: bool = _DEFAULTS["limits"]
    smoothness: float = _DEFAULTS["smoothness"]
    filter: str = _DEFAULTS["filter"]
    cutoff: float = _DEFAULTS["cutoff"]
    plant: bool = _DEFAULTS["plant"]
    floor: bool = _DEFAULTS["floor"]
    radius: float | None = _DEFAULTS["radius"]
    hold_ball: bool = _DEFAULTS["hold_ball"]
    ball: str = _DEFAULTS["ball"]
    release: str = _DEFAULTS["release"]

    def __post_init__(self):
        for name, choices in (("filter", FILTERS), ("release", RELEASES)):
            if getattr(self, name) not in choices:
                raise InputError(name, f"{getattr(self, name)!r}", f"one of {', '.join(choices)}")
        least, most = _SMOOTHNESS.least, _SMOOTHNESS.most
        if not least <= self.smoothness <= most:
            raise InputError("smoothness", f"{self.smoothness} s", _SMOOTHNESS.describe_limits(least, most))


@dataclass(frozen=True, eq=False, kw_only=True)
class Reconstruction:
    """The result of `reconstruct`.

    Attributes:
        motion: at the trial's rate, in the markers' space.
        model: the model whose skeleton moves.
        trial: the markers under the set's labels, cleaned, with all gaps filled that can be filled.
        raw: the trial as given.
        solved: the poses before the filters.
        cleaned: the cleaned trial with the report on what was changed.
        release: the release of a throw, else None.
        held: (T, 2, 2) bool, which points of the feet are held, see `filter_foot_plants`; None without that filter.
        floor: height in metres of the floor under the feet as recorded.
        grounded: whether motion and trial were moved so that this floor is at height 0.
        seconds: computing time of each step.
        warnings: messages for people.
    """

    motion: Motion
    model: MarkerModel
    trial: MarkerTrial
    raw: MarkerTrial
    solved: PoseSolution
    cleaned: CleaningResult
    release: Release | None = None
    held: np.ndarray | None = None
    floor: float = 0.0
    grounded: bool = False
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def lowered_by(self) -> float:
        """Metres by which motion and trial are lower than the recorded markers."""
        return self.floor if self.grounded else 0.0

    def place_on_floor(self) -> Motion:
        """Return the motion with its floor at height 0, as clips of a library have it."""
        return self.motion if self.grounded else move_down(self.motion, self.floor)

    def report(self) -> dict:
        """Return the figures of the reconstruction, as values for JSON."""
        return {"version": __version__, **collect_figures(self)}


def reconstruct(trial: MarkerTrial, static: MarkerTrial | None = None, model: MarkerModel | None = None,
                settings: ReconstructSettings = ReconstructSettings(), progress: Progress | None = None,
                cancelled: Callable[[], bool] | None = None) -> Reconstruction:
    """Reconstruct the skeleton motion that explains the markers of a trial.

    Args:
        trial: the recorded markers, metres, Z up.
        static: the same markers on the same body in a standing pose, from which the model is built; without one the
            model is built from the trial itself.
        model: a model that was built before; static is then used for checks only.
        settings: the options.
        progress: called with the share that is done (0 to 1) and the name of the step.
        cancelled: returns True when the user stops the job.
    Returns:
        The motion with its model, the cleaned trial, the release and the warnings.
    Raises:
        InputError: if the markers belong to no known set, the static or the model is of another body or set, the
            markers are mirrored, or too few markers are visible.
        UserCancelledError: if the user stops the job.
    """
    with limit_to_one_thread():  # several threads also slow small systems down
        return _reconstruct_on_one_thread(trial, static, model, settings=settings,
                                          monitor=_RunMonitor(progress, cancelled), cancelled=cancelled)


def _reconstruct_on_one_thread(trial, static, model, settings: ReconstructSettings, monitor: _RunMonitor,
                               cancelled) -> Reconstruction:
    """Run `reconstruct` on a single thread."""
    with monitor.time_step("clean", 0.1):
        marker_set = find_marker_set(trial, model, settings.marker_set)
        visible, still = (None if one is None else prepare_trial(one, marker_set) for one in (trial, static))
        if model is not None:
            check_model_fits(model, visible)
        monitor.add_warnings(check_prepared_trial(visible, still, marker_set, model))
        cleaned = clean_prepared_trial(visible, marker_set, model, monitor.build_inner_progress(0.0, 0.1), cancelled)
        # long filled gaps are for display, not evidence for the pose
        clean_markers, evidence = cleaned.trial, cleaned.build_pose_trial()
        monitor.add_warnings(cleaned.report.lines)
    with monitor.time_step("model", 0.45):
        if model is None:
            inner_progress = monitor.build_inner_progress(0.1, 0.45)
            model = _calibrate_model(marker_set, evidence, still, inner_progress, cancelled)
            monitor.add_warnings(model.notes)
    with monitor.time_step("pose", 0.85):
        solved = _solve_pose(model, evidence, marker_set, settings=settings, monitor=monitor, cancelled=cancelled)
        monitor.add_warnings([*solved.notes, *_describe_poor_fit(solved, model)])
    with monitor.time_step("filter", 0.92):
        motion, held = _filter_motion(solved, model, visible, settings, monitor)
        monitor.add_warnings(describe_foot_slide(motion, held is not None))
    with monitor.time_step("floor", 0.94):
        floor = _measure_floor(model, clean_markers, settings, monitor)
        down = floor if settings.floor else 0.0
        motion, clean_markers, visible = move_down(motion, down), move_trial_down(clean_markers,
                                                                                   down), move_trial_down(visible,
                down)
    with monitor.time_step("release", 1.0):
        release = _find_release(visible, motion, model, marker_set=marker_set, settings=settings, monitor=monitor)
    return Reconstruction(motion=motion, model=model, trial=clean_markers, raw=trial, solved=solved, cleaned=cleaned,
                          release=release, held=held, floor=floor, grounded=settings.floor, seconds=monitor.seconds,
                          warnings=tuple(monitor.warnings))


class _RunMonitor:
    """Collect progress, the seconds of each step and the warnings of a run, and check for cancellation."""

    def __init__(self, progress, cancelled):
        self._progress, self._cancelled = progress, cancelled
        self._done = 0.0
        self.seconds: dict[str, float] = {}
        self.warnings: list[str] = []

    @contextmanager
    def time_step(self, name: str, until: float):
        """Time one step; `until` is the share of the whole that is done after it."""
        self.check_cancelled()
        if self._progress:
            self._progress(self._done, name)
        began = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - began
        self._done = until

    def build_inner_progress(self, low: float, high: float) -> Progress | None:
        """Return a progress callback that maps 0 to 1 onto `low` to `high` of the whole, or None."""
        if self._progress is None:
            return None

        def report(fraction: float, text: str = "") -> None:
            self._progress(low + (high - low) * fraction, text)

        return report

    def add_warnings(self, lines) -> None:
        """Add messages, each only once."""
        self.warnings += [line for line in lines if line not in self.warnings]

    def check_cancelled(self) -> None:
        """Raise UserCancelledError if the user has stopped the job."""
        if self._cancelled is not None and self._cancelled():
            raise UserCancelledError("cancelled")


def build_model(trial: MarkerTrial, static: MarkerTrial | None, settings: ReconstructSettings = ReconstructSettings(),
                progress: Progress | None = None, cancelled: Callable[[], bool] | None = None) -> MarkerModel:
    """Build the model alone, as `reconstruct` does.

    Args:
        trial: the recorded markers.
        static: a static trial of the same body, or None.
        settings: the options.
        progress: called with the share that is done and a text.
        cancelled: returns True when the user stops the job.
    Returns:
        The calibrated model.
    Raises:
        InputError, UserCancelledError: as `reconstruct`.
    """
    marker_set = find_marker_set(trial, None, settings.marker_set)
    visible, still = (None if one is None else prepare_trial(one, marker_set) for one in (trial, static))
    check_prepared_trial(visible, still, marker_set, None)
    evidence = clean_prepared_trial(visible, marker_set, None, cancelled=cancelled).build_pose_trial()
    return _calibrate_model(marker_set, evidence, still, progress, cancelled)


def _calibrate_model(marker_set, trial, still, progress, cancelled) -> MarkerModel:
    """Clean the static trial and calibrate the model; on failure add the markers that it lacks to the message."""
    from .model.calibrate import calibrate

    if still is not None:
        still = clean_prepared_trial(still, marker_set, None, cancelled=cancelled).build_pose_trial()
    try:
        return calibrate(marker_set, trial, still, progress=progress, cancelled=cancelled)
    except InputError as error:
        lacking = [] if still is None else [label for label in trial.labels if label not in still.labels]
        if not lacking:
            raise
        raise InputError(still.name, f"{error}; markers missing in it: {format_some(lacking)}") from None


def _solve_pose(model: MarkerModel, trial: MarkerTrial, marker_set, settings, monitor: _RunMonitor,
                cancelled) -> PoseSolution:
    """Solve the poses; with a held ball, first without it to find where it lies in the hand, then with it."""
    pose_settings = PoseSettings(weights=settings.weights, limits=settings.limits, smoothness=settings.smoothness)
    label = _find_ball_label(model, marker_set, trial) if settings.hold_ball else None
    solved = solve_poses(model, trial, pose_settings, monitor.build_inner_progress(0.45, 0.85 if label is None
                                                                                   else 0.65), cancelled)
    if label is None:
        if settings.hold_ball:
            monitor.add_warnings(["no marker on a ball, so no ball is held"])
        return solved
    release = _find_release(trial, solved.motion, model, marker_set=marker_set,
                            settings=replace(settings, release="auto"), monitor=monitor)
    if release is None or release.method != "ball":
        monitor.add_warnings([f"{label} does not show how the ball is held, so it takes no part in the pose"])
        return solved
    hand = f"{release.side.capitalize()}Hand"
    held = np.arange(len(trial)) < release.frame
    ball = HeldBall(joint=hand, centre=release.centre, radius=release.radius,
                    seen=trial.positions[:, trial.index_of(label)], held=held)
    return solve_poses(model, trial, replace(pose_settings, ball=ball), monitor.build_inner_progress(0.65, 0.85),
                       cancelled)


def _describe_poor_fit(solved: PoseSolution, model: MarkerModel) -> list[str]:
    """Report markers that do not fit the model, overall or one by one."""
    seen = np.isfinite(solved.residual)
    if not seen.any():
        return []
    mean = float(solved.residual[seen].mean())
    count = np.maximum(seen.sum(axis=0), 1)
    each = np.where(seen, solved.residual, 0.0).sum(axis=0) / count
    worst = [i for i in np.argsort(-each)[:4] if each[i] > _POOR_MARKER_RESIDUAL]
    if mean <= _POOR_MEAN_RESIDUAL and not worst:
        return []
    details = ", ".join(f"{model.markers[i]} {1000.0 * each[i]:.0f}" for i in worst)
    off = f"markers are {1000.0 * mean:.0f} mm off on average" + (f" (mm: {details})" if details else "")
    return [f"{off}: check that model, static and marker set belong to this body and that no labels are exchanged"]


def _find_ball_label(model: MarkerModel, marker_set, trial: MarkerTrial) -> str | None:
    """Return the first ball marker of the model or its set that the trial contains, or None."""
    labels = ((model.ball.label,) if model.ball else ()) + (() if marker_set is None else marker_set.ball)
    return next((label for label in labels if label in trial.labels), None)


def _filter_motion(solved: PoseSolution, model: MarkerModel, trial: MarkerTrial, settings, monitor: _RunMonitor):
    """Apply both filters; return the motion and which foot points are held. `trial` must have its gaps unfilled."""
    from .pose.low_pass import filter_butterworth, smooth_kalman
    from .pose.plant_filter import filter_foot_plants

    motion = solved.motion
    if settings.filter == "butterworth":
        out = filter_butterworth(motion, settings.cutoff)
    elif settings.filter == "kalman":
        out = smooth_kalman(motion, measure_marker_visibility(model, trial), settings.cutoff)
    if settings.filter != "none":
        motion = out.motion
        monitor.add_warnings(out.notes)
    if not (settings.plant and _has_legs(motion)):
        return motion, None
    planted = filter_foot_plants(motion)
    return planted.motion, planted.held


def _has_legs(motion: Motion) -> bool:
    """Return whether the skeleton has the legs that the foot-plant filter needs."""
    from ..motion.humanoid import identify_joints

    try:
        identify_joints(motion.skeleton)
    except InputError:
        return False
    return True


def _measure_floor(model: MarkerModel, trial: MarkerTrial, settings: ReconstructSettings,
                   monitor: _RunMonitor) -> float:
    """Measure the floor height in metres, and report it where it is not at 0."""
    floor = measure_floor(model, trial)
    if abs(floor) > _REPORTED_FLOOR_HEIGHT:
        done = "markers and motion were moved so that it is at 0" if settings.floor else "use Floor at 0 to move it"
        monitor.add_warnings([f"the floor is at {floor:+.3f} m; {done}"])
    return floor


def move_down(motion: Motion, by: float) -> Motion:
    """Return the motion moved down by `by` metres."""
    return replace(motion, root_positions=motion.root_positions - [0.0, 0.0, by]) if by else motion


def move_trial_down(trial: MarkerTrial, by: float) -> MarkerTrial:
    """Return the trial moved down by `by` metres."""
    return trial.with_positions(trial.positions - [0.0, 0.0, by]) if by else trial


def _find_release(trial, motion, model: MarkerModel, marker_set, settings: ReconstructSettings, monitor: _RunMonitor):
    """Find when and how the ball leaves the hand, where the settings ask for it; a model with a ball says where it
    lies.
    """
    from .release.radar_speed import parse_radar_speed
    from .release.release import ReleaseSettings, estimate_release

    label = _find_ball_label(model, marker_set, trial)
    is_throw = label is not None or parse_radar_speed(trial.name) is not None
    if settings.release == "no" or (settings.release == "auto" and not is_throw):
        return None
    release_settings = ReleaseSettings(label, settings.radius, ball=settings.ball)
    if model.ball is not None and model.ball.label == label:
        side = "left" if model.skeleton.names[model.ball.joint].startswith("Left") else "right"
        release_settings = replace(release_settings, radius=release_settings.radius or model.ball.radius, hand=side,
                                   centre=model.ball.centre)
    try:
        return estimate_release(trial, motion, release_settings)
    except InputError as error:
        monitor.add_warnings([f"no release found: {error}"])
        return None
