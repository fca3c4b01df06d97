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
from ...files.bvh.bvh_text import BvhText, parse_data

LONGEST = 1 << 20
"""Most bytes of a line or a hierarchy; longer ones are invalid."""
_LARGEST = 1e7  # in the stream's units or degrees: no body has such a value
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
        self.rubbish = self.others = 0
        self.told = ""
        self._text: str | None = None
        self._columns = 0
        self._waiting = b""
        self._opened: list[str] = []
        self._depth = 0
        self._sent: float | None = None
        self._avatar: str | None = None
        if hierarchy is not None:
            self._begin(hierarchy)

    @property
    def known(self) -> bool:
        """Whether there is a hierarchy."""
        return self._text is not None

    def feed(self, data: bytes, whole: bool = False) -> list[Frame]:
        """Parse the next bytes.

        Args:
            data: bytes that have arrived.
            whole: whether nothing follows that belongs to them (a datagram).
        Returns:
            The frames that these bytes complete.
        """
        pieces = _END.split(self._waiting + data)
        self._waiting = pieces.pop()
        if whole and self._waiting:
            pieces.append(self._waiting)
            self._waiting = b""
        if len(self._waiting) > LONGEST:
            self._waiting = b""
            self._reject("a line that does not end")
        found = [self._piece(piece.decode("utf-8", "replace").strip()) for piece in pieces]
        if whole and self._opened:
            self._opened, self._depth = [], 0
            self._reject("an incomplete hierarchy")
        return [frame for frame in found if frame is not None]

    def lost(self) -> None:
        """Drop incomplete pieces after the connection was lost; the next sender may have another avatar's name."""
        self._waiting, self._opened, self._depth, self._sent, self._avatar = b"", [], 0, None, None

    def _piece(self, line: str) -> Frame | None:
        """Parse one line; only a line of numbers gives a frame."""
        if not line:
            return None
        if self._opened or line.upper().startswith("HIERARCHY"):
            return self._hierarchy_line(line)
        if line.startswith("#"):
            sent = _SENT.match(line)
            self._sent = _number(sent.group(1)) if sent else self._sent
            return None
        upper = line.upper()
        if upper == "MOTION" or upper.startswith("FRAMES:"):
            return None
        if upper.startswith("FRAME TIME:"):
            seconds = _number(line[11:])
            self.frame_time = seconds if seconds and 1e-4 <= seconds <= 1.0 else self.frame_time
            return None
        return self._frame(line)

    def _hierarchy_line(self, line: str) -> None:
        """Collect one line of a hierarchy; the last bracket completes it."""
        self._opened.append(line)
        before, self._depth = self._depth, self._depth + line.count("{") - line.count("}")
        if self._depth < 0 or sum(map(len, self._opened[-1:])) > 4096 or len(self._opened) > 20000:
            self._opened, self._depth = [], 0
            self._reject("a hierarchy whose brackets do not match")
        elif self._depth == 0 and before > 0:
            text, self._opened = "\n".join(self._opened), []
            self._begin(text)

    def _begin(self, text: str) -> None:
        """Use a hierarchy; the current one stays where the new one is the same or invalid."""
        if text == self._text:
            return
        try:
            columns = sum(len(channels) for channels in _parsed(text, None).channels)
        except InputError as error:
            self._reject(str(error))
            return
        self._text, self._columns, self.rows = text, columns, None

    def _frame(self, line: str) -> Frame | None:
        """Parse the numbers of a frame."""
        words = line.split()
        sent, self._sent = self._sent, None
        name = words[1] if len(words) > 2 and words[0].isdigit() and _number(words[1]) is None else None
        if name is not None:  # the avatar's name follows its number
            if name != (self._avatar or name):
                self.others += 1
                return None
            words = words[2:]
        try:
            values = np.array(words, dtype=float)
        except ValueError:
            return self._reject(f"{line[:40]!r} instead of numbers")
        if self._text is None:
            return self._reject("frames before any hierarchy: restart the sender, or choose the suit's BVH file")
        if len(values) != self._columns:
            return self._reject(f"{len(values)} numbers in a frame; expected {self._columns} as in the hierarchy")
        if not np.all(np.abs(values) < _LARGEST):  # true for NaN as well
            return self._reject("NaN, infinite or impossibly large numbers")
        if self.rows is None and not self._start(values):
            return None
        self._avatar = name or self._avatar
        return Frame(values, sent, self.rows)

    def _start(self, values: np.ndarray) -> bool:
        """Build the conversion to poses from the hierarchy and the first frame's values (C,)."""
        try:
            self.rows = BvhRows(_parsed(self._text, values), self.unit)
        except InputError as error:
            self._reject(str(error))
            return False
        return True

    def _reject(self, what: str) -> None:
        """Count an invalid piece and store the reason."""
        self.rubbish += 1
        self.told = what


def hierarchy_of(path) -> str:
    """Read the HIERARCHY section of a BVH file as text.

    Raises:
        InputError: if it is no BVH file.
    """
    from ...files.bvh import bvh_text

    bvh_text.parse(path)
    text = Path(path).read_text("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")
    return re.split(r"(?im)^[ \t]*MOTION\b", text.removeprefix("\ufeff"))[0].strip()


def _parsed(text: str, values: np.ndarray | None) -> BvhText:
    """Parse a hierarchy with one row of values (zeros if there are none yet) as if it were a file."""
    columns = sum(int(count) for count in re.findall(r"(?im)^[ \t]*CHANNELS[ \t]+([0-6])\b", text))
    row = " ".join(["0"] * columns)
    found = parse_data(_PLACE, f"{text}\nMOTION\nFrames: 1\nFrame Time: 0.01\n{row}\n".encode())
    return found if values is None else replace(found, values=np.asarray(values)[None])


def _number(word: str) -> float | None:
    """Parse a word as a finite number; None if it is not one."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
