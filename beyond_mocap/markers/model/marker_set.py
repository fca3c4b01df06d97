"""Marker sets: which markers lie on which segment and which anatomical points they mark.

A set has no coordinates. Its segments say which joint carries a marker; its landmarks say what the marker lies on, and
joint centres are predicted from these alone (`centres`): a custom set needs names, no rules.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from ...base.errors import InputError, format_some
from ..trial import MarkerTrial
from .template import JOINTS, LANDMARKS

UNLABELED = re.compile(r"^(\*\d+|[UuxX]_?\d+|C_\d+|[Uu]nlabell?ed.*|[Uu]nnamed.*)$")
"""Labels that recording software gives to unlabeled markers."""
_MIN_SHARE = 0.8  # share of a set's markers that a trial must contain


@dataclass(frozen=True)
class MarkerSet:
    """The markers of one protocol.

    Attributes:
        name: one word.
        segments: joint name (of `template.JOINTS`) -> labels of the markers that it carries.
        landmarks: anatomical point (of `template.LANDMARKS`) -> labels; of several, the mean is used.
        aliases: another label -> the set's own.
        static: markers that may be missing in all but the static trial.
        optional: markers that may be missing anywhere.
        ball: markers on a ball.
        other: markers on other objects.
        about: one line that describes the set.
    Raises:
        InputError: for unknown joints or landmarks, or a marker on two segments.
    """

    name: str
    segments: Mapping[str, tuple[str, ...]]
    landmarks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    static: frozenset[str] = frozenset()
    optional: frozenset[str] = frozenset()
    ball: tuple[str, ...] = ()
    other: tuple[str, ...] = ()
    about: str = ""

    def __post_init__(self):
        for name in ("segments", "landmarks"):
            table = {key: tuple(labels) for key, labels in getattr(self, name).items()}
            object.__setattr__(self, name, MappingProxyType(table))
        object.__setattr__(self, "aliases", MappingProxyType(dict(self.aliases)))
        for name in ("static", "optional"):
            object.__setattr__(self, name, frozenset(getattr(self, name)))
        for name in ("ball", "other"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        self._check()

    def _check(self):
        """Raise InputError for unknown joints, landmarks and markers, and for markers on two segments."""
        where = f"marker set {self.name}"
        for joint in self.segments:
            if joint not in JOINTS:
                raise InputError(where, f"no segment {joint!r}", f"one of {', '.join(JOINTS)}")
        for landmark in self.landmarks:
            if landmark not in LANDMARKS:
                raise InputError(where, f"no landmark {landmark!r}", f"one of {', '.join(sorted(LANDMARKS))}")
        labels = self.labels
        twice = sorted({label for label in labels if labels.count(label) > 1})
        if twice:
            raise InputError(where, f"marker {twice[0]!r} on two segments", "each marker on one segment")
        unknown = sorted({x for group in self.landmarks.values() for x in group} - set(labels))
        if unknown:
            raise InputError(where, f"landmark on {unknown[0]!r}, which is on no segment", "a marker of a segment")
        if not labels:
            raise InputError(where, "no segment has a marker", "a line such as `segment Hips: LASI, RASI, SACR`")

    @property
    def labels(self) -> tuple[str, ...]:
        """All markers on the body, segment by segment."""
        return tuple(label for group in self.segments.values() for label in group)

    @property
    def required_markers(self) -> frozenset[str]:
        """Markers that every trial of this set must contain."""
        return frozenset(self.labels) - self.static - self.optional

    def list_missing(self, labels: Sequence[str]) -> tuple[str, ...]:
        """List the required markers that are not among `labels`, in the set's order."""
        present = {self.map_labels(labels).get(label, label) for label in labels}
        return tuple(label for label in self.labels if label in self.required_markers and label not in present)

    def find_segment(self, label: str) -> str | None:
        """Find the joint that carries a marker; None where it lies on no segment."""
        return next((joint for joint, group in self.segments.items() if label in group), None)

    def map_labels(self, labels: Sequence[str]) -> dict[str, str]:
        """Map labels to the set's own.

        Args:
            labels: as recorded.
        Returns:
            {label: the set's label}, only for labels that differ (an alias, or another case).
        """
        own = (*self.labels, *self.ball, *self.other)
        plain = {_normalize_label(label): label for label in own} | {_normalize_label(old): new for old,
                                                                     new in self.aliases.items()}
        present = set(labels)
        found: dict[str, str] = {}
        for label in labels:
            new = plain.get(_normalize_label(label))
            if label not in own and new is not None and new not in present and new not in found.values():
                found[label] = new
        return found

    def select_clusters(self, labels: Sequence[str]) -> dict[str, tuple[str, ...]]:
        """Select the markers of each segment that are among `labels`; segments without any are left out."""
        present = set(labels)
        found = {joint: tuple(x for x in group if x in present) for joint, group in self.segments.items()}
        return {joint: group for joint, group in found.items() if group}


