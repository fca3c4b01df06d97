"""Markers as a file holds them, and their way to a trial of ours: one subject, metres, Z up, nothing that is no
marker."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ..trial import MarkerEvent, MarkerTrial
from ..upright import handedness, tall, up_axis
from . import marker_labels, marker_unit

_WILD = 1e9  # in any unit
_FARTHEST = 1000.0  # metres from the origin: a mark for "not seen", or damage
_UP = {
    (2, 1): ((0, 1, 2), (1, 1, 1)), (2, -1): ((0, 1, 2), (1, -1, -1)),
    (1, 1): ((0, 2, 1), (1, -1, 1)), (1, -1): ((0, 2, 1), (1, 1, -1)),
    (0, 1): ((1, 2, 0), (1, 1, 1)), (0, -1): ((1, 2, 0), (-1, 1, -1)),
}  # fmt: skip
"""What points up in the file, (axis, sign) -> which of its axes ours are, and their signs: turned, never mirrored."""


@dataclass(kw_only=True)
class RawMarkers:
    """What a reader found. T frames, M points, the file's unit and axes.

    labels: as written. positions: (T, M, 3), NaN where not seen. residuals: (T, M) in the file's unit, NaN where not
    seen; None where unknown. unit: as written, "" where absent. up: (axis, sign) as the file says; None where it does
    not. usual_up: what such files have where they say nothing. prefixes: of labels, as the file names them. listed:
    labels that the file says are no markers. events: (seconds, label, side, subject). notes: lines for people.
    """

    labels: list[str]
    positions: np.ndarray
    fps: float
    unit: str = ""
    residuals: np.ndarray | None = None
    up: tuple[int, int] | None = None
    usual_up: tuple[int, int] = (2, 1)
    prefixes: tuple[str, ...] = ()
    listed: tuple[str, ...] = ()
    events: list[tuple[float, str, str, str]] = field(default_factory=list)
    start: float = 0.0
    notes: list[str] = field(default_factory=list)


def as_trial(raw: RawMarkers, path: str | os.PathLike, unit: float | str | None, subject: str | None,
             up: str | None) -> MarkerTrial:  # fmt: skip
    """The trial that a file holds. unit: as the user gives it (`marker_unit.metres_per_unit`), None for the file's.
    subject: whose markers, None for the only body. up: the file's axis that points up ("Z", "-Y"), None to find it.

    InputError where no marker is ever seen, several bodies are in the file and none is chosen, or the unit is unknown.
    """
    notes = list(raw.notes)
    chosen, labels, whose = _choose(raw, path, subject, notes)
    positions = np.array(raw.positions[:, chosen], dtype=float)
    residuals = None if raw.residuals is None else np.array(raw.residuals[:, chosen], dtype=float)
    positions[(positions == 0).all(axis=-1)] = np.nan
    wild = (np.abs(positions) > _WILD).any(axis=-1)
    positions[wild] = np.nan
    known = unit is not None
    metres, how = (marker_unit.given(path, unit, positions) if known
                   else marker_unit.decided(path, raw.unit, positions, tall(labels, positions)))  # fmt: skip
    notes.insert(0, how)
    positions *= metres
    far = wild | (np.abs(positions) > _FARTHEST).any(axis=-1)
    if far.any():
        notes.append(f"{far.sum()} places farther than {_FARTHEST:.0f} m from the origin, taken as not seen")
        positions[far] = np.nan
    positions[~np.isfinite(positions).all(axis=-1)] = np.nan
    labels, positions, residuals = _seen_only(path, labels, positions, residuals, notes)
    positions = _upright(raw, labels, positions, up, notes)
    if residuals is not None:
        residuals = np.where(np.isfinite(positions).all(axis=-1), residuals * metres, np.nan)
        residuals = residuals if np.nanmax(residuals, initial=0) > 0 else None
    _tell_mirrored(labels, positions, notes)
    return MarkerTrial(labels=tuple(labels), positions=positions, fps=raw.fps, residuals=residuals,
                       events=_events(raw, whose), start=raw.start, name=Path(path).stem, subject=whose,
                       notes=tuple(notes))  # fmt: skip


def _choose(raw: RawMarkers, path, subject, notes) -> tuple[list[int], list[str], str]:
    """Which points are the subject's markers, their labels, and who that is."""
    listed = {marker_labels.split(label, raw.prefixes)[1] for label in raw.listed}
    parted = [marker_labels.split(label, raw.prefixes) for label in raw.labels]
    of: dict[str, list[str]] = {}
    for name, label in parted:
        of.setdefault(name, []).append(label)
    dropped = {name: marker_labels.computed(labels, listed) for name, labels in of.items()}
    points = [i for i, (name, label) in enumerate(parted) if label not in dropped[name]]
    if len(points) < len(parted):
        some = list(dict.fromkeys(label for name, label in parted if label in dropped[name]))
        notes.append(f"{len(parted) - len(points)} computed points left out: {_few(some)}")
    if not points:
        raise InputError(path, "no markers", "points that are markers", "export the trial with its markers")
    counts: dict[str, int] = {}
    for i in points:
        counts[parted[i][0]] = counts.get(parted[i][0], 0) + 1
    whose = marker_labels.chosen_subject(path, counts, subject)
    kept = [i for i in points if parted[i][0] in ("", whose) or counts[parted[i][0]] < marker_labels.FEWEST_OF_A_BODY]
    labels = [parted[i][1] if parted[i][0] in ("", whose) else ":".join(parted[i]) for i in kept]
    if others := [name for name in counts if name not in ("", whose)]:
        notes.append(f"subject {whose or 'without a name'!r} of {_few(list(counts))}")
        if objects := [name for name in others if counts[name] < marker_labels.FEWEST_OF_A_BODY]:
            notes.append(f"markers of {_few(objects)} kept under their own names")
    labels, twice = marker_labels.unique(labels)
    if twice:
        notes.append(f"labels that came twice, numbered: {_few(twice)}")
    return kept, labels, whose


