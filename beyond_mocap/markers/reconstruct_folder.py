"""Reconstruct a folder of trials: find statics and sessions, and build one model for all trials of a subject.

The files of a folder are one session; where it has folders below, each of these is one. A static trial is recognised by
its name, and serves the trials of its session that have its markers and body. Trials with the same static share the
model that is built from it, and the models of several sessions of one subject get one skeleton (Fredriksson section
5.2.3). Trials without a static are modelled from their own motion.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..base.errors import BeyondMocapError, InputError, UserCancelledError
from .checks import check_trial
from .model.model import MarkerModel
from .reconstruct import Reconstruction, ReconstructSettings, build_model, reconstruct
from .trial import MarkerTrial
from .trial_preparation import apply_set_labels, find_marker_set

SUFFIXES = (".c3d", ".trc")
_STATIC = re.compile(r"static|calib|(^|[^a-z])cal([^a-z]|$)|[tna][-_ ]?pose|standing", re.IGNORECASE)
_MIN_SHARED_MARKERS = 0.8  # share of a trial's markers that its static must have

ReadTrial = Callable[[Path], MarkerTrial]


@dataclass(frozen=True)
class Recording:
    """One file of a folder.

    Attributes:
        path: the file.
        name: name of its results, with its session in front.
        session: its folder relative to the given one; "" for the given folder itself.
    """

    path: Path
    name: str
    session: str

    @property
    def is_static(self) -> bool:
        """Whether the file name says that the body only stands."""
        return bool(_STATIC.search(self.path.stem))


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialOutcome:
    """The outcome for one trial.

    Attributes:
        recording: the file.
        reconstruction: the result; None where it failed.
        error: why it failed, or "".
        static: its static trial, or None.
        note: why a static that exists is not used, or "".
    """

    recording: Recording
    reconstruction: Reconstruction | None
    error: str = ""
    static: Recording | None = None
    note: str = ""


def list_recordings(folder: Path) -> list[Recording]:
    """List all marker recordings in a folder and below it, by name.

    Raises:
        InputError: if there are none.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES and path.is_file())
    if not paths:
        raise InputError(folder, "contains no .c3d or .trc file", "recordings of markers", "choose another folder")
    bare = [path.relative_to(folder).with_suffix("").as_posix() for path in paths]
    names = [name if bare.count(name) == 1 else name + path.suffix.lower().replace(".", "_")
             for name, path in zip(bare, paths)]
    sessions = [path.parent.relative_to(folder).as_posix() for path in paths]
    return [Recording(path, name, session.removeprefix(".")) for path, name, session in zip(paths, names, sessions)]


def reconstruct_folder(folder: Path, read: ReadTrial, settings: ReconstructSettings = ReconstructSettings(),
                       model: MarkerModel | None = None, progress: Callable[[float, str], None] | None = None,
                       cancelled: Callable[[], bool] | None = None) -> Iterator[TrialOutcome]:
    """Reconstruct every trial of a folder, one after the other; a trial that fails is reported and does not stop the
    others.

    Args:
        folder: the folder with the recordings.
        read: reads one file.
        settings: the options.
        model: a model for all trials, instead of models built from them.
        progress: called with the share that is done and a text.
        cancelled: returns True when the user stops the job.
    Yields:
        The outcome of each trial.
    Raises:
        InputError: if the folder has no trials.
        UserCancelledError: if the user stops the job.
    """
    recordings = list_recordings(folder)
    statics, trials = _split_statics(recordings, read)
    plans = [_plan_trial(one, read, statics if model is None else [], settings) for one in trials]
    models = _build_models(plans, read, settings, cancelled)
    for number, plan in enumerate(plans):
        if cancelled is not None and cancelled():
            raise UserCancelledError("cancelled")
        part = _build_trial_progress(progress, number, len(plans), plan.recording.name)
        yield _reconstruct_trial(plan, read, settings, model=model or models.get(plan.static_path), progress=part,
                                 cancelled=cancelled)


@dataclass(frozen=True, eq=False, kw_only=True)
class _TrialPlan:
    """What is planned for one trial.

    Attributes:
        recording: the file.
        static: its static recording with the trial read from it, or None.
        error: why the trial cannot be read, or "".
        subject: whose markers these are.
        note: why a static is not used, or "".
    """

    recording: Recording
    static: tuple[Recording, MarkerTrial] | None = None
    error: str = ""
    subject: str = field(default="")
    note: str = ""

    @property
    def static_path(self) -> Path | None:
        """Path of the static trial, or None."""
        return None if self.static is None else self.static[0].path


