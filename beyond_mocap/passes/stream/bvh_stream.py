"""Parser for the text of a BVH stream, as motion capture suits send it, piece by piece as it arrives.

Two forms are read, also mixed:

- **BVH**: the text of a BVH file. The hierarchy once (over UDP: in a datagram of its own, better once a second, since a
  listener may start late), then one line of numbers for each frame. `Frames:` and `Frame Time:` may come between.
- **Neuron** (Axis Neuron and Axis Studio, "BVH" broadcasting with "String" format): numbers only; each frame starts
  with the avatar's number and name and ends with `||`. There is no hierarchy: it has to be known from a BVH file that
  the same suit has exported.

A line `# sent SECONDS` (Unix clock) before a frame gives the time at which it was sent; other lines that begin with #
are ignored. Of several avatars the first one seen is used. Everything else is invalid: it is counted and skipped, and
never raises.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...files.bvh.bvh import BvhRows
from ...files.bvh.bvh_text import BvhText, parse_bvh_text

LONGEST_LINE = 1 << 20
"""Most bytes of a line or a hierarchy; longer ones are invalid."""
_LARGEST_VALUE = 1e7  # in the stream's units or degrees: no body has such a value
_END = re.compile(rb"\|\||\n")
_SENT = re.compile(r"#\s*sent\s+([0-9.]+)")
_PLACE = Path("the stream")


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame of a stream.

    Attributes:
        values: (C,) channels in the stream's own units and degrees.
        sent: s of the Unix clock at which it was sent, or None.
        rows: converts such values to poses.
    """

    values: np.ndarray
    sent: float | None
    rows: BvhRows


