"""Kinds of options: each turns the text of an option into a number, or says what was expected."""

from __future__ import annotations

import argparse
import contextlib


def positive(text: str) -> float:
    """A number above 0."""
    return between(text, 1e-9, 1e6, "a positive number")


def rate(text: str) -> float:
    """Frames per second."""
    return between(text, 1.0, 480.0, "1 to 480 frames per second")


def share(text: str) -> float:
    """A share of 1."""
    return between(text, 0.0, 1.0, "a number from 0 to 1")


def seed(text: str) -> int:
    """What random choices begin with, as all who draw numbers take it."""
    return whole(text, 0, 2**31 - 1, "0 to 2147483647")


def between(text: str, low: float, high: float, expected: str, kind: type = float) -> float:
    """The number of a kind, float or int, that an option's text says, where it lies from `low` to `high`."""
    with contextlib.suppress(ValueError):
        value = kind(text)
        if low <= value <= high:
            return value
    raise argparse.ArgumentTypeError(f"{text!r} is not {expected}")


def whole(text: str, low: int, high: int, expected: str) -> int:
    """The whole number that an option's text says, where it lies from `low` to `high`."""
    return between(text, low, high, expected, int)
