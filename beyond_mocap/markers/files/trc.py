"""Read and write TRC files: markers as text, first written by Motion Analysis, today by OpenSim.

Five header lines (kind, names and values of the rate, count and unit, labels, coordinates), then one row for each
frame: number, time, X Y Z of every marker. There is no standard; blanks, missing cells, decimal commas, line ends and
encodings differ, and are read leniently. Anything that would make a body wrong is reported. Files are written in
millimetres, Y up.
"""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.content import read_bytes
from ...base.errors import InputError, format_count
from ...files.atomic import atomic_write
from ..trial import MAX_FPS, MIN_FPS, MarkerTrial
from .raw_markers import RawMarkers, build_trial

_MISSING = {"", "nan", "-", "na", "n/a", "null", "none", "inf", "-inf"}
_EXPORT_AGAIN = "export it again"
_MAX_FRAMES = 2_000_000  # with filled gaps
_MAX_BYTES = 4_000_000_000  # bytes of a file

_PLACE_FORMAT = "%.4f\t%.4f\t%.4f"


def read_trc(path: str | os.PathLike, unit: float | str | None = None, subject: str | None = None,
             up: str | None = None) -> MarkerTrial:  # fmt: skip
    """Read the trial in a TRC file. Y is up unless the body shows otherwise.

    Args:
        path: the file.
        unit: metres per unit or a name; None for the file's own.
        subject: whose markers, if labels have prefixes.
        up: the file's axis that points up; None to detect it.
    Returns:
        The trial, metres, Z up.
    Raises:
        InputError: if the file is missing, damaged or not a TRC file, with the line, and as `raw_markers.build_trial`.
    """
    path = Path(path)
    lines = _read_lines(path)
    head = _parse_header(path, lines)
    whole = _drop_cut_row(lines, head)
    times, positions = _parse_rows(path, whole, head)
    fps, start, positions, notes = _align_to_rate(path, head, times, positions)
    notes = [*notes, *_describe_early_end(head, len(positions), len(whole) < len(lines))]
    raw = RawMarkers(labels=head.labels, positions=positions, fps=fps, unit=head.unit, usual_up=(1, 1), start=start,
                     notes=[*head.notes, *notes])  # fmt: skip
    return build_trial(raw, path, unit, subject, up)


def _read_lines(path: Path) -> list[str]:
    """Read the lines of the file, without their ends."""
    data = read_bytes(path, "a TRC file", _MAX_BYTES)
    if not data.strip():
        raise InputError(path, "an empty file", "a TRC file", _EXPORT_AGAIN)
    if b"\0" in data[:4096]:
        raise InputError(path, "binary content", "a TRC file", "choose a TRC file")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return re.split(r"\r\n|\n|\r", text)


# -- head


@dataclass(frozen=True, kw_only=True)
class _Header:
    """The header of a file.

    Attributes:
        labels: M labels.
        columns: (M, 3) columns of the cells with X, Y and Z.
        first_row: index of the line where the rows begin.
        values: of the header, by their names in lower case.
        tabs: whether tabs separate the cells.
        notes: messages for people.
    """

    labels: list[str]
    columns: np.ndarray
    first_row: int
    values: dict[str, str]
    tabs: bool
    notes: list[str]

    @property
    def unit(self) -> str:
        """Unit in the header, "" without one."""
        return self.values.get("units", "")

    def parse_number(self, name: str) -> float:
        """Return a value of the header; NaN where it is absent or not a number."""
        try:
            value = float(self.values.get(name, "").replace(",", "."))
        except ValueError:
            return math.nan
        return value if math.isfinite(value) else math.nan


def _parse_header(path: Path, lines: list[str]) -> _Header:
    """Parse the header; raise InputError where it is not that of a TRC file."""
    label_line = next((i for i, line in enumerate(lines[:20]) if line.lstrip().lower().startswith("frame#")), None)
    if label_line is None:
        raise InputError(f"{path}:1", "no line that starts with Frame#", "a TRC header", "choose a TRC file")
    tabs = "\t" in lines[label_line]
    axis_line = next((i for i in range(label_line + 1, min(label_line + 4, len(lines)))
                      if re.match(r"\s*[XYZ]\d+(\s|$)", lines[i])), None)
    label_cells = _split_cells(lines[label_line], tabs)
    labels, starts = _parse_labels(path, label_cells, label_line, tabs)
    if axis_line is not None:
        labels, starts, order = _parse_axis_line(path, _split_cells(lines[axis_line], tabs), axis_line, labels=labels,
                                                 starts=starts, tabs=tabs)
    else:
        order = (0, 1, 2)
    if not labels:
        raise InputError(f"{path}:{label_line + 1}", "no labels", "Frame#, Time and a label for each marker",
                         _EXPORT_AGAIN)
    notes, values = [], _parse_values(lines, label_line, tabs)
    marker_count = values.get("nummarkers", "")
    if marker_count.isdigit() and int(marker_count) != len(labels):
        notes.append(f"{len(labels)} markers, not {marker_count} as in the header")
    columns = np.array(starts)[:, None] + np.array(order)
    return _Header(labels=labels, columns=columns, first_row=(label_line if axis_line is None else axis_line) + 1,
                   values=values, tabs=tabs, notes=notes)


