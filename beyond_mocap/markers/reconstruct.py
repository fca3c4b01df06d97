"""Reconstruct a moving skeleton from optical markers (Fredriksson section 5).

The steps: label and clean the markers, build or take a model, solve the poses, filter the motion, estimate the floor
and, for throws, the release of the ball.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from .. import __version__
from ..base.errors import Cancelled, InputError
from ..base.settings import defaults, setting
from ..motion.motion import Motion
from .cleaning.clean import Cleaned, clean
from .model.model import MarkerModel
from .pose.pose import HeldBall, PoseSettings, Solved, solve
from .pose.residuals import floor_under, seen_markers
from .trial import MarkerTrial, evenly, list_some

_DEFAULTS = defaults("markers")
FILTERS = setting("markers", "filter").choice_names
RELEASES = setting("markers", "release").choice_names
_SMOOTHNESS = setting("markers", "smoothness")
LEAST_MARKERS = 0.5  # share of a model's markers that a trial must contain
_TOLD_FLOOR = 0.02  # metres from height 0 beyond which the floor height is reported
# Mean residuals in metres above which the fit is reported as poor: over all markers, and of one marker.
_FAR_MEAN, _FAR_MARKER = 0.015, 0.04

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
            raise InputError("smoothness", f"{self.smoothness} s", _SMOOTHNESS.limits_text(least, most))


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
    solved: Solved
    cleaned: Cleaned
    release: object | None = None
    held: np.ndarray | None = None
    floor: float = 0.0
    grounded: bool = False
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def lowered(self) -> float:
        """Metres by which motion and trial are lower than the recorded markers."""
        return self.floor if self.grounded else 0.0

    def on_floor(self) -> Motion:
        """Return the motion with its floor at height 0, as clips of a library have it."""
        return self.motion if self.grounded else moved_down(self.motion, self.floor)

    def report(self) -> dict:
        """Return the figures of the reconstruction, as values for JSON."""
        from .reconstruction_figures import figures

        return {"version": __version__, **figures(self)}


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
        Cancelled: if the user stops the job.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):  # same bits on every machine; several threads slow small systems down
        return _reconstruct(trial, static, model, settings=settings, road=_Road(progress, cancelled),
                            cancelled=cancelled)


def _reconstruct(trial, static, model, settings: ReconstructSettings, road: _Road, cancelled) -> Reconstruction:
    """Run `reconstruct` on a single thread."""
    with road.step("clean", 0.1):
        marker_set = set_of(trial, model, settings)
        seen, still = (None if one is None else named_evenly(one, marker_set) for one in (trial, static))
        if model is not None:
            _check_fits(model, seen)
        road.tell(_checked(seen, still, marker_set, model))
        cleaned = _tidied(seen, marker_set, model, road.inner(0.0, 0.1), cancelled)
        tidy, told = cleaned.trial, cleaned.for_pose()  # long filled gaps are for display, not evidence for the pose
        road.tell(cleaned.report.lines)
    with road.step("model", 0.45):
        if model is None:
            still = None if still is None else _tidied(still, marker_set, None, None, cancelled).for_pose()
            model = _calibrated(marker_set, told, still, road.inner(0.1, 0.45), cancelled)
            road.tell(model.notes)
    with road.step("pose", 0.85):
        solved = _posed(model, told, marker_set, settings=settings, road=road, cancelled=cancelled)
        road.tell([*solved.notes, *_far_off(solved, model)])
    with road.step("filter", 0.92):
        motion, held = _filtered(solved, model, seen, settings, road)
    with road.step("floor", 0.94):
        floor = _floor(model, tidy, settings, road)
        down = floor if settings.floor else 0.0
        motion, tidy, seen = moved_down(motion, down), _lowered(tidy, down), _lowered(seen, down)
    with road.step("release", 1.0):
        found = _release(seen, motion, model, marker_set=marker_set, settings=settings, road=road)
    return Reconstruction(motion=motion, model=model, trial=tidy, raw=trial, solved=solved, cleaned=cleaned,
                          release=found, held=held, floor=floor, grounded=settings.floor, seconds=road.seconds,
                          warnings=tuple(road.warnings))


class _Road:
    """Collect progress, the seconds of each step and the warnings of a run, and check for cancellation."""

    def __init__(self, progress, cancelled):
        self._progress, self._cancelled = progress, cancelled
        self._done = 0.0
        self.seconds: dict[str, float] = {}
        self.warnings: list[str] = []

    @contextmanager
    def step(self, name: str, until: float):
        """Time one step; `until` is the share of the whole that is done after it."""
        self.check()
        if self._progress:
            self._progress(self._done, name)
        begun = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - begun
        self._done = until

    def inner(self, low: float, high: float) -> Progress | None:
        """Return a progress callback that maps 0 to 1 onto `low` to `high` of the whole, or None."""
        if self._progress is None:
            return None

        def report(fraction: float, text: str = "") -> None:
            self._progress(low + (high - low) * fraction, text)

        return report

    def tell(self, lines) -> None:
        """Add messages, each only once."""
        self.warnings += [line for line in lines if line not in self.warnings]

    def check(self) -> None:
        """Raise Cancelled if the user has stopped the job."""
        if self._cancelled is not None and self._cancelled():
            raise Cancelled("cancelled")


def set_of(trial: MarkerTrial, model: MarkerModel | None, settings: ReconstructSettings):
    """Find the marker set of a trial.

    Args:
        trial: the recorded markers.
        model: a given model, or None.
        settings: the options; a chosen marker set wins.
    Returns:
        The chosen set, the model's own or the shipped one that fits; None for a model of a set that is not shipped.
    Raises:
        InputError: if no shipped set fits the labels.
    """
    if settings.marker_set is not None:
        return settings.marker_set
    from .files.marker_set_text import shipped_sets
    from .model.marker_set import recognise

    sets = shipped_sets()
    if model is not None:
        return next((one for one in sets if one.name == model.set_name), None)
    try:
        return recognise(trial.labels, sets)
    except InputError as error:
        raise InputError(trial.name, str(error)) from None  # labels carry no file name


def named_by(trial: MarkerTrial, marker_set) -> MarkerTrial:
    """Return the trial with the set's own labels; unchanged if `marker_set` is None."""
    from .model.marker_set import named_as

    return trial if marker_set is None else named_as(trial, marker_set)