class BvhStream:
    """Parses the bytes of a stream.

    Args:
        hierarchy: text of a BVH file's HIERARCHY section that is known beforehand, or None.
        unit: metres per unit of the stream; None: guessed.
    Attributes:
        rows: converts values to poses; None until there are a hierarchy and a frame.
        frame_time: s, if the stream gives it, otherwise None.
        invalid_count: number of invalid pieces that were skipped.
        other_avatars: number of frames of other avatars.
        last_error: what was wrong with the last invalid piece, one line.
    """

    def __init__(self, hierarchy: str | None = None, unit: float | None = None):
        self.unit = unit
        self.rows: BvhRows | None = None
        self.frame_time: float | None = None
        self.invalid_count = self.other_avatars = 0
        self.last_error = ""
        self._text: str | None = None
        self._columns = 0
        self._partial = b""
        self._hierarchy_lines: list[str] = []
        self._depth = 0
        self._sent: float | None = None
        self._avatar: str | None = None
        if hierarchy is not None:
            self._use_hierarchy(hierarchy)

    def feed(self, data: bytes, whole: bool = False) -> list[Frame]:
        """Parse the next bytes.

        Args:
            data: bytes that have arrived.
            whole: whether nothing follows that belongs to them (a datagram).
        Returns:
            The frames that these bytes complete.
        """
        pieces = _END.split(self._partial + data)
        self._partial = pieces.pop()
        if whole and self._partial:
            pieces.append(self._partial)
            self._partial = b""
        if len(self._partial) > LONGEST_LINE:
            self._partial = b""
            self._count_invalid("a line that does not end")
        found = [self._parse_line(piece.decode("utf-8", "replace").strip()) for piece in pieces]
        if whole and self._hierarchy_lines:
            self._hierarchy_lines, self._depth = [], 0
            self._count_invalid("an incomplete hierarchy")
        return [frame for frame in found if frame is not None]

    def drop_partial(self) -> None:
        """Drop incomplete pieces after the connection was lost; the next sender may have another avatar's name."""
        self._partial, self._hierarchy_lines, self._depth, self._sent, self._avatar = b"", [], 0, None, None

    def _parse_line(self, line: str) -> Frame | None:
        """Parse one line; only a line of numbers gives a frame."""
        if not line:
            return None
        if self._hierarchy_lines or line.upper().startswith("HIERARCHY"):
            return self._add_hierarchy_line(line)
        if line.startswith("#"):
            sent = _SENT.match(line)
            self._sent = _parse_number(sent.group(1)) if sent else self._sent
            return None
        upper = line.upper()
        if upper == "MOTION" or upper.startswith("FRAMES:"):
            return None
        if upper.startswith("FRAME TIME:"):
            seconds = _parse_number(line[11:])
            self.frame_time = seconds if seconds and 1e-4 <= seconds <= 1.0 else self.frame_time
            return None
        return self._parse_frame(line)

    def _add_hierarchy_line(self, line: str) -> None:
        """Collect one line of a hierarchy; the last bracket completes it."""
        self._hierarchy_lines.append(line)
        before, self._depth = self._depth, self._depth + line.count("{") - line.count("}")
        if self._depth < 0 or sum(map(len, self._hierarchy_lines[-1:])) > 4096 or len(self._hierarchy_lines) > 20000:
            self._hierarchy_lines, self._depth = [], 0
            self._count_invalid("a hierarchy whose brackets do not match")
        elif self._depth == 0 and before > 0:
            text, self._hierarchy_lines = "\n".join(self._hierarchy_lines), []
            self._use_hierarchy(text)

    def _use_hierarchy(self, text: str) -> None:
        """Use a hierarchy; the current one stays where the new one is the same or invalid."""
        if text == self._text:
            return
        try:
            columns = sum(len(channels) for channels in _parse_hierarchy(text, None).channels)
        except InputError as error:
            self._count_invalid(str(error))
            return
        self._text, self._columns, self.rows = text, columns, None

    def _parse_frame(self, line: str) -> Frame | None:
        """Parse the numbers of a frame."""
        words = line.split()
        sent, self._sent = self._sent, None
        name = words[1] if len(words) > 2 and words[0].isdigit() and _parse_number(words[1]) is None else None
        if name is not None:  # the avatar's name follows its number
            if name != (self._avatar or name):
                self.other_avatars += 1
                return None
            words = words[2:]
        try:
            values = np.array(words, dtype=float)
        except ValueError:
            return self._count_invalid(f"{line[:40]!r} instead of numbers")
        if self._text is None:
            return self._count_invalid("frames before any hierarchy: restart the sender, or choose the suit's BVH file")
        if len(values) != self._columns:
            return self._count_invalid(
                f"{len(values)} numbers in a frame; expected {self._columns} as in the hierarchy")
        if not np.all(np.abs(values) < _LARGEST_VALUE):  # true for NaN as well
            return self._count_invalid("NaN, infinite or impossibly large numbers")
        if self.rows is None and not self._build_rows(values):
            return None
        self._avatar = name or self._avatar
        return Frame(values, sent, self.rows)

    def _build_rows(self, values: np.ndarray) -> bool:
        """Build the conversion to poses from the hierarchy and the first frame's values (C,)."""
        try:
            self.rows = BvhRows(_parse_hierarchy(self._text, values), self.unit)
        except InputError as error:
            self._count_invalid(str(error))
            return False
        return True

    def _count_invalid(self, reason: str) -> None:
        """Count an invalid piece and store the reason."""
        self.invalid_count += 1
        self.last_error = reason


def read_hierarchy(path) -> str:
    """Read the HIERARCHY section of a BVH file as text.

    Raises:
        InputError: if it is no BVH file.
    """
    from ...files.bvh import bvh_text

    data = bvh_text.read_content(Path(path))
    bvh_text.parse_bvh_text(Path(path), data)
    return re.split(r"(?im)^[ \t]*MOTION\b", data.decode("utf-8", "replace"))[0].strip()


def _parse_hierarchy(text: str, values: np.ndarray | None) -> BvhText:
    """Parse a hierarchy with one row of values (zeros if there are none yet) as if it were a file."""
    columns = sum(int(count) for count in re.findall(r"(?im)^[ \t]*CHANNELS[ \t]+([0-6])\b", text))
    row = " ".join(["0"] * columns)
    parsed = parse_bvh_text(_PLACE, f"{text}\nMOTION\nFrames: 1\nFrame Time: 0.01\n{row}\n".encode())
    return parsed if values is None else replace(parsed, values=np.asarray(values)[None])


def _parse_number(text: str) -> float | None:
    """Parse a word as a finite number; None if it is not one."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
