"""From a recorded trial to one that a model can be put on: its marker set, labels, even frames, checked and cleaned."""

from __future__ import annotations

from ..base.errors import InputError, format_some
from .checks import check_trial, report_unused
from .cleaning.clean import CleaningResult, clean_trial
from .files.marker_set_text import read_shipped_sets
from .model.marker_set import choose_marker_set, convert_labels
from .model.model import MarkerModel
from .trial import MarkerTrial, resample_evenly

MIN_MARKER_SHARE = 0.5
"""Share of a model's markers that a trial must contain."""


def find_marker_set(trial: MarkerTrial, model: MarkerModel | None, chosen_set=None):
    """Find the marker set of a trial.

    Args:
        trial: the recorded markers.
        model: a given model, or None.
        chosen_set: the set that the user chose, or None.
    Returns:
        The chosen set, the model's own or the shipped one that fits; None for a model of a set that is not shipped.
    Raises:
        InputError: if no shipped set fits the labels.
    """
    if chosen_set is not None:
        return chosen_set
    sets = read_shipped_sets()
    if model is not None:
        return next((one for one in sets if one.name == model.set_name), None)
    try:
        return choose_marker_set(trial.labels, sets)
    except InputError as error:
        raise InputError(trial.name, str(error)) from None  # labels carry no file name


def prepare_trial(trial: MarkerTrial, marker_set) -> MarkerTrial:
    """Return the trial with the set's labels and evenly spaced frames.

    Args:
        trial: the recorded markers.
        marker_set: the chosen set; None: labels stay.
    Returns:
        The prepared trial.
    """
    return resample_evenly(apply_set_labels(trial, marker_set))


def apply_set_labels(trial: MarkerTrial, marker_set) -> MarkerTrial:
    """Return the trial with the set's own labels; unchanged if `marker_set` is None."""
    return trial if marker_set is None else convert_labels(trial, marker_set)


def collect_clusters(marker_set, model: MarkerModel | None, trial: MarkerTrial) -> dict[str, tuple[str, ...]]:
    """Collect the clusters of markers that each segment carries.

    Args:
        marker_set: the marker set, or None to use the clusters of the model.
        model: the model; needed if `marker_set` is None.
        trial: the recorded markers.
    Returns:
        Segment name -> labels of its markers that the trial contains.
    """
    if marker_set is not None:
        return marker_set.select_clusters(trial.labels)
    names = model.skeleton.names
    found = {names[joint]: tuple(model.markers[i] for i in rows if model.markers[i] in trial.labels)
             for joint, rows in model.collect_clusters().items()}
    return {name: labels for name, labels in found.items() if labels}


def clean_prepared_trial(trial: MarkerTrial, marker_set, model: MarkerModel | None, progress=None,
                         cancelled=None) -> CleaningResult:
    """Clean a prepared trial.

    Args:
        trial: the markers, with the set's labels.
        marker_set: the marker set, or None to use the clusters of the model.
        model: the model; needed if `marker_set` is None.
        progress: called with the share that is done and a text.
        cancelled: returns True when the user stops the job.
    Returns:
        The cleaned trial, and the report on what was changed.
    Raises:
        UserCancelledError: if the user stops the job.
    """
    return clean_trial(trial, collect_clusters(marker_set, model, trial), progress=progress, cancelled=cancelled)


def check_prepared_trial(trial: MarkerTrial, still: MarkerTrial | None, marker_set,
                         model: MarkerModel | None) -> tuple[str, ...]:
    """Check a prepared trial for missing and unused markers, and for those of another body.

    Args:
        trial: the markers, with the set's labels.
        still: the prepared static trial, or None.
        marker_set: the marker set, or None to use the clusters of the model.
        model: a given model, or None.
    Returns:
        Messages on what is unusual.
    Raises:
        InputError: for mirrored markers, or a static or model of another body.
    """
    clusters = collect_clusters(marker_set, model, trial)
    others = () if marker_set is None else (*marker_set.ball, *marker_set.other)
    lacking = () if marker_set is None or model is not None else marker_set.list_missing(trial.labels)
    missing = [f"markers of the set {marker_set.name} are missing: {format_some(lacking)}"] if lacking else []
    return (*missing, *report_unused(trial, clusters, others), *check_trial(trial, still, clusters, model))


def check_model_fits(model: MarkerModel, trial: MarkerTrial) -> None:
    """Check that a trial contains enough of a model's markers.

    Args:
        model: the model.
        trial: the markers, with the set's labels.
    Raises:
        InputError: if they are fewer than MIN_MARKER_SHARE of the model's.
    """
    lacking = [label for label in model.markers if label not in trial.labels]
    if len(lacking) > (1.0 - MIN_MARKER_SHARE) * len(model.markers):
        found = f"has {len(model.markers) - len(lacking)} of the model's {len(model.markers)} markers"
        raise InputError(trial.name, f"{found}, not {format_some(lacking)}", "a trial with the model's markers",
                         "choose another model, or the marker set that has these labels")