def clusters_of(marker_set, model: MarkerModel | None, trial: MarkerTrial) -> dict[str, tuple[str, ...]]:
    """Collect the clusters of markers that each segment carries.

    Args:
        marker_set: the marker set, or None to use the clusters of the model.
        model: the model; needed if `marker_set` is None.
        trial: the recorded markers.
    Returns:
        Segment name -> labels of its markers that the trial contains.
    """
    if marker_set is not None:
        return marker_set.clusters(trial.labels)
    names = model.skeleton.names
    found = {names[joint]: tuple(model.markers[i] for i in rows if model.markers[i] in trial.labels)
             for joint, rows in model.clusters().items()}
    return {name: labels for name, labels in found.items() if labels}


def _checked(trial, still, marker_set, model) -> tuple[str, ...]:
    """Report missing and unused markers; raise InputError for mirrored markers or the static of another person."""
    from .checks import check, unused

    clusters = clusters_of(marker_set, model, trial)
    others = () if marker_set is None else (*marker_set.ball, *marker_set.other)
    lacking = () if marker_set is None or model is not None else marker_set.lacking(trial.labels)
    gone = [f"markers of the set {marker_set.name} are missing: {list_some(lacking)}"] if lacking else []
    return (*gone, *unused(trial, clusters, others), *check(trial, still, clusters, model))


