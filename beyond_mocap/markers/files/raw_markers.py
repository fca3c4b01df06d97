"""Markers as a file contains them, and their conversion to a trial: one subject, metres, Z up, unique labels, only
markers.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...base.errors import InputError, format_count, format_some
from ..trial import MarkerEvent, MarkerTrial
from .unit_and_axes import check_given_unit, decide_unit, detect_up_axis, measure_handedness, measure_height

_MAX_COORDINATE = 1e9  # in any unit; a larger coordinate is damage
_MAX_DISTANCE = 1000.0  # metres from the origin; farther is a code for "not visible", or damage
_UP_ROTATIONS = {(2, 1): ((0, 1, 2), (1, 1, 1)), (2, -1): ((0, 1, 2), (1, -1, -1)), (1, 1): ((0, 2, 1), (1, -1, 1)),
                 (1, -1): ((0, 2, 1), (1, 1, -1)), (0, 1): ((1, 2, 0), (1, 1, 1)), (0, -1): ((1, 2, 0), (-1, 1, -1))}
"""(up axis of the file, sign) -> the file's axes that become X, Y and Z, and their signs: rotations, no reflections."""

MIN_BODY_MARKERS = 10  # markers; a subject of a file with fewer is taken for an object

_COMPUTED_LABEL = re.compile(
    r"(Angles?V?|Force|Moment|Power|GRF|CentreOfMass(Floor)?|CenterOfMass(Floor)?|^CoM(Floor)?|GroundReaction\w*"
    r"|NormalisedGRF)$", re.I)  # fmt: skip
_FRAME_LABEL = re.compile(r"(.+)([OALP])")


@dataclass(kw_only=True)
class RawMarkers:
    """What a reader found: T frames, M points, in the file's unit and axes.

    Attributes:
        labels: as written.
        positions: (T, M, 3), NaN where not visible.
        fps: frames per second.
        unit: as written, "" where absent.
        residuals: (T, M) in the file's unit, NaN where not visible; None where unknown.
        up: (axis, sign) as the file says; None where it does not.
        usual_up: what such files have where they do not say.
        prefixes: prefixes of labels, as the file lists them.
        computed: labels that the file lists as no markers.
        events: (seconds, label, side, subject).
        start: seconds of frame 0.
        notes: messages for people.
    """

    labels: list[str]
    positions: np.ndarray
    fps: float
    unit: str = ""
    residuals: np.ndarray | None = None
    up: tuple[int, int] | None = None
    usual_up: tuple[int, int] = (2, 1)
    prefixes: tuple[str, ...] = ()
    computed: tuple[str, ...] = ()
    events: list[tuple[float, str, str, str]] = field(default_factory=list)
    start: float = 0.0
    notes: list[str] = field(default_factory=list)


def build_trial(raw: RawMarkers, path: str | os.PathLike, unit: float | str | None, subject: str | None,
                up: str | None) -> MarkerTrial:  # fmt: skip
    """Convert raw markers to a trial.

    Args:
        raw: what a reader found.
        path: the file, for messages and the name.
        unit: as the user gives it (`unit_and_axes.parse_unit`); None for the file's.
        subject: whose markers; None for the only body.
        up: the file's axis that points up ("Z", "-Y"); None to detect it.
    Returns:
        The trial, metres, Z up.
    Raises:
        InputError: if no marker is ever visible, several bodies are in the file and none is chosen, or the unit is
            unknown.
    """
    notes = list(raw.notes)
    chosen, labels, whose = _choose_subject(raw, path, subject, notes)
    positions = np.array(raw.positions[:, chosen], dtype=float)
    residuals = None if raw.residuals is None else np.array(raw.residuals[:, chosen], dtype=float)
    positions[(positions == 0).all(axis=-1)] = np.nan
    is_damaged = (np.abs(positions) > _MAX_COORDINATE).any(axis=-1)
    positions[is_damaged] = np.nan
    known = unit is not None
    metres, unit_note = (check_given_unit(path, unit, positions) if known
                         else decide_unit(path, raw.unit, positions, measure_height(labels, positions)))  # fmt: skip
    notes.insert(0, unit_note)
    positions *= metres
    is_too_far = is_damaged | (np.abs(positions) > _MAX_DISTANCE).any(axis=-1)
    if is_too_far.any():
        notes.append(
            f"{format_count(is_too_far.sum(), 'place')} farther than {_MAX_DISTANCE:.0f} m from the origin, treated as "
            "not visible")
        positions[is_too_far] = np.nan
    positions[~np.isfinite(positions).all(axis=-1)] = np.nan
    labels, positions, residuals = _remove_invisible(path, labels, positions, residuals, notes)
    positions = _rotate_upright(raw, labels, positions, up, notes)
    if residuals is not None:
        residuals = np.where(np.isfinite(positions).all(axis=-1), residuals * metres, np.nan)
        residuals = residuals if np.nanmax(residuals, initial=0) > 0 else None
    if measure_handedness(labels, positions) < -0.5:
        notes.append("the body is mirrored: its coordinates are left-handed, or left and right labels are exchanged")
    return MarkerTrial(labels=tuple(labels), positions=positions, fps=raw.fps, residuals=residuals,
                       events=_select_events(raw, whose), start=raw.start, name=Path(path).stem, subject=whose,
                       notes=tuple(notes))  # fmt: skip


