"""Metres per unit and the up axis of a marker file: as its header says, or as the body in it shows.

The names of markers show which way is up and which side is left: heads are above feet, toes in front of heels.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence

import numpy as np

from ...base.errors import InputError
from ...base.fixes import Fix
from ...base.vectors import unit_vectors

NAMES = {"m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "dm": 0.1, "decimeter": 0.1,
         "decimeters": 0.1, "cm": 0.01, "centimeter": 0.01, "centimeters": 0.01, "centimetre": 0.01,
         "centimetres": 0.01, "mm": 0.001, "millimeter": 0.001, "millimeters": 0.001, "millimetre": 0.001,
         "millimetres": 0.001, "um": 1e-6, "micrometer": 1e-6, "micrometers": 1e-6, "in": 0.0254, "inch": 0.0254,
         "inches": 0.0254, '"': 0.0254, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048}
_GUESSED_UNITS = ("mm", "m", "cm", "in")  # units that are tried
_USUAL_SPAN = 1.5  # metres that the markers of a standing body span
_GUESS_RANGE = (0.5, 2.6)  # metres that the markers may span for a guessed unit
_BODY_RANGE = (0.1, 10.0)  # metres that they may span for the header's unit
_HEIGHT_RANGE = (0.25, 2.8)  # metres from the feet to the head, or to the pelvis without markers above it
_GIVEN_RANGE = (0.01, 100.0)  # metres that the markers may span for a given unit
_SET_UNIT = "set the unit (metres per unit, or mm, cm, m, in)"

HIGH = re.compile(r"HD$|HEAD|^C7$|^T[1-4]$|CLAV|STRN|^MAN|SHO?U?L?D?E?R?$|ACR|SJN", re.I)
MIDDLE = re.compile(r"ASI|PSI|SACR", re.I)
LOW = re.compile(r"HEE|TOE|ANK|MAL|CALC|FOOT|MT\d?$|MFS|^[LR]?MT|MET", re.I)
FRONT, BACK = re.compile(r"TOE|MT\d?$|ASI", re.I), re.compile(r"HEE|CALC|PSI|SACR", re.I)
_MIN_UP_SHARE = 0.7  # share of the direction from feet to head along one axis, in the median frame
_FRAMES = 400  # frames that are used
_MIN_LENGTH = 1e-300  # in any unit; only coinciding points have no direction
_MIN_VOLUME = 0.25  # volume of the three unit directions, from which on the handedness is clear


def parse_unit(unit: float | str, where: object = "unit") -> float:
    """Parse a unit as users give it.

    Args:
        unit: metres per unit, or a name.
        where: for messages.
    Returns:
        Metres per unit.
    Raises:
        InputError: if it is neither.
    """
    value = NAMES.get(str(unit).strip().lower())
    if value is None:
        try:
            value = float(unit)
        except (TypeError, ValueError):
            value = math.nan
    if not 1e-9 < value < 1e4:
        raise InputError(where, f"unit {str(unit)[:40]!r}", "metres per unit, or mm, cm, m, in", "check the unit")
    return value


def check_given_unit(path: str | os.PathLike, unit: float | str, positions: np.ndarray) -> tuple[float, str]:
    """Check a unit given by the user against the size of the body.

    Args:
        path: for messages.
        unit: metres per unit, or a name.
        positions: (T, M, 3) in the file's unit.
    Returns:
        Metres per unit, and a message.
    Raises:
        InputError: if it is not a unit, or gives an impossible size.
    """
    metres, span = parse_unit(unit), measure_span(positions)
    if span > 0 and not _GIVEN_RANGE[0] <= span * metres <= _GIVEN_RANGE[1]:
        found = f"makes {path} span {span * metres:.4g} m"
        raise InputError(f"unit {str(unit)[:40]}", found, "a body", "check the unit", fixes=(Fix("use_unit", "0"),))
    note = f"unit {metres:g} m, as given"
    usual = not span or _BODY_RANGE[0] <= span * metres <= _BODY_RANGE[1]
    return metres, note if usual else f"{note}: the markers then span {span * metres:.4g} m, unusual for a body"


def decide_unit(path: str | os.PathLike, header_unit: str, positions: np.ndarray, height: float = 0.0) -> tuple[float,
        str]:
    """Decide the unit of a file.

    Args:
        path: for messages.
        header_unit: unit in the header, "" for none.
        positions: (T, M, 3) in the file's unit.
        height: from feet to head (or pelvis) in that unit, 0 where unknown.
    Returns:
        Metres per unit, and a message on how it was decided.
    Raises:
        InputError: if neither header nor size give the unit, or the header's unit gives an impossible size.
    """
    known = NAMES.get(header_unit.strip().lower())
    span = measure_span(positions)
    if known is not None:
        if height > 0 and not _HEIGHT_RANGE[0] <= height * known <= _HEIGHT_RANGE[1]:
            raise InputError(path, f"a body of {height * known:.4g} m in the header's unit {header_unit.strip()!r}",
                             "a body", _SET_UNIT, fixes=_list_unit_fixes(span))  # fmt: skip
        if span > 0 and not _BODY_RANGE[0] <= span * known <= _BODY_RANGE[1]:
            raise InputError(
                path, f"markers that span {span * known:.4g} m in the header's unit {header_unit.strip()!r}", "a body",
                             _SET_UNIT, fixes=_list_unit_fixes(span))  # fmt: skip
        return known, f"unit {header_unit.strip()}"
    fitting = _list_fitting_units(span)
    found = f"unit {header_unit.strip()[:20]!r}" if header_unit.strip() else "no unit"
    if not fitting:
        raise InputError(path, f"{found}, and markers that span {span:.4g} of it", "mm, cm, m or in", _SET_UNIT)
    best = min(fitting, key=lambda name: abs(math.log(span * NAMES[name] / _USUAL_SPAN)))
    return NAMES[best], f"{found} in the header: taken as {best}, since the markers span {span:.4g}"


def _list_fitting_units(span: float) -> list[str]:
    """List the names of the units in which markers that span so much of the file's unit are a body's."""
    return [name for name in _GUESSED_UNITS if _GUESS_RANGE[0] <= span * NAMES[name] <= _GUESS_RANGE[1]]


def _list_unit_fixes(span: float) -> tuple[Fix, ...]:
    return tuple(Fix("use_unit", f"{NAMES[name]:g}") for name in _list_fitting_units(span))


def measure_span(positions: np.ndarray) -> float:
    """Measure how far the markers extend along their longest axis, in a usual frame; 0 without visible markers."""
    few = positions[:: max(len(positions) // 400, 1)]
    seen = np.isfinite(few)
    reach = np.where(seen, few, -np.inf).max(axis=1) - np.where(seen, few, np.inf).min(axis=1)
    reach = reach[np.isfinite(reach).all(axis=-1)]
    return float(np.median(reach, axis=0).max()) if len(reach) else 0.0


def detect_up_axis(labels: Sequence[str], positions: np.ndarray) -> tuple[int, int] | None:
    """Detect the axis along which heads (or the pelvis) are above feet.

    Args:
        labels: M labels.
        positions: (T, M, 3), any unit and axes, NaN where not visible.
    Returns:
        (axis 0..2, sign); None where the labels do not show it, or the body lies down.
    """
    up = _measure_up(labels, positions)
    if up is None:
        return None
    along = np.nanmedian(up, axis=0)
    axis = int(np.abs(along).argmax())
    return (axis, 1 if along[axis] > 0 else -1) if abs(along[axis]) > _MIN_UP_SHARE else None


def measure_height(labels: Sequence[str], positions: np.ndarray) -> float:
    """Measure the usual distance from feet to head (or pelvis).

    Args:
        labels: M labels.
        positions: (T, M, 3).
    Returns:
        The distance in the positions' unit; 0 where the labels do not show it.
    """
    for high in (HIGH, MIDDLE):
        apart = _measure_offset(labels, positions, LOW, high)
        length = np.linalg.norm(apart, axis=-1) if apart is not None else np.zeros(0)
        if np.isfinite(length).any():
            return float(np.nanmedian(length))
    return 0.0


def measure_handedness(labels: Sequence[str], positions: np.ndarray) -> float:
    """Measure whether the body is right-handed or mirrored.

    Ahead, left and up, by the names of markers, form a right-handed frame, or a left-handed one if the coordinates are
    mirrored or left and right labels exchanged.

    Args:
        labels: M labels.
        positions: (T, M, 3), any unit and axes, NaN where not visible.
    Returns:
        Near +1 for right-handed, near -1 for mirrored, 0 where unknown.
    """
    ahead, up, sides = _measure_direction(labels, positions, BACK, FRONT), _measure_up(labels,
            positions), _list_sides(labels)
    if ahead is None or up is None or not sides:
        return 0.0
    few = _sample_frames(positions)
    left = unit_vectors(_compute_mean(few[:, [i for i, _ in sides]] - few[:, [j for _, j in sides]], axis=1), np.nan,
                        _MIN_LENGTH)
    with np.errstate(invalid="ignore"):
        volume = np.einsum("ti,ti->t", np.cross(ahead, left), up)
    clear = volume[np.abs(volume) > _MIN_VOLUME]
    return float(np.sign(clear).mean()) if len(clear) else 0.0


def _measure_up(labels, positions) -> np.ndarray | None:
    """Measure (t, 3) unit directions from the feet to the head, or to the pelvis where only legs have markers."""
    whole = _measure_direction(labels, positions, LOW, HIGH)
    return _measure_direction(labels, positions, LOW, MIDDLE) if whole is None else whole


def _sample_frames(positions: np.ndarray) -> np.ndarray:
    """Return some frames, spread over the trial."""
    return positions[:: max(len(positions) // _FRAMES, 1)]


def _measure_direction(labels, positions, start: re.Pattern, end: re.Pattern) -> np.ndarray | None:
    """Measure (t, 3) unit directions from the middle of some markers to that of others; None where there are none."""
    apart = _measure_offset(labels, positions, start, end)
    direction = None if apart is None else unit_vectors(apart, np.nan, _MIN_LENGTH)
    return None if direction is None or not np.isfinite(direction).any() else direction


def _measure_offset(labels, positions, start: re.Pattern, end: re.Pattern) -> np.ndarray | None:
    """Measure (t, 3) vectors from the middle of some markers to that of others, in some frames; None without such
    labels.
    """
    ends = [[i for i, label in enumerate(labels) if pattern.search(label)] for pattern in (start, end)]
    if not all(ends):
        return None
    few = _sample_frames(positions)
    return _compute_mean(few[:, ends[1]], axis=1) - _compute_mean(few[:, ends[0]], axis=1)


def _list_sides(labels) -> list[tuple[int, int]]:
    """List (left, right) indices of markers whose names differ in their first letter, or in Left and Right."""
    where = {label.upper(): i for i, label in enumerate(labels)}
    swapped = ((label, re.sub(r"^L(EFT)?", lambda m: "RIGHT" if m[1] else "R", label)) for label in where)
    return [(where[label], where[other]) for label, other in swapped if other != label and other in where]


def _compute_mean(values: np.ndarray, axis: int) -> np.ndarray:
    """Compute the mean along `axis`, ignoring NaN; NaN where all values are."""
    seen = np.isfinite(values)
    count = seen.sum(axis=axis)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(count > 0, np.where(seen, values, 0).sum(axis=axis) / count, np.nan)
