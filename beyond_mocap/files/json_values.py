"""Values out of a JSON text, each told as InputError with its place where it is not what it has to be."""

from __future__ import annotations

import json
import math

from ..base.errors import InputError


def object_of(said: str, name: str, page: str):
    """What a text stands for, without names that come twice and without NaN; `page` of the docs describes it.
    InputError with line and column, after `name`."""
    try:
        return json.loads(said, object_pairs_hook=_once, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        raise InputError(f"{name}:{error.lineno}:{error.colno}", error.msg, "JSON", f"see {page}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(name, str(error) or "nested too deep", "JSON", f"see {page}") from None


def _once(pairs) -> dict:
    """An object in which no name comes twice."""
    out = dict(pairs)
    if len(out) != len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(name for name in names if names.count(name) > 1)!r} twice in one object")
    return out


def _no_number(said: str):
    raise ValueError(f"{said}, which is no number")


def check_object(value, where: str) -> None:
    """InputError where a value is no object."""
    if not isinstance(value, dict):
        raise InputError(where, shown(value), "an object {...}")


def check_names(value, where: str, known, needed) -> None:
    """InputError where a value is no object, lacks one of the `needed` names, or has one that is not `known`."""
    check_object(value, where)
    for name in needed:
        if name not in value:
            raise InputError(where, f"no {name!r}", f"{', '.join(needed)}")
    for name in value:
        if name not in known:
            raise InputError(where, shown(name), f"one of {', '.join(sorted(known))}", "check the spelling")


def number(value, where: str) -> float:
    """A finite number."""
    try:
        good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        good = False
    if not good:
        raise InputError(where, shown(value), "a number")
    return float(value)


def whole_number(value, where: str) -> int:
    """A whole number."""
    if isinstance(value, bool) or not isinstance(value, int) and number(value, where) != int(value):
        raise InputError(where, shown(value), "a whole number")
    return int(value)


def truth(value, where: str) -> bool:
    """true or false."""
    if not isinstance(value, bool):
        raise InputError(where, shown(value), "true or false")
    return value


def text(value, where: str) -> str:
    """A text."""
    if not isinstance(value, str):
        raise InputError(where, shown(value), "a text")
    return value


def numbers(value, where: str, count: int, expected: str) -> tuple:
    """So many finite numbers; `expected` is how they are told of."""
    if not isinstance(value, (list, tuple)) or len(value) != count:
        raise InputError(where, shown(value), expected)
    return tuple(number(one, where) for one in value)


def entries(value, where: str) -> list:
    """A list."""
    if not isinstance(value, (list, tuple)):
        raise InputError(where, shown(value), "a list [...]")
    return list(value)


def shown(value) -> str:
    """A value as it stands in the file, shortened."""
    try:
        said = json.dumps(value, ensure_ascii=True, default=str)
    except RecursionError:  # what can just be read may be too deep to be written
        return "a value nested too deep"
    return said if len(said) <= 40 else said[:37] + "..."
