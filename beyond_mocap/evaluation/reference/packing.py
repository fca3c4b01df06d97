"""Nested records as a few plain arrays, and back: what a library's many recordings have lies in one array each."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

_COUNT = "count"  # ending of the name of the array with the lengths of others


def pack_values(kind: Any, values: Sequence, name: str) -> dict[str, np.ndarray]:
    """Pack values of one kind.

    Args:
        kind: `np.ndarray`, float or int, a tuple of one kind, one of them or None, or a dataclass of such fields.
        values: of that kind; arrays differ in their first axis alone.
        name: of the arrays, or how their names begin.
    Returns:
        Arrays by name.
    """
    if kind is np.ndarray:
        joined = np.concatenate(values) if values else np.zeros(0)
        return {name: joined, f"{name}.{_COUNT}": np.array([len(value) for value in values], int)}
    if kind in (float, int):
        return {name: np.array(values, kind)}
    if (item := _find_item(kind)) is not None:
        rows = [() if value is None else value if get_origin(kind) is tuple else (value,) for value in values]
        counts = np.array([len(row) for row in rows], int)
        return {f"{name}.{_COUNT}": counts, **pack_values(item, list(chain.from_iterable(rows)), f"{name}.item")}
    parts = (pack_values(part, [getattr(value, field) for value in values], f"{name}.{field}")
             for field, part in get_type_hints(kind).items())
    return {key: array for arrays in parts for key, array in arrays.items()}


def restore_values(kind: Any, arrays: dict[str, np.ndarray], name: str) -> list:
    """Restore what `pack_values` packed; KeyError or ValueError for arrays of another form."""
    if kind is np.ndarray:
        return _cut_parts(arrays[name], arrays[f"{name}.{_COUNT}"])
    if kind in (float, int):
        return arrays[name].tolist()
    if (item := _find_item(kind)) is not None:
        rows = _cut_parts(restore_values(item, arrays, f"{name}.item"), arrays[f"{name}.{_COUNT}"])
        return [tuple(row) if get_origin(kind) is tuple else row[0] if row else None for row in rows]
    hints = get_type_hints(kind)
    columns = (restore_values(part, arrays, f"{name}.{field}") for field, part in hints.items())
    return [kind(**dict(zip(hints, row))) for row in zip(*columns, strict=True)]


def _find_item(kind: Any) -> Any:
    """Find the kind of what a tuple of any length has, or of a value that may be None; None for other kinds."""
    return get_args(kind)[0] if get_origin(kind) is tuple or type(None) in get_args(kind) else None


def _cut_parts(values, counts: np.ndarray) -> list:
    """Cut a list or an array into parts of these lengths; ValueError where it has another length."""
    ends = np.cumsum(counts).tolist()
    if len(values) != (ends[-1] if ends else 0):
        raise ValueError("other lengths than stated")
    return [values[start:end] for start, end in zip([0, *ends], ends)]
