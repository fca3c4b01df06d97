"""Metres per unit and the axis that points up in a file of markers: as its header says, or as the body in it tells.

Names of markers tell which way is up and whether left is left: heads stand above feet, toes before heels.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence

import numpy as np

from ...base.errors import InputError
from ...base.vectors import unit_vectors

NAMES = {"m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "dm": 0.1, "decimeter": 0.1,
         "decimeters": 0.1, "cm": 0.01, "centimeter": 0.01, "centimeters": 0.01, "centimetre": 0.01,
         "centimetres": 0.01, "mm": 0.001, "millimeter": 0.001, "millimeters": 0.001, "millimetre": 0.001,
         "millimetres": 0.001, "um": 1e-6, "micrometer": 1e-6, "micrometers": 1e-6, "in": 0.0254, "inch": 0.0254,
         "inches": 0.0254, '"': 0.0254, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048}
_GUESSED = ("mm", "m", "cm", "in")
_USUAL = 1.5  # metres that the markers of a standing body span
_GUESS_RANGE = (0.5, 2.6)
_BODY_RANGE = (0.1, 10.0)
_HEIGHT_RANGE = (0.25, 2.8)  # from the feet to the head, or to the pelvis where nothing above is marked
_GIVEN_RANGE = (0.01, 100.0)
_SAY = "say --unit (metres per unit, or mm, cm, m, in)"

HIGH = re.compile(r"HD$|HEAD|^C7$|^T[1-4]$|CLAV|STRN|^MAN|SHO?U?L?D?E?R?$|ACR|SJN", re.I)
MIDDLE = re.compile(r"ASI|PSI|SACR", re.I)
LOW = re.compile(r"HEE|TOE|ANK|MAL|CALC|FOOT|MT\d?$|MFS|^[LR]?MT|MET", re.I)
FRONT, BACK = re.compile(r"TOE|MT\d?$|ASI", re.I), re.compile(r"HEE|CALC|PSI|SACR", re.I)
_DECISIVE = 0.7  # of the way from feet to head along one axis, in the median frame
_FRAMES = 400  # looked at
_TINY = 1e-300  # of any unit: only points that coincide have no direction
_SURE = 0.25  # sine volume of the three directions


def metres_per_unit(unit: float | str, where: object = "--unit") -> float:
    """A unit as users give it: metres per unit, or a name. InputError where it is neither."""
    value = NAMES.get(str(unit).strip().lower())
    if value is None:
        try:
            value = float(unit)
        except (TypeError, ValueError):
            value = math.nan
    if not 1e-9 < value < 1e4:
        raise InputError(where, f"unit {str(unit)[:40]!r}", "metres per unit, or mm, cm, m, in", "check the unit")
    return value


def read_given_unit(path: str | os.PathLike, unit: float | str, positions: np.ndarray) -> tuple[float, str]:
    """(metres per unit, line on it) of a unit that the user gives; positions: (T, M, 3) in the file's unit. InputError
    where it is none, or makes something of the body that no body is."""
    metres, span = metres_per_unit(unit), body_span(positions)
    if span > 0 and not _GIVEN_RANGE[0] <= span * metres <= _GIVEN_RANGE[1]:
        found = f"makes {path} span {span * metres:.4g} m"
        raise InputError(f"--unit {str(unit)[:40]}", found, "a body", "check the unit")
    told = f"unit {metres:g} m, as given"
    usual = not span or _BODY_RANGE[0] <= span * metres <= _BODY_RANGE[1]
    return metres, told if usual else f"{told}: makes the markers span {span * metres:.4g} m, as no body does"


def decide_unit(path: str | os.PathLike, said: str, positions: np.ndarray, height: float = 0.0) -> tuple[float, str]:
    """(metres per unit, line on how it was found). said: as the header has it; positions: (T, M, 3) in the file's unit;
    height: from feet to head (or pelvis) in it, 0 where unknown.

    InputError, which names --unit, where neither header nor size tell, or where the body is impossibly large or small
    by what the header says."""
    known = NAMES.get(said.strip().lower())
    span = body_span(positions)
    if known is not None:
        if height > 0 and not _HEIGHT_RANGE[0] <= height * known <= _HEIGHT_RANGE[1]:
            raise InputError(path, f"a body of {height * known:.4g} m in the header's unit {said.strip()!r}", "a body",
                             _SAY)  # fmt: skip
        if span > 0 and not _BODY_RANGE[0] <= span * known <= _BODY_RANGE[1]:
            raise InputError(path, f"markers that span {span * known:.4g} m in the header's unit {said.strip()!r}",
                             "a body", _SAY)  # fmt: skip
        return known, f"unit {said.strip()}"
    fitting = [name for name in _GUESSED if _GUESS_RANGE[0] <= span * NAMES[name] <= _GUESS_RANGE[1]]
    found = f"unit {said.strip()[:20]!r}" if said.strip() else "no unit"
    if not fitting:
        raise InputError(path, f"{found}, and markers that span {span:.4g} of it", "mm, cm, m or in", _SAY)
    best = min(fitting, key=lambda name: abs(math.log(span * NAMES[name] / _USUAL)))
    return NAMES[best], f"{found} in the header: taken as {best}, since the markers span {span:.4g}"


def body_span(positions: np.ndarray) -> float:
    """How far the markers reach along the axis of their largest reach, in a usual frame; 0 where nothing is seen."""
    few = positions[:: max(len(positions) // 400, 1)]
    seen = np.isfinite(few)
    reach = np.where(seen, few, -np.inf).max(axis=1) - np.where(seen, few, np.inf).min(axis=1)
    reach = reach[np.isfinite(reach).all(axis=-1)]
    return float(np.median(reach, axis=0).max()) if len(reach) else 0.0


def up_axis(labels: Sequence[str], positions: np.ndarray) -> tuple[int, int] | None:
    """(axis 0..2, sign) along which heads (or pelvis) lie above feet; None where the names do not tell or the body
    lies down.

    positions: (T, M, 3), any unit, any axes, NaN where not seen."""
    up = _upwards(labels, positions)
    if up is None:
        return None
    along = np.nanmedian(up, axis=0)
    axis = int(np.abs(along).argmax())
    return (axis, 1 if along[axis] > 0 else -1) if abs(along[axis]) > _DECISIVE else None


def tall(labels: Sequence[str], positions: np.ndarray) -> float:
    """How far heads (or pelvis) usually lie from the feet, in the unit of the positions (T, M, 3); 0 where the names do
    not tell."""
    for high in (HIGH, MIDDLE):
        apart = _apart(labels, positions, LOW, high)
        length = np.linalg.norm(apart, axis=-1) if apart is not None else np.zeros(0)
        if np.isfinite(length).any():
            return float(np.nanmedian(length))
    return 0.0


def handedness(labels: Sequence[str], positions: np.ndarray) -> float:
    """How surely the body is as bodies are: near +1 where ahead, left and up, as the names of markers tell them, form a
    right-handed frame; near -1 where it is mirrored (its coordinates, or its left and right labels); 0 where unknown.

    positions: (T, M, 3), any unit and axes, NaN where not seen."""
    ahead, up, sides = _between(labels, positions, BACK, FRONT), _upwards(labels, positions), _sides(labels)
    if ahead is None or up is None or not sides:
        return 0.0
    few = _few(positions)
    left = unit_vectors(_mean(few[:, [i for i, _ in sides]] - few[:, [j for _, j in sides]], axis=1), np.nan, _TINY)
    with np.errstate(invalid="ignore"):
        volume = np.einsum("ti,ti->t", np.cross(ahead, left), up)
    told = volume[np.abs(volume) > _SURE]
    return float(np.sign(told).mean()) if len(told) else 0.0


def _upwards(labels, positions) -> np.ndarray | None:
    """(t, 3) unit directions from the feet to the head, or to the pelvis where only legs are marked."""
    whole = _between(labels, positions, LOW, HIGH)
    return _between(labels, positions, LOW, MIDDLE) if whole is None else whole


def _few(positions: np.ndarray) -> np.ndarray:
    """Some frames, spread over the trial."""
    return positions[:: max(len(positions) // _FRAMES, 1)]


def _between(labels, positions, start: re.Pattern, end: re.Pattern) -> np.ndarray | None:
    """(t, 3) unit directions from the middle of some markers to that of others; None where there are none."""
    apart = _apart(labels, positions, start, end)
    direction = None if apart is None else unit_vectors(apart, np.nan, _TINY)
    return None if direction is None or not np.isfinite(direction).any() else direction


def _apart(labels, positions, start: re.Pattern, end: re.Pattern) -> np.ndarray | None:
    """(t, 3) from the middle of some markers to that of others, in some frames; None where no labels are such."""
    ends = [[i for i, label in enumerate(labels) if pattern.search(label)] for pattern in (start, end)]
    if not all(ends):
        return None
    few = _few(positions)
    return _mean(few[:, ends[1]], axis=1) - _mean(few[:, ends[0]], axis=1)


def _sides(labels) -> list[tuple[int, int]]:
    """(left, right) indices of markers whose names differ in their first letter, or in Left and Right."""
    where = {label.upper(): i for i, label in enumerate(labels)}
    swapped = ((label, re.sub(r"^L(EFT)?", lambda m: "RIGHT" if m[1] else "R", label)) for label in where)
    return [(where[label], where[other]) for label, other in swapped if other != label and other in where]


def _mean(values: np.ndarray, axis: int) -> np.ndarray:
    """The mean of what is a number; NaN where nothing is."""
    seen = np.isfinite(values)
    count = seen.sum(axis=axis)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(count > 0, np.where(seen, values, 0).sum(axis=axis) / count, np.nan)