def modelled(trial: MarkerTrial, static: MarkerTrial | None, settings: ReconstructSettings = ReconstructSettings(),
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
        InputError, Cancelled: as `reconstruct`.
    """
    marker_set = set_of(trial, None, settings)
    seen, still = (None if one is None else named_evenly(one, marker_set) for one in (trial, static))
    _checked(seen, still, marker_set, None)
    tidy, still = (None if one is None else _tidied(one, marker_set, None, None, cancelled).for_pose()
                   for one in (seen, still))
    return _calibrated(marker_set, tidy, still, progress, cancelled)


def named_evenly(trial: MarkerTrial, marker_set) -> MarkerTrial:
    """Return the trial with the set's labels and evenly spaced frames."""
    return evenly(named_by(trial, marker_set))


def _tidied(trial: MarkerTrial, marker_set, model, progress, cancelled) -> Cleaned:
    """Clean a trial that has the set's labels."""
    return clean(trial, clusters_of(marker_set, model, trial), progress=progress, cancelled=cancelled)


def _calibrated(marker_set, trial, still, progress, cancelled) -> MarkerModel:
    """Calibrate the model; on failure add the markers that the static trial lacks to the message."""
    from .model.calibrate import calibrate

    try:
        return calibrate(marker_set, trial, still, progress=progress, cancelled=cancelled)
    except InputError as error:
        lacking = [] if still is None else [label for label in trial.labels if label not in still.labels]
        if not lacking:
            raise
        raise InputError(still.name, f"{error}; markers missing in it: {list_some(lacking)}") from None


def _check_fits(model: MarkerModel, trial: MarkerTrial) -> None:
    """Raise InputError if the trial contains fewer than half of the model's markers."""
    lacking = [label for label in model.markers if label not in trial.labels]
    if len(lacking) > (1.0 - LEAST_MARKERS) * len(model.markers):
        found = f"has {len(model.markers) - len(lacking)} of the model's {len(model.markers)} markers"
        raise InputError(trial.name, f"{found}, not {list_some(lacking)}", "a trial with the model's markers",
                         "choose another model, or the marker set that has these labels")


def _posed(model: MarkerModel, trial: MarkerTrial, marker_set, settings, road: _Road, cancelled) -> Solved:
    """Solve the poses; with a held ball, first without it to find where it lies in the hand, then with it."""
    how = PoseSettings(weights=settings.weights, limits=settings.limits, smoothness=settings.smoothness)
    label = _ball_label(model, marker_set, trial) if settings.hold_ball else None
    solved = solve(model, trial, how, road.inner(0.45, 0.85 if label is None else 0.65), cancelled)
    if label is None:
        if settings.hold_ball:
            road.tell(["no marker on a ball, so no ball is held"])
        return solved
    found = _release(trial, solved.motion, model, marker_set=marker_set, settings=replace(settings, release="auto"),
                     road=road)
    if found is None or found.how != "ball":
        road.tell([f"{label} does not show how the ball is held, so it takes no part in the pose"])
        return solved
    hand = f"{found.side.capitalize()}Hand"
    held = np.arange(len(trial)) < found.frame
    ball = HeldBall(joint=hand, centre=found.centre, radius=found.radius, seen=trial.positions[:, trial.index(label)],
                    held=held)
    return solve(model, trial, replace(how, ball=ball), road.inner(0.65, 0.85), cancelled)


def _far_off(solved: Solved, model: MarkerModel) -> list[str]:
    """Report markers that do not fit the model, overall or one by one."""
    seen = np.isfinite(solved.residual)
    if not seen.any():
        return []
    mean = float(solved.residual[seen].mean())
    count = np.maximum(seen.sum(axis=0), 1)
    each = np.where(seen, solved.residual, 0.0).sum(axis=0) / count
    worst = [i for i in np.argsort(-each)[:4] if each[i] > _FAR_MARKER]
    if mean <= _FAR_MEAN and not worst:
        return []
    told = ", ".join(f"{model.markers[i]} {1000.0 * each[i]:.0f}" for i in worst)
    off = f"markers are {1000.0 * mean:.0f} mm off on average" + (f" (mm: {told})" if told else "")
    return [f"{off}: check that model, static and marker set belong to this body and that no labels are exchanged"]


def _ball_label(model: MarkerModel, marker_set, trial: MarkerTrial) -> str | None:
    """Return the first ball marker of the model or its set that the trial contains, or None."""
    labels = ((model.ball.label,) if model.ball else ()) + (() if marker_set is None else marker_set.ball)
    return next((label for label in labels if label in trial.labels), None)


def _filtered(solved: Solved, model: MarkerModel, trial: MarkerTrial, settings, road: _Road):
    """Apply both filters; return the motion and which foot points are held. `trial` must have its gaps unfilled."""
    from .pose.low_pass import butterworth, kalman
    from .pose.plant_filter import plant_filter

    motion = solved.motion
    if settings.filter == "butterworth":
        out = butterworth(motion, settings.cutoff)
    elif settings.filter == "kalman":
        out = kalman(motion, told_by_markers(model, trial), settings.cutoff)
    if settings.filter != "none":
        motion = out.motion
        road.tell(out.notes)
    if not (settings.plant and _has_legs(motion)):
        return motion, None
    planted = plant_filter(motion)
    return planted.motion, planted.held


def told_by_markers(model: MarkerModel, trial: MarkerTrial) -> np.ndarray:
    """Measure which share of each joint's own markers is visible.

    Args:
        model: the model with M markers on J joints.
        trial: the recorded markers, T frames.
    Returns:
        (T, J) shares, 0 to 1; 1 for joints that carry no marker.
    """
    seen = np.isfinite(seen_markers(model, trial)).all(axis=-1)
    worth = np.ones((len(trial), len(model.skeleton)))
    for joint, rows in model.clusters().items():
        worth[:, joint] = seen[:, rows].mean(axis=1)
    return worth


def _has_legs(motion: Motion) -> bool:
    """Return whether the skeleton has the legs that the foot-plant filter needs."""
    from ..motion.humanoid import identify

    try:
        identify(motion.skeleton)
    except InputError:
        return False
    return True


def _floor(model: MarkerModel, trial: MarkerTrial, settings: ReconstructSettings, road: _Road) -> float:
    """Measure the floor height in metres, and report it where it is not at 0."""
    floor = floor_under(model, trial)
    if abs(floor) > _TOLD_FLOOR:
        done = "markers and motion were moved so that it is at 0" if settings.floor else "use Floor at 0 to move it"
        road.tell([f"the floor is at {floor:+.3f} m; {done}"])
    return floor


def moved_down(motion: Motion, by: float) -> Motion:
    """Return the motion moved down by `by` metres."""
    return replace(motion, root_positions=motion.root_positions - [0.0, 0.0, by]) if by else motion


def _lowered(trial: MarkerTrial, by: float) -> MarkerTrial:
    """Return the trial moved down by `by` metres."""
    return trial.with_positions(trial.positions - [0.0, 0.0, by]) if by else trial


def _release(trial, motion, model: MarkerModel, marker_set, settings: ReconstructSettings, road: _Road):
    """Find when and how the ball leaves the hand, where the settings ask for it; a model with a ball says where it
    lies.
    """
    from .release.release import ReleaseSettings, radar_speed, release

    label = _ball_label(model, marker_set, trial)
    told = label is not None or radar_speed(trial.name) is not None
    if settings.release == "no" or (settings.release == "auto" and not told):
        return None
    asked = ReleaseSettings(label, settings.radius, ball=settings.ball)
    if model.ball is not None and model.ball.label == label:
        side = "left" if model.skeleton.names[model.ball.joint].startswith("Left") else "right"
        asked = replace(asked, radius=asked.radius or model.ball.radius, hand=side, centre=model.ball.centre)
    try:
        return release(trial, motion, asked)
    except InputError as error:
        road.tell([f"no release found: {error}"])
        return None