def _split_cells(line: str, tabs: bool) -> list[str]:
    return [cell.strip() for cell in line.rstrip("\n").split("\t")] if tabs else line.split()


def _parse_labels(path: Path, cells: list[str], at: int, tabs: bool) -> tuple[list[str], list[int]]:
    """Parse the labels and the first column of each: every third cell with tabs, else one after the other."""
    if len(cells) < 3 or not cells[1].lower().startswith("time"):
        raise InputError(f"{path}:{at + 1}", f"{' '.join(cells[:2])[:40]!r}", "Frame#, Time and labels", _EXPORT_AGAIN)
    if not tabs:
        return cells[2:], [2 + 3 * i for i in range(len(cells) - 2)]
    where = [i for i in range(2, len(cells)) if cells[i]]
    if where != [i for i in where if (i - 2) % 3 == 0]:
        if where == list(range(2, 2 + len(where))):  # labels without the two empty cells between
            return [cells[i] for i in where], [2 + 3 * i for i in range(len(where))]
        wrong = next(i for i in where if (i - 2) % 3)
        raise InputError(f"{path}:{at + 1}", f"label {cells[wrong][:40]!r} in column {wrong + 1}",
                         "a label over every third column", _EXPORT_AGAIN)  # fmt: skip
    last = max(where, default=-1)
    return [cells[i] for i in range(2, last + 1, 3)], list(range(2, last + 1, 3))


def _parse_axis_line(path, cells, below, labels, starts, tabs):
    """Parse the line X1 Y1 Z1 ...: labels, first columns and the order of the axes; markers without a label are
    kept.
    """
    names = [cell for cell in cells if cell]
    letters = "".join(name[0].upper() for name in names[:3])
    if sorted(letters) != ["X", "Y", "Z"] or len(names) % 3:
        raise InputError(f"{path}:{below + 1}", f"{' '.join(names[:4])[:40]!r}", "X1 Y1 Z1 X2 ...", _EXPORT_AGAIN)
    count = len(names) // 3
    if count < len(labels):
        found, expected = f"coordinates of {count} markers", f"{len(labels)}, as there are labels"
        raise InputError(f"{path}:{below + 1}", found, expected, _EXPORT_AGAIN)
    order = tuple(letters.index(axis) for axis in "XYZ")
    return labels + [""] * (count - len(labels)), [2 + 3 * i for i in range(count)], order


def _parse_values(lines: list[str], at: int, tabs: bool) -> dict[str, str]:
    """Parse the values of the header by their names: a line of names above a line of values."""
    for i in range(at - 1):
        names = lines[i].split()
        if names and names[0].lower() == "datarate":
            values = _split_cells(lines[i + 1], tabs) if "\t" in lines[i + 1] else lines[i + 1].split()
            return {name.lower(): value for name, value in zip(names, values)}
    return {}


# -- rows


def _drop_cut_row(lines: list[str], head: _Header) -> list[str]:
    """Drop the last row where the file ends within it: it has no line end, fewer cells or digits than the row before,
    and the header says more frames.
    """
    rows = [line for line in lines[head.first_row:] if line.strip()]
    if not lines[-1].strip() or not 1 < len(rows) < head.parse_number("numframes"):
        return lines
    ends = [(len(cells), len(cells[-1].replace(",", ".").partition(".")[2]))
            for cells in (_split_cells(line, head.tabs) for line in rows[-2:])]
    return lines[:-1] if ends[1] < ends[0] else lines


def _describe_early_end(head: _Header, count: int, is_cut: bool) -> list[str]:
    """Describe in a line that a file has fewer frames than its header says; no line where it has not."""
    expected = head.parse_number("numframes")
    if not count < expected:
        return []
    cut = ", and its last row, which is cut off, is left out" if is_cut else ""
    return [f"{format_count(count, 'frame')}, not {expected:.0f} as in the header: the file ends early{cut}"]


