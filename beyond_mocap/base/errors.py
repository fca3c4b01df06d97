"""The core's small family of errors: each knows the exit status that `../shared/contract.md` promises for it; and lines
that are told without being errors.

A message is one line: what was found where, what was expected, and the next step. The command line prints it to stderr,
an operator puts it into Blender's report; nobody else formats it again.
"""

from __future__ import annotations


class BeyondMocapError(Exception):
    """Anything the user can do something about. `exit_status` is the command's exit status."""

    exit_status = 2


class InputError(BeyondMocapError):
    """A file, an option or an array is not what it has to be (exit status 2)."""

    def __init__(self, where: object, found: str, expected: str = "", next_step: str = ""):
        """`where`: file, file:line or option; `found`, `expected`, `next_step`: short phrases without a full stop."""
        parts = [f"{where}: {found}"]
        if expected:
            parts.append(f"expected {expected}")
        if next_step:
            parts.append(next_step)
        super().__init__("; ".join(" ".join(part.split()) for part in parts))
        self.where = str(where)


class NotInLibrary(BeyondMocapError):
    """The library cannot do what is asked; `nearest` names what it has instead (exit status 3)."""

    exit_status = 3

    def __init__(self, message: str, nearest: tuple[str, ...] = ()):
        """`message`: one line; `nearest`: the nearest word combinations that the library holds."""
        super().__init__(" ".join(message.split()))
        self.nearest = tuple(nearest)


class Cancelled(BeyondMocapError):
    """The user stopped the work (exit status 130)."""

    exit_status = 130


class TimedLine(str):
    """A line of a report, with the seconds it is about, so that whoever shows it can go there.

    spans: (first, last) seconds on the track's clock, in the order of the line; () where it is about no time."""

    spans: tuple[tuple[float, float], ...]

    def __new__(cls, text: str, *spans: tuple[float, float]):
        """`text`: the line; `spans`: see above."""
        line = super().__new__(cls, text)
        line.spans = tuple((float(first), float(last)) for first, last in spans)
        return line


def told_time(seconds: float) -> str:
    """Seconds as a line says them: to the microsecond, however many they are, and no zeros behind."""
    return f"{round(float(seconds), 6):.15g}"


def spans_of(line: str) -> tuple[tuple[float, float], ...]:
    """The seconds that a line is about; () for a plain text."""
    return getattr(line, "spans", ())
