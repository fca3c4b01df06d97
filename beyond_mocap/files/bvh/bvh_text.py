"""Parse the text of a BVH file: hierarchy and numbers in the file's own units and axes, without conversion.

BVH has no standard. This parser follows Meredith and Maddock (2001, "Motion Capture File Formats Explained"). It is
lenient where files differ (letter case, blanks, line ends, joint names with blanks) and strict where a body would be
wrong.
"""

from __future__ import annotations

import io
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.content import read_bytes
from ...base.errors import InputError, format_count
from ...base.memory import check_memory

POSITIONS = ("Xposition", "Yposition", "Zposition")
ROTATIONS = ("Xrotation", "Yrotation", "Zrotation")
_CHANNELS = {name.lower(): name for name in POSITIONS + ROTATIONS}
_SHORTEST_FRAME, _LONGEST_FRAME = 0.001, 1.0  # s; what is longer is mostly in milliseconds
_LARGE_FILE, _BYTES_PER_BYTE = 1e7, 4.0  # bytes; of memory for a byte of text: it is parsed, and motion is built of it
_LARGEST_ANGLE = 1e7  # degrees; larger values are damaged
_LARGEST_POSITION = 1e9  # 1000 km in millimetres
_MOST_JOINTS = 2000  # bodies with fingers and faces have some hundreds
_LONGEST_BONE = 500.0  # times the median: the longest of a body with a moving face is 100 times a bone of the face
MAX_BYTES = 2_000_000_000
"""Largest BVH file: 90 minutes of a body with fingers at 240 frames per second are about 1 GB."""
_EXPORT_AGAIN = "export the file again"
_DAMAGED = f"the file is truncated or damaged; {_EXPORT_AGAIN}"


@dataclass(frozen=True, kw_only=True)
class BvhText:
    """A file's content: J joints, parents before children; file units, file axes, degrees.

    Attributes:
        path: the file, for errors.
        names: J unique names.
        parents: J indices, -1 for joint 0.
        offsets: (J, 3).
        channels: J tuples of channel names.
        end_parents: E indices, the parents of the End Sites.
        end_offsets: (E, 3), the End Sites.
        frame_time: seconds.
        values: (T, C), the joints' channels in file order.
        first_row: line of the first frame.
        renamed: repeated names with their new names.
    """

    path: Path
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray
    channels: tuple[tuple[str, ...], ...]
    end_parents: tuple[int, ...]
    end_offsets: np.ndarray
    frame_time: float
    values: np.ndarray
    first_row: int
    renamed: tuple[tuple[str, str], ...]


def read_bvh_text(path) -> BvhText:
    """Read and parse a BVH file.

    Args:
        path: the file.
    Returns:
        Its content.
    Raises:
        InputError: with the line, if it is missing, truncated, damaged or not BVH; if memory lacks for it.
    """
    path = Path(path)
    data = read_content(path)
    if len(data) > _LARGE_FILE:
        check_memory(path, _BYTES_PER_BYTE * len(data), "cut it into shorter recordings")
    return parse_bvh_text(path, data)


def parse_bvh_text(path: Path, data: bytes) -> BvhText:
    """Parse the bytes of a BVH file.

    Args:
        path: the file's name for errors.
        data: the bytes, with unified line ends.
    Returns:
        Its content.
    Raises:
        InputError: with the line, if it is truncated, damaged or not BVH.
    """
    motion = re.search(rb"^[ \t]*MOTION\b[^\n]*\n?", data, re.M | re.I)
    if motion is None:
        raise InputError(path, "no MOTION section", "HIERARCHY, then MOTION", f"the file is truncated; {_EXPORT_AGAIN}")
    joints = _HierarchyParser(path).parse(_decode(data[: motion.start()]))
    line = data.count(b"\n", 0, motion.end()) + 1
    frames, frame_time, rows_start, line = _parse_motion_head(path, data, motion.end(), line)
    columns = sum(len(c) for c in joints.channels)
    if columns == 0:
        raise InputError(path, "no joint has channels", "a CHANNELS line per joint", _EXPORT_AGAIN)
    values = _parse_rows(path, data[rows_start - 1 :], columns, line)  # start at the previous line's end
    if len(values) != frames:
        raise InputError(
            f"{path}:{line}", f"{format_count(len(values), 'row')} of motion", f"{frames}, the number after Frames:",
            f"the file is {'truncated' if len(values) < frames else 'damaged'}; {_EXPORT_AGAIN}",
        )
    _check_sizes(path, joints, values, line)
    text = joints.build_text(frame_time, values, line)
    _check_bones(text)
    return text