def _choose_subject(raw: RawMarkers, path, subject, notes) -> tuple[list[int], list[str], str]:
    """Choose the subject's points: their indices, their labels, and the subject."""
    listed = {split_label(label, raw.prefixes)[1] for label in raw.computed}
    split_labels = [split_label(label, raw.prefixes) for label in raw.labels]
    by_subject: dict[str, list[str]] = {}
    for name, label in split_labels:
        by_subject.setdefault(name, []).append(label)
    dropped = {name: find_computed(labels, listed) for name, labels in by_subject.items()}
    points = [i for i, (name, label) in enumerate(split_labels) if label not in dropped[name]]
    if len(points) < len(split_labels):
        some = list(dict.fromkeys(label for name, label in split_labels if label in dropped[name]))
        notes.append(f"{format_count(len(split_labels) - len(points), 'computed point')} left out: {format_some(some)}")
    if not points:
        raise InputError(path, "no markers", "points that are markers", "export the trial with its markers")
    counts: dict[str, int] = {}
    for i in points:
        counts[split_labels[i][0]] = counts.get(split_labels[i][0], 0) + 1
    whose = choose_subject(path, counts, subject)
    selected = [i for i in points if split_labels[i][0] in ("", whose) or counts[split_labels[i][0]] < MIN_BODY_MARKERS]
    labels = [split_labels[i][1] if split_labels[i][0] in ("", whose) else ":".join(split_labels[i]) for i in selected]
    if others := [name for name in counts if name not in ("", whose)]:
        notes.append(f"subject {whose or 'without a name'!r} of {format_some(list(counts))}")
        if objects := [name for name in others if counts[name] < MIN_BODY_MARKERS]:
            notes.append(f"markers of {format_some(objects)} kept with their own names")
    labels, duplicates = make_unique(labels)
    if duplicates:
        notes.append(f"duplicate labels, numbered: {format_some(duplicates)}")
    return selected, labels, whose


def _remove_invisible(path, labels, positions, residuals, notes):
    """Remove markers that are never visible; raise InputError if none is left."""
    is_visible = np.isfinite(positions).all(axis=-1).any(axis=0)
    if not is_visible.any():
        raise InputError(path, f"{len(labels)} markers, none ever visible", "places of markers", "export it again")
    if not is_visible.all():
        notes.append(f"never visible: {format_some([label for label, seen in zip(labels, is_visible) if not seen])}")
    labels = [label for label, seen in zip(labels, is_visible) if seen]
    return labels, positions[:, is_visible], None if residuals is None else residuals[:, is_visible]


def _rotate_upright(raw: RawMarkers, labels, positions, requested: str | None, notes) -> np.ndarray:
    """Rotate the places to Z up: as given, else as the file says, else as the body shows, else as such files usually
    are.
    """
    body_up = detect_up_axis(labels, positions)
    candidates = {"as given": None if requested is None else parse_axis(requested), "as the file says": raw.up,
                  "heads above feet": body_up, "as such files usually are": raw.usual_up}
    why, up = next((why, up) for why, up in candidates.items() if up)
    notes.append(f"{_format_axis(up)} is up, {why}")
    if body_up and body_up != up and requested is None:
        notes.append(f"but heads are above feet along {_format_axis(body_up)}: check which way is up")
    axes, signs = _UP_ROTATIONS[up]
    return positions[..., axes] * np.array(signs, dtype=float)


def _select_events(raw: RawMarkers, whose: str) -> tuple[MarkerEvent, ...]:
    """Select the events of the subject, and those without a subject."""
    return tuple(MarkerEvent(seconds, label, side) for seconds, label, side, name in raw.events
                 if not name or not whose or name == whose)  # fmt: skip