def _split_statics(recordings: Sequence[Recording], read: ReadTrial):
    """Split the recordings into statics, read, and trials.

    If all names are those of statics, they are trials too. A static that cannot be read is treated as a trial, so that
    its error is reported.
    """
    if all(one.is_static for one in recordings):
        return [], list(recordings)
    statics, trials = [], []
    for one in recordings:
        if not one.is_static:
            trials.append(one)
            continue
        try:
            statics.append((one, read(one.path)))
        except (BeyondMocapError, OSError):
            trials.append(one)
    return statics, trials


def _plan_trial(one: Recording, read: ReadTrial, statics, settings: ReconstructSettings) -> _TrialPlan:
    """Read a trial and choose its static."""
    try:
        trial = read(one.path)
        static, note = _choose_static(one, trial, statics, settings)
        return _TrialPlan(recording=one, static=static, subject=trial.subject, note=note)
    except (BeyondMocapError, OSError) as error:
        return _TrialPlan(recording=one, error=str(error))


def _choose_static(one: Recording, trial: MarkerTrial, statics, settings):
    """Choose the static of a trial: same session, markers and body; of several, the one with the most similar name.

    Returns the static or None, and a message on a static that is of another body, or "".
    """
    if not statics:
        return None, ""
    marker_set = find_marker_set(trial, None, settings.marker_set)
    labeled_trial = apply_set_labels(trial, marker_set)
    required = set(labeled_trial.labels) & set(marker_set.labels)
    candidates, note = [], ""
    for recording, static in statics:
        labeled_static = apply_set_labels(static, marker_set)
        shared = len(required & set(labeled_static.labels)) / max(len(required), 1)
        same_name = not (trial.subject and static.subject and trial.subject != static.subject)
        if recording.session != one.session or not same_name or shared < _MIN_SHARED_MARKERS:
            continue
        try:
            check_trial(labeled_trial, labeled_static, marker_set.select_clusters(labeled_trial.labels))
        except InputError as error:
            note = f"reconstructed without a static: {error}"
            continue
        candidates.append((len(os.path.commonprefix([recording.path.stem, one.path.stem])), shared,
                           (recording, static)))
    return (max(candidates, key=lambda row: row[:2])[2], "") if candidates else (None, note)


def _build_models(plans: Sequence[_TrialPlan], read: ReadTrial, settings, cancelled) -> dict[Path, MarkerModel]:
    """Build one model for each static, from the first trial that it serves; sessions of one subject get one
    skeleton.
    """
    first = {plan.static_path: plan for plan in reversed(plans) if plan.static is not None}
    models: dict[Path, MarkerModel] = {}
    for path, plan in reversed(first.items()):
        try:
            models[path] = build_model(read(plan.recording.path), plan.static[1], settings, cancelled=cancelled)
        except (InputError, OSError):
            continue  # the error is reported when its trials are reconstructed
    groups: dict[tuple, list[Path]] = {}
    for path, own in models.items():
        groups.setdefault((first[path].subject, own.set_name, own.skeleton.names), []).append(path)
    for paths in groups.values():
        if len({first[path].recording.session for path in paths}) > 1:
            from .model.assemble import merge_session_models

            models.update(zip(paths, merge_session_models([models[path] for path in paths])))
    return models


def _reconstruct_trial(plan: _TrialPlan, read: ReadTrial, settings, model, progress, cancelled) -> TrialOutcome:
    """Reconstruct one trial; errors other than a cancellation become part of the outcome."""
    if plan.error:
        return TrialOutcome(recording=plan.recording, reconstruction=None, error=plan.error)
    static, still = plan.static or (None, None)
    try:
        reconstruction = reconstruct(read(plan.recording.path), still, model, settings=settings, progress=progress,
                                     cancelled=cancelled)
    except UserCancelledError:
        raise
    except (BeyondMocapError, OSError) as error:
        return TrialOutcome(recording=plan.recording, reconstruction=None, error=str(error), static=static)
    return TrialOutcome(recording=plan.recording, reconstruction=reconstruction, static=static, note=plan.note)


def _build_trial_progress(progress, number: int, count: int, name: str):
    """Return a progress callback for one of `count` trials, or None."""
    if progress is None:
        return None
    return lambda fraction, text="": progress((number + fraction) / count, f"{name}: {text}")