def read_content(path: Path) -> bytes:
    """Read the bytes of a BVH file.

    Args:
        path: the file.
    Returns:
        The bytes with unified line ends.
    Raises:
        InputError: if it cannot be read or is not BVH.
    """
    data = read_bytes(path, "a BVH file", MAX_BYTES)
    data = data.removeprefix(b"\xef\xbb\xbf")
    if not data or data.isspace():
        raise InputError(path, "the file is empty", "a BVH file", _EXPORT_AGAIN)
    if b"\0" in data or not re.match(rb"\s*HIERARCHY\b", data, re.I):
        first = "binary content" if b"\0" in data else f"starts with {_decode(data.lstrip()[:12].split()[0])!r}"
        raise InputError(f"{path}:1", first, "HIERARCHY at the start", "choose a BVH file")
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in data else data


def _decode(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


class _HierarchyParser:
    """Parses the hierarchy token by token, with a stack instead of recursion: files may nest thousands of levels deep.
    """

    def __init__(self, path: Path):
        self.path = path
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: list = []
        self.channels: list[tuple[str, ...]] = []
        self.ends: list = []
        self.renamed: list[tuple[str, str]] = []
        self.line = 1
        self.stack: list[int | None] = []  # open joints; None for an End Site

    def parse(self, text: str) -> "_HierarchyParser":
        """Parse all joints of the HIERARCHY section."""
        lines = text.split("\n")
        for self.line, line in enumerate(lines, 1):
            words = line.replace("{", " { ").replace("}", " } ").split()
            while words:
                words = self._parse_statement(words)
        if self.stack:
            raise self._build_error(f"{len(self.stack)} brackets not closed", "a } for each {",
                                    "the hierarchy is truncated")
        if not self.names:
            raise self._build_error("no ROOT", "ROOT and a joint's name", _EXPORT_AGAIN)
        for joint, offset in enumerate(self.offsets):
            if offset is None:
                raise InputError(self.path, f"joint {self.names[joint]!r} has no OFFSET", "OFFSET x y z", _EXPORT_AGAIN)
        return self

    def build_text(self, frame_time: float, values: np.ndarray, first_row: int) -> BvhText:
        """Combine the joints with the motion's numbers."""
        ends = [(joint, offset) for joint, offset in self.ends if offset is not None]
        return BvhText(
            path=self.path, names=tuple(self.names), parents=tuple(self.parents), offsets=np.array(self.offsets),
            channels=tuple(self.channels), end_parents=tuple(joint for joint, _ in ends),
            end_offsets=np.array([offset for _, offset in ends]).reshape(-1, 3), frame_time=frame_time, values=values,
            first_row=first_row, renamed=tuple(self.renamed),
        )

    def _build_error(self, found: str, expected: str = "", next_step: str = _EXPORT_AGAIN) -> InputError:
        return InputError(f"{self.path}:{self.line}", found, expected, next_step)

    def _parse_statement(self, words: list[str]) -> list[str]:
        """Parse one statement; return the rest of the line."""
        keyword = words[0].upper()
        if keyword in ("HIERARCHY", "{"):
            return words[1:]
        if keyword in ("ROOT", "JOINT", "END"):
            return self._open_joint(keyword, words)
        if keyword == "}":
            if not self.stack:
                raise self._build_error("one } too many", "a { for each }")
            self.stack.pop()
            return words[1:]
        if keyword == "OFFSET":
            return self._parse_offset(words)
        if keyword == "CHANNELS":
            return self._parse_channels(words)
        raise self._build_error(f"{words[0]!r}", "ROOT, JOINT, End Site, OFFSET, CHANNELS or a bracket")

    def _open_joint(self, keyword: str, words: list[str]) -> list[str]:
        """Open a joint or End Site; return the rest of the line."""
        stop = words.index("{") if "{" in words else len(words)
        name = " ".join(words[1:stop])
        if (keyword == "ROOT") == bool(self.names) or (self.stack == [] and self.names):
            raise self._build_error(f"{keyword} {name}", "one ROOT with all joints inside it",
                                    "export one body per file")
        if self.stack and self.stack[-1] is None:
            raise self._build_error(f"{keyword} {name} inside an End Site", "}")
        parent = self.stack[-1] if self.stack else -1
        if keyword == "END":
            self.ends.append([parent, None])
            self.stack.append(None)
            return words[stop:]
        if not name:
            raise self._build_error(f"{keyword} without a name", f"{keyword} and a name")
        if len(self.names) == _MOST_JOINTS:
            raise self._build_error(f"more than {_MOST_JOINTS} joints", "the skeleton of a body")
        self.stack.append(len(self.names))
        self.names.append(self._make_unique(name))
        self.parents.append(parent)
        self.offsets.append(None)
        self.channels.append(())
        return words[stop:]

    def _make_unique(self, name: str) -> str:
        used, number, unique = set(self.names), 2, name
        while unique in used:
            unique, number = f"{name}_{number}", number + 1
        if unique != name:
            self.renamed.append((name, unique))
        return unique

    def _parse_offset(self, words: list[str]) -> list[str]:
        numbers = [_parse_number(word) for word in words[1:4]]
        if len(numbers) < 3 or any(number is None or abs(number) > _LARGEST_POSITION for number in numbers):
            raise self._build_error(f"{' '.join(words)[:60]!r}", "OFFSET and three numbers of normal size")
        if not self.stack:
            raise self._build_error("OFFSET outside of a joint", "ROOT first")
        if self.stack[-1] is None:
            self.ends[-1][1] = numbers
        else:
            self.offsets[self.stack[-1]] = numbers
        return words[4:]

    def _parse_channels(self, words: list[str]) -> list[str]:
        """Parse the channels of the open joint; return the rest of the line."""
        count = int(words[1]) if len(words) > 1 and re.fullmatch("[0-6]", words[1]) else None
        names = [_CHANNELS.get(word.lower()) for word in words[2 : 2 + (count or 0)]]
        if count is None or len(names) < count or None in names:
            raise self._build_error(f"{' '.join(words)[:90]!r}",
                                    "CHANNELS, a number (0 to 6), and Xposition ... Zrotation")
        if len(set(names)) < count:
            raise self._build_error("a channel is repeated", "each channel once per joint")
        if not self.stack or self.stack[-1] is None:
            raise self._build_error("CHANNELS outside of a joint", "a joint first")
        if self.channels[self.stack[-1]]:
            raise self._build_error("CHANNELS is repeated", "one CHANNELS line per joint")
        self.channels[self.stack[-1]] = tuple(names)
        return words[2 + count :]


def _parse_number(word: str) -> float | None:
    """Parse a word as a finite number, else None."""
    try:
        value = float(word) if "_" not in word else math.nan
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _parse_motion_head(path: Path, data: bytes, start: int, line: int) -> tuple[int, float, int, int]:
    """Parse the two lines after MOTION: frames, seconds per frame, and where the rows start (byte, line)."""
    frames_text, start, line = _parse_labelled_value(path, data, start, line=line, label=rb"Frames\s*:",
                                                     expected="Frames: and their number")
    frames = int(frames_text) if re.fullmatch(r"\d{1,12}", frames_text) else 0
    if frames < 1:
        raise InputError(f"{path}:{line - 1}", f"Frames: {frames_text[:40]}", "a whole number above 0", _EXPORT_AGAIN)
    expected = "Frame Time: and seconds per frame"
    time_text, start, line = _parse_labelled_value(path, data, start, line=line, label=rb"Frame\s*Time\s*:",
                                                   expected=expected)
    frame_time = _parse_number(time_text)
    if frame_time is None or not _SHORTEST_FRAME <= frame_time <= _LONGEST_FRAME:
        raise InputError(
            f"{path}:{line - 1}", f"Frame Time: {time_text[:40]}",
            f"seconds, {_SHORTEST_FRAME:g} to {_LONGEST_FRAME:g}: 0.0333333 for 30 frames per second",
            "correct that line",
        )
    return frames, frame_time, start, line


def _parse_labelled_value(path: Path, data: bytes, start: int, line: int, label: bytes, expected: str) -> tuple[str,
        int, int]:
    """Parse the value after `label` on the next line that is not blank; also return where the line after it starts."""
    while True:
        stop = data.find(b"\n", start)
        stop = len(data) if stop < 0 else stop
        text = data[start:stop].strip()
        if text or stop == len(data):
            break
        start, line = stop + 1, line + 1
    match = re.match(label, text, re.I)
    if match is None:
        raise InputError(f"{path}:{line}", f"{_decode(text[:40])!r}", expected, _DAMAGED)
    return _decode(text[match.end() :].strip()), stop + 1, line + 1


def _parse_rows(path: Path, text: bytes, columns: int, line: int) -> np.ndarray:
    """Parse the motion's numbers (T, columns); InputError with the first invalid line."""
    if not text or text.isspace():
        raise InputError(f"{path}:{line}", "no rows of motion", f"rows of {columns} numbers", _DAMAGED)
    try:
        values = np.loadtxt(io.BytesIO(text), comments=None, ndmin=2) + 0.0  # adding 0 removes the sign of -0.0
        if values.shape[1] == columns and -1e300 < values.min() and values.max() < 1e300:
            return values
    except ValueError:
        pass
    raise _build_row_error(path, text, columns, line)


def _check_sizes(path: Path, joints: _HierarchyParser, values: np.ndarray, line: int) -> None:
    if max(values.max(), -values.min()) <= _LARGEST_ANGLE:
        return
    names = [f"{name} {c}" for name, channels in zip(joints.names, joints.channels) for c in channels]
    for row, column in np.argwhere(np.abs(values) > _LARGEST_ANGLE):
        if names[column].endswith("rotation"):
            found = f"{values[row, column]:.3g} degrees in {names[column]}, frame {row}"
            raise InputError(f"{path}:{line + row}", found, "an angle", _EXPORT_AGAIN)
        if abs(values[row, column]) > _LARGEST_POSITION:
            found = f"a position beyond 1000 km in {names[column]}, frame {row}"
            raise InputError(f"{path}:{line + row}", found, "a person's motion", _EXPORT_AGAIN)


def _check_bones(text: BvhText) -> None:
    """Check that no bone is far longer than the others: the unit would be estimated by it, or the body reach for
    kilometres. Joints with positions of their own are no bones.
    """
    joints = [joint for joint, names in enumerate(text.channels)
              if text.parents[joint] >= 0 and not set(names) & set(POSITIONS)]
    lengths = np.linalg.norm(text.offsets[joints], axis=1)
    usual = float(np.median(lengths[lengths > 0.0])) if np.any(lengths > 0.0) else math.inf
    if len(lengths) and lengths.max() > _LONGEST_BONE * usual:
        name, length = text.names[joints[int(lengths.argmax())]], lengths.max()
        raise InputError(text.path, f"joint {name!r} is {length:.6g} from its parent, half of the joints less than "
                         f"{usual:.4g}", "the bones of a body", _EXPORT_AGAIN)


def _build_row_error(path: Path, text: bytes, columns: int, line: int) -> InputError:
    """Build the error of the first invalid row; `text` begins with the end of the line before `line`."""
    for at, row in enumerate(_decode(text).split("\n"), line - 1):
        words = row.split()
        invalid = next((word for word in words if _parse_number(word) is None or abs(float(word)) >= 1e300), None)
        if invalid is not None:
            return InputError(f"{path}:{at}", f"{invalid[:30]!r}", "a number of normal size", _EXPORT_AGAIN)
        if words and len(words) != columns:
            expected = f"{columns}, one per channel of the hierarchy"
            return InputError(f"{path}:{at}", f"{len(words)} numbers", expected, _DAMAGED)
    return InputError(f"{path}:{line}", "numbers that cannot be read", f"rows of {columns} numbers", _EXPORT_AGAIN)
