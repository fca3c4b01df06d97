"""Read C3D files: markers of optical motion capture (www.c3d.org, "The C3D file format: a user guide").

The `c3d` package reads header and parameters; the samples are read here, all frames at once, since the package reads
frame by frame, converts analog channels that are not needed, and rejects files whose header and parameters disagree.
Where they disagree, the file's size decides.
"""

from __future__ import annotations

import io
import itertools
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.content import open_file
from ...base.errors import InputError
from ...base.optional_packages import import_optional
from ..trial import MAX_FPS, MIN_FPS, MarkerTrial
from .raw_markers import RawMarkers, build_trial

BLOCK = 512  # bytes
_PROCESSORS = {84: "<", 85: "<", 86: ">"}  # Intel, DEC, SGI/MIPS: the byte order
_DEC = 85
_MAX_HEADER_EVENTS = 18
_EXPORT_AGAIN = "export it again"
_COMPUTED_GROUPS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS", "MODELED_MARKERS")
_AXES = {sign + axis: ("XYZ".index(axis), -1 if sign == "-" else 1) for sign in ("", "+", "-") for axis in "XYZ"}


def read_c3d(path: str | os.PathLike, unit: float | str | None = None, subject: str | None = None,
             up: str | None = None) -> MarkerTrial:  # fmt: skip
    """Read the trial in a C3D file: one subject's markers and the events.

    Analog channels, angles, forces and points that a model computed are left out and reported in the notes.

    Args:
        path: the file.
        unit: metres per unit or a name; None for the file's own.
        subject: whose markers, if the file contains several bodies.
        up: the file's axis that points up; None to detect it.
    Returns:
        The trial, metres, Z up.
    Raises:
        InputError: if the file is missing, damaged, cut off or not a C3D file, and as `raw_markers.build_trial`.
    """
    path = Path(path)
    with open_file(path, "a C3D file") as handle:
        size = os.fstat(handle.fileno()).st_size
        parameters = _read_parameters(path, handle, size)
        layout = _find_layout(path, parameters, size)
        words = _read_words(handle, layout)
    positions, residuals = _decode_points(words, layout, parameters)
    return build_trial(_build_raw_markers(path, parameters, layout, positions, residuals), path, unit, subject, up)


# -- header and parameters