def parse_axis(name: str) -> tuple[int, int]:
    """Parse the name of an axis: "Z", "+Y", "-x".

    Returns:
        (axis 0..2, sign).
    Raises:
        InputError: if it is not an axis.
    """
    letter = name.strip().upper().lstrip("+-")
    if letter not in ("X", "Y", "Z") or len(name.strip()) > 2:
        raise InputError("up axis", f"axis {name[:20]!r}", "one of X, Y, Z, -X, -Y, -Z", "name the axis that points up")
    return "XYZ".index(letter), -1 if "-" in name else 1


def _format_axis(up: tuple[int, int]) -> str:
    return ("-" if up[1] < 0 else "") + "XYZ"[up[0]]


def split_label(label: str, prefixes: Iterable[str] = ()) -> tuple[str, str]:
    """Split a label as files write it ("Derrick:C7") into subject and label.

    Args:
        label: as written.
        prefixes: that the file lists.
    Returns:
        (subject, label); the subject is "" without a prefix.
    """
    for prefix in sorted((one for one in prefixes if one.strip()), key=len, reverse=True):
        if label.startswith(prefix) and len(label) > len(prefix):
            return prefix.strip().rstrip(":_").strip(), label[len(prefix) :].strip()
    subject, colon, rest = label.rpartition(":")
    return (subject.strip(), rest.strip()) if colon and rest.strip() else ("", label.strip())


def find_computed(labels: Sequence[str], listed: Iterable[str] = ()) -> set[str]:
    """Find the labels that are no markers.

    Args:
        labels: of one subject.
        listed: labels that the file lists as angles, forces and the like.
    Returns:
        The listed labels, those named as such, and the four points (O, A, L, P) of a segment's frame that Plug-in Gait
        computes.
    """
    stems: dict[str, set[str]] = {}
    for label in labels:
        if frame := _FRAME_LABEL.fullmatch(label):
            stems.setdefault(frame[1], set()).add(frame[2])
    frames = {stem + letter for stem, letters in stems.items() if letters == set("OALP") for letter in letters}
    there = set(labels)
    return {label for label in labels if _COMPUTED_LABEL.search(label)} | (frames & there) | (set(listed) & there)


def choose_subject(path, counts: dict[str, int], requested: str | None) -> str:
    """Choose whose markers are meant.

    Args:
        path: for messages.
        counts: {subject: number of its markers}.
        requested: by the user; None for the only body.
    Returns:
        The subject.
    Raises:
        InputError: if there are several bodies, or not the requested one; the message lists them.
    """
    listed = ", ".join(f"{name!r} ({format_count(count, 'marker')})" for name, count in counts.items() if name)
    if requested is not None and requested.strip():
        if not listed:
            found = f"no subject {requested.strip()[:60]!r}"
            raise InputError(path, found, "no choice, since its labels name no subject", "leave the subject empty")
        for name in counts:
            if name.lower() == requested.strip().lower():
                return name
        raise InputError(path, f"no subject {requested.strip()[:60]!r}", f"one of {listed}", "choose one subject")
    bodies = [name for name, count in counts.items() if count >= MIN_BODY_MARKERS]
    named_bodies = [name for name in bodies if name]
    bodies = named_bodies or bodies
    if len(bodies) > 1:
        raise InputError(path, f"{len(bodies)} subjects: {listed}", "one", "choose one subject")
    return bodies[0] if bodies else max(counts, key=counts.__getitem__)


def make_unique(labels: Sequence[str]) -> tuple[list[str], list[str]]:
    """Make labels unique: the second "LASI" becomes "LASI (2)".

    A marker without a label becomes "*1", "*2" ..., as trackers name unlabeled markers.

    Args:
        labels: as written.
    Returns:
        The unique labels, and those that occurred more than once.
    """
    out: list[str] = []
    taken, duplicates, unnamed = {label for label in labels if label}, [], 0
    used: set[str] = set()
    for label in labels:
        while not label or label in used:
            if label:
                duplicates.append(label)
                label = _number_label(label, taken | used)
            else:
                unnamed += 1
                label = f"*{unnamed}" if f"*{unnamed}" not in taken else ""
        used.add(label)
        out.append(label)
    return out, list(dict.fromkeys(duplicates))


def _number_label(label: str, taken: set[str]) -> str:
    number = 2
    while f"{label} ({number})" in taken:
        number += 1
    return f"{label} ({number})"