def _parse_rows(path: Path, lines: list[str], head: _Header) -> tuple[list[str], np.ndarray]:
    """Parse the rows: T texts of Time, and (T, M, 3) places, NaN where a cell is empty."""
    width = int(head.columns.max()) + 1
    times, rows = [], []
    for i in range(head.first_row, len(lines)):
        if not lines[i] or lines[i].isspace():
            continue
        cells = _split_row(path, i, lines[i], head, width)
        times.append(cells[1].strip())
        rows.append(_parse_numbers(path, i, cells[2:]))
    if not rows:
        raise InputError(path, "no rows below the header", "a row for each frame", _EXPORT_AGAIN)
    return times, np.array(rows)[:, head.columns - 2]


def _split_row(path: Path, index: int, line: str, head: _Header, width: int) -> list[str]:
    """Split a row into cells, and add empty ones that are left out at its end.

    Raises InputError where there are more cells than markers, or a place is cut in two.
    """
    cells = line.split("\t") if head.tabs else line.split()
    while len(cells) > width and not cells[-1].strip():
        cells.pop()
    place = f"{path}:{index + 1}"
    if len(cells) > width:
        found = format_count(len(cells) - 2, "coordinate")
        raise InputError(place, found, f"{width - 2} for {len(head.labels)} markers", "one recording per file")
    while head.tabs and cells and not cells[-1].strip():
        cells.pop()
    short = width - len(cells)
    if short and (not head.tabs or len(cells) < 2 or (len(cells) - 2) % 3):
        found = format_count(max(len(cells) - 2, 0), "coordinate")
        raise InputError(place, found, f"{width - 2} for {len(head.labels)} markers",
                         f"the row is cut off; {_EXPORT_AGAIN}")  # fmt: skip
    return cells + [""] * short


def _parse_numbers(path: Path, index: int, cells: list[str]) -> np.ndarray:
    """Parse (3 M,) float of one row's cells, NaN for empty ones."""
    try:
        return np.array(list(map(float, cells)))
    except ValueError:
        return np.array([_parse_number(path, cell.strip(), index + 1, column) for column, cell in enumerate(cells, 3)])


def _parse_number(path: Path, cell: str, line: int, column: int) -> float:
    """Parse one cell; raise InputError with line and column where it is not a number."""
    if cell.lower() in _MISSING:
        return math.nan
    try:
        return float(cell if "." in cell else cell.replace(",", "."))
    except ValueError:
        raise InputError(f"{path}:{line}", f"{cell[:40]!r} in column {column}", "a number", "correct it") from None


# -- time


def _align_to_rate(path: Path, head: _Header, times: list[str], positions: np.ndarray):
    """Align the rows to one frame rate; frames missing in the times are added as not visible.

    Returns frames per second, seconds of the first frame, places and messages. Raises InputError where times go back or
    have no single rate.
    """
    rates = (head.parse_number(name) for name in ("datarate", "camerarate", "origdatarate"))
    header_rate = next((rate for rate in rates if rate > 0), math.nan)
    seconds, resolution = _parse_seconds(times)
    if len(times) < 2 or not np.isfinite(seconds).all() or np.ptp(seconds) == 0:
        _check_rate(path, header_rate)
        notes = [] if len(times) < 2 else ["no times in the file: DataRate is used as the frame rate"]
        return header_rate, 0.0 if not np.isfinite(seconds[:1]).all() else float(seconds[0]), positions, notes
    steps = np.diff(seconds)
    only_coarse = bool(
        (steps >= 0).all()) and header_rate > 0 and 1 / header_rate < resolution  # equal times, written with few digits
    if (steps <= 0).any() and not only_coarse:
        frame = int(np.argmax(steps <= 0)) + 2
        found = f"Time of frame {frame} is {times[frame - 1][:20]}, after {times[frame - 2][:20]}"
        raise InputError(path, found, "increasing times", "one recording per file")
    fps, notes = _choose_rate(header_rate, seconds, steps, resolution)
    _check_rate(path, fps)
    frames = np.rint((seconds - seconds[0]) * fps).astype(int)
    plain = np.arange(len(frames))
    if np.abs((seconds - seconds[0]) * fps - plain).max() <= max(0.5, resolution * fps + 0.1):
        frames = plain
    off = np.abs((seconds - seconds[0]) - frames / fps).max()
    if len(np.unique(frames)) < len(frames) or off > max(0.25 / fps, resolution):
        found = f"times that are up to {1000 * off:.3g} ms off {fps:g} frames per second"
        raise InputError(path, found, "one rate", "resample it to one rate")
    return fps, float(seconds[0]), *_insert_gaps(path, frames, positions, notes)


