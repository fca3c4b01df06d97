"""Check a trial before the fit: mirrored markers, exchanged sides, the static of another person, empty recordings.

Skin lets two markers of a segment come nearer and move apart by a centimetre, but their usual distance stays. In 21
comparisons between recordings of different bodies, a third to nine tenths of the distances within segments differed by
more than 15 mm; between a static and a walk of the same body none did, between a static and a sprint at most a fifth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ..base.errors import InputError, TimedMessage, format_some
from ..base.time_series import find_runs
from .files.unit_and_axes import measure_handedness
from .model.marker_set import UNLABELED
from .model.model import MarkerModel
from .trial import MarkerTrial

_MIRRORED_BELOW = -0.5  # handedness below which a body is mirrored (-1: surely, +1: surely not)
# metres by which a distance may differ, in addition to half of its range in the trial itself
_DISTANCE_TOLERANCE = 0.012
# Shares of differing distances from which on the markers are those of another body, or some markers were moved.
_OTHER_BODY_SHARE, _MOVED_SHARE = 0.25, 0.1
_MAX_MISSING_SHARE = 0.3  # share of the trial's markers that a static may lack
_MIN_PAIRS = 4  # with fewer distances no comparison is made
# A stretch of at least this many seconds with fewer than this share of the markers is reported.
_EMPTY_SECONDS, _EMPTY_SHARE = 0.1, 0.2


def check_trial(trial: MarkerTrial, static: MarkerTrial | None, clusters: Mapping[str, Sequence[str]],
                model: MarkerModel | None = None) -> tuple[str, ...]:
    """Check a trial and its static or model.

    Args:
        trial: the recorded markers.
        static: a static trial, or None.
        clusters: segment -> labels of its markers.
        model: a model, or None; not used with a static.
    Returns:
        Messages on what is unusual.
    Raises:
        InputError: if markers are mirrored or left and right exchanged, if static or model are of another body, or if
            no marker is visible at all.
    """
    labels = [label for group in clusters.values() for label in group if label in trial.labels]
    body = trial.select_markers(labels)
    if not body.visibility.any():
        raise InputError(trial.name, "none of the body's markers is visible", "a recorded body", "choose another file")
    _check_sides(body, static, clusters)
    lines = list(_iter_empty_stretches(body))
    if static is not None:
        if not static.visibility.any():
            raise InputError(static.name, "no marker is visible", "a static trial with the trial's markers",
                             "choose another static trial, or use none")  # fmt: skip
        lines += _check_static_complete(body, static)
        lines += _check_same_body(body, _UsualDistances(static), clusters, static.name, "the static")
    elif model is not None:
        lines += _check_same_body(body, _measure_model_distances(model), clusters, model.subject or "the model",
                                  "the model")
    return tuple(lines)


def _check_static_complete(trial: MarkerTrial, static: MarkerTrial) -> list[str]:
    """Report markers of the trial that the static lacks; raise InputError if more than 30 % are missing."""
    lacking = [label for label in trial.labels if label not in static.labels]
    if not lacking:
        return []
    names = format_some(lacking)
    if len(lacking) > _MAX_MISSING_SHARE * len(trial.labels):
        raise InputError(
            static.name,
            f"has {len(trial.labels) - len(lacking)} of the trial's {len(trial.labels)} markers, not {names}",
            "a static trial with the trial's markers", "choose another static trial, or use none",
        )
    return [f"{static.name} lacks {names}: their places are estimated from the motion"]


def report_unused(trial: MarkerTrial, clusters: Mapping[str, Sequence[str]], others: Sequence[str] = ()) -> list[str]:
    """Report labeled markers that lie on no segment.

    Args:
        trial: the recorded markers.
        clusters: segment -> labels of its markers.
        others: labels that are known to be on no body.
    Returns:
        One message, or none.
    """
    known = {label for group in clusters.values() for label in group} | set(others)
    left = [label for label in trial.labels if label not in known and not UNLABELED.match(label)]
    return [f"markers without a segment are not used: {format_some(left)}"] if left else []


def _check_sides(trial: MarkerTrial, static: MarkerTrial | None, clusters) -> None:
    """Raise InputError if trial or static are mirrored, and say what is exchanged."""
    both = [one for one in (trial, static) if one is not None]
    mirrored = [measure_handedness(one.labels, one.positions) < _MIRRORED_BELOW for one in both]
    if not any(mirrored):
        return
    name = both[mirrored.index(True)].name
    found, step = "left and right are exchanged", "exchange the left and right labels, or mirror the coordinates"
    if len(both) == 2 and not all(mirrored):
        good, bad = (static, trial) if mirrored[0] else (trial, static)
        if _has_crossed_sides(bad, good, clusters):
            found, step = "left and right labels are exchanged", "exchange L and R in its labels"
        else:
            found, step = "its coordinates are mirrored", "read it with its axes right-handed"
    expected = "a right-handed recording, left labels on the left"
    raise InputError(name, f"the body is mirrored: {found}", expected, step)


def _has_crossed_sides(bad: MarkerTrial, good: MarkerTrial, clusters) -> bool:
    """Return whether left segments of the bad trial have the shape of right ones of the good trial, not of left
    ones.
    """
    mine, own = _UsualDistances(bad), _UsualDistances(good)
    straight, crossed = [], []
    for one, other in _list_pairs(clusters):
        swapped = _swap_side(one), _swap_side(other)
        if (one, other) != swapped and all(pair in known for known in (mine, own) for pair in ((one, other), swapped)):
            straight.append(abs(mine[one, other] - own[one, other]))
            crossed.append(abs(mine[one, other] - own[swapped]))
    return bool(straight) and float(np.sum(crossed)) < float(np.sum(straight))


def _swap_side(label: str) -> str:
    """Return the label of the same marker on the other side."""
    return {"L": "R", "R": "L"}.get(label[:1], label[:1]) + label[1:]


def _list_pairs(clusters) -> list[tuple[str, str]]:
    """List the marker pairs of each segment, sorted by the labels without their first letter, so that sides compare."""
    return [tuple(sorted(two, key=lambda label: (label[1:], label)))
            for group in clusters.values() for two in combinations(group, 2)]  # fmt: skip


class _UsualDistances:
    """The usual distance of two markers in a trial, metres, computed on demand."""

    def __init__(self, trial: MarkerTrial):
        self._trial, self._index = trial, {label: i for i, label in enumerate(trial.labels)}
        self._known: dict[tuple[str, str], np.ndarray] = {}

    def measure_distances(self, pair) -> np.ndarray:
        """Return the distances in the frames that see both markers: (t,) metres."""
        if pair not in self._known:
            one, other = (self._trial.positions[:, self._index[label]] for label in pair)
            apart = np.linalg.norm(one - other, axis=-1)
            self._known[pair] = apart[np.isfinite(apart)]
        return self._known[pair]

    def __contains__(self, pair) -> bool:
        return all(label in self._index for label in pair) and len(self.measure_distances(pair)) > 0

    def __getitem__(self, pair) -> float:
        return float(np.median(self.measure_distances(pair)))


def _measure_model_distances(model: MarkerModel) -> dict[tuple[str, str], float]:
    """Measure the distances between markers that one segment of a model carries: {(label, label): metres}."""
    known = {}
    for rows in model.collect_clusters().values():
        for i, j in combinations(rows, 2):
            apart = float(np.linalg.norm(model.places[i] - model.places[j]))
            known[model.markers[i], model.markers[j]] = known[model.markers[j], model.markers[i]] = apart
    return known


def _check_same_body(trial: MarkerTrial, known, clusters, name: str, what: str) -> list[str]:
    """Compare distances within segments; report a few that differ, raise InputError if many do."""
    usual = _UsualDistances(trial)
    pairs = [pair for pair in _list_pairs(clusters) if pair in usual and pair in known]
    if len(pairs) < _MIN_PAIRS:
        return []
    off = np.array([abs(usual[pair] - known[pair]) for pair in pairs])
    tolerance = np.array([0.5 * np.subtract(*np.percentile(usual.measure_distances(pair), [90, 10])) for pair in pairs])
    wrong = off > _DISTANCE_TOLERANCE + tolerance
    share = float(wrong.mean())
    if share <= _MOVED_SHARE:
        return []
    worst = [pairs[i] for i in np.argsort(tolerance - off)[: min(3, int(wrong.sum()))]]
    examples = ", ".join(f"{a}-{b} {1000 * usual[a, b]:.0f} against {1000 * known[a, b]:.0f} mm" for a, b in worst)
    count = f"{int(wrong.sum())} of {len(pairs)} distances within segments differ from {what}'s: {examples}"
    if share >= _OTHER_BODY_SHARE:
        raise InputError(trial.name, f"{count}; {name} is of another body, or its markers were attached again",
                         f"{what} of the same body in the same session", "choose that one, or none")
    return [f"{count}; some markers may have been attached again"]


def _iter_empty_stretches(trial: MarkerTrial):
    """Report each stretch in which hardly any marker is visible."""
    few = trial.visibility.mean(axis=1) < _EMPTY_SHARE
    for first, end in find_runs(few):
        if (end - first) / trial.fps >= _EMPTY_SECONDS:
            span = trial.start + first / trial.fps, trial.start + (end - 1) / trial.fps
            count = "hardly any" if trial.visibility[first:end].any() else "no"
            yield TimedMessage(f"{count} markers from {span[0]:.2f} to {span[1]:.2f} s: the pose there is a guess",
                               span)
