"""Numbers that follow each other smoothly, kept as differences of differences of whole numbers: they pack well, and
come back as they were."""

from __future__ import annotations

import numpy as np

from ..errors import InputError

_UNKNOWN = -(2**31)


def packed_places(metres: np.ndarray) -> np.ndarray:
    """Places (N, k) m, to the millimetre and NaN where they are not known, as `places` reads them."""
    return packed(np.where(np.isnan(metres), _UNKNOWN, np.round(np.nan_to_num(metres) * 1000.0)))


def packed(values: np.ndarray) -> np.ndarray:
    """Whole numbers (N, k) as differences of differences, in the smallest type that holds them."""
    once = np.diff(values.astype(np.int64), axis=0, prepend=0)
    twice = once.copy()
    twice[2:] = np.diff(once[1:], axis=0)
    most = np.abs(twice).max(initial=0)
    return twice.astype(next(kind for kind in ("<i2", "<i4", "<i8") if most <= np.iinfo(kind).max))


def places(values: np.ndarray, where: str) -> np.ndarray:
    """(N, k) m of what `packed_places` has packed. InputError, with `where` before it, for other than whole numbers."""
    whole = unpacked(values, where)
    return np.where(whole == _UNKNOWN, np.nan, whole / 1000.0)


def unpacked(values: np.ndarray, where: str) -> np.ndarray:
    """What `packed` has packed, as floating point numbers. InputError, with `where` before it, for other than whole
    numbers."""
    if values.dtype.kind != "i":
        raise InputError(where, f"values of type {values.dtype}", "whole numbers")
    once = values.astype(np.int64)
    once[1:] = np.cumsum(once[1:], axis=0)
    return np.cumsum(once, axis=0).astype(float)
