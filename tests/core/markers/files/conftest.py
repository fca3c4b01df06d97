"""A made standing body of 17 markers for the tests of marker files, and how it is written in them."""

import struct
from types import SimpleNamespace

import numpy as np
import pytest

STANDING = {
    "LFHD": (0.1, 0.07, 1.7), "RFHD": (0.1, -0.07, 1.7), "C7": (-0.08, 0.0, 1.5), "LSHO": (0.0, 0.18, 1.45),
    "RSHO": (0.0, -0.18, 1.45), "LASI": (0.1, 0.12, 1.0), "RASI": (0.1, -0.12, 1.0), "LPSI": (-0.1, 0.05, 1.02),
    "RPSI": (-0.1, -0.05, 1.02), "LKNE": (0.02, 0.15, 0.5), "RKNE": (0.02, -0.15, 0.5), "LANK": (-0.02, 0.13, 0.08),
    "RANK": (-0.02, -0.13, 0.08), "LHEE": (-0.08, 0.1, 0.04), "RHEE": (-0.08, -0.1, 0.04), "LTOE": (0.15, 0.11, 0.04),
    "RTOE": (0.15, -0.11, 0.04),
}  # fmt: skip
FRAMES = 12


def encode_parameter(group, name, data, kind, dimensions=(), order="<"):
    """The bytes of one C3D parameter; kind -1 text, 1, 2 or 4 bytes a number."""
    body = struct.pack("b", kind) + bytes([len(dimensions), *dimensions]) + data + b"\0"
    return struct.pack("bb", len(name), group) + name.encode() + struct.pack(f"{order}h", len(body) + 2) + body


def encode_vax(values):
    """Single precision numbers as DEC writes them."""
    bits = (np.asarray(values, np.float32) * 4).view(np.uint32)
    return ((bits >> 16) | (bits << 16)).astype("<u4").tobytes()


def build_c3d(positions, labels, scale=-1.0, fps=100.0, processor=84, unit="m", residual=0.0, more=(), analog=0,
              first=1, header=None, groups=(), width=16, split=None):  # fmt: skip
    """A whole C3D file. positions: (T, M, 3) in the file's unit, NaN where not seen. scale: negative for floats. more:
    (group, name, data, kind, dimensions) of other parameters; groups: names of groups 3, 4 ...; header: {byte: value}
    written over the 16-bit words of the header. split: labels from there on stand in LABELS2."""
    order = ">" if processor == 86 else "<"
    floats = encode_vax if processor == 85 else lambda values: np.asarray(values, f"{order}f4").tobytes()
    count, points = len(positions), len(labels)
    section = b""
    for number, name in enumerate(["POINT", "ANALOG", *groups], 1):
        section += struct.pack("bb", len(name), -number) + name.encode() + struct.pack(f"{order}h", 3) + b"\0"
    parts = (labels[:split], labels[split:] if split else ())
    lists = [[label.encode().ljust(width)[:width] for label in part] for part in parts]
    word = lambda value: struct.pack(f"{order}H", value & 0xFFFF)  # noqa: E731
    rows = [
        (1, "USED", word(points), 2, ()), (1, "FRAMES", word(count), 2, ()), (1, "SCALE", floats([scale]), 4, ()),
        (1, "RATE", floats([fps]), 4, ()), (1, "LABELS", b"".join(lists[0]), -1, (width, len(lists[0]))),
        (1, "UNITS", unit.encode(), -1, (len(unit),)), (2, "USED", word(analog), 2, ()),
        (2, "RATE", floats([fps]), 4, ()), *more,
    ]  # fmt: skip
    rows += [(1, "LABELS2", b"".join(lists[1]), -1, (width, len(lists[1])))] if split else []
    start = lambda blocks: (1, "DATA_START", word(2 + blocks), 2, ())  # noqa: E731
    size = len(section) + sum(len(encode_parameter(*row, order)) for row in [*rows, start(0)]) + 6
    blocks = -(-size // 512)
    section += b"".join(encode_parameter(*row, order) for row in [*rows, start(blocks)])
    section = bytes([1, 80, blocks, processor]) + section
    head = struct.pack(f"{order}BBHHHHH", 2, 80, points, analog, first & 0xFFFF, (first + count - 1) & 0xFFFF, 10)
    head += floats([scale]) + struct.pack(f"{order}HH", 2 + blocks, 1) + floats([fps])
    head = bytearray(head.ljust(512, b"\0"))
    for at, value in (header or {}).items():
        head[at : at + 2] = word(value)
    seen = np.isfinite(positions).all(axis=-1)
    fourth = np.where(seen, residual, -1.0)[..., None]
    values = np.concatenate([np.where(seen[..., None], positions, 0) / (1 if scale < 0 else scale), fourth], axis=-1)
    values = np.concatenate([values.reshape(count, -1), np.full((count, analog), 7.0)], axis=1)
    data = floats(values.reshape(-1)) if scale < 0 else np.rint(values).astype(f"{order}i2").tobytes()
    return bytes(head) + section.ljust(blocks * 512, b"\0") + data.ljust(-(-len(data) // 512) * 512, b"\0")


def build_trc_lines(positions, labels, fps=100.0, unit="mm", start=0.0):
    """The lines of a TRC file. positions: (T, M, 3) in the file's unit and axes."""
    count = len(labels)
    head = ["PathFileType\t4\t(X/Y/Z)\tmade.trc", "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
            f"{fps}\t{fps}\t{len(positions)}\t{count}\t{unit}",
            "Frame#\tTime\t" + "\t\t\t".join(labels) + "\t\t",
            "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, count + 1) for axis in "XYZ")]  # fmt: skip
    rows = [f"{i + 1}\t{start + i / fps:.6f}\t" + "\t".join("" if np.isnan(x) else f"{x:.5f}" for x in frame.ravel())
            for i, frame in enumerate(positions)]  # fmt: skip
    return [*head, "", *rows]


@pytest.fixture
def body():
    """labels, positions (12, 17, 3) m, Z up: a body that stands and sways, LKNE not seen in frame 5."""
    positions = np.tile(np.array(list(STANDING.values())), (FRAMES, 1, 1))
    positions += 0.01 * np.sin(np.arange(FRAMES))[:, None, None] + [[[1.0, 2.0, 0.0]]]
    positions[5, list(STANDING).index("LKNE")] = np.nan
    labels = tuple(STANDING)
    return SimpleNamespace(labels=labels, positions=positions, c3d=build_c3d, trc=build_trc_lines, index=labels.index)
