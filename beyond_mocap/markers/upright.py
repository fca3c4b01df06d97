"""Which way is up, and whether left is left, as the names of markers tell: heads stand above feet, toes before
heels."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ..base.vectors import unit_vectors

HIGH = re.compile(r"HD$|HEAD|^C7$|^T[1-4]$|CLAV|STRN|^MAN|SHO?U?L?D?E?R?$|ACR|SJN", re.I)
MIDDLE = re.compile(r"ASI|PSI|SACR", re.I)
LOW = re.compile(r"HEE|TOE|ANK|MAL|CALC|FOOT|MT\d?$|MFS|^[LR]?MT|MET", re.I)
FRONT, BACK = re.compile(r"TOE|MT\d?$|ASI", re.I), re.compile(r"HEE|CALC|PSI|SACR", re.I)
_DECISIVE = 0.7  # of the way from feet to head along one axis, in the median frame
_FRAMES = 400  # looked at
_TINY = 1e-300  # of any unit: only points that coincide have no direction
_SURE = 0.25  # sine volume of the three directions


def up_axis(labels: Sequence[str], positions: np.ndarray) -> tuple[int, int] | None:
    """(axis 0..2, sign) along which heads (or pelvis) lie above feet; None where the names do not tell or the body
    lies down.

    positions: (T, M, 3), any unit, any axes, NaN where not seen.
    """
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

    positions: (T, M, 3), any unit and axes, NaN where not seen.
    """
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
