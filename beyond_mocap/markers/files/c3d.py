"""C3D files: markers of optical motion capture (www.c3d.org, "The C3D file format: a user guide").

The `c3d` package reads header and parameters; the samples are read here, all frames at once, since it goes frame by
frame, converts analog channels that nobody asked for, and refuses files whose header and parameters disagree. Where
they do, the file's own size tells who is right.
"""

from __future__ import annotations

import io
import itertools
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...files.content import opened
from ..trial import FEWEST_FPS, MOST_FPS, MarkerTrial
from .raw_markers import RawMarkers, as_trial

BLOCK = 512
_PROCESSORS = {84: "<", 85: "<", 86: ">"}  # Intel, DEC, SGI/MIPS: the order of bytes
_DEC = 85
_EVENTS_IN_HEADER = 18
_EXPORT_AGAIN = "export it again"
_NO_MARKERS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS", "MODELED_MARKERS")
_AXES = {sign + axis: ("XYZ".index(axis), -1 if sign == "-" else 1) for sign in ("", "+", "-") for axis in "XYZ"}


def read_c3d(path: str | os.PathLike, unit: float | str | None = None, subject: str | None = None,
             up: str | None = None) -> MarkerTrial:  # fmt: skip
    """The trial in a C3D file: one subject's markers and the events; analog channels, angles, forces and points that
    a model computed are left out, and told in the notes.

    unit: metres per unit or a name; None for the file's own. subject: whose markers, where the file has several bodies.
    up: the file's axis that points up, None to find it.
    InputError where the file is missing, damaged, cut off or no C3D file, and as `raw_markers.as_trial`."""
    path = Path(path)
    with opened(path, "a C3D file") as handle:
        size = os.fstat(handle.fileno()).st_size
        parameters = _parameters(path, handle, size)
        layout = _layout(path, parameters, size)
        words = _words(path, handle, layout)
    positions, residuals = _points(words, layout, parameters)
    return as_trial(_raw(path, parameters, layout, positions, residuals), path, unit, subject, up)


# -- header and parameters


