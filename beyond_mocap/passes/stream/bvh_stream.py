"""The text of a BVH stream, as motion capture suits send it: taken apart while it arrives, piece by piece.

Two forms are understood, mixed as they come:

- **BVH**: the file's own text. The hierarchy once (over UDP: in a datagram of its own, better once a second, since
  who listens may have come late), then one line of numbers a frame. `Frames:` and `Frame Time:` may stand between.
- **Neuron** (Axis Neuron and Axis Studio, "BVH" broadcasting with "String" format): numbers only, each frame ended by
  `||` and begun by the avatar's number and name. There is no hierarchy: it has to be known from a BVH file that the
  same suit has exported.

A line `# sent SECONDS` (of the Unix clock) before a frame lets who listens know how long it has been on the way; other
lines that begin with # are left out. Of several avatars the first that is seen is taken. Everything else is rubbish:
it is counted and left out, and never raises.
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
"""Bytes of a line or a hierarchy; more is rubbish."""
_LARGEST = 1e7
_END = re.compile(rb"\|\||\n")
_SENT = re.compile(r"#\s*sent\s+([0-9.]+)")
_PLACE = Path("the stream")


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame: values (C,) in the file's own units and degrees; sent: seconds of the Unix clock, or None; rows: how
    such values become poses."""

    values: np.ndarray
    sent: float | None
    rows: BvhRows


class BvhStream:
    """Takes a stream's bytes apart.

    hierarchy: the text of a BVH file's HIERARCHY section that is known beforehand, or None. rows: how values become
    poses, as soon as a hierarchy and a frame are there. frame_time: seconds, as the stream says, else None. rubbish:
    pieces that were left out; others: frames of other avatars. told: what was wrong with the last rubbish, one line."""

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
        """The frames that `data` completes. whole: nothing follows that belongs to it (a datagram)."""
        pieces = _END.split(self._waiting + data)
        self._waiting = pieces.pop()
        if whole and self._waiting:
            pieces.append(self._waiting)
            self._waiting = b""
        if len(self._waiting) > LONGEST:
            self._waiting = b""
            self._reject("a line without an end")
        found = [self._piece(piece.decode("utf-8", "replace").strip()) for piece in pieces]
        if whole and self._opened:
            self._opened, self._depth = [], 0
            self._reject("a hierarchy that is cut off")
        return [frame for frame in found if frame is not None]

    def lost(self) -> None:
        """The connection was lost: what is half there will not be completed,
        and who comes next may have another name."""
        self._waiting, self._opened, self._depth, self._sent, self._avatar = b"", [], 0, None, None

    def _piece(self, line: str) -> Frame | None:
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
        self._opened.append(line)
        before, self._depth = self._depth, self._depth + line.count("{") - line.count("}")
        if self._depth < 0 or sum(map(len, self._opened[-1:])) > 4096 or len(self._opened) > 20000:
            self._opened, self._depth = [], 0
            self._reject("a hierarchy whose brackets do not match")
        elif self._depth == 0 and before > 0:
            text, self._opened = "\n".join(self._opened), []
            self._begin(text)

    def _begin(self, text: str) -> None:
        """Take a hierarchy over; the one there is stays where it is the same, or where this one is none."""
        if text == self._text:
            return
        try:
            columns = sum(len(channels) for channels in _parsed(text, None).channels)
        except InputError as error:
            self._reject(str(error))
            return
        self._text, self._columns, self.rows = text, columns, None

    def _frame(self, line: str) -> Frame | None:
        words = line.split()
        sent, self._sent = self._sent, None
        name = words[1] if len(words) > 2 and words[0].isdigit() and _number(words[1]) is None else None
        if name is not None:  # the avatar's, behind its number
            if name != (self._avatar or name):
                self.others += 1
                return None
            words = words[2:]
        try:
            values = np.array(words, dtype=float)
        except ValueError:
            return self._reject(f"{line[:40]!r} instead of numbers")
        if self._text is None:
            return self._reject("frames before any hierarchy: let the sender begin anew, or choose the suit's BVH file")
        if len(values) != self._columns:
            return self._reject(f"{len(values)} numbers in a frame; expected {self._columns} as in the hierarchy")
        if not np.all(np.abs(values) < _LARGEST):  # also where one is no number
            return self._reject("numbers that no body has")
        if self.rows is None and not self._start(values):
            return None
        self._avatar = name or self._avatar
        return Frame(values, sent, self.rows)

    def _start(self, values: np.ndarray) -> bool:
        try:
            self.rows = BvhRows(_parsed(self._text, values), self.unit)
        except InputError as error:
            self._reject(str(error))
            return False
        return True

    def _reject(self, what: str) -> None:
        self.rubbish += 1
        self.told = what


def hierarchy_of(path) -> str:
    """The HIERARCHY section of a BVH file as text. InputError for what is no BVH file."""
    from ...files.bvh import bvh_text

    bvh_text.parse(path)
    text = Path(path).read_text("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")
    return re.split(r"(?im)^[ \t]*MOTION\b", text.removeprefix("\ufeff"))[0].strip()


def _parsed(text: str, values: np.ndarray | None) -> BvhText:
    """A hierarchy and one row (zeros where there is none yet) as if it were a file."""
    columns = sum(int(count) for count in re.findall(r"(?im)^[ \t]*CHANNELS[ \t]+([0-6])\b", text))
    row = " ".join(["0"] * columns)
    found = parse_data(_PLACE, f"{text}\nMOTION\nFrames: 1\nFrame Time: 0.01\n{row}\n".encode())
    return found if values is None else replace(found, values=np.asarray(values)[None])


def _number(word: str) -> float | None:
    """The word as a finite number, else None."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
