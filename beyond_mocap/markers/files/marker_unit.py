"""Metres per unit of a file of markers: as its header says, or by the size of the body in it."""

from __future__ import annotations

import math
import os

import numpy as np

from ...base.errors import InputError

NAMES = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0,
    "dm": 0.1, "decimeter": 0.1, "decimeters": 0.1,
    "cm": 0.01, "centimeter": 0.01, "centimeters": 0.01, "centimetre": 0.01, "centimetres": 0.01,
    "mm": 0.001, "millimeter": 0.001, "millimeters": 0.001, "millimetre": 0.001, "millimetres": 0.001,
    "um": 1e-6, "micrometer": 1e-6, "micrometers": 1e-6,
    "in": 0.0254, "inch": 0.0254, "inches": 0.0254, '"': 0.0254,
    "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
}  # fmt: skip
_GUESSED = ("mm", "m", "cm", "in")
_USUAL = 1.5  # metres that the markers of a standing body span
_GUESS_RANGE = (0.5, 2.6)
_BODY_RANGE = (0.1, 10.0)
_HEIGHT_RANGE = (0.25, 2.8)  # from the feet to the head, or to the pelvis where nothing above is marked
_GIVEN_RANGE = (0.01, 100.0)
_SAY = "say --unit (metres per unit, or mm, cm, m, in)"


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


def given(path: str | os.PathLike, unit: float | str, positions: np.ndarray) -> tuple[float, str]:
    """(metres per unit, line on it) of a unit that the user gives; positions: (T, M, 3) in the file's unit. InputError
    where it is none, or makes something of the body that no body is."""
    metres, span = metres_per_unit(unit), body_span(positions)
    if span > 0 and not _GIVEN_RANGE[0] <= span * metres <= _GIVEN_RANGE[1]:
        found = f"makes {path} span {span * metres:.4g} m"
        raise InputError(f"--unit {str(unit)[:40]}", found, "a body", "check the unit")
    told = f"unit {metres:g} m, as given"
    usual = not span or _BODY_RANGE[0] <= span * metres <= _BODY_RANGE[1]
    return metres, told if usual else f"{told}: makes the markers span {span * metres:.4g} m, as no body does"


def decided(path: str | os.PathLike, said: str, positions: np.ndarray, height: float = 0.0) -> tuple[float, str]:
    """(metres per unit, line on how it was found). said: as the header has it; positions: (T, M, 3) in the file's unit;
    height: from feet to head (or pelvis) in it, 0 where unknown.

    InputError, which names --unit, where neither header nor size tell, or where the body is impossibly large or small
    by what the header says.
    """
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