class _Parameters:
    """The header and the parameters of a file. Arrays of parameters are taken as far as the file holds them: what their
    dimensions promise is not believed."""

    def __init__(self, reader, order: str, dec: bool):
        self._reader, self.header, self.order, self.dec = reader, reader.header, order, dec

    def numbers(self, name: str, unsigned: bool = True) -> np.ndarray:
        """(N,) float: the values of a parameter; none where it is absent or text. Whole numbers of 16 bits are counts,
        so they go beyond 32767 unless `unsigned` is False."""
        parameter = self._reader.get(name)
        if parameter is None:
            return np.zeros(0)
        size = parameter.bytes_per_element
        kinds = {1: "u1", 2: f"{self.order}{'u' if unsigned else 'i'}2", 4: f"{self.order}f4"}
        if size not in kinds:
            return np.zeros(0)
        data = parameter.bytes[: len(parameter.bytes) // size * size]
        return _floats(data, self) if size == 4 else np.frombuffer(data, kinds[size]).astype(float)

    def number(self, name: str) -> float:
        """The first value of a parameter; NaN where there is none."""
        values = self.numbers(name)
        return float(values[0]) if len(values) else math.nan

    def texts(self, name: str) -> list[str]:
        """The texts of a parameter, also of those that go on under NAME2, NAME3 ..."""
        out = []
        for number in itertools.chain([""], range(2, 100)):
            parameter = self._reader.get(f"{name}{number}")
            if parameter is None or parameter.bytes_per_element != -1:
                break
            width = parameter.dimensions[0] if parameter.dimensions else 1
            data = parameter.bytes
            out += [_text(data[i : i + width]) for i in range(0, len(data), width)] if width else []
        return out


def _text(data: bytes) -> str:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _floats(data: bytes, parameters: _Parameters) -> np.ndarray:
    """(N,) float of single precision numbers as this file writes them."""
    if not parameters.dec:
        with np.errstate(invalid="ignore"):  # some kinds of NaN
            return np.frombuffer(data, f"{parameters.order}f4").astype(float)
    # VAX F floating (DEC): the 16-bit halves are exchanged, the exponent's bias is two greater, and no number is NaN.
    halves = np.frombuffer(data, "<u2").astype(np.uint32)
    bits = (halves[0::2] << 16) | halves[1::2]
    values = bits.view(np.float32).astype(float) / 4.0
    return np.where((bits >> 23) & 0xFF == 0, 0.0, values)


def _parameters(path: Path, handle, size: int) -> _Parameters:
    """InputError where header or parameters are damaged, or the file is another one."""
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
    if int.from_bytes(section[300:302], "little" if order == "<" else "big") > _EVENTS_IN_HEADER:
        section[300:302] = b"\0\0"
    return _Parameters(_parsed(path, bytes(section)), order, start[3] == _DEC)


def _parsed(path: Path, section: bytes):
    """The package's reader on header and parameters alone, so that what they promise cannot lead it into the data."""
    try:
        import c3d
    except ImportError as error:
        found = f"the package c3d cannot be imported ({error})"
        raise InputError(path, found, "c3d 0.6 or newer", "pip install 'beyond-mocap[markers]'") from None

    class Reader(c3d.Reader):
        def _check_metadata(self):  # asserts that header and parameters agree: looked at in `_layout`
            pass

    try:
        return Reader(io.BytesIO(section))
    except Exception as error:  # whatever a parser stumbles over: the parameters are damaged
        found = f"damaged parameters ({type(error).__name__}: {str(error)[:60]})"
        raise InputError(path, found, "a C3D file", _EXPORT_AGAIN) from None


# -- the samples


@dataclass(frozen=True, kw_only=True)
class _Layout:
    """Where the samples lie. data: byte of the first. points, analog: values of a frame (a point has four). scale: as
    the file has it; negative where samples are floats. notes: where header and parameters disagree."""

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


def _layout(path: Path, parameters: _Parameters, size: int) -> _Layout:
    """Where the samples lie: of all that header and parameters say, what fits the size of the file, the header's first.
    InputError where nothing does."""
    scale = _one_of(parameters.number("POINT:SCALE"), parameters.header.scale_factor)
    if not 1e-12 < abs(scale) < 1e12:
        raise InputError(path, f"scale {scale:g} of the points", "a scale that is not 0", _EXPORT_AGAIN)
    header, first, frames = parameters.header, *_frames(parameters)
    blocks = _counts(header.data_block, parameters.number("POINT:DATA_START"))
    counts = {"data": [(block - 1) * BLOCK for block in blocks if block > 1],
              "points": _counts(header.point_count, parameters.number("POINT:USED")),
              "analog": _counts(header.analog_count, _analog(parameters)), "frames": frames}
    if not (any(counts["points"]) and counts["data"] and counts["frames"]):
        raise InputError(path, f"{header.point_count} markers, {max(counts['frames'], default=0)} frames", "markers",
                         "export the trial with its markers")  # fmt: skip
    layouts = [
        _Layout(data=data, points=points, analog=analog, frames=count, scale=scale, first_frame=first, notes=())
        for data, points, analog, count in itertools.product(*counts.values()) if points
    ]
    left = [size - layout.data - layout.frames * layout.stride for layout in layouts]
    fitting = [i for i, rest in enumerate(left) if 0 <= rest < BLOCK] or [i for i, rest in enumerate(left) if rest >= 0]
    if not fitting:
        best = layouts[0]
        there = max(size - best.data, 0) // best.stride
        expected = f"{best.frames} as the header says"
        raise InputError(path, f"{there} frames", expected, f"the file is cut off; {_EXPORT_AGAIN}")
    chosen = layouts[fitting[0]]
    notes = [f"header and parameters disagree on {name}: {getattr(chosen, name)} fits the file"
             for name, said in counts.items() if len(said) > 1]  # fmt: skip
    return _Layout(data=chosen.data, points=chosen.points, analog=chosen.analog, frames=chosen.frames, scale=scale,
                   first_frame=first, notes=tuple(notes))


def _one_of(*values: float) -> float:
    """The first that is a number."""
    return next((float(value) for value in values if math.isfinite(value)), math.nan)


def _counts(*values: float) -> list[int]:
    """The different whole numbers among these."""
    return list(dict.fromkeys(int(value) for value in values if math.isfinite(value) and value >= 0))


def _analog(parameters: _Parameters) -> float:
    """Analog values in a frame of points, as the parameters say."""
    used, rate = parameters.number("ANALOG:USED"), parameters.number("ANALOG:RATE")
    points = _one_of(parameters.number("POINT:RATE"), parameters.header.frame_rate)
    if used == 0:
        return 0.0
    ratio = rate / points if points > 0 else math.nan
    return used * round(ratio) if math.isfinite(ratio) and abs(ratio) < 1e6 else math.nan


def _frames(parameters: _Parameters) -> tuple[int, list[int]]:
    """(number of the first frame, how many there are as the file says in different places, the surest first)."""
    start, end = (parameters.numbers(f"TRIAL:ACTUAL_{name}_FIELD") for name in ("START", "END"))
    header = parameters.header
    first = int(start[0] + 65536 * start[1]) if len(start) == 2 else int(header.first_frame)
    said = [int(end[0] + 65536 * end[1]) - first + 1] if len(end) == 2 else []
    said += _counts(parameters.number("POINT:LONG_FRAMES"), header.last_frame - header.first_frame + 1.0,
                    parameters.number("POINT:FRAMES"))  # fmt: skip
    return first, list(dict.fromkeys(count for count in said if count > 0))


def _words(path: Path, handle, layout: _Layout) -> np.ndarray:
    """(T, bytes of a frame's points) uint8."""
    handle.seek(layout.data)
    points = 4 * layout.points * layout.word
    if not layout.analog:
        data = np.fromfile(handle, np.uint8, layout.frames * layout.stride)
        return data.reshape(layout.frames, layout.stride)
    mapped = np.memmap(handle, np.uint8, "r", layout.data, (layout.frames, layout.stride))
    return np.array(mapped[:, :points])


def _points(words: np.ndarray, layout: _Layout, parameters: _Parameters) -> tuple[np.ndarray, np.ndarray]:
    """(T, M, 3) places in the file's unit, NaN where not seen, and (T, M) residuals."""
    shape, magnitude = (layout.frames, layout.points, 4), abs(layout.scale)
    if layout.scale < 0:
        values = _floats(np.ascontiguousarray(words).tobytes(), parameters).reshape(shape)
        places, fourth = values[..., :3], values[..., 3]
    else:
        values = np.ascontiguousarray(words).view(f"{parameters.order}i2").reshape(shape).astype(float)
        places, fourth = values[..., :3] * magnitude, values[..., 3]
    # The fourth word: negative where the point is not seen, else cameras in the upper byte, residual in the lower.
    unseen = ~(np.isfinite(values).all(axis=-1)) | (fourth < 0)
    places = np.where(unseen[..., None], np.nan, places)
    word = np.where(unseen | (fourth > 32767), 0, fourth).astype(int)
    return places, np.where(unseen, np.nan, (word & 0xFF) * magnitude)


# -- what the parameters say about them


def _raw(path: Path, parameters: _Parameters, layout: _Layout, positions, residuals) -> RawMarkers:
    rate = _one_of(parameters.number("POINT:RATE"), parameters.header.frame_rate)
    if not FEWEST_FPS <= rate <= MOST_FPS:
        rate = float(parameters.header.frame_rate)
    if not FEWEST_FPS <= rate <= MOST_FPS:
        raise InputError(path, f"{rate:g} frames per second", f"{FEWEST_FPS:g} to {MOST_FPS:g}", _EXPORT_AGAIN)
    notes, labels = list(layout.notes), parameters.texts("POINT:LABELS")[: layout.points]
    if len(labels) < layout.points:
        notes.append(f"{layout.points - len(labels)} of {layout.points} points have no label")
    return RawMarkers(
        labels=labels + [""] * (layout.points - len(labels)), positions=positions, fps=rate,
        unit=" ".join(parameters.texts("POINT:UNITS")[:1]), residuals=residuals,
        up=_AXES.get("".join(parameters.texts("POINT:Y_SCREEN")[:1]).strip().upper()),
        prefixes=tuple(parameters.texts("SUBJECTS:LABEL_PREFIXES")),
        listed=tuple(label for group in _listed(parameters) for label in parameters.texts(f"POINT:{group}")),
        events=_events(parameters), start=max(layout.first_frame - 1, 0) / rate, notes=notes,
    )


def _listed(parameters: _Parameters) -> list[str]:
    """Parameters that list the points that are no markers: the usual ones and those that the file names itself."""
    named = [name.upper() for name in parameters.texts("POINT:TYPE_GROUPS")]
    return list(dict.fromkeys([*_NO_MARKERS, *(name for name in named if name not in ("LABELS", "DESCRIPTIONS"))]))


def _events(parameters: _Parameters) -> list[tuple[float, str, str, str]]:
    """(seconds, label, side, subject) of the EVENT group, else of the header; seconds from frame 1."""
    times = parameters.numbers("EVENT:TIMES")
    labels, sides, whose = (parameters.texts(f"EVENT:{name}") for name in ("LABELS", "CONTEXTS", "SUBJECTS"))
    used = parameters.number("EVENT:USED")
    count = min(len(times) // 2, int(used) if math.isfinite(used) else 0)
    out = [(60 * times[2 * i] + times[2 * i + 1], _at(labels, i), _side(_at(sides, i)), _at(whose, i))
           for i in range(count)]  # fmt: skip
    if not out:
        header = parameters.header
        out = [(float(seconds), " ".join(str(label).split()).strip("\0"), "", "") for seconds, label in header.events]
    return [event for event in out if math.isfinite(event[0]) and abs(event[0]) < 1e6]


def _at(values: list[str], index: int) -> str:
    return values[index] if index < len(values) else ""


def _side(context: str) -> str:
    return context.lower() if context.lower() in ("left", "right") else ""