def _seen_only(path, labels, positions, residuals, notes):
    """The markers that are seen at all."""
    ever = np.isfinite(positions).all(axis=-1).any(axis=0)
    if not ever.any():
        raise InputError(path, f"{len(labels)} markers, none of them ever seen", "places of markers", "export it again")
    if not ever.all():
        notes.append(f"never seen: {_few([label for label, seen in zip(labels, ever) if not seen])}")
    labels = [label for label, seen in zip(labels, ever) if seen]
    return labels, positions[:, ever], None if residuals is None else residuals[:, ever]


def _upright(raw: RawMarkers, labels, positions, given: str | None, notes) -> np.ndarray:
    """The places with Z up: as given, else as the file says, else as the body stands, else as such files usually
    are."""
    stands = up_axis(labels, positions)
    said = {
        "as given": None if given is None else axis_named(given),
        "as the file says": raw.up,
        "heads above feet": stands,
        "as such files usually are": raw.usual_up,
    }
    why, up = next((why, up) for why, up in said.items() if up)
    notes.append(f"{_axis(up)} is up, {why}")
    if stands and stands != up and given is None:
        notes.append(f"heads lie above feet along {_axis(stands)}, though: check which way is up")
    axes, signs = _UP[up]
    return positions[..., axes] * np.array(signs, dtype=float)


def _tell_mirrored(labels, positions, notes) -> None:
    if handedness(labels, positions) < -0.5:
        notes.append("the body is mirrored: its coordinates are left-handed, or left and right labels are exchanged")


def _events(raw: RawMarkers, whose: str) -> tuple[MarkerEvent, ...]:
    return tuple(MarkerEvent(seconds, label, side) for seconds, label, side, name in raw.events
                 if not name or not whose or name == whose)  # fmt: skip


def axis_named(name: str) -> tuple[int, int]:
    """(axis 0..2, sign) of an axis's name: "Z", "+Y", "-x". InputError where it is none."""
    plain = name.strip().upper().lstrip("+-")
    if plain not in ("X", "Y", "Z") or len(name.strip()) > 2:
        raise InputError("--up", f"axis {name[:20]!r}", "one of X, Y, Z, -X, -Y, -Z", "name the axis that points up")
    return "XYZ".index(plain), -1 if "-" in name else 1


def _axis(up: tuple[int, int]) -> str:
    return ("-" if up[1] < 0 else "") + "XYZ"[up[0]]


def _few(names, most: int = 6) -> str:
    names = [name or "(no name)" for name in names]
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
