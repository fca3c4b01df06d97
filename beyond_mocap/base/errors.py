"""The core's errors, each with the command's exit status for it, and messages with a time.

A message is one line: what is wrong and where, what was expected, and the next step. The command line prints it to
stderr, an operator puts it into Blender's report; no caller formats it again.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from .fixes import Fix

if TYPE_CHECKING:
    from typing import Self


_OTHER_VALUES = {"number": re.compile(r"(?:could not convert string to float|invalid literal for int\(\).*?): (.+)"),
                 "time": re.compile(r"Invalid isoformat string: (.+)")}  # expected value -> Python's text without it
_INNER_WORDS = re.compile(r"\b(array|arrays|shapes?|axis|dimensions?|broadcast|unpack|list|substring|iterable|sequence|"
                          r"arg|argument|object|cannot convert|not supported)\b")  # of Python's and numpy's texts


class BeyondMocapError(Exception):
    """An error that the user can do something about.

    Attributes:
        exit_status: exit status of the command.
        fixes: steps that repair it and that an interface can offer.
        parts: what is wrong and where, then what to do about it, which may be "".
    """

    exit_status = 2
    fixes: tuple[Fix, ...] = ()

    @property
    def parts(self) -> tuple[str, str]:
        return str(self), ""

    def offer(self, *fixes: Fix) -> Self:
        """Add steps that repair it.

        Args:
            fixes: after those that it has.
        Returns:
            The error itself.
        """
        self.fixes = (*self.fixes, *fixes)
        return self


class InputError(BeyondMocapError):
    """A file, an option or an array is invalid (exit status 2).

    Attributes:
        where: file, file:line or option, as text.
    """

    def __init__(self, where: object, found: str, expected: str = "", next_step: str = "", *,
                 fixes: tuple[Fix, ...] = ()):
        """Build the one-line message.

        Args:
            where: file, file:line or option.
            found: what was found there.
            expected: what was expected; "" for nothing to say.
            next_step: what to do next; "" for nothing to say. All three are short phrases without a full stop.
            fixes: steps that repair it and that an interface can offer.
        """
        parts = [f"{where}: {found}"]
        if expected:
            parts.append(f"expected {expected}")
        if next_step:
            parts.append(next_step)
        parts = [" ".join(part.split()) for part in parts]
        super().__init__("; ".join(parts))
        self.where, self.fixes = str(where), tuple(fixes)
        self._parts = parts[0], "; ".join(parts[1:])

    @property
    def parts(self) -> tuple[str, str]:
        return self._parts


class NotInLibraryError(BeyondMocapError):
    """The library lacks what was requested (exit status 3).

    Attributes:
        nearest: the nearest label combinations that the library has.
        line: line of the annotations, None if unknown.
    """

    exit_status = 3

    def __init__(self, message: str, nearest: tuple[str, ...] = (), line: int | None = None,
                 fixes: tuple[Fix, ...] = ()):
        """Build the one-line message.

        Args:
            message: one line; what to do is after its last semicolon.
            nearest: the nearest label combinations that the library has.
            line: line of the annotations, None if unknown.
            fixes: steps that repair it and that an interface can offer.
        """
        super().__init__(" ".join(message.split()))
        self.nearest = tuple(nearest)
        self.line, self.fixes = line, tuple(fixes)

    @property
    def parts(self) -> tuple[str, str]:
        found, _, step = str(self).rpartition("; ")
        return (found, step) if found else (step, "")

    def locate(self, where: object) -> NotInLibraryError:
        """Build the same error with its place in front.

        Args:
            where: the file with the annotations, or what they belong to.
        Returns:
            The error.
        """
        place = where if self.line is None else f"{where}:{self.line}"
        return NotInLibraryError(f"{place}: {self}", self.nearest, self.line, self.fixes)


class UserCancelledError(BeyondMocapError):
    """The user cancelled the work (exit status 130)."""

    exit_status = 130


class TimedMessage(str):
    """One line of a report with the times it refers to, so that an interface can jump there.

    Attributes:
        spans: (first, last) seconds on the track's clock, in the order of the line; () for a line without a time.
    """

    spans: tuple[tuple[float, float], ...]

    def __new__(cls, text: str, *spans: tuple[float, float]):
        """Build the line.

        Args:
            text: the line.
            spans: (first, last) seconds on the track's clock.
        """
        line = super().__new__(cls, text)
        line.spans = tuple((float(first), float(last)) for first, last in spans)
        return line


def build_read_error(path: str | os.PathLike, kind: str, error: Exception | None = None) -> InputError:
    """Build the error for a file that cannot be opened or read.

    Args:
        path: the file.
        kind: what it should be, such as "a C3D file".
        error: the exception that opening it raised; None after a failed `is_file`.
    Returns:
        The error: no such file, a folder, or the exception's reason.
    """
    if isinstance(error, ValueError):  # a path that no file can have
        return InputError(path, f"cannot be read ({error})", f"{kind} that is readable")
    if os.path.isdir(path):  # Windows reports a folder as a permission error
        return InputError(path, "is a folder", kind, "choose a file in it")
    if isinstance(error, FileNotFoundError) or not os.path.exists(path):
        return InputError(path, "no such file", kind, "check the path")
    reason = getattr(error, "strerror", None) or error
    if reason is None:
        return InputError(path, "is a device or a pipe", kind, "write its content into a file and choose that")
    return InputError(path, f"cannot be read ({reason})", f"{kind} that is readable")


def describe_damage(error: Exception) -> str:
    """Describe what is wrong with a file's values by the error that reading them raised.

    Args:
        error: the exception; what it says is left out where that is about the program and not about the file.
    Returns:
        A phrase without a full stop.
    """
    text = " ".join(str(error).split())
    if isinstance(error, KeyError):
        return f"no {text[:60]}"
    for kind, pattern in _OTHER_VALUES.items():
        if other := pattern.fullmatch(text):
            return f"{other[1][:60]} in the place of a {kind}"
    found = "values in other places, or of another kind, than expected"
    is_inner = not isinstance(error, ValueError) or not text or _INNER_WORDS.search(text)
    return found if is_inner else f"{found} ({text})"[:200]


def describe_no_folder(path: str | os.PathLike) -> str:
    """Describe what a path is that should be a folder and is none: a file, a device or a pipe, or nothing."""
    if os.path.isfile(path):
        return "is a file"
    return "is a device or a pipe" if os.path.exists(path) else "no such folder"


def format_seconds(seconds: float) -> str:
    """Format seconds for a message: to the microsecond, without trailing zeros.

    Args:
        seconds: any finite number.
    Returns:
        The shortest decimal text of the rounded number.
    """
    return f"{round(float(seconds), 6):.15g}"


def format_count(count: int, noun: str, plural: str = "") -> str:
    """Format a count with its noun for a message: "1 clip", "2 clips".

    Args:
        count: how many.
        noun: the noun for one.
        plural: the noun for several; "" adds an s.
    Returns:
        The text.
    """
    return f"{count} {noun if count == 1 else plural or noun + 's'}"


def format_some(names: Sequence[str], most: int = 6) -> str:
    """Format the first names of a list, and how many more there are.

    Args:
        names: the names.
        most: how many are written out.
    """
    listed = ", ".join(name or "(no name)" for name in names[:most])
    return listed + (f" and {len(names) - most} more" if len(names) > most else "")


def line_spans(line: str) -> tuple[tuple[float, float], ...]:
    """Return the times that a message refers to.

    Args:
        line: a `TimedMessage` or a plain text.
    Returns:
        (first, last) seconds on the track's clock; () for a plain text.
    """
    return getattr(line, "spans", ())