def choose_marker_set(labels: Sequence[str], sets: Iterable[MarkerSet]) -> MarkerSet:
    """Choose the marker set that fits the labels: of the sets that are present enough, the one that explains most
    labels.

    Args:
        labels: as recorded; unlabeled markers are ignored.
        sets: the sets to choose from. Up to a fifth of a set's markers may be missing, as those of an arm out of view.
    Returns:
        The set.
    Raises:
        InputError: if every set lacks more; the message names the nearest set and its missing markers.
    """
    sets = list(sets)
    labeled = [label for label in labels if not UNLABELED.match(label)]
    candidates = [(marker_set, _find_present(marker_set, labeled)) for marker_set in sets]
    share = [len(present & s.required_markers) / max(len(s.required_markers), 1) for s, present in candidates]
    matching = [(len(present), part, -len(s.labels), s) for (s, present), part in zip(candidates, share) if part
                >= _MIN_SHARE]
    if matching:
        return max(matching, key=lambda row: row[:3])[3]
    if not sets:
        raise InputError("marker sets", "no marker sets", "at least one")
    nearest, present = candidates[share.index(max(share))]
    missing = sorted(nearest.required_markers - present)
    unknown = sorted(set(labeled) - set(nearest.map_labels(labeled)) - set(nearest.labels))
    raise InputError(
        "markers", f"no marker set fits; nearest is {nearest.name}, of which "
        + f"{format_some(missing, 8)} {'is' if len(missing) == 1 else 'are'} missing"
        + (f" ({format_some(unknown, 8)} not in it)" if unknown else ""),
        "all markers of one set", "choose a marker set file that has these labels",
    )


def _find_present(marker_set: MarkerSet, labels: Sequence[str]) -> set[str]:
    """Return the set's markers that are among the labels."""
    renamed = marker_set.map_labels(labels)
    return {renamed.get(label, label) for label in labels} & set(marker_set.labels)


def _normalize_label(label: str) -> str:
    """Return the label in lower case, without separators."""
    return re.sub(r"[\s_\-.]", "", label).lower()


def convert_labels(trial: MarkerTrial, marker_set: MarkerSet) -> MarkerTrial:
    """Convert a trial to the set's labels.

    A set may say which unlabeled marker is which (`also LHAND: x52`), but recording software numbers these differently
    in every trial. Where both a left and a right marker were matched in this way, each goes to the side whose markers
    are nearer.

    Args:
        trial: the recorded markers.
        marker_set: the set.
    Returns:
        The trial with the set's labels.
    """
    names = marker_set.map_labels(trial.labels)
    unlabeled = {new: old for old, new in names.items() if UNLABELED.match(old)}
    for new, old in unlabeled.items():
        twin = _find_twin(new, marker_set, unlabeled)
        if twin and _find_side(marker_set, new) == "Left":
            distances = [_measure_side_distance(trial, one, marker_set, "Left") + _measure_side_distance(trial, other,
                    marker_set, "Right") for one, other in ((old, unlabeled[twin]), (unlabeled[twin], old))]
            if distances[1] < distances[0]:
                names[old], names[unlabeled[twin]] = twin, new
    return trial.rename_labels(names)


def _find_side(marker_set: MarkerSet, label: str) -> str:
    """Return "Left", "Right" or "" for the segment that carries a marker."""
    segment = marker_set.find_segment(label) or ""
    return next((side for side in ("Left", "Right") if segment.startswith(side)), "")


def _find_twin(label: str, marker_set: MarkerSet, among) -> str | None:
    """Find the marker with the same name on the other side's segment, or None."""
    segment = marker_set.find_segment(label) or ""
    other = segment.replace("Left", "Right") if "Left" in segment else segment.replace("Right", "Left")
    there = [x for x in marker_set.segments.get(other, ()) if x in among and x[1:] == label[1:]]
    return there[0] if there and other != segment else None


def _measure_side_distance(trial: MarkerTrial, label: str, marker_set: MarkerSet, side: str) -> float:
    """Measure the mean distance in metres from a marker to the nearest marker of a side."""
    own = trial.positions[:, trial.index_of(label)]
    best = np.inf
    for segment, labels in marker_set.segments.items():
        for other in labels:
            if segment.startswith(side) and other in trial.labels and other != label:
                apart = np.linalg.norm(trial.positions[:, trial.index_of(other)] - own, axis=-1)
                apart = apart[np.isfinite(apart)]
                if len(apart):
                    best = min(best, float(apart.mean()))
    return best