class _Parameters:
    """The header and the parameters of a file.

    Arrays of parameters are read up to the data that is present, whatever their dimensions promise.
    """

    def __init__(self, reader, order: str, dec: bool):
        self._reader, self.header, self.order, self.dec = reader, reader.header, order, dec

    def read_numbers(self, name: str) -> np.ndarray:
        """Return the values of a numeric parameter; 16-bit integers are counts up to 65535.

        Args:
            name: GROUP:NAME.
        Returns:
            (N,) float; empty where the parameter is absent or text.
        """
        parameter = self._reader.get(name)
        if parameter is None:
            return np.zeros(0)
        size = parameter.bytes_per_element
        kinds = {1: "u1", 2: f"{self.order}u2", 4: f"{self.order}f4"}
        if size not in kinds:
            return np.zeros(0)
        data = parameter.bytes[: len(parameter.bytes) // size * size]
        return _decode_floats(data, self) if size == 4 else np.frombuffer(data, kinds[size]).astype(float)

    def read_number(self, name: str) -> float:
        """Return the first value of a parameter; NaN where there is none."""
        values = self.read_numbers(name)
        return float(values[0]) if len(values) else math.nan

    def read_texts(self, name: str) -> list[str]:
        """Return the texts of a parameter, and of its continuations NAME2, NAME3 ..."""
        out = []
        for number in itertools.chain([""], range(2, 100)):
            parameter = self._reader.get(f"{name}{number}")
            if parameter is None or parameter.bytes_per_element != -1:
                break
            width = parameter.dimensions[0] if parameter.dimensions else 1
            data = parameter.bytes
            out += [_decode_text(data[i : i + width]) for i in range(0, len(data), width)] if width else []
        return out


def _decode_text(data: bytes) -> str:
    """Decode a text as UTF-8, else as Windows-1252, without control characters."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _decode_floats(data: bytes, parameters: _Parameters) -> np.ndarray:
    """Decode single-precision numbers as this file writes them, (N,) float."""
    if not parameters.dec:
        with np.errstate(invalid="ignore"):  # some kinds of NaN
            return np.frombuffer(data, f"{parameters.order}f4").astype(float)
    # VAX F floating (DEC): the 16-bit halves are swapped, the exponent's bias is two greater, and there is no NaN.
    halves = np.frombuffer(data, "<u2").astype(np.uint32)
    bits = (halves[0::2] << 16) | halves[1::2]
    values = bits.view(np.float32).astype(float) / 4.0
    return np.where((bits >> 23) & 0xFF == 0, 0.0, values)


def _read_parameters(path: Path, handle, size: int) -> _Parameters:
    """Read header and parameters; raise InputError where they are damaged, or the file is of another kind."""
    head = handle.read(BLOCK)
    if len(head) < BLOCK or head[1] != 0x50 or head[0] == 0:
        found = "an empty file" if not head else "not the start of a C3D file"
        raise InputError(path, found, "a C3D file", "choose another file" if head else _EXPORT_AGAIN)
    first = (head[0] - 1) * BLOCK
    handle.seek(first)
    start = handle.read(4)
    if len(start) < 4 or start[3] not in _PROCESSORS:
        raise InputError(path, "damaged parameters", "84, 85 or 86 for the kind of numbers", _EXPORT_AGAIN)
    handle.seek(0)
    section = bytearray(handle.read(min(first + max(start[2], 1) * BLOCK, size)))
    order = _PROCESSORS[start[3]]
    if int.from_bytes(section[300:302], "little" if order == "<" else "big") > _MAX_HEADER_EVENTS:
        section[300:302] = b"\0\0"
    return _Parameters(_parse_parameters(path, bytes(section)), order, start[3] == _DEC)


def _parse_parameters(path: Path, section: bytes):
    """Parse header and parameters with the package, without the data, so that wrong sizes cannot lead into it."""
    import_optional("c3d", path)
    import c3d

    class Reader(c3d.Reader):
        def _check_metadata(self):  # the package asserts that header and parameters agree; `_find_layout` handles it
            pass

    try:
        return Reader(io.BytesIO(section))
    except Exception:  # any error of the parser means that the parameters are damaged
        raise InputError(path, "damaged parameters", "a C3D file", _EXPORT_AGAIN) from None


# -- the samples


@dataclass(frozen=True, kw_only=True)
class _Layout:
    """Where the samples lie in the file.

    Attributes:
        data: byte of the first sample.
        points: number of points in a frame (four values each).
        analog: number of analog values in a frame.
        frames: number of frames.
        scale: as in the file; negative where samples are floats.
        first_frame: number of the first frame.
        notes: messages where header and parameters disagree.
    """

    data: int
    points: int
    analog: int
    frames: int
    scale: float
    first_frame: int
    notes: tuple[str, ...]

    @property
    def word(self) -> int:
        """Bytes of a sample."""
        return 4 if self.scale < 0 else 2

    @property
    def stride(self) -> int:
        """Bytes of a frame."""
        return (4 * self.points + self.analog) * self.word


def _find_layout(path: Path, parameters: _Parameters, size: int) -> _Layout:
    """Find the layout that fits the size of the file, of all that header and parameters say, the header's first.

    Raises InputError where none fits.
    """
    scale = _find_number(parameters.read_number("POINT:SCALE"), parameters.header.scale_factor)
    if not 1e-12 < abs(scale) < 1e12:
        raise InputError(path, f"scale {scale:g} of the points", "a scale that is not 0", _EXPORT_AGAIN)
    header, first, frames = parameters.header, *_list_frame_counts(parameters)
    blocks = _list_counts(header.data_block, parameters.read_number("POINT:DATA_START"))
    counts = {"data": [(block - 1) * BLOCK for block in blocks if block > 1],
              "points": _list_counts(header.point_count, parameters.read_number("POINT:USED")),
              "analog": _list_counts(header.analog_count, _count_analog(parameters)), "frames": frames}
    if not (any(counts["points"]) and counts["data"] and counts["frames"]):
        raise InputError(path, f"{header.point_count} markers, {max(counts['frames'], default=0)} frames", "markers",
                         "export the trial with its markers")  # fmt: skip
    layouts = [
        _Layout(data=data, points=points, analog=analog, frames=count, scale=scale, first_frame=first, notes=())
        for data, points, analog, count in itertools.product(*counts.values()) if points
    ]
    remaining_bytes = [size - layout.data - layout.frames * layout.stride for layout in layouts]
    fitting = [i for i, rest in enumerate(remaining_bytes) if 0 <= rest < BLOCK] or [i for i,
            rest in enumerate(remaining_bytes) if rest >= 0]
    if not fitting:
        best = layouts[0]
        present_frames = max(size - best.data, 0) // best.stride
        expected = f"{best.frames} as the header says"
        raise InputError(path, f"{present_frames} frames", expected, f"the file is cut off; {_EXPORT_AGAIN}")
    chosen = layouts[fitting[0]]
    notes = [f"header and parameters disagree on {name}: {getattr(chosen, name)} fits the file"
             for name, candidates in counts.items() if len(candidates) > 1]  # fmt: skip
    return _Layout(data=chosen.data, points=chosen.points, analog=chosen.analog, frames=chosen.frames, scale=scale,
                   first_frame=first, notes=tuple(notes))


def _find_number(*values: float) -> float:
    """Return the first value that is a number, or NaN."""
    return next((float(value) for value in values if math.isfinite(value)), math.nan)


def _list_counts(*values: float) -> list[int]:
    """List the different whole numbers among these values."""
    return list(dict.fromkeys(int(value) for value in values if math.isfinite(value) and value >= 0))


def _count_analog(parameters: _Parameters) -> float:
    """Count the analog values in a frame of points, as the parameters say; NaN where they do not."""
    used, rate = parameters.read_number("ANALOG:USED"), parameters.read_number("ANALOG:RATE")
    points = _find_number(parameters.read_number("POINT:RATE"), parameters.header.frame_rate)
    if used == 0:
        return 0.0
    ratio = rate / points if points > 0 else math.nan
    return used * round(ratio) if math.isfinite(ratio) and abs(ratio) < 1e6 else math.nan


def _list_frame_counts(parameters: _Parameters) -> tuple[int, list[int]]:
    """Return the number of the first frame, and the numbers of frames given in different places, the most reliable
    first.
    """
    start, end = (parameters.read_numbers(f"TRIAL:ACTUAL_{name}_FIELD") for name in ("START", "END"))
    header = parameters.header
    first = int(start[0] + 65536 * start[1]) if len(start) == 2 else int(header.first_frame)
    counts = [int(end[0] + 65536 * end[1]) - first + 1] if len(end) == 2 else []
    counts += _list_counts(parameters.read_number("POINT:LONG_FRAMES"), header.last_frame - header.first_frame + 1.0,
                           parameters.read_number("POINT:FRAMES"))  # fmt: skip
    return first, list(dict.fromkeys(count for count in counts if count > 0))


def _read_words(handle, layout: _Layout) -> np.ndarray:
    """Read (T, bytes of a frame's points) uint8."""
    handle.seek(layout.data)
    points = 4 * layout.points * layout.word
    if not layout.analog:
        data = np.fromfile(handle, np.uint8, layout.frames * layout.stride)
        return data.reshape(layout.frames, layout.stride)
    mapped = np.memmap(handle, np.uint8, "r", layout.data, (layout.frames, layout.stride))
    return np.array(mapped[:, :points])


def _decode_points(words: np.ndarray, layout: _Layout, parameters: _Parameters) -> tuple[np.ndarray, np.ndarray]:
    """Decode (T, M, 3) places in the file's unit, NaN where not visible, and (T, M) residuals."""
    shape, magnitude = (layout.frames, layout.points, 4), abs(layout.scale)
    if layout.scale < 0:
        values = _decode_floats(np.ascontiguousarray(words).tobytes(), parameters).reshape(shape)
        places, fourth = values[..., :3], values[..., 3]
    else:
        values = np.ascontiguousarray(words).view(f"{parameters.order}i2").reshape(shape).astype(float)
        places, fourth = values[..., :3] * magnitude, values[..., 3]
    # The fourth word: negative where the point is not visible, else cameras in the upper byte, residual in the lower.
    is_occluded = ~(np.isfinite(values).all(axis=-1)) | (fourth < 0)
    places = np.where(is_occluded[..., None], np.nan, places)
    word = np.where(is_occluded | (fourth > 32767), 0, fourth).astype(int)
    return places, np.where(is_occluded, np.nan, (word & 0xFF) * magnitude)


# -- what the parameters say about them


def _build_raw_markers(path: Path, parameters: _Parameters, layout: _Layout, positions, residuals) -> RawMarkers:
    """Build the raw markers with labels, rate, unit, axes and events from the parameters."""
    rate = _find_number(parameters.read_number("POINT:RATE"), parameters.header.frame_rate)
    if not MIN_FPS <= rate <= MAX_FPS:
        rate = float(parameters.header.frame_rate)
    if not MIN_FPS <= rate <= MAX_FPS:
        raise InputError(path, f"{rate:g} frames per second", f"{MIN_FPS:g} to {MAX_FPS:g}", _EXPORT_AGAIN)
    notes, labels = list(layout.notes), parameters.read_texts("POINT:LABELS")[: layout.points]
    if len(labels) < layout.points:
        notes.append(f"{layout.points - len(labels)} of {layout.points} points have no label")
    return RawMarkers(
        labels=labels + [""] * (layout.points - len(labels)), positions=positions, fps=rate,
        unit=" ".join(parameters.read_texts("POINT:UNITS")[:1]), residuals=residuals,
        up=_AXES.get("".join(parameters.read_texts("POINT:Y_SCREEN")[:1]).strip().upper()),
        prefixes=tuple(parameters.read_texts("SUBJECTS:LABEL_PREFIXES")),
        computed=tuple(label for group in _list_computed_groups(parameters)
                       for label in parameters.read_texts(f"POINT:{group}")), events=_read_events(parameters),
        start=max(layout.first_frame - 1, 0) / rate, notes=notes,
    )


def _list_computed_groups(parameters: _Parameters) -> list[str]:
    """List the parameters that name points that are no markers: the usual ones and those that the file defines
    itself.
    """
    file_groups = [name.upper() for name in parameters.read_texts("POINT:TYPE_GROUPS")]
    return list(dict.fromkeys([*_COMPUTED_GROUPS,
                               *(name for name in file_groups if name not in ("LABELS", "DESCRIPTIONS"))]))


def _read_events(parameters: _Parameters) -> list[tuple[float, str, str, str]]:
    """Read (seconds, label, side, subject) of the EVENT group, else of the header; seconds from frame 1."""
    times = parameters.read_numbers("EVENT:TIMES")
    labels, sides, whose = (parameters.read_texts(f"EVENT:{name}") for name in ("LABELS", "CONTEXTS", "SUBJECTS"))
    used = parameters.read_number("EVENT:USED")
    count = min(len(times) // 2, int(used) if math.isfinite(used) else 0)
    out = [(60 * times[2 * i] + times[2 * i + 1], _get_text(labels, i), _parse_side(_get_text(sides, i)),
            _get_text(whose, i)) for i in range(count)]  # fmt: skip
    if not out:
        header = parameters.header
        out = [(float(seconds), " ".join(str(label).split()).strip("\0"), "", "") for seconds, label in header.events]
    return [event for event in out if math.isfinite(event[0]) and abs(event[0]) < 1e6]


def _get_text(values: list[str], index: int) -> str:
    return values[index] if index < len(values) else ""


def _parse_side(context: str) -> str:
    return context.lower() if context.lower() in ("left", "right") else ""
