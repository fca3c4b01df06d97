"""Check values from a JSON text; InputErrors name the place of an invalid value."""

from __future__ import annotations

import json
import math

from ..base.errors import InputError


def parse_json(text: str, name: str, page: str):
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
    if not text.strip():
        raise InputError(name, "the file is empty", "JSON", f"see {page}")
    try:
        return json.loads(text, object_pairs_hook=_build_unique_object, parse_constant=_reject_constant)
    except json.JSONDecodeError as error:
        place = f"{name}:{error.lineno}:{error.colno}"
        raise InputError(place, "not JSON from here on", "JSON", f"see {page}") from None
    except RecursionError:
        raise InputError(name, "nested too deeply", "JSON", f"see {page}") from None
    except ValueError as error:
        found = "a number of thousands of digits" if "set_int_max_str_digits" in str(error) else str(error)
        raise InputError(name, found, "JSON", f"see {page}") from None


def _build_unique_object(pairs) -> dict:
    """Build an object in which no name is repeated."""
    out = dict(pairs)
    if len(out) != len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(name for name in names if names.count(name) > 1)!r} is repeated in one object")
    return out


def _reject_constant(constant: str):
    raise ValueError(f"{constant} is not a number")


def check_object(value, where: str) -> None:
    """Check that a value is an object.

    Args:
        value: the value.
        where: its place, for errors.
    Raises:
        InputError: if it is not.
    """
    if not isinstance(value, dict):
        raise InputError(where, describe_value(value), "an object {...}", "correct the value")


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
            raise InputError(where, f"no {name!r}", f"the names {', '.join(needed)}", f"add {name!r}")
    for name in value:
        if name not in known:
            raise InputError(where, describe_value(name), f"one of {', '.join(sorted(known))}", "check the spelling")


def check_number(value, where: str) -> float:
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
        is_valid = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        is_valid = False
    if not is_valid:
        raise InputError(where, describe_value(value), "a number", "correct the value")
    return float(value)


def check_whole_number(value, where: str) -> int:
    """Check that a value is a whole number.

    Args:
        value: the value.
        where: its place, for errors.
    Returns:
        The number.
    Raises:
        InputError: if it is not.
    """
    if isinstance(value, bool) or not isinstance(value, int) and check_number(value, where) != int(value):
        raise InputError(where, describe_value(value), "a whole number", "correct the value")
    return int(value)


def check_bool(value, where: str) -> bool:
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
        raise InputError(where, describe_value(value), "true or false", "correct the value")
    return value


def check_text(value, where: str) -> str:
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
        raise InputError(where, describe_value(value), "a text", "correct the value")
    return value


def check_numbers(value, where: str, count: int, expected: str) -> tuple:
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
        raise InputError(where, describe_value(value), expected, "correct the value")
    return tuple(check_number(one, where) for one in value)


def check_list(value, where: str) -> list:
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
        raise InputError(where, describe_value(value), "a list [...]", "correct the value")
    return list(value)


def check_texts(value, where: str) -> tuple[str, ...]:
    """Check that a value is a list of texts.

    Args:
        value: the value.
        where: its place, for errors.
    Returns:
        The texts.
    Raises:
        InputError: if it is not.
    """
    return tuple(check_text(one, where) for one in check_list(value, where))


def describe_value(value) -> str:
    """Format a value as JSON, shortened to 40 characters, for errors.

    Args:
        value: the value.
    Returns:
        The text.
    """
    try:
        formatted = json.dumps(value, ensure_ascii=True, default=str)
    except RecursionError:  # a value that can just be read may be too deep to write
        return "a value nested too deeply"
    return formatted if len(formatted) <= 40 else formatted[:37] + "..."