def _parse_seconds(times: list[str]) -> tuple[np.ndarray, float]:
    """Parse (T,) seconds, NaN for invalid ones, and the resolution of their digits."""
    texts = [time.replace(",", ".") for time in times]

    def parse_value(text: str) -> float:
        try:
            return float(text)
        except ValueError:
            return math.nan

    digits = max((len(text.partition(".")[2]) for text in texts[:100] if "e" not in text.lower()), default=6)
    seconds = np.array([parse_value(text) for text in texts])
    return np.where(np.abs(seconds) < 1e7, seconds, np.nan), 10.0 ** -digits


def _choose_rate(header_rate: float, seconds: np.ndarray, steps: np.ndarray, resolution: float) -> tuple[float,
        list[str]]:
    """Choose the frame rate: the header's where the times agree, else that of the times, with a message."""
    if header_rate > 0:
        frames = np.rint((seconds - seconds[0]) * header_rate)
        exact = np.abs(seconds - seconds[0] - frames / header_rate).max() <= resolution + 0.1 / header_rate
        if exact and np.median(steps * header_rate) < 1.5:
            return header_rate, []
    measured_rate = 1 / float(np.median(steps))
    mean = (len(seconds) - 1) / float(seconds[-1] - seconds[0])
    measured_rate = mean if abs(mean / measured_rate - 1) < 0.05 else measured_rate
    measured_rate = round(measured_rate) if abs(measured_rate
                                                - round(measured_rate)) < 0.005 * measured_rate and round(
        measured_rate) else measured_rate
    return measured_rate, [
        f"{measured_rate:g} frames per second by the times; the header says {header_rate:g}"] if header_rate > 0 else []


def _check_rate(path: Path, fps: float) -> None:
    """Raise InputError where the rate is out of range."""
    if not MIN_FPS <= fps <= MAX_FPS:
        expected = f"{MIN_FPS:g} to {MAX_FPS:g}"
        raise InputError(path, f"{fps:g} frames per second", expected, "check DataRate and Time")


def _insert_gaps(path: Path, frames: np.ndarray, positions: np.ndarray, notes: list[str]):
    """Insert missing frames as not visible; return the places and the messages."""
    count = int(frames[-1]) + 1
    missing = count - len(frames)
    if not missing:
        return positions, notes
    if count > min(20 * len(frames) + 1000, _MAX_FRAMES):
        raise InputError(path, f"times that skip {missing} frames of {count}", "one recording", "split it in two")
    whole = np.full((count, *positions.shape[1:]), np.nan)
    whole[frames] = positions
    return whole, [*notes, f"{format_count(missing, 'frame')} missing in the times, added as not visible"]


def write_trc(trial: MarkerTrial, path: str | os.PathLike) -> None:
    """Write a trial as a TRC file; cells of markers that are not visible stay empty.

    Args:
        trial: the trial.
        path: the file.
    Raises:
        InputError: if the file cannot be written.
    """
    atomic_write(path, format_trc(trial, Path(path).name))


def format_trc(trial: MarkerTrial, name: str = "") -> str:
    """Format a trial as TRC text.

    Args:
        trial: the trial.
        name: in the first line; "" uses the trial's name.
    Returns:
        The text, millimetres, Y up.
    """
    labels = [" ".join(label.split()) for label in trial.labels]
    count, rate = len(labels), f"{trial.fps:.6f}"
    head = [f"PathFileType\t4\t(X/Y/Z)\t{name or trial.name}",
            "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
            f"{rate}\t{rate}\t{len(trial)}\t{count}\tmm\t{rate}\t1\t{len(trial)}",
            "Frame#\tTime\t" + "\t".join(f"{label}\t\t" for label in labels),
            "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, count + 1)), ""]
    places = 1000.0 * trial.positions[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])
    rows = [f"{i}\t{seconds:.7f}\t{_format_row(frame, seen)}"
            for i, (seconds, frame, seen) in enumerate(zip(trial.seconds, places, trial.visibility), 1)]  # fmt: skip
    return "\n".join([*head, *rows, ""])


def _format_row(places: np.ndarray, seen: np.ndarray) -> str:
    """Format one frame's (M, 3) places in millimetres; empty cells where a marker is not visible."""
    if seen.all():
        return "\t".join([_PLACE_FORMAT] * len(seen)) % tuple(places.ravel().tolist())
    return "\t".join(_PLACE_FORMAT % tuple(place) if there else "\t\t" for place, there in zip(places.tolist(), seen))
