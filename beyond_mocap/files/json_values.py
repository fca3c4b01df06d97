"""Check values from a JSON text; InputErrors name the place of an invalid value."""

from __future__ import annotations

import json
import math

from ..base.errors import InputError


def object_of(said: str, name: str, page: str):
    """Parse a JSON text, without duplicate names and without NaN.

    Args:
        text: the JSON text.
        name: the file's name for errors.
        page: page of the docs that describes it.
    Returns:
        The value.
    Raises:
        InputError: with line and column, if the text is invalid.
    """
    try:
        return json.loads(said, object_pairs_hook=_once, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        raise InputError(f"{name}:{error.lineno}:{error.colno}", error.msg, "JSON", f"see {page}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(name, str(error) or "nested too deeply", "JSON", f"see {page}") from None


def _once(pairs) -> dict:
    """Build an object in which no name is repeated."""
    out = dict(pairs)
    if len(out) != len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(name for name in names if names.count(name) > 1)!r} is repeated in one object")
    return out


def _no_number(said: str):
    raise ValueError(f"{said} is not a number")


def check_object(value, where: str) -> None:
    """Check that a value is an object.

    Args:
        value: the value.
        where: its place, for errors.
    Raises:
        InputError: if it is not.
    """
    if not isinstance(value, dict):
        raise InputError(where, shown(value), "an object {...}")


def check_names(value, where: str, known, needed) -> None:
    """Check that a value is an object with the right names.

    Args:
        value: the value.
        where: its place, for errors.
        known: all allowed names.
        needed: the required names.
    Raises:
        InputError: if it is not.
    """
    check_object(value, where)
    for name in needed:
        if name not in value:
            raise InputError(where, f"no {name!r}", f"{', '.join(needed)}")
    for name in value:
        if name not in known:
            raise InputError(where, shown(name), f"one of {', '.join(sorted(known))}", "check the spelling")


def number(value, where: str) -> float:
    """Check that a value is a finite number.

    Args:
        value: the value.
        where: its place, for errors.
    Returns:
        The number.
    Raises:
        InputError: if it is not.
    """
    try:
        good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        good = False
    if not good:
        raise InputError(where, shown(value), "a number")
    return float(value)


def whole_number(value, where: str) -> int:
    """Check that a value is a whole number.

    Args:
        value: the value.
        where: its place, for errors.
    Returns:
        The number.
    Raises:
        InputError: if it is not.
    """
    if isinstance(value, bool) or not isinstance(value, int) and number(value, where) != int(value):
        raise InputError(where, shown(value), "a whole number")
    return int(value)


def truth(value, where: str) -> bool:
    """Check that a value is true or false.

    Args:
        value: the value.
        where: its place, for errors.
    Returns:
        The value.
    Raises:
        InputError: if it is not.
    """
    if not isinstance(value, bool):
        raise InputError(where, shown(value), "true or false")
    return value


def text(value, where: str) -> str:
    """Check that a value is a text.

    Args:
        value: the value.
        where: its place, for errors.
    Returns:
        The text.
    Raises:
        InputError: if it is not.
    """
    if not isinstance(value, str):
        raise InputError(where, shown(value), "a text")
    return value


def numbers(value, where: str, count: int, expected: str) -> tuple:
    """Check that a value is a list of finite numbers.

    Args:
        value: the value.
        where: its place, for errors.
        count: number of entries.
        expected: what errors say they expect.
    Returns:
        The numbers.
    Raises:
        InputError: if it is not.
    """
    if not isinstance(value, (list, tuple)) or len(value) != count:
        raise InputError(where, shown(value), expected)
    return tuple(number(one, where) for one in value)


def entries(value, where: str) -> list:
    """Check that a value is a list.

    Args:
        value: the value.
        where: its place, for errors.
    Returns:
        The list.
    Raises:
        InputError: if it is not.
    """
    if not isinstance(value, (list, tuple)):
        raise InputError(where, shown(value), "a list [...]")
    return list(value)


def shown(value) -> str:
    """Format a value as JSON, shortened to 40 characters, for errors.

    Args:
        value: the value.
    Returns:
        The text.
    """
    try:
        said = json.dumps(value, ensure_ascii=True, default=str)
    except RecursionError:  # a value that can just be read may be too deep to write
        return "a value nested too deeply"
    return said if len(said) <= 40 else said[:37] + "..."
